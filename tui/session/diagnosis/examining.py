"""Complete examination of a drive's line: monitor, request, measure, and probe a gateway.

Nothing is ever written. If another master is detected first, nothing is sent at all.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from math import ceil, log

from tui.bus.api import DeviceCounters, LineCounters, LineStatus, ModbusLine
from tui.bus.errors import ONE_BEHIND, LineError, LineLost, RequestRefused
from tui.bus.line_events import LineEvent, StateChanged
from tui.bus.link import SerialLink, TcpLink
from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.profile.profile import Profile

from ..clock import REAL_CLOCK
from ..connect.identify import DriveIdentity, identify_drive
from ..connect.limits import limits_of
from ..connect.other_masters import LISTEN, Overheard, overheard
from .asking import FRAMES_COME_WITHIN, evidence_of_port, last_time, sight_of_drive
from .evidence import DiagnosticEvidence
from .gateway_probe import GATEWAY_REFUSALS, gateway_codes, probed
from .measure import measure_of
from .short_reads import ShortReads

SHORT_READS = 200
MEASURE_WITHIN = 6.0
"""Seconds that the reads may take."""
TRAFFIC = 8
"""Bytes without a frame from which nothing is sent: the length of the shortest read.

A master at another baud sends at least so many while it is monitored. Fewer are probably noise.
"""
EXCLUDED, RISK = 0.02, 0.05
"""Share of faulty replies that makes a line poor, and the risk of missing it after good reads
only."""
CLEAN_READS = ceil(log(RISK) / log(1 - EXCLUDED))
LEAST_READS = 50
"""Least number of reads in addition to the drive's replies of the last minute."""
PAUSED_READS, PAUSE, PAUSED_WITHIN = 16, 0.1, 4.0
"""Number of reads that distinguish copies of replies from a second drive's, the pause between them,
and their time limit, both in s."""
RECONNECTED_WITHIN = 3.0
"""Seconds within which a gateway accepts a new connection."""
CLOSED_MEANWHILE = "The line was closed during the reads."
IDLE = 3.0
"""Seconds without a request after which it shows whether a gateway closes idle connections."""


async def examine_line(
    line: ModbusLine,
    device: int,
    profile: Profile | None,
    *,
    changed: str = "",
    answering: Sequence[int] = (),
    reads: int = SHORT_READS,
) -> DiagnosticEvidence:
    """Collect all evidence about a drive and its line."""
    behind = [ONE_BEHIND in line.state.reason]

    def hear(event: LineEvent) -> None:
        if isinstance(event, StateChanged):
            behind.append(ONE_BEHIND in event.state.reason)

    unsubscribe = line.facts.events.subscribe(hear)
    try:
        sight = await _examined(line, device, profile, changed, answering, reads, behind)
    finally:
        unsubscribe()
    return replace(sight, behind=any(behind))


async def _examined(
    line: ModbusLine,
    device: int,
    profile: Profile | None,
    changed: str,
    answering: Sequence[int],
    reads: int,
    behind: Sequence[bool],
) -> DiagnosticEvidence:
    ready = line.state.status is LineStatus.CONNECTED
    others = Overheard()
    if ready and not isinstance(line.link, TcpLink):
        others = await _others(line)
    loose = 0 if others.has_frames or not others.text else others.loose
    if others.has_frames or loose >= TRAFFIC:
        seen = await asyncio.to_thread(evidence_of_port, line.link, device)
        return replace(seen, profile=profile, changed=changed, overheard=others.text, loose=loose)
    sight = await _requested(line, device, profile, changed, answering, reads, behind, ready=ready)
    return replace(sight, loose=loose)


async def _requested(
    line: ModbusLine,
    device: int,
    profile: Profile | None,
    changed: str,
    answering: Sequence[int],
    reads: int,
    behind: Sequence[bool],
    *,
    ready: bool,
) -> DiagnosticEvidence:
    """Return the evidence from requests; `ready` is True if the line was open before."""
    sight = await sight_of_drive(line, device, profile, changed=changed, neighbors=answering)
    cut = isinstance(sight.trouble, LineLost) and ready
    if cut and not isinstance(line.link, SerialLink) and await _connected_again(line):
        sight = await sight_of_drive(line, device, profile, changed=changed, neighbors=answering)
        cut = isinstance(sight.trouble, LineLost)
    if any(behind):
        return sight
    heard = sight.heard
    unreached = heard.nothing or not (heard.answered or set(heard.exceptions) - GATEWAY_REFUSALS)
    if not isinstance(line.link, SerialLink) and (cut or (heard.requested and unreached)):
        return replace(sight, works=await probed(line, device, beside=not heard.exceptions))
    # a good reply of the last minute: the baud and the format are correct, however few arrive now
    good = line.counters.devices.get(device, DeviceCounters()).minute.good
    if heard.answered or heard.functions or heard.misshapen or (good and not heard.nothing):
        return await _measured(line, sight, reads)
    return sight


async def _others(line: ModbusLine) -> Overheard:
    """Return the traffic of another master before the first request."""
    since = last_time(line.trace)
    await REAL_CLOCK.sleep(LISTEN)
    heard, ours = overheard(line.trace, since), _has_sent(line, since)
    if heard.text and not heard.has_frames and not ours:
        # a master sends as much again in the same time; noise comes at random
        await REAL_CLOCK.sleep(LISTEN)
        heard, ours = overheard(line.trace, since), _has_sent(line, since)
    # late replies and noise around polls of this computer are not traffic of another master
    return heard if heard.requests or not ours else Overheard()


def _has_sent(line: ModbusLine, since: float) -> bool:
    return any(frame.direction == "out" and frame.time > since for frame in line.trace)


async def _measured(line: ModbusLine, sight: DiagnosticEvidence, reads: int) -> DiagnosticEvidence:
    """Return the evidence with the shares of many reads."""
    device, since, profile, identity = sight.device, last_time(line.trace), sight.profile, None
    if profile is None:
        identity, profile = await _identified(line, device)
    count = partial(
        measure_of,
        device=device,
        tcp=isinstance(line.link, TcpLink),
        echoes=bool(sight.heard.echoed),
        unreached=gateway_codes(profile),
    )
    clean = clean_reads(line.counters, device)
    short = last = await _read(line, device, profile, reads, MEASURE_WITHIN, clean=clean)
    measure = count(short.frames, seconds=short.seconds)
    measure.turns = short.turns
    measure.swapped, measure.straight = short.swapped
    if measure.second or measure.duplicated:
        last = await _read(line, device, profile, PAUSED_READS, PAUSED_WITHIN, PAUSE)
        measure.decide(count(last.frames))
    sight = _with_end(line, sight, short.ended or last.ended)
    idle = 0.0
    if not isinstance(line.link, SerialLink) and sight.trouble is None:
        idle = IDLE
    others = overheard(line.trace, since)
    return replace(
        sight,
        identity=identity,
        measure=measure,
        overheard=others.text if others.requests else "",
        idle_closed=bool(idle) and await _closes_idle(line),
        idle=idle,
    )


def _with_end(
    line: ModbusLine, sight: DiagnosticEvidence, ended: LineError | None
) -> DiagnosticEvidence:
    """Return the evidence with the reason if the reads ended early, or if the line is lost now."""
    if isinstance(ended, RequestRefused):
        return replace(sight, withheld=str(ended))
    if ended is None and line.state.status is not LineStatus.CONNECTED:
        ended = LineLost(line.state.reason or CLOSED_MEANWHILE)
    return replace(sight, trouble=ended)


def clean_reads(counted: LineCounters, device: int) -> int:
    """Number of reads that are enough if all are good: so many replies exclude a poor line.

    Good replies of the last minute count if there were no faulty ones.
    """
    line = counted.minute
    own = counted.devices.get(device, DeviceCounters()).minute
    well = own.whole_share == 1.0 and line.share == 1.0 and not (line.foreign or line.strays)
    return max(LEAST_READS, CLEAN_READS - own.good * well)


async def _read(
    line: ModbusLine,
    device: int,
    profile: Profile | None,
    reads: int,
    within: float,
    pause: float = 0.0,
    clean: int | None = None,
) -> ShortReads:
    """Short reads, with their frames."""
    short = ShortReads(line, device, profile, last=last_time(line.trace))
    await short.read(reads, within, pause=pause, clean=clean)
    await REAL_CLOCK.sleep(FRAMES_COME_WITHIN)
    short.take_frames()
    return short


async def _identified(line: ModbusLine, device: int) -> tuple[DriveIdentity | None, Profile | None]:
    """Return the drive's identity, and its profile or the likeliest one."""
    try:
        found = await identify_drive(line, device)
        likely = found.profile or next(iter(found.candidates), None)
        profile = await asyncio.to_thread(library.load, likely) if likely else None
    except (LineError, DriveError):
        return None, None
    if profile is not None and found.profile:
        line.describe(device, limits_of(profile))
    return found, profile


async def _connected_again(line: ModbusLine) -> bool:
    """True once a lost line is connected; a gateway may have closed it because nothing was sent."""
    limit = REAL_CLOCK.monotonic() + RECONNECTED_WITHIN
    while line.state.status is not LineStatus.CONNECTED and REAL_CLOCK.monotonic() < limit:
        await REAL_CLOCK.sleep(FRAMES_COME_WITHIN / 10)
    return line.state.status is LineStatus.CONNECTED


async def _closes_idle(line: ModbusLine) -> bool:
    """True if the connection is closed in some seconds without requests."""
    lost: list[bool] = []

    def hear(event: LineEvent) -> None:
        if isinstance(event, StateChanged):
            lost.append(event.state.status is not LineStatus.CONNECTED)

    unsubscribe = line.facts.events.subscribe(hear)
    try:
        await REAL_CLOCK.sleep(IDLE)
    finally:
        unsubscribe()
    return any(lost)
