"""Search for the target of a slot: a parameter that it can map, or none."""

from __future__ import annotations

from ..errors import UnknownParameter
from ..profile.profile import Profile, parse_address
from ..profile.schema import Block, Parameter
from ..profile.search import parameter_search
from .assignment import UNUSED, Assignment, MappingError
from .slot_rules import reason_against

NONE = frozenset({"", "-", "--", "none", "off", "0", "w0", "16#0", "0x0"})
"""Words for an unused slot."""


def raw_of(profile: Profile, block: Block, parameter: Parameter) -> int:
    """Return the raw value with which a slot selects a parameter.

    Raises MappingError if the block cannot hold it.
    """
    if wrong := reason_against(profile, block, parameter):
        raise MappingError(wrong)
    if block.selects_by == "address":
        return parameter.address
    return next(c.raw for c in block.choices if c.parameter == parameter.code)


def pick(profile: Profile, today: Assignment, place: int, text: str) -> Assignment:
    """Return an assignment with a slot mapped to a typed code, number, address, or `none`.

    Raises MappingError and UnknownParameter.
    """
    return today.with_raw(place, raw_named(profile, today.block, text))


def raw_named(profile: Profile, block: Block, text: str) -> int:
    """Return a slot's raw value for typed text; raises MappingError and UnknownParameter."""
    wanted = text.strip()
    if wanted.casefold() in NONE:
        return UNUSED
    try:
        parameter = profile.find(wanted)
    except UnknownParameter:
        address = parse_address(wanted)
        if block.selects_by != "address" or address is None:
            raise
        raise MappingError(
            f"No parameter of {profile.name} is known at {wanted}. Type a code, or `none`."
        ) from None
    return raw_of(profile, block, parameter)


def choices(profile: Profile, block: Block | None, search: str = "") -> list[Parameter]:
    """Return the parameters that a slot of the block can select, best matches first.

    Without a block, these are all registers that can be read.

    A search finds codes, numbers, addresses and names; each result contains all words of the
    search.
    """
    if block is not None and block.selects_by == "choice":
        offered = [profile[choice.parameter] for choice in block.choices]
    else:
        offered = sorted(profile.parameters, key=lambda parameter: parameter.address)
    if block is None:
        fitting = [p for p in offered if p.access != "w" and p.is_register]
    else:
        fitting = [p for p in offered if not reason_against(profile, block, p)]
    if not search.split():
        return fitting
    scores = parameter_search(profile).scores(search)
    found = [p for p in fitting if p.code in scores]
    return sorted(found, key=lambda p: scores[p.code])
