"""`drivepanel` and `python -m tui`."""

from __future__ import annotations

import os
import sys

COMPLETES = "_DRIVEPANEL_COMPLETE"
"""Set where a shell asks what may follow."""


def main() -> None:
    """Run the command line, or the panel where there is none."""
    if len(sys.argv) == 1 and COMPLETES not in os.environ:
        from tui.cli.alone import alone

        alone()
        return
    from tui.cli.main import main as command

    command(prog_name="drivepanel")


if __name__ == "__main__":
    main()
