"""The drives of a replay: each with the profile and the identity that the record names."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple

from tui.bus.errors import LineError
from tui.bus.expectation import IDENTIFY, REPORT_ID
from tui.bus.model import LineStatus
from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.profile.profile import Profile, digest_of
from tui.drive.values import from_words, is_signed_type, word_count

from .connect.identify import DriveIdentity, identity_from
from .console import DriveConsole
from .drive import DriveSession
from .fleet import Fleet
from .journal import Entry, Journal
from .reading import Origin, Reading
from .record.replay_line import REPLAY_SENDS_NOTHING, ReplayLine
from .record.runs import history_of, read_events
from .record.schema import EventRow

EXACT_LEAD = 60.0
"""Seconds before the time of a replay that pass as they were."""
MONITORED_IN_LEAD = 4
"""Drives whose curves begin before the time of a replay, if none is open."""
LEAD_TAKES, EXACT_TAKES = 0.25, 1.5
"""Seconds of processor time for both; a line with many drives then has gaps in its curves."""
LEAD_SLEEP = 5.0
"""Seconds of each sleep in those before; more with many drives."""
OTHER_PROFILE = (
    "Drive {device}: profile {profile} has changed since the record was made. Values may be shown"
    " differently."
)
NO_PROFILE = "Drive {device}: {error} Its values are not shown."
SAME_TRIP_WITHIN = 5_000_000
"""Microseconds between a trip and the event by which a program reported it."""
EVER = 4e9
"""A time after all records, in seconds since 1970."""
UNNAMED = "Drive {device}: the record does not name its profile. Its values are not shown."


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
        line.use_means(device, _means(profile).get)
        session = DriveSession(line, device, profile, identity, line.clock)
        session.arming.barred = REPLAY_SENDS_NOTHING
        fleet.take(session)
        if named.hash and named.hash != digest_of(profile):
            reported.append(OTHER_PROFILE.format(device=device, profile=id))
    return reported


def _identity(line: ReplayLine, device: int, named: NamedProfile) -> DriveIdentity:
    """Return the identity that the drive reported then, else that of the note."""
    for function in (IDENTIFY, REPORT_ID):
        if (found := line.identification(device, function)) is not None:
            return identity_from(device, found)
    known = named.id or None
    candidates = (known,) if known else ()
    return DriveIdentity(device, "", named.reference, named.version, "", known, candidates)


def _means(profile: Profile) -> dict[tuple[int, int], bool]:
    """Return the registers that hold a quantity, with True for the signed ones."""
    found: dict[tuple[int, int], bool] = {}
    for parameter in profile.data.parameters:
        is_number = bool(parameter.unit) and not parameter.bits and not profile.names(parameter)
        if is_number and word_count(parameter) == 1:
            signed = is_signed_type(parameter)
            found[parameter.function, parameter.address] = signed
    return found


def add_trips(line: ReplayLine, device: int | None) -> None:
    """Add the trips of `device` that only the words of the record show to its events.

    Without a device, those of some drives. It reads files for a second a drive and day: in a thread
    that nobody waits for.
    """
    for each in line.devices[:MONITORED_IN_LEAD] if device is None else (device,):
        if line.state.status is LineStatus.CLOSED:
            return
        trips = _trips_of(tuple(line.files), each, named_profile(line, each).id)
        known = [
            event.utc for event in line.events if (event.device, event.kind) == (each, "fault")
        ]
        new = [
            trip for trip in trips if all(abs(trip.utc - utc) > SAME_TRIP_WITHIN for utc in known)
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
    found = {}
    for parameter in session.profile.data.parameters:
        place = parameter.function, parameter.address, word_count(parameter)
        with suppress(LineError):
            reply = line.newest_reply(session.device, *place)
            raw = from_words(parameter, reply.words)
            found[parameter.code] = Reading.undecoded(parameter, raw, reply.time, Origin.POLL)
    session.take(found)


async def pass_lead(
    line: ReplayLine,
    fleet: Fleet,
    device: int | None,
    monitor: Callable[[DriveConsole], None],
    period: float,
) -> None:
    """Go from the lead to the time of the replay, with all that happened on the way.

    `monitor` starts the monitor of the drive `device`; without one, of some drives for a while.
    """
    clock, drives = line.clock, fleet.consoles
    exact = line.in_step(device, max(clock.monotonic(), line.at - EXACT_LEAD), period)
    if clock.monotonic() < exact:
        clock.least_sleep = max(LEAD_SLEEP, float(len(drives)))
        await line.run_to(exact, LEAD_TAKES)
        clock.least_sleep = 0.0
    for console in drives:
        await asyncio.to_thread(_take_known, line, console.session)
    shown = [console for console in drives if device in (None, console.device)]
    for console in shown[:MONITORED_IN_LEAD]:
        monitor(console)
    await line.run_to(line.at, EXACT_TAKES)
    for console in shown[:MONITORED_IN_LEAD]:
        if device is None:
            console.monitor.stop()
        else:
            monitor(console)  # reads all values of this time, also those of the slow rate
    for console in drives:  # what was not read at the begin may have been read since
        await asyncio.to_thread(_take_known, line, console.session)
        fleet.line_watch.keep(console.session, console.monitor)
