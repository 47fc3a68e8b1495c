"""Collection of evidence for a diagnosis: the port, its adapter, and a few reads of the drive.

Nothing is ever written, and the line keeps its baud and its format. The reads are sent with the
priority of an operator, by the process that owns the line; paused polling stays paused.
"""

from __future__ import annotations

import asyncio
import math
import os
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import replace

from tui.bus.api import Frame, LineStatus, ModbusLine, Priority
from tui.bus.errors import ExchangeError, LineError, LineLost, NoAnswer, RequestRefused
from tui.bus.expectation import IDENTIFY
from tui.bus.link import Link, SerialLink, TcpLink
from tui.bus.transport.port_errors import PortErrors
from tui.bus.transport.ports import see_port
from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.profile.profile import Profile

from ..clock import REAL_CLOCK
from ..connect.identify import status_words_without_identification
from ..connect.known_lines import line_name, load_memory
from ..connect.limits import limits_of
from .evidence import SAME_ADAPTER, AdapterSeen, DiagnosticEvidence
from .reply_evidence import ReplyEvidence, evidence_of_errors, evidence_of_frames

PROBE_TRIES = 3
"""Number of reads of a drive that answers, up to the first unanswered one."""
TRIES_IN_VAIN = 2
"""Number of reads of a drive that does not answer."""
SERIAL = "serial:"
FRAMES_COME_WITHIN = 0.5
"""Seconds within which the keeper of a line sends its frames."""
LATE_WITHIN = 1.0
"""Seconds within which a late reply to the last unanswered request arrives."""
Asks = Callable[[], Awaitable[object]]


def evidence_of_port(
    link: Link, device: int, trouble: LineError | None = None
) -> DiagnosticEvidence:
    """Return the evidence about a line without sending on it; reads files of the system."""
    port = see_port(link.path) if isinstance(link, SerialLink) else None
    return DiagnosticEvidence(link, device, trouble=trouble, port=port, adapter=adapter_of(link))


def adapter_of(link: Link) -> AdapterSeen:
    """Return where the adapter last used under the port's name is at present."""
    if not isinstance(link, SerialLink):
        return SAME_ADAPTER
    typed = os.path.abspath(link.path)
    before = load_memory().names.get(typed, "")
    was = before.removeprefix(SERIAL)
    if not before.startswith(SERIAL) or line_name(link).key == before:
        return SAME_ADAPTER
    if not os.path.exists(was):
        return AdapterSeen(was)
    now = os.path.realpath(was)
    # a permanent name of one adapter that leads to the same port is the same adapter
    return SAME_ADAPTER if now == os.path.realpath(typed) else AdapterSeen(was, now)


async def sight_of_drive(
    line: ModbusLine,
    device: int,
    profile: Profile | None,
    *,
    changed: str = "",
    neighbors: Sequence[int] = (),
) -> DiagnosticEvidence:
    """Send a drive on an open line a few requests, and return the evidence from the results."""
    seen = await asyncio.to_thread(evidence_of_port, line.link, device)
    seen = replace(seen, profile=profile, changed=changed, neighbors=tuple(neighbors))
    if _attached(line) and seen.port is not None:
        # the program that owns the line has the port, as it should
        seen = replace(seen, port=seen.port._replace(holder="", others=""))
    if line.state.status is not LineStatus.CONNECTED:
        return replace(seen, trouble=LineLost(line.state.reason or "The line is not open yet."))
    if profile is not None:
        line.describe(device, limits_of(profile))
    before, last = _errors_counted(line), last_time(line.trace)
    try:
        outcomes = await _outcomes(line, device, profile)
    except RequestRefused as error:
        return replace(seen, withheld=str(error))
    except LineError as error:
        return replace(seen, trouble=error)
    state = line.device_state(device)
    return replace(
        seen,
        heard=await _heard(line, device, last, outcomes),
        errors=_errors_counted(line).since(before),
        turnaround=state.usual_turnaround or state.turnaround,
    )


async def _outcomes(
    line: ModbusLine, device: int, profile: Profile | None
) -> list[LineError | None]:
    """Return the results of the reads, None for an answer. Raises an error other than the end of an
    exchange."""
    questions = await asyncio.to_thread(_questions, line, device, profile)
    outcomes: list[LineError | None] = []
    for question in questions[:TRIES_IN_VAIN]:
        outcomes.append(await _outcome(question))
        if outcomes[-1] is None:
            while len(outcomes) < PROBE_TRIES and outcomes[-1] is None:
                outcomes.append(await _outcome(question))
            break
    return outcomes


async def _outcome(question: Asks) -> LineError | None:
    try:
        await question()
    except ExchangeError as error:
        return error
    return None


def _questions(line: ModbusLine, device: int, profile: Profile | None) -> list[Asks]:
    """Return the requests for a drive: its state by its profile, else its identity, then states
    of families."""

    def read(address: int, function: int = 3) -> Asks:
        return lambda: line.read(
            device, address, 1, priority=Priority.OPERATOR_READ, function=function
        )

    def identify() -> Awaitable[object]:
        return line.identify(device, priority=Priority.OPERATOR_READ)

    if profile is None:
        return [identify, *(read(address) for address in status_words_without_identification())]
    status = profile.quantity("status_word") or next(iter(profile.parameters))
    first = read(status.address, status.function)
    # a request of another shape need not wait until a late answer to the first is ruled out
    return [first, identify if profile.function(IDENTIFY) is not None else first]


async def _heard(
    line: ModbusLine, device: int, last: float, outcomes: Sequence[LineError | None]
) -> ReplyEvidence:
    """Return the replies from the frames; from the results of the requests if frames are not
    recorded."""
    tcp = isinstance(line.link, TcpLink)
    if all(isinstance(outcome, NoAnswer) for outcome in outcomes):
        await REAL_CLOCK.sleep(LATE_WITHIN)
    if _attached(line):
        # replies come later than their requests
        await REAL_CLOCK.sleep(FRAMES_COME_WITHIN)
    heard = evidence_of_frames(
        (frame for frame in line.trace if frame.time > last), device, tcp=tcp
    )
    return heard if heard.requested >= len(outcomes) else evidence_of_errors(outcomes, device)


def last_time(frames: Sequence[Frame]) -> float:
    """Return the time of the latest frame; later frames are new."""
    return max((frame.time for frame in frames), default=-math.inf)


def _attached(line: ModbusLine) -> bool:
    """True if another program holds the line."""
    facts = line.facts
    return facts.voice is not None and facts.programs[0].id != facts.me.id


def _errors_counted(line: ModbusLine) -> PortErrors:
    counters = line.counters
    return PortErrors(counters.framing, counters.parity, counters.breaks, counters.overruns)


def profile_remembered(link: Link, device: int) -> Profile | None:
    """Return the profile last used for the drive at this address; None if unknown."""
    mark = load_memory().lines.get(line_name(link).key)
    drive = mark.drives.get(device) if mark is not None else None
    if drive is None or not drive.profile:
        return None
    try:
        return library.load(drive.profile)
    except DriveError:
        return None
