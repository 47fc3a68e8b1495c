"""The strip and the tabs: each part at its place, whatever the values, the width and the drive."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import Any, cast

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.cells import cell_len

from tests.drive.test_fault_reset import BY_TERMINALS
from tui.bus.api import LineState, LineStatus
from tui.drive.fault_reset import not_in_command
from tui.drive.profile import library
from tui.screens.frame import TABS, message_lines
from tui.screens.frame_source import FrameSource
from tui.screens.keys.action import MONITOR
from tui.screens.keys.table import TABBED
from tui.session.command.commander import STILL_IN_FAULT
from tui.widgets.drawing import cut_at_word
from tui.widgets.palette import ATTENTION, CURSOR, FAULT, FAULT_BLOCK
from tui.widgets.replay_bar import ReplayView, replay_line
from tui.widgets.strip import BarMessage, DriveNow, StripView, strip_line, tabs_line

RUNS = DriveNow(
    device=2,
    name="MACHINE 4",
    model="ATV71HU15M3",
    kind="running",
    words="FORWARD",
    frequency="30.0",
    reference="40.0",
    current="3.2",
    armed=56.4,
    family="ATV71",
)
VIEW = StripView(drive=RUNS, faults=1, unseen=True, load=0.4, clock="14:02:11")


def test_status_bar_fits_80_columns() -> None:
    line = strip_line(VIEW, 80)
    assert line.cell_len == 80
    assert (
        line.plain
        == " 2 MACHINE 4·ATV71 ▶ FORWARD      30.0 →  40.0 Hz   3.2 A        ■1  ARMED 56 s "
    )


@pytest.mark.parametrize("width", [80, 85, 86, 100, 120, 200])
@pytest.mark.parametrize("name", ["", "MACHINE 4", "CONVEYOR WEST 12", "é" * 40])
def test_the_model_is_shown_from_80_columns_beside_any_name(width: int, name: str) -> None:
    line = strip_line(VIEW._replace(drive=RUNS._replace(name=name)), width).plain
    assert "ATV71" in line.split("▶")[0]
    assert not name or name[:3] in line


def test_the_model_is_whole_if_there_is_room() -> None:
    assert "MACHINE 4 · ATV71HU15M3 " in strip_line(VIEW, 120).plain
    assert " 2 ATV71HU15M3 " in strip_line(VIEW._replace(drive=RUNS._replace(name="")), 80).plain
    long = VIEW._replace(drive=RUNS._replace(name="CONVEYOR WEST 12"))
    assert strip_line(long, 80).plain.startswith(" 2 CONVEY…12·ATV71 ▶")


@pytest.mark.parametrize("width", [60, 72, 80, 120])
def test_names_that_differ_in_their_number_do_so_in_the_status_bar(width: int) -> None:
    for name in ("MACHINE", "CONVEYOR WEST"):
        drives = (RUNS._replace(name=f"{name} {number}") for number in (4, 5, 14))
        heads = {
            strip_line(VIEW._replace(drive=drive), width).plain.split("▶")[0] for drive in drives
        }
        assert len(heads) == 3


def test_viewing_a_fault_moves_nothing() -> None:
    view = VIEW._replace(drive=RUNS._replace(armed=None))
    lines = [strip_line(view._replace(unseen=unseen), 80).plain for unseen in (True, False)]
    assert lines[0] == lines[1]


def test_old_message_over_a_dialog_uses_the_rows_that_are_reserved() -> None:
    message = BarMessage("14:02:11", "one two three four " * 5, "told", 90.0)
    assert len(message_lines(message, 60)) == 1
    lines = message_lines(message, 60, rows=3)
    assert " ".join(line.plain[10:] for line in lines).split() == message.text.split()


def cells_before(text: str, part: str) -> int:
    return cell_len(text[: text.rindex(part)])


@given(
    words=st.sampled_from(["FORWARD", "FAULT ObF", "STANDBY", "NOT READY", "STOPPING", "reading"]),
    frequency=st.sampled_from(["0.0", "-40.0", "599.0", "-----", ""]),
    current=st.sampled_from(["0.0", "120.4", "-----"]),
    name=st.text(max_size=30),
    armed=st.sampled_from([None, 0.2, 59.0]),
    by=st.sampled_from(["", "Terminals", "panel pts/12", "analog input AI1 of the drive"]),
    faults=st.integers(0, 31),
    width=st.sampled_from([60, 72, 80, 100, 120, 200]),
)
def test_value_changes_move_nothing(
    words: str,
    frequency: str,
    current: str,
    name: str,
    armed: float | None,
    by: str,
    faults: int,
    width: int,
) -> None:
    plain = strip_line(StripView(drive=RUNS), width).plain
    drive = RUNS._replace(words=words, frequency=frequency, current=current, name=name, armed=armed)
    drive = drive._replace(by=by)
    other = strip_line(StripView(drive=drive, faults=faults), width)
    assert other.cell_len == width
    if width >= 80 and faults < 10:
        assert cells_before(other.plain, "▶") == cells_before(plain, "▶")
        assert cells_before(other.plain, " A ") == cells_before(plain, " A ")


POOR = ("line 91 % good", "line 91 %", "91 %", "")
FOREIGN = ("foreign frames", "foreign", "")


@pytest.mark.parametrize(
    ("drive", "faults", "shown"),
    [
        (RUNS._replace(armed=None), 0, "▲ line 91 % good "),
        (RUNS._replace(armed=None), 1, "▲ 91 %  ■ 1 fault  "),
        (RUNS, 0, "▲ 91 %  ARMED 56 s "),
        (RUNS, 1, "▲ ■1  ARMED 56 s "),
        (RUNS._replace(armed=None, by="Terminals"), 0, "▲ 91 % by Terminals "),
        (None, 0, "▲ line 91 % 14:02:11 "),
        (None, 1, " ■ 1 fault  ▲ line 91 % 14:02:11 "),
    ],
)
def test_line_trouble_uses_the_space_left_by_faults_and_arming(
    drive: DriveNow | None, faults: int, shown: str
) -> None:
    view = VIEW._replace(drive=drive, faults=faults, trouble=POOR)
    line = strip_line(view, 80)
    assert line.plain.endswith(shown)
    assert line.cell_len == 80
    assert strip_line(VIEW._replace(drive=None, trouble=POOR), 120).plain.endswith(
        "▲ line 91 % good  ■ 1 fault  load  40 %  14:02:11 "
    )


@pytest.mark.parametrize("drive", [None, RUNS, RUNS._replace(armed=None)])
@pytest.mark.parametrize("trouble", [POOR, FOREIGN])
@pytest.mark.parametrize("width", [60, 72, 80, 120])
def test_line_trouble_moves_nothing_else(
    drive: DriveNow | None, trouble: tuple[str, ...], width: int
) -> None:
    view = VIEW._replace(drive=drive, line="pump", faults=1 if drive is None else 0)
    plain = strip_line(view, width).plain
    marked = strip_line(view._replace(trouble=trouble), width).plain
    for part in ("14:02:11", "■ 1 fault") if drive is None else ("ARM", "▶", " A "):
        if part in plain:
            assert marked.rindex(part) == plain.rindex(part)


def test_silent_drive_is_shown_with_its_age() -> None:
    line = strip_line(VIEW._replace(drive=RUNS._replace(age=12.0)), 80).plain
    assert "? 12s ago" in line
    assert "FORWARD" not in line


def test_acknowledged_fault_is_not_highlighted() -> None:
    def style_of(unseen: bool) -> object:
        line = strip_line(VIEW._replace(unseen=unseen), 80)
        at = line.plain.index("■")
        return next(span.style for span in line.spans if span.start <= at < span.end)

    assert style_of(unseen=True) == FAULT_BLOCK
    assert style_of(unseen=False) == FAULT


def test_other_commander_of_the_drive_is_shown() -> None:
    for by in ("Terminals", "panel pts/12"):
        drive = RUNS._replace(armed=None, by=by)
        assert f"by {by}" in strip_line(StripView(drive=drive), 80).plain


def test_status_bar_without_a_drive_shows_the_line() -> None:
    view = StripView(line="/dev/ttyUSB0 19200 8E1 · 31 drives", faults=2, load=0.74, clock="14:02")
    line = strip_line(view, 80).plain
    assert "31 drives" in line
    assert "■ 2 faults" in line
    assert "load  74 %" in line


def test_long_line_name_hides_no_note_about_the_line() -> None:
    path = "/dev/serial/by-id/usb-FTDI_FT232R_USB_UART_A50285BI-if00-port0 19200 8E1"
    view = StripView(line=f"{path} · only listened to", load=0.74, clock="14:02:11")
    reported = strip_line(view, 80).plain
    assert reported.startswith(" Drive Panel · …BI-if00-port0 19200 8E1 · only listened to ")
    assert len(reported) == 80
    short = StripView(line="/dev/ttyUSB0 19200 8E1 · only listened to", clock="14:02:11")
    assert " · /dev/ttyUSB0 19200 8E1 · only listened to " in strip_line(short, 80).plain


@pytest.mark.parametrize("width", [60, 72, 79, 80, 120])
@pytest.mark.parametrize("chosen", [tab.name for tab in TABBED])
def test_every_tab_has_its_key_and_fits(width: int, chosen: str) -> None:
    marks = {"parameters": ("●", ATTENTION), "faults": ("■", FAULT), "line": ("■", FAULT)}
    line = tabs_line(TABS, chosen, marks, width)
    assert line.cell_len <= width
    assert [tab.key for tab in TABS] == [tab.digit for tab in TABBED]
    for tab in TABS:
        assert f"{tab.key}{marks.get(tab.place, (' ',))[0]}{tab.name[0]}" in line.plain
    assert any(span.style == CURSOR for span in line.spans)


def test_marks_move_no_tab() -> None:
    bare = tabs_line(TABS, MONITOR, {}, 80).plain
    marked = tabs_line(TABS, MONITOR, {"parameters": ("●", ATTENTION)}, 80).plain
    assert marked == bare.replace("3 Parameters", "3●Parameters")


@pytest.mark.parametrize(("width", "gap"), [(60, 2), (80, 1), (120, 4), (200, 4)])
def test_tabs_are_evenly_spaced(width: int, gap: int) -> None:
    line = tabs_line(TABS, MONITOR, {}, width).plain
    assert re.findall(r"(?<=\w)( +)(?=\d)", line) == [" " * gap] * (len(TABS) - 1)


@pytest.mark.parametrize("kind", ["refused", "done"])
def test_message_is_complete_at_first_and_one_line_later(kind: str) -> None:
    text = "Not sent: 80.0 Hz is above the high speed HSP, 60.0 Hz. Raise HSP on Parameters first."
    new = message_lines(BarMessage("14:02:11", text, kind, 1.0), 80)
    later = message_lines(BarMessage("14:02:11", text, kind, 60.0), 80)
    assert " ".join(" ".join(line.plain for line in new).split()).endswith(text)
    assert len(later) == 1
    assert "…" in later[0].plain
    assert "m messages" in later[0].plain


@pytest.mark.parametrize("width", [60, 80])
@pytest.mark.parametrize("family", BY_TERMINALS)
def test_failed_reset_is_shown_completely(family: str, width: int) -> None:
    for why in (not_in_command(library.load(family), BY_TERMINALS[family]), STILL_IN_FAULT):
        text = f"Fault reset: {why}"
        lines = message_lines(BarMessage("14:02:11", text, "done", 1.0), width)
        assert text in " ".join(" ".join(line.plain for line in lines).split())
        assert all(line.cell_len <= width for line in lines)


@given(st.text(max_size=200), st.integers(1, 120))
def test_text_is_cut_at_a_word(text: str, width: int) -> None:
    assert len(cut_at_word(text, width)) <= max(width, 1)


@pytest.mark.parametrize("width", [60, 72, 80, 120])
@pytest.mark.parametrize("faults", [0, 3])
def test_unwritable_journal_is_shown_and_moves_nothing(width: int, faults: int) -> None:
    before = strip_line(StripView(drive=RUNS), width).plain
    line = strip_line(StripView(drive=RUNS, faults=faults, off_record=True), width)
    assert line.cell_len == width
    assert ("NO JOURNAL" if width >= 72 else "J!") in line.plain
    assert re.search("ARM(ED)? 56", line.plain)
    for part in ("▶", " A "):
        assert cells_before(line.plain, part) == cells_before(before, part)
    assert "NO JOURNAL" in strip_line(StripView(line="sim:atv71", off_record=True), width).plain
    assert "JOURNAL" not in before


@pytest.mark.parametrize(
    ("status", "reason", "next_try", "text"),
    [
        (LineStatus.CONNECTED, "", None, ""),
        (LineStatus.CLOSED, "", None, ""),
        (LineStatus.CONNECTING, "", None, "CONNECTING for 12 s."),
        (LineStatus.CONNECTING, "Waiting.", None, "CONNECTING for 12 s. Waiting."),
        (LineStatus.LOST, "Unplugged.", None, "LINE LOST for 12 s: Unplugged."),
        (LineStatus.LOST, "Gone.", 103.0, "LINE LOST for 12 s: Gone. Retrying in 3 s."),
        (LineStatus.LOST, "Gone.", 99.0, "LINE LOST for 12 s: Gone. Retrying in 0 s."),
    ],
)
def test_line_that_cannot_be_used_is_named_with_its_time(
    status: LineStatus, reason: str, next_try: float | None, text: str
) -> None:
    state = LineState(status, reason, 88.0, next_try)
    opened = cast(Any, SimpleNamespace(line=SimpleNamespace(state=state)))
    source = cast(Any, SimpleNamespace(_app=SimpleNamespace(opened=opened)))
    assert FrameSource._line_trouble(source, 100.0) == text
    source._app.opened = None
    assert FrameSource._line_trouble(source, 100.0) == ""
    assert FrameSource._line_trouble(source, 100.0, opened) == text


@pytest.mark.parametrize("width", [60, 80, 120])
def test_row_of_a_replay_cuts_the_name_and_never_the_state(width: int) -> None:
    state = "was read 12 s before" if width > 60 else "FORWARD"
    view = ReplayView(
        0.0,
        60.0,
        30.0,
        1.0,
        playing=False,
        drive=f"12 ATV71HD15N4 was {state.removeprefix('was ')}",
    )
    text = replay_line(view, width).plain
    assert "  12" in text
    assert len(text) == width
    assert f"{state} " in text
    assert text.endswith("nothing is sent ")
