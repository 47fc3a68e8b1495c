"""Opening the panel: `drivepanel`, `drivepanel LINE`, `drivepanel demo`."""

from __future__ import annotations

import gc
import os
import sys
from typing import TYPE_CHECKING

import click

from ..shared.completion import complete_line
from ..shared.devices import SLAVE_ADDRESS, one_device
from ..shared.errors import USAGE, Failure, told
from ..shared.lines import is_line
from ..shared.options import read_only_option
from ..shared.signals import ending_by_signal

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine

STOP, LEAVE_RUNNING = "stop", "leave-running"

YOUNGEST = 10_000
"""New objects after which garbage is looked for; a look holds up what a key does."""

DEMO_LINE = "demo"
"""The LINE of the demo inside the panel; every other text is opened as it is written."""


def run_panel(
    start: str | None,
    device: int | None,
    *,
    read_only: bool = False,
    low_bandwidth: bool = False,
    on_hangup: str = STOP,
    mouse: bool = False,
    bell: bool = True,
    ascii: bool | None = None,
) -> None:
    """Run the panel until it is left."""
    if trouble := _terminal_trouble():
        raise Failure(trouble, USAGE)
    gc.disable()  # until the first picture: what is imported and built for it stays
    os.environ.setdefault("TEXTUAL_ANIMATIONS", "none")  # read when textual is first imported
    from tui.app import DrivePanelApp
    from tui.session.connect.open_line import open_line
    from tui.terminal.abilities import abilities_of, fewer_colours, given_environment

    abilities = abilities_of(
        given_environment(os.environ), written_as=sys.stderr.encoding, ascii=ascii
    )
    app = DrivePanelApp(
        open_line=_open_with_demo if start == DEMO_LINE else open_line,
        start=start,
        device=device,
        read_only=read_only,
        low_bandwidth=low_bandwidth,
        leave_running=on_hangup == LEAVE_RUNNING,
        mouse=mouse,
        bell=bell,
        abilities=fewer_colours(abilities) if low_bandwidth else abilities,
        on_shown=_collect_garbage,
    )
    with ending_by_signal(app, stop=on_hangup == STOP):
        app.run()
    if app.begun_journal is not None:
        from .orders import close_journal

        close_journal(app.begun_journal)
    if app.return_code:
        raise click.exceptions.Exit(app.return_code)  # the panel itself has said why


def _open_with_demo(text: str, *, read_only: bool = False, wait: float | None = None) -> OpenLine:
    """The demo's line, or any other that is chosen in the panel afterwards."""
    from tui.session.connect.open_line import demo_line, open_line

    if text == DEMO_LINE:
        from tui.drive.profile.library import demo_drives

        return demo_line({id: hertz for id, (_, hertz) in demo_drives().items()})
    return open_line(text, read_only=read_only, wait=wait)


def _collect_garbage() -> None:
    """Collect garbage from now on, more seldom than usual, and not among what is there by now."""
    gc.freeze()
    gc.set_threshold(YOUNGEST, *gc.get_threshold()[1:])
    gc.enable()


def _terminal_trouble() -> str:
    """Why the panel cannot be drawn here, or nothing."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        return "The panel needs a terminal. Without one, use read, watch or --help."
    if not sys.stderr.isatty():
        return "The panel is drawn on standard error: leave away what leads that elsewhere (2>)."
    return ""


on_hangup_option = click.option(
    "--on-hangup",
    type=click.Choice([STOP, LEAVE_RUNNING]),
    default=STOP,
    show_default=True,
    help="What happens to motors started from here when the terminal is lost.",
)
low_bandwidth_option = click.option(
    "--low-bandwidth", is_flag=True, help="Send as little as possible, for a slow link."
)
mouse_option = click.option(
    "--mouse", is_flag=True, help="Let the terminal report the mouse; the keys do all without."
)


bell_option = click.option(
    "--bell/--no-bell", default=True, show_default=True, help="Ring the bell once for a new fault."
)
ascii_option = click.option(
    "--ascii/--no-ascii",
    default=None,
    help="Draw with ASCII characters only; unless given, as the locale says.",
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
@click.argument("line_text", required=False, metavar="[LINE]", shell_complete=complete_line)
@click.option(
    "-d",
    "--device",
    type=SLAVE_ADDRESS,
    multiple=True,
    callback=one_device,
    metavar="ADDRESS",
    help="Slave address of the drive to open; without it the line is searched.",
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
    if line_text is not None and not is_line(line_text):
        from ..main import no_such_command

        raise click.UsageError(no_such_command(line_text))
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
