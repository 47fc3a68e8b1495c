"""Weighing of the causes of a fault or an alarm by the drive's values; pure functions.

The rules are data of the help files. Only values that are current, or belong to the trip, decide.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from typing import Literal

from .profile.profile import Profile, is_verified, mark_of
from .profile.schema import CauseRule, Hint, Multiple, Parameter
from .shown import shown
from .values import Value

Basis = Literal["trip", "now", "setting"]
"""Time of a value that decided: at the trip, now, or a setting or rating, which does not change."""
Verdict = Literal["supported", "open", "excluded"]
COMPARED_WITHOUT_SIGN = frozenset({"output_frequency", "frequency_reference"})
"""Quantities whose sign is the direction of the motor."""
RATINGS = frozenset({"drive_current"})
"""Quantities that are read and have a unit, but never change."""


@dataclass(frozen=True, slots=True)
class KnownValues:
    """Raw values by code that may decide about causes; no old and no failed value is among them."""

    now: Mapping[str, int] = field(default_factory=dict)
    trip: Mapping[str, int] = field(default_factory=dict)
    """Values at the trip, by the code of the live parameter."""
    before: Mapping[str, int] = field(default_factory=dict)
    """Last values read before the trip, for what is not in `trip`."""
    changed: frozenset[str] = frozenset()
    """Settings that were written after the trip: they decide nothing about it."""


@dataclass(frozen=True, slots=True)
class Evidence:
    """A value that decided about a cause, as text."""

    code: str
    text: str
    """The value, with its limits: `ULN 228.0 V (170 to 240 V) at the trip`."""
    basis: Basis
    rule: CauseRule

    @property
    def reason(self) -> str:
        """The reason of an exclusion; a present value does not exclude a past cause."""
        return f"not now, {self.text}" if self.basis == "now" else f"ruled out, {self.text}"


@dataclass(frozen=True, slots=True)
class WeighedCause:
    """A probable cause with the values for or against it."""

    text: str
    verdict: Verdict
    weight: int = 0
    """Sum of the weights of the rules that support it."""
    evidence: tuple[Evidence, ...] = ()
    """Against an excluded cause, else for it; the strongest first."""
    unknown: tuple[str, ...] = ()
    """Codes of values that would decide, but are old, failed or not read."""


def weigh(profile: Profile, hint: Hint, known: KnownValues) -> tuple[WeighedCause, ...]:
    """Return the causes of a fault, the likeliest first, those that a value excludes last.

    Supported causes come before others, by weight; equal ones keep the order of the help.
    """
    causes = [_weighed(profile, hint, text, known) for text in hint.probable]
    return tuple(sorted(causes, key=lambda cause: (cause.verdict == "excluded", -cause.weight)))


def exclusion(profile: Profile, hint: Hint, text: str, known: KnownValues) -> Evidence | None:
    """Return the value that rules out a cause or a check; None if no value does.

    A parameter that no document confirms rules out nothing.
    """
    rules = [rule for rule in hint.ruled_out if rule.text == text and _is_sure(profile, rule)]
    return next(iter(_found(profile, rules, known)), None)


def values_at_trip(
    profile: Profile, raws: Mapping[str, int], place: int | None, *, present: bool
) -> dict[str, int]:
    """Return what the drive itself keeps of a trip, by the code of the live parameter.

    `place` is that of the fault in the drive's history, 0 for the last one, None if it is in no
    place. `present` is True while the drive is in the fault. A stored value has its own code, too.
    """
    faults = profile.data.faults
    found: dict[str, int] = {}
    if place is not None and place < len(faults.stored):
        for number, code in enumerate(faults.stored[place]):
            if code not in raws:
                continue
            live = faults.stored_from[number] if number < len(faults.stored_from) else ""
            found |= {key: raws[code] for key in (code, live) if key}
    if present:
        found |= {code: raws[code] for code in faults.held if code in raws}
    return found


def values_now(profile: Profile, raws: Mapping[str, int]) -> dict[str, int]:
    """Return the values that are not stored ones, of any fault."""
    stored = {code for codes in profile.data.faults.stored for code in codes}
    return {code: raw for code, raw in raws.items() if code not in stored}


def stored_codes(profile: Profile, codes: Sequence[str]) -> list[str]:
    """Return the codes of the values that the drive stored from live parameters at the last trip.

    A code that is not stored is omitted.
    """
    faults = profile.data.faults
    pairs = zip(faults.stored_from, faults.stored[0] if faults.stored else (), strict=False)
    stored = {live: code for live, code in pairs if live}
    return [stored[code] for code in codes if code in stored]


def is_measured(profile: Profile, parameter: Parameter) -> bool:
    """True if a value changes without a write, so that the present one is not that of the trip."""
    if parameter.access != "r" or parameter.quantity in RATINGS:
        return False
    named = bool(profile.names(parameter)) and not parameter.bits
    watched = {value.parameter for value in profile.data.monitoring.values}
    return not named or parameter.code in watched


def _weighed(profile: Profile, hint: Hint, text: str, known: KnownValues) -> WeighedCause:
    against = exclusion(profile, hint, text, known)
    if against is not None:
        return WeighedCause(text, "excluded", 0, (against,))
    rules = [rule for rule in hint.supported if rule.text == text]
    backing = sorted(_found(profile, rules, known), key=lambda found: -found.rule.weight)
    weight = sum(found.rule.weight for found in backing)
    if backing:
        return WeighedCause(text, "supported", weight, tuple(backing))
    rules += [rule for rule in hint.ruled_out if rule.text == text]
    unknown = [code for rule in rules for code in rule.codes if not _is_known(rule, code, known)]
    return WeighedCause(text, "open", 0, (), tuple(dict.fromkeys(unknown)))


def _is_sure(profile: Profile, rule: CauseRule) -> bool:
    parameters = (profile.get(code) for code in rule.codes)
    return all(parameter is not None and is_verified(parameter) for parameter in parameters)


def _is_known(rule: CauseRule, code: str, known: KnownValues) -> bool:
    if code in known.changed:
        return False
    if code != rule.parameter:
        return code in known.trip or code in known.before or code in known.now
    return _at(rule, known) is not None


def _at(rule: CauseRule, known: KnownValues) -> tuple[int, str] | None:
    """Return the raw value that decides, and its time as text if that is the trip."""
    code = rule.parameter
    if rule.at != "now" and code in known.trip:
        return known.trip[code], "at the trip"
    if rule.at != "now" and code in known.before:
        return known.before[code], "before the trip"
    if rule.at != "trip" and code in known.now:
        return known.now[code], ""
    return None


def _found(profile: Profile, rules: Sequence[CauseRule], known: KnownValues) -> list[Evidence]:
    found = (_evidence(profile, rule, known) for rule in rules)
    return [evidence for evidence in found if evidence is not None]


def _evidence(profile: Profile, rule: CauseRule, known: KnownValues) -> Evidence | None:
    """Return the value for which a rule holds; None if it does not hold or is not known to."""
    parameter = profile.get(rule.parameter)
    if parameter is None or known.changed.intersection(rule.codes):
        return None
    raws = {**known.now, **known.before, **known.trip}
    found = _at(rule, known)
    if found is None or not rule.has_condition or not all(when.holds(raws) for when in rule.when):
        return None
    raw, when = found
    value = shown(profile, parameter, raw, raws)
    if not (_raw_fits(rule, raw) and _value_fits(profile, rule, parameter, value, raws)):
        return None
    measured = is_measured(profile, parameter)
    basis: Basis = "trip" if when else "now" if measured else "setting"
    text = _text(profile, rule, parameter, value, raws)
    if when and measured:
        text = f"{text} {when}"
    return Evidence(rule.parameter, text, basis, rule)


def _raw_fits(rule: CauseRule, raw: int) -> bool:
    ranged = rule.min is not None and rule.max is not None
    if not rule.values and not ranged:
        return True
    masked = raw if rule.mask is None else raw & rule.mask
    within = rule.min is not None and rule.max is not None and rule.min <= raw <= rule.max
    return masked in rule.values or within


def _value_fits(
    profile: Profile, rule: CauseRule, parameter: Parameter, value: Value, raws: Mapping[str, int]
) -> bool:
    """True if the value is within the limits in its unit; an unknown limit or unit is not."""
    if (rule.at_least, rule.at_most, *rule.of) == (None,) * 4:
        return True
    if value.number is None or value.unsure or value.unit != parameter.unit:
        return False
    number = abs(value.number) if parameter.quantity in COMPARED_WITHOUT_SIGN else value.number
    if rule.at_least is not None and number < Decimal(rule.at_least):
        return False
    if rule.at_most is not None and number > Decimal(rule.at_most):
        return False
    low, high = rule.of
    if low is not None:
        limit = _limit(profile, low, value.unit, raws)
        if limit is None or number < limit:
            return False
    if high is not None:
        limit = _limit(profile, high, value.unit, raws)
        return limit is not None and number <= limit
    return True


def _limit(profile: Profile, of: Multiple, unit: str, raws: Mapping[str, int]) -> Decimal | None:
    """Return a limit that follows another parameter; None if that is 0 or not in this unit."""
    value = _other(profile, of, raws)
    if value is None or not value.number or value.unit != unit:
        return None
    return value.number * Decimal(of.times) + Decimal(of.plus)


def _other(profile: Profile, of: Multiple, raws: Mapping[str, int]) -> Value | None:
    parameter, raw = profile.get(of.parameter), raws.get(of.parameter)
    return shown(profile, parameter, raw, raws) if parameter and raw is not None else None


def _text(
    profile: Profile,
    rule: CauseRule,
    parameter: Parameter,
    value: Value,
    raws: Mapping[str, int],
) -> str:
    """Return the value with the limits it was compared with."""
    mask = 0 if rule.mask is None else rule.mask
    bits = [bit for bit in parameter.bits if mask >> bit.bit & 1]
    held = value.display
    if bits:
        held = ", ".join(f"{b.name}: {(b.off, b.on)[value.raw >> b.bit & 1]}" for b in bits)
    text = f"{parameter.code}{mark_of(profile, parameter)} {held}"
    limits = ", ".join(_limit_texts(profile, rule, parameter.unit, raws))
    return f"{text} ({limits})" if limits else text


def _limit_texts(
    profile: Profile, rule: CauseRule, unit: str, raws: Mapping[str, int]
) -> list[str]:
    low, high = rule.at_least, rule.at_most
    texts = []
    if low is not None and high is not None:
        texts.append(f"{low} to {high} {unit}".rstrip())
    elif low is not None or high is not None:
        texts.append(f"{'from' if high is None else 'up to'} {low or high} {unit}".rstrip())
    for of in rule.of:
        value = _other(profile, of, raws) if of is not None else None
        if of is None or value is None:
            continue
        share = "" if Decimal(of.times) == 1 else f"{Decimal(of.times) * 100:g} % of "
        texts.append(f"{share}{of.parameter} {value.display}")
    return texts
