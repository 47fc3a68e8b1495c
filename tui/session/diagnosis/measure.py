"""Shares of lost, damaged, late, duplicated and foreign frames among many reads; pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from statistics import median

from tui.bus.trace import Frame
from tui.wire.frames import is_whole

from .heard import LATE_NOTE, REFUSED, REGISTER_READS, TCP_HEAD, due_bytes

SICK_KINDS = ("late", "lost", "damaged", "duplicated", "foreign")
DAMAGED_NOTE = "damaged"
TURNS = 2
"""Second replies, or returns of a value to an earlier one, that show two drives."""
SLOW_REPLIES = 0.25
"""Usual delay of the replies, in s, from which a missing one is taken for a late one."""


@dataclass(slots=True)
class Measure:
    """Counts of many short reads of one drive; `seconds` is the time they took."""

    asked: int = 0
    answered: int = 0
    lost: int = 0
    damaged: int = 0
    late: int = 0
    duplicated: int = 0
    foreign: int = 0
    behind: int = 0
    """Replies that fit the request before, and not their own."""
    second: int = 0
    """Second replies to one request, with another content."""
    turns: int = 0
    """Times that the reply to one request returned to an earlier content."""
    seconds: float = 0.0
    swapped: int = 0
    """Values that make sense with their bytes swapped, and not as they are."""
    straight: int = 0
    """Values of which the contrary is so."""

    def count(self, kind: str) -> int:
        """The number of frames that were sick in this way."""
        number: int = getattr(self, kind)
        return number

    @property
    def worst(self) -> str:
        """The most frequent trouble; empty for none."""
        worst = max(SICK_KINDS, key=self.count)
        return worst if self.count(worst) else ""

    @property
    def two_drives(self) -> bool:
        """True if two drives reply in turn, each with values of its own."""
        return self.second >= TURNS or (self.turns >= TURNS and self.damaged >= TURNS)


@dataclass(slots=True)
class _Exchange:
    request: bytes
    began: float
    replies: list[bytes] = field(default_factory=list)
    delay: float = 0.0
    """From the request to the first reply, in s."""
    sick: bool = False
    """True if it brought something, though no reply."""


def measure_of(
    frames: Iterable[Frame], device: int, seconds: float = 0.0, *, tcp: bool = False
) -> Measure:
    """The counts of the requests to a device among these frames, oldest first."""
    found, exchanges, ours = Measure(seconds=seconds), list[_Exchange](), False
    contents: dict[bytes, list[bytes]] = {}
    for frame in frames:
        body = frame.data[TCP_HEAD:] if tcp else frame.data
        if frame.direction == "out":
            ours = body[:1] == bytes([device])
            if ours:
                exchanges.append(_Exchange(body if tcp else body[:-2], frame.time))
        elif ours and frame.data != exchanges[-1].request:
            if not tcp and not is_whole(body):
                _loose(found, exchanges[-1], frame)
            elif tcp or body[:-2] != exchanges[-1].request:
                _whole(found, exchanges, body if tcp else body[:-2], frame, contents)
    for one in exchanges:
        found.asked += 1
        found.answered += bool(one.replies)
        found.lost += not one.replies and not one.sick
    delays = [one.delay for one in exchanges if one.replies]
    if delays and median(delays) >= SLOW_REPLIES:
        found.late, found.lost = found.late + found.lost, 0
    found.turns = sum(_turns(one) for one in contents.values())
    return found


def _loose(found: Measure, exchange: _Exchange, frame: Frame) -> None:
    """Bytes that form no frame: one damaged reply each."""
    found.damaged += 1
    if frame.note == DAMAGED_NOTE or not exchange.replies:
        exchange.sick = True


def _whole(
    found: Measure,
    exchanges: Sequence[_Exchange],
    body: bytes,
    frame: Frame,
    contents: dict[bytes, list[bytes]],
) -> None:
    now = exchanges[-1]
    before = exchanges[-2] if len(exchanges) > 1 else None
    if body[0] != now.request[0]:
        found.foreign += 1
        now.sick = True
    elif frame.note.startswith(LATE_NOTE) or now.replies:
        if before is not None and before.replies and _is_copy(body, now, before):
            found.duplicated += 1
        else:
            _stray(found, _owner(body, now, before), body)
    elif may_answer(body, now.request):
        now.replies.append(body)
        now.delay = frame.time - now.began
        contents.setdefault(now.request, []).append(body)
    else:
        now.sick = True
        found.behind += before is not None and may_answer(body, before.request)


def _is_copy(body: bytes, now: _Exchange, before: _Exchange) -> bool:
    """True if a frame, or the one that was taken for the reply, repeats the reply before."""
    taken = now.request != before.request and now.replies[:1] == before.replies[:1]
    return body == before.replies[0] or taken


def _owner(body: bytes, now: _Exchange, before: _Exchange | None) -> _Exchange:
    """The request to which a frame belongs that came when none was due."""
    if before is None or now.replies:
        return now
    older = body == before.replies[0] if before.replies else not before.sick
    return before if older else now


def _stray(found: Measure, to: _Exchange, body: bytes) -> None:
    """A whole frame when none was due: late if its request has no reply, else a second one."""
    if not to.replies:
        found.late += 1
        to.sick = True
    elif body == to.replies[0]:
        found.duplicated += 1
    else:
        found.second += 1


def may_answer(body: bytes, request: bytes) -> bool:
    """True if a frame may be the reply to a request, by its function and length."""
    if body[1] == request[1] | REFUSED:
        return True
    long = request[1] in REGISTER_READS and len(body) != due_bytes(request) - 2
    return body[1] == request[1] and not long


def _turns(bodies: Sequence[bytes]) -> int:
    """The number of times that an earlier content came again."""
    return sum(
        body != bodies[at - 1] and body in bodies[: at - 1]
        for at, body in enumerate(bodies)
        if at > 1
    )
