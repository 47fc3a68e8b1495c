"""Follows one value through the program: modules that pass it on, types that carry it.

A module passes the value on if it gets it from one module and another one gets it from there. A
function that takes the value and returns it to its caller is a helper of that caller, no hop.
Only what cannot change carries a value: bytes, a frozen record, a line of text. A monitor or an
image has values for long, and passes them on only as one of those.
"""

from __future__ import annotations

import itertools
import sys
from collections import deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import msgspec
from rich.text import Text

from .sources import PACKAGE

DEEPEST = 6
"""Records inside records that are searched for the value."""
LONGEST = 400
"""Members of a record or container that are searched."""
OUTSIDE = ""
"""Other code, such as asyncio."""


@dataclass
class Trail:
    """Records where a value passes, in the threads that it watches."""

    raw: int
    shown: str
    """The value as text, such as 231.7."""
    edges: dict[tuple[str, str], str] = field(default_factory=dict)
    """Type of the carrier, by the module that had the value and the one that got it."""
    _given: dict[int, str] = field(default_factory=dict)

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Watch all calls of this thread."""
        sys.setprofile(self._event)
        try:
            yield
        finally:
            sys.setprofile(None)

    def _event(self, frame: FrameType, event: str, result: Any) -> None:
        if event not in ("call", "return"):
            return
        code = frame.f_code
        module = module_of(code.co_filename)
        if module == OUTSIDE:
            return
        if event == "call":
            names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
            carrier = self.carrier([frame.f_locals.get(name) for name in names if name != "self"])
            if carrier:
                self._given[id(frame)] = carrier
            return
        given, carrier = self._given.pop(id(frame), ""), self.carrier([result])
        caller = module_of(frame.f_back.f_code.co_filename) if frame.f_back else OUTSIDE
        if bool(given) is bool(carrier) or module == caller:
            return
        edge = (caller, module) if given else (module, caller)
        self.edges.setdefault(edge, given or carrier)

    def carrier(self, values: list[Any]) -> str:
        """The outermost type that holds the value; empty if none does."""
        return next((found for value in values if (found := self._holder(value, DEEPEST))), "")

    def _holder(self, value: Any, deep: int) -> str:
        match value:
            case bool() | None | float():
                return ""
            case int():
                return "int" if value == self.raw else ""
            case bytes() | bytearray():
                return "bytes" if self.raw.to_bytes(2, "big") in value else ""
            case str():
                return "str" if self.shown in value else ""
            case Text():
                return "Text" if self.shown in value.plain else ""
        if not deep:
            return ""
        inner = next((h for part in members(value) if (h := self._holder(part, deep - 1))), "")
        plain = isinstance(value, list | Mapping) or type(value) is tuple
        return inner if not inner or plain else type(value).__name__

    def way(self, first: str, last: str) -> list[str]:
        """The shortest way from one module to another; empty if there is none."""
        before: dict[str, str] = {first: ""}
        waiting = deque([first])
        while waiting:
            here = waiting.popleft()
            if here == last:
                found = [here]
                while before[found[0]]:
                    found.insert(0, before[found[0]])
                return found
            for giver, taker in list(self.edges):  # other threads may be watched
                if giver == here and taker not in before:
                    before[taker] = here
                    waiting.append(taker)
        return []

    def carriers(self, way: list[str]) -> list[str]:
        """The types that carry the value along a way, each once."""
        return list(dict.fromkeys(self.edges[pair] for pair in itertools.pairwise(way)))


def members(value: Any) -> Iterator[Any]:
    """Content of a container or a record; nothing that runs independently, such as a monitor."""
    kind = type(value)
    if isinstance(value, Mapping):
        yield from list(value.values())[:LONGEST]
    elif isinstance(value, tuple | list):
        yield from value[:LONGEST]
    elif isinstance(value, msgspec.Struct):
        yield from (getattr(value, name) for name in kind.__struct_fields__)
    elif is_dataclass(value) and not isinstance(value, type):
        yield from (getattr(value, part.name, None) for part in fields(value))


def module_of(filename: str) -> str:
    """A module of the panel by its path below `tui`; simulated drives count as outside."""
    path = Path(filename)
    if PACKAGE not in path.parents:
        return OUTSIDE
    name = path.relative_to(PACKAGE).with_suffix("").as_posix()
    return OUTSIDE if name.startswith("simulator/") else name
