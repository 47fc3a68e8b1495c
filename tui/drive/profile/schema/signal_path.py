"""Switches between the sources of command or reference and the motor."""

from collections.abc import Iterator, Sequence
from typing import Annotated, Literal

from msgspec import Meta

from .base import Confidence, Identifier, Table, When, WordAddress, about

PathPlace = tuple[str | int, ...]
"""A place in the list of paths."""


class PathSource(Table, frozen=True, kw_only=True):
    """A source of command or reference: a fixed one, or the one that a parameter selects."""

    name: Annotated[
        str, about("Name of a fixed source; empty if `parameter` selects the source.")
    ] = ""
    parameter: Annotated[str, about("Parameter whose value selects the source.")] = ""
    mask: Annotated[WordAddress, about("Bits that select the source, before the shift.")] = 0xFFFF
    shift: Annotated[int, Meta(ge=0, le=15)] = 0
    line: Annotated[list[int], about("Values, after mask and shift, that mean this line.")] = []
    is_line: Annotated[bool, about("True if a fixed source is this line.")] = False
    names: Annotated[
        dict[str, str],
        about("Names of the values; a missing one has its name from the parameter."),
    ] = {}
    word: Annotated[str, about("Word with the present value of a fixed source.")] = ""
    words: Annotated[
        dict[str, str],
        about("Words with the present value, by the selecting value in decimal."),
    ] = {}


class PathPosition(Table, frozen=True, kw_only=True):
    """A position of a switch, if its conditions hold; the first one that holds applies."""

    contact: Annotated[
        int,
        Meta(ge=0, le=1),
        about("Contact that is connected: 0 is the path so far, 1 is `other`."),
    ]
    when: Annotated[list[When], about("Conditions for the position; all must hold.")] = []
    state: Annotated[
        str,
        about("Shown as the state of the switch; empty: the value of its parameter."),
    ] = ""
    how: Annotated[
        str,
        about(
            "Action that brings the switch into the position, in the imperative; "
            "empty: its parameter."
        ),
    ] = ""


class PathSwitch(Table, frozen=True, kw_only=True):
    """One switch of a signal path."""

    name: Annotated[str, about("Name of the switch, as short as its code.")]
    parameter: Annotated[
        str, about("Parameter that sets the switch; empty if no parameter does.")
    ] = ""
    names: Annotated[dict[str, str], about("Short names of the parameter's values.")] = {}
    other: Annotated[
        PathSource, about("Source that the switch connects instead of the path so far.")
    ]
    positions: Annotated[
        list[PathPosition],
        Meta(min_length=1),
        about("Positions of the switch; the first one whose conditions hold applies."),
    ]


class SignalPath(Table, frozen=True, kw_only=True):
    """The way of the command or the reference to the motor, if its conditions hold."""

    id: Identifier
    carries: Annotated[Literal["command", "reference"], about("Signal on the path.")]
    when: Annotated[
        list[When],
        about("Conditions for the path; all must hold. The first path that applies is used."),
    ] = []
    first: Annotated[PathSource, about("The source at the beginning of the path.")]
    switches: Annotated[list[PathSwitch], about("Switches from the source to the motor.")] = []
    reports: Annotated[
        When | None,
        about("Word of the drive that shows whether this line is the active source."),
    ] = None
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
