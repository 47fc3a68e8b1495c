"""Record the functions that an operation calls, and plant errors in them, one at a time."""

from __future__ import annotations

import importlib
import inspect
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, NamedTuple

import pytest

PACKAGE = "tui."
WITNESS = "tui.simulator"


class Place(NamedTuple):
    """A function of the product."""

    module: str
    name: str
    """Its qualified name."""

    def __str__(self) -> str:
        return f"{self.module}:{self.name}"


class Passage:
    """Record each product function called while it is open, in any new thread."""

    def __init__(self, spared: Callable[[], bool] = lambda: False) -> None:
        self.places: set[Place] = set()
        self.open = False
        self._spared = spared

    def note(self, frame: FrameType, event: str, _: object) -> None:
        module = frame.f_globals.get("__name__", "")
        if event != "call" or not self.open or not module.startswith(PACKAGE):
            return
        name = frame.f_code.co_qualname
        if not module.startswith(WITNESS) and "<" not in name and not self._spared():
            self.places.add(Place(module, name))


@contextmanager
def traced(passage: Passage) -> Iterator[None]:
    """Trace this thread and those that start in the meantime."""
    threading.setprofile(passage.note)
    sys.setprofile(passage.note)
    try:
        yield
    finally:
        sys.setprofile(None)
        threading.setprofile(None)


class Planted(RuntimeError):
    """The error that is planted."""


def plant(
    patch: pytest.MonkeyPatch,
    place: Place,
    *,
    once: bool,
    spared: Callable[[], bool] = lambda: False,
) -> bool:
    """Make a function raise, at its first call or at each; False if it cannot be replaced."""
    owner: Any = importlib.import_module(place.module)
    *path, last = place.name.split(".")
    for part in path:
        owner = getattr(owner, part)
    held = inspect.getattr_static(owner, last, None)
    left = [1 if once else 10**9]

    def raises() -> None:
        if not spared() and left[0] > 0:
            left[0] -= 1
            raise Planted(f"planted in {place}")

    if isinstance(held, property):
        made: Any = property(_behind(raises, held.fget), held.fset)
    elif isinstance(held, staticmethod | classmethod):
        made = type(held)(_behind(raises, held.__func__))
    elif inspect.isfunction(held):
        made = _behind(raises, held)
    else:
        return False
    patch.setattr(owner, last, made)
    if not path:
        _everywhere(patch, last, held, made)
    return True


def _behind(raises: Callable[[], None], function: Any) -> Any:
    """Wrap a function so that it raises first."""

    async def later(*given: Any, **named: Any) -> Any:
        raises()
        return await function(*given, **named)

    def now(*given: Any, **named: Any) -> Any:
        raises()
        return function(*given, **named)

    return later if inspect.iscoroutinefunction(function) else now


def _everywhere(patch: pytest.MonkeyPatch, name: str, held: object, made: object) -> None:
    """Replace a function in the modules that have imported it by its name, too."""
    for known, module in list(sys.modules.items()):
        if known.startswith(PACKAGE) and vars(module).get(name) is held:
            patch.setattr(module, name, made)
