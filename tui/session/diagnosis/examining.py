"""A whole examination of a drive's line: listen, ask, measure, and what a gateway may be instead.

Nothing is ever written. Where another master is heard first, nothing is sent at all.
"""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import replace

from tui.bus.api import LineStatus, ModbusLine, Priority
from tui.bus.errors import ExchangeError, LineError, LineLost
from tui.bus.link import RtuTcpLink, SerialLink, TcpLink
from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.drive.values import raw_range, word_count

from ..clock import REAL_CLOCK
from ..connect.identify import identify_drive, status_words_without_identification
from ..connect.other_masters import LISTEN, overheard
from .asking import FRAMES_COME_WITHIN, last_time, sight_of_drive, sight_of_port
from .gateway_probe import Works, probed
from .measure import measure_of
from .sight import Sight

SHORT_READS = 200
MEASURE_WITHIN = 8.0
"""Seconds that the reads may take."""
FRAMES_AT_ONCE = 50
"""Reads after which their frames are taken: a line keeps the last ones only."""
IDLE = 3.0
"""Seconds without a request in which a gateway shows that it closes idle connections."""
CHECKED = 30
"""Parameters whose values are looked at."""
SMALL = 0x0FFF
"""The greatest raw value of a parameter that shows whether its bytes are swapped."""


async def examine_line(
    line: ModbusLine,
    device: int,
    profile: Profile | None,
    *,
    changed: str = "",
    answering: Sequence[int] = (),
    reads: int = SHORT_READS,
) -> Sight:
    """Everything that is seen of a drive and its line."""
    ready = line.state.status is LineStatus.CONNECTED
    if ready and not isinstance(line.link, TcpLink) and (others := await _others(line)):
        seen = await asyncio.to_thread(sight_of_port, line.link, device)
        return replace(seen, profile=profile, changed=changed, overheard=others)
    sight = await sight_of_drive(line, device, profile, changed=changed, neighbours=answering)
    heard = sight.heard
    cut = isinstance(sight.trouble, LineLost) and ready
    if not isinstance(line.link, SerialLink) and (cut or (heard.asked and heard.nothing)):
        return replace(sight, works=await _probed(line, device))
    if heard.answered or heard.functions or heard.misshapen:
        return await _measured(line, sight, reads)
    return sight


async def _others(line: ModbusLine) -> str:
    """Another master that is heard before the first request, in a sentence; empty for none."""
    since = last_time(line.trace)
    await REAL_CLOCK.sleep(LISTEN)
    heard = overheard(line.trace, since)
    ours = any(frame.direction == "out" and frame.time > since for frame in line.trace)
    # late replies and noise around polls of this computer are no talk of another master
    return heard.text if heard.requests or not ours else ""


async def _probed(line: ModbusLine, device: int) -> Works | None:
    assert isinstance(line.link, TcpLink | RtuTcpLink)
    return await probed(line.link, device)


async def _measured(line: ModbusLine, sight: Sight, reads: int) -> Sight:
    """The sight with the shares of many reads."""
    device, tcp = sight.device, isinstance(line.link, TcpLink)
    profile = sight.profile or await _identified(line, device)
    began, since = REAL_CLOCK.monotonic(), last_time(line.trace)
    frames, last = [], since
    values: list[tuple[Parameter, int]] = []
    pool = _pool(profile)
    for number in range(reads):
        if (
            REAL_CLOCK.monotonic() - began > MEASURE_WITHIN
            or line.state.status is LineStatus.CLOSED
        ):
            break
        one = pool[number // 2 % len(pool)] if pool and number % 2 else None
        try:
            raw = await _read(line, device, profile, one, number)
        except ExchangeError:
            raw = None
        except LineError:
            break
        if one is not None and raw is not None:
            values.append((one, raw))
        if number % FRAMES_AT_ONCE == FRAMES_AT_ONCE - 1:
            frames += [frame for frame in line.trace if frame.time > last]
            last = last_time(frames) if frames else last
    seconds = REAL_CLOCK.monotonic() - began
    await REAL_CLOCK.sleep(FRAMES_COME_WITHIN)
    frames += [frame for frame in line.trace if frame.time > last]
    measure = measure_of(frames, device, seconds, tcp=tcp)
    measure.swapped, measure.straight = _swapped(values)
    others = overheard(line.trace, since)
    return replace(
        sight,
        measure=measure,
        overheard=others.text if others.requests else "",
        idle_closed=not isinstance(line.link, SerialLink) and await _closes_idle(line),
    )


async def _identified(line: ModbusLine, device: int) -> Profile | None:
    try:
        found = await identify_drive(line, device)
        likely = found.profile or next(iter(found.candidates), None)
        return await asyncio.to_thread(library.load, likely) if likely else None
    except (LineError, DriveError):
        return None


def _pool(profile: Profile | None) -> list[Parameter]:
    """Settings whose values are small, so that swapped bytes are seen."""
    if profile is None:
        return []
    return [
        one
        for one in profile.parameters
        if "w" in one.access and word_count(one) == 1 and raw_range(one)[0] >= 0
        and raw_range(one)[1] <= SMALL and one.function == 3
    ][:CHECKED]  # fmt: skip


async def _read(
    line: ModbusLine, device: int, profile: Profile | None, one: Parameter | None, number: int
) -> int | None:
    """One short read; a drive of which nothing is known identifies itself every other time."""
    status = profile.quantity("status_word") if profile is not None else None
    if one is None and status is None and number % 2:
        await line.identify(device, priority=Priority.OPERATOR_READ)
        return None
    known = one or status
    address, function = (known.address, known.function) if known is not None else (_any(), 3)
    reply = await line.read(device, address, 1, priority=Priority.OPERATOR_READ, function=function)
    return reply.words[0]


def _any() -> int:
    return next(iter(status_words_without_identification()), 0)


def _swapped(values: Sequence[tuple[Parameter, int]]) -> tuple[int, int]:
    """Parameters that make sense with swapped bytes alone, and as they are alone."""
    swapped, straight = set[str](), set[str]()
    for one, raw in values:
        low, high = raw_range(one)
        turned = (raw & 0xFF) << 8 | raw >> 8
        fits, fits_turned = low <= raw <= high, low <= turned <= high
        if fits != fits_turned:
            (straight if fits else swapped).add(one.code)
    return len(swapped), len(straight)


async def _closes_idle(line: ModbusLine) -> bool:
    """True if the connection is closed in some seconds without requests."""
    lost: list[bool] = []
    end = line.on_state(lambda state: lost.append(state.status is not LineStatus.CONNECTED))
    try:
        await REAL_CLOCK.sleep(IDLE)
    finally:
        end()
    return any(lost)
