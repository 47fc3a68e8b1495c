"""The key `.`: a typed address makes a drive the open one, which the stop key stops."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import pytest
from textual.pilot import Pilot

from tui.app import DrivePanelApp
from tui.screens.dialogs.address import AddressField
from tui.screens.keys.table import key_meanings
from tui.screens.monitor.screen import MonitorScreen
from tui.session.connect.identify import DriveIdentity
from tui.session.drive import DriveSession
from tui.session.fleet import FoundDrive

from . import fakes
from .test_flows import shown, until

pytestmark = pytest.mark.long

UNKNOWN = DriveIdentity(9, "", "", "", "", None, ("powerdrive", "proxidrive"))


@dataclass
class Typing:
    """The panel with drives 1, 3, 9 (not identified) and 31; drive 1 is open."""

    app: DrivePanelApp
    pilot: Pilot[None]
    stopped: list[int] = field(default_factory=list)

    async def type(self, *keys: str) -> None:
        await self.pilot.press("full_stop")
        await until(self.pilot, lambda: isinstance(self.app.screen, AddressField))
        await self.pilot.press(*keys)
        await self.pilot.pause()

    async def enter(self) -> None:
        await self.pilot.press("enter")
        await until(self.pilot, lambda: not isinstance(self.app.screen, AddressField))

    @property
    def open(self) -> int:
        assert self.app.chosen is not None
        return self.app.chosen.device


@asynccontextmanager
async def typing(monkeypatch: pytest.MonkeyPatch) -> AsyncIterator[Typing]:
    app = fakes.app_of()
    ready = fakes.snapshot_of(fakes.console_of(None).session.profile, fakes.READY)
    drives = [
        FoundDrive(
            replace(fakes.ATV71, device=device, name=f"PUMP {device}"),
            fakes.console_of(ready, device=device),
        )
        for device in (1, 3, 31)
    ]
    for drive in drives:
        assert drive.console is not None
        drive.console.session.identity = drive.identity
    made = Typing(app, None)  # type: ignore[arg-type]

    def note(_: Any, sessions: list[DriveSession], *__: Any) -> None:
        devices = [session.device for session in sessions]
        made.stopped += devices
        app.call_later(app._void_questions, devices)

    monkeypatch.setattr(app, "_stop_sessions", note)
    async with app.run_test(size=(80, 24)) as pilot:
        made.pilot = pilot
        app.opened, app.fleet = fakes.opened(), fakes.StillFleet(*drives, FoundDrive(UNKNOWN))
        app.connection.look()
        app.connection.drives.focus()
        app.chosen = drives[0].console
        await pilot.pause()
        yield made


async def test_typed_address_selects_a_drive_on_line(monkeypatch: pytest.MonkeyPatch) -> None:
    async with typing(monkeypatch) as made:
        await made.type("3", "1")
        assert "→ 31 PUMP 31" in shown_text(made, "#target")
        assert made.open == 1
        assert "STOP 1" in made.app.stop_target_text
        await made.enter()
        assert made.open == 31
        assert made.app.screen is made.app.connection
        assert made.app.connection.drives.chosen == 31
        assert "Space STOP 31" in shown(made.app, "keys")
        await made.pilot.press("space")
        assert made.stopped == [31]


async def test_message_is_drawn_once_while_a_dialog_is_open(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with typing(monkeypatch) as made:
        made.app.tell("A message of two rows. " * 5)
        await until(made.pilot, lambda: made.app.connection.message_rows == 2)
        await made.type("3")
        made.app.tell("A short one.")
        dialog = made.app.screen
        await until(made.pilot, lambda: "A short one." in shown(made.app, "said"))
        assert isinstance(dialog, AddressField)
        assert dialog.message_rows == 2  # else the first row of the screen below appears again


async def test_typed_address_keeps_the_screen_of_a_drive(monkeypatch: pytest.MonkeyPatch) -> None:
    async with typing(monkeypatch) as made:
        assert made.app.chosen is not None
        made.app.show_monitor(made.app.chosen)
        await made.pilot.pause()
        await made.type("3")
        await made.enter()
        await until(made.pilot, lambda: isinstance(made.app.screen, MonitorScreen))
        assert made.open == 3
        screen = made.app.screen
        assert isinstance(screen, MonitorScreen)
        assert screen.console.device == 3
        assert "Drive 3 PUMP 3 is open: Space stops it." in events_text(made)


@pytest.mark.parametrize(("digits", "why"), [("4", "No drive 4"), ("9", "not identified")])
async def test_address_without_a_drive_opens_nothing(
    monkeypatch: pytest.MonkeyPatch, digits: str, why: str
) -> None:
    async with typing(monkeypatch) as made:
        await made.type(digits, "enter")
        assert why in shown_text(made, "#target")
        assert isinstance(made.app.screen, AddressField)
        assert made.open == 1


async def test_stop_while_an_address_is_typed_stops_the_open_drive(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with typing(monkeypatch) as made:
        await made.type("3", "space")
        await until(made.pilot, lambda: made.app.screen is made.app.connection)
        assert (made.stopped, made.open) == ([1], 1), "what was typed is discarded"


async def test_escape_leaves_the_open_drive(monkeypatch: pytest.MonkeyPatch) -> None:
    async with typing(monkeypatch) as made:
        await made.type("3", "escape")
        await until(made.pilot, lambda: made.app.screen is made.app.connection)
        assert made.open == 1


async def test_without_drives_the_key_says_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    async with typing(monkeypatch) as made:
        made.app.fleet = fakes.StillFleet()
        await made.pilot.press("full_stop")
        await made.pilot.pause()
        assert not isinstance(made.app.screen, AddressField)
        assert "Press s on Line to scan." in events_text(made)


def test_key_waits_for_the_burst_check() -> None:
    """It changes whom Space stops, as `[` and `]` do."""
    meanings = key_meanings("line")
    assert [meanings[key] for key in (".", "[", "]")] == [False] * 3
    assert meanings["1"]


def shown_text(made: Typing, place: str) -> str:
    return str(made.app.screen.query_one(place).render())


def events_text(made: Typing) -> str:
    return " ".join(event.text for event in made.app.events.events)
