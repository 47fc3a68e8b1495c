"""Control source of a drive: its present configuration, and the writes that change it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .profile.profile import Profile, is_verified
from .profile.schema import ControlSource, Parameter


@dataclass(frozen=True, slots=True)
class SourceChange:
    """A word that a configuration requires, with the drive's present value."""

    parameter: Parameter
    old: int | None
    new: int

    @property
    def verified(self) -> bool:
        """True if an available document confirms the parameter's address."""
        return is_verified(self.parameter)


def source_codes(profile: Profile) -> list[str]:
    """Return the codes of all words that the configurations of a profile set."""
    codes = [s.parameter for source in profile.data.control_sources for s in source.settings]
    return list(dict.fromkeys(codes))


def source_in_force(profile: Profile, raws: Mapping[str, int]) -> ControlSource | None:
    """Return the configuration that matches all its words; the one with most words if several."""
    fitting = [
        source
        for source in profile.data.control_sources
        if all(raws.get(setting.parameter) == setting.value for setting in source.settings)
    ]
    return max(fitting, key=lambda source: len(source.settings), default=None)


def source_changes(
    profile: Profile, source: ControlSource, raws: Mapping[str, int]
) -> list[SourceChange]:
    """Return the words that differ from a configuration, in the order of writing."""
    return [
        SourceChange(profile[setting.parameter], raws.get(setting.parameter), setting.value)
        for setting in source.settings
        if raws.get(setting.parameter) != setting.value
    ]
