"""Many short reads of one drive, of several shapes, so that each reply identifies its request.

A line holds a request back while the late reply to a lost one could be taken for its own. So the
shapes alternate: a request of another length or function need not wait.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import inf
from secrets import randbelow

from tui.bus.api import LineStatus, ModbusLine, Priority
from tui.bus.errors import DeviceException, ExchangeError, LineError, RequestRefused
from tui.bus.expectation import IDENTIFY
from tui.bus.trace import Frame
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.drive.values import raw_range, word_count

from ..clock import REAL_CLOCK
from ..connect.identify import status_words_without_identification
from .reply_evidence import TCP_HEAD

FRAMES_AT_ONCE = 50
"""Number of reads after which their frames are collected: a line keeps only the last frames."""
CHECKED = 30
"""Number of parameters of each shape whose values are checked."""
SMALL = 0x0FFF
"""Greatest raw value of a parameter that shows whether its bytes are swapped."""
LONGEST_READ = 4
"""Words of the longest short read."""
PATIENCE, SLOWER = 0.3, 4.0
"""Least wait for a reply in s, and the wait as a multiple of the quickest reply."""
AFTER_A_MISS = 0.5
"""Seconds without a request after a missing reply, in which a late one may arrive."""
MISSES_IN_A_ROW = 6
"""Consecutive misses that are enough for a verdict; more would only cost time."""
DIAGNOSE, ECHO = 8, 0
REGISTERS = 3

ReadOnce = Callable[[], Awaitable[None]]


@dataclass(slots=True)
class _Shape:
    """Requests with replies of one form; `missed` is the time in s of the last one without a
    reply."""

    asks: Sequence[ReadOnce]
    times: int = 0
    missed: float = -inf


@dataclass(slots=True)
class ShortReads:
    """Reads of one drive; nothing is written. `ended` is the reason if they ended early."""

    line: ModbusLine
    device: int
    profile: Profile | None
    values: dict[str, tuple[Parameter, list[int]]] = field(default_factory=dict)
    """Values read from settings with small values, by code, oldest first."""
    frames: list[Frame] = field(default_factory=list)
    ended: LineError | None = None
    seconds: float = 0.0
    """Seconds that the reads took."""
    last: float = 0.0
    """Time of the last collected frame."""

    async def read(
        self, reads: int, within: float, *, pause: float = 0.0, clean: int | None = None
    ) -> None:
        """Read so many times, in turns of all shapes, within a time limit in seconds.

        `clean` reads are enough if none had a fault.
        """
        shapes, held, sick = _shapes(self), self.line.timing.late_reply, _sick(self.line)
        began, misses = REAL_CLOCK.monotonic(), 0
        for number in range(reads):
            now = REAL_CLOCK.monotonic()
            if (
                now > began + within
                or misses >= MISSES_IN_A_ROW
                or self.line.state.status is LineStatus.CLOSED
            ):
                break
            if number == clean and _sick(self.line) == sick and not self.swapped[0]:
                break
            free = [item for item in shapes if now - item.missed >= held]
            rarest = min(free, key=lambda entry: entry.times, default=None)
            shape = rarest or min(shapes, key=lambda entry: entry.missed)
            ask = shape.asks[shape.times % len(shape.asks)]
            shape.times += 1
            try:
                await ask()
                misses = 0
            except DeviceException:
                misses = 0
            except ExchangeError:
                shape.missed, misses = REAL_CLOCK.monotonic(), misses + 1
                await REAL_CLOCK.sleep(AFTER_A_MISS)
            except RequestRefused as error:
                shapes.remove(shape)
                if not shapes:
                    self.ended = error
                    break
            except LineError as error:
                self.ended = error
                break
            if pause:
                await REAL_CLOCK.sleep(pause)
            if number % FRAMES_AT_ONCE == FRAMES_AT_ONCE - 1:
                self.take_frames()
        self.seconds = REAL_CLOCK.monotonic() - began

    @property
    def patience(self) -> float | None:
        """Wait for the start of a reply in seconds; None before the first reply."""
        quickest = min(_delays(self.line.trace, self.device), default=None)
        return None if quickest is None else max(PATIENCE, SLOWER * quickest)

    def take_frames(self) -> None:
        """Collect the frames since the last call."""
        new = [frame for frame in self.line.trace if frame.time > self.last]
        if new:
            self.frames += new
            self.last = new[-1].time

    def note(self, parameters: Sequence[Parameter], words: Sequence[int]) -> None:
        """Store values that were read."""
        for parameter, raw in zip(parameters, words, strict=True):
            self.values.setdefault(parameter.code, (parameter, []))[1].append(raw)

    @property
    def swapped(self) -> tuple[int, int]:
        """Numbers of settings that are plausible only with swapped bytes, and only without
        swapping."""
        swapped = straight = 0
        for parameter, raws in self.values.values():
            low, high = raw_range(parameter)
            raw = raws[-1]
            fits = low <= raw <= high
            fits_turned = low <= ((raw & 0xFF) << 8 | raw >> 8) <= high
            swapped += fits_turned and not fits
            straight += fits and not fits_turned
        return swapped, straight

    @property
    def turns(self) -> int:
        """Number of times that a setting returned to an earlier value."""
        return sum(
            raw != raws[at - 1] and raw in raws[: at - 1]
            for _, raws in self.values.values()
            for at, raw in enumerate(raws)
            if at > 1
        )


def _sick(line: ModbusLine) -> int:
    """Return the number of faulty replies and refusals on the line so far."""
    now = line.counters
    missed = now.timeouts + now.checksum + now.wrong + now.exceptions
    return missed + now.stale + now.resyncs + now.framing + now.parity + now.breaks


def _delays(frames: Sequence[Frame], device: int) -> Iterator[float]:
    """Yield the seconds from each request to its reply."""
    for before, frame in pairwise(frames):
        replied = before.direction == "out" and frame.direction == "in" and not frame.note
        if replied and device in (before.data[0], *before.data[TCP_HEAD : TCP_HEAD + 1]):
            yield frame.time - before.time


def _shapes(reads: ShortReads) -> list[_Shape]:
    """Return the shapes that the drive is known to support; never empty."""
    line, device, profile = reads.line, reads.device, reads.profile

    def read(parameters: Sequence[Parameter]) -> ReadOnce:
        async def ask() -> None:
            address, count = parameters[0].address, len(parameters)
            reply = await line.read(
                device, address, count, priority=Priority.OPERATOR_READ, within=reads.patience
            )
            reads.note(parameters, reply.words)

        return ask

    async def identify() -> None:
        await line.identify(device, priority=Priority.OPERATOR_READ, within=reads.patience)

    async def echo() -> None:
        await line.diagnose(device, ECHO, randbelow(1 << 16), priority=Priority.OPERATOR_READ)

    async def status() -> None:
        address = next(iter(status_words_without_identification()), 0)
        await line.read(device, address, 1, priority=Priority.OPERATOR_READ, within=reads.patience)

    if profile is None:
        return [_Shape([identify]), _Shape([status])]
    runs = _runs(profile)
    shapes = [_Shape([read(pair) for pair in found]) for found in runs if found]
    diagnose = profile.function(DIAGNOSE)
    if diagnose is not None and ECHO in diagnose.subfunctions:
        shapes.append(_Shape([echo]))
    if len(shapes) == 1 and profile.function(IDENTIFY) is not None:
        shapes.append(_Shape([identify]))
    return shapes or [_Shape([status])]


def _runs(profile: Profile) -> list[list[tuple[Parameter, ...]]]:
    """Settings with small values at adjacent addresses, by the length of the run, from 1."""
    small = {
        parameter.address: parameter
        for parameter in profile.parameters
        if "w" in parameter.access
        and word_count(parameter) == 1
        and parameter.function == REGISTERS
        and raw_range(parameter)[0] >= 0 and raw_range(parameter)[1] <= SMALL
    }  # fmt: skip
    reading = profile.function(REGISTERS)
    most = (reading.max_read if reading is not None else None) or 1
    longest = 1 if profile.data.reading.single_words_only else min(LONGEST_READ, most)
    found = []
    for length in range(1, longest + 1):
        runs = (tuple(small.get(at + step) for step in range(length)) for at in small)
        whole = [tuple(parameter for parameter in run if parameter is not None) for run in runs]
        found.append([run for run in whole if len(run) == length][:CHECKED])
    return found
