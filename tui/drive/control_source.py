"""Which configuration of command and reference a drive has, and what another would change."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .profile.profile import Profile, is_verified
from .profile.schema import ControlSource, Parameter


@dataclass(frozen=True, slots=True)
class SourceChange:
    """A word that a configuration needs, with what the drive holds in its place."""

    parameter: Parameter
    old: int | None
    new: int

    @property
    def verified(self) -> bool:
        """True if a document in hand confirms the parameter's address."""
        return is_verified(self.parameter)


def source_codes(profile: Profile) -> list[str]:
    """Codes of all words that the configurations of a profile set."""
    codes = [s.parameter for source in profile.data.control_sources for s in source.settings]
    return list(dict.fromkeys(codes))


def source_in_force(profile: Profile, raws: Mapping[str, int]) -> ControlSource | None:
    """The configuration whose every word the drive holds; the one that says most, if several."""
    fitting = [
        source
        for source in profile.data.control_sources
        if all(raws.get(setting.parameter) == setting.value for setting in source.settings)
    ]
    return max(fitting, key=lambda source: len(source.settings), default=None)


def source_changes(
    profile: Profile, source: ControlSource, raws: Mapping[str, int]
) -> list[SourceChange]:
    """The words that differ from what a configuration needs, in the order of writing."""
    return [
        SourceChange(profile[setting.parameter], raws.get(setting.parameter), setting.value)
        for setting in source.settings
        if raws.get(setting.parameter) != setting.value
    ]
