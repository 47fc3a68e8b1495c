"""Opening the panel: `drivepanel`, `drivepanel LINE`, `drivepanel demo`."""

from __future__ import annotations

from typing import Any

import click

from ..opening import DEMO_LINE, LEAVE_RUNNING, STOP, open_panel, terminal_trouble
from ..shared.errors import USAGE, Failure, told
from ..shared.options import SLAVE_ADDRESS, read_only_option


def run_panel(start: str | None, device: int | None, **how: Any) -> None:
    """Run the panel until it is left; `how` as for `open_panel`."""
    if trouble := terminal_trouble():
        raise Failure(trouble, USAGE)
    if status := open_panel(start, device, **how):
        raise click.exceptions.Exit(status)  # the panel itself has said why


on_hangup_option = click.option(
    "--on-hangup",
    type=click.Choice([STOP, LEAVE_RUNNING]),
    default=STOP,
    show_default=True,
    help="What becomes of motors commanded from here when the terminal goes away.",
)
low_bandwidth_option = click.option(
    "--low-bandwidth", is_flag=True, help="Send as little as possible to a slow terminal."
)
mouse_option = click.option(
    "--mouse", is_flag=True, help="Let the terminal report its mouse; the panel needs none."
)


bell_option = click.option(
    "--bell/--no-bell", default=True, show_default=True, help="Ring once for a new fault."
)
ascii_option = click.option(
    "--ascii/--no-ascii",
    default=None,
    help="Draw with plain signs only; what the locale says otherwise.",
)


@click.command()
@low_bandwidth_option
@on_hangup_option
@mouse_option
@bell_option
@ascii_option
@told
def demo(low_bandwidth: bool, on_hangup: str, mouse: bool, bell: bool, ascii: bool | None) -> None:
    """Open the panel on one simulated line with five running drives."""
    run_panel(
        DEMO_LINE,
        None,
        low_bandwidth=low_bandwidth,
        on_hangup=on_hangup,
        mouse=mouse,
        bell=bell,
        ascii=ascii,
    )


@click.command(hidden=True)
@click.argument("line_text", required=False, metavar="[LINE]")
@click.option(
    "-d",
    "--device",
    type=SLAVE_ADDRESS,
    metavar="ADDRESS",
    help="Watch the drive at this slave address at once; without it, look for drives.",
)
@read_only_option
@low_bandwidth_option
@on_hangup_option
@mouse_option
@bell_option
@ascii_option
@told
def panel(
    line_text: str | None,
    device: int | None,
    read_only: bool,
    low_bandwidth: bool,
    on_hangup: str,
    mouse: bool,
    bell: bool,
    ascii: bool | None,
) -> None:
    """Open the panel."""
    if device is not None and line_text is None:
        raise click.UsageError("A device is on a line: write LINE -d ADDRESS.")
    run_panel(
        line_text,
        device,
        read_only=read_only,
        low_bandwidth=low_bandwidth,
        on_hangup=on_hangup,
        mouse=mouse,
        bell=bell,
        ascii=ascii,
    )
