"""Family profile with the learned scales and the taught reference of one drive."""

from __future__ import annotations

from collections.abc import Mapping

from msgspec.structs import replace

from .profile.profile import Profile, is_verified
from .profile.schema import Chart, Parameter, Quantity, TeachableReference
from .teaching import TaughtScale
from .values import is_enumeration
from .words import is_word

REFERENCE_UNITS: Mapping[str, Quantity] = {"Hz": "command_frequency", "rpm": "command_speed"}
"""Units in which a reference can be given, and the quantity of its word."""
RUNS = frozenset({"forward", "reverse"})


def why_not_taught(family: Profile, code: str) -> str:
    """Return why a parameter's scale cannot be taught; empty if it can."""
    parameter = family[code]
    if parameter.access == "w" or parameter.bits or not is_word(parameter):
        return f"{code} has no scale that can be learned: it is not a number of one word."
    if family.names(parameter) and is_enumeration(parameter):
        return f"{code} has no scale that can be learned: its values have names."
    if not is_raw(family, parameter):
        return f"The scale of {code} is already known from the profile of {family.name}."
    return ""


def is_raw(family: Profile, parameter: Parameter) -> bool:
    """Return True if a parameter is shown raw because no document states its scale.

    A document may describe it without a scale, as a block diagram does.
    """
    measured = parameter.access == "r" and parameter.quantity is None
    measured = measured and (parameter.min, parameter.max, parameter.factory) == (None, None, None)
    reported = bool(
        parameter.unit or parameter.scale_source or parameter.unit_by or parameter.values
    )
    reported = reported or bool(parameter.enumeration or parameter.bits) or parameter.scale != "1"
    reported = reported or parameter.offset != "0"
    counters = family.data.port_counters
    reported = reported or any(parameter.code in (c.frames, c.checksum_errors) for c in counters)
    return not reported and (measured or not is_verified(parameter)) and is_word(parameter)


def teachable_codes(family: Profile) -> list[str]:
    """Return the codes of all parameters whose scale can be taught, in the profile's order."""
    return [p.code for p in family.parameters if is_raw(family, p) and p.access != "w"]


def reference_of(family: Profile, code: str) -> TeachableReference | None:
    """Return the facts on a parameter that can become the reference once taught, or None."""
    found = family.data.teachable_references
    return next((reference for reference in found if reference.parameter == code), None)


def why_no_reference(family: Profile, code: str, taught: Mapping[str, TaughtScale]) -> str:
    """Return why a parameter cannot take the reference; empty if it can after confirmation."""
    if reference_of(family, code) is None:
        known = ", ".join(reference.parameter for reference in family.data.teachable_references)
        if known:
            return f"{code} cannot take the reference. Use {known}."
        return f"{code} cannot take the reference. {family.name} has no such parameter."
    if (scale := taught.get(code)) is None:
        return f"The scale of {code} was not learned yet. Teach it first."
    if scale.unit not in REFERENCE_UNITS:
        unit = scale.unit or "no unit"
        return f"{code} was learned in {unit}, but a reference needs Hz or rpm."
    return ""


def with_taught(family: Profile, taught: Mapping[str, TaughtScale], reference: str = "") -> Profile:
    """Return the profile of one drive; `reference` is the parameter confirmed for its reference."""
    known = {
        code: scale
        for code, scale in taught.items()
        if family.get(code) is not None and not why_not_taught(family, code)
    }
    if not known:
        return family
    if reference and why_no_reference(family, reference, known):
        reference = ""
    parameters = [
        _taught(parameter, known[parameter.code], parameter.code == reference)
        if parameter.code in known
        else parameter
        for parameter in family.parameters
    ]
    charts = family.data.charts
    way = reference_of(family, reference) if reference else None
    if way is not None and way.bits:
        charts = [_choosing(chart, way.bits) for chart in charts]
    data = replace(family.data, parameters=parameters, charts=charts)
    return Profile(data, family.read_help, taught=known)


def _taught(parameter: Parameter, scale: TaughtScale, reference: bool) -> Parameter:
    """Return the parameter with its scale and unit; the editor still does not write it."""
    quantity = REFERENCE_UNITS[scale.unit] if reference else parameter.quantity
    return replace(parameter, unit=scale.unit, scale=f"{scale.scale:f}", quantity=quantity)


def _choosing(chart: Chart, bits: int) -> Chart:
    """Return the chart with these bits set in its run commands; stops are unchanged."""
    orders = [
        replace(order, words=[word | bits if word else word for word in order.words])
        if order.id in RUNS and order.parameter in ("", chart.command)
        else order
        for order in chart.orders
    ]
    return replace(chart, orders=orders)
