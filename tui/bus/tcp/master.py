"""Modbus TCP: transaction ids, and replies checked down to the byte."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from pymodbus.framer.socket import FramerSocket
from pymodbus.pdu import DecodePDU

from ..errors import LineLost
from ..expectation import exception_code
from ..master import ExchangeResult, LineContext, Piece, ResultKind, Sending, settle
from ..transport.base import Transport

NO_TRANSACTION = bytes(2)
ID_MISSING = "the gateway does not return the transaction id of the request. Use another gateway"
HEADER_LENGTH = 7
"""Transaction id, protocol id, length, unit id."""
SHOWN = 260
"""Bytes of something else that are kept to be looked at."""
NO_CHECKSUM = bytes(2)
MAX_LENGTH = 254
"""Unit id and the longest function and data."""


class TcpMaster:
    """One Modbus TCP connection. `ended` is called once when it is lost."""

    def __init__(
        self,
        transport: Transport,
        around: LineContext,
        ended: Callable[[], None],
        unit_of: Callable[[int], int] = int,
    ) -> None:
        """`unit_of`: the unit that requests to a device carry."""
        self.echo: bool | None = False
        self.failure: LineLost | None = None
        self._transport = transport
        self._around = around
        self._ended = ended
        self._unit_of = unit_of
        self._framer = FramerSocket(DecodePDU(is_server=False))
        self._buffer = bytearray()
        self._transaction = 0
        self._sending: Sending | None = None
        self._done: asyncio.Future[ExchangeResult] | None = None
        self._unnumbered = False
        """True if a reply without a transaction id came since the last request."""
        self._hold = 0.0
        self._last = 0.0
        transport.start(self)

    def close(self) -> None:
        """Drop the connection."""
        self._transport.close()

    def received(self, data: bytes, time: float) -> None:
        """Take the bytes apart by their headers; only the awaited transaction is looked at."""
        self._last = time
        self._around.tally.bytes_in += len(data)
        buffer, at = bytes(self._buffer) + data, 0
        while len(buffer) - at >= HEADER_LENGTH:
            length = int.from_bytes(buffer[at + 4 : at + 6], "big")
            if buffer[at + 2 : at + 4] != b"\0\0" or not 2 <= length <= MAX_LENGTH:
                self._around.trace.add(time, "in", buffer[at : at + SHOWN], "no Modbus TCP")
                self._reset("the other end sent something else than Modbus TCP")
                return
            end = at + 6 + length
            if len(buffer) < end:
                break
            self._take(buffer[at:end], time)
            at = end
        self._buffer[:] = buffer[at:]

    def _take(self, unit: bytes, time: float) -> None:
        sending = self._sending
        if sending is None or sending.expectation is None or not self._is_ours(unit):
            self._unnumbered |= unit[:2] == NO_TRANSACTION  # no request has this id
            self._around.tally.stale += 1
            self._around.trace.add(time, "in", unit, "late or repeated")
            return
        result = _result(unit, sending, self._unit_of(sending.device))
        note = "" if result.kind in (ResultKind.REPLY, ResultKind.EXCEPTION) else "not the reply"
        self._around.trace.add(time, "in", unit, note)
        settle(self._done, result)

    def _is_ours(self, unit: bytes) -> bool:
        awaited = self._done is not None and not self._done.done()
        return awaited and int.from_bytes(unit[:2], "big") == self._transaction

    def _reset(self, reason: str) -> None:
        """Close a connection whose bytes can no longer be separated into frames."""
        self._transport.close()
        self.lost(reason)

    def lost(self, reason: str) -> None:
        """The connection ended: the waiting caller gets the error at once."""
        if self.failure is not None:
            return
        self.failure = LineLost(f"The line was lost: {reason}.")
        settle(self._done, ExchangeResult(ResultKind.NOTHING))
        self._ended()

    async def quiet(self) -> None:
        """Wait out the time after a broadcast; Modbus TCP knows no silence."""
        while self.failure is None and self._hold > self._around.clock():
            await self._transport.rest(self._hold)
        if self.failure is not None:
            raise self.failure

    async def exchange(self, sending: Sending) -> ExchangeResult:
        """Send a request and await the reply of its transaction."""
        clock, tally = self._around.clock, self._around.tally
        self._transaction = self._transaction % 0xFFFF + 1
        data = self._framer.encode(sending.pdu, self._unit_of(sending.device), self._transaction)
        await self._transport.take_in()
        if self.failure is not None:
            raise self.failure
        self._done = asyncio.get_running_loop().create_future()
        self._sending, self._unnumbered = sending, False
        begun = clock()
        try:
            sending.look()
            await self._send(data)
            tally.count_sent(sending.device, len(data))
            self._around.trace.add(begun, "out", data)
            result = await self._result(sending)
        finally:
            self._sending = self._done = None
        end = clock() if result.kind is ResultKind.NOTHING else self._last
        tally.count_end(sending.device, clock() - begun, len(result.received))
        if result.kind is ResultKind.NOTHING and self._buffer:
            # half a reply, or a length that is wrong: what follows could not be told apart
            self._reset("a reply broke off")
        result.sent, result.end, result.turnaround = begun, end, max(0.0, end - begun)
        return result

    async def send_finished(self, data: bytes) -> None:
        """Send a finished frame; the connection keeps its reply apart by its transaction."""
        await self._transport.send(data)

    async def _send(self, data: bytes) -> None:
        try:
            await self._transport.send(data)
        except OSError as error:
            self.lost(str(error.strerror or error))
            raise self.failure or LineLost("The line was lost.") from error

    async def _result(self, sending: Sending) -> ExchangeResult:
        assert self._done is not None
        if sending.expectation is None:
            self._hold = self._around.clock() + self._around.timing.turnaround_delay
            return ExchangeResult(ResultKind.NOTHING)
        await asyncio.wait((self._done,), timeout=sending.time_out)
        if self.failure is not None:
            raise self.failure
        if self._done.done():
            return self._done.result()
        if self._unnumbered:
            return ExchangeResult(ResultKind.WRONG, detail=ID_MISSING)
        return ExchangeResult(ResultKind.NOTHING)


def _result(unit: bytes, sending: Sending, awaited: int) -> ExchangeResult:
    """Return the result for a reply with the right transaction id."""
    expectation = sending.expectation
    assert expectation is not None
    device, pdu = unit[6], unit[HEADER_LENGTH:]
    if device != awaited:
        return ExchangeResult(ResultKind.WRONG, detail=f"unit {device} answered", received=unit)
    if expectation.fits(pdu):
        return ExchangeResult(ResultKind.REPLY, pdu=pdu, received=unit)
    code = exception_code(expectation.function, pdu)
    if code is not None:
        return ExchangeResult(ResultKind.EXCEPTION, pdu=pdu, exception=code, received=unit)
    instead = Piece(bytes([sending.device]) + pdu + NO_CHECKSUM, whole=True)
    detail = expectation.mismatch(pdu)
    return ExchangeResult(ResultKind.WRONG, detail=detail, received=unit, instead=instead)
