"""The panel with errors planted in it.

    python -m tests.line.failing_panel PLANTS ARGUMENT...

PLANTS is a JSON list of plants; each raises its error once its file exists.
"""

from __future__ import annotations

import functools
import importlib
import inspect
import json
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

TEXT = "a screw is loose"
"""The text of each error."""


class Unspeakable(Exception):
    """An error whose text raises."""

    def __str__(self) -> str:
        raise RuntimeError(TEXT)


class Lengthy(Exception):
    """An error whose text looks like a traceback."""

    def __str__(self) -> str:
        return f"{TEXT}\n" + "Traceback (most recent call last):\n  File x\n\x1b[2J" * 100


def _too_deep() -> None:
    _too_deep()


def _hang() -> None:
    while True:
        time.sleep(1)


def _fail(error: type[BaseException]) -> None:
    raise error(TEXT)


def _exit() -> None:
    sys.exit(3)


ERRORS: Mapping[str, Callable[[], None]] = {
    "RuntimeError": functools.partial(_fail, RuntimeError),
    "MemoryError": functools.partial(_fail, MemoryError),
    "KeyboardInterrupt": functools.partial(_fail, KeyboardInterrupt),
    "Unspeakable": functools.partial(_fail, Unspeakable),
    "Lengthy": functools.partial(_fail, Lengthy),
    "RecursionError": _too_deep,
    "SystemExit": _exit,
    "hang": _hang,
}


@dataclass(frozen=True, slots=True)
class Plant:
    """An error, or a hang, in a function of the panel: `module:Class.method`."""

    place: str
    file: str
    error: str = "RuntimeError"
    dialog: str = ""
    """A dialog that a method of the app opens instead, once."""

    def put(self) -> None:
        """Plant it."""
        module, _, names = self.place.partition(":")
        *owners, name = names.split(".")
        owner: Any = importlib.import_module(module)
        for text in owners:
            owner = getattr(owner, text)
        setattr(owner, name, self._failing(inspect.getattr_static(owner, name)))

    def _failing(self, whole: Any) -> Any:
        if inspect.iscoroutinefunction(whole):

            @functools.wraps(whole)
            async def later(*args: Any, **given: Any) -> Any:
                self._fail(*args)
                return await whole(*args, **given)

            return later

        @functools.wraps(whole)
        def now(*args: Any, **given: Any) -> Any:
            self._fail(*args)
            return whole(*args, **given)

        return now

    def _fail(self, *args: Any) -> None:
        if not Path(self.file).exists():
            return
        if self.dialog:
            from tests.ui.test_dialog_keys import DIALOGS

            Path(self.file).unlink()
            app = args[0]
            app.push_screen(DIALOGS[self.dialog](app, app.chosen))
        else:
            ERRORS[self.error]()


def planted(*plants: Plant) -> str:
    """The plants as an argument."""
    return json.dumps([asdict(plant) for plant in plants])


def main() -> None:
    """Plant the errors, and open the panel."""
    _, plants, *arguments = sys.argv
    for load in json.loads(plants):
        Plant(**load).put()
    sys.argv[1:] = arguments
    from tui.__main__ import main as panel

    panel()


if __name__ == "__main__":
    main()
