"""Drawings of the parts of screens and their key bars, recorded for many values and widths.

`recorded_drawings.txt` has a section for each subject. Styles follow a row, as their places.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import date
from itertools import product
from pathlib import Path

import pytest
from rich.text import Text
from textual.binding import Binding

from tests.drive.test_whole_values import HELD, OTHER, whole
from tests.recorded import result, sections
from tests.session.test_recorded_texts import ENTRIES, NOON
from tui.bus.errors import LineLost, NotShared, PortBusy, PortMissing, PortRefused
from tui.bus.model import TURNAROUND_EDGES, DeviceCounters
from tui.drive.bit_texts import short_bit
from tui.drive.control_source import source_changes
from tui.screens.command.teaching import fault_of_look, words_to_teach
from tui.screens.connection import choices, wall
from tui.screens.connection.advice import hint_for
from tui.screens.connection.line_list import list_width
from tui.screens.control import view as control
from tui.screens.dialogs.ask import fault_of_new
from tui.screens.dialogs.pick_parameter import pick_lines
from tui.screens.dialogs.question import hint, matches_text
from tui.screens.faults.parts import ago_text, dated_text, labelled
from tui.screens.frames.choice import choice_of
from tui.screens.frames.counters_view import bar_lines, beside, counters_lines, time_text
from tui.screens.frames.frame_list import count_text
from tui.screens.frames.frame_view import gap_text
from tui.screens.keys import table
from tui.screens.keys.first_keys import unknown_text
from tui.screens.keys.pages import key_text
from tui.screens.messages.changes import change_count_text, change_list_lines
from tui.screens.monitor import arrange, assembly, curves, readouts, words
from tui.screens.monitor.screen import fault_of_rating
from tui.screens.trend.view import scale_for, trend_room
from tui.screens.why import WHY_KEYS
from tui.session.changes import ChangeList, LineLoss, LineRun
from tui.session.counters.compare import Bounds, Comparison, DriveCount, TurnaroundBar, differences
from tui.session.counters.watch import CountersNow
from tui.session.record.decoding import HistoryPoint
from tui.session.record.runs import RecordedRun
from tui.session.record.silences import LostLink
from tui.widgets.replay_bar import NO_MOTOR

TEXTS = Path(__file__).parent / "recorded_drawings.txt"
KEYS = (*"abcdefghijklmnopqrstuvwxyzABCSUX!?./<>[]", "space", "f1", "f9", "f12", "ctrl+s", "ctrl+o",
        "ctrl+p", "ctrl+z", "ctrl+backslash", "enter", "escape", "tab", "up", "pageup")  # fmt: skip
NAMES = sorted(table.EVERYWHERE)


def drawn(text: Text) -> str:
    spans = " ".join(f"{span.start}-{span.end}:{span.style}" for span in text.spans)
    return f"{text.plain}|{text.style or ''} {spans}".rstrip()


def gauges() -> Iterator[str]:
    for value, (low, high), width, mark in product(
        (None, 0.0, 1.0, 25.3, 49.9, 80.0, -30.0), ((0, 50), (-50, 50), (10, 10)), (1, 9, 20),
        (None, 20.0),
    ):  # fmt: skip
        yield drawn(readouts.gauge(value, low, high, width, mark))
    for text, width, plain in product(
        ("50.0", "-12.34", "1234567.8", "no number", ""), (4, 12, 22), (False, True)
    ):
        yield from readouts.big(text, width, plain=plain)
    yield from (row for width in (4, 9, 14) for row in readouts.dashes(width))
    for decimals, signed in product(range(3), (False, True)):
        yield f"{readouts.readout_cells(decimals, signed=signed)}"
    for wide in (False, True):
        yield f"{readouts.readout_quantities(whole(), wide=wide)}"
    for cells in (12, 30):
        for line in readouts.framed(
            Text("Output frequency"), Text(" Hz"), [Text("a"), Text("b" * 40)], Text("low"), cells
        ):
            yield drawn(line)


def drives() -> Iterator[str]:
    rows = [
        wall.WallRow(1), wall.WallRow(5, "x", "", "stop failed", "Stop failed", age=400000.0),
        wall.WallRow(2, "Pump", "ATV", "running", "Running", "50.0", "", "4.8", "A", 0.8, 0.4),
        wall.WallRow(
            31, "A very long name of a drive", "ATV312HU22N4", "fault", "Fault", "-0.0", "30.0",
            "12.34", "mA", 1.7, 75, True, ("OCF", "Overcurrent of the motor"), "3 m", "fault",
            ("⣀⣀⣀", "⠉⠉⠉"),
        ),
        wall.WallRow(
            247, "", "ATV71", "stop", "Stopping", "7.5", "", "0.1", "A", 0.0, 4000, False,
            ("alarm", ""), "", "alarm",
        ),
        wall.WallRow(6, kind="unknown"),
    ]  # fmt: skip
    for width, two in product((40, 60, 80, 100, 120, 160, 220), (False, True)):
        columns = wall.columns_for(width, two_rows=two)
        yield f"{width} {two} {columns} {columns.taken}"
        yield drawn(wall.column_heads(columns, 60.0 if two else None))
        for row in rows:
            yield drawn(wall.wall_line(row, columns))
    for shown, scan, width in product((rows, rows[:1]), ((), ("scanning 1-31", "scan")), (30, 80)):
        yield drawn(wall.heading(shown, scan, width))
    yield f"{wall.state_counts(rows)} {wall.aligned(['1', '1.5', '-20.25', ''])}"
    for share, width in product((None, 0.0, 0.33, 0.999, 1.0, 12.0), (7, 16)):
        yield drawn(wall.load_bar(share, width))
        yield drawn(wall.load_cell(share, width))
    yield f"{[wall.spaced_age(age) for age in (None, 0, 0.9, 99, 100, 5999, 6000, 4e5, 9e6)]}"


def keys() -> Iterator[str]:
    for name, width in product(NAMES, (40, 80)):
        yield f"{name} {width}: {table.keys_line(name, width, 'STOP 2')}"
    for stops in ("STOP", table.STOPS_ALL, table.STOPS_NONE, table.STOPS_LIVE, NO_MOTOR):
        yield f"{stops}: {table.keys_line(NAMES[0], 100, stops)}"
    for width, spaces in product((40, 80), (False, True)):
        own = [("Enter", "Run"), ("Esc", "Cancel")]
        yield f"{table.typing_line(width, 'STOP', own, spaces=spaces)}"
        yield f"{table.opening_line(width, 'STOP')}"
    for name in NAMES:
        used = KEYS if name in ("monitor", "faults") else KEYS[:20]
        yield f"{name}: {[text for key in used if (text := table.elsewhere(name, key, key))]}"
        yield f"  {[table.once_closed(name, key, key) for key in ('r', 'x', 's', 'f1', 'ctrl+z')]}"
        bound = [b for b in table.bindings(name) if isinstance(b, Binding)]
        yield f"  {' '.join(f'{b.key}:{b.action}' for b in bound)}"
        yield f"  {' '.join(key for key, shows in table.key_meanings(name).items() if shows)}"
    yield f"{[key_text(key) for key in KEYS]} {unknown_text(b'')} {unknown_text(bytes(range(40)))}"


def rooms() -> Iterator[str]:
    for width, height, count in product((60, 80, 100, 140), (12, 18, 24, 40), (1, 3, 6)):
        yield f"{trend_room(width, height, count, events=count == 3)}"
        for lean in (False, True):
            yield f"{arrange.arrange(width, height, count, lean=lean)}"
    for low, high, before, present in product(
        (None, 0.0, 10.0, -5.0, 48.0), (None, 50.0, 49.9, 0.2), (None, (0.0, 60.0)), (None, 71.0)
    ):
        points = [HistoryPoint(0, 0, low, low, high)]
        yield f"{low} {high} {before} {present}: {scale_for(points, before, present)}"
    profile = whole()
    for wide in (False, True):
        yield f"{[value.parameter for value in assembly.other_values(profile, wide=wide)]}"
    watched = assembly.watched_words(profile)
    yield f"{[p.code for p in watched]} {assembly.codes_beside(profile)}"
    yield f"{[words.bit_columns(width) for width in (20, 40, 60, 80, 120)]}"
    yield f"{[p.code for p in words.shown_words(watched)]}"
    for bit in profile["STAT"].bits:
        yield f"{short_bit(bit, on=True)} {short_bit(bit, on=False)}"
    yield f"{[curves.span_text(seconds) for seconds in (0.5, 6, 60, 90, 600, 7200)]}"
    for cells, barred in product((10, 30, 60), (False, True)):
        yield f"{assembly.value_cells(cells, barred)}"
    yield f"{[list_width(width) for width in (40, 80, 120)]}"


def typed() -> Iterator[str]:
    for text in ("", "x", "0", "-1", "50.0", "50 Hz", "1e9", "a/b", "..", "n" * 300):
        yield f"{text[:20]!r}: {fault_of_look(text)} {fault_of_rating(text)} {fault_of_new(text)}"
        yield f"  {choices.fault_of_line(text)}"
    for text in ("serial:/dev/ttyUSB0", "serial:/dev/ttyUSB0,9600,8N1", "tcp:10.0.0.9", "rtu:h:502",
                 "tcp:", "serial:", "sim:atv71", "sim:gone"):  # fmt: skip
        yield f"{text}: {choices.fault_of_line(text)} {choices.line_in(text, 14)}"
        yield f"  {choices.same_line(text, 'serial:/dev/ttyUSB0,19200,8E1')}"
    yield f"{choices.line_forms()} {choices.simulated_lines()}"
    for text in ("", "3", "errors", "3 errors", "8501", "16#2135", "write", "5-9", "zz", "late 3"):
        yield f"{text!r}: {result(choice_of, text)}"
    for error in (
        PortMissing("/dev/x"), PortBusy("/dev/x"), PortRefused("/dev/x", "denied"),
        LineLost("gone"), NotShared("other"), OSError(13, "denied"), ValueError("x"),
    ):  # fmt: skip
        yield f"{type(error).__name__}: {hint_for(error)}"


def parts() -> Iterator[str]:
    profile = whole()
    for source, raws, width in product(profile.data.control_sources, (HELD, OTHER), (40, 80)):
        found = source_changes(profile, source, raws)
        lines = [
            *control.change_lines(profile, found, width),
            *control.note_lines(source, found, width),
        ]
        for line in (*lines, *control.short_changes(profile, found, width)):
            yield drawn(line)
        yield drawn(control.source_row(source, active=raws is HELD))
    for left in ("", "A motor runs that no program commands. " * 3):
        yield from map(drawn, control.left_lines(left, 60))
    yield from map(drawn, pick_lines(profile.parameters[:9], 50))
    yield drawn(hint(("y", "Reset"), ("Esc", "Cancel")))
    yield drawn(WHY_KEYS)
    for count, visible in ((0, None), (1, 1), (9, 4), (2, None)):
        yield matches_text(count, visible)
    yield f"{[ago_text(seconds) for seconds in (0, 59, 61, 3599, 7300, 90000, 9e6)]}"
    yield f"{[dated_text(wall_time, 1e6) for wall_time in (1e6, 999000.0, 900000.0, 0.0)]}"
    yield from map(drawn, labelled("Cause", [Text("one"), Text("two")]))
    yield f"{[time_text(seconds) for seconds in (0, 59.5, 61, 3700, 90000)]}"
    yield f"{[gap_text(seconds) for seconds in (None, 0.0, 0.0004, 0.0123, 1.5, 75, 4000)]}"
    for count, kept, chosen in ((0, 0, True), (0, 1, True), (3, 9, False)):
        yield count_text(count, kept, filtered=chosen)
    yield from map(
        drawn, bar_lines([TurnaroundBar(5, 3), TurnaroundBar(20, 40), TurnaroundBar(None, 0)], 4)
    )
    yield from map(drawn, beside([Text("a"), Text("b")], [Text("c" * 9)], 30))
    yield f"{words_to_teach(profile, ['FOUT', 'TRP1', 'CHST', 'GONE'])}"


def pages() -> Iterator[str]:
    total = DeviceCounters(
        requests=900,
        replies=880,
        timeouts=9,
        checksum=4,
        exceptions={2: 3},
        turnarounds=tuple(range(len(TURNAROUND_EDGES) + 1)),
    )
    since = replace(total, requests=90, replies=88, timeouts=0, checksum=1)
    first = DriveCount(100, 5, Bounds(50, 50), Bounds(40, 40))
    grown = Comparison(first, first).with_look(DriveCount(130, 7, Bounds(90, 90), Bounds(70, 70)))
    for load, drive, trouble in product(
        (None, 0.0, 0.456), ((), (("this", grown),)), ("", "The drive refuses function 8.")
    ):
        shown = tuple(differences(grown)) if drive else ()
        found = CountersNow(total, since, 65.0, load, load, "keeper", drive, trouble, shown)
        for width, height in ((60, 18), (100, 40)):
            lines = counters_lines(found, "2 Pump", width, height)
            assert not any("…" in line.plain for line in lines[:12])
            yield from map(drawn, lines)
    run = RecordedRun(7, "p", NOON, NOON + 65, 0.5, 0.5, "forward", "30.0 Hz", "", "", "panel (12)")
    found_changes = ChangeList(ENTRIES, [LineRun("rtu:x", run)])
    found_changes.losses.append(LineLoss("rtu:x", LostLink(None, NOON, NOON + 9.6, "gone")))
    for width, day in product((50, 100), (date(2026, 1, 2), date(2026, 2, 2))):
        yield from map(drawn, change_list_lines(found_changes, width, day))
    yield f"{change_count_text(found_changes)} {change_count_text(ChangeList(has_more=True))}"
    yield change_count_text(ChangeList())


SECTIONS = (gauges, drives, keys, rooms, typed, parts, pages)


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_parts_of_screens_are_drawn_as_recorded(section: Callable[[], Iterator[str]]) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
