"""Control source of a drive: its configuration, and taking and returning control. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .orders import chart_in_force, order_target
from .profile.profile import Profile, is_verified
from .profile.schema import ControlSource, OrderId, Parameter


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


@dataclass(frozen=True, slots=True)
class ControlTaking:
    """Commands to take and give back control that a drive has, and its present controller."""

    can_take: bool
    can_give_back: bool
    taken: bool | None
    """True if Modbus has control; None if no word shows it."""
    is_given_back: bool = False
    """True if the drive holds the word that gives control back."""


def control_taking(profile: Profile, raws: Mapping[str, int]) -> ControlTaking | None:
    """Return the possibilities to switch control; None if the drive has neither command."""
    chart = chart_in_force(profile, raws)
    if chart is None:
        return None
    ids: dict[OrderId, bool | None] = {}
    for order in chart.orders:
        if order.id in ("take-control", "hand-back"):
            held = raws.get(order_target(profile, chart, order).code)
            ids[order.id] = None if held is None else held == order.words[-1]
    if not ids:
        return None
    taken, is_given_back = ids.get("take-control"), ids.get("hand-back") is True
    if taken is None and is_given_back:
        taken = False
    return ControlTaking("take-control" in ids, "hand-back" in ids, taken, is_given_back)
