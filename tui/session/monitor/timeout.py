"""A drive's communication timeout: its length, its reaction, and whether it is active."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from tui.bus.api import Priority
from tui.bus.errors import NoAnswer
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import CommunicationFault
from tui.drive.sentences import counted, sentence

from ..drive import DriveSession
from ..read.presence import look_for_drive, meets_silence
from ..read.reader import Reader
from ..reading import Reading
from ..timeout_report import Timeout, TimeoutWatch


@dataclass(frozen=True, slots=True)
class TimeoutWarning:
    """Drive without a reply for a large part of its timeout; times in seconds."""

    device: int
    profile: Profile
    silent: float
    watch: TimeoutWatch

    @property
    def left(self) -> float:
        """Seconds until the drive reacts; negative if it has reacted."""
        return self.watch.timeout - self.silent


_NO_TIMEOUT = (
    "{drives}: without communication it goes on: it has no timeout.",
    "{drives}: without communication each goes on: it has no timeout.",
)
_GOES_ON = (
    "{drives}: without communication it goes on: its reaction is {reaction}.",
    "{drives}: without communication each goes on: its reaction is {reaction}.",
)
_ACTS = (
    "{drives}: on loss of communication it acts {seconds:g} s after the last request: {reaction}",
    "{drives}: on loss of communication each acts {seconds:g} s after the last request: {reaction}",
)


def polling_stop_text(*sessions: DriveSession, watch: TimeoutWatch | None) -> str:
    """Return a sentence with the reaction of drives of one family when polling stops."""
    count, names = len(sessions), names_of(sessions)
    if watch is None:
        return counted(count, *_NO_TIMEOUT, drives=names)
    if watch.reaction is not None and not watch.acts:
        return counted(count, *_GOES_ON, drives=names, reaction=watch.reaction.name)
    does = sentence(watch.reaction.does) if watch.reaction else "its own reaction follows."
    return counted(count, *_ACTS, drives=names, seconds=watch.timeout, reaction=does)


def names_of(sessions: Sequence[DriveSession]) -> str:
    """Return the device addresses and the family name of drives of one family."""
    devices = ", ".join(str(session.device) for session in sessions)
    single, several = "Device {devices}, {family}", "Devices {devices}, {family}"
    return counted(len(sessions), single, several, devices=devices, family=sessions[0].profile.name)


async def read_timeout(reader: Reader, priority: Priority, besides: Sequence[str] = ()) -> Timeout:
    """Read a drive's communication timeout and reaction; `besides` are codes to read with them.

    Raises the line's errors.
    """
    session = reader.session
    rules = session.profile.data.communication_fault
    if rules is None or not rules.timeout:
        return Timeout(known=True)
    readings = await timeouts_of_ports(reader, rules, priority)
    found = await reader.read([*_related_words(session, rules), *besides], priority=priority)
    reported = [reading for reading in readings if reading.raw is not None]
    running = [
        (timeout_seconds(reading, rules.off), reading.parameter.code) for reading in reported
    ]
    shortest = min(((s, code) for s, code in running if s is not None), default=None)
    if shortest is None:
        return Timeout(known=bool(reported))
    raw = found[rules.reaction].raw if rules.reaction else None
    reaction = next((item for item in rules.reactions if item.raw == raw), None)
    faults = {fault_code.raw: fault_code.code for fault_code in session.profile.data.faults.codes}
    trips = reaction is None or reaction.trips
    fault = faults.get(rules.fault, "") if trips and rules.fault is not None else ""
    sure = rules.starts_confidence != "unverified"
    watch = TimeoutWatch(shortest[0], reaction, code=shortest[1], fault=fault, sure=sure)
    return Timeout(True, replace(watch, active=watch.acts and has_begun(session)))


async def timeouts_of_ports(
    reader: Reader, rules: CommunicationFault, priority: Priority
) -> list[Reading]:
    """Read the timeout of each port of a drive; the drive may not answer for a port it lacks.

    Raises the line's errors; NoAnswer only if the drive does not answer at all, or if its family
    answers every read and no timeout was read.
    """
    found: list[Reading] = []
    silent: NoAnswer | None = None
    image = reader.session.image
    for code in (rules.timeout, *rules.other_timeouts):
        try:
            found += (await reader.read([code], priority=priority)).values()
        except NoAnswer as error:
            if error.retry_in is not None:
                raise
            await look_for_drive(reader.session, error)
            silent, now = error, reader.session.clock.monotonic()
            # `silent` only after the second time: one lost reply does not mean a missing word
            again = code in image.refused
            image.take({code: Reading.bad(reader.profile[code], now, str(error), silent=again)})
    if silent is not None and not found and not meets_silence(reader.profile):
        raise silent
    return found


def _related_words(session: DriveSession, rules: CommunicationFault) -> list[str]:
    """Return the codes of the words that show the reaction, and whether the timeout is active."""
    codes = [rules.reaction] if rules.reaction else []
    if rules.needs_write and not session.reported_by_line:
        codes += [chart.command for chart in session.profile.data.charts if chart.command]
    return list(dict.fromkeys(codes))


def timeout_now(session: DriveSession) -> Timeout:
    """Return a drive's known timeout; its watch is active if it has begun since the last read."""
    found = session.timeout or Timeout(known=False)
    if found.watch is not None and found.watch.acts and has_begun(session):
        return replace(found, watch=replace(found.watch, active=True))
    return found


def has_begun(session: DriveSession) -> bool:
    """Return True if a drive's communication timeout has begun, as far as known.

    In some families it begins when any master writes a command or reference. A word in the drive
    that is not 0 shows such a write, and this program knows its own.
    """
    rules = session.profile.data.communication_fault
    if rules is None or not rules.needs_write or session.reported_by_line:
        return True
    raws = session.image.trusted
    profile = session.profile
    written = [chart.command for chart in profile.data.charts]
    written += [reference.parameter for reference in profile.data.references]
    return any(raws.get(code) for code in written)


def timeout_seconds(reading: Reading, off: int | None) -> float | None:
    """Return the timeout in seconds; None if it is off or could not be read."""
    number = reading.number
    if reading.raw is None or reading.raw == off or not number:
        return None
    return number / 1000 if reading.unit == "ms" else number
