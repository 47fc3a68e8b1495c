"""The drives of a replay: each with the profile and the identity that the record names."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache, partial
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple

from tui.bus.errors import LineError
from tui.bus.expectation import IDENTIFY, REPORT_ID
from tui.bus.model import LineStatus
from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.profile.profile import Profile, digest_of
from tui.drive.values import from_words, word_count

from .connect.identify import DriveIdentity, identity_from
from .console import DriveConsole
from .drive import DriveSession
from .fleet import Fleet
from .journal import Entry, Journal
from .monitor.fault_record import SECONDS_KEPT
from .monitor.line_watch import GLANCE
from .monitor.rates import codes_of_state
from .monitor.trend import Trend
from .read.reader import Reader
from .reading import Origin, Reading
from .record.newest import ends_of_cycles
from .record.repeated_cycles import RepeatedCycles, cycles_of
from .record.replay_line import REPLAY_SENDS_NOTHING, ReplayLine
from .record.runs import history_of, read_events
from .record.schema import EventRow
from .replay_past import (
    PAST_SECONDS,
    RECENT_SECONDS,
    RecordedCycles,
    means_of,
    recall_past,
    recorded_curve,
)

TRIPS_OF = 4
"""Drives whose trips are events of a replay, if none is open."""
EXACT_TAKES = 1.5
"""Seconds of processor time for them; on a slow computer, the curve then has a gap."""
OTHER_PROFILE = (
    "Drive {device}: profile {profile} has changed since the record was made. Values may be shown"
    " differently."
)
NO_PROFILE = "Drive {device}: {error} Its values are not shown."
MOST_SOUGHT = 500
"""Replies in which a recorded cycle is sought."""
SOUGHT_WITHIN = 5
"""Periods in which it is sought."""
LONGER_THAN_LEAD = 1000.0
"""Seconds between the checks of drives before a replay begins: samples replace them."""
SAME_TRIP_WITHIN = 5.0
"""Seconds between a trip and the event by which a program reported it."""
CODE_WITHIN = 3.0
"""Seconds after a trip in which its code is read."""
TRIPS_SOUGHT = 3
"""Reported faults of which one is the last trip: a drive may be in fault at first."""
EVER = 4e9
"""A time after all records, in seconds since 1970."""
UNNAMED = "Drive {device}: the record does not name its profile. Its values are not shown."
BeginPolls = Callable[[DriveConsole, float], None]
"""Starts the monitor of a drive, with its period in seconds."""


class UnwrittenJournal(Journal):
    """A journal for a replay: nothing that happens in it is recorded."""

    def add(self, entry: Entry, *, sent: bool = True) -> None:
        """Do nothing."""


class NamedProfile(NamedTuple):
    """The profile of a drive, as the record names it."""

    id: str = ""
    hash: str = ""
    reference: str = ""
    version: str = ""


def named_profile(line: ReplayLine, device: int) -> NamedProfile:
    """Return the profile of a device at the present time; empty if the record names none."""
    event = line.profile_note(device)
    if event is None:
        return NamedProfile()
    try:
        about = json.loads(event.text)
        known = {name: str(about.get(name) or "") for name in ("hash", "reference", "version")}
        return NamedProfile(str(about["profile"]), **known)
    except (ValueError, KeyError, TypeError, AttributeError):
        return NamedProfile()


def take_drives(line: ReplayLine, fleet: Fleet) -> list[str]:
    """Add the drives of a record to a fleet; return what a person should know about them.

    It reads files, in the caller's thread.
    """
    reported = []
    fleet.line_watch.least_period = LONGER_THAN_LEAD
    for device in line.devices:
        named = named_profile(line, device)
        identity = _identity(line, device, named)
        if not (id := named.id or identity.profile):
            fleet.note(identity)
            reported.append(UNNAMED.format(device=device))
            continue
        try:
            profile = library.load(id)
        except DriveError as error:
            fleet.note(identity)
            reported.append(NO_PROFILE.format(device=device, error=error))
            continue
        _read_from(line, fleet.take(_session(line, device, profile, identity)))
        if named.hash and named.hash != digest_of(profile):
            reported.append(OTHER_PROFILE.format(device=device, profile=id))
    return reported


def _session(
    line: ReplayLine, device: int, profile: Profile, identity: DriveIdentity | None
) -> DriveSession:
    """Return a drive of the replay."""
    line.use_profile(device, means_of(profile).get, partial(_place_of, profile))
    session = DriveSession(line, device, profile, identity, line.clock)
    session.arming.barred = REPLAY_SENDS_NOTHING
    session.reads_blocks = False
    return session


def _read_from(line: ReplayLine, console: DriveConsole) -> None:
    console.monitor.steady.recorded = RepeatedCycles(line, console.device)


def _place_of(profile: Profile, code: str) -> tuple[int, int] | None:
    """Return function and address of a parameter; None if the profile lacks it."""
    entry = profile.get(code)
    return None if entry is None else (entry.function, entry.address)


def _identity(line: ReplayLine, device: int, named: NamedProfile) -> DriveIdentity:
    """Return the identity that the drive reported then, else that of the note."""
    for function in (IDENTIFY, REPORT_ID):
        if (found := line.identification(device, function)) is not None:
            return identity_from(device, found)
    known = named.id or None
    candidates = (known,) if known else ()
    return DriveIdentity(device, "", named.reference, named.version, "", known, candidates)


def add_trips(line: ReplayLine, device: int | None) -> None:
    """Add the trips of `device` that only the words of the record show to its events.

    Without a device, those of some drives. It reads files for a second a drive and day: in a thread
    that nobody waits for.
    """
    for each in line.devices[:TRIPS_OF] if device is None else (device,):
        if line.state.status is LineStatus.CLOSED:
            return
        trips = _trips_of(tuple(line.files), each, named_profile(line, each).id)
        known = [
            event.utc for event in line.events if (event.device, event.kind) == (each, "fault")
        ]
        new = [
            trip
            for trip in trips
            if all(abs(trip.utc - utc) > SAME_TRIP_WITHIN * 1e6 for utc in known)
        ]
        line.events = tuple(sorted((*line.events, *new), key=attrgetter("utc")))


@lru_cache(maxsize=64)
def _trips_of(files: tuple[Path, ...], device: int, profile: str) -> list[EventRow]:
    found = history_of(read_events(files), device, profile, -EVER, EVER).trips
    return [
        EventRow(
            round(trip.begun * 1e6), 0, device, "fault",
            f"Tripped on {f'{trip.code} {trip.name}'.strip() or 'a fault'}.",
        )
        for trip in found
        if trip.within is not None
    ]  # fmt: skip


def _take_known(line: ReplayLine, session: DriveSession) -> None:
    """Have a session know all that was read of its drive by now, by any program."""
    parameters = session.profile.data.parameters
    places = [(item.function, item.address, word_count(item)) for item in parameters]
    found = {}
    replies = line.last_replies(session.device, places)
    for parameter, reply in zip(parameters, replies, strict=True):
        if reply is not None:
            raw = from_words(parameter, reply.words)
            found[parameter.code] = Reading.undecoded(parameter, raw, reply.time, Origin.POLL)
    session.take(found)


def in_step(line: ReplayLine, device: int | None, since: float, period: float) -> float:
    """Return when the first recorded cycle of a device from `since` on ended; `since` without one.

    The monitor of a replay begins then, and repeats those that follow.
    """
    if device is None:
        return since
    until = min(since + SOUGHT_WITHIN * period, line.at)
    replies = line.last_before(device, since, until, MOST_SOUGHT)
    return next(iter(ends_of_cycles(replies[::-1], until)), since)


def _first_read(line: ReplayLine, session: DriveSession) -> float:
    """Return when the state of a drive was first read: the program of the record began then."""
    reads = Reader(session).planned(codes_of_state(session.profile))
    cycles, _ = cycles_of(line, session.device, line.clock.begin, reads)
    return cycles[0].last.ended / 1e6 if cycles else line.clock.begin


async def pass_lead(
    line: ReplayLine,
    fleet: Fleet,
    device: int | None,
    monitor: BeginPolls,
    period: float,
    *,
    goes_on: bool = True,
) -> None:
    """Go to the time of the replay: with the seconds before it of the drive `device`.

    `monitor` starts its monitor, which `goes_on` then. The curves of the other drives have samples
    before the last minute, see `open_past`.
    """
    clock, drives, watch = line.clock, fleet.consoles, fleet.line_watch
    shown = fleet.console(device) if device is not None else None
    begin = in_step(line, device, max(clock.monotonic(), line.at - SECONDS_KEPT), period)
    for console in drives:
        since, monitored = line.at - RECENT_SECONDS, line.at
        if console is shown:
            since, monitored = line.at - PAST_SECONDS, begin
        events = [e.utc / 1e6 for e in line.events if e.device == console.device]
        await asyncio.to_thread(_take_known, line, console.session)  # scales of the curve
        past = RecordedCycles(line, console)
        curve = await asyncio.to_thread(recall_past, past, watch, events, since, monitored)
        watch.recorded[console.device] = past  # from now on for the line's loop only
        await line.do(partial(_resume, console, curve), f"curve of {console.device}")
        console.recorder.since = await asyncio.to_thread(_first_read, line, console.session)
    if shown is not None:
        await line.run_to(begin, EXACT_TAKES)
        monitor(shown, period)
        watch.keep(shown.session, shown.monitor)
    await line.run_to(line.at, EXACT_TAKES)
    watch.least_period = GLANCE
    if shown is not None and not goes_on:
        shown.monitor.stop()
    for console in drives:
        await asyncio.to_thread(_take_known, line, console.session)
        watch.keep(console.session, console.monitor)  # checks it at this time


async def recall_trip(
    line: ReplayLine,
    console: DriveConsole,
    monitor: BeginPolls,
    period: float,
) -> None:
    """Have a drive know the record of its last trip up to now, as a monitor then made it.

    The seconds around that trip are replayed on a line of their own.
    """
    now = line.clock.monotonic()
    for trip in _last_trips(line, console.device, now):
        until = min(trip + CODE_WITHIN, now)
        lead = until - trip + SAME_TRIP_WITHIN + SECONDS_KEPT
        past = ReplayLine(line.path, until, lead=lead, files=line.files)
        past.open()
        try:
            session = console.session
            then = DriveConsole(
                _session(past, console.device, session.profile, session.identity),
                UnwrittenJournal(),
            )
            _read_from(past, then)
            await past.run_to(in_step(past, console.device, past.clock.monotonic(), period))
            monitor(then, period)
            await past.run_to(until)
            if (record := then.recorder.latest) is not None:
                console.recorder.recall(record)
                return
        finally:
            await asyncio.to_thread(past.close)


def _last_trips(line: ReplayLine, device: int, now: float) -> list[float]:
    """Return the last reported faults of a drive up to a time, the newest first."""
    found: list[float] = []
    for event in reversed(line.events):
        at = event.utc / 1e6
        if event.kind == "fault" and event.device == device and at <= now:
            # the code of a fault may be reported on its own
            if found and found[-1] - at < SAME_TRIP_WITHIN:
                found.pop()
            found.append(at)
    return found[:TRIPS_SOUGHT]


async def _resume(console: DriveConsole, curve: Trend) -> None:
    """Continue a curve; in the line's loop, where nothing else adds to it."""
    console.monitor.recall(curve)


def open_past(line: ReplayLine, console: DriveConsole, monitor: BeginPolls, period: float) -> None:
    """Give a drive that is opened each recorded cycle and its last trip; it takes a moment."""
    until = line.clock.monotonic()

    async def work() -> None:
        past = RecordedCycles(line, console)
        await _resume(console, await asyncio.to_thread(recorded_curve, past, until))
        await recall_trip(line, console, monitor, period)

    with suppress(LineError):
        line.spawn(work, f"curve of {console.device}")
