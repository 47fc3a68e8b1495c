"""The panel, with an error in its drawing as soon as a file exists.

    BROKEN_PANEL=FILE python -m benchmarks.broken_panel LINE [OPTIONS]

The file holds the name of the method that fails: `put` draws the lines of a screen, `draw_frame`
the frame around screens and dialogs. The time of the first error is written beside that file, in
seconds of the monotonic clock, which all programs of a machine share.
"""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Any

from tui.__main__ import main as run_panel
from tui.screens.base import PanelScreen
from tui.screens.frame import Framed

FAILING = {"put": PanelScreen, "draw_frame": Framed}


class InjectedError(RuntimeError):
    """An error that no code expects."""


def inject(name: str, switch: Path) -> None:
    """Make a method fail once its name is in the file."""
    owner = FAILING[name]
    original = getattr(owner, name)

    def failing(self: Any, *arguments: Any) -> Any:
        if switch.exists() and switch.read_text("utf-8") == name:
            raised = switch.with_suffix(".raised")
            if not raised.exists():
                raised.write_text(repr(time.monotonic()), "utf-8")
            raise InjectedError("injected by the benchmark")
        return original(self, *arguments)

    setattr(owner, name, failing)


def main() -> None:
    """Run the panel with its two faults prepared."""
    for name in FAILING:
        inject(name, Path(os.environ["BROKEN_PANEL"]))
    run_panel()


if __name__ == "__main__":
    main()
