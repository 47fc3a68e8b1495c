"""One RTU request and the bytes that come back for it: their meaning, and when it is certain.

Knows no clock and no port: its caller passes it bytes, silence and the timeout.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from tui.wire.frames import MAX_FRAME, frame_ends, is_whole

from ..expectation import EXCEPTION, Expectation, exception_code, exception_extents
from ..master import ExchangeResult, Piece, ResultKind

FLOOD = 4096
"""Bytes of one exchange above which the older half is dropped: no valid exchange is as long."""
REFUSAL, REFUSED_LATER = 5, 2
"""Characters of the shortest reply, and of those after it for which it is worth to wait."""
NOISE = 4
"""Fewer loose bytes than in the shortest frame are noise, not a damaged reply."""


class ReplyExtent(NamedTuple):
    """Place of the awaited reply among received bytes, from device to checksum."""

    start: int
    end: int
    exception: int | None = None


class RtuExchange:
    """The awaited reply of one request, on a line that may echo, repeat and mix up replies.

    `echo` is True if the adapter repeats what is sent, None until the exchange shows it.
    `expectation` None is a broadcast. The first `skip` fitting replies belong to earlier requests.
    Without `exceptions`, a refusal counts as the reply to an earlier request.
    """

    def __init__(
        self,
        frame: bytes,
        expectation: Expectation | None,
        *,
        echo: bool | None = None,
        exceptions: bool = True,
        skip: int = 0,
    ) -> None:
        self.frame = frame
        self.echo = echo
        self.buffer = bytearray()
        self._expectation = expectation
        self._device = frame[0]
        self._exceptions = exceptions
        self._skip = skip
        self._skipped_to = 0
        self._looked_to = 0
        """End of the bytes in which no further reply can begin."""
        # a reply that repeats the request looks like an echo
        self._mirrored = expectation is not None and expectation.fits(frame[1:-2])

    @property
    def expected(self) -> bool:
        """True if a reply is due at all."""
        return self._expectation is not None

    @property
    def longest(self) -> int:
        """Most characters that the reply has on the wire, with the echo before it."""
        expectation = self._expectation
        length = expectation.length if expectation is not None else 0
        echo = len(self.frame) if self.echo else 0
        return echo + (MAX_FRAME if length is None else length + 3)

    @property
    def missing(self) -> int:
        """Characters that come before there can be a result; 0 unless the reply has begun."""
        expectation = self._expectation
        if expectation is None or expectation.length is None or self._skip:
            return 0
        reply = self.buffer[len(self.frame) if self.echo else 0 :]
        head, rest = bytes((self._device, *expectation.prefix)), self.longest - len(self.buffer)
        if reply.startswith(head):
            return rest
        if not reply or not head.startswith(reply):
            return 0
        refusal = REFUSAL - len(reply)
        return rest if rest <= refusal + REFUSED_LATER else refusal

    def feed(self, data: bytes) -> ExchangeResult | None:
        """Take received bytes; the result once the reply is whole."""
        self.buffer += data
        if len(self.buffer) > FLOOD:
            self._let_go(len(self.buffer) - FLOOD // 2)
        if self._expectation is None:
            return None
        while extent := self._find(self._expectation):
            if self._skip and extent.exception is None:
                self._skip -= 1
                self._skipped_to = extent.end
                continue
            return self._answered(extent)
        self._looked_to = max(0, len(self.buffer) - MAX_FRAME)
        return None

    def _let_go(self, count: int) -> None:
        """Forget the oldest bytes."""
        del self.buffer[:count]
        self._skipped_to = max(0, self._skipped_to - count)
        self._looked_to = max(0, self._looked_to - count)

    def pass_over(self, result: ExchangeResult) -> ExchangeResult | None:
        """Skip the reply just found, which belongs to another request; returns the next one, if
        any."""
        assert self._expectation is not None
        self._skipped_to = self.buffer.find(result.pdu, self._skipped_to) + len(result.pdu) + 2
        return self.feed(b"")

    def _find(self, expectation: Expectation) -> ReplyExtent | None:
        if self._is_too_short(expectation):
            return None
        start = max(self._after_echo(), self._skipped_to, self._looked_to)
        return find_reply(
            self.buffer, self._device, expectation, start=start, exceptions=self._exceptions
        )

    def _is_too_short(self, expectation: Expectation) -> bool:
        """True if neither the reply nor a refusal can be complete yet, as after most pieces."""
        if expectation.length is None:
            return False
        if len(self.buffer) - self._skipped_to >= expectation.length + 3:
            return False
        refusal = bytes((self._device, expectation.function | EXCEPTION))
        return not self._exceptions or refusal not in self.buffer

    def _after_echo(self) -> int:
        """Return where a reply may begin: after the echo of the request, if there is one."""
        if self._mirrored and self.echo is False:
            return 0
        copy = self.buffer.find(self.frame)
        return 0 if copy < 0 else copy + len(self.frame)

    def _answered(self, extent: ReplyExtent) -> ExchangeResult:
        before = self._after_echo()
        if not self._mirrored:
            if before:
                self.echo = True
            elif extent.start == 0:
                self.echo = False
        alone = extent.end - extent.start == len(self.buffer)
        loose = [] if alone else self._loose(extent)
        return ExchangeResult(
            ResultKind.REPLY if extent.exception is None else ResultKind.EXCEPTION,
            pdu=bytes(self.buffer[extent.start + 1 : extent.end - 2]),
            exception=extent.exception or 0,
            received=bytes(self.buffer),
            strays=[piece for piece in loose if piece.whole],
            resynchronised=bool(loose),
        )

    def _loose(self, extent: ReplyExtent | None = None) -> list[Piece]:
        """The received bytes besides the reply and the echo."""
        rest = bytearray(self.buffer)
        parts = []
        if extent is not None:
            parts.append(rest[extent.end :])
            del rest[extent.start :]
        copy = rest.find(self.frame)
        if copy >= 0:
            parts.append(rest[:copy])
            del rest[: copy + len(self.frame)]
        parts.append(rest)
        return [piece for part in parts for piece in pieces(part)]

    def silent(self) -> ExchangeResult | None:
        """Result after a silence longer than a pause inside a frame; None if the reply may follow.

        The rest of a damaged reply ends the exchange; noise, or another device's frame, does not.
        """
        if self._expectation is None:
            return None
        loose = self._loose()
        for piece in loose:
            if piece.whole or self._begun_echo(piece.data):
                continue
            if self._is_remnant(piece.data, self._expectation):
                return ExchangeResult(
                    ResultKind.DAMAGED,
                    received=bytes(self.buffer),
                    strays=[stray for stray in loose if stray.whole],
                    recognized=True,
                )
        return None

    def _is_remnant(self, data: bytes, expectation: Expectation) -> bool:
        """True if damaged bytes are the rest of the reply, by their head or their length."""
        if expectation.length is not None and len(data) == expectation.length + 3:
            return True
        return begins_reply(data, self._device, expectation.function) or expectation.prefix in data

    def _begun_echo(self, data: bytes) -> bool:
        return self.echo is not False and self.frame.startswith(data)

    def expired(self) -> ExchangeResult:
        """The result at the end of the timeout."""
        copied = self.frame in self.buffer
        if not self._mirrored:
            if copied:
                self.echo = True
            elif not self.buffer:
                self.echo = False
        elif not self.buffer:
            self.echo = False
        loose = self._loose()
        result = ExchangeResult(
            ResultKind.NOTHING,
            received=bytes(self.buffer),
            strays=[piece for piece in loose if piece.whole],
        )
        if self._expectation is None:
            return result
        own = [piece for piece in result.strays if piece.device == self._device]
        if own:
            result.kind = ResultKind.WRONG
            result.detail = self._expectation.mismatch(own[0].pdu)
        elif any(not piece.whole and len(piece.data) >= NOISE for piece in loose):
            result.kind = ResultKind.DAMAGED
        elif self._mirrored and copied and self.echo is None:
            result.kind = ResultKind.UNSURE
        elif self._mirrored and copied:
            result.detail = "only the adapter's echo of it came back"
        return result


def find_reply(
    data: bytes | bytearray,
    device: int,
    expectation: Expectation,
    *,
    start: int = 0,
    exceptions: bool = True,
) -> ReplyExtent | None:
    """The first reply from `start` on that is the awaited one, checksum included.

    With `exceptions` a refusal of the awaited function counts as well.
    """
    at = data.find(device, start)
    while at >= 0:
        for found in _candidates(data, at, expectation, exceptions):
            if is_whole(data[found.start : found.end]):
                return found
        at = data.find(device, at + 1)
    return None


def _candidates(
    data: bytes | bytearray, at: int, expectation: Expectation, exceptions: bool
) -> Iterator[ReplyExtent]:
    extent = expectation.extent(data, at + 1)
    if extent and at + extent + 3 <= len(data):
        yield ReplyExtent(at, at + extent + 3)
    function = expectation.function
    if not exceptions or data[at + 1 : at + 2] != bytes([function | EXCEPTION]):
        return
    for length in exception_extents(function):
        pdu = bytes(data[at + 1 : at + 1 + length])
        code = exception_code(function, pdu)
        if code is not None and at + length + 3 <= len(data):
            yield ReplyExtent(at, at + length + 3, code)


def pieces(data: bytes | bytearray) -> list[Piece]:
    """Received bytes, divided into whole frames and the bytes between them."""
    found: list[Piece] = []
    loose = 0
    for at, end in sorted(frame_ends(data).items()):
        if at < loose:
            continue  # inside the frame before
        if at > loose:
            found.append(Piece(bytes(data[loose:at]), whole=False))
        found.append(Piece(bytes(data[at:end]), whole=True))
        loose = end
    if len(data) > loose:
        found.append(Piece(bytes(data[loose:]), whole=False))
    return found


def begins_reply(data: bytes, device: int, function: int) -> bool:
    """Return True if a reply of the device to the function seems to begin somewhere in the
    bytes."""
    heads = (bytes([device, function]), bytes([device, function | EXCEPTION]))
    return any(head in data for head in heads)


def noted(result: ExchangeResult, request: bytes, device: int) -> Iterator[tuple[bytes, str]]:
    """Yield the received pieces, each with its remark; empty for the reply itself."""
    if not result.received:
        return
    if result.pdu and len(result.received) == len(result.pdu) + 3:
        yield result.received, ""
        return
    for piece in pieces(result.received):
        if piece.data == request and piece.pdu != result.pdu:
            note = "echo or answer" if result.kind is ResultKind.UNSURE else "echo"
        elif not piece.whole:
            note = "damaged" if result.kind is ResultKind.DAMAGED else "noise"
        elif piece.device != device:
            note = f"of device {piece.device}"
        else:
            note = "" if piece.pdu == result.pdu else "not the reply"
        yield piece.data, note
