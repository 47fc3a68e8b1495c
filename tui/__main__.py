"""`drivepanel` and `python -m tui`."""

from __future__ import annotations

import os
import sys

TYPE_CHECKING = False
"""As in typing, whose import would hold up a stop."""
if TYPE_CHECKING:
    from collections.abc import Callable

    from tui.bus.share.keeping import KeeperOrder

ASKING = ("_DRIVEPANEL_COMPLETE", "DRIVEPANEL_LINE")
"""Set where a shell asks what may follow, and where a LINE is meant though none is typed."""

NO_KEEPER = "DRIVEPANEL_NO_KEEPER"
"""Set by tests: a program that opens a line first holds it itself, as where no process can."""


def main() -> None:
    """Run the command line, or the panel where there is none."""
    if "stop" in sys.argv:
        from tui.cli.short_stop import stop_at_once

        stop_at_once(sys.argv[1:])
    from tui.cli.shared.standard_streams import keep_streams

    keep_streams()
    _have_keepers()
    if len(sys.argv) == 1 and not any(os.environ.get(name) for name in ASKING):
        from tui.cli.alone import alone

        alone()
        return
    from tui.cli.main import main as command
    from tui.cli.shared.typed import ONE_COMMAND

    command(prog_name="drivepanel", obj=ONE_COMMAND)


def _have_keepers() -> None:
    """Have a process of its own hold each line that is opened."""
    from tui.session.connect import keepers

    if os.name == "posix" and not os.environ.get(NO_KEEPER):
        keepers.start = _start_keeper


def _start_keeper(
    order: KeeperOrder, lock: int, started: Callable[[int], None]
) -> Callable[[], bool]:
    # imported with the first line: the panel shows itself before that
    from tui.keeper.starting import start_keeper

    return start_keeper(order, lock, started)


if __name__ == "__main__":
    main()
