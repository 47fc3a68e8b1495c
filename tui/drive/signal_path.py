"""Live source of a drive's command and reference, and the steps that make it this line. Pure.

The raw values passed in must be current. A value that is missing leaves the path unknown: no
source is ever assumed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from .channel import undecided
from .control_source import SourceChange
from .profile.profile import UNVERIFIED, Profile
from .profile.schema import PathPosition, PathSource, PathSwitch, SignalPath, path_places
from .sentences import all_of

Signal = Literal["command", "reference"]


@dataclass(frozen=True, slots=True)
class PathState:
    """A signal path with its switches as they are."""

    path: SignalPath
    positions: tuple[PathPosition | None, ...]
    """Position of each switch; None if a value that decides it is missing."""
    live: PathSource | None
    """The active source; None if it is not known."""
    enters: int
    """Index of the switch that connects the active source; -1 for the first source."""
    by_line: bool | None
    """True if this line is the active source; None if that is not known."""
    unknown: str
    """Why the active source is not known, as a clause; empty if it is known."""


def source_raw(source: PathSource, raws: Mapping[str, int]) -> int | None:
    """Return the value that selects a source; None for a fixed one or one that was not read."""
    raw = raws.get(source.parameter)
    return None if raw is None else (raw & source.mask) >> source.shift


def source_name(profile: Profile, source: PathSource, raws: Mapping[str, int]) -> str:
    """Return the name of a source; empty if the value that selects it was not read."""
    if source.name:
        return source.name
    raw = source_raw(source, raws)
    if raw is None:
        return ""
    found = source.names.get(str(raw)) or profile.names(profile[source.parameter]).get(raw)
    return found or f"{source.parameter} = {raw}"


def source_word(source: PathSource, raws: Mapping[str, int]) -> str:
    """Return the code of the word with a source's present value; empty if there is none."""
    return source.word or source.words.get(str(source_raw(source, raws)), "")


def path_codes(profile: Profile) -> list[str]:
    """Return the codes of all words on which the signal paths depend, and of their values."""
    return list(dict.fromkeys(code for _, code in path_places(profile.data.signal_paths) if code))


def path_state(profile: Profile, carries: Signal, raws: Mapping[str, int]) -> PathState | None:
    """Return the path of a signal that applies; None if the profile has none for it.

    If a value that selects the path is missing, or none applies, it is the first path, unknown.
    """
    paths = [path for path in profile.data.signal_paths if path.carries == carries]
    if not paths:
        return None
    for path in paths:
        unread = undecided(path.when, raws)
        if unread:
            return _unknown(paths[0], f"{unread} was not read")
        if unread is None:
            return _followed(path, raws)
    return _unknown(paths[0], "the profile does not describe this setting")


def _unknown(path: SignalPath, why: str) -> PathState:
    return PathState(path, (None,) * len(path.switches), None, -1, None, why)


def _followed(path: SignalPath, raws: Mapping[str, int]) -> PathState:
    """Follow a path from the motor back to its source."""
    found = [_position(switch, raws) for switch in path.switches]
    positions = tuple(position for position, _ in found)
    for index in reversed(range(len(path.switches))):
        position, why = found[index]
        if position is None:
            return PathState(path, positions, None, -1, None, why)
        if position.contact:
            live, enters = path.switches[index].other, index
            break
    else:
        live, enters = path.first, -1
    by_line, why = _checked(path, live, raws)
    known = live if by_line is not None else None
    return PathState(path, positions, known, enters, by_line, why)


def _position(switch: PathSwitch, raws: Mapping[str, int]) -> tuple[PathPosition | None, str]:
    """Return the position of a switch; None and the reason if it is not known."""
    for position in switch.positions:
        unread = undecided(position.when, raws)
        if unread:
            return None, f"{unread} was not read"
        if unread is None:
            return position, ""
    return None, f"the position of {switch.name} is not known"


def _checked(
    path: SignalPath, live: PathSource, raws: Mapping[str, int]
) -> tuple[bool | None, str]:
    """Return whether a source is this line; None and the reason if the drive reports otherwise."""
    by_line = live.is_line
    if not live.name:
        raw = source_raw(live, raws)
        if raw is None:
            return None, f"{live.parameter} was not read"
        by_line = raw in live.line
    if path.reports is not None:
        reported = path.reports.holds(raws)
        if reported is None:
            return None, f"{path.reports.parameter} was not read"
        if reported is not by_line:
            return None, f"{path.reports.parameter} reports another source"
    return by_line, ""


def is_certain(state: PathState) -> bool:
    """Return True if an available document of the family describes the path."""
    return state.path.confidence not in UNVERIFIED


@dataclass(frozen=True, slots=True)
class LineStep:
    """One step that makes this line a source, in the imperative."""

    text: str
    change: SourceChange | None = None
    """Parameter to set; None if the step moves an input or presses a key."""


@dataclass(frozen=True, slots=True)
class LineWay:
    """Steps that make this line the source of a signal."""

    steps: tuple[LineStep, ...]
    """In their order."""

    @property
    def text(self) -> str:
        """All steps as one clause."""
        return all_of([step.text for step in self.steps])


def ways_to_line(profile: Profile, state: PathState, raws: Mapping[str, int]) -> list[LineWay]:
    """Return the ways to make this line the active source, those of fewest steps first.

    Empty if it is the source already, or if the state of the path is not known.
    """
    if state.live is None or state.by_line:
        return []
    path = state.path
    ends = [(-1, path.first), *((n, switch.other) for n, switch in enumerate(path.switches))]
    found = [_way(profile, state, end, raws) for end in ends]
    return sorted((way for way in found if way is not None), key=lambda way: len(way.steps))


def _way(
    profile: Profile, state: PathState, end: tuple[int, PathSource], raws: Mapping[str, int]
) -> LineWay | None:
    """Return the steps that make this line the source at one end; None if it cannot be there."""
    enters, source = end
    steps: list[LineStep] = []
    if not source.is_line:
        if not source.line:
            return None
        if source_raw(source, raws) not in source.line:
            if profile[source.parameter].access == "r":
                return None
            steps.append(_selected(profile, source, raws))
    for index, switch in enumerate(state.path.switches):
        wanted, now = int(index == enters), state.positions[index]
        if index < enters or (now is not None and now.contact == wanted):
            continue
        step = None if now is None else _turned(profile, switch, now, wanted, raws)
        if step is None:
            return None
        steps.append(step)
    return LineWay(tuple(steps)) if steps else None


def _turned(
    profile: Profile,
    switch: PathSwitch,
    now: PathPosition,
    contact: int,
    raws: Mapping[str, int],
) -> LineStep | None:
    """Return the step that brings a switch to a contact; None if none is known.

    A switch that an input or a key moves is moved by it; any other by its parameter.
    """
    positions = [position for position in switch.positions if position.contact == contact]
    if now.how and (found := next((at.how for at in positions if at.how), "")):
        return LineStep(found)
    for when in (at.when[0] for at in positions if len(at.when) == 1):
        if when.mask is None and when.parameter == switch.parameter:
            raw = when.values[0]
            return _set(profile, switch.parameter, raw, raw, raws)
    return None


def _selected(profile: Profile, source: PathSource, raws: Mapping[str, int]) -> LineStep:
    """Return the step that selects this line at a source; other bits of its word stay."""
    value = source.line[0]
    raw = raws.get(source.parameter, 0) & ~source.mask & 0xFFFF | value << source.shift
    return _set(profile, source.parameter, value, raw, raws)


def _set(profile: Profile, code: str, value: int, raw: int, raws: Mapping[str, int]) -> LineStep:
    name = profile.names(profile[code]).get(value, str(value))
    change = SourceChange(profile[code], raws.get(code), raw)
    return LineStep(f"set {code} to {name}", change)
