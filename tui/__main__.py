"""`drivepanel` and `python -m tui`."""

from __future__ import annotations

import os
import sys

ASKING = ("_DRIVEPANEL_COMPLETE", "DRIVEPANEL_LINE")
"""Set where a shell asks what may follow, and where a LINE is meant though none is typed."""


def main() -> None:
    """Run the command line, or the panel where there is none."""
    if "stop" in sys.argv:
        from tui.cli.short_stop import stop_at_once

        stop_at_once(sys.argv[1:])
    from tui.cli.shared.standard_streams import keep_streams

    keep_streams()
    if len(sys.argv) == 1 and not any(os.environ.get(name) for name in ASKING):
        from tui.cli.opening import alone

        alone()
        return
    from tui.cli.main import main as command
    from tui.cli.shared.typed import ONE_COMMAND

    command(prog_name="drivepanel", obj=ONE_COMMAND)


if __name__ == "__main__":
    main()
