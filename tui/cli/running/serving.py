"""Serving lines, a gateway to them and their values for the plant, until a signal ends it.

Messages to systemd follow the protocol of sd_notify: each is a datagram to the socket that
NOTIFY_SOCKET names. Without it nothing is sent.
"""

from __future__ import annotations

import asyncio
import logging
import os
import socket
import time
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from tui.session.running.ending import Ending

from ..plant.publish_options import PublishOptions, is_loopback
from ..shared.drive_commands import close_journal, journal_document
from ..shared.errors import LINE_TROUBLE, Failure
from ..shared.line_argument import mind_the_drive
from ..shared.numbers import check_rate
from ..shared.options import Target, why_not_served, written_host_port
from ..shared.pending_timeouts import say_farewells
from ..shared.say import say

if TYPE_CHECKING:
    from tui.bus.api import ModbusLine
    from tui.session.connect.identify import DriveIdentity
    from tui.session.connect.open_line import OpenLine
    from tui.session.gateway.drives import Note
    from tui.session.gateway.line import GatewayLine
    from tui.session.gateway.rules import GatewayRules
    from tui.session.journal import Journal


log = logging.getLogger(__name__)

SHARE_OF_WATCHDOG = 3
"""Heartbeats per time that systemd allows."""


class Service:
    """This program as systemd knows it."""

    def __init__(self, environment: Mapping[str, str] = os.environ) -> None:
        self._place = environment.get("NOTIFY_SOCKET", "")
        self._limit = _watchdog_seconds(environment)

    def ready(self, status: str) -> None:
        """Everything that was asked for is served."""
        self._tell(f"READY=1\nSTATUS={' '.join(status.split())}")

    def stopping(self) -> None:
        """The end was begun."""
        self._tell("STOPPING=1\nSTATUS=Ending")

    async def watch(self, alive: Callable[[], bool]) -> None:
        """Send heartbeats while `alive` returns True; return immediately without a watchdog."""
        if self._limit is None:
            return
        while True:
            if alive():
                self._tell("WATCHDOG=1")
            else:
                log.error("the line loop hangs: systemd gets no heartbeat")
            await asyncio.sleep(self._limit / SHARE_OF_WATCHDOG)

    @property
    def watchdog(self) -> float | None:
        """Seconds after which systemd ends a program without signs of life; None: it never does."""
        return self._limit

    def _tell(self, text: str) -> None:
        if not self._place:
            return
        # an abstract address begins with a zero, which no variable can hold
        address = f"\0{self._place[1:]}" if self._place.startswith("@") else self._place
        try:
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as sender:
                sender.connect(address)
                sender.sendall(text.encode())
        except OSError as error:
            log.warning("systemd was not told %r: %s", text, error)


def _watchdog_seconds(environment: Mapping[str, str]) -> float | None:
    """The time that systemd allows between two signs of life, where it watches this process."""
    text, pid = environment.get("WATCHDOG_USEC", ""), environment.get("WATCHDOG_PID", "")
    if not text.isdecimal() or not int(text) or (pid and pid != str(os.getpid())):
        return None
    return int(text) / 1e6


PULSE_INTERVAL = 0.5
STILL_AFTER = 5.0
"""Seconds without a beat after which a line counts as standing still."""


class LinePulse:
    """Beats in the loop of a line; `alive` may be asked in any thread."""

    def __init__(self, line: ModbusLine) -> None:
        self._last = time.monotonic()
        self._worker = line.spawn(self._beat, "pulse")

    @property
    def alive(self) -> bool:
        """True if it beat a moment ago."""
        return not self._worker.done() and time.monotonic() - self._last < STILL_AFTER

    async def _beat(self) -> None:
        while True:
            self._last = time.monotonic()
            await asyncio.sleep(PULSE_INTERVAL)


@dataclass(frozen=True, slots=True)
class GatewayWish:
    """Options of the gateway: its address, and the rights of its clients."""

    host: str
    port: int
    units: Mapping[int, tuple[int, int]]
    rules: GatewayRules


@dataclass(frozen=True, slots=True)
class OpenedLine:
    """A line that is served, with the facts configured for its drives."""

    name: str
    opened: OpenLine
    profiles: Mapping[int, str]
    """By device, those that a person has named."""
    drives: Sequence[Target] = ()
    """Those that are read for the plant."""


@dataclass(frozen=True, slots=True)
class ServedAt:
    """Addresses of the servers; None for those that are off."""

    tcp: str | None = None
    metrics: str | None = None
    mqtt: str | None = None


Ready = Callable[[ServedAt], str]
"""Reports that all is served, with the addresses; returns one line for systemd."""


async def served_until_signal(
    lines: Sequence[OpenedLine],
    gateway: GatewayWish | None,
    plant: PublishOptions | None,
    service: Service,
    ready: Ready,
) -> int:
    """Serve until a signal comes; its number."""
    ending, journal = Ending(), journal_document()
    pulses = [LinePulse(line.opened.line) for line in lines]
    with ending.by_signals():
        watch = asyncio.create_task(service.watch(lambda: all(pulse.alive for pulse in pulses)))
        try:
            async with AsyncExitStack() as stack:
                places = await _served(stack, lines, gateway, plant, journal)
                service.ready(ready(places))
                await ending.event.wait()
                service.stopping()
        finally:
            watch.cancel()
    await asyncio.to_thread(close_journal, journal)
    return ending.number


async def _served(
    stack: AsyncExitStack,
    lines: Sequence[OpenedLine],
    wish: GatewayWish | None,
    plant: PublishOptions | None,
    journal: Journal,
) -> ServedAt:
    """Begin all that is wanted; it ends with the stack, the gateway with its motors first."""
    places = ServedAt()
    gates = _gates(lines, journal) if wish is not None else ()
    for line in lines:
        stack.push_async_callback(say_farewells, line.opened)
    if plant is not None:
        places = await _published(stack, lines, plant, gates)
    if wish is not None:
        place = await stack.enter_async_context(_gateway(gates, wish))
        places = replace(places, tcp=place)
    return places


async def _published(
    stack: AsyncExitStack,
    lines: Sequence[OpenedLine],
    plant: PublishOptions,
    gates: Sequence[GatewayLine],
) -> ServedAt:
    """Read the drives, and hand their values out."""
    from ..plant.drives import PlantDrive, PlantLine, Sign, no_sign
    from ..plant.publishing import Changes, metrics_at, published_to, reading

    places, changes = ServedAt(), Changes()
    signs: list[Sign] = [gate.sign for gate in gates] or [no_sign for _ in lines]
    for line in lines:
        check_rate(line.opened.line.link, plant.every, len(line.drives))
    read = [
        PlantLine(
            line.name,
            line.opened,
            tuple(PlantDrive(line.opened, t, (), plant.every, changes, sign) for t in line.drives),
        )
        for line, sign in zip(lines, signs, strict=True)
    ]
    if plant.metrics is not None:
        at = await stack.enter_async_context(metrics_at(read, *plant.metrics))
        places = replace(places, metrics=at)
    if plant.broker is not None:
        at = await stack.enter_async_context(published_to(read, plant.broker, changes))
        places = replace(places, mqtt=at)
    await stack.enter_async_context(reading(read))
    return places


def _gates(lines: Sequence[OpenedLine], journal: Journal) -> list[GatewayLine]:
    from tui.session.gateway.line import GatewayLine

    return [
        GatewayLine(line.opened.line, journal, _noting(line.opened), line.profiles)
        for line in lines
    ]


@asynccontextmanager
async def _gateway(gates: Sequence[GatewayLine], wish: GatewayWish) -> AsyncIterator[str]:
    """While inside, Modbus TCP is served; the LINE to it. Motors of clients are stopped after."""
    from tui.bus.gateway.server import TcpGateway
    from tui.session.gateway.gateway import Gateway

    gateway = Gateway(gates, wish.units, wish.rules)
    server = TcpGateway(gateway.answer, gateway.gone)
    try:
        try:
            host, port = await server.listen(wish.host, wish.port)
        except OSError as error:
            place = written_host_port(wish.host, wish.port)
            why = why_not_served(error)
            raise Failure(f"Nothing can be served at {place}: {why}.", LINE_TROUBLE) from error
        _warn(wish, host, port)
        yield f"tcp:{written_host_port(host, port)}"
    finally:
        await server.close()
        for reported in await gateway.close():
            head = reported.head if reported.failed else "Stopped:"
            say(f"drivepanel: {head} {reported.text}", err=True)


def _noting(opened: OpenLine) -> Note:
    def note(device: int, identity: DriveIdentity | None, profile: str) -> None:
        mind_the_drive(opened, device, identity, profile)

    return note


_OPEN_TO_READ = (
    "Modbus TCP has no password: anyone who can reach {place} can read these drives and stop their"
    " motors. Restrict access by a firewall."
)
_OPEN_AS_ALLOWED = (
    "Modbus TCP has no password: anyone who can reach {place} can read these drives and stop their"
    " motors, and do what the options allow. Restrict access by a firewall."
)


def _warn(wish: GatewayWish, host: str, port: int) -> None:
    """Warn if other computers can reach the gateway."""
    if is_loopback(host):
        return
    allows = wish.rules.writes or wish.rules.commands
    text = _OPEN_AS_ALLOWED if allows else _OPEN_TO_READ
    say(f"drivepanel: {text.format(place=written_host_port(host, port))}", err=True)
