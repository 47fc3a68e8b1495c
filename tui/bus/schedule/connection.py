"""Keeps a line connected: opens it, serves it, and opens it again when it is lost."""

from __future__ import annotations

import asyncio
import logging
import os
import socket
from collections.abc import Callable
from functools import partial

import serial

from ..errors import LineBehind, LineError, LineFailed, LineLost
from ..link import Link, RtuTcpLink, SerialLink, TcpLink, label
from ..master import LineContext, Master
from ..model import LineState, LineStatus
from ..rtu.master import RtuMaster
from ..tcp.master import TcpMaster
from ..transport.base import Transport
from ..transport.opening import opened_beside
from ..transport.port_errors import PortErrors
from ..transport.ports import is_pseudo_terminal, open_serial, other_openers
from ..transport.serial_posix import PosixSerial
from ..transport.serial_thread import ThreadedSerial
from ..transport.tcp import TcpTransport
from .dispatcher import Dispatcher
from .inside import SharedLine
from .last_way import LastWay
from .patience import pause

log = logging.getLogger(__name__)


async def open_port(link: SerialLink, *, alone: bool = True) -> Transport:
    """Open a serial port for Modbus; not `alone`: beside a program that holds it.

    Raises PortBusy, PortMissing, PortRefused, LineLost.
    """
    opened = partial(_open_port, link, alone=alone)
    port, note = await opened_beside(link.path, opened, lambda opened: opened[0].close())
    return PosixSerial(port, note) if os.name == "posix" else ThreadedSerial(port, note)


def _open_port(link: SerialLink, *, alone: bool) -> tuple[serial.Serial, str]:
    """The open port, and a remark about it."""
    port = open_serial(link.path, link.baud, link.format, alone=alone)
    note = ""
    if is_pseudo_terminal(link.path):
        if port.parity != link.format[1]:
            note = f"A pseudo-terminal has no parity: opened with {port.parity}."
    elif alone and (others := other_openers(link.path)):
        note = f"{others} has the port open too; requests of two programs disturb each other."
    return port, note


async def connect_tcp(link: TcpLink | RtuTcpLink, timeout: float) -> Transport:
    """Connect to a server. Raises LineLost."""
    try:
        return await TcpTransport.connect(link.host, link.port, timeout)
    except TimeoutError:
        reason = "it does not answer. Check the address and the network."
    except ConnectionRefusedError:
        reason = "no program listens on that port. Check the port, and that the device is on."
    except socket.gaierror:
        reason = "the host name is unknown. Check its spelling."
    except (OSError, UnicodeError) as error:
        reason = f"{getattr(error, 'strerror', None) or error}."
    raise LineLost(f"{label(link)} cannot be reached: {reason}")


async def open_transport(link: Link, around: LineContext, *, alone: bool = True) -> Transport:
    """Open the port of a line, or connect to it. Raises the line's errors."""
    if isinstance(link, SerialLink):
        return await open_port(link, alone=alone)
    return await connect_tcp(link, around.timing.connect_timeout)


async def open_master(
    link: Link,
    around: LineContext,
    wake: Callable[[], None],
    opened: Callable[[str], None],
) -> Master:
    """Open a line for requests; `opened` is called for it, with the remark on the port.

    Raises the line's errors.
    """
    transport = await open_transport(link, around)
    wire_time = isinstance(link, SerialLink) and not is_pseudo_terminal(link.path)
    opened(transport.note)
    if isinstance(link, TcpLink):
        return TcpMaster(transport, around, wake, link.unit_of)
    if around.timing.wire_time is not None:
        wire_time = around.timing.wire_time
    if isinstance(transport, PosixSerial | ThreadedSerial):
        counts: Callable[[], PortErrors | None] = transport.errors
    else:
        counts = _no_counts
    master = RtuMaster(transport, link, around, wake, wire_time=wire_time, port_errors=counts)
    if isinstance(transport, PosixSerial | ThreadedSerial):
        master.pause = transport.pause
    return master


def _no_counts() -> None:
    """Report that a device server does not count port errors."""


class Connection:
    """The life of a line in its loop; `changed` is called with each new state."""

    def __init__(
        self,
        link: Link,
        around: LineContext,
        dispatcher: Dispatcher,
        changed: Callable[[LineState, LineError | None], None],
        quiet_after: Callable[[], float],
        shared: SharedLine | None = None,
        last_way: LastWay | None = None,
    ) -> None:
        self._shared = shared
        self._last_way = last_way
        self._link = link
        self._around = around
        self._dispatcher = dispatcher
        self._changed = changed
        self._quiet_after = quiet_after
        self._failures = 0
        self._lost_since: float | None = None
        self._note = ""
        dispatcher.steps.recovered = self._say_connected
        self.refusal: LineError | None = None
        """Reason if requests fail immediately; None while they are accepted."""

    async def run(self) -> None:
        """Connect and serve repeatedly, until canceled."""
        self._say(LineStatus.CONNECTING)
        while True:
            try:
                await self._once()
                continue
            except LineBehind as error:
                # opened again immediately: stops wait for it, all else has failed
                self._say(LineStatus.LOST, str(error), error)
                continue
            except LineError as error:
                failure = error
            except Exception as error:
                # an internal error must not lose the line permanently
                log.exception("the line's loop failed")
                failure = LineFailed(f"The line failed: {error!r}.")
            self._failures += 1
            if type(failure) is LineLost and self._dispatcher.steps.behind:
                # stops are still accepted and kept: the line is opened again soon
                failure, self._failures = LineBehind(str(failure)), 1
            timing = self._around.timing
            delay = pause(self._failures, timing.reconnect_first, timing.reconnect_longest)
            self.refusal = failure
            self._say(LineStatus.LOST, str(failure), failure, delay)
            kind = LineFailed if isinstance(failure, LineFailed) else LineLost
            try:
                self._dispatcher.fail_all(str(failure), kind)
            except Exception:
                log.exception("what waits for the line was not told that it is lost")
            await (self._shared.pause(delay) if self._shared else asyncio.sleep(delay))

    async def _once(self) -> None:
        """Serve one connection until no program needs it. Raises the line's errors when it is
        lost."""
        if self._shared is not None:
            await self._shared.own(self._say_of_owner)
        master = await open_master(
            self._link, self._around, self._dispatcher.wake, self._say_opened
        )
        try:
            self.refusal = None
            self._failures = 0
            if self._last_way is not None:
                self._last_way.master = master
            await self._serve(master)
        finally:
            if self._last_way is not None:
                self._last_way.lose()
            quiet = self._quiet_after()
            master.close()
            if self._shared is not None:
                self._dispatcher.in_flight = False
                self._shared.rest(quiet)
        self._say(LineStatus.CONNECTING)

    async def _serve(self, master: Master) -> None:
        """Serve requests; return when the line is held for other programs and none needs it."""
        if self._shared is None:
            await self._dispatcher.serve(master)
            return
        serving = asyncio.ensure_future(self._dispatcher.serve(master))
        unwanted = asyncio.ensure_future(self._shared.unwanted())
        try:
            done, _ = await asyncio.wait((serving, unwanted), return_when=asyncio.FIRST_COMPLETED)
        finally:
            for task in (serving, unwanted):
                task.cancel()
            await asyncio.wait((serving, unwanted))
        for task in done:
            task.result()

    def _say_opened(self, note: str) -> None:
        self._note = note
        if behind := self._dispatcher.steps.behind:
            self._say(LineStatus.LOST, behind, LineBehind(behind))
        else:
            self._say_connected()

    def _say_connected(self) -> None:
        self._say(LineStatus.CONNECTED, f"{self._dispatcher.facts.unkept} {self._note}".strip())

    def _say_of_owner(self, status: LineStatus, text: str, error: LineError | None) -> None:
        """Report about the program that owns the line; its requests are its own business."""
        if status is LineStatus.CONNECTED:
            self.refusal = None
            self._failures = 0
        self._say(status, text, error)

    def _say(
        self,
        status: LineStatus,
        reason: str = "",
        error: LineError | None = None,
        delay: float | None = None,
    ) -> None:
        now = self._around.clock()
        next_try = None if delay is None else now + delay
        if status is not LineStatus.LOST:
            self._lost_since = None
        elif self._lost_since is None:
            self._lost_since = now
        since = now if self._lost_since is None else self._lost_since
        self._changed(LineState(status, reason, since, next_try), error)
