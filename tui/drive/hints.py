"""Causes of a fault or an alarm, in words shared by screens, commands and reports."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from tui.drive.sentences import sentence

from .profile.profile import Profile
from .profile.schema import FaultHelp, HelpConfidence, Hint, ResetWay
from .reset_text import MAY_START
from .shown import shown
from .values import set_bits

TRUST: Mapping[HelpConfidence, str] = {
    "manual": "manual",
    "public": "public guide",
    "practice": "general practice",
}
"""Text for the certainty of the first cause."""
RESETS: Mapping[ResetWay | None, str] = {
    "by-reset": "{by} once the cause is removed.",
    "automatic": "{by} once the cause is removed, or the automatic restart if it is on.",
    "by-itself": "The drive leaves the fault once the cause is removed, and may start.",
    "power-cycle": "Switch the drive off and on once the cause is removed; {by} has no effect.",
    None: "{by} once the cause is removed.",
}
RESET_NOW = "{by} works now, as the drive reports."
RESET_NOT_YET = "Not yet: the drive reports that the cause is still present."


@dataclass(frozen=True, slots=True)
class ExcludedAdvice:
    """A cause or check that a value excludes, with that value as text."""

    text: str
    code: str
    reason: str
    """Return `ruled out, BRA Yes`, or `not now, ULN 228.0 V` if the value at the fault is
    unknown."""


@dataclass(frozen=True, slots=True)
class FaultAdvice:
    """The causes and checks of a fault that its values do not exclude."""

    probable: tuple[str, ...]
    check: tuple[str, ...]
    excluded: tuple[ExcludedAdvice, ...]
    confidence: HelpConfidence
    """The confidence of the first remaining cause: practice, unless the help lists it first."""


@dataclass(frozen=True, slots=True)
class ResetText:
    """Text about the reset of a fault, and True if the drive itself reports this."""

    text: str
    by_drive: bool
    wait: str = ""


def reset_text(
    help_: FaultHelp | None, ready: bool | None, by: str, follows: str = MAY_START
) -> ResetText:
    """Return how a fault is reset; `by` names the key or the command.

    `ready` is True or False as the drive reports it, None if it does not. That report takes
    precedence over the help, which is recalled from memory. `follows` is the motor's reaction, from
    `reset_follows`.
    """
    if ready is not None:
        text = RESET_NOW if ready else RESET_NOT_YET
        return ResetText(f"{text.format(by=by)} {follows}", True)
    wait = f"wait about {help_.wait_s} s before it" if help_ and help_.wait_s else ""
    text = RESETS[help_.reset if help_ else None].format(by=by)
    return ResetText(f"{text} {follows}", False, wait)


def reset_ready(profile: Profile, raws: Mapping[str, int]) -> bool | None:
    """Return True if the drive reports that a reset can work now; None if it has no such word."""
    reported = profile.data.faults.reset_ready
    raw = raws.get(reported.parameter) if reported else None
    if reported is None or raw is None:
        return None
    return (raw >> reported.bit & 1) == reported.value


def codes_to_read(profile: Profile, hint: Hint | None) -> list[str]:
    """Return the codes to read to display a fault."""
    reported = profile.data.faults.reset_ready
    codes = [look.code for look in hint.look_at] if hint else []
    for row in hint.ruled_out if hint else ():
        codes += [row.parameter, *(when.parameter for when in row.when)]
    return list(dict.fromkeys([*codes, *([reported.parameter] if reported else [])]))


def advice(profile: Profile, hint: Hint, raws: Mapping[str, int], *, latest: bool) -> FaultAdvice:
    """Return the causes and checks of a fault or an alarm, without those that values exclude.

    `latest` is False for a fault that is not the last one: the values that the drive has stored do
    not belong to it.
    """
    stored = frozenset(profile.data.faults.stored[0]) if profile.data.faults.stored else frozenset()
    known = raws if latest else {code: raw for code, raw in raws.items() if code not in stored}
    rows = {row.text: row for row in reversed(hint.ruled_out) if row.holds(known)}
    probable = tuple(text for text in hint.probable if text not in rows)
    excluded = []
    for text in (*hint.probable, *hint.check):
        if (row := rows.get(text)) is not None:
            parameter = profile[row.parameter]
            value = shown(profile, parameter, known[row.parameter], known)
            measured = parameter.access == "r" and bool(parameter.unit)
            reason = f"ruled out, {row.parameter} {value.text} {value.unit}".rstrip()
            if measured and row.parameter not in stored:
                reason = f"not now, {row.parameter} {value.text} {value.unit}".rstrip()
            excluded.append(ExcludedAdvice(text, row.parameter, reason))
    return FaultAdvice(
        probable,
        tuple(text for text in hint.check if text not in rows),
        tuple(excluded),
        hint.confidence if probable[:1] == tuple(hint.probable[:1]) else "practice",
    )


def alarm_words(profile: Profile) -> list[str]:
    """Return the codes of words of the monitoring set that carry alarm bits."""
    watched = [value.parameter for value in profile.data.monitoring.values]
    return [code for code in watched if any(bit.alarm for bit in profile[code].bits)]


def alarms_on(profile: Profile, raws: Mapping[str, int]) -> list[tuple[str, int, str]]:
    """Return the alarm bits that are set, as code of the word, bit and name."""
    return [
        (code, bit.bit, bit.name)
        for code, raw in raws.items()
        if (parameter := profile.get(code)) is not None
        for bit in set_bits(parameter.bits, raw)
        if bit.alarm
    ]


def hint_markdown(
    profile: Profile, hint: Hint, left: FaultAdvice, value: Callable[[str], str], reset: str = ""
) -> list[str]:
    """Return facts about a fault as lines of Markdown; `value` returns what a parameter holds."""
    lines = []
    if left.probable:
        lines.append(f"- Probably ({TRUST[left.confidence]}): {_joined(left.probable)}")
    if left.check:
        lines.append(f"- Check (general practice): {_joined(left.check)}")
    lines += [f"- {advice.text}: {advice.reason}." for advice in left.excluded]
    lines += [
        f"- Check {look.code}, {profile[look.code].name}: {value(look.code)} ({look.why})"
        for look in hint.look_at
    ]
    if reset:
        lines.append(f"- Reset (unverified): {reset}")
    return lines


def _joined(texts: Sequence[str]) -> str:
    return sentence("; ".join(texts))
