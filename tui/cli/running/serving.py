"""Serving lines, and a gateway to them, until a signal ends it."""

from __future__ import annotations

import asyncio
import ipaddress
import signal
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..commands.orders import close_journal, told_journal
from ..shared.errors import LINE_TROUBLE, Failure
from ..shared.host_port import written_host_port
from ..shared.line_argument import mind_the_drive
from ..shared.say import say
from .ending import Ending
from .line_pulse import LinePulse
from .service import Service

if TYPE_CHECKING:
    from tui.session.connect.identify import DriveIdentity
    from tui.session.connect.open_line import OpenLine
    from tui.session.gateway.drives import Note
    from tui.session.gateway.rules import GatewayRules
    from tui.session.journal import Journal


@dataclass(frozen=True, slots=True)
class GatewayWish:
    """The gateway that is wanted: where it listens, and what its clients may do."""

    host: str
    port: int
    units: Mapping[int, tuple[int, int]]
    rules: GatewayRules


Ready = Callable[[str | None], str]
"""Says that all is served, with the LINE of the gateway; gives it in one line for systemd."""


async def served_until_signal(
    opened: list[OpenLine], wish: GatewayWish | None, service: Service, ready: Ready
) -> int:
    """Serve until a signal comes; its number."""
    ending, journal = Ending(), told_journal()
    pulses = [LinePulse(one.line) for one in opened]
    with ending.by_signals():
        watch = asyncio.create_task(service.watch(lambda: all(one.alive for one in pulses)))
        try:
            await _gateway(opened, wish, journal, service, ending, ready)
        finally:
            watch.cancel()
    await asyncio.to_thread(close_journal, journal)
    return int(signal.Signals[ending.why.removeprefix("ended by ")])


async def _gateway(
    opened: list[OpenLine],
    wish: GatewayWish | None,
    journal: Journal,
    service: Service,
    ending: Ending,
    ready: Ready,
) -> None:
    if wish is None:
        service.ready(ready(None))
        await ending.event.wait()
        service.stopping()
        return
    from tui.bus.gateway.server import TcpGateway
    from tui.session.gateway.gateway import Gateway
    from tui.session.gateway.line import GatewayLine

    lines = [GatewayLine(one.line, journal, _noting(one)) for one in opened]
    gateway = Gateway(lines, wish.units, wish.rules)
    server = TcpGateway(gateway.answer, gateway.gone)
    try:
        try:
            host, port = await server.listen(wish.host, wish.port)
        except OSError as error:
            place = written_host_port(wish.host, wish.port)
            why = error.strerror or str(error)
            raise Failure(f"Nothing can be served at {place}: {why}.", LINE_TROUBLE) from error
        _warn(wish, host, port)
        service.ready(ready(f"tcp:{written_host_port(host, port)}"))
        await ending.event.wait()
    finally:
        service.stopping()
        await server.close()
        for told in await gateway.close():
            say(f"drivepanel: {told.head if told.failed else 'Stopped:'} {told.text}", err=True)


def _noting(opened: OpenLine) -> Note:
    def note(device: int, identity: DriveIdentity | None, profile: str) -> None:
        mind_the_drive(opened, device, identity, profile)

    return note


def _warn(wish: GatewayWish, host: str, port: int) -> None:
    """Say what it means to listen where other computers reach it."""
    if _is_loopback(host):
        return
    more = ", and may do what the options allow" if _allows(wish.rules) else ""
    say(
        f"drivepanel: Modbus TCP knows no password: whoever reaches"
        f" {written_host_port(host, port)} reads these drives and stops their motors{more}."
        " Let a firewall decide who does.",
        err=True,
    )


def _allows(rules: GatewayRules) -> bool:
    return bool(rules.writes) or rules.commands


def _is_loopback(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"
