"""Signal paths of one drive from values that are current, for the Control screen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from tui.drive.channel import channel_codes
from tui.drive.control_source import source_codes
from tui.drive.profile.schema import PathSource
from tui.drive.sentences import any_of
from tui.drive.shown import shown
from tui.drive.signal_path import (
    LineStep,
    LineWay,
    PathState,
    Signal,
    path_codes,
    path_state,
    source_name,
    source_word,
    ways_to_line,
)
from tui.drive.values import set_bits
from tui.safety import LOOK_IS_OLD

from .drive import DriveSession

CARRIED: tuple[Signal, ...] = ("reference", "command")


@dataclass(frozen=True, slots=True)
class PathSourceText:
    """A source as text."""

    label: str
    """Parameter that selects the source, or its fixed name."""
    name: str
    """Selected source; `-----` if it was not read, empty for a fixed source."""
    value: str
    """Present value of the source; empty if it has none, or no current one."""


@dataclass(slots=True)
class ControlPaths:
    """Texts of the signal paths; values older than 10 s count as not read."""

    session: DriveSession

    @property
    def codes(self) -> list[str]:
        """All codes that the screen needs."""
        profile = self.session.profile
        return list(
            dict.fromkeys((*source_codes(profile), *channel_codes(profile), *path_codes(profile)))
        )

    @property
    def raws(self) -> Mapping[str, int]:
        """Raw values that are current."""
        return self.session.image.fresh(LOOK_IS_OLD)

    def state(self, carries: Signal) -> PathState | None:
        """Return the path of a signal; None if the profile has none for it."""
        return path_state(self.session.profile, carries, self.raws)

    def source_text(self, source: PathSource) -> PathSourceText:
        """Return a source with its name and its present value."""
        profile, raws = self.session.profile, self.raws
        value = self.text(source_word(source, raws))
        if source.name:
            return PathSourceText(source.name, "", value)
        return PathSourceText(
            source.parameter, source_name(profile, source, raws) or "-----", value
        )

    def switch_state(self, state: PathState, index: int) -> str:
        """Return the state of a switch; `-----` if its value was not read."""
        switch, position = state.path.switches[index], state.positions[index]
        if position is not None and position.state:
            return position.state
        if not switch.parameter:
            return ""
        raw = self.raws.get(switch.parameter)
        if raw is None:
            return "-----"
        return switch.names.get(str(raw)) or self.text(switch.parameter)

    def text(self, code: str) -> str:
        """Return a current value as text; a bit word as its number, inputs by their names."""
        profile, raws = self.session.profile, self.raws
        raw = raws.get(code) if code else None
        if raw is None:
            return ""
        parameter = profile[code]
        inputs = profile.data.faults.inputs
        if inputs is not None and inputs.parameter == code:
            return (
                " ".join(b.name for b in set_bits(parameter.bits, raw & inputs.mask)) or "none on"
            )
        return shown(profile, parameter, raw, raws, self.session.image.lacking).display

    def way_text(self, state: PathState) -> str:
        """Return what to do so that this line is the source, as a clause in the imperative.

        Of several ways, those of the fewest steps; empty if it is the source, or none is known.
        """
        best = [way.text for way in self._best_ways(state)]
        return any_of(best) if best else ""

    @property
    def steps(self) -> tuple[LineStep, ...]:
        """The steps of both signals that set a parameter, each once."""
        states = [state for carries in CARRIED if (state := self.state(carries)) is not None]
        steps = (step for s in states for way in self._best_ways(s) for step in way.steps)
        found = {(c.parameter.code, c.new): step for step in steps if (c := step.change)}
        return tuple(found.values())

    def _best_ways(self, state: PathState) -> list[LineWay]:
        ways = ways_to_line(self.session.profile, state, self.raws)
        return [way for way in ways if len(way.steps) == len(ways[0].steps)]
