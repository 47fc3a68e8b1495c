"""Modbus RTU over a port or a device server: silence, sending, and the bytes that come back."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable

from tui.safety import FROZEN_IN_SENDING
from tui.wire.frames import MAX_FRAME, frame

from ..errors import LineLost
from ..link import Link, RtuTcpLink, character_time, silence
from ..master import ExchangeResult, LineContext, ResultKind, Sending, settle
from ..transport.base import Transport
from ..transport.port_errors import PortErrors
from .exchange import RtuExchange, noted, pieces

BABBLE = 1.0
"""Seconds to wait for silence on a line that never falls silent, before sending anyway."""
LEAD = 0.0004
"""Seconds before the end of the silence at which the next request is chosen and made ready."""
TOLERANCE = 0.001
"""Seconds by which the end of a request is uncertain."""
REMEMBERED, JUDGED, SELDOM = 64, 8, 0.15
"""Replies looked back at; how many are enough; the share of early ones on a line with a baud."""
MUCH_TALK = 256
"""Bytes received without a pause, while no reply was due, after which they are decoded."""
IDLE_LIMIT = 4096
"""Bytes kept of those received while no reply is due."""
BEFORE_END, SHORTEST_PAUSE = 0.0003, 0.0005
"""Seconds before the end of a reply from which each piece is read immediately, and the shortest
pause in reading. On a line that delivers single characters, each wake-up costs a turn of the
loop."""


class PutOffTimer:
    """Calls an action after a delay, which is often restarted; lives in the line's loop.

    To restart it is cheap: the timer of the loop is kept, and set again only when it rings.
    """

    def __init__(self) -> None:
        self._timer: asyncio.TimerHandle | None = None
        self._due = 0.0
        self._action: Callable[[], None] | None = None

    def start(self, delay: float, action: Callable[[], None]) -> None:
        """Call the action after so many seconds; replaces an earlier action and delay."""
        loop = asyncio.get_running_loop()
        self._due, self._action = loop.time() + delay, action
        if self._timer is not None and self._timer.when() > self._due:
            self.stop()
        if self._timer is None:
            self._timer = loop.call_at(self._due, self._ring)

    def _ring(self) -> None:
        """Call the action if it is due, else wait on: a new timer for each piece costs more."""
        loop, self._timer = asyncio.get_running_loop(), None
        if self._action is None:
            return
        if loop.time() < self._due:
            self._timer = loop.call_at(self._due, self._ring)
        else:
            self._action()

    def leave(self) -> None:
        """Cancel the action, but keep the timer: cheaper than stop() if start() follows soon."""
        self._action = None

    def stop(self) -> None:
        """Cancel the action and the timer."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None


class RtuMaster:
    """One opened RTU line. `ended` is called once when the line is lost."""

    def __init__(
        self,
        transport: Transport,
        link: Link,
        around: LineContext,
        ended: Callable[[], None],
        *,
        wire_time: bool,
        port_errors: Callable[[], PortErrors | None] = lambda: None,
    ) -> None:
        self.echo: bool | None = None
        self.failure: LineLost | None = None
        self.pause: Callable[[float], None] = lambda _: None
        """Has the transport read nothing for so many seconds, unless something is sent."""
        self._transport = transport
        self._around = around
        self._ended = ended
        self._wire_time = wire_time
        self._character = character_time(link)
        self._silence = silence(link)
        timing = around.timing
        floor = timing.frame_gap_tcp if isinstance(link, RtuTcpLink) else timing.frame_gap
        self._gap = max(self._silence, floor)
        # earlier traffic on the line is unknown
        self._last = around.clock()
        self._hold = 0.0
        self._exchange: RtuExchange | None = None
        self._done: asyncio.Future[ExchangeResult] | None = None
        self._timer, self._time_out = PutOffTimer(), PutOffTimer()
        self._deadline = self._latest = 0.0
        """Timeout of the reply (line's clock) without any byte, and with bytes coming in."""
        self._sent = 0.0
        self._over = 0.0
        """When the last character of the reply that has begun is on the wire, at the latest."""
        self._ends = 0.0
        """Timeout of that reply if no further byte comes."""
        self._idle = bytearray()
        self._distrusts = False
        """True while nothing is concluded from bytes: not even that a reply came twice."""
        self._early: deque[bool] = deque(maxlen=REMEMBERED)
        """Of the last replies, whether each began before its request was over."""
        self._port_errors = port_errors
        self._counted = port_errors()
        transport.start(self)

    def close(self) -> None:
        """Give the port back."""
        self._timer.stop()
        self._time_out.stop()
        self._transport.close()

    def received(self, data: bytes, time: float) -> None:
        """Take received bytes: part of the awaited reply, or unexpected ones."""
        self._last = time
        self._around.tally.bytes_in += len(data)
        if self._exchange is None:
            self._idle += data
            del self._idle[:-IDLE_LIMIT]
            if len(self._idle) < MUCH_TALK:
                self._timer.start(self._gap, self._sort_idle)
            else:
                self._sort_idle()  # continuous traffic of others: there would be no silence
            return
        self._expect_end(self._exchange, len(data), time)
        result = self._exchange.feed(data)
        while result is not None and self._came_too_early(result, time):
            result = self._exchange.pass_over(result)
        if result is not None:
            settle(self._done, result)
        elif self._exchange.expected:
            self._timer.start(self._ends - time, self._fell_silent)
            pause = self._exchange.missing * self._character - BEFORE_END
            if pause > SHORTEST_PAUSE:
                self.pause(pause)

    def _expect_end(self, exchange: RtuExchange, came: int, time: float) -> None:
        """Set the time until which the rest of a reply is awaited: its length on the wire, and a
        gap.

        A busy computer delivers bytes with pauses in between; a new request then would collide with
        the reply. An echo may come in pieces while the request is still being sent.
        """
        if not exchange.buffer:
            on_wire = exchange.longest * self._character
            self._over = time - came * self._character + on_wire
        self._ends = max(time, self._sent, self._over) + self._gap

    def _came_too_early(self, result: ExchangeResult, time: float) -> bool:
        """True if a reply began before the end of its request: then it belongs to another one.

        Only if the line is known to keep the time of its baud.
        """
        if not self._wire_time or result.kind not in (ResultKind.REPLY, ResultKind.EXCEPTION):
            return False
        begun = time - (len(result.pdu) + 3) * self._character
        early = begun < self._sent - TOLERANCE
        self._early.append(early)
        seldom = sum(self._early) <= len(self._early) * SELDOM
        return early and seldom and len(self._early) >= JUDGED

    def lost(self, reason: str) -> None:
        """Note that the port is lost; the waiting caller gets the error at once."""
        self._timer.stop()
        self.failure = LineLost(f"The line was lost: {reason}.")
        settle(self._done, ExchangeResult(ResultKind.NOTHING))
        self._ended()

    async def quiet(self) -> None:
        """Wait until the line has been silent nearly long enough for the next request.

        The rest of the silence is waited just before sending, when the request is ready.
        """
        await self._silent(LEAD)
        self._sort_idle()

    async def _silent(self, lead: float) -> None:
        clock = self._around.clock
        give_up = clock() + BABBLE + max(0.0, self._hold - clock())
        while self.failure is None:
            now = clock()
            until = max(self._last + self._silence - lead, self._hold)
            if now >= until or now >= give_up:
                if lead:
                    return
                await self._transport.take_in()
                if self._last + self._silence <= clock() or now >= give_up:
                    break
                continue  # more bytes came
            await self._transport.rest(min(until, give_up))
        if self.failure is not None:
            raise self.failure

    async def exchange(self, sending: Sending) -> ExchangeResult:
        """Send a request and await its reply, its remains, or the end of its time."""
        clock, tally = self._around.clock, self._around.tally
        data = frame(sending.device, sending.pdu)
        exchange = RtuExchange(
            data, sending.expectation, echo=self.echo, exceptions=sending.sure, skip=sending.skip
        )
        self._done = asyncio.get_running_loop().create_future()
        await self._silent(0.0)
        if self._idle:
            self._sort_idle()
        self._exchange = exchange
        begun = clock()
        self._sent = self._last = begun + len(data) * self._character
        try:
            sending.look()
            await self._send(data)
            tally.count_sent(sending.device, len(data))
            self._around.trace.add(begun, "out", data)
            still = clock() - begun > FROZEN_IN_SENDING
            result = await (self._distrust(sending) if still else self._result(sending))
        finally:
            self._exchange = self._done = None
            self._timer.stop()
            self._time_out.leave()
        self.echo = exchange.echo
        end = clock() if result.kind is ResultKind.NOTHING else self._last
        tally.count_end(sending.device, clock() - begun, len(result.received))
        tally.resyncs += result.resynchronised
        if result.kind is not ResultKind.REPLY or result.resynchronised:
            self._count_port_errors()
        for piece, note in noted(result, data, sending.device):
            self._around.trace.add(end, "in", piece, note)
        reply = (len(result.pdu) + 3) * self._character
        result.sent, result.end = self._sent, end
        result.turnaround = max(0.0, end - self._sent - reply)
        return result

    async def send_finished(self, data: bytes) -> None:
        """Send a finished frame, await no reply, and keep the line quiet for one.

        For a stop whose normal way has failed: it uses no state of an exchange.
        """
        await asyncio.sleep(self._gap)
        await self._transport.send(data)
        on_wire = len(data) * self._character
        self._hold = self._around.clock() + on_wire + self._around.timing.turnaround_delay

    async def _send(self, data: bytes) -> None:
        try:
            await self._transport.send(data)
        except OSError as error:
            self._transport.close()
            if self.failure is None:
                self.lost(str(error.strerror or error))
            raise self.failure or LineLost("The line was lost.") from error

    async def _distrust(self, sending: Sending) -> ExchangeResult:
        """Wait for the end of the timeout, and ignore all bytes until then.

        The program was suspended while it sent: bytes since then may answer an earlier request.
        """
        clock = self._around.clock
        self._exchange, self._distrusts = None, True
        self._sent = self._last = clock() + (len(sending.pdu) + 3) * self._character
        try:
            while self.failure is None and clock() < self._sent + sending.time_out:
                await self._transport.rest(self._sent + sending.time_out)
            self._sort_idle()
        finally:
            self._distrusts = False
        if self.failure is not None:
            raise self.failure
        return ExchangeResult(ResultKind.NOTHING)

    async def _result(self, sending: Sending) -> ExchangeResult:
        """Wait for the result; while bytes are coming in, a little over the timeout."""
        assert self._done is not None
        expectation = sending.expectation
        if expectation is None:
            self._hold = self._deadline = self._sent + self._around.timing.turnaround_delay
            self._latest = self._deadline
        else:
            length = MAX_FRAME if expectation.length is None else expectation.length + 3
            self._deadline = self._sent + sending.time_out
            self._latest = self._deadline + length * self._character + self._gap
        self._look_at_time()
        result = await self._done
        if self.failure is not None:
            raise self.failure
        return result

    def _look_at_time(self) -> None:
        """End the exchange if its time is up, else look again then."""
        if (exchange := self._exchange) is None:
            return
        # a lump may follow what has come; where nothing has, the time is up by itself
        lump, now = self._ends if exchange.buffer else self._deadline, self._around.clock()
        left = min(max(self._deadline, lump), self._latest) - now
        if left > 0:
            self._time_out.start(left, self._look_at_time)
        else:
            # the line may have fallen silent at the same moment
            silent = exchange.silent() if now >= self._ends else None
            settle(self._done, silent or exchange.expired())

    def _fell_silent(self) -> None:
        if self._exchange is not None:
            result = self._exchange.silent()
            if result is not None:
                settle(self._done, result)

    def _sort_idle(self) -> None:
        """Decode the bytes that came while no reply was due."""
        if not self._idle:
            return
        self._timer.stop()
        data, self._idle = bytes(self._idle), bytearray()
        for piece in pieces(data):
            note = f"late or repeated, device {piece.device}" if piece.whole else "noise"
            self._around.trace.add(self._last, "in", piece.data, note)
            if piece.whole:
                self._around.tally.stale += 1
                if not self._distrusts:
                    self._around.stray(piece, self._last)

    def _count_port_errors(self) -> None:
        """Add the port's error counts since the last call; only called if a reply fails."""
        now = self._port_errors()
        if now is None or self._counted is None:
            return
        new, tally = now.since(self._counted), self._around.tally
        self._counted = now
        tally.framing += new.framing
        tally.parity += new.parity
        tally.breaks += new.breaks
        tally.overruns += new.overruns
