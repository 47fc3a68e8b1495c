"""Rows of Line for drives that answered."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from textual.visual import VisualType

from tui.drive.profile import library
from tui.screens.connection.drive_list import DriveList
from tui.screens.connection.rows import about_drive, next_step
from tui.screens.connection.state import QUIET
from tui.screens.connection.wall import (
    DOUBLE_ROWS,
    SINGLE_ROWS,
    WALL_SIGNS,
    WallRow,
    aligned,
    column_heads,
    columns_for,
    heading,
    load_bar,
    wall_line,
)
from tui.session.connect.identify import DriveIdentity
from tui.session.console import DriveConsole
from tui.session.drive import DriveSession
from tui.session.fleet import Fleet, FoundDrive
from tui.session.journal import Journal
from tui.session.monitor.alarms import PresentFault
from tui.widgets.palette import ALARM

from . import fakes
from .test_flows import picture, until

NAMELESS = DriveIdentity(7, "", "", "", "", None, ("powerdrive", "proxidrive", "varmeca"))


def found(identity: DriveIdentity, profile: str | None = "atv71", *, guessed: bool) -> FoundDrive:
    console = None if profile is None else fakes.console_of(None, family=profile)
    if console is not None:
        console.session.guessed = guessed
    return FoundDrive(identity, console)


rows = st.builds(
    WallRow,
    st.integers(1, 247),
    *[st.text("abcABC123 é漢", max_size=40)] * 2,
    st.sampled_from([*WALL_SIGNS, "ready", "stopped"]),
    *[st.text("abcABC123 .", max_size=30)] * 5,
    st.none() | st.floats(0, 3),
    st.none() | st.floats(0, 1e7),
    st.booleans(),
    st.tuples(*[st.text("abc -:", max_size=40)] * 2),
    st.text("abc >", max_size=9),
    st.sampled_from(["", "alarm", "fault"]),
    st.lists(st.text("⠒ ", max_size=50), max_size=2).map(tuple),
)


@given(st.integers(36, 220), st.booleans(), rows, rows)
def test_columns_of_a_row_never_move(
    width: int, two_rows: bool, wall_row: WallRow, other: WallRow
) -> None:
    columns = columns_for(width, two_rows=two_rows)
    lines = [wall_line(row, columns).split("\n") for row in (wall_row, other)]
    assert {len(line.plain) for drawn in lines for line in drawn} == {columns.taken}
    assert {len(drawn) for drawn in lines} == {columns.rows}
    assert columns.taken <= width
    for scale in (None, 60.0, 1200.0):
        assert len(column_heads(columns, scale).plain) == columns.taken


def test_narrow_row_drops_model_then_curve_then_name() -> None:
    kept = [columns_for(width) for width in (119, 79, 51, 36)]
    assert [(bool(columns.model), bool(columns.curve), bool(columns.name)) for columns in kept] == [
        (True, True, True),
        (False, True, True),
        (False, False, True),
        (False, False, False),
    ]


@pytest.mark.parametrize("width", [58, 66, 79, 88, 119, 199])
@pytest.mark.parametrize("two_rows", [True, False])
def test_spare_cells_go_to_long_names_before_the_message(width: int, two_rows: bool) -> None:
    usual = columns_for(width, two_rows=two_rows)
    columns = columns_for(width, two_rows=two_rows, names=["Varmeca 33/34 of the west hall"])
    assert usual.taken <= columns.taken <= width
    layouts = {layout.message for layout in (*SINGLE_ROWS, *DOUBLE_ROWS)}
    assert columns.name == 30 or columns.message in layouts
    assert columns_for(79, two_rows=two_rows).name >= 12
    for name in ("CONVEYOR WEST 12", "CONVEYOR WEST 13"):
        assert name[-2:] in wall_line(WallRow(1, name), columns).plain.split("\n")[0]


@pytest.mark.parametrize("width", [36, 41, 45, 58, 79])
def test_narrow_row_shows_the_whole_fault_code_and_minutes(width: int) -> None:
    row = WallRow(
        1, "PUMP", kind="fault", words="FAULT OPF1", message=("OPF1", ""), brief="12 min",
        message_kind="fault",
    )  # fmt: skip
    text = wall_line(row, columns_for(width)).plain
    assert "OPF1" in text
    assert "…" not in text
    assert "12 min" in text or "12min" in text


def test_two_rows_are_used_only_if_they_fit() -> None:
    assert [columns_for(width, two_rows=True).rows for width in (119, 79, 60)] == [2, 2, 1]


def test_decimal_points_are_below_each_other() -> None:
    texts = aligned(["46.0", "12.50", "7", "", "1380", "-----"])
    assert texts == ["46.0 ", "12.50", "7   ", "", "1380   ", "-----   "]
    points = {f"{text:>9}".find(".") for text in texts[:2]}
    assert len(points) == 1


def test_heading_counts_drives_in_each_state() -> None:
    drives = [
        WallRow(1, kind="fault"),
        WallRow(2, kind="unknown", words="NO ANSWER"),
        WallRow(3, kind="running", words="FORWARD"),
        WallRow(4, kind="running", words="REVERSE"),
        WallRow(5, kind="ready", words="STANDBY"),
    ]
    scan = ["scan done: 5 of 10 addresses", "5 of 10 addresses"]
    text = heading(drives, scan, 80).plain
    assert text.startswith(" 5 drives: 2 running, 1 standby, 1 fault, 1 no answer  ")
    assert text.endswith("  5 of 10 addresses ")
    assert heading(drives, scan, 120).plain.endswith(f"  {scan[0]} ")
    assert heading(drives, [], 30).plain == " 5 drives: 2 running, ...      "[:30]


@pytest.mark.parametrize(("share", "filled"), [(None, 0), (0.0, 0), (0.5, 5), (1.0, 10), (1.5, 10)])
def test_load_bar_ends_at_the_rated_current(share: float | None, filled: int) -> None:
    bar = load_bar(share, 10)
    assert bar.cell_len == 10
    assert abs(bar.plain.count("━") - filled) <= 1
    over = [span for span in bar.spans if span.style == ALARM]
    assert bool(over) is (share is not None and share > 1)


def test_guessed_profile_is_marked_with_its_alternatives() -> None:
    drive = found(NAMELESS, "powerdrive", guessed=True)
    assert "profile Powerdrive ?" in about_drive(drive)
    assert "proxidrive or varmeca" in next_step(drive)


def test_identified_drive_has_no_mark() -> None:
    drive = found(fakes.ATV71, guessed=False)
    assert "?" not in about_drive(drive)
    assert not next_step(drive)


def test_drive_without_a_profile_says_so() -> None:
    assert "no profile" in about_drive(found(NAMELESS, None, guessed=False))


async def test_new_state_moves_nothing_in_a_long_drive_list(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
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
        screen._typed_at = fakes.NOW
        drives.focus()
        drives.highlighted = 31
        await pilot.pause()
        drives.highlighted = 25
        await pilot.pause()
        before = drives.scroll_offset
        assert before.y > 0
        line_watch.looks[5] = line_watch.looks[26] = overheated
        drawn: list[str] = []
        replace_prompt = drives.replace_option_prompt

        def noted(id: str, prompt: VisualType) -> DriveList:
            drawn.append(id)
            return replace_prompt(id, prompt)

        monkeypatch.setattr(drives, "replace_option_prompt", noted)
        screen.show_drives()
        assert drawn == ["5", "26"], "only what changed is drawn"
        await pilot.pause()
        assert (drives.scroll_offset, drives.highlighted) == (before, 25)
        assert "■ FAULT OHF" in str(drives.get_option("26").prompt)
        # a drive in fault keeps its place, too
        app.panel_clock.monotonic = lambda: fakes.NOW + QUIET  # type: ignore[method-assign]
        screen._typed_at = fakes.NOW
        screen.show_drives()
        assert [option.id for option in drives.options][:3] == ["1", "2", "3"]
        assert drives.chosen == 26


async def test_drive_without_a_profile_opens_once_one_is_typed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    app = fakes.app_of()
    opened: list[DriveConsole] = []
    monkeypatch.setattr(app, "show_monitor", opened.append)
    async with app.run_test() as pilot:
        app.opened, app.fleet = fakes.opened(), Fleet(fakes.StillLine(), Journal())
        app.fleet.note(DriveIdentity(9, "", "", "", "", None, ()))
        app.connection.open_drive(9)
        field = app.connection.form._fields["profile"]
        await until(pilot, lambda: app.focused is field)
        await until(pilot, lambda: "Device 9 does not identify itself." in picture(app))
        assert opened == []
        await pilot.press(*"atv71")
        app.connection.open_drive(9)
        await until(pilot, lambda: bool(opened))
        assert [(each.device, each.session.profile.id) for each in opened] == [(9, "atv71")]


# A drive that was found stays stoppable


def taken() -> tuple[Fleet, DriveConsole]:
    """A monitored Altivar 71 on a line."""
    fleet = Fleet(fakes.StillLine(), Journal())
    session = DriveSession(fleet.line, 2, library.load("atv71"), fakes.ATV71)
    return fleet, fleet.take(session)


def test_console_stays_until_another_drive_replaces_it() -> None:
    fleet, console = taken()
    fleet.note(fakes.ATV71)
    assert fleet.consoles == [console]
    fleet.note(replace(fakes.ATV71, reference="ATV99"))  # another drive is there now
    assert fleet.consoles == []


def test_fault_of_a_drive_that_was_replaced_is_not_recorded() -> None:
    fleet, console = taken()
    fault = PresentFault(2, "OCF", "Overcurrent", 1.0)
    fleet._record_fault(fault, "tripped")
    assert [entry.code for entry in fleet.journal._recent] == ["OCF"]
    fleet._record_fault(replace(fault, device=console.device + 1), "tripped")
    assert len(fleet.journal._recent) == 1


def test_drive_commanded_by_the_panel_keeps_its_family() -> None:
    fleet, console = taken()
    other = DriveSession(fleet.line, 2, library.load("atv21"), fakes.ATV71)
    console.session.note_command()
    assert fleet.take(other) is console
    assert fleet.line_watch.under_command() == [console.session]
    event = fleet.events.newest
    assert event is not None
    assert "It runs by a command of this panel: it stays" in event.text
    console.session.commanded_at = None
    assert fleet.take(other).session is other
