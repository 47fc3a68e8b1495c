"""Detection of another master on a line: before the first request, and during the search."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from tui.bus.api import ModbusLine
from tui.bus.errors import LineError
from tui.bus.trace import Frame
from tui.drive.sentences import counted, first_of
from tui.wire.frames import is_whole
from tui.wire.overheard import OverheardRequest, overheard_request

from ..clock import REAL_CLOCK, Clock
from .addresses import addresses_text

LISTEN = 1.5
"""Seconds for which a line is monitored before the first request: longer than a master's cycle."""
TALK = 4
"""Least loose bytes that count as traffic: the length of the shortest frame."""
TEXTS_OF_EACH = 3
"""Number of different requests to one address that are listed."""
NOT_AWAITED = ("late or repeated", "noise")
"""Notes on frames that arrived while no reply was due."""


_ANSWERED_ONE = "Another master polls drives on this line: address {who} answered it."
_ANSWERED_SEVERAL = "Another master polls drives on this line: addresses {who} answered it."


class OtherMaster(LineError):
    """Another master polls on the line; two masters disturb each other."""


@dataclass(frozen=True, slots=True)
class Overheard:
    """Traffic of other masters on a line."""

    requests: tuple[OverheardRequest, ...] = ()
    answered: tuple[int, ...] = ()
    """Addresses that answered another master."""
    loose: int = 0
    """Bytes that form no frame at this baud and format."""

    @property
    def has_frames(self) -> bool:
        """True if a frame of another master was heard."""
        return bool(self.requests or self.answered)

    @property
    def text(self) -> str:
        """The other master in a sentence: its requests by address; empty if there is none."""
        if self.requests:
            requested = dict.fromkeys(request.device for request in self.requests)
            reported = [f"Address {device}: {self._of(device)}." for device in requested]
            return " ".join(["Another master polls drives on this line.", *reported])
        if self.answered:
            who = addresses_text(self.answered)
            return counted(len(self.answered), _ANSWERED_ONE, _ANSWERED_SEVERAL, who=who)
        if self.loose >= TALK:
            return (
                f"Received {self.loose} bytes that form no frame: another device sends at another"
                " baud or format, or it is noise."
            )
        return ""

    def _of(self, device: int) -> str:
        """Return the requests to one address."""
        texts = dict.fromkeys(request.text for request in self.requests if request.device == device)
        return first_of([*texts], TEXTS_OF_EACH)


def overheard(frames: Iterable[Frame], since: float) -> Overheard:
    """Return the traffic of others after a time of the line's clock; own echoes do not count."""
    ours: set[bytes] = set()
    requests: list[OverheardRequest] = []
    answered: dict[int, None] = {}
    loose = 0
    for frame in frames:
        if frame.direction == "out":
            ours.add(frame.data)
        elif frame.time <= since or frame.data in ours:
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
    """Monitor a line for some seconds; drives that are polled by Drive Panel do not count."""
    since, before = _last_time(line.trace), line.counters.bytes_in
    await clock.sleep(seconds)
    found = overheard(line.trace, since)
    new = [frame for frame in line.trace if frame.time > since]
    if found.text or any(frame.direction == "out" for frame in new):
        return found
    # an incomplete frame: monitoring ended in the middle of another master's traffic
    framed = sum(len(frame.data) for frame in new)
    return Overheard(loose=found.loose + line.counters.bytes_in - before - framed)


class MasterDetector:
    """Detector of other masters' requests during a search."""

    def __init__(self, line: ModbusLine) -> None:
        self._line = line
        self._since = _last_time(line.trace)

    def look(self) -> None:
        """Raise OtherMaster if another master has polled a drive since the last call."""
        found = overheard(self._line.trace, self._since)
        if found.requests:
            raise OtherMaster(found.text)


def _last_time(frames: Sequence[Frame]) -> float:
    """Time of the latest frame; later frames are new."""
    return frames[-1].time if frames else -math.inf
