"""`drivepanel` without arguments: opens the panel without importing a parser."""

from __future__ import annotations

import gc
import sys

from tui.session.logs import start_logging

from .opening import open_panel, terminal_trouble


def alone() -> None:
    """Open the panel; every failure is reported as by other commands."""
    gc.disable()  # until the first picture
    try:
        start_logging(0)
        if not terminal_trouble():
            sys.exit(open_panel(None, None))
    except (Exception, KeyboardInterrupt) as error:
        _tell(error)
    from .main import main

    main(prog_name="drivepanel")


def _tell(error: BaseException) -> None:
    """Report an error and end with its status."""
    import click

    from .shared.errors import reported

    @click.command()
    @reported
    def failed() -> None:
        raise error

    failed(args=[], prog_name="drivepanel")
