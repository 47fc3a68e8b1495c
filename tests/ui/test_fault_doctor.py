"""The Faults screen: causes, live values, checks, conditions of a reset, alarms."""

from __future__ import annotations

import re
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from tests.ui.fakes import NOW, readings_of
from tui.drive.hints import reset_text
from tui.drive.profile import library
from tui.drive.sentences import capitalized
from tui.screens.faults.doctor import EXCLUDED, LIKELIEST, OPEN, TOO_FEW, UNDECIDED, doctor_lines
from tui.screens.faults.doctor_view import DoctorView
from tui.screens.faults.next_steps import ARM, BESIDE_KEY, open_row
from tui.screens.faults.parts import LABEL
from tui.screens.faults.screen import FaultsScreen
from tui.screens.faults.view import history_rows, record_lines
from tui.session.drive import DriveSession
from tui.session.journal import Entry
from tui.session.monitor.fault_record import FaultRecord, Moment
from tui.session.monitor.trend import TrendPoint
from tui.session.monitor.watched import SeenTrip, Watched
from tui.widgets.curve import ASCII_SIGNS, BRAILLE, CurveSigns

from .test_frame import panel

ATV71 = library.load("atv71")
BRAKING = {"BRA": 1, "VCAL": 4, "ULP0": 2280, "DEC": 30}


def view(raw: int | None, **more: object) -> DoctorView:
    fault = ATV71.fault(raw) if raw is not None else None
    made = DoctorView(profile=ATV71, fault=fault, present=True, record=None, readings={}, now=0.0)
    return replace(made, **more)  # type: ignore[arg-type]


def reported(shown: DoctorView, width: int = 80, height: int = 20) -> str:
    return "\n".join(line.plain.rstrip() for line in doctor_lines(shown, width, height))


def sections(text: str) -> dict[str, list[str]]:
    """Rows of a page by the heading or name of their part."""
    found: dict[str, list[str]] = {}
    name = ""
    for row in text.splitlines():
        first = row.strip().partition(" ")[0]
        if first in ("Why", "Values", "Next", "Check", "Enter", "x", "Before", "Tab", "History"):
            name = first
        found.setdefault(name, []).append(row)
    return found


def reset_shown(text: str) -> str:
    """Text of the reset on a page."""
    rows = sections(text)["x"]
    return " ".join(" ".join(rows).split()).removeprefix("x ")


@pytest.mark.parametrize("family", ["atv21", "atv31", "atv312", "atv71"])
def test_every_fault_fits_80_columns(family: str) -> None:
    profile = library.load(family)
    for fault in profile.data.faults.codes:
        help_ = profile.guide.fault(fault.raw)
        if help_ is None:
            continue
        shown = view(None, profile=profile, fault=fault)
        text = reported(shown, 80, 50)
        for part in (
            *help_.probable,
            *help_.check,
            *(capitalized(look.why) for look in help_.look_at),
        ):
            assert part in text, (fault.code, part)
        assert "…" not in text.partition("Why")[2], fault.code
        lines = [line.plain for line in doctor_lines(shown, 80, 50)]
        assert all(len(line) <= 80 for line in lines)
        starts = {line.index(UNDECIDED) for line in lines if UNDECIDED in line}
        assert len(starts) <= 1, (fault.code, "reasons are below each other")


@pytest.mark.parametrize("width", [60, 80, 120, 200])
def test_values_before_the_trip_are_whole(width: int) -> None:
    state = "Decelerating"
    moments = tuple(Moment(0.0, -0.5 * n, "", ("40.0", "3.2", state)) for n in range(3))
    record = FaultRecord(NOW, 0.0, None, (), ("RFR Hz", "LCR A", "HMIS"), moments, ())
    lines = [line.plain for line in record_lines(record, width, 20, 0)]
    assert [line.count(state) for line in lines[2:]] == [1, 1, 1]
    assert {len(line) for line in lines[1:]} == {len(lines[1])}
    assert len(lines[1]) <= width


@pytest.mark.parametrize("width", [60, 80, 120, 200])
@pytest.mark.parametrize("height", [3, 8, 12, 20, 36, 56])
def test_page_fits_its_place_and_keeps_the_likeliest_cause(width: int, height: int) -> None:
    read = readings_of(ATV71, {**BRAKING, "INR": 1, "ETI": 4}, NOW)
    for cursor in (None, 0, 4, 9, 12):
        shown = view(18, readings=read, now=NOW, cursor=cursor)
        lines = doctor_lines(shown, width, height)
        assert len(lines) <= height
        assert all(line.cell_len <= width for line in lines)
        if height >= 12:
            text = "\n".join(line.plain for line in lines)
            assert f"{LIKELIEST} The braking is too sudden for the inertia" in text
            assert "A reset works now" in text
        if height >= 12 and cursor is not None and cursor < len(shown.rows):
            assert f"\n  {shown.rows[cursor].code} " in text


def test_fault_without_a_number_is_named_before_its_causes() -> None:
    profile = library.load("powerdrive")
    (help_,) = profile.guide.data.faults
    first, second = sections(reported(view(None, profile=profile, present=True), 120))["Why"][1:3]
    assert first.strip() == help_.name
    assert help_.probable[0] in second


def test_general_practice_is_marked() -> None:
    assert "general practice" in sections(reported(view(1)))["Why"][0]
    guide = sections(reported(view(18), 80, 30))
    assert "public guide" in guide["Why"][0]
    assert guide["Check"][0].endswith("(practice)")
    assert guide["x"][-1].endswith("(practice)")


def test_drive_reports_if_a_reset_is_possible() -> None:
    for raw, output in ((0x0004, "A reset works now"), (0, "Not yet: the drive reports")):
        text = reset_shown(reported(view(9, readings=readings_of(ATV71, {"ETI": raw}, NOW))))
        assert output in text
        assert "practice" not in text
    old = {
        code: reading.aged(NOW + 60, 6.0)
        for code, reading in readings_of(ATV71, {"ETI": 4}, NOW).items()
    }
    assert "a reset has no effect" in reset_shown(reported(view(9, readings=old)))


def test_next_key_says_what_a_reset_needs() -> None:
    read = readings_of(ATV71, {"ETI": 4}, NOW)
    assert reset_shown(reported(view(9, readings=read))).startswith(f"{ARM} A reset works now")
    armed = reset_shown(reported(view(9, readings=read, armed=True)))
    assert armed.startswith("A reset works now")
    barred = reset_shown(reported(view(9, readings=read, barred="The line is read-only.")))
    assert barred.startswith("Not allowed here: The line is read-only. A reset works now")
    atv21 = library.load("atv21")
    wait = reset_shown(reported(view(None, profile=atv21, fault=atv21.fault(14))))
    assert "Wait about 120 s before it." in wait


@pytest.mark.parametrize("width", [60, 80])
@pytest.mark.parametrize("height", range(2, 21))
@pytest.mark.parametrize("raw", [9, 18, 22])
def test_reset_text_is_never_cut_off(raw: int, width: int, height: int) -> None:
    for eti in (None, 0, 4):
        readings = {} if eti is None else readings_of(ATV71, {"ETI": eti}, NOW)
        shown = view(raw, readings=readings)
        text = reported(shown, width, height)
        assert len(text.splitlines()) <= height
        if TOO_FEW in text:
            assert height < 9, text
            continue
        assert capitalized(
            reset_text(shown.help, shown.ready, BESIDE_KEY, shown.follows).text
        ) in reset_shown(text)


def test_input_that_caused_the_trip_fits_80_columns() -> None:
    """'Logic input ...' and 16#000C did not show where to look."""
    external = next(f for f in ATV71.data.faults.codes if f.code == "EPF1")
    read = readings_of(ATV71, {"ETF": 132, "LET": 1, "IL1R": 0x000C, "EPL": 1}, NOW)
    rows = sections(reported(view(external.raw, readings=read)))["Values"]
    assert "Input or bit that trips it" in rows[1]
    assert rows[1].endswith(" Logic input LI4")
    assert next(row for row in rows if "IL1R" in row).endswith(" LI3, LI4")
    still = reported(view(external.raw, readings=readings_of(ATV71, {"IL1R": 0}, NOW)))
    assert next(row for row in still.splitlines() if "IL1R" in row).endswith(" none")


def test_alarm_has_causes_and_parameters() -> None:
    text = reported(view(None, present=False, alarms=[("LRS6", 8, "Undervoltage alarm")]))
    for part in ("UNDERVOLTAGE ALARM", "alarm, no fault", "Mains low or a dip", "ULN", "practice"):
        assert part in text
    assert "x" not in sections(text)
    both = view(18, alarms=[("LRS6", 8, "Undervoltage alarm")])
    assert "OVERBRAKING" in reported(both)
    assert "UNDERVOLTAGE" not in reported(both)


def test_unreadable_help_file_is_reported() -> None:
    profile = library.load_file(library.packaged_folder() / "atv71.toml")
    profile.guide.__dict__["_found"] = ({}, {})
    profile.guide.trouble = "mine.toml:3: there is no such fault."
    assert "mine.toml:3" in reported(view(18, profile=profile))


async def test_live_value_follows_the_drive() -> None:
    async with panel() as made:
        made.simulation.drive(1).provoke("ObF")
        await made.on("5")
        await made.until(lambda: "works now" in made.shown("doctor"))
        made.simulation.drive(1).set("DEC", 123)
        await made.until(lambda: "12.3 s" in made.shown("doctor"), 60.0)


@pytest.mark.sweep
async def test_key_line_stays_at_the_bottom() -> None:
    async with panel() as made:
        await made.on("5")
        await made.until(lambda: "No fault." in made.shown("doctor"))
        keys = made.app.screen.query_one("#keys").region
        assert keys.y == made.app.size.height - 1


def test_drive_without_a_fault_shows_no_causes() -> None:
    text = reported(view(None, present=False))
    assert "No fault." in text
    assert "Why" not in text


def test_family_without_a_history_reads_none() -> None:
    profile = library.load("powerdrive")
    text = reported(view(None, profile=profile, present=False, unread=True))
    assert "not known on this drive" in text
    assert "reading the history" not in text


@pytest.mark.parametrize("family", ["atv31", "atv312"])
def test_earlier_fault_is_not_shown_as_the_last(family: str) -> None:
    profile = library.load(family)
    raws = {"LFt": 18, "DP1": 9, "DP2": 5}
    shown = view(None, profile=profile, present=False, readings=readings_of(profile, raws, NOW))
    rows = reported(shown).partition("History")[2].splitlines()
    last, second, third = (profile.fault(raw) for raw in raws.values())
    for row, number, fault in zip(rows, ("last", "2", "3"), (last, second, third), strict=False):
        assert fault is not None
        assert row.split()[:2] == [number, fault.code]
    assert profile.data.faults.stored[0] == [], "EP1 belongs to fault n-1"


def causes(shown: DoctorView, width: int = 100) -> list[str]:
    """Sign and text of each cause, in the order of the page."""
    rows = sections(reported(shown, width, 40))["Why"][1:]
    return [row.strip() for row in rows if row.strip()[0] in (LIKELIEST, OPEN, EXCLUDED)]


def test_causes_are_weighed_and_excluded_ones_are_last_and_dim() -> None:
    read = readings_of(ATV71, {**BRAKING, "DEC": 5, "INR": 1}, NOW)
    shown = view(18, readings=read, now=NOW)
    rows = causes(shown)
    assert rows[0].startswith(f"{LIKELIEST} The braking is too sudden for the inertia")
    assert rows[0].endswith("DEC 0.5 s (up to 1 s)")
    assert rows[1].startswith(f"{OPEN} The load drives the motor")
    assert rows[-1].startswith(f"{EXCLUDED} Mains voltage already high")
    assert rows[-1].endswith("ULN 228.0 V (170 to 240 V) at the trip")
    text = reported(shown, 100, 40)
    assert "3 of 4 left" in text
    assert "× No resistor: set BRA on, if the process allows it (ruled out, BRA Yes)" in text
    (line,) = [line for line in doctor_lines(shown, 100, 40) if "already high" in line.plain]
    assert any("strike" in str(span.style) for span in line.spans)
    high = view(18, readings=readings_of(ATV71, {**BRAKING, "BRA": 0, "ULP0": 2580}, NOW))
    assert not [row for row in causes(high) if row.startswith(EXCLUDED)]


def test_supported_cause_moves_to_the_top() -> None:
    before = causes(view(18, readings=readings_of(ATV71, {"VCAL": 4, "ULP0": 2280}, NOW)))
    assert before[0].startswith(f"{LIKELIEST} The braking is too sudden")
    high = view(18, readings=readings_of(ATV71, {"VCAL": 4, "ULP0": 2800}, NOW))
    assert causes(high)[0].startswith(f"{LIKELIEST} Mains voltage already high")
    assert "general practice" in reported(high)


def test_old_value_or_older_fault_excludes_nothing() -> None:
    assert not [row for row in causes(view(18)) if row.startswith(EXCLUDED)]
    read = readings_of(ATV71, BRAKING, NOW)
    old = {code: reading.aged(NOW + 60, 6.0) for code, reading in read.items()}
    rows = causes(view(18, readings=old, now=NOW + 60))
    assert not [row for row in rows if row.startswith(EXCLUDED)]
    assert rows[-1].endswith("not known: ULN, VCAL")
    older = causes(view(18, present=False, readings=read))
    assert not [row for row in older if row.startswith(EXCLUDED)]


def test_value_of_a_failed_cycle_excludes_nothing() -> None:
    read = readings_of(ATV71, {"ULN": 2280, "VCAL": 4}, NOW)
    assert causes(view(19, monitored=read))[-1].startswith(EXCLUDED)
    stale = {code: reading.aged(NOW + 60, 6.0) for code, reading in read.items()}
    assert not [r for r in causes(view(19, monitored=stale)) if r.startswith(EXCLUDED)]


def test_present_value_does_not_exclude_a_past_cause() -> None:
    profile = library.load("atv312")
    now = readings_of(profile, {"ULn": 2280, "VCAL": 2}, NOW)
    rows = causes(view(None, profile=profile, fault=profile.fault(18), readings=now))
    assert rows[-1].endswith("not now: ULn 228.0 V (170 to 240 V)")


def test_setting_written_since_the_trip_is_no_evidence() -> None:
    read = readings_of(ATV71, {"DEC": 5, "INR": 1}, NOW)
    assert "DEC 0.5 s" in causes(view(18, readings=read))[0]
    assert "DEC 0.5 s" not in causes(view(18, readings=read, changed=frozenset({"DEC"})))[0]


def record(**raws: int) -> FaultRecord:
    """A trip into an overvoltage after a cycle with these values."""
    before = readings_of(ATV71, raws, NOW - 1)
    return FaultRecord(NOW, 0.0, ATV71.fault(18), (), (), (), (), before)


def test_values_at_the_trip_and_now_are_in_two_columns() -> None:
    read = readings_of(ATV71, {"ULP0": 2280, "LCP0": 29, "DEC": 5, "INR": 1}, NOW)
    monitored = readings_of(ATV71, {"ULN": 2284, "LCR": 0, "OTR": 0}, NOW)
    shown = view(18, readings=read, monitored=monitored, now=NOW, record=record(OTR=-940, LCR=99))
    rows = {row.split()[0]: row.split()[-4:] for row in sections(reported(shown, 80, 40))["Values"]}
    assert rows["ULP0"] == ["228.0", "V", "228.4", "V"]
    assert rows["LCR"] == ["2.9", "A", "0.0", "A"], "what the drive stored precedes"
    assert rows["OTR"] == ["~-94.0", "%", "0.0", "%"]
    assert rows["DEC"][-2:] == ["0.5", "s"]


def tripped(seconds: float, *, signs: CurveSigns = BRAILLE) -> DoctorView:
    """A trip of a motor at 40 Hz and 5 A that was read for some seconds before it."""
    count = round(seconds / 0.5)
    points = [TrendPoint(100.0 - n / 2, (40.0, 5.0, 40.0)) for n in range(count, -1, -1)]
    found = replace(record(ULN=2282), time=100.0, wall=1e9, points=tuple(points), period=0.5)
    read = readings_of(ATV71, BRAKING, NOW)
    return view(18, record=found, readings=read, now=NOW, signs=signs)


@pytest.mark.parametrize("width", [80, 120, 200])
@pytest.mark.parametrize("seconds", [4.0, 10.0, 29.0])
def test_curves_end_with_the_trip_and_begin_with_the_first_value(
    width: int, seconds: float
) -> None:
    shown = tripped(seconds)
    rows = [line.plain for line in doctor_lines(shown, width, 24)]
    top = next(at for at, row in enumerate(rows) if "the 10 s before it" in row)
    axis = next(at for at, row in enumerate(rows) if at > top and "└" in row)
    assert all(len(row) <= width for row in rows)
    trip, corner = rows[axis].index("■"), rows[axis].index("└")
    lit = re.compile("[\u2801-\u28ff]")
    cells = [at for row in rows[top + 1 : axis] for at in (m.start() for m in lit.finditer(row))]
    assert max(cells) == trip
    columns = trip - corner
    missing = max(0.0, 1 - seconds / 10) * columns
    assert abs(min(cells) - corner - 1 - missing) <= 1
    units = [row.rstrip()[-2:] for row in rows[top + 1 : axis] if not row.endswith("    ")]
    assert [unit.strip() for unit in units] == ["Hz", "A"]


def test_trip_without_curves_or_room_for_them_leaves_the_width_to_the_names() -> None:
    full = "Ramp adapted to the bus voltage"
    assert full not in reported(tripped(10.0))
    for shown, width, height in (
        (view(18, record=record(), now=NOW), 80, 20),
        (tripped(0.0), 80, 20),
        (tripped(10.0), 79, 20),
        (tripped(10.0), 80, 13),
    ):
        text = reported(shown, width, height)
        assert "before it" not in text
        assert full in text or height == 13


def test_curves_of_a_plain_terminal_are_ascii() -> None:
    rows = [line.plain for line in doctor_lines(tripped(10.0, signs=ASCII_SIGNS), 80, 20)]
    top = next(at for at, row in enumerate(rows) if "before it" in row)
    assert re.search(r"[-_\"]{5}", rows[top + 1])
    assert not re.search("[\u2800-\u28ff]", "".join(rows))


def test_value_long_before_the_trip_shows_its_age_and_is_no_evidence() -> None:
    late = record(ULN=2280, VCAL=4, LCR=99)
    early = {"ULN": readings_of(ATV71, {"ULN": 2280}, NOW - 9)["ULN"]}
    late = replace(late, before={**late.before, **early})
    read = readings_of(ATV71, {"VCAL": 4}, NOW)
    shown = view(18, readings=read, record=late, now=NOW)
    assert "~228.0 V -8s" in reported(shown, 80, 40)
    assert not [row for row in causes(shown) if row.startswith(EXCLUDED)]


def test_value_that_the_drive_keeps_in_a_fault_is_that_of_the_trip() -> None:
    profile = library.load("atv21")
    read = readings_of(profile, {"FE27": 120}, NOW)
    shown = view(None, profile=profile, fault=profile.fault(13), monitored=read, now=NOW)
    (row,) = [row for row in reported(shown, 80, 40).splitlines() if row.startswith("  FE27")]
    assert row.split()[-3:] == ["120", "%", "-----"]
    assert causes(shown)[0].endswith("FE27 120 % (from 100 %) at the trip")


def test_cursor_begins_at_the_value_that_decided() -> None:
    read = readings_of(ATV71, {"VCAL": 4, "ULP0": 2800}, NOW)
    shown = view(18, readings=read, now=NOW)
    assert shown.rows[shown.at].code == "ULP0"
    assert "Open ULP0" in sections(reported(shown, 80, 40))["Enter"][0]
    assert replace(shown, cursor=1).at == 1


def test_promoted_cause_is_not_shown_as_certain() -> None:
    readings = readings_of(ATV71, {"VCAL": 4, "ULP0": 2280}, NOW)
    assert "general practice" in sections(reported(view(19, readings=readings)))["Why"][0]


POINTS = tuple(TrendPoint(NOW - 100 + n, (float(n), n / 10, 50.0)) for n in range(90))


def quiet(watched: Watched, **more: object) -> str:
    """Page without a fault, in one line."""
    shown = view(None, present=False, now=NOW, wall=1_795_259_250.0, watched=watched, **more)
    return " ".join(reported(shown, 80, 20).split())


def test_quiet_page_shows_the_last_trip_and_what_was_monitored() -> None:
    text = quiet(Watched(NOW - 20, POINTS, journal_read=True))
    (since,) = re.findall(r"None seen since (\S+)\. Earlier trips are not known: ", text)
    assert f"By another program since {since}, by this panel since " in text
    assert "Highest in the last 10 min: 89.0 Hz at " in text
    assert "8.9 A at " in text
    assert "Not read" not in text
    trip = SeenTrip(1_795_259_250.0 - 720, "ObF Overbraking", tripped=True)
    assert ", 12 min ago. Trips while no program" in quiet(Watched(NOW - 20, POINTS, trip))
    seen = quiet(Watched(NOW - 20, (), SeenTrip(1_795_000_000.0, "", False, 1_795_000_060.0)))
    assert "A fault whose code is not known, first seen " in seen
    assert "3 days ago. Reset " in seen


def test_quiet_page_does_not_claim_more_than_was_read() -> None:
    assert "Not known: the drive has not been read yet." in quiet(Watched(None))
    own = quiet(Watched(NOW - 20))
    assert "By this panel since " in own
    assert "yet: reading the journal" in own
    gap = (*POINTS[:30], *POINTS[60:])
    assert "Not read from " in quiet(Watched(NOW - 20, gap))
    unread = tuple(replace(point, values=(None, None, None)) for point in POINTS)
    assert "another program" not in quiet(Watched(NOW - 20, unread))


@pytest.mark.parametrize("codes", [("ObF Overbraking",), ()])
def test_last_trip_of_the_trend_has_its_fault(codes: tuple[str, ...]) -> None:
    """After a seek, a replay has the trip in the trend alone."""
    trip = TrendPoint(NOW - 9, (0.0, 0.0, 50.0), "trip", (), codes)
    faults: Any = SimpleNamespace(
        app=SimpleNamespace(clock=SimpleNamespace(wall_of=lambda time: time)),
        console=SimpleNamespace(monitor=SimpleNamespace(trend=(*POINTS, trip))),
        _recorder=SimpleNamespace(since=None),
        _last=None,
        _journal_read=True,
    )
    assert FaultsScreen._watched(faults).last == SeenTrip(NOW - 9, "".join(codes), tripped=True)


def journal_entry(session: DriveSession, answer: str, time: str, *, device: int = 0) -> Entry:
    return Entry(
        time, session.line_text, device or session.device, "atv71", "ObF", 0, None, "", 18,
        "Overbraking", answer, None, "", kind="fault",
    )  # fmt: skip


async def test_quiet_page_has_the_last_trip_from_the_journal() -> None:
    async with panel() as made:
        fleet = made.app.fleet
        assert fleet is not None
        session = fleet.consoles[0].session
        for answer, time in (
            ("tripped", "2026-01-05T10:00:00.000+00:00"),
            ("reset", "2026-01-05T10:05:00.000+00:00"),
        ):
            fleet.journal.add(journal_entry(session, answer, time))
        other = journal_entry(session, "tripped", "2026-01-06T10:00:00.000+00:00", device=99)
        fleet.journal.add(other)
        await made.on("5")
        await made.until(lambda: "ObF Overbraking, tripped 05 Jan 2026" in made.shown("doctor"))
        assert "Reset 05 Jan 2026" in " ".join(made.shown("doctor").split())
        await made.until(lambda: "By this panel since " in made.shown("doctor"))


async def test_new_trip_drops_the_values_stored_with_the_one_before() -> None:
    async with panel() as made:
        drive = made.simulation.drive(1)
        drive.set("ULP0", 2900)
        await made.on("5")
        await made.until(lambda: "last" in made.shown("doctor"))
        screen = made.app.screen
        assert isinstance(screen, FaultsScreen)
        await made.until(lambda: "ULP0" in screen._readings)
        drive.provoke("OSF")
        await made.until(lambda: "OVERVOLTAGE" in made.shown("doctor").upper())
        await made.until(lambda: screen.doctor().record is not None)
        known = screen.doctor().known
        assert known.trip.get("ULN") != 2900


@pytest.mark.parametrize("height", range(1, 12))
@pytest.mark.parametrize("cursor", range(-1, 8))
def test_history_shows_as_many_faults_as_fit_and_the_one_under_the_cursor(
    cursor: int, height: int
) -> None:
    profile = library.load("atv71")
    raws = {code: 3 + number for number, code in enumerate(profile.data.faults.history)}
    shown = view(None, profile=profile, present=False, readings=readings_of(profile, raws, NOW))
    shown = replace(shown, cursor=len(shown.rows) + cursor)
    count = len(shown.history)
    lines = [line.plain for line in history_rows(shown, 80, height)]
    numbers = [line[LABEL:].split()[0].replace("last", "1") for line in lines]
    first = int(numbers[0])
    assert list(map(int, numbers)) == list(range(first, first + min(height, count)))
    if cursor < count:
        assert cursor < 0 or str(cursor + 1) in numbers
        assert first == max(1, cursor + 2 - height), "no further than the cursor needs"
    assert lines[0].split()[0] == "History"
    assert all(not line[:LABEL].strip() for line in lines[1:])


def test_fault_without_a_time_says_if_it_is_present() -> None:
    gone = reported(view(18, present=False))
    assert "no longer present" in gone
    assert "before monitoring" not in gone
    present = reported(view(18))
    assert "tripped before monitoring began" in present
    assert "no longer present" not in present


@pytest.mark.parametrize(
    ("raw", "at", "text"),
    [
        (5, 1, "Open SLL Reaction to a Modbus fault: Freewheel, factory setting Freewheel."),
        (8, 1, "Open LET Level of the external fault: Active at 1, factory setting Active at 1."),
        (2, 0, "Open VDP Software version."),
    ],
)
def test_row_of_enter_has_the_factory_setting_as_soon_as_there_is_room(
    raw: int, at: int, text: str
) -> None:
    read = readings_of(ATV71, {"SLL": 1, "LET": 1}, NOW)
    shown = view(raw, readings=read, now=NOW, cursor=at)
    named = text.partition(":")[0].rstrip(".") + "."
    assert open_row(replace(shown, cursor=len(shown.rows)), 80) == []
    for width in range(len(named) + 10, len(text) + 30):
        (row,) = open_row(shown, width)
        fits = len(text) < width - len("  Enter  ")
        assert row.plain.rstrip() == f"  Enter  {text if fits else named}", width
