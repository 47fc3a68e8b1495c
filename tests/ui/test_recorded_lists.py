"""Trend, the lists of Line, frames and smaller lists, drawn as recorded.

`recorded_lists.txt` is like `recorded_pages.txt`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from itertools import product
from pathlib import Path

import pytest

from tests.recorded import AFTER_A_CHANGE, sections
from tui.bus.api import Contact, DeviceCounters, LastMinute
from tui.bus.link import SerialLink, TcpLink
from tui.bus.program import Program
from tui.drive.blocks.user_words import UserWord
from tui.drive.family_page import page_lines
from tui.drive.profile import library
from tui.screens.bundle import result_lines
from tui.screens.choosing import action_lines
from tui.screens.command.command_keys import option_line
from tui.screens.connection import choices, progress, rows
from tui.screens.connection.advice import Advice, advice_lines
from tui.screens.connection.health_view import health_lines
from tui.screens.connection.line_form import drawn_field, form_lines
from tui.screens.connection.wall import columns_for, wall_line
from tui.screens.connection.wall_curves import CurveCells, WallCurves
from tui.screens.control.map_screen import row_lines, word_lines
from tui.screens.frames.frame_view import frame_line, frames_text, gaps
from tui.screens.keys.finding import find
from tui.screens.keys.help import help_lines
from tui.screens.messages.screen import event_lines
from tui.screens.trend import table
from tui.screens.trend.contents import BandView, TrendView
from tui.screens.trend.event_list import trend_events
from tui.screens.trend.page import TrendPage
from tui.screens.trend.traces import MarkValues, mark_values, value_at
from tui.screens.trend.view import trend_rows
from tui.screens.why import reason_lines
from tui.screens.wiring.screen import section_tops, trouble_sections, wiring_lines
from tui.session.bundle.work import Bundle
from tui.session.communication_map import MapRow
from tui.session.connect.identify import DriveIdentity
from tui.session.connect.search import Search
from tui.session.diagnosis.diagnosis import diagnosed
from tui.session.diagnosis.evidence import DiagnosticEvidence
from tui.session.diagnosis.reply_evidence import ReplyEvidence
from tui.session.events import Event
from tui.session.fleet import FoundDrive
from tui.session.monitor.look import Look
from tui.session.record.schema import EventRow
from tui.widgets.curve import ASCII_SIGNS, BLOCKS, BRAILLE

from . import fakes, test_frame_pictures, test_line_pictures
from . import test_trend_pictures as trends
from .test_recorded_pages import Pages

TEXTS = Path(__file__).with_name("recorded_lists.txt")
WALL = fakes.StillClock().wall()


# -- Trend -----------------------------------------------------------------------------------------


recorded = cache(trends.recorded)


def band(code: str, page: TrendPage, number: int, *, reduced: bool, trouble: str) -> BandView:
    profile = library.load("atv71")
    entry, since = profile.get(code), trends.WALL - page.begins(trends.WALL) + 30
    since = next((span for span in (120.0, 900.0) if span >= since), 3600.0)
    reduced = reduced or since > 900
    points = recorded(code, since, reduced=reduced) if code in trends.LEVELS else []
    reading = None
    if entry is not None and code in fakes.RUNNING:
        age = 14.0 if number == 1 else 0.1
        reading = fakes.readings_of(profile, {code: fakes.RUNNING[code]}, fakes.NOW - age)[code]
        reading = reading.aged(fakes.NOW, 6.0)
    marks = None
    if page.mark_a is not None and page.mark_b is not None:
        marks = mark_values(points, page.mark_a, page.mark_b, 3.0)
    at = None if page.cursor is None else value_at(points, page.cursor, 3.0)
    first = None if page.mark_a is None else value_at(points, page.mark_a, 3.0)
    row = table.TableRow(
        code, trends.UNITS.get(code, ""), number, "50.0" if number else "", page.cursor is not None,
        page.mark_a is not None, at, first, marks, abs((page.mark_b or 0) - (page.mark_a or 0)),
    )  # fmt: skip
    title, name = entry.name if entry else "", code if number else f"2 {code}"
    followed = recorded("FRH", since, reduced=reduced) if code == "RFR" else []
    return BandView(
        name, title, trends.UNITS.get(code, ""), entry, number, points, 3.0,
        (0.0, 1.5 * trends.LEVELS.get(code, 1.0)), reading, trouble, "partly reduced" * reduced,
        row, "FRH" if followed else "", followed,
    )  # fmt: skip


def pages_of_time() -> Iterator[tuple[str, TrendPage]]:
    now, live = trends.WALL, TrendPage()
    yield "live", live
    yield "held", live.hold(now - 7)
    cursor = live.moved(-1, 60, now).moved(-9, 60, now)
    yield "cursor", cursor
    marked = cursor.marked(now)
    yield "mark", marked
    both = marked.moved(-20, 60, now).marked(now)
    yield "marks", both
    yield "no marks", both.marked(now).run()
    yield "turned", both.turned(-1, now)
    yield "later", both.turned(-3, now).turned(1, now).at(now - 5, now)
    for step in (-3, 1, 2, 4, 6, 9):
        yield f"span {step}", (both if step % 2 else live).with_span(step, now)


RECORDED = (
    (5, None, "line", "The line is open again"), (12, 2, "stop", "Space"),
    (12.5, 2, "stop", "Space"), (44, 2, "done", "Run forward"), (300, 2, "fault", "Fault ObF"),
    (90_000, 3, "alarm", "Hot"), (31, 2, "told", "Not shown"), (33, 4, "fault", "Another drive"),
    (8, None, "fault", "Panel"), (21, 2, "refused", "A refusal " * 9),
)  # fmt: skip
"""Events: seconds before the page, drive, kind, text."""


def trend() -> Iterator[str]:
    pages = Pages()
    now = trends.WALL
    past = [
        EventRow(round((now - at) * 1e6), 0, device, kind, text)
        for at, device, kind, text in RECORDED
    ]
    present = [Event(now - 44.5, 2, "done", "Run forward"), Event(now - 1, 2, "failed", "No reply")]
    events = trend_events(past, present, frozenset({2, 3}))
    yield f"{events}"
    sizes = ((60, 12), (80, 20), (100, 30), (120, 36), (200, 56))
    for number, (name, page) in enumerate(pages_of_time()):
        yield f"{name}: {page}"
        for turn, count in enumerate((1, 3, 4), number):
            width, height = sizes[turn % 5]
            codes = [each.code for each in (*trends.FOUR[:3], trends.BANDS[0])][:count]
            bands = [
                band(code, page, n, reduced=number % 3 == 1, trouble="not read" * (n == 2))
                for n, code in enumerate(codes)
            ]
            view = TrendView(
                bands, turn % (count + 2), page, now, fakes.NOW, events if turn % 4 else [],
                turn % len(events) if turn % 3 == 0 and turn % 4 else None,
                (None, now - 50, now - 6000, now - 90_000)[turn % 4], turn % 5 == 0, turn % 7 == 0,
                (BRAILLE, BLOCKS, ASCII_SIGNS)[turn % 3],
            )  # fmt: skip
            yield from pages.page(
                f"{name} {count} {width}x{height}", trend_rows(view, width, height)
            )
            for cells in (table.NARROW - 1, table.NARROW, table.WIDE - 1, table.WIDE):
                shown = [each.row for each in bands]
                lines = table.value_table(shown, cells, present=count > 1)
                yield from pages.page(f"{name} table {cells}", lines)
    yield from pages.page(
        "none", trend_rows(TrendView([], 0, TrendPage(), now, 0, [], None), 80, 20)
    )
    points = recorded("LCR", 3600.0, reduced=True)
    for a, b in (
        (now - 3000, now - 900),
        (now - 30, now - 1),
        (now + 9, now + 10),
        (now - 5, now - 5),
    ):
        found: MarkValues = mark_values(points, a, b, 3.0)
        yield f"{found}"


# -- Line ------------------------------------------------------------------------------------------


def fleet_of_line() -> fakes.StillFleet:
    fleet = test_line_pictures.wall(18)
    looks: dict[int, Look] = fleet.line_watch.looks  # type: ignore[assignment]
    contacts: tuple[Contact, ...] = ("silent", "refused", "damaged", "swapped", "not_polled")
    for device, contact in enumerate(contacts, start=2):
        before = replace(looks[device], time=fakes.NOW - 40 * device) if device < 6 else None
        looks[device] = Look(None, "In vain.", fakes.NOW - 1, None, {}, before, contact)
    del looks[8]
    looks[9] = replace(looks[9], time=fakes.NOW - 10)
    looks[10] = fakes.look_of({**fakes.ALARM, "RFR": 100})
    looks[11] = fakes.look_of(fakes.REVERSE)
    looks[12] = fakes.look_of({**fakes.RUNNING, "RFR": 300, "FRH": 450, "LCR": 0})
    for identity in (
        DriveIdentity(20, "", "", "", "", None, ("powerdrive", "proxidrive")),
        DriveIdentity(21, "Leroy-Somer", "", "0104", "MIXER", None, ()),
    ):
        fleet.hold(FoundDrive(identity))
    guessed = fakes.console_of(None, device=22, family="powerdrive")
    guessed.session.guessed = True
    fleet.hold(
        FoundDrive(DriveIdentity(22, "", "", "", "", None, ("powerdrive", "varmeca")), guessed)
    )
    return fleet


def line_lists() -> Iterator[str]:
    pages, fleet = Pages(), fleet_of_line()
    curves, high = WallCurves().draw(
        [drive.console for drive in fleet.found.values() if drive.console], CurveCells(12, 2),
        now=fakes.NOW, wall=WALL, reach=9.0,
    )  # fmt: skip
    yield f"{high} {rows.drive_names(fleet)}"
    for connected, later in ((True, 0.0), (True, 7.0), (False, 0.0)):
        found = rows.rows_of(
            fleet, fakes.NOW + later, connected=connected, wall=WALL, curves=curves
        )  # fmt: skip
        for row in found.values():
            yield f"{row}"
        for width in (60, 120):
            columns = columns_for(width)
            yield from pages.page(width, [wall_line(row, columns) for row in found.values()])
    for drive in fleet.found.values():
        yield f"{rows.about_drive(drive)} / {rows.next_step(drive)} / {rows.profile_text(drive)}"
    shared = fakes.StillLine()
    others = [Program("2", "serve", 812), Program("3", "watch", 902), Program("4", "watch", 977)]
    shared.facts.set_programs((shared.facts.me, *others))
    shares = {shared.facts.me.id: 0.08, "2": 0.61, "3": 0.09}
    minutes = {2: LastMinute(81, 38, 3, strays=2), 3: LastMinute(1_234_567), 22: LastMinute()}
    for minute in (
        LastMinute(),
        LastMinute(489, 38, 3, 14, 2),
        LastMinute(8, 2),
        LastMinute(99_999),
    ):
        devices = {device: DeviceCounters(minute=own) for device, own in minutes.items()}
        shared.counters = replace(fakes.COUNTED, minute=minute, devices=devices, programs=shares)
        for device, width in product((None, 2, 3, 22), (60, 80, 119, 130)):
            yield from pages.page("health", health_lines(shared.counters, device, width))
    for device, left, width, given in product(
        (None, 2, 20, 22), ("", "Drive 2 runs without a commander."), (60, 100, 180), (None, shared)
    ):
        drive_at = fleet.found[device] if device else None
        yield from pages.page(device, rows.about_lines(drive_at, left, width, given))
    for kind, width in product(("", "error", "alarm"), (40, 70)):
        advice = Advice("The port is in use by mbpoll.", "Press Enter to try again.", kind)
        for more in ({}, {"left": "12 s", "families": "These react: Altivar.", "read_only": True}):
            yield from pages.page(kind, advice_lines(advice, width, **more))  # type: ignore[arg-type]
    yield from searches()
    yield from line_choices(pages)


def line_choices(pages: Pages) -> Iterator[str]:
    ports = [("/dev/ttyUSB0", "USB-RS485 adapter"), ("/dev/ttyS0", "")]
    recent = [
        test_line_pictures.ADAPTER,
        "tcp:10.0.0.9",
        "serial:/dev/ttyS0,9600,8N1",
        "sim: atv71@1",
    ]
    for known, used in product((ports, []), (recent, [])):
        yield f"{choices.groups(known, used)}"
        for group, width in product(choices.groups(known, used), (16, 24, 60)):
            lines = [
                choices.choice_line(choice, width, mark)
                for choice, mark in product(group.choices, choices.LIST_MARKS)
            ]
            yield from pages.page(f"{group.title} {width}", lines)
    fields = [("Serial", [drawn_field("19200"), drawn_field("8E1", off=True)]),
              ("Profile", [drawn_field("", "any family")])]  # fmt: skip
    for width in (14, 24, 40):
        yield from pages.page(width, form_lines(fields, width))


def searches() -> Iterator[str]:
    for requested, cost, ended, again in product(
        (0, 7), (0.0, 0.3, 9.0), ("", "done"), (False, True)
    ):
        search = Search(range(1, 32), now=lambda: fakes.NOW)
        search.requested = search.at = requested
        search.cost, search.ended, search.again = cost, ended, again
        search.answered = frozenset(range(1, 1 + requested))
        yield f"{search.text} {progress.left_text(search, 5.0)} {progress.scan_forms(search, 0.0)}"
        yield f"{[progress.far_text(search, 40.0, room) for room in (60, 24, 12)]}"
    yield f"{progress.left_text(None, 1.0)} {progress.scan_forms(None, 1.0)}"


# -- Frames and smaller lists ----------------------------------------------------------------------


def small_lists() -> Iterator[str]:
    pages, frames = Pages(), test_frame_pictures.log()[:12]
    between, words = gaps(frames), ["", "Read 1 word at 3201 (ETA)", "w" * 90]
    for number, width in product(range(len(frames)), (60, 110, 150)):
        text = words[number % 3]
        shown = [
            frame_line(
                frames[number], WALL + number, between[number], width, text, found=number == 3
            )
        ]
        yield from pages.page(width, shown)
    yield frames_text(frames, [0, 2, 5], ["a", "b\tc", "d"], WALL - fakes.NOW, ["line", "heading"])
    for query, screen in product(
        ("", "arm", "par back", "s", "zz", "coast", "stop"), ("monitor", "line")
    ):
        actions = find(query, screen)
        for item in actions:
            yield f"{item.action.id} {item.screen} {item.here} {item.score} {item.ready}"
        for width in (50, 100):
            yield from pages.page(query, action_lines(actions, width))
    for screen, width, replay in product(("monitor", "line", "trend"), (54, 70), (False, True)):
        yield from pages.page(f"{screen} {width}", list(help_lines(screen, width, replay=replay)))
    for kind, width in product(("failed", "told", "stop", "done", "fault"), (40, 100)):
        for device in (None, 2):
            event = Event(WALL, device, kind, "A message of several words. " * 4)
            yield from pages.page(kind, event_lines(event, width))


def dialogs() -> Iterator[str]:
    pages = Pages()
    yield from diagnoses(pages)
    bundle = Bundle(b"x" * 2048, ("README.txt", "a.json"), {"scan.json": "no line"}, {"name": 3})
    for made, width in product((bundle, replace(bundle, missing={}, omitted={})), (40, 76)):
        yield from pages.page(width, list(result_lines(made, Path("b.zip"), width)))
    rows_of_map = [
        MapRow("ETA", "not known"), MapRow("CMD", "16#000F", "switched on, enabled, run " * 4),
        MapRow("A long head of a row", "text", "detail"), MapRow("LFR", "50.0 Hz", ""),
        MapRow("X", "a text above its cells", "y"),
    ]  # fmt: skip
    chosen = [
        (UserWord(3202), "Output frequency", "50.0 Hz"), (UserWord(), "", ""),
        (UserWord(3204, "signed"), "Motor current with a long name of a value", "-8.4 A"),
    ]  # fmt: skip
    for width in (60, 80, 120):
        yield from pages.page(
            width, [part for row in rows_of_map for part in row_lines(row, width)]
        )
        yield from pages.page(width, word_lines(chosen, width))
    for listing in library.listings():
        charts = library.load(listing.id).data.charts
        for option in (option for chart in charts for option in chart.options):
            for raw, choice in product((None, 0, 0xFFFF), option.choices):
                raws = {} if raw is None else {option.parameter: raw}
                line = option_line(option, choice.bits, choice.name, raws)
                yield from pages.page(listing.id, [line])


def diagnoses(pages: Pages) -> Iterator[str]:
    links: tuple[SerialLink | TcpLink, ...] = (SerialLink("/dev/ttyUSB0"), TcpLink("10.0.0.9"))
    for link, (requested, answered) in product(links, ((9, 0), (9, 9), (9, 5))):
        heard = ReplyEvidence(requested=requested, answered=answered)
        found = diagnosed(DiagnosticEvidence(link, 2, heard=heard))
        for width in (40, 70):
            yield from pages.page(width, list(reason_lines(found, width)))
            parts = trouble_sections(found, WALL)
            page = page_lines(parts, width)
            yield from pages.page(section_tops(page), wiring_lines(page))
    yield from pages.page("none", list(reason_lines(None, 40)))
    yield f"{trouble_sections(None, WALL)}"


SECTIONS: tuple[Callable[[], Iterator[str]], ...] = (trend, line_lists, small_lists, dialogs)


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_lists_of_screens_are_drawn_as_recorded(section: Callable[[], Iterator[str]]) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__], AFTER_A_CHANGE
