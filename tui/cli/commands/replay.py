"""`drivepanel replay`: the screens of the panel on a record."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from ..shared.errors import USAGE, Failure
from ..shared.line_argument import LineArgument
from ..shared.options import SLAVE_ADDRESS, one_device
from ..shared.registration import command
from ..shared.standard_streams import NO_RECORD_FROM_INPUT, STANDARD
from .panel import ascii_option, bell_option, low_bandwidth_option, mouse_option, run_panel


@command("Show a record on the screens of the panel.", group="Watch")
@click.argument("source", metavar="FILE|FOLDER|LINE", cls=LineArgument)
@click.option("--at", "at", metavar="TIME", help="Begin at HH:MM[:SS], or at a date with a time.")
@click.option(
    "-d",
    "--device",
    type=SLAVE_ADDRESS,
    multiple=True,
    callback=one_device,
    metavar="ADDRESS",
    help="Show the drive at this address.",
)
@low_bandwidth_option
@mouse_option
@bell_option
@ascii_option
def replay(source: str, at: str | None, device: int | None, **how: Any) -> None:
    """Show a record of a line, or of `drivepanel record`, as the panel showed the drives then.

    A FOLDER with the files of one line, or a LINE of this computer, is shown over all its days.
    Nothing is sent to a drive. Times without a date are local.
    """
    from tui.bus.errors import LinkSyntaxError
    from tui.session.connect.line_key import REPLAY_PREFIX
    from tui.session.connect.recorded_line import replayed
    from tui.session.record.replay_text import ReplayText

    path = Path(source)
    if path == STANDARD:
        raise click.UsageError(NO_RECORD_FROM_INPUT)
    wanted = ReplayText(path.absolute() if path.exists() else path, at or "")
    text = f"{REPLAY_PREFIX}{wanted.text}"
    try:
        line = replayed(text)
    except LinkSyntaxError as error:
        raise Failure(str(error), USAGE) from error
    line.close()
    if device is not None and device not in line.devices:
        known = ", ".join(map(str, line.devices)) or "none"
        raise Failure(f"Drive {device} is not in the record. Its drives: {known}.", USAGE)
    run_panel(text, device, **how)
