"""What the Connection screen says of a drive that answered."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.screens.connection.drive_list import DriveList
from tui.screens.connection.found import about_drive, drive_line, next_step
from tui.session.connect.identify import DriveIdentity
from tui.session.fleet import FoundDrive

from . import fakes
from .test_flows import shown

NAMELESS = DriveIdentity(7, "", "", "", "", None, ("powerdrive", "proxidrive", "varmeca"))


READY = ("ready", "ready")


def found(identity: DriveIdentity, profile: str | None = "atv71", *, guessed: bool) -> FoundDrive:
    console = None if profile is None else fakes.console_of(None, family=profile)
    return FoundDrive(identity, console, guessed)


@given(st.integers(44, 120), st.text("abcABC123 ", max_size=40), st.text("abc ", max_size=16))
def test_a_drive_fills_its_line_and_its_state_stands_at_the_end(
    width: int, name: str, state: str
) -> None:
    drive = FoundDrive(replace(fakes.ATV71, name=name))
    state = state or "ready"
    line = drive_line(drive, (state, "ready"), width)
    assert line.cell_len == width
    assert line.plain.endswith(f" {state}")
    assert "ATV71HU15M3" in line.plain


def test_a_profile_that_is_a_guess_says_so_and_names_the_others() -> None:
    drive = found(NAMELESS, "powerdrive", guessed=True)
    assert "Powerdrive ?" in drive_line(drive, READY, 48).plain
    assert "profile Powerdrive ?" in about_drive(drive)
    assert "proxidrive or varmeca" in next_step(drive)


@pytest.mark.parametrize("width", [48, 80])
def test_a_drive_that_named_itself_has_no_sign(width: int) -> None:
    drive = found(fakes.ATV71, guessed=False)
    assert "?" not in drive_line(drive, READY, width).plain + about_drive(drive)
    assert next_step(drive) == "Enter watches it."


def test_a_drive_without_profile_says_so() -> None:
    assert "no profile" in about_drive(found(NAMELESS, None, guessed=False))


async def test_a_new_state_moves_nothing_in_a_long_list_of_drives() -> None:
    app = fakes.app_of()
    async with app.run_test(size=(80, 24)) as pilot:
        await pilot.pause()
        screen, drives = app.connection, app.connection.query_one(DriveList)
        line_watch, overheated = fakes.FakeLineWatch(), fakes.look_of({**fakes.FAULT, "LFT": 16})
        app.opened = fakes.opened()
        app.fleet = fakes.StillFleet(line_watch=line_watch)
        for device in range(1, 33):
            identity = replace(fakes.ATV71, device=device)
            app.fleet.hold(FoundDrive(identity, fakes.console_of(None, device=device)))
            line_watch.looks[device] = fakes.look_of(fakes.READY)
        screen.show_drives()
        drives.focus()
        drives.highlighted = 31
        await pilot.pause()
        drives.highlighted = 25
        await pilot.pause()
        screen.say("What was said last.", "")
        before = drives.scroll_offset
        assert before.y > 0
        line_watch.looks[5] = line_watch.looks[26] = overheated
        screen.show_drives()
        await pilot.pause()
        assert (drives.scroll_offset, drives.highlighted) == (before, 25)
        assert "What was said last." in shown(app, "message")
        assert str(drives.get_option("26").prompt).endswith("fault OHF")
