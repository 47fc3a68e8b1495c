"""`drivepanel serve`: an owner of lines without a screen, and a Modbus TCP gateway to them."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tui.session.signals import BY_SIGNAL

from ..plant.broker import mqtt_password_option
from ..plant.publish_options import (
    PublishOptions,
    check_drives,
    check_names,
    publish_options,
    read_drives,
)
from ..running.serving import GatewayWish, OpenedLine, ServedAt, Service, served_until_signal
from ..shared.completion import complete_line
from ..shared.line_argument import LINE_VARIABLE, line_options, mind_the_line
from ..shared.looking_after import guard_motors, say_shared
from ..shared.numbers import SHORTEST_CYCLE, seconds
from ..shared.options import (
    CONNECT_WITHIN,
    devices_option,
    host_port,
    json_option,
    profile_of,
    usual_settings,
)
from ..shared.output import print_json
from ..shared.registration import ON_LINE, command
from ..shared.say import say
from ..shared.served_lines import ServedLine, served_lines
from ..shared.signals import never_suspended

if TYPE_CHECKING:
    from ..documents.other_documents import ServeReady


@command("Run headless and serve lines over Modbus TCP.", group="Share", statuses=ON_LINE)
@click.argument("lines", nargs=-1, metavar="LINE...", shell_complete=complete_line)
@line_options
@click.option("--tcp", metavar="HOST:PORT", help="Serve Modbus TCP (default host: loopback).")
@click.option(
    "--map",
    "maps",
    multiple=True,
    metavar="IDS=LINE[@DEVICE]",
    help="Map unit ids to drives of a line: 101-131=2@1.",
)
@click.option(
    "--fresh",
    type=seconds(),
    default=0.0,
    metavar="S",
    help="Answer by what was read up to S seconds ago.",
)
@click.option(
    "--allow-writes", metavar="CODES|all", help="Allow Modbus TCP clients to write these settings."
)
@click.option(
    "--allow-commands",
    is_flag=True,
    help="Allow Modbus TCP clients to command drives.",
)
@click.option(
    "--metrics",
    metavar="HOST:PORT",
    help="Serve drive values to Prometheus (default host: loopback).",
)
@click.option(
    "--mqtt",
    metavar="URL",
    help="Publish to mqtt[s]://[USER@]HOST[:PORT][/TOPIC].",
)
@mqtt_password_option
@click.option(
    "--every",
    type=seconds(SHORTEST_CYCLE),
    metavar="S",
    help="Poll for --metrics and --mqtt every S seconds (default: 1).",
)
@devices_option("Serve this drive, which does not identify itself; needs -p.")
@profile_of("Use this profile for the drives of -d.")
@json_option
def serve(
    lines: tuple[str, ...],
    tcp: str | None,
    maps: tuple[str, ...],
    fresh: float,
    allow_writes: str | None,
    allow_commands: bool,
    metrics: str | None,
    mqtt: str | None,
    password_file: Path | None,
    every: float | None,
    devices: tuple[int, ...],
    profile_id: str | None,
    as_json: bool,
) -> None:
    """Own lines without a screen until Ctrl-C or SIGTERM; panels and commands attach to them.

    With --tcp, third-party programs reach the drives by Modbus TCP. They can read; options allow
    more. A word that can only stop a motor always passes.

    With --metrics and --mqtt, drives are read cycle by cycle, as by watch. Name them by a name of
    the settings file, by LINE@1,2, or by -d.
    """
    served = served_lines(_words(lines))
    plant = publish_options(metrics, mqtt, password_file, every)
    if bool(devices) != (profile_id is not None):
        raise click.UsageError("-d names drives, -p their profile: both, or none.")
    if tcp is None:
        if maps or fresh or allow_writes or allow_commands:
            raise click.UsageError(
                "--map, --fresh, --allow-writes, --allow-commands require --tcp."
            )
        if devices and plant is None:
            raise click.UsageError("-d and -p require --tcp, --metrics or --mqtt.")
    wish = _wish(len(served), tcp, maps, fresh, allow_writes, allow_commands)
    served = with_named(served, wish, devices, profile_id)
    if plant is not None:
        check_drives(served)
        if plant.broker is not None:
            check_names(plant.broker, [line.name for line in served])
    service, texts = Service(), [line.text for line in served]

    def ready(places: ServedAt) -> str:
        text = ", ".join(texts) + _reached(places, wish)
        if as_json:
            print_json(_ready_document(texts, places, wish), compact=True)
        else:
            say(f"Ready: {text}. Ctrl-C ends it.")
            sys.stdout.flush()
        return text

    with ExitStack() as stack:
        stack.enter_context(never_suspended())
        opened = [_opened(stack, line, plant) for line in served]
        ending = asyncio.run(served_until_signal(opened, wish, plant, service, ready))
    if ending == signal.SIGTERM:
        return
    raise click.exceptions.Exit(BY_SIGNAL + ending)


def _words(typed: tuple[str, ...]) -> tuple[str, ...]:
    """The LINEs as they were typed, that of the environment where there is none."""
    words = typed or tuple(filter(None, [os.environ.get(LINE_VARIABLE)]))
    if not words:
        raise click.UsageError("Missing argument 'LINE...'.")
    return words


def with_named(
    served: list[ServedLine],
    wish: GatewayWish | None,
    devices: tuple[int, ...],
    profile_id: str | None,
) -> list[ServedLine]:
    """The lines with the drives of -d: ids of the gateway, else addresses on the only line."""
    if profile_id is None:
        return served
    from tui.drive.profile import library

    library.load(profile_id)
    if wish is None and len(served) > 1:
        raise click.UsageError("-d is on which line? Write LINE@1,2, or name lines and drives.")
    units = wish.units if wish is not None else {device: (0, device) for device in devices}
    for number in devices:
        if (place := units.get(number)) is not None:
            line, device = place
            served[line] = served[line].with_drives([device], {device: profile_id})
    return served


def _wish(
    count: int,
    tcp: str | None,
    maps: tuple[str, ...],
    fresh: float,
    allow_writes: str | None,
    allow_commands: bool,
) -> GatewayWish | None:
    """The gateway that the options describe; None without --tcp."""
    if tcp is None:
        return None
    from tui.session.gateway.rules import (
        GatewayRules,
        RulesError,
        allowed_codes,
        as_written,
        unit_map,
    )

    host, port = host_port(tcp)
    try:
        units = unit_map(count, maps)
        typed = frozenset[str]() if allow_writes is None else allowed_codes(allow_writes)
        writes = as_written(typed)
    except RulesError as error:
        raise click.UsageError(str(error)) from error
    return GatewayWish(host, port, units, GatewayRules(fresh, writes, allow_commands))


def _opened(stack: ExitStack, served: ServedLine, plant: PublishOptions | None) -> OpenedLine:
    """A line, opened for as long as this runs."""
    from tui.session.connect.open_line import open_line

    usual = usual_settings(served.usual_profile)
    opened = open_line(served.text, wait=CONNECT_WITHIN, usual=usual, program="serve")
    stack.callback(opened.close)
    say_shared(opened)
    guard_motors(opened)
    mind_the_line(opened)
    drives = read_drives(served, opened.devices) if plant is not None else []
    return OpenedLine(served.name, opened, served.profiles, drives)


def _reached(places: ServedAt, wish: GatewayWish | None) -> str:
    """Return the addresses of the server in a few words."""
    parts = [""]
    if wish is not None:
        parts.append(f"Modbus TCP at {places.tcp}, {_may(wish)}")
    if places.metrics is not None:
        parts.append(f"metrics at {places.metrics}")
    if places.mqtt is not None:
        parts.append(f"values to {places.mqtt}")
    return "; ".join(parts)


_MAY = {
    (False, False): "reads only",
    (True, False): "reads and writes of {codes}",
    (False, True): "reads and commands",
    (True, True): "reads, writes of {codes} and commands",
}
"""Rights of clients, by whether they may write and command."""


def _may(wish: GatewayWish) -> str:
    """Return the rights of clients in a few words."""
    text = _MAY[bool(wish.rules.writes), bool(wish.rules.commands)]
    return text.format(codes=", ".join(sorted(wish.rules.writes)))


def _ready_document(texts: list[str], places: ServedAt, wish: GatewayWish | None) -> ServeReady:
    from ..documents.other_documents import ServeReady

    return ServeReady(
        lines=texts,
        tcp=places.tcp,
        metrics=places.metrics,
        mqtt=places.mqtt,
        writes=[] if wish is None else sorted(wish.rules.writes),
        commands=wish is not None and wish.rules.commands,
    )
