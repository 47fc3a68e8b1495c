"""Selection of the parameters that a list shows: search, filters, groups. Pure functions."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from typing import Literal

from ..profile.profile import Profile, is_verified
from ..profile.schema import Parameter, Quantity
from ..profile.search import parameter_search
from .edits import Edits
from .factory import not_factory
from .writable import is_setting

FilterId = Literal[
    "all",
    "start-up",
    "settings",
    "staged",
    "not factory",
    "differs",
    "unsaved",
    "read-only",
    "unverified",
    "favorites",
    "recent",
]
FILTERS: tuple[FilterId, ...] = (
    "all",
    "start-up",
    "settings",
    "staged",
    "not factory",
    "differs",
    "unsaved",
    "favorites",
    "recent",
    "read-only",
    "unverified",
)


HOME_QUANTITIES: tuple[Quantity, ...] = ("acceleration", "high_speed", "line_address")
"""Quantities in common use; the list opens with the group of the first one that exists."""


@dataclass(frozen=True, slots=True)
class Choice:
    """Contents of a list: all parameters that pass a filter, or one group of the profile."""

    filter: FilterId = "all"
    group: str = ""


@dataclass(frozen=True, slots=True)
class FilterContext:
    """Facts that the filters use."""

    profile: Profile
    raws: Mapping[str, int] = field(default_factory=dict)
    edits: Edits = field(default_factory=Edits)
    unsaved: Collection[str] = ()
    favorites: Collection[str] = ()
    recent: tuple[str, ...] = ()
    other: Mapping[str, int] = field(default_factory=dict)
    """Raw values of the parameter set to compare the drive with."""
    absent: Collection[str] = ()
    """Codes that the drive does not have."""


def group_order(profile: Profile) -> list[str]:
    """Return the profile's groups; those with settings come before read-only ones."""
    settings = {p.group for p in profile.parameters if is_setting(profile, p)}
    return sorted(profile.groups, key=lambda group: group not in settings)


def start_up_codes(profile: Profile) -> list[str]:
    """Return the parameters of a first commissioning, in the order of its steps."""
    return [code for step in profile.data.start_up for code in step.parameters]


def home_group(profile: Profile) -> str:
    """Return the group to open first: usually the keypad's menu of settings."""
    found = (profile.quantity(quantity) for quantity in HOME_QUANTITIES)
    return next((p.group for p in found if p is not None), group_order(profile)[0])


def chosen_codes(facts: FilterContext, choice: Choice) -> list[str]:
    """Return the codes that a choice shows."""
    if choice.group:
        return [p.code for p in facts.profile.parameters if p.group == choice.group]
    return rows(facts, choice.filter)


def rows(facts: FilterContext, chosen: FilterId, search: str = "") -> list[str]:
    """Return the codes to show: best matches first, settings before others, in profile order.

    Recent ones begin with the last edited; a start-up keeps the order of its steps.
    """
    profile = facts.profile
    parameters = list(profile.parameters)
    if chosen == "recent":
        parameters = [p for code in facts.recent if (p := profile.get(code)) is not None]
    if chosen == "start-up":
        parameters = [profile[code] for code in start_up_codes(profile)]
    passing = [p for p in parameters if passes(facts, chosen, p)]
    if not search.split():
        return [p.code for p in passing]
    scores = parameter_search(profile).scores(search)
    found = [
        (scores[p.code], not is_setting(profile, p), p.code) for p in passing if p.code in scores
    ]
    return [code for *_, code in sorted(found, key=lambda row: row[:2])]


def passes(facts: FilterContext, chosen: FilterId, parameter: Parameter) -> bool:
    """Return True if a parameter belongs to a filter."""
    code, profile = parameter.code, facts.profile
    raw = facts.raws.get(code)
    match chosen:
        case "settings":
            return is_setting(profile, parameter)
        case "staged":
            return code in facts.edits
        case "not factory":
            return not_factory(profile, parameter, facts.raws, facts.absent)
        case "differs":
            other = facts.other.get(code)
            return is_setting(profile, parameter) and other is not None and other != raw
        case "unsaved":
            return code in facts.unsaved
        case "read-only":
            return parameter.access == "r"
        case "unverified":
            return not is_verified(parameter)
        case "favorites":
            return code in facts.favorites
        case _:
            return True
