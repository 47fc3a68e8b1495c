"""What a fault or an alarm points at, in words that screens, commands and reports share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from .profile.profile import Profile
from .profile.schema import FaultHelp, HelpConfidence, Hint, ResetWay
from .values import set_bits

TRUST: Mapping[HelpConfidence, str] = {
    "manual": "manual",
    "public": "public guide",
    "practice": "general practice",
}
"""How surely the first cause is known, in words."""
RESETS: Mapping[ResetWay | None, str] = {
    "by-reset": "{by} once the cause is gone; a run command may start it",
    "automatic": "{by} once the cause is gone; or a restart by itself, if on",
    "by-itself": "alone, once the cause is gone; a run command starts it",
    "power-cycle": "switch off and on, the cause gone; {by} does nothing",
    None: "{by} once the cause is gone; a run command may start it",
}
RESET_NOW = "{by} works now, says the drive; a run command may start it"
RESET_NOT_YET = "not yet, says the drive: the cause is still there"


@dataclass(frozen=True, slots=True)
class ResetText:
    """How a fault ends, in a sentence or two, and whether the drive itself says so."""

    text: str
    told_by_drive: bool
    wait: str = ""


def reset_text(help_: FaultHelp | None, ready: bool | None, by: str) -> ResetText:
    """How a fault ends; `by` names what resets it: a key, or the command.

    `ready` is what the drive says of it now, None where it says nothing. The drive is believed
    before what is only recalled.
    """
    if ready is not None:
        text = RESET_NOW if ready else RESET_NOT_YET
        return ResetText(text.format(by=by), True)
    wait = f"wait about {help_.wait_s} s before it" if help_ and help_.wait_s else ""
    return ResetText(RESETS[help_.reset if help_ else None].format(by=by), False, wait)


def reset_ready(profile: Profile, raws: Mapping[str, int]) -> bool | None:
    """Whether the drive says that a reset can work now; None where it does not tell."""
    told = profile.data.faults.reset_ready
    raw = raws.get(told.parameter) if told else None
    if told is None or raw is None:
        return None
    return (raw >> told.bit & 1) == told.value


def codes_to_read(profile: Profile, hint: Hint | None) -> list[str]:
    """Parameters to read for a fault that is looked at."""
    told = profile.data.faults.reset_ready
    codes = [look.code for look in hint.look_at] if hint else []
    return list(dict.fromkeys([*codes, *([told.parameter] if told else [])]))


def alarm_words(profile: Profile) -> list[str]:
    """Words of the monitoring set that carry alarm bits."""
    watched = [value.parameter for value in profile.data.monitoring.values]
    return [code for code in watched if any(bit.alarm for bit in profile[code].bits)]


def alarms_on(profile: Profile, raws: Mapping[str, int]) -> list[tuple[str, int, str]]:
    """Alarm bits that are set: word, bit and name."""
    return [
        (code, bit.bit, bit.name)
        for code, raw in raws.items()
        if (parameter := profile.get(code)) is not None
        for bit in set_bits(parameter.bits, raw)
        if bit.alarm
    ]


def hint_markdown(
    profile: Profile, hint: Hint, value: Callable[[str], str], reset: str = ""
) -> list[str]:
    """What is known of a fault as lines of Markdown; `value` tells what a parameter holds."""
    trust = TRUST[hint.confidence]
    lines = [f"- Probably ({trust}): {_joined(hint.probable)}"]
    if hint.check:
        lines.append(f"- Check (general practice): {_joined(hint.check)}")
    lines += [
        f"- Look at {look.code}, {profile[look.code].name}: {value(look.code)} ({look.why})"
        for look in hint.look_at
    ]
    if reset:
        lines.append(f"- Reset (recalled, not sure): {reset}")
    return lines


def _joined(texts: Sequence[str]) -> str:
    return "; ".join(texts) + "."
