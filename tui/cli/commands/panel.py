"""Opening the panel: `drivepanel`, `drivepanel LINE`, `drivepanel demo`."""

from __future__ import annotations

from typing import Any

import click

from tui.session.paths import recent_lines

from ..opening import DEMO_LINE, LEAVE_RUNNING, STOP, open_panel, terminal_trouble
from ..shared.completion import complete_line
from ..shared.errors import USAGE, Failure
from ..shared.line_argument import LineArgument, is_line, share_group_option
from ..shared.options import SLAVE_ADDRESS, one_device, read_only_option
from ..shared.registration import command


def run_panel(start: str | None, device: int | None, **how: Any) -> None:
    """Run the panel until it is left; `how` are the options, as for `open_panel`."""
    if trouble := terminal_trouble():
        raise Failure(trouble, USAGE)
    if status := open_panel(start, device, **how):
        raise click.exceptions.Exit(status)  # the panel itself has said why


on_hangup_option = click.option(
    "--on-hangup",
    type=click.Choice([STOP, LEAVE_RUNNING]),
    default=STOP,
    show_default=True,
    help="Set what happens to its motors if the panel is lost.",
)
low_bandwidth_option = click.option(
    "--low-bandwidth", is_flag=True, help="Send as little as possible, for a slow link."
)
mouse_option = click.option(
    "--mouse", is_flag=True, help="Use the mouse; every function also has a key."
)


bell_option = click.option(
    "--bell/--no-bell",
    default=True,
    show_default=True,
    help="Report a new fault by the terminal bell.",
)
ascii_option = click.option(
    "--ascii/--no-ascii",
    default=None,
    help="Show ASCII characters only (default: by locale).",
)


@command("Open the panel on five running simulated drives.", group="Profiles")
@low_bandwidth_option
@on_hangup_option
@mouse_option
@bell_option
@ascii_option
def demo(**how: Any) -> None:
    """Open the panel on one simulated line with five running drives."""
    run_panel(DEMO_LINE, None, **how)


def _as_used_last(line_text: str) -> str:
    """Return a port that names no settings with those of its last use, as the form of Line does."""
    from tui.session.connect.named_lines import named_lines
    from tui.session.connect.port_settings import with_last_settings

    if any(line.line == line_text for line in named_lines().values()):
        return line_text  # what the settings file says
    return with_last_settings(line_text, recent_lines())


@command("Open the panel.", hidden=True)
@click.argument(
    "line_text",
    required=False,
    metavar="[LINE]",
    cls=LineArgument,
    shell_complete=complete_line,
)
@click.option(
    "-d",
    "--device",
    type=SLAVE_ADDRESS,
    multiple=True,
    callback=one_device,
    metavar="ADDRESS",
    help="Open the drive at this address instead of scanning the line.",
)
@share_group_option
@read_only_option
@low_bandwidth_option
@on_hangup_option
@mouse_option
@bell_option
@ascii_option
def panel(line_text: str | None, device: int | None, **how: Any) -> None:
    """Open the panel."""
    if device is not None and line_text is None:
        raise click.UsageError("A device is on a line: write LINE -d ADDRESS.")
    if line_text is not None and not is_line(line_text):
        from ..main import no_such_command

        raise click.UsageError(no_such_command(line_text))
    run_panel(None if line_text is None else _as_used_last(line_text), device, **how)
