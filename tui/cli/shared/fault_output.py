"""Causes of a drive's fault for the command line: text and JSON."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from tui.drive.fault_reset import reset_codes, reset_follows
from tui.drive.hints import (
    TRUST,
    FaultAdvice,
    ResetText,
    advice,
    alarms_on,
    codes_to_read,
    reset_ready,
    reset_text,
)
from tui.session.reading import Reading, with_text

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile
    from tui.drive.profile.schema import Hint
    from tui.session.console import DriveConsole
    from tui.session.drive_state import DriveState

RESET_BY = "a fault reset"


@dataclass(frozen=True, slots=True)
class FaultFinding:
    """Knowledge about a drive's present fault or alarm, and the values to check."""

    profile: Profile
    hint: Hint | None
    readings: Mapping[str, Reading]
    alarm: str = ""
    """The name of the reported alarm, if there is no fault."""

    @property
    def advice(self) -> FaultAdvice | None:
        """The causes and checks that the values leave."""
        raws = {code: r.raw for code, r in self.readings.items() if r.raw is not None}
        return advice(self.profile, self.hint, raws, latest=True) if self.hint else None

    @property
    def ready(self) -> bool | None:
        """True if the drive says that a reset can work now; None if it does not report it."""
        raws = {code: r.raw for code, r in self.readings.items() if r.raw is not None}
        return reset_ready(self.profile, raws)

    def reset(self) -> ResetText:
        """Return how the fault is reset."""
        from tui.drive.profile.schema import FaultHelp

        help_ = self.hint if isinstance(self.hint, FaultHelp) else None
        return reset_text(help_, self.ready, RESET_BY, self.follows())

    def follows(self) -> str:
        """The motor's reaction to a reset now, with the inputs that are closed."""
        raws = {code: r.raw for code, r in self.readings.items() if r.raw is not None}
        return reset_follows(self.profile, raws, raws)


async def find_out(
    console: DriveConsole, state: DriveState, readings: Mapping[str, Reading]
) -> FaultFinding | None:
    """Read what the drive's fault points at, else its first alarm; None where it has neither.

    Raises the line's errors.
    """
    profile = console.session.profile
    if state.kind == "fault" or state.fault is not None:
        help_ = profile.guide.fault(state.fault.raw if state.fault else None)
        codes = [*codes_to_read(profile, help_), *reset_codes(profile)]
        found = await console.read(list(dict.fromkeys(codes)))
        return FaultFinding(profile, help_, with_text(found))
    raws = {code: r.raw for code, r in readings.items() if r.raw is not None}
    for word, bit, name in alarms_on(profile, raws):
        if (hint := profile.guide.alarm(word, bit)) is not None:
            codes = codes_to_read(profile, hint)
            found = await console.read(codes) if codes else {}
            return FaultFinding(profile, hint, with_text(found), name)
    return None


def fault_json(state: DriveState, found: FaultFinding | None) -> dict[str, Any] | None:
    """The fault that a drive is in, with what it points at; null where it is in none."""
    fault = state.fault
    if fault is None and state.kind != "fault":
        return None
    reported: dict[str, Any] = {
        "raw": fault.raw if fault else None,
        "code": fault.code if fault else None,
        "name": fault.name if fault else None,
    }
    hint = found.hint if found is not None and not found.alarm else None
    return {
        **reported,
        **_advice_json(found if hint else None),
        "look_at": _look_at_json(found) if found and hint else [],
        "confidence": hint.confidence if hint else None,
        "source": hint.source if hint else None,
        "reset": _reset_json(found) if found else None,
    }


def alarm_json(found: FaultFinding | None) -> dict[str, Any] | None:
    """The first alarm of a drive without a fault, with what it points at; null where none is."""
    if found is None or not found.alarm:
        return None
    hint = found.hint
    return {
        "name": found.alarm,
        **_advice_json(found),
        "look_at": _look_at_json(found) if hint else [],
        "confidence": hint.confidence if hint else None,
        "source": hint.source if hint else None,
    }


def _advice_json(found: FaultFinding | None) -> dict[str, Any]:
    left = found.advice if found is not None else None
    return {
        "causes": list(left.probable) if left else [],
        "checks": list(left.check) if left else [],
        "ruled_out": [
            {"text": advice.text, "code": advice.code, "reason": advice.reason}
            for advice in left.excluded
        ]
        if left
        else [],
    }


def _look_at_json(found: FaultFinding) -> list[dict[str, Any]]:
    from .output import reading_json

    rows = []
    for look in found.hint.look_at if found.hint else ():
        reading = found.readings.get(look.code)
        value = reading_json(reading) if reading is not None else None
        row = {"code": look.code, "name": found.profile[look.code].name, "why": look.why}
        rows.append({**row, "value": value})
    return rows


def _reset_json(found: FaultFinding) -> dict[str, Any]:
    from tui.drive.profile.schema import FaultHelp

    help_ = found.hint if isinstance(found.hint, FaultHelp) else None
    return {
        "way": help_.reset if help_ else None,
        "confidence": "practice",
        "possible_now": found.ready,
        "wait_s": help_.wait_s if help_ else None,
        "follows": found.follows(),
    }


def fault_rows(found: FaultFinding | None) -> list[tuple[str, str]]:
    """Titles and texts of what a fault or an alarm points at, for a person."""
    if found is None:
        return []
    rows: list[tuple[str, str]] = []
    hint, left = found.hint, found.advice
    if hint is not None and left is not None:
        causes = "; ".join(left.probable) or "no cause is left"
        probably = f"{causes} ({TRUST[left.confidence]})"
        rows.append(("  probably", f"{found.alarm}: {probably}" if found.alarm else probably))
        if left.check:
            rows.append(("  check", f"{'; '.join(left.check)} ({TRUST['practice']})"))
        rows += [("  ruled out", f"{advice.text}: {advice.reason}") for advice in left.excluded]
        for look in hint.look_at:
            reading = found.readings.get(look.code)
            value = f"{reading.text} {reading.unit}".rstrip() if reading else "-----"
            rows.append(("  look at", f"{look.code} {value}, {look.why}"))
    elif found.profile.guide.trouble:
        rows.append(("  probably", found.profile.guide.trouble))
    if not found.alarm:
        reset = found.reset()
        message = "" if reset.by_drive else f" ({TRUST['practice']})"
        wait = f"; {reset.wait}" if reset.wait else ""
        rows.append(("  reset", f"{reset.text}{wait}{message}"))
    return rows
