"""The frame around screens, and what screens decide without drawing it, as recorded.

`recorded_parts.txt` has a section for each subject.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.recorded import AFTER_A_CHANGE, result, sections, short
from tui.bus.api import LineCounters
from tui.bus.line import Frame
from tui.drive.profile import library
from tui.screens.frame import message_lines, not_stopped_lines, with_drive
from tui.screens.frame_source import FrameSource
from tui.screens.frames.choice import choice_of, chosen, decoded, exchanges, went_wrong
from tui.screens.monitor.time_cursor import TimeCursor
from tui.screens.parameters import edit_value, parameter_list, set_keys, write_keys
from tui.screens.parameters.stage_keys import limit_of_edit
from tui.screens.state_words import stands_by, state_cell, value_cell
from tui.screens.trend.loading import first_bands
from tui.screens.trend.traces import BandTrace, compacted, reference_code
from tui.session.command.stop_report import Phase, StopReport
from tui.session.events import Event, EventLog
from tui.session.fleet import FoundDrive
from tui.session.monitor.alarms import LineAlarms
from tui.session.monitor.trend_bands import TrendBand
from tui.session.record.decoding import HistoryPoint
from tui.session.record.history import History
from tui.session.work import Outcome, OutcomeKind
from tui.widgets.strip import BarMessage
from tui.wire.frames import sealed

from . import fakes, test_command_pictures, test_parameter_pictures
from .test_monitor_pictures import WATCH
from .test_recorded_lists import fleet_of_line
from .test_recorded_pages import Pages

TEXTS = Path(__file__).with_name("recorded_parts.txt")
ATV71 = library.load("atv71")


# -- The frame -------------------------------------------------------------------------------------


def panel_of(raws: Mapping[str, int], **changes: Any) -> Any:
    """Return a panel, with the parts of it that the frame reads."""
    line = changes.pop("line", fakes.CONNECTED)
    snapshot = fakes.snapshot_of(
        ATV71, raws, line, age=changes.pop("age", 0.1), error=changes.pop("error", "")
    )
    console = fakes.console_of(snapshot, line, armed=changes.pop("armed", None))
    console.session.work.outcome = changes.pop("outcome", None)
    fleet = fakes.StillFleet(FoundDrive(fakes.ATV71, console), line=line)
    fleet.alarms = LineAlarms(EventLog(), lambda *_: None)
    both = {2: snapshot.state, 3: snapshot.state}
    fleet.alarms.take(both, fakes.FakeLineWatch(seen=both).onsets.by_device)
    warnings = changes.pop("warnings", [])
    fleet.line_watch.warnings = lambda: warnings  # type: ignore[method-assign]
    report = changes.pop("report", None)
    fleet.stopper = test_command_pictures.FakeStopper({2: report} if report else {})  # type: ignore[assignment]
    events = EventLog(lambda: test_parameter_pictures.WALL)
    for event in changes.pop("events", ()):
        events.add(*event)
    opened = fakes.opened(line)
    panel_line = SimpleNamespace(opened=opened, fleet=fleet)
    clock = fakes.StillClock()
    return SimpleNamespace(**{
        "fleet": fleet, "fleets": [fleet], "live_fleets": [fleet], "clock": clock,
        "panel_clock": clock, "chosen": console, "panel_lines": [panel_line], "opened": opened,
        "unreached": ("", 0.0), "read_only": False, "journal_trouble": "", "replay": None,
        "place": "monitor", "line_label": "/dev/ttyUSB0 19200 8E1", "hearing": "",
        "events": events, "key_hint": (None, "", ""), **changes,
    })  # fmt: skip


def stop_of(phase: Phase, since: float = 1.0) -> StopReport:
    text = "NOT STOPPED: Device 2 did not answer."
    return StopReport(2, phase, text, fakes.NOW - since, fakes.NOW - since)


WORKING = Outcome(OutcomeKind.WORKING, "Writing 3 parameters", fakes.NOW - 2)
DONE = Outcome(OutcomeKind.DONE, "Stopped", fakes.NOW - 0.1)
EVENTS = [
    ("told", "Armed for 60 s.", None),
    ("refused", "Not written.", 2),
    ("told", "Press a.", 2),
]
FRAMES: list[tuple[Mapping[str, int], dict[str, Any]]] = [
    (fakes.RUNNING, {}), (fakes.REVERSE, {"armed": 31.0}), (fakes.FAULT, {"armed": float("inf")}),
    (fakes.READY, {"age": 9.0}), (fakes.READY, {"error": "Device 2 did not answer."}),
    (test_command_pictures.REMOTE, {}), (fakes.RUNNING, {"line": fakes.LOST}),
    (fakes.RUNNING, {"line": fakes.CONNECTING}), (fakes.RUNNING, {"outcome": WORKING}),
    *((fakes.RUNNING, {"report": stop_of(phase)}) for phase in Phase),
    (fakes.RUNNING, {"report": stop_of(Phase.FAILED, 61.0)}),
    (fakes.RUNNING, {"report": stop_of(Phase.FAILED), "outcome": DONE}),
    (fakes.RUNNING, {"report": stop_of(Phase.FAILED), "events": [
        ("failed", "NOT STOPPED: Device 2 did not answer.", 2)]}),
    (fakes.RUNNING, {"unreached": ("NOT STOPPED: drive 5.", fakes.NOW - 59.0)}),
    (fakes.RUNNING, {"unreached": ("NOT STOPPED: drive 5.", fakes.NOW - 61.0)}),
    *((fakes.RUNNING, {"warnings": [
        SimpleNamespace(device=2, watch=watch, silent=6.25, left=left),
        SimpleNamespace(device=5, watch=watch, silent=1.0, left=9.0),
    ]}) for watch, left in ((WATCH, 3.75), (replace(WATCH, reaction=None), 0.0))),
    (fakes.READY, {"read_only": True, "journal_trouble": "disk full"}),
    *((fakes.READY, {"events": EVENTS[:count], "place": place})
      for count, place in ((1, "monitor"), (2, "line"), (3, "line"))),
    (fakes.READY, {"chosen": None, "events": EVENTS[1:2]}), (fakes.READY, {"fleet": None}),
    (fakes.READY, {"line_label": "", "hearing": "/dev/ttyS0"}), (fakes.READY, {"line_label": ""}),
]  # fmt: skip


def frame() -> Iterator[str]:
    pages = Pages()
    for number, (raws, changes) in enumerate(FRAMES):
        view = FrameSource(panel_of(raws, **dict(changes))).view()
        yield f"{number}: {view.strip}"
        message = view.message and (view.message.when, view.message.text, view.message.kind)
        yield f"  {message} {view.message and view.message.there} {view.marks} {view.not_stopped}"
    yield from later_frames()
    texts = [f"NOT STOPPED, drive {number}: it did not answer." for number in range(1, 9)]
    for count, width in product((0, 1, 6, 8), (40, 80)):
        yield from pages.page(count, not_stopped_lines(texts[:count], width))
    long = "The drive refused HSP with exception 4, not written. Stop the motor and write again. "
    for text, kind, age, there in product(
        ("Armed.", long * 2, f"NOT STOPPED: {long}"), ("fault", "refused", "working", "next"),
        (0.0, 15.0), (False, True),
    ):  # fmt: skip
        shown = BarMessage("14:02:11", text, kind, age, there)
        for width, lead, rows in ((59, True, 1), (72, True, 2), (80, False, 1), (71, True, 1)):
            yield from pages.page(kind, message_lines(shown, width, lead=lead, rows=rows))
    yield f"{message_lines(None, 80)}"
    for device, text in product((None, 2), ("Armed.", "NOT STOPPED: no answer")):
        yield with_drive(Event(0.0, device, "told", text))


def later_frames() -> Iterator[str]:
    """Load, and replies that stay where they were shown."""
    app = panel_of(fakes.READY, events=EVENTS[:1])
    source = FrameSource(app)
    for place, seconds, busy in (
        ("monitor", 0.0, 31.0), ("monitor", 1.9, 32.0), ("line", 2.0, 32.5), ("monitor", 5.0, 33.0),
        ("line", 8.0, 2.0), ("line", 11.0, 99.0),
    ):  # fmt: skip
        app.place = place
        app.clock = SimpleNamespace(
            monotonic=lambda at=seconds: fakes.NOW + at, time_of_day=lambda: "14:02:11"
        )
        app.opened.line.counters = LineCounters(busy_seconds=busy)
        view = source.view()
        yield f"{place} {seconds}: {view.strip.load} {view.message and view.message.text}"
    app.key_hint = app.events.newest, "monitor", "Press r."
    app.place = "monitor"
    for text in ("", "Wrote 3."):
        if text:
            app.events.add("done", text, 7)
        message = source.view().message
        yield f"{message and (message.text, message.there, message.when)}"


def states() -> Iterator[str]:
    fleet = fleet_of_line()
    for raws in (
        fakes.RUNNING, fakes.READY, fakes.FAULT, fakes.ALARM, test_command_pictures.REMOTE,
        {**fakes.RUNNING, "RFR": 0, "FRH": 0}, {**fakes.READY, "ETA": 0x0221},
    ):  # fmt: skip
        snapshot = fakes.snapshot_of(ATV71, raws)
        session = fakes.console_of(snapshot).session
        for report in (None, *map(stop_of, Phase)):
            found = state_cell(session, snapshot.state, report, fakes.NOW, snapshot.readings)
            yield f"{found} {stands_by(session, snapshot.state)}"
        quantities = ("output_frequency", "motor_current", "torque", "speed_reference")
        yield f"{[value_cell(session, snapshot.readings, each) for each in quantities]}"
    session = next(drive.session for drive in fleet.found.values() if drive.session)
    yield f"{state_cell(session, None, None, fakes.NOW, {})}"


# -- Parameters ------------------------------------------------------------------------------------


def lists_of_parameters() -> Iterator[str]:
    console = test_parameter_pictures.editor_of(fakes.READY, armed=52.0)
    editor = console.editor
    assert editor is not None
    test_parameter_pictures.staged(editor)
    listed = parameter_list.ParameterList()

    def now(name: object) -> str:
        shown = [item.code or f"{item.group}{item.text}"[:9] for item in listed.window(4)]
        return f"{name}: {listed.code} {listed.place}/{listed.count} {listed.top} {shown}"

    for search in ("", "acc", "frequency ramp", "zzz", ""):
        listed.fill(editor, search)
        yield f"{now(search)} {listed.shown_as(editor)}"
        for lines in (1, 2, -1, 9, -99, 99):
            listed.move(lines)
            yield now(lines)
    for step in (1,) * 12 + (-1,) * 3:
        listed.choose_next(editor.facts, step)
        listed.fill(editor, "")
        yield f"{now(step)} {listed.chosen} {parameter_list.shows_steps(listed)}"
        for to in (1, -1):
            listed.end(to)
            yield now(to)
            listed.move_to(-5 * to, -to)  # beyond the last row, which may be a heading
            yield now(to)
    for step in (1,) * 14 + (-1,) * 4:
        listed.group(editor, step)
        listed.fill(editor, "")
        yield f"{now(step)} {listed.chosen}"
    for code, given in product(
        ("ACC", "HSP", "TFR", "STT", "FRY"), ("5.03", "9999", "x", 1, 70000)
    ):
        yield f"{code} {given}: {result(limit_of_edit, editor, code, given)}"
    for code in ("ACC", "HSP", "STT", "LAC", "CMD", "ETA", "AI1T", "TTO"):
        parameter = editor.session.profile[code]
        yield f"{code}: {edit_value.about_number(editor, parameter)!r}"
        firsts = [edit_value.first_raw(editor, code, raw) for raw in (None, 7)]
        yield f"  {firsts} {type(edit_value.dialog_for(editor, parameter)()).__name__}"
    yield from written_texts()


def written_texts() -> Iterator[str]:
    for count in (0, 1, 5):
        yield set_keys.staged_text(count, "a.toml")
        yield set_keys.difference_text("a", count, 2, 0)
        yield set_keys.difference_text("a", count, 0, count)
        yield write_keys.unsaved_text([f"P{number:02}" for number in range(count * 3)])
    for state in ("rest", "results"):
        console = test_parameter_pictures.editor_of(fakes.RUNNING, armed=52.0)
        editor = console.editor
        assert editor is not None
        test_parameter_pictures.STATES[state][0](editor)
        applied = editor.applied
        assert applied is not None
        yield write_keys.results_head(applied)
        table = write_keys.results_table(applied)
        yield f"{[list(column.cells) for column in table.columns]}"
        yield write_keys.write_text(editor, list(editor.staging.edits))


# -- Trend and frames ------------------------------------------------------------------------------


def traces() -> Iterator[str]:
    snapshot = fakes.snapshot_of(ATV71, fakes.RUNNING)
    console = fakes.console_of(snapshot)
    points = [HistoryPoint(at, at + 0.1, at % 7, at % 7 + 1, at % 7 + 2) for at in range(0, 900, 3)]
    for code, own in product(("RFR", "LCR", "XYZ"), (console, None)):
        trace = BandTrace(TrendBand(2, code), own)
        trace.take(History(points[:4], "Hz" if own else "", troubles=("the clock was set",)))
        reading = [trace.reading(fakes.NOW + later) for later in (0.0, 9.0)]
        yield f"{short(trace.entry)} {short(reading)} {trace.trouble} {trace.unit} {trace.loaded}"
        yield f"  {trace.troubles} {len(trace.points)} {reference_code(ATV71, trace.entry)}"
        since_times: list[float] = []

        def live_points(
            _: str, since: float, since_times: list[float] = since_times
        ) -> list[HistoryPoint]:
            since_times.append(since)
            return points[10:40]

        trace.live = SimpleNamespace(points=live_points, close=lambda: None)  # type: ignore[assignment]
        trace.unit = ""
        trace.reference = BandTrace(TrendBand(2, "FRH"), own, trace.live, list(points[:9]))
        trace.add_live(60.0, 60.0)
        yield f"  {since_times} {trace.unit} {[point.time for point in trace.points]}"
        trace.points = points * 9
        trace.add_live(0.0, 900.0)
        yield f"  {len(trace.points)} {trace.points[:2]} {len(trace.reference.points)}"
        trace.close()
        yield f"  {trace.live}"
    bad = fakes.console_of(fakes.snapshot_of(ATV71, fakes.RUNNING, error="No answer."))
    yield f"{BandTrace(TrendBand(2, 'RFR'), bad).trouble} {first_bands(console)}"
    yield f"{compacted([*points[:40], *points[200:]], 0.0, 900.0)[:3]}"
    cursor = TimeCursor().opened(fakes.NOW, 500.0)
    for columns in (-1, -9, 3, 99, -200, 1):
        cursor = cursor.moved(columns, 60, fakes.NOW - 90, fakes.NOW)
        yield f"{cursor} {cursor.with_span(9).step} {cursor.closed()}"


WORDS = (
    ("out", "02 03 0C81 0002"), ("in", "02 03 04 0637 0000"), ("out", "02 03 0C81 0009"),
    ("in", "02 83 02"), ("out", "02 06 2329 0032"), ("in", "02 06 2329 0032"),
    ("out", "02 10 2329 0002 04 0032 0033"), ("in", "02 10 2329 0002"),
    ("out", "05 17 0C81 0002 2135 0001 02 000F"), ("in", "05 17 04 0637 0000"),
    ("out", "02 17 0C81 0002 2135 0001 02 000F"), ("in", "02 17 04 0637 0000"),
    ("out", "02 01 0000 000A"), ("in", "02 01 02 FF03"), ("in", "03 01 02 FF03"),
    ("out", "02 02 0005 0001"), ("in", "02 02 01 01"), ("out", "02 05 0003 FF00"),
    ("in", "02 05 0003 FF00"), ("out", "02 0F 0003 000A 02 FF01"), ("in", "02 0F 0003 000A"),
    ("out", "02 04 0C81 0001"), ("in", "02 04 02 0001"), ("in", "02 03 02 0001"),
    ("out", "00 06 2135 0000"), ("out", "02 2B 0E 01 00"), ("in", "02 AB 01"), ("in", "02 2B 0E"),
    ("out", "02 63 00"), ("in", "02 E3 01"), ("out", "02 08 0000 1234"), ("in", "02 03 02 06"),
    ("out", "02 03 0C"), ("out", "02 03 0C81 0001"), ("out", "07 03 0001 0001"), ("in", "FF"),
    ("out", "02 03 0C81 0001"),
)  # fmt: skip
"""Frames without their checksums."""


def frame_words() -> Iterator[str]:
    made = [
        Frame(float(at), way, sealed(bytes.fromhex(text)), "noise" if at == 7 else "")  # type: ignore[arg-type]
        for at, (way, text) in enumerate(WORDS)
    ]

    def words_of(frames: Any, *, guesses: tuple[str, ...] = ()) -> list[str]:
        profiles = {2: ATV71, 3: ATV71}
        return decoded(frames, profiles.get, lambda _: {"INR": 1}, lambda _: guesses, tcp=False)

    for (way, text), first, second in zip(
        WORDS, words_of(made), words_of(made, guesses=("ETA",)), strict=True
    ):
        yield f"{way} {text}: {first}{'' if first == second else f' / {second}'}"
    yield f"{exchanges(made)} {exchanges(made[1:3])}"
    for places in exchanges(made):
        group = [made[at] for at in places]
        yield f"{places} {[went_wrong(group, tcp=False, last=last) for last in (False, True)]}"
    for text in (
        "",
        "2",
        "5 7",
        "error",
        "2 error",
        "read",
        "f16",
        "write 2",
        "eta",
        "06 37",
        "f99",
    ):
        yield f"{text}: {chosen(made, choice_of(text), words_of, tcp=False)}"
    tcp = [Frame(0.0, "out", b"\0\1\0\0\0\6" + made[0].data[:6]), Frame(0.1, "in", b"\0")]
    yield f"{decoded(tcp, {2: ATV71}.get, lambda _: {}, tcp=True)}"


SECTIONS: tuple[Callable[[], Iterator[str]], ...] = (
    frame, states, lists_of_parameters, traces, frame_words
)  # fmt: skip


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_parts_behind_screens_give_the_recorded_results(
    section: Callable[[], Iterator[str]],
) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__], AFTER_A_CHANGE
