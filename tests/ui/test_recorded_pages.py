"""Whole pages of screens, drawn without a terminal in many states and sizes, as recorded.

`recorded_pages.txt` has a section for each screen. A page has a checksum of its rows with their
styles, and below it those rows that no page before it has.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from decimal import Decimal
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from zlib import crc32

import pytest
from rich.text import Text

from tests.recorded import AFTER_A_CHANGE, sections
from tui.drive.control_source import source_changes
from tui.drive.profile import library
from tui.screens.blocks import view as blocks
from tui.screens.command.control import Control, Hindrance, hindrance
from tui.screens.control import screen as control_screen
from tui.screens.control import switch_view
from tui.screens.control import view as control
from tui.screens.faults.doctor import doctor_lines
from tui.screens.faults.doctor_view import DoctorView
from tui.screens.faults.view import history_rows, record_lines, stored_lines
from tui.screens.monitor.arrange import arrange
from tui.screens.monitor.assembly import monitor_parts, other_values, tables, watched_words
from tui.screens.monitor.run_line import RunLine, proposed, run_lines
from tui.screens.monitor.screen import ViewSource, works_now
from tui.screens.monitor.time_cursor import TimeCursor
from tui.screens.monitor.view import View
from tui.screens.parameters import detail_view, parameter_list, table_view
from tui.session.blocks.proposals import monitoring_stretches
from tui.session.events import EventLog
from tui.session.fleet import FoundDrive
from tui.session.monitor.alarms import LineAlarms, PresentFault
from tui.session.monitor.watched import SeenTrip, Watched
from tui.session.timeout_report import TimeoutWatch
from tui.widgets.palette import STRONG

from . import (
    fakes,
    test_block_pictures,
    test_command_pictures,
    test_monitor_pictures,
    test_parameter_pictures,
)
from .test_control_view import FULL, MovedClock, paths_of

TEXTS = Path(__file__).with_name("recorded_pages.txt")
SIZES = ((60, 16), (80, 24), (100, 30), (120, 40), (200, 60))
WALL = fakes.StillClock().wall()


def styled(text: Text) -> str:
    spans = " ".join(f"{span.start}-{span.end}:{span.style}" for span in text.spans)
    return f"{text.plain}|{text.style or ''} {spans}"


class Pages:
    """Pages as text, each row of them once."""

    def __init__(self) -> None:
        self._seen = set[str]()

    def page(self, name: object, lines: Sequence[Text]) -> Iterator[str]:
        """A checksum of the rows, and those of them that are new."""
        yield f"> {name} {crc32(chr(10).join(map(styled, lines)).encode()):08x}"
        rows = dict.fromkeys(line.plain.rstrip() for line in lines)
        yield from (row for row in rows if row not in self._seen)
        self._seen.update(rows)


# -- Monitor ---------------------------------------------------------------------------------------


def monitored(scene: test_monitor_pictures.Scene, cursor: TimeCursor, word: int | None) -> View:
    """The contents of Monitor in a scene."""
    profile, snapshot = library.load(scene.family), None
    if scene.raws is not None:
        snapshot = fakes.snapshot_of(
            profile, scene.raws, scene.line, age=scene.age, error=scene.error, block=scene.block
        )
    console = fakes.console_of(snapshot, scene.line, family=scene.family, armed=scene.armed)
    cast("fakes.StillLine", console.session.line)._heard = fakes.NOW - scene.heard
    watch = fakes.FakeLineWatch(scene.watch)
    drive = FoundDrive(replace(fakes.ATV71, profile=scene.family), console)
    fleet = fakes.StillFleet(drive, line_watch=watch, line=scene.line)
    fleet.alarms = LineAlarms(EventLog(), lambda *_: None)
    fleet.stopper = cast(
        "Any", test_command_pictures.FakeStopper({2: scene.stop} if scene.stop else {})
    )
    if snapshot is not None:
        watch.seen[2] = snapshot.state
        fleet.alarms.take(dict(watch.seen), watch.onsets.by_device)
    app: Any = SimpleNamespace(
        clock=fakes.StillClock(), fleet=fleet, read_only=scene.read_only, plain_signs=False,
        has_braille=True, has_colors=True, low_bandwidth=scene.low_bandwidth, replay=None,
    )  # fmt: skip
    held = hindrance(profile, console.session.image.raws)
    control_now = Control(armed_for=scene.armed, hindrance=held)
    return ViewSource(app, console).view(control_now, word, cursor)


CURSORS = [
    TimeCursor().with_span(step).opened(fakes.NOW - back, WALL - fakes.NOW)
    for step, back in ((0, 0.2), (0, 43.0), (-1, 18.0), (-2, 3.0), (1, 51.0), (3, 30.0))
]
TROUBLES = (
    Control(offer="Drive 2 runs by a command of run (4711), which has exited. Press T or Space."),
    Control(lost="The drive no longer holds CMD."), Control(why_disarmed="No key for 60 s."),
    Control(armed_for=9.0, hindrance=Hindrance("The terminals command it.", "Press 6.", True)),
    Control(barred="The profile does not match the drive."),
)  # fmt: skip


def on_monitor(pages: Pages, name: object, view: View, size: tuple[int, int]) -> Iterator[str]:
    third = size[0] >= 120 and not view.lean
    count = len(other_values(view.profile, wide=third))
    room, words = arrange(*size, count, lean=view.lean), watched_words(view.profile)
    parts = monitor_parts(view, room, words)
    rows = " ".join(str(len(lines)) for lines in parts.values())
    lines = [line for part in parts.values() for line in part]
    yield from pages.page(f"{name} {size}: {rows}", lines)


def monitor() -> Iterator[str]:
    pages = Pages()
    for name, scene in test_monitor_pictures.SCENES.items():
        view = monitored(scene, TimeCursor(), None)
        for size in SIZES[: 3 if name in ("running", "fault", "raw", "percent") else 2]:
            yield from on_monitor(pages, name, view, size)
        keys = ("reset", "run_line('forward')", "run_line('reference')", "arm")
        yield f"{name}: {[works_now(view, key) for key in keys]} {view.time_left} {view.age}"
    scenes = test_monitor_pictures.SCENES
    running = monitored(scenes["running"], TimeCursor(), None)
    for number, (cursor, of) in enumerate(product(CURSORS, ("running", "raw", "reverse"))):
        view = monitored(scenes[of], cursor, None)
        yield from on_monitor(pages, f"cursor {number} {of}", view, SIZES[number % 5])
    for step, plain in product((-2, 1, 2, 3), (False, True)):
        view = replace(running, step=TimeCursor().with_span(step).step, plain=plain)
        yield from on_monitor(pages, f"span {step} {plain}", view, SIZES[3])
    for name, size in product(("running", "alarm", "raw", "percent", "not-heard"), SIZES):
        view = monitored(scenes[name], TimeCursor(), 0)
        room = arrange(*size, len(other_values(view.profile, wide=size[0] >= 120)))
        for word in range(len(tables(view.profile, room, watched_words(view.profile)))):
            yield from on_monitor(pages, f"{name} table {word}", replace(view, word=word), size)
    for number, given in enumerate(TROUBLES):
        ready = monitored(scenes["standby"], TimeCursor(), None)
        yield from on_monitor(pages, number, replace(ready, control=given), SIZES[number % 2])
    for changes in (
        {"lean": True}, {"plain": True}, {"braille": False}, {"colored": False},
        {"replayed": True}, {"heard": None}, {"period": 0.1}, {"now": fakes.NOW + 2.4},
        {"watch": TimeoutWatch(3.0, None)}, {"now": fakes.NOW + 9.0, "was": "Running forward"},
        {"stands_by": True}, {"fault_at": "tripped 14:02:11"}, {"trend": ()},
    ):  # fmt: skip
        for name in ("running", "fault", "standby"):
            view = monitored(scenes[name], TimeCursor(), None)
            yield from on_monitor(pages, f"{changes} {name}", replace(view, **changes), SIZES[1])


def run_line() -> Iterator[str]:
    pages = Pages()
    held = {**fakes.RUNNING, "HSP": 500, "LSP": 50, "ACC": 30, "DEC": 45, "INR": 1, "TFR": 600,
            "FRS": 500, "LFR": 300, "LFRD": 900}  # fmt: skip
    for family in ("atv71", "atv21", "powerdrive"):
        profile = library.load(family)
        raws = held if family == "atv71" else {}
        readings = fakes.readings_of(profile, raws, fakes.NOW)
        for wanted in ("", "45.0 Hz", "9 rpm"):
            yield f"{family} {wanted}: {proposed(profile, wanted, raws)}"
        for purpose, typed, output in product(
            ("forward", "reverse", "reference"), ("", "0", "30.0", "80"), (None, "-20", "40", "0")
        ):
            unit = proposed(profile, "", raws)[1]
            line = RunLine(purpose, typed, unit, fakes.NOW + 0.1, 1)  # type: ignore[arg-type]
            now = fakes.NOW + (1 if output else 0)
            turning = None if output is None else Decimal(output)
            for shown, width in ((line, 60), (line.checked(profile, readings), 110)):
                why = "The terminals command it. Press Esc, then 6." if typed == "80" else ""
                lines = run_lines(shown, profile, readings, now, width, why, turning)
                yield from pages.page(f"{family} {purpose} {typed} {output} {width}", lines)
        line = RunLine("forward", "30.0", unit, 0.0, 1)
        for keys in ("5", "a", ".", "1.2.3", "123456789"):
            taken: RunLine | None = line
            for key in keys:
                taken = taken and taken.typed(key)
            yield f"{keys}: {taken} {taken and taken.erased()} {line.erased()}"
        if unit:
            for key, high in product(("up", "down", "pageup", "pagedown"), (None, Decimal(31))):
                yield f"{key} {line.stepped(key, Decimal(28), high)}"


# -- Control, Parameters, Blocks -------------------------------------------------------------------


class QuestionNotShown:
    """A question that is not shown."""

    texts: Sequence[object] = ()

    def __call__(self, *given: object) -> None:
        """Keep its texts."""
        self.texts = given[:4]


def control_pages() -> Iterator[str]:
    pages = Pages()
    for (case, (family, raws)), width in product(FULL.items(), (60, 80, 120)):
        paths = paths_of(family, raws, MovedClock())
        lines = switch_view.drawing(paths, "40.0" if width > 60 else "", STRONG, width)
        lines += [*switch_view.written_paths(paths, width), *switch_view.hints(paths, width)]
        yield from pages.page(f"{case} {width}", lines)
    for family in ("atv71", "atv21", "atv312", "powerdrive"):
        console = fakes.console_of(None, family=family)
        profile, session = console.session.profile, console.session
        sources = profile.data.control_sources
        rules = profile.data.communication_fault
        reactions = rules.reactions if rules else ()
        watches = [None, *(TimeoutWatch(2.5, reaction) for reaction in [None, *reactions])]
        for watch, whole in product(watches, (False, True)):
            lines = control_screen.timeout_lines(session, watch, "as set", 70, whole=whole)
            lines += control_screen.timeout_lines(session, watch, "", 60, whole=whole)
            seconds = watch and watch.timeout
            yield from pages.page(f"{family} {seconds} {whole}", lines)
        yield from pages.page(family, control_screen.warning_lines(session, 60))
        snapshots = [None, *(
            fakes.snapshot_of(profile, raws, error=error)
            for raws, error in ((fakes.RUNNING, ""), (test_command_pictures.REMOTE, "gone"))
            if family == "atv71"
        )]  # fmt: skip
        for snapshot, source, whole in product(snapshots, [None, *sources[:2]], (False, True)):
            trouble = "" if whole else "reading the configuration failed"
            switches = ["Input LI5 switches the command to the terminals."] if whole else []
            found = control.now_lines(
                profile, source, snapshot, trouble, switches, 60, whole=whole
            )  # fmt: skip
            yield from pages.page(f"{family} {whole}", [line for part in found for line in part])
        for watch, turning in ((None, False), (watches[-1], True)):
            ask = QuestionNotShown()
            control_screen.ask_to_test(
                ask, session, watch, turning=turning, work=lambda **_: None
            )  # fmt: skip
            yield f"{ask.texts}"
        yield f"{[source_changes(profile, source, {}) for source in sources[:1]]}"


def parameters() -> Iterator[str]:
    pages = Pages()
    states = ("settings", "staged", "refused", "elsewhere", "done", "compared", "written",
              "locked", "results")  # fmt: skip
    for state in states:
        prepare, drive, armed, _ = test_parameter_pictures.STATES[state]
        console = test_parameter_pictures.editor_of(drive, armed=armed)
        editor = console.editor
        assert editor is not None
        prepare(editor)
        test_parameter_pictures.TEXTS_SHOWN.clear()
        everywhere = [p.code for p in console.session.profile.parameters][::9]
        changed = [edit.code for edit in editor.staging.edits]
        codes = list(dict.fromkeys([*changed, "ACC", "DEC", "HSP", "TTO", "ADD", "SPAT", "ETA"]))
        listed = parameter_list.ParameterList()
        listed.fill(editor, "")
        for width in (38, 60, 92, 150):
            several = everywhere if state == "settings" else codes
            items = table_view.items_of(editor, several, headings=width > 60)
            layout = table_view.layout_of(editor, items, width)
            lines = [table_view.head_line(layout.columns, editor.other_label or "Factory")]
            lines += [
                table_view.row_line(editor, item, layout, width, chosen=item.code == "ACC")
                for item in items
            ]
            lines.append(detail_view.status_line(editor, f"{state} 3 of 9", width + 20))
            yield from pages.page(f"{state} {width} {layout.columns}", lines)
        for code in everywhere if state == "settings" else codes:
            for width, height in ((60, detail_view.SHORT), (110, detail_view.TALL)):
                step = parameter_list.step_help(console.session.profile, code)
                lines = detail_view.parameter_lines(editor, code, width, height, step)
                yield from pages.page(f"{state} {code} {width}", lines)
        entries = listed.entries(editor.facts)
        for entry, room in zip(entries, (4, 9, 16, 40) * len(entries), strict=False):
            lines = parameter_list.group_lines(entries, entry.choice, 22, room)
            yield from pages.page(f"{state} {entry.label} {room}", lines)
    for listing in library.listings():
        yield f"{parameter_list.start_up_items(library.load(listing.id))}"


def block_pages() -> Iterator[str]:
    pages = Pages()
    for name, (make, prepare, _, _) in test_block_pictures.STATES.items():
        if name not in ("scanner", "proposed", "wrong", "differs", "indirect", "reading",
                        "neighbors"):  # fmt: skip
            continue
        editor = make()
        prepare(editor)
        for width, block in product((38, 54, 80, 120), editor.proposals.blocks):
            for at in (None, *range(len(block.slots))) if width in (38, 80) else (0,):
                lines = blocks.table_lines(editor, block, width, at, double=width > 100)
                lines += blocks.slot_lines(editor, block, at or 0, width)
                yield from pages.page(f"{name} {block.id} {width} {at}", lines)
            lines = blocks.cost_lines(editor, block, editor.proposals.saving(), width)
            lines += blocks.cost_lines(editor, block, None, width)
            lines += blocks.user_word_lines(editor, editor.words, width)
            yield from pages.page(f"{name} {block.id} {width}", lines)
        for width, room in ((60, 5), (110, 40)):
            found = monitoring_stretches(editor.session)
            yield from pages.page(name, blocks.stretch_lines(editor, found, width, room))
            yield from pages.page(name, blocks.stretch_lines(editor, [], width, room))


# -- Faults ----------------------------------------------------------------------------------------


def doctor_views() -> Iterator[tuple[str, DoctorView]]:
    atv71 = library.load("atv71")
    read = {"BRA": 1, "VCAL": 4, "ULP0": 2280, "DEC": 30, "INR": 1, "ETI": 4, "LFT": 18,
            **fakes.STORED, "DP0": 18, "DP1": 5, "DP2": 0, "DP3": 99}  # fmt: skip
    readings = fakes.readings_of(atv71, {**fakes.FAULT, **read}, fakes.NOW)
    usual = DoctorView(
        atv71, atv71.fault(18), True, test_command_pictures.trip(), readings, fakes.NOW, wall=WALL
    )
    yield "trip", usual
    since = PresentFault(2, "ObF", "Overbraking", WALL - 75, tripped=True)
    for at in (0, 3, 7, 12, 14, 40):
        yield f"at {at}", replace(usual, cursor=at, since=since, armed=at > 3)
    yield "seen", replace(usual, record=None, since=replace(since, tripped=False))
    yield "unseen", replace(usual, record=None, unread=True, barred="The line is read-only.")
    yield "old", replace(usual, present=False, now=fakes.NOW + 70, place=1, wall=WALL + 90_000)
    yield "changed", replace(usual, changed=frozenset({"DEC"}), monitored=readings, raws=read)
    for raw in (1, 3, 9, 20, 22):
        yield f"fault {raw}", replace(usual, fault=atv71.fault(raw), record=None, armed=True)
    external = next(fault for fault in atv71.data.faults.codes if fault.code == "EPF1")
    inputs = {"ETF": 132, "LET": 1, "IL1R": 0x000C, "EPL": 1}
    seen = fakes.readings_of(atv71, inputs, fakes.NOW - 3)
    yield "inputs", replace(usual, fault=external, record=None, readings=seen)
    yield "no number", replace(usual, fault=None, record=None)
    alarms = [("LRS6", 8, "Undervoltage alarm"), ("LRS6", 11, "Drive thermal alarm")]
    yield "alarm", replace(usual, fault=None, record=None, present=False, alarms=alarms)
    calm = replace(usual, fault=None, record=None, present=False)
    yield "quiet", calm
    trip = SeenTrip(WALL - 700, "ObF Overbraking", True, WALL - 600)
    points = test_command_pictures.trip().points
    for number, watched in enumerate((
        Watched(None), Watched(fakes.NOW - 20, points, trip, True),
        Watched(fakes.NOW - 20, points, journal_read=True),
        Watched(fakes.NOW - 20, (), replace(trip, fault="", tripped=False, reset=None)),
    )):  # fmt: skip
        yield f"watched {number}", replace(calm, watched=watched)
    for family in ("atv21", "atv312", "powerdrive"):
        profile = library.load(family)
        fault = next(iter(profile.data.faults.codes[3:]), None)
        yield family, DoctorView(profile, fault, True, None, {}, fakes.NOW, wall=WALL)


def faults() -> Iterator[str]:
    pages = Pages()
    for name, view in doctor_views():
        for size in ((60, 11), (80, 19), (80, 40), (120, 35), (200, 55)):
            yield from pages.page(f"{name} {size}", doctor_lines(view, *size))
        yield f"{name}: {view.rows} {view.stored_place} {view.advice}"
        if name in ("trip", "at 14", "at 40", "quiet", "atv21"):
            for width, height in ((60, 9), (90, 3), (130, 12)):
                yield from pages.page(f"{name} {width}", history_rows(view, width, height))
    record, atv71 = test_command_pictures.trip(), library.load("atv71")
    readings = fakes.readings_of(atv71, fakes.STORED, fakes.NOW)
    for width, height, offset in ((60, 9, 0), (80, 20, 4), (120, 30, 0)):
        yield from pages.page(width, record_lines(record, width, height, offset))
        for codes in ((), ["RFP0", "EP0", "THP0", "GONE"]):
            yield from pages.page(codes, stored_lines(atv71, codes, readings, width))
    bare = replace(record, writes=())
    yield from pages.page("no writes", record_lines(bare, 80, 9, 0))
    yield from pages.page("none", record_lines(None, 80, 9, 0))


SECTIONS: tuple[Callable[[], Iterator[str]], ...] = (
    monitor, run_line, control_pages, parameters, block_pages, faults
)  # fmt: skip


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_pages_of_screens_are_drawn_as_recorded(section: Callable[[], Iterator[str]]) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__], AFTER_A_CHANGE
