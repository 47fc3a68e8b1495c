"""The option -d: the slave address of one drive, or of several."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

CommandFunction = Callable[..., Any]
Option = Callable[[CommandFunction], CommandFunction]

SLAVE_ADDRESS = click.IntRange(1, 247)


def one_device(_: click.Context, option: click.Parameter, given: tuple[int, ...]) -> int | None:
    """The one address of an option -d that may be given once; the last would win otherwise."""
    if len(given) > 1:
        raise click.BadParameter("once only: this command is for one drive.", param=option)
    return given[0] if given else None


device_option = click.option(
    "-d",
    "--device",
    type=SLAVE_ADDRESS,
    multiple=True,
    callback=one_device,
    default=(1,),
    show_default=True,
    metavar="ADDRESS",
    help="Use the drive at this slave address.",
)
several_devices_option = click.option(
    "-d",
    "--device",
    type=SLAVE_ADDRESS,
    multiple=True,
    default=(1,),
    show_default=True,
    metavar="ADDRESS",
    help="Use the drive at this slave address; repeatable.",
)


def devices_option(help_text: str, **more: Any) -> Option:
    """The option -d of a command that takes several drives; `more` goes to click."""
    return click.option(
        "-d",
        "--device",
        "devices",
        type=SLAVE_ADDRESS,
        multiple=True,
        metavar="ADDRESS",
        help=help_text,
        **more,
    )
