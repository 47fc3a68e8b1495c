"""`drivepanel publish`: values of drives to an MQTT broker, cycle after cycle."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..plant.broker import Broker, broker_of, mqtt_password_option
from ..plant.publish_options import check_names
from ..shared.completion import complete_line_or_code
from ..shared.numbers import check_rate
from ..shared.options import Target, drives_options, every_option, json_option
from ..shared.output import print_json
from ..shared.registration import ON_LINE, command
from ..shared.say import say
from ..shared.several_lines import LineWish, further_lines, lines_argument, lines_wished, on_lines

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine


@command("Publish drive values to an MQTT broker.", group="Share", statuses=ON_LINE)
@lines_argument
@click.argument("codes", nargs=-1, metavar="[CODE...]", shell_complete=complete_line_or_code)
@drives_options
@click.option(
    "--mqtt",
    "url",
    required=True,
    metavar="URL",
    help="Use broker mqtt[s]://[USER@]HOST[:PORT][/TOPIC].",
)
@mqtt_password_option
@every_option
@json_option
def publish(
    target: Target,
    codes: tuple[str, ...],
    url: str,
    password_file: Path | None,
    every: float,
    as_json: bool,
) -> None:
    """Publish parameters of drives to an MQTT broker, by default their monitoring set.

    Lines, drives and codes are named as for watch; Ctrl-C ends it. Each cycle of a drive is one
    retained message. A missing drive or broker is retried. The program subscribes to nothing, so no
    message from the broker can cause a write.
    """
    more, codes = further_lines(codes)
    wishes = lines_wished(target, more)
    broker = broker_of(url, password_file)
    check_names(broker, [wish.name for wish in wishes])

    async def work(opened: Sequence[OpenLine]) -> None:
        await _published(wishes, opened, codes, broker, every, as_json=as_json)

    on_lines(wishes, work, read_only=False)


async def _published(
    wishes: Sequence[LineWish],
    opened: Sequence[OpenLine],
    codes: Sequence[str],
    broker: Broker,
    every: float,
    *,
    as_json: bool,
) -> None:
    """Publish until this is cancelled."""
    from ..documents.other_documents import PublishReady
    from ..plant.drives import PlantDrive, PlantLine
    from ..plant.publishing import Changes, published_to, reading

    changes = Changes()
    for line, wish in zip(opened, wishes, strict=True):
        check_rate(line.line.link, every, len(wish.on(line)))
    lines = [
        PlantLine(
            wish.name,
            line,
            tuple(PlantDrive(line, target, codes, every, changes) for target in wish.on(line)),
        )
        for wish, line in zip(wishes, opened, strict=True)
    ]
    async with published_to(lines, broker, changes) as place, reading(lines):
        if as_json:
            print_json(PublishReady(mqtt=place), compact=True)
        else:
            say(f"Ready: values to {place}. Ctrl-C ends it.")
        await asyncio.Event().wait()
