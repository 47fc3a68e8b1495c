"""True if another master polls drives on a line: heard before the first request, and during the
search."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from tui.bus.api import ModbusLine
from tui.bus.errors import LineError
from tui.bus.trace import Frame
from tui.wire.frames import is_whole
from tui.wire.overheard import OverheardRequest, overheard_request

from ..clock import REAL_CLOCK, Clock
from .addresses import addresses_text

LISTEN = 1.5
"""Seconds that a line is listened to before the first request: a master's cycle is shorter."""
TALK = 4
"""Fewer loose bytes than the shortest frame has are not worth the name of somebody's talk."""
TOLD_OF_EACH = 3
"""Number of different requests to one address that are listed."""
NOT_AWAITED = ("late or repeated", "noise")
"""Notes of what came in while nothing was due."""


class OtherMaster(LineError):
    """Another master talks on the line; two of them disturb each other."""


@dataclass(frozen=True, slots=True)
class Overheard:
    """Traffic of other masters on a line."""

    requests: tuple[OverheardRequest, ...] = ()
    answered: tuple[int, ...] = ()
    """Addresses that answered somebody."""
    loose: int = 0
    """Bytes that form no frame at this baud and format."""

    @property
    def text(self) -> str:
        """The other master in a sentence: its requests by address; empty if there is none."""
        if self.requests:
            requested = dict.fromkeys(request.device for request in self.requests)
            reported = "; ".join(f"address {device}: {self._of(device)}" for device in requested)
            return f"Another master polls drives on this line. {reported[0].upper()}{reported[1:]}."
        if self.answered:
            who = addresses_text(self.answered)
            return f"Another master polls drives on this line: {who} answered it."
        if self.loose >= TALK:
            return (
                f"Another device sends on this line at another baud or format: {self.loose} bytes"
                " that"
                " form no frame."
            )
        return ""

    def _of(self, device: int) -> str:
        """Return the requests to one address."""
        texts = list(
            dict.fromkeys(request.text for request in self.requests if request.device == device)
        )
        more = len(texts) - TOLD_OF_EACH
        return ", ".join(texts[:TOLD_OF_EACH]) + (f" and {more} more" if more > 0 else "")


def overheard(frames: Iterable[Frame], since: float) -> Overheard:
    """Return the traffic of others since a time of the line's clock; our own echoes do not
    count."""
    ours: set[bytes] = set()
    requests: list[OverheardRequest] = []
    answered: dict[int, None] = {}
    loose = 0
    for frame in frames:
        if frame.direction == "out":
            ours.add(frame.data)
        elif frame.time < since or frame.data in ours:
            continue
        elif is_whole(frame.data):
            request = overheard_request(frame.data)
            if request is not None and not frame.note.startswith("echo") and frame.note:
                requests.append(request)
            elif frame.note.startswith(NOT_AWAITED):
                answered[frame.data[0]] = None
        elif frame.note.startswith(NOT_AWAITED):
            loose += len(frame.data)
    return Overheard(tuple(requests), tuple(answered), loose)


async def listen_first(
    line: ModbusLine, seconds: float = LISTEN, clock: Clock = REAL_CLOCK
) -> Overheard:
    """Listen to a line. Drives that are polled meanwhile are not taken for others' talk."""
    since, before = _last_time(line.trace), line.counters.bytes_in
    await clock.sleep(seconds)
    found = overheard(line.trace, since)
    new = [frame for frame in line.trace if frame.time >= since]
    if found.text or any(frame.direction == "out" for frame in new):
        return found
    # bytes that are no frame yet: the listening ended in the midst of somebody's talk
    framed = sum(len(frame.data) for frame in new)
    return Overheard(loose=found.loose + line.counters.bytes_in - before - framed)


class MasterDetector:
    """Looks for requests of other masters while drives are searched for."""

    def __init__(self, line: ModbusLine) -> None:
        self._line = line
        self._since = _last_time(line.trace)

    def look(self) -> None:
        """Raise OtherMaster where somebody else has asked a drive meanwhile."""
        found = overheard(self._line.trace, self._since)
        if found.requests:
            raise OtherMaster(found.text)


def _last_time(frames: Sequence[Frame]) -> float:
    """The time behind which a frame is new."""
    return frames[-1].time + 1e-9 if frames else 0.0
