"""Matching of observed replies to their requests. No clock, no port.

On a serial line, a request and its reply may be the same bytes, without a sender. The last request
and its age show which one it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from ..frames import BIT_READS
from .splitting import REFUSAL, SAME_BOTH_WAYS, ObservedFrame, fits_reply, fits_request

ObservedAnswer = Literal["ok", "exception", "none", "damaged", "broadcast", "again", "unasked"]
"""Result of a request: `again` is a second reply, `unasked` a reply without a request."""
BROADCAST_DEVICE = 0
GIVEN_UP_AFTER = 3.0
"""Seconds after which a request counts as unanswered, even if no other follows."""
REPLY_WITHIN = 0.15
"""Seconds in which a frame that may be the reply or the repeated request counts as the reply."""
AGAIN_WITHIN = 0.05
"""Seconds in which a repeat of an unanswered write is a second reply."""
_ECHOED = {15: 5, 16: 5}
"""Number of bytes that a reply repeats from its request, by function; includes the function."""


@dataclass(frozen=True, slots=True)
class ObservedExchange:
    """A request with its result; requests and replies without device and checksum."""

    time: float
    """Time of the start of the request, or of a reply without a request, by the listener's
    clock."""
    device: int
    function: int
    answer: ObservedAnswer
    request: bytes = b""
    reply: bytes = b""
    turnaround: float | None = None
    """Seconds from the end of the request to the beginning of the reply; None if both were read at
    once."""
    noise: bytes = b""
    """Bytes after the request that form no frame."""
    waited: float | None = None
    """Seconds from the end of an unanswered request to the next request."""

    @property
    def exception(self) -> int | None:
        """Exception code of the reply; None if it is not an exception."""
        return self.reply[-1] if self.answer == "exception" else None

    @property
    def has_other_echo(self) -> bool:
        """True if the reply to a write repeats the address, but another value."""
        echoes = self.answer == "ok" and self.function in SAME_BOTH_WAYS
        return echoes and self.reply != self.request


@dataclass(slots=True)
class _OpenRequest:
    frame: ObservedFrame
    noise: bytes = b""


class Pairing:
    """Converts frames, in their order, to exchanges; each is returned when its result is known."""

    def __init__(self) -> None:
        self._requested: _OpenRequest | None = None
        self._last: ObservedExchange | None = None
        self._replied = float("-inf")
        """Time of the end of the last reply."""
        self._reply = b""
        """The last reply as it was on the line."""

    def is_due(self, device: int, function: int) -> bool:
        """Return True if a reply of a device to a function is due."""
        requested = self._requested.frame if self._requested is not None else None
        return requested is not None and (requested.device, requested.function) == (
            device,
            function,
        )

    def take(self, frame: ObservedFrame) -> tuple[list[ObservedExchange], bool | None]:
        """Take a frame; return the exchanges that are now known, and True if it is a request.

        The second value is None for noise.
        """
        if not frame.whole:
            if self._requested is not None:
                self._requested.noise += frame.data
            return [], None
        requested = self._requested
        if requested is not None and _answers(requested.frame, frame):
            return [self._answered(requested, frame)], False
        if not fits_request(frame.data):
            return [self._stray(frame)], False  # the due reply may still arrive
        found = self._given_up(frame)
        if frame.device == BROADCAST_DEVICE:
            return [*found, self._kept(_exchange(frame, "broadcast"))], True
        self._requested = _OpenRequest(frame)
        return found, True

    def wait(self, now: float, longest: float = GIVEN_UP_AFTER) -> list[ObservedExchange]:
        """Return the open request as unanswered if it has waited for `longest` seconds."""
        if self._requested is None or now - self._requested.frame.ended < longest:
            return []
        return self._given_up()

    def _answered(self, requested: _OpenRequest, frame: ObservedFrame) -> ObservedExchange:
        self._requested = None
        self._replied, self._reply = frame.ended, frame.data
        refused = bool(frame.function & REFUSAL)
        return self._kept(
            ObservedExchange(
                requested.frame.begun,
                frame.device,
                requested.frame.function,
                "exception" if refused else "ok",
                requested.frame.pdu,
                frame.pdu,
                None if frame.pause is None else max(0.0, frame.begun - requested.frame.ended),
                requested.noise,
            )
        )

    def _given_up(self, following: ObservedFrame | None = None) -> list[ObservedExchange]:
        """Return the open request as unanswered; `following` is the next request."""
        requested, self._requested = self._requested, None
        if requested is None:
            return []
        frame = requested.frame
        # a second drive at the same address answers a moment later
        if frame.data == self._reply and frame.begun - self._replied < AGAIN_WITHIN:
            return [self._again(frame)]
        answer: ObservedAnswer = "damaged" if requested.noise else "none"
        waited = max(0.0, following.begun - frame.ended) if following is not None else None
        return [self._kept(_exchange(frame, answer, requested.noise, waited))]

    def _stray(self, frame: ObservedFrame) -> ObservedExchange:
        """Return a reply without a request."""
        last = self._last
        same = last is not None and last.answer in ("ok", "exception", "again")
        function = frame.function & ~REFUSAL
        if same and last is not None and (last.device, last.function) == (frame.device, function):
            return self._again(frame)
        return ObservedExchange(frame.begun, frame.device, function, "unasked", b"", frame.pdu)

    def _again(self, frame: ObservedFrame) -> ObservedExchange:
        last = self._last
        assert last is not None
        return ObservedExchange(
            frame.begun, frame.device, last.function, "again", last.request, frame.pdu
        )

    def _kept(self, exchange: ObservedExchange) -> ObservedExchange:
        self._last = exchange
        return exchange


def _exchange(
    frame: ObservedFrame, answer: ObservedAnswer, noise: bytes = b"", waited: float | None = None
) -> ObservedExchange:
    """Return an exchange without a reply."""
    return ObservedExchange(
        frame.begun, frame.device, frame.function, answer, frame.pdu, noise=noise, waited=waited
    )


def _answers(requested: ObservedFrame, frame: ObservedFrame) -> bool:
    """Return True if a frame is the reply to a request, including exceptions."""
    if frame.device != requested.device or frame.function & ~REFUSAL != requested.function:
        return False
    if frame.function & REFUSAL:
        return True
    if not fits_reply(frame.data):
        return False
    function = frame.function
    if function in SAME_BOTH_WAYS:
        return frame.pdu[:3] == requested.pdu[:3] and not _repeated(requested, frame)
    if function in (1, 2, 3, 4, 23):
        words = int.from_bytes(requested.pdu[3:5], "big")
        return len(frame.pdu) == 2 + ((words + 7) // 8 if function in BIT_READS else 2 * words)
    if (count := _ECHOED.get(function)) is not None:
        return frame.pdu[:count] == requested.pdu[:count]
    return not _repeated(requested, frame)


def _repeated(requested: ObservedFrame, frame: ObservedFrame) -> bool:
    """Return True if a master has repeated an unanswered request."""
    return frame.data == requested.data and frame.begun - requested.ended > REPLY_WITHIN
