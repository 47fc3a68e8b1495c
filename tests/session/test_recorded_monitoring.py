"""Results of monitoring from values, states and counts, as recorded text.

`recorded_monitoring.txt` has a section for each subject: the health of a line, the alarms of its
drives, their trends and trips, and the texts about a timeout.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from datetime import UTC, datetime
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import msgspec
import pytest

from tests.drive.test_whole_values import HELD, whole
from tests.recorded import sections, short
from tests.session.test_line_health import counted
from tests.ui import fakes
from tests.ui.fakes import CONNECTED, readings_of, snapshot_of
from tui.bus.fake import FakeLine
from tui.bus.line_events import DeviceWritten, NoteReceived
from tui.bus.model import LastMinute
from tui.bus.notes import LineNote
from tui.bus.program import Program
from tui.drive.profile import library
from tui.drive.profile.schema import FaultCode, Reaction
from tui.session.connect.identify import DriveIdentity
from tui.session.drive import DriveSession
from tui.session.drive_state import DriveState, drive_state
from tui.session.events import EventLog
from tui.session.journal import Entry
from tui.session.monitor.alarms import FaultOnsets, LineAlarms, PresentFault
from tui.session.monitor.fault_record import Recorder, record_codes, record_name, record_text
from tui.session.monitor.line_health import LineHealth, percent
from tui.session.monitor.rates import bad_readings, codes_of_state, monitoring_codes, rates_of
from tui.session.monitor.snapshot import Snapshot, as_read, stale_after
from tui.session.monitor.timeout import TimeoutWarning, names_of, polling_stop_text, timeout_now
from tui.session.monitor.trend import Trend, TrendNotes, TrendPoint
from tui.session.monitor.watched import Watched, last_trip
from tui.session.reading import Reading, with_text
from tui.session.shown import Quality
from tui.session.timeout_report import Timeout, TimeoutWatch

from .fake_clock import FakeClock

TEXTS = Path(__file__).parent / "recorded_monitoring.txt"
NOON = datetime(2026, 1, 2, 12, 0, tzinfo=UTC).timestamp()
PROFILE, ATV71 = whole(), library.load("atv71")
READY, RUNNING, FAULT = (
    {**HELD, "STAT": word, "FOUT": hertz, "TRIP": trip}
    for word, hertz, trip in ((0x0001, 0, 0), (0x0207, 425, 0), (0x0408, 0, 7))
)


def cycle(raws: dict[str, int], at: float = 100.0, error: str = "", **more: Any) -> Snapshot:
    """A cycle of the invented drive, with readings of the same time."""
    read = readings_of(PROFILE, raws, at)
    state = drive_state(PROFILE, read)
    rate = 0.0 if error else 2.0
    return Snapshot(1, at, NOON + at, read, state, rate, error, CONNECTED, **more)


def health() -> Iterator[str]:
    """Messages about the last minute, one look after the other, then about others."""
    good, line = LastMinute(good=600), LineHealth()
    minutes = (
        good, LastMinute(good=588, lost=12), LastMinute(good=587, lost=13),
        LastMinute(good=593, lost=7), LastMinute(good=594, lost=6), LastMinute(good=10, lost=9),
        LastMinute(good=10, lost=10), LastMinute(good=10, lost=1), LastMinute(),
        LastMinute(good=600, foreign=2, strays=2), LastMinute(good=600, foreign=3, strays=1),
        LastMinute(good=600, foreign=1, strays=3), LastMinute(good=600, strays=1), good, good,
        LastMinute(good=500, lost=40, damaged=30, silent=3, foreign=9, strays=9),
    )  # fmt: skip
    drives: tuple[dict[int, LastMinute], ...] = (
        {2: good}, {2: good, 3: LastMinute(good=30, lost=10), 4: LastMinute()},
        {2: LastMinute(good=500, lost=40, damaged=30), 3: LastMinute(good=2, lost=1)},
        {2: LastMinute(good=97, lost=3), 3: LastMinute(good=95, damaged=5)}, {},
    )  # fmt: skip
    for each in drives:
        line.forget()
        yield f"{each}"
        for minute in minutes:
            messages = line.look(counted(minute, each))
            yield f"{minute}: {[(t.kind, t.signs) for t in line.troubles]}"
            yield from (f"  {kind}: {text}" for kind, text in messages)
    yield f"{[percent(share) for share in (None, 0, 0.009, 0.5, 0.999, 1)]}"


def state(kind: str, fault: FaultCode | None = None) -> DriveState:
    return replace(drive_state(PROFILE, {}), kind=cast(Any, kind), fault=fault)


def alarms() -> Iterator[str]:
    """Faults of several drives, which come, get their code, are lost, are viewed, and end."""
    over, silent = PROFILE.fault(1), PROFILE.fault(7)
    runs, none, nobody = state("running"), state("fault"), state("unknown")
    steps: tuple[dict[int, DriveState], ...] = (
        {1: runs, 2: state("fault", over), 3: nobody}, {1: none, 2: nobody, 3: runs},
        {1: state("fault", silent), 2: none, 3: state("fault", over)}, {1: none, 3: runs},
        {1: runs, 2: state("fault", over)}, {1: none, 2: runs}, {1: runs, 2: state("fault", over)},
        {1: state("fault", over), 2: state("fault", silent)}, {},
        {1: state("fault", over), 2: state("fault", silent), 4: none}, {1: runs, 2: runs, 4: runs},
    )  # fmt: skip
    now = NOON
    log = EventLog(lambda: now)
    kept: list[str] = []

    def keep(fault: PresentFault, what: str) -> None:
        kept.append(f"{fault.device} {fault.code or '?'} {what} {fault.wall - NOON:g}")

    line, onsets = LineAlarms(log, keep), FaultOnsets()
    for number, step in enumerate(steps):
        now = NOON + 10 * number
        for device, each in step.items():
            onsets.note(device, each, now)
        named = {d: f"{s.kind} {s.fault.code if s.fault else ''}".strip() for d, s in step.items()}
        yield f"{named}: new {line.take(step, onsets.by_device)}"
        yield f"  {[(each.device, each.code, each.when, each.seen) for each in line.active]}"
        yield f"  {line.unseen} {kept} {short(dict(onsets.by_device))}"
        kept.clear()
        line.acknowledge(number)
    yield from (
        f"{item.wall - NOON:g} {item.device} {item.kind}: {item.text}" for item in log.events
    )
    yield f"{line.take({5: none}, {})} {line.active}"
    early = FaultOnsets()
    early.recall(1, state("fault", over), NOON)
    for wall, each in ((NOON - 1, runs), (NOON, none), (NOON + 1, runs), (NOON + 2, none)):
        early.note(1, each, wall)
        yield short(dict(early.by_device))


def written(*words: int, at: int, when: float = 100.0, by: str = "run") -> DeviceWritten:
    return DeviceWritten(2, at, words, Program(by, by, 7), when)


def points_of(trend: Trend) -> list[str]:
    return [f"{p.time:g} {p.values} {p.mark} {p.by} {p.codes}" for p in trend.points]


def trends() -> Iterator[str]:
    """Points of cycles with writes between them, joined with those of other programs."""
    accel, command, reference = (ATV71[code].address for code in ("ACC", "CMD", "LFR"))
    trend = Trend(ATV71)
    yield f"{trend.kind}; {trend.last}"
    ready, running, tripped = fakes.READY, fakes.RUNNING, fakes.FAULT
    steps: tuple[tuple[dict[str, int], list[DeviceWritten]], ...] = (
        (ready, []), (running, [written(15, at=command)]),
        ({**running, "FRH": 400}, [written(400, at=reference, by="panel")]),
        ({**running, "FRH": 400}, [written(5, 6, at=accel), written(1, at=60000)]),
        ({**running, "FRH": 404}, []), ({}, [written(3, at=accel)]),
        ({**running, "FRH": 404, "RFR": -9}, []), ({**running, "FRH": 395}, []), (running, []),
        (tripped, [written(3, at=accel)]), ({**tripped, "LFT": 0}, []), (ready, []),
        (fakes.REVERSE, [written(0, at=command, when=97.0)]), (tripped, []), (ready, []),
    )  # fmt: skip
    for number, (each, writes) in enumerate(steps):
        for write in writes:
            trend.note_write(write)
        lost = "gone" if number == 5 else ""
        trend.add(replace(snapshot_of(ATV71, each, error=lost), time=100.0 + number / 2))
    yield from points_of(trend)
    other = Trend(ATV71, [TrendPoint(90.0, (1.0, None, 2.0)), TrendPoint(103.0, (3.0, None, 4.0))])
    other.join([TrendPoint(95.0, (5.0, None, 6.0)), TrendPoint(90.0, (9.0, None, 9.0))])
    yield f"{points_of(other)}"
    trend.resume(Trend(ATV71))
    trend.resume(other)
    yield from points_of(trend)
    trend.add(replace(snapshot_of(ATV71, ready), time=695.0))
    yield f"{[point.time for point in trend.points]}"


def notes() -> Iterator[str]:
    """Points of other programs, and what this program writes of its own."""
    line = FakeLine({2: {}})
    left: list[LineNote] = []
    trend = Trend(PROFILE)
    facts = SimpleNamespace(
        notes=SimpleNamespace(ask=lambda *those: wanted.append(those), leave=left.append),
        events=line.facts.events,
    )
    wanted: list[tuple[int, str]] = []
    shared = TrendNotes(cast(Any, facts), 2, trend)
    shared.ask()
    shared.ask()
    yield f"{wanted}"
    kind = trend.kind
    others = [
        TrendPoint(90.0, (1.0, None, 2.0), "write", ("\x1b[2J" + "b" * 200, "c", "d"), ("x",) * 30),
        TrendPoint(91.0, (1.0, 2.0)), TrendPoint(float("inf"), (1.0, 2.0, 3.0)),
        TrendPoint(92.0, (1.0, float("nan"), 3.0)), TrendPoint(93.0, (None, None, None)),
    ]  # fmt: skip
    data = msgspec.msgpack.encode(others)
    for device, named, at in ((2, kind, 0), (3, kind, 1), (2, "trend gone", 2)):
        sent = msgspec.msgpack.encode([*others, TrendPoint(94.0 + at, (None, 5.0, None))])
        line.facts.events.emit(NoteReceived(LineNote(device, named, sent)))
    for device in (0, 2, 3):
        line.facts.events.emit(
            DeviceWritten(device, PROFILE["ACCE"].address, (5,), Program("x", "x", 7), 100.0)
        )
    for number in range(6):
        shared.add(trend.add(cycle(READY, 100.0 + number)))
    yield from points_of(trend)
    yield f"{[(note.device, note.kind, len(note.data)) for note in left]}"
    shared.end()
    line.facts.events.emit(NoteReceived(LineNote(2, kind, data)))
    shared.add(trend.add(cycle(READY, 106.0)))
    yield f"{len(trend.points)}"


def histories() -> Iterator[str]:
    """Times and gaps of monitoring, and the last trip in a journal."""
    points = [TrendPoint(at, (value, None, 2.0)) for at, value in
              ((10.0, None), (12.0, -50.0), (17.0, 5.0), (22.5, 40.0), (23.0, None))]  # fmt: skip
    nothing = [TrendPoint(at, (None, None, None)) for at in (1.0, 9.0)]
    short_ones = [TrendPoint(12.5, ()), TrendPoint(13.0, (7.0,)), TrendPoint(20.0, (6.0, 8.0))]
    for own, some in product(
        (None, 12.0, 13.0, 13.5), ((), points, points[1:], nothing, short_ones)
    ):
        seen = Watched(own, some)
        names = ("output_frequency", "motor_current", "frequency_reference", "gone")
        yield f"{own} {len(some)}: {seen.since} {seen.by_others} {seen.gaps}"
        yield f"  {[seen.highest(name) for name in names]}"
    entry = Entry(
        "2026-01-02T11:00:00.000+00:00", "rtu:x", 2, "example-fan", "OC", 0, None, "", 0,
        "Overcurrent", "tripped", None, "the trip was seen", kind="fault",
    )  # fmt: skip
    later = replace(entry, time="2026-01-02T11:05:00.000+00:00")
    for entries in (
        [], [replace(entry, kind="write")], [entry], [replace(entry, answer="seen", new="")],
        [replace(entry, answer="reset")], [entry, replace(later, answer="reset")],
        [entry, replace(later, answer="reset"), replace(later, answer="reset")],
        [replace(entry, time="never")], [entry, replace(later, code="COM")],
        [replace(entry, code="", new=""), replace(later, answer="code read")],
        [replace(entry, code="", new=""), replace(later, answer="reset")],
    ):  # fmt: skip
        yield short(last_trip(entries))


def trips() -> Iterator[str]:
    """The record of a trip, with its texts, from the cycles before it."""
    session = DriveSession(FakeLine({2: {}}), 2, PROFILE, clock=FakeClock())
    identity = DriveIdentity(2, "Example", "EXFAN-22", "1.2", "Fan <1>", "example-fan", ())
    own = cast(Any, SimpleNamespace(
        profile=PROFILE, device=2, line_text="rtu:x", identity=identity, image=session.image,
    ))  # fmt: skip
    entry = Entry(
        datetime.fromtimestamp(NOON + 75, UTC).isoformat(timespec="milliseconds"), "rtu:x", 2,
        "example-fan", "ACCE", 211, 30, "3.0 s", 45, "4.5 s", "ok", 45, "edit",
    )  # fmt: skip
    recent = [
        entry, replace(entry, device=3, new="3 s"), replace(entry, line="rtu:y", new="5 s"),
        replace(entry, time=datetime.fromtimestamp(NOON + 60, UTC).isoformat()),
    ]  # fmt: skip
    recorder = Recorder(own, cast(Any, SimpleNamespace(recent=recent)))
    slow = {"HOUR": Reading.bad(PROFILE["HOUR"], 50.0, "gone")}
    steps = [
        cycle(FAULT, 50.0), cycle(READY, 60.0), cycle(RUNNING, 70.0), cycle(RUNNING, 71.0, "gone"),
        cycle({**RUNNING, "FOUT": 600}, 80.0), cycle({}, 81.0),
        replace(cycle({**FAULT, "TRIP": 0}, 95.0), period=0.7), cycle({**FAULT, "TRIP": 1}, 95.5),
    ]  # fmt: skip
    steps[4] = replace(steps[4], readings={**with_text(steps[4].readings), **slow})
    for each in steps:
        recorder.take(each)
        yield f"{each.time:g} {recorder.seen} {recorder.since} {short(recorder.latest is not None)}"
    record = recorder.latest
    assert record is not None
    yield f"{record.time} {record.wall - NOON:g} {record.codes} {record.headings} {record.period}"
    yield f"{record.raws} {[(p.time, p.values) for p in record.points]}"
    for known in (record, replace(record, fault=None, writes=()), replace(record, before={})):
        stored = [("FOUT", "Output | frequency", "60.0 Hz")] if known is record else []
        yield record_text(own, known, stored, {"FOUT": "60.0 Hz"})
        yield record_name(own, known)
    own.identity = None
    yield record_text(own, record, []).splitlines()[3]
    for at in (89.0, 90.5, 120.0):
        recorder.recall(replace(record, time=at))
        yield f"{recorder.latest.time if recorder.latest else None}"
    recorder.acknowledge()
    yield f"{recorder.seen} {record_codes(own)}"


def snapshots() -> Iterator[str]:
    """Rates of a profile, ages of values, and cycles as a client reads them."""
    rates = rates_of(PROFILE)
    yield f"{rates} {rates.seldom} {rates.with_fast(['FOUT', 'TYPE', 'TRIP', 'TYPE'])}"
    yield f"{monitoring_codes(PROFILE)} {codes_of_state(PROFILE)}"
    yield short(bad_readings(PROFILE, rates, 5.0, "x"))
    yield f"{[(stale_after(s, often=o), s, o) for s in (0.5, 2.0) for o in (True, False)]}"
    own = cycle(RUNNING, 100.0, period=0.6, wished=0.5)
    for each in (
        own,
        replace(own, period=0.61),
        replace(own, readings={}),
        replace(own, time=105.0),
    ):
        stale = [each.is_stale(at) for at in (100.0, 101.5, 102.5, 104.0, 110.0)]
        yield f"{each.too_slow} {each.read_at} {stale}"
    for each, since in product((own, replace(own, error="gone")), (99.0, 100.0)):
        found = as_read(PROFILE, ("STAT", "FOUT", "TEMP", "SECR", "LOW"), each, since)
        yield f"{[(code, r.quality, r.raw, r.error) for code, r in found.readings.items()]}"
        yield f"{found.state.headline!r} {found.state.kind}"
    bad = {**with_text(own.readings), "STAT": Reading.bad(PROFILE["STAT"], 1.0, "no")}
    found = as_read(PROFILE, ("STAT",), replace(own, readings=bad), 0.0)
    yield f"{found.readings['STAT'].quality is Quality.BAD} {found.state.headline!r}"


def timeouts() -> Iterator[str]:
    """Sentences about drives when polling stops."""
    sessions = [DriveSession(FakeLine({n: {} for n in (2, 5)}), n, PROFILE) for n in (2, 5)]
    ignores = Reaction(raw=0, name="Ignore", does="It runs on.", trips=False, never_set=True)
    stops = Reaction(raw=1, name="Stop", does="it stops", trips=True)
    watches = (
        None, TimeoutWatch(10.0, ignores), TimeoutWatch(2.5, stops), TimeoutWatch(2.5, None),
        TimeoutWatch(2.5, stops, active=False),
    )  # fmt: skip
    for watch, count in product(watches, (1, 2)):
        yield f"{names_of(sessions[:count])}: {polling_stop_text(*sessions[:count], watch=watch)}"
    for watch in watches:
        session = sessions[0]
        session.timeout = Timeout(True, watch)
        yield f"{short(timeout_now(session))} {watch and (watch.acts, watch.trips)}"
        if watch is not None:
            yield f"{TimeoutWarning(2, PROFILE, 4.0, watch).left}"
    sessions[0].timeout = None
    yield short(timeout_now(sessions[0]))


SECTIONS = (health, alarms, trends, notes, histories, trips, snapshots, timeouts)


@pytest.mark.usefixtures("in_utc")
@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_monitoring_gives_what_is_recorded(section: Callable[[], Iterator[str]]) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
