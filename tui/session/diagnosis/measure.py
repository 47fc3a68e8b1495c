"""Shares of lost, damaged, late, duplicated and foreign frames among many reads; pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, field
from statistics import median

from tui.bus.trace import Frame
from tui.wire.frames import is_whole

from .reply_evidence import (
    LATE_NOTE,
    REFUSED,
    REGISTER_READS,
    TCP_HEAD,
    due_bytes,
    is_whole_tcp,
)

SICK_KINDS = (
    "late", "lost", "damaged", "duplicated", "surplus", "foreign", "unreached", "stray",
)  # fmt: skip
DAMAGED_NOTE = "damaged"
TURNS = 2
"""Number of second replies, or of returns of a setting to an earlier value, that indicates two
drives."""
SLOW_REPLIES = 0.25
"""Usual delay of the replies, in s, from which a missing reply counts as late."""
RECENT = 6
"""Number of last requests to which an unexpected frame may belong."""
PROMPT = 0.15
"""Seconds after a request within which a line that is one behind sends the older reply."""
DIAGNOSE = 8
TRANSACTION_BYTES = 2
"""Length of the transaction identifier of Modbus TCP, in bytes."""


@dataclass(slots=True)
class Measure:
    """Counts of many short reads of one drive; `seconds` is the time they took."""

    requested: int = 0
    answered: int = 0
    refused: int = 0
    """Number of `answered` requests whose reply was an exception."""
    lost: int = 0
    damaged: int = 0
    late: int = 0
    duplicated: int = 0
    foreign: int = 0
    unreached: int = 0
    """Refusals of a gateway that did not reach the drive."""
    behind: int = 0
    """Replies that match the previous request, and not their own."""
    second: int = 0
    """Second replies to one request with different content."""
    surplus: int = 0
    """Second replies with other content that are not known to be copies or a second drive's."""
    stray: int = 0
    """Intact replies with bytes before or after them that form no frame."""
    turns: int = 0
    """Times that a setting returned to an earlier value."""
    seconds: float = 0.0
    swapped: int = 0
    """Values that are plausible only with their bytes swapped."""
    straight: int = 0
    """Values that are plausible only without swapping."""

    def count(self, kind: str) -> int:
        """Return the number of frames with this fault."""
        number: int = getattr(self, kind)
        return number

    @property
    def worst(self) -> str:
        """The most frequent fault; empty if there is none."""
        worst = max(SICK_KINDS, key=self.count)
        return worst if self.count(worst) else ""

    @property
    def two_drives(self) -> bool:
        """True if two drives reply in turn, each with its own values."""
        collided = self.damaged + self.stray
        return self.second >= TURNS or (self.turns >= TURNS and collided >= TURNS)

    @property
    def has_values(self) -> bool:
        """True if a reply was not an exception."""
        return self.answered > self.refused

    @property
    def one_behind(self) -> bool:
        """True if each request gets the reply to the one before, and a repeated request gets its
        own."""
        return self.behind > 1 and self.behind > self.late and self.behind * 3 >= self.requested

    def decide(self, paused: Measure) -> None:
        """Decide from reads with pauses if surplus replies are copies or a second drive's.

        Without a pause, a copy may arrive during the next request and be taken for its reply.
        """
        if paused.second >= TURNS:
            self.second = paused.second
            return
        second, self.second = max(self.second, paused.second), 0
        if not paused.second and (self.duplicated or paused.duplicated):
            self.duplicated += second
        else:
            self.surplus = second


@dataclass(slots=True)
class _Exchange:
    request: bytes
    began: float
    transaction: bytes = b""
    replies: list[bytes] = field(default_factory=list)
    delay: float = 0.0
    """From the request to the first reply, in s."""
    sick: bool = False
    """True if bytes arrived, but no valid reply."""
    damaged: bool = False
    """True if bytes outside any frame arrived."""
    broken: bool = False
    """True if the reply itself was damaged."""
    older: str = ""
    """Kind of an immediate reply to the previous request, unless all replies are one behind."""


def measure_of(
    frames: Iterable[Frame],
    device: int,
    seconds: float = 0.0,
    *,
    tcp: bool = False,
    echoes: bool = False,
    unreached: Collection[int] = (),
) -> Measure:
    """Return the counts of the requests to a device among these frames, oldest first.

    With `echoes`, the adapter repeats sent bytes, so that echoes by function 8 are not judged.
    `unreached` are the exceptions by which a gateway reports that it did not reach the drive.
    """
    frames = list(frames)
    polled = {_body(item, tcp)[:1] for item in frames if item.direction == "out"}
    found, exchanges, ours = Measure(seconds=seconds), list[_Exchange](), False
    for frame in frames:
        body = _body(frame, tcp)
        if frame.direction == "out":
            ours = body[:1] == bytes([device]) and not (echoes and body[1] == DIAGNOSE)
            if ours:
                exchanges.append(_Exchange(body, frame.time, frame.data[: TRANSACTION_BYTES * tcp]))
        elif not ours or _is_echo(frame, body, exchanges[-1]):
            continue
        elif not (is_whole_tcp(frame.data) if tcp else is_whole(frame.data)):
            _loose(exchanges[-1], frame)
        elif body[0] == device and body[1] & REFUSED and body[-1] in unreached:
            found.unreached += 1
            exchanges[-1].sick = True
        elif body[0] == device:
            _whole(found, exchanges[-RECENT:], body, frame)
        elif body[:1] not in polled:
            found.foreign += 1
            exchanges[-1].sick = True
    for exchange in exchanges:
        _end(found, exchange)
    delays = [exchange.delay for exchange in exchanges if exchange.replies]
    if delays and median(delays) >= SLOW_REPLIES:
        # a surplus reply answers an earlier request there
        found.late += found.lost + found.duplicated + found.second
        found.lost = found.duplicated = found.second = 0
    return found


def _end(found: Measure, exchange: _Exchange) -> None:
    """Count a completed exchange."""
    found.requested += 1
    found.answered += bool(exchange.replies)
    found.refused += bool(exchange.replies) and bool(exchange.replies[0][1] & REFUSED)
    if exchange.damaged:
        kind = "damaged" if exchange.broken or not exchange.replies else "stray"
        setattr(found, kind, found.count(kind) + 1)
    found.lost += not exchange.replies and not exchange.sick
    if exchange.older and (exchange.replies or exchange.damaged or exchange.older == "second"):
        setattr(found, exchange.older, found.count(exchange.older) + 1)
    elif exchange.older:
        found.behind += 1


def _body(frame: Frame, tcp: bool) -> bytes:
    """Address, function and data."""
    return frame.data[TCP_HEAD:] if tcp else frame.data[:-2]


def _is_echo(frame: Frame, body: bytes, exchange: _Exchange) -> bool:
    return body == exchange.request and body[1:2] != bytes([DIAGNOSE])


def _loose(exchange: _Exchange, frame: Frame) -> None:
    """Note bytes outside any frame: a damaged reply, or stray bytes beside an intact one."""
    exchange.damaged = True
    exchange.broken = exchange.broken or frame.note == DAMAGED_NOTE
    if frame.note == DAMAGED_NOTE or not exchange.replies:
        exchange.sick = True


def _whole(found: Measure, recent: Sequence[_Exchange], body: bytes, frame: Frame) -> None:
    """Count an intact frame of the drive: the reply, or a surplus one to a recent request."""
    now, before = recent[-1], recent[-2] if len(recent) > 1 else None
    due = not now.replies and not frame.note.startswith(LATE_NOTE)
    if due and may_answer(body, now.request):
        now.replies.append(body)
        now.delay = frame.time - now.began
        return
    now.sick = now.sick or due
    prompt = due and frame.time - now.began < PROMPT
    if prompt and before is not None and may_answer(body, before.request):
        known = "duplicated" if body in before.replies else "second"
        now.older = known if before.replies else "late"
        before.sick = True
        return
    if now.transaction:
        recent = [
            exchange
            for exchange in recent
            if exchange.transaction == frame.data[:TRANSACTION_BYTES]
        ]
    fits = [exchange for exchange in reversed(recent) if may_answer(body, exchange.request)]
    missing = [fit for fit in fits if not fit.replies and not fit.sick]
    if missing:
        found.late += 1
        missing[0].sick = True
    elif any(body in fit.replies for fit in fits):
        found.duplicated += 1
    elif fits:
        found.second += 1


def may_answer(body: bytes, request: bytes) -> bool:
    """True if a frame may be the reply to a request, by its function and length."""
    if body[1] == request[1] | REFUSED:
        return True
    if request[1] == DIAGNOSE:
        return body == request
    long = request[1] in REGISTER_READS and len(body) != due_bytes(request) - 2
    return body[1] == request[1] and not long
