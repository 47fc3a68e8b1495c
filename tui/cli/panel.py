"""Opening the panel: `drivepanel`, `drivepanel LINE`, `drivepanel demo`."""

from __future__ import annotations

import os
import sys

import click

from .errors import USAGE, Failure, told
from .options import read_only_option

DEMO = {"atv21": 35.0, "atv31": 25.0, "atv312": 42.0, "atv71": 50.0, "powerdrive": 30.0}
"""Profiles of the demo and the frequency in Hz at which each motor runs."""


def run_panel(
    start: str | None, device: int | None, *, demo: bool = False, read_only: bool = False
) -> None:
    """Run the panel until it is left."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise Failure("The panel needs a terminal. Without one, use read, watch or --help.", USAGE)
    os.environ.setdefault("TEXTUAL_ANIMATIONS", "none")  # read when textual is first imported
    from tui.app import DrivePanelApp
    from tui.session.lines import demo_line, open_line

    app = DrivePanelApp(
        open_line=(lambda _text, **_: demo_line(DEMO)) if demo else open_line,
        start="demo" if demo else start,
        device=device,
        read_only=read_only,
    )
    app.run()


@click.command()
@read_only_option
@told
def demo(read_only: bool) -> None:
    """Open the panel on one simulated line with five running drives."""
    run_panel(None, None, demo=True, read_only=read_only)


@click.command(hidden=True)
@click.argument("line_text", required=False, metavar="[LINE]")
@click.option(
    "-d",
    "--device",
    type=click.IntRange(1, 247),
    metavar="ADDRESS",
    help="Watch the drive at this slave address at once; without it, look for drives.",
)
@read_only_option
@told
def panel(line_text: str | None, device: int | None, read_only: bool) -> None:
    """Open the panel."""
    if device is not None and line_text is None:
        raise click.UsageError("A device is on a line: write LINE -d ADDRESS.")
    run_panel(line_text, device, read_only=read_only)
