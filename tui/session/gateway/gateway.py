"""Requests of Modbus TCP clients: each is passed to its drive, and the reply back."""

from __future__ import annotations

import logging
from collections.abc import Callable, Coroutine, Mapping, Sequence
from functools import partial
from typing import Any

from tui.bus.api import IdentificationObjects, ModbusLine, Priority
from tui.bus.errors import (
    DeviceException,
    ExchangeError,
    LineBusy,
    LineError,
    NoAnswer,
    RequestRefused,
)
from tui.bus.gateway.pdu import (
    BUSY,
    DEVICE_FAILURE,
    ILLEGAL_FUNCTION,
    ILLEGAL_VALUE,
    NO_PATH,
    NO_RESPONSE,
    WRITE_FUNCTIONS,
    DiagnoseRequested,
    IdentifyRequested,
    ReadRequested,
    Unanswerable,
    WriteRequested,
    diagnosed_pdu,
    exception_pdu,
    identified_pdu,
    parse_request,
    words_pdu,
)
from tui.bus.gateway.server import TcpRequest
from tui.bus.gateway.talk import TcpClient
from tui.drive.errors import DriveError

from ..command.stop_report import StopSummary
from .line import GatewayLine, PendingWrite
from .rules import GatewayRules
from .writes import GatewayWrite

log = logging.getLogger(__name__)


class Gateway:
    """Answers the requests of all clients; for one loop."""

    def __init__(
        self,
        lines: Sequence[GatewayLine],
        units: Mapping[int, tuple[int, int]],
        rules: GatewayRules,
    ) -> None:
        self._lines = lines
        self._units = units
        self._rules = rules

    async def close(self) -> list[StopSummary]:
        """Close all lines; return the results for the motors that were stopped."""
        return [reported for line in self._lines if (reported := await line.close()) is not None]

    def gone(self, client: TcpClient) -> None:
        """Release the drives of a client that has closed its connection."""
        for line in self._lines:
            line.commanding.gone(client.peer)

    def answer(self, request: TcpRequest) -> Coroutine[Any, Any, bytes]:
        """Return a coroutine for the reply; every error becomes an exception reply of Modbus.

        Call it when the request arrives: a stop after that moment cancels the request.
        """
        function = request.pdu[0]
        place = self._units.get(request.unit)
        if place is None:
            return _refused(function, NO_PATH)
        line, device = self._lines[place[0]], place[1]
        if not request.stale:
            # a request that waited while this program was suspended proves no living client
            line.commanding.heard(device, request.client.peer)
            line.drives.keep_chart_known(device)
        try:
            requested = parse_request(request.pdu)
        except Unanswerable as refused:
            if function in WRITE_FUNCTIONS:
                log.info("device %s, client %s: %s", device, request.client.peer, refused)
            return _refused(function, refused.code)
        if isinstance(requested, WriteRequested):
            write = line.pending.came(request.client, device, requested.words)
            return self._write(line, request, requested, write)
        answer = partial(self._answer, line, device, requested)
        return self._report_reply(
            line, device, request, partial(self._in_turn, line, request, answer)
        )

    async def _in_turn(
        self,
        line: GatewayLine,
        request: TcpRequest,
        answer: Callable[[], Coroutine[Any, Any, bytes]],
    ) -> bytes:
        async with line.turns.reading(request.client.host):
            return await answer()

    async def _report_reply(
        self,
        line: GatewayLine,
        device: int,
        request: TcpRequest,
        answer: Callable[[], Coroutine[Any, Any, bytes]],
    ) -> bytes:
        function = request.pdu[0]
        try:
            return await answer()
        except Unanswerable as refused:
            if function in WRITE_FUNCTIONS:
                log.info("device %s, client %s: %s", device, request.client.peer, refused)
            return exception_pdu(function, refused.code)
        except LineError as error:
            if isinstance(error, NoAnswer):
                # the next reply may be from another drive
                line.drives.doubt(device)
            return exception_pdu(function, exception_of(error))
        except DriveError as error:
            log.error("device %s: %s", device, error)
            return exception_pdu(function, DEVICE_FAILURE)

    async def _answer(
        self,
        line: GatewayLine,
        device: int,
        requested: ReadRequested | DiagnoseRequested | IdentifyRequested,
    ) -> bytes:
        match requested:
            case ReadRequested():
                return await self._read(line, device, requested)
            case DiagnoseRequested():
                return await self._diagnose(line, device, requested)
            case IdentifyRequested():
                found = await self._identify(line, device)
                return identified_pdu(requested, found.conformity, found.objects)

    async def _read(self, line: GatewayLine, device: int, requested: ReadRequested) -> bytes:
        session = line.drives.known(device)
        if session is not None and session.profile.function(requested.function) is None:
            raise Unanswerable(ILLEGAL_FUNCTION)
        try:
            reply = await line.line.read(
                device,
                requested.address,
                requested.count,
                priority=_patience(line.line, device),
                function=requested.function,
                max_age=self._rules.fresh,
            )
        except RequestRefused as refused:
            code = BUSY if device in line.line.facts.paused else ILLEGAL_VALUE
            raise Unanswerable(code, str(refused)) from refused
        finally:
            if line.line.device_state(device).answers:
                line.drives.find_out(device)
        return words_pdu(requested.function, reply.words)

    async def _write(
        self, line: GatewayLine, request: TcpRequest, requested: WriteRequested, write: PendingWrite
    ) -> bytes:
        try:
            answer = partial(self._written, line, request, requested, write)
            return await self._report_reply(line, write.device, request, answer)
        finally:
            line.pending.ended(write)

    async def _written(
        self, line: GatewayLine, request: TcpRequest, requested: WriteRequested, write: PendingWrite
    ) -> bytes:
        device = write.device
        # a stop does not wait until a drive that was silent is identified again
        session = line.drives.known(device) or await line.drives.found(device)
        if session is not None:
            return await GatewayWrite(
                line, session, requested, request, self._rules, write
            ).carry_out()
        # an unidentified drive is sent a word that stops all its candidate families
        session = line.drives.stoppable(device, requested.words)
        if session is None:
            raise Unanswerable(ILLEGAL_FUNCTION, "a device without a profile is only read")
        try:
            return await GatewayWrite(
                line, session, requested, request, self._rules, write
            ).carry_out()
        finally:
            line.drives.unknown_again(device)

    async def _diagnose(
        self, line: GatewayLine, device: int, requested: DiagnoseRequested
    ) -> bytes:
        session = await line.drives.found(device)
        function = session.profile.function(8) if session is not None else None
        if function is None or requested.subfunction not in (function.subfunctions or ()):
            raise Unanswerable(ILLEGAL_FUNCTION)
        if requested.subfunction in CHANGING_SUBFUNCTIONS:
            raise Unanswerable(ILLEGAL_FUNCTION, "it would change the drive's counters")
        data = await line.line.diagnose(device, requested.subfunction, requested.data)
        return diagnosed_pdu(requested.subfunction, data)

    async def _identify(self, line: GatewayLine, device: int) -> IdentificationObjects:
        line.drives.known(device)
        try:
            return await line.line.identify(device, priority=_patience(line.line, device))
        except RequestRefused as refused:
            raise Unanswerable(ILLEGAL_FUNCTION, str(refused)) from refused


async def _refused(function: int, code: int) -> bytes:
    return exception_pdu(function, code)


CHANGING_SUBFUNCTIONS = frozenset({1, 3, 4, 10})
"""Subfunctions of function 8: restart, delimiter, listen-only mode, clearing of counters."""


def _patience(line: ModbusLine, device: int) -> Priority:
    """Return the priority of a read: a device that never answered gets a shorter wait.

    A silent device is read as a poll, which pauses between two attempts. Otherwise a client that
    repeats its request would occupy the line.
    """
    state = line.device_state(device)
    if state.next_try is not None:
        return Priority.POLL
    return Priority.OPERATOR_READ if state.heard is not None else Priority.BACKGROUND


def exception_of(error: LineError) -> int:
    """Return the exception code for an error of the line; that of the drive if it sent one."""
    if isinstance(error, DeviceException):
        return error.code
    if isinstance(error, ExchangeError):
        return NO_RESPONSE
    return BUSY if isinstance(error, LineBusy) else NO_PATH
