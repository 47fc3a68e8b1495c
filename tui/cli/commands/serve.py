"""`drivepanel serve`: an owner of lines without a screen, and a Modbus TCP gateway to them."""

from __future__ import annotations

import asyncio
import os
import signal
import sys
from contextlib import ExitStack
from typing import TYPE_CHECKING, Any

import click

from ..running.holding import BY_SIGNAL
from ..running.service import Service
from ..running.serving import GatewayWish, served_until_signal
from ..shared.completion import complete_line, complete_profile
from ..shared.devices import devices_option
from ..shared.errors import told
from ..shared.host_port import host_port
from ..shared.line_argument import (
    LINE_VARIABLE,
    line_options,
    mind_the_line,
    named_line_of,
)
from ..shared.looking_after import guard_motors
from ..shared.options import CONNECT_WITHIN, json_option
from ..shared.output import print_json
from ..shared.say import say

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine


@click.command()
@click.argument("lines", nargs=-1, metavar="LINE...", shell_complete=complete_line)
@line_options
@click.option(
    "--tcp", metavar="HOST:PORT", help="Serve Modbus TCP there; loopback where no host is named."
)
@click.option(
    "--map",
    "maps",
    multiple=True,
    metavar="IDS=LINE[@DEVICE]",
    help="Which ids are drives of which line, counted from 1: 101-131=2@1.",
)
@click.option(
    "--fresh",
    type=click.FloatRange(min=0),
    default=0.0,
    metavar="S",
    help="Answer by what was read up to S seconds ago.",
)
@click.option(
    "--allow-writes", metavar="CODES|all", help="Settings that Modbus TCP clients may write."
)
@click.option(
    "--allow-commands",
    is_flag=True,
    help="Modbus TCP clients may start motors and give references, while no panel does.",
)
@devices_option("Id of a drive that does not say who it is; -p names its profile.")
@click.option(
    "-p",
    "--profile",
    "profile_id",
    metavar="ID",
    shell_complete=complete_profile,
    help="Profile of the drives of -d.",
)
@json_option
@told
def serve(
    lines: tuple[str, ...],
    tcp: str | None,
    maps: tuple[str, ...],
    fresh: float,
    allow_writes: str | None,
    allow_commands: bool,
    devices: tuple[int, ...],
    profile_id: str | None,
    as_json: bool,
) -> None:
    """Own lines without a screen until Ctrl-C or SIGTERM; panels and commands attach to them.

    With --tcp programs of others reach the drives by Modbus TCP. They read; what else they may do
    is allowed by options. A word that can only stop a motor always passes.
    """
    texts = _written_out(lines)
    wish = _wish(len(texts), tcp, maps, fresh, allow_writes, allow_commands, devices, profile_id)
    service = Service()

    def ready(tcp: str | None) -> str:
        text = f"{', '.join(texts)}{'' if wish is None else f'; Modbus TCP at {tcp}, {_may(wish)}'}"
        if as_json:
            print_json(_ready_json(texts, tcp, wish), compact=True)
        else:
            say(f"Ready: {text}. Ctrl-C ends it.")
            sys.stdout.flush()
        return text

    with ExitStack() as stack:
        opened = [_opened(stack, text) for text in texts]
        ending = asyncio.run(served_until_signal(opened, wish, service, ready))
    if ending == signal.SIGTERM:
        return
    raise click.exceptions.Exit(BY_SIGNAL + ending)


def _written_out(lines: tuple[str, ...]) -> list[str]:
    """The lines, names resolved; that of the environment where none is typed."""
    typed = lines or tuple(filter(None, [os.environ.get(LINE_VARIABLE)]))
    if not typed:
        raise click.UsageError("Missing argument 'LINE...'.")
    texts = [named.line if (named := named_line_of(text)) else text for text in typed]
    if len(set(texts)) < len(texts):
        raise click.UsageError("A line is named twice.")
    return texts


def _wish(
    count: int,
    tcp: str | None,
    maps: tuple[str, ...],
    fresh: float,
    allow_writes: str | None,
    allow_commands: bool,
    devices: tuple[int, ...],
    profile_id: str | None,
) -> GatewayWish | None:
    """The gateway that the options describe; None without --tcp."""
    if tcp is None:
        if maps or fresh or allow_writes or allow_commands or devices or profile_id:
            raise click.UsageError(
                "--map, --fresh, --allow-writes, --allow-commands, -d and -p go with --tcp."
            )
        return None
    if bool(devices) != (profile_id is not None):
        raise click.UsageError("-d names drives, -p their profile: both, or none.")
    from tui.drive.profile import library
    from tui.session.gateway.rules import GatewayRules, RulesError, allowed_codes, unit_map

    if profile_id is not None:
        library.load(profile_id)
    host, port = host_port(tcp)
    try:
        units = unit_map(count, maps)
        writes = frozenset[str]() if allow_writes is None else allowed_codes(allow_writes)
    except RulesError as error:
        raise click.UsageError(str(error)) from error
    profiles = dict.fromkeys(devices, profile_id or "")
    return GatewayWish(host, port, units, GatewayRules(fresh, writes, allow_commands, profiles))


def _opened(stack: ExitStack, text: str) -> OpenLine:
    """A line, opened for as long as this runs."""
    from tui.session.connect.open_line import open_line

    opened = open_line(text, wait=CONNECT_WITHIN, program="serve")
    stack.callback(opened.close)
    if opened.line.facts.voice is not None and opened.line.facts.others:
        say(f"drivepanel: {opened.line.state.reason}", err=True)
    guard_motors(opened)
    mind_the_line(opened)
    return opened


def _may(wish: GatewayWish) -> str:
    """What clients may do, in a few words."""
    may = ["reads"]
    if wish.rules.writes:
        may.append(f"writes of {', '.join(sorted(wish.rules.writes))}")
    if wish.rules.commands:
        may.append("commands")
    return " and ".join([", ".join(may[:-1]), may[-1]]) if may[1:] else "reads only"


def _ready_json(texts: list[str], tcp: str | None, wish: GatewayWish | None) -> dict[str, Any]:
    return {
        "event": "ready",
        "lines": texts,
        "tcp": tcp,
        "writes": [] if wish is None else sorted(wish.rules.writes),
        "commands": wish is not None and wish.rules.commands,
    }
