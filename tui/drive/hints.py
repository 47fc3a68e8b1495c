"""Causes of a fault or an alarm, in words shared by screens, commands and reports."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from tui.drive.sentences import sentence, without_stop

from .causes import (
    KnownValues,
    WeighedCause,
    exclusion,
    stored_codes,
    values_at_trip,
    values_now,
    weigh,
)
from .profile.profile import Profile
from .profile.schema import AlarmHelp, FaultHelp, HelpConfidence, Hint, ResetWay
from .sentences import MAY_START
from .values import set_bits

TRUST: Mapping[HelpConfidence, str] = {
    "manual": "manual",
    "public": "public guide",
    "practice": "general practice",
}
"""Text for the certainty of the first cause."""
RESETS: Mapping[ResetWay | None, str] = {
    "by-reset": "{by} works once the cause is removed.",
    "automatic": "{by} works once the cause is removed, or the automatic restart if it is on.",
    "by-itself": "The drive leaves the fault once the cause is removed, and may start.",
    "power-cycle": "Switch the drive off and on once the cause is removed; {by} has no effect.",
    None: "{by} works once the cause is removed.",
}
RESET_NOW = "{by} works now, as the drive reports."
RESET_NOT_YET = "Not yet: the drive reports that the cause is still present."


@dataclass(frozen=True, slots=True)
class DecidedAdvice:
    """A cause or check for which a value decided, with that value as text."""

    text: str
    code: str
    reason: str
    """`ruled out, BRA Yes`, or `not now, ULN 228.0 V` if the value at the fault is unknown; of a
    supported cause the values alone."""
    source: str = ""
    confidence: HelpConfidence = "practice"


@dataclass(frozen=True, slots=True)
class FaultAdvice:
    """The causes and checks of a fault, weighed by its values."""

    causes: tuple[WeighedCause, ...]
    """All causes, the likeliest first, those that a value excludes last."""
    check: tuple[str, ...]
    """Checks that no value excludes."""
    excluded: tuple[DecidedAdvice, ...]
    """Excluded causes, then excluded checks."""
    confidence: HelpConfidence
    """The confidence of the first remaining cause: practice, unless the help lists it first."""

    @property
    def probable(self) -> tuple[str, ...]:
        """Causes that no value excludes, the likeliest first."""
        return tuple(cause.text for cause in self.causes if cause.verdict != "excluded")

    @property
    def supported(self) -> tuple[DecidedAdvice, ...]:
        """Causes that values support, with these."""
        return tuple(
            DecidedAdvice(
                cause.text,
                cause.evidence[0].code,
                "; ".join(evidence.text for evidence in cause.evidence),
                cause.evidence[0].rule.source,
                cause.evidence[0].rule.confidence,
            )
            for cause in self.causes
            if cause.verdict == "supported"
        )


@dataclass(frozen=True, slots=True)
class ResetText:
    """Text about the reset of a fault, and True if the drive itself reports this."""

    text: str
    by_drive: bool
    wait: str = ""


def reset_text(
    help_: FaultHelp | None, ready: bool | None, by: str, follows: str = MAY_START
) -> ResetText:
    """Return how a fault is reset; `by` names the reset, such as `a reset`.

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
    """Return the codes to read to display a fault and to weigh its causes."""
    reported = profile.data.faults.reset_ready
    codes = [look.code for look in hint.look_at] if hint else []
    for rule in (*hint.ruled_out, *hint.supported) if hint else ():
        codes += rule.codes
    codes = [*codes, *stored_codes(profile, codes)]
    known = [parameter for code in codes if (parameter := profile.get(code)) is not None]
    codes += [p.scale_source for p in known if p.scale_source]
    codes += [p.unit_by.parameter for p in known if p.unit_by]
    return list(dict.fromkeys([*codes, *([reported.parameter] if reported else [])]))


def advice_now(
    profile: Profile, hint: Hint, raws: Mapping[str, int], *, present: bool, latest: bool = True
) -> FaultAdvice:
    """Weigh by current values and by those that the drive stored at its last trip.

    `present` is False if the drive is no longer in the fault, `latest` if its last fault is another
    one. For an alarm, which is there now, all values are those of its time.
    """
    alarm = isinstance(hint, AlarmHelp)
    trip = values_at_trip(profile, raws, 0 if latest and not alarm else None, present=present)
    now = values_now(profile, raws)
    return advice(profile, hint, KnownValues(now, {**now, **trip} if alarm else trip))


def advice(profile: Profile, hint: Hint, known: KnownValues) -> FaultAdvice:
    """Weigh the causes of a fault or an alarm, and leave out the checks that values exclude."""
    causes = weigh(profile, hint, known)
    decided = {cause.text: cause.evidence[0] for cause in causes if cause.verdict == "excluded"}
    for text in hint.check:
        if (found := exclusion(profile, hint, text, known)) is not None:
            decided[text] = found
    excluded = tuple(
        DecidedAdvice(text, found.code, found.reason, found.rule.source, found.rule.confidence)
        for text in dict.fromkeys((*hint.probable, *hint.check))
        if (found := decided.get(text)) is not None
    )
    first = next((cause.text for cause in causes if cause.verdict != "excluded"), None)
    return FaultAdvice(
        causes,
        tuple(text for text in hint.check if text not in decided),
        excluded,
        hint.confidence if first == hint.probable[0] else "practice",
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
    lines += [f"- {without_stop(known.text)}: {known.reason}." for known in left.supported]
    if left.check:
        lines.append(f"- Check (general practice): {_joined(left.check)}")
    lines += [f"- {without_stop(advice.text)}: {advice.reason}." for advice in left.excluded]
    lines += [
        f"- Check {look.code}, {profile[look.code].name}: {value(look.code)} ({look.why})"
        for look in hint.look_at
    ]
    if reset:
        lines.append(f"- Reset (unverified): {reset}")
    return lines


def _joined(texts: Sequence[str]) -> str:
    return sentence("; ".join(texts))
