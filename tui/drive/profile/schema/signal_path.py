"""Switches between the sources of command or reference and the motor."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Annotated, Literal

from msgspec import Meta

from .base import Confidence, Identifier, Table, When, WordAddress

PathPlace = tuple[str | int, ...]
"""A place in the list of paths."""


class PathSource(Table, frozen=True, kw_only=True):
    """A source of command or reference: a fixed one, or the one that a parameter selects."""

    name: str = ""
    """Name of a fixed source; empty if `parameter` selects the source."""
    parameter: str = ""
    """Parameter whose value selects the source."""
    mask: WordAddress = 0xFFFF
    """Bits that select the source, before the shift."""
    shift: Annotated[int, Meta(ge=0, le=15)] = 0
    line: list[int] = []
    """Values, after mask and shift, that mean this line."""
    is_line: bool = False
    """True if a fixed source is this line."""
    names: dict[str, str] = {}
    """Names of the values; a missing one has its name from the parameter."""
    word: str = ""
    """Word with the present value of a fixed source."""
    words: dict[str, str] = {}
    """Words with the present value, by the selecting value in decimal."""


class PathPosition(Table, frozen=True, kw_only=True):
    """A position of a switch, if its conditions hold; the first one that holds applies."""

    contact: Annotated[int, Meta(ge=0, le=1)]
    """Contact that is connected: 0 is the path so far, 1 is `other`."""
    when: list[When] = []
    """Conditions for the position; all must hold."""
    state: str = ""
    """Shown as the state of the switch; empty: the value of its parameter."""
    how: str = ""
    """Action that brings the switch into the position, in the imperative; empty: its parameter."""


class PathSwitch(Table, frozen=True, kw_only=True):
    """One switch of a signal path."""

    name: str
    parameter: str = ""
    """Parameter that sets the switch; empty if no parameter does."""
    names: dict[str, str] = {}
    """Short names of the parameter's values."""
    other: PathSource
    """Source that the switch connects instead of the path so far."""
    positions: Annotated[list[PathPosition], Meta(min_length=1)]


class SignalPath(Table, frozen=True, kw_only=True):
    """The way of the command or the reference to the motor, if its conditions hold."""

    id: Identifier
    carries: Literal["command", "reference"]
    when: list[When] = []
    """Conditions for the path; all must hold. The first path that applies is used."""
    first: PathSource
    """The source at the beginning of the path."""
    switches: list[PathSwitch] = []
    """Switches from the source to the motor."""
    reports: When | None = None
    """Word of the drive that shows whether this line is the active source."""
    note: str = ""
    source: str
    confidence: Confidence


def path_places(paths: Sequence[SignalPath]) -> Iterator[tuple[PathPlace, str]]:
    """Yield every place in the paths that names a parameter, with its code."""
    for at, path in enumerate(paths):
        yield from _when_places((at, "when"), path.when)
        yield from _source_places((at, "first"), path.first)
        for index, switch in enumerate(path.switches):
            here = (at, "switches", index)
            yield (*here, "parameter"), switch.parameter
            yield from _source_places((*here, "other"), switch.other)
            for place, position in enumerate(switch.positions):
                yield from _when_places((*here, "positions", place, "when"), position.when)
        if path.reports is not None:
            yield (at, "reports"), path.reports.parameter


def _when_places(at: PathPlace, conditions: Sequence[When]) -> Iterator[tuple[PathPlace, str]]:
    for when in conditions:
        yield at, when.parameter


def _source_places(at: PathPlace, source: PathSource) -> Iterator[tuple[PathPlace, str]]:
    yield (*at, "parameter"), source.parameter
    yield (*at, "word"), source.word
    for code in source.words.values():
        yield (*at, "words"), code
