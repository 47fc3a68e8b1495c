"""Writes of Modbus TCP clients: permissions, words that only stop, and the journal."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from functools import partial
from typing import NoReturn

from tui.bus.api import Priority
from tui.bus.errors import DeviceException, LineError, RequestRefused
from tui.bus.gateway.pdu import (
    BUSY,
    ILLEGAL_FUNCTION,
    ILLEGAL_VALUE,
    Unanswerable,
    WriteRequested,
    words_pdu,
    written_pdu,
)
from tui.bus.gateway.server import TcpRequest
from tui.drive.chart import read_chart
from tui.drive.foreign_write import (
    ExternalWord,
    StartDirection,
    WordKind,
    classify_words,
    half_refusal,
    parameters_at,
    registers_of,
    setting_refusal,
    starts_by,
    stop_deciding_codes,
    value_refusal,
)
from tui.drive.orders import chart_codes
from tui.drive.profile.schema import Parameter
from tui.drive.settings.writable import AT_REST, needs_standstill
from tui.drive.shown import depends_on
from tui.drive.values import from_words
from tui.safety import CLIENT_WRITE_ARMED_FOR, JUST_READ

from ..drive import DriveSession, unproved_text
from ..read.reader import Reader
from ..reading import Reading
from ..settings.write import parameter_entry
from .line import GatewayLine, PendingWrite
from .rules import GatewayRules

log = logging.getLogger(__name__)

ENDED_BEFORE_ANSWER = "serve ended, may have taken effect"


class GatewayWrite:
    """One write of one client to a drive whose profile is known."""

    def __init__(
        self,
        line: GatewayLine,
        session: DriveSession,
        requested: WriteRequested,
        request: TcpRequest,
        rules: GatewayRules,
        write: PendingWrite,
    ) -> None:
        self._line = line
        self._session = session
        self._requested = requested
        self._client, self._host = request.client.peer, request.client.host
        self._request = request
        self._rules = rules
        self._write = write
        self._commands = False
        """True if a word of it commands the drive otherwise than by a stop."""

    async def carry_out(self) -> bytes:
        """Write what is allowed, and return the reply. Raises Unanswerable and the line's errors.

        A write that only stops overtakes the earlier writes of its client, and cancels them.
        """
        if not self._may_go_first():
            await self._request.turn()
        words = await self._line.identify_apart(self._host, self._session, self._requested.words)
        stops = [word for word in words if word.kind is WordKind.STOP]
        if len(stops) == len(words):
            return await self._send(Priority.STOP)
        for stop in stops:
            # first, because the rest may be refused
            await self._send_alone(stop)
        await self._request.turn()
        await self._check(words)
        order = starts_by(self._session.profile, words)
        return await (self._start(order) if order else self._send(Priority.OPERATOR_WRITE))

    def _may_go_first(self) -> bool:
        """Return True if it may contain a stop, and no earlier write changes its meaning."""
        profile = self._session.profile
        kinds = {word.kind for word in classify_words(profile, self._requested.words, {})}
        if WordKind.COMMAND not in kinds:
            return WordKind.STOP in kinds
        # an earlier command word changes the state, but not the meaning of this word
        own = {chart.command for chart in profile.data.charts}
        codes = stop_deciding_codes(profile, self._requested.words)
        deciding = [profile.find(code) for code in codes if code not in own]
        registers = {register for parameter in deciding for register in registers_of(parameter)}
        return not self._line.pending.changes_before(self._write, registers)

    async def _read(self, codes: list[str]) -> Mapping[str, int]:
        """Read codes; return raw values of the last JUST_READ seconds, none after an error."""
        try:
            await Reader(self._session).read(codes, priority=Priority.OPERATOR_WRITE)
        except LineError as error:
            log.info("the values that a write depends on were not read: %s", error)
            return {}
        return self._session.image.fresh(JUST_READ)

    async def _check(self, words: list[ExternalWord]) -> None:
        """Raise Unanswerable if any part of the request is not allowed."""
        self._commands = any(word.kind is WordKind.COMMAND for word in words)
        if why := self._voided() or self._session.byte_order.text:
            self._refuse(BUSY, why)
        drive = await self._line.drives.found(self._session.device)
        if drive is None or drive.profile.id != self._session.profile.id:
            self._refuse(BUSY, "another drive answers at this address")
        if self._session.is_unconfirmed:
            self._refuse(ILLEGAL_FUNCTION, unproved_text(self._session))
        if any(word.kind is WordKind.UNKNOWN for word in words):
            lacking = [word.address for word in words if word.kind is WordKind.UNKNOWN]
            self._refuse(ILLEGAL_FUNCTION, f"no parameter can be written at {lacking}")
        if self._commands and not self._rules.commands:
            self._refuse(ILLEGAL_FUNCTION, "commands are not allowed; use --allow-commands")
        for parameter in parameters_at([word for word in words if word.kind is WordKind.COMMAND]):
            if why := half_refusal(parameter, self._requested.words):
                self._refuse(ILLEGAL_VALUE, why)
        settings = [word for word in words if word.kind is WordKind.SETTING]
        for setting in settings:
            why = setting_refusal(self._session.profile, setting, self._rules.writes)
            if why:
                self._refuse(ILLEGAL_FUNCTION, why)
        await self._check_values(settings)
        if self._commands:
            why = self._line.commanding.claim(self._session.device, self._client)
            if why:
                self._refuse(BUSY, why)

    async def _check_values(self, settings: list[ExternalWord]) -> None:
        profile = self._session.profile
        parameters = parameters_at(settings)
        for parameter in parameters:
            if why := value_refusal(profile, parameter, self._requested.words):
                self._refuse(ILLEGAL_VALUE, why)
        # for the journal: the value before, and its unit
        codes = [
            code for parameter in parameters for code in (parameter.code, *depends_on(parameter))
        ]
        still = any(needs_standstill(profile, parameter) for parameter in parameters)
        if still:
            codes += profile.data.status_codes
            codes += chart_codes(profile)
        raws = await self._read(list(dict.fromkeys(codes))) if codes else {}
        if still:
            motion = read_chart(profile, raws).motion
            if motion not in AT_REST:
                self._refuse(BUSY, f"allowed only with the motor stopped; the drive is {motion}")

    def _refuse(self, code: int, why: str) -> NoReturn:
        who = f"device {self._session.device}, Modbus TCP client {self._client}"
        log.warning("%s: not written: %s", who, why)
        raise Unanswerable(code, why)

    async def _start(self, order: StartDirection) -> bytes:
        """Record the start, then send the request. Raises StartNotRecorded."""
        begun = await self._line.started.begin(self._session, order)
        sent = True
        try:
            return await self._send(Priority.OPERATOR_WRITE)
        except Unanswerable:
            sent = False
            raise
        finally:
            if sent:
                self._line.resting.release(self._session.device)
            if begun or sent:
                self._line.started.sent(self._session, sent=sent)

    def _stop(self) -> None:
        """Cancel what any program has commanded before this request."""
        self._line.commanding.stop(self._session.device, self._client)
        self._line.pending.stops_by(self._write)

    async def _send_alone(self, item: ExternalWord) -> None:
        """Send one word that stops; both, if its parameter has two."""
        device = self._session.device
        if item.address not in {parameter.place for parameter in item.parameters}:
            return  # sent with the first word of its parameter
        word, send = (device, item.address, item.word), partial(self._send_alone_now, item)
        await self._line.turns.stopping(self._host, word, send)
        self._line.commanding.stopped_too(device, self._client)

    async def _send_alone_now(self, word: ExternalWord) -> None:
        self._stop()
        answer = ENDED_BEFORE_ANSWER
        own = max((registers_of(parameter) for parameter in word.parameters), key=len)
        values = [self._requested.words[address] for address in own]
        try:
            await self._session.line.write(
                self._session.device, word.address, values, priority=Priority.STOP
            )
            answer = "ok"
            self._line.keep_resting(self._session)
        except LineError as error:
            answer = str(error)
            raise
        finally:
            self._keep(list(word.parameters), {}, answer, "stop")

    async def _send(self, priority: Priority) -> bytes:
        """Send the request unchanged, and return the reply; equal stops share one frame."""
        send = partial(self._send_now, priority)
        if priority is not Priority.STOP:
            return await send()
        device = self._session.device
        pdu = await self._line.turns.stopping(self._host, (device, self._requested), send)
        self._line.commanding.stopped_too(device, self._client)
        return pdu

    async def _send_now(self, priority: Priority) -> bytes:
        """Send the request, and record each parameter in the journal."""
        stops = priority is Priority.STOP
        if stops:
            self._stop()
        parameters = parameters_at(classify_words(self._session.profile, self._requested.words, {}))
        before = {
            parameter.code: self._session.image.get(parameter.code) for parameter in parameters
        }
        answer, stored = ENDED_BEFORE_ANSWER, True
        try:
            pdu = await self._exchange(priority, parameters)
            answer = "ok"
            if stops:
                self._line.keep_resting(self._session)
            return pdu
        except LineError as error:
            answer, stored = str(error), not isinstance(error, RequestRefused | DeviceException)
            if isinstance(error, RequestRefused):
                raise Unanswerable(self._refusal_code(), answer) from error
            raise
        finally:
            self._keep(parameters, before, answer, "stop" if stops else "write", stored=stored)

    async def _exchange(self, priority: Priority, parameters: list[Parameter]) -> bytes:
        session, requested = self._session, self._requested
        forbidden = None if priority is Priority.STOP else self._voided
        if forbidden is not None:
            session.line.facts.leases.arm(session.device, CLIENT_WRITE_ARMED_FOR, session.care())
        for parameter in parameters:
            session.image.doubt(parameter.code)
        if requested.function == 23:
            reply = await session.line.read_write(
                session.device, requested.read_address, requested.count, requested.address,
                requested.values,
                priority=priority, forbidden=forbidden,
            )  # fmt: skip
            return words_pdu(23, reply.words)
        await session.line.write(
            session.device, requested.address, requested.values,
            priority=priority, multiple=requested.function in (15, 16), forbidden=forbidden,
        )  # fmt: skip
        return written_pdu(requested)

    def _voided(self) -> str:
        """Return why it must not be sent; called in the line's thread just before the frame."""
        if self._line.pending.void(self._write):
            return "Not sent: a stop came after it."
        if self._request.stale:
            return "Not sent: it arrived while serve was suspended, and is too old."
        gone = self._commands and self._request.client.left
        return "Not sent: its client has disconnected and cannot stop the motor." if gone else ""

    def _refusal_code(self) -> int:
        """Return the exception code for a write that the line did not send."""
        line, profile = self._session.line, self._session.profile
        if profile.function(self._requested.function) is None or line.read_only or line.held:
            return ILLEGAL_FUNCTION
        device = self._session.device
        if line.facts.commander(device) or device in line.facts.paused or self._voided():
            return BUSY
        return ILLEGAL_VALUE

    def _keep(
        self,
        parameters: list[Parameter],
        before: Mapping[str, Reading | None],
        answer: str,
        what: str,
        *,
        stored: bool = True,
    ) -> None:
        """Record each parameter whose words were all written in the journal.

        `stored` is False if the drive did not take them.
        """
        session, words = self._session, self._requested.words
        why = f"{what} of Modbus TCP client {self._client}"
        for parameter in parameters:
            own = registers_of(parameter)
            if any(address not in words for address in own):
                continue
            held = before.get(parameter.code)
            old, new = held.raw if held else None, from_words(parameter, [words[at] for at in own])
            self._line.journal.add(
                parameter_entry(
                    session, parameter, old=old, new=new, answer=answer, why=why, refused=not stored
                )
            )
