"""Causes of a drive's fault for the command line: text and JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypedDict

from tui.drive.chart import fault_code
from tui.drive.fault_reset import reset_codes, reset_follows
from tui.drive.hints import (
    TRUST,
    DecidedAdvice,
    FaultAdvice,
    ResetText,
    advice_now,
    alarm_words,
    alarms_on,
    codes_to_read,
    reset_ready,
    reset_text,
)
from tui.drive.profile.schema import FaultHelp, Hint
from tui.drive.sentences import without_stop
from tui.session.reading import Reading, with_text
from tui.session.shown import Quality

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile
    from tui.session.console import DriveConsole
    from tui.session.drive_state import DriveState

    from ..documents.parts import AlarmField, ExcludedPart, FaultField, LookField, ResetField

RESET_BY = "a fault reset"
ALL_RULED_OUT = "All listed causes are ruled out."


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
        """The causes, weighed by the values, and the checks that these leave."""
        if self.hint is None:
            return None
        good = [r for r in self.readings.values() if r.quality is Quality.GOOD]
        raws = {r.parameter.code: r.raw for r in good if r.raw is not None}
        return advice_now(self.profile, self.hint, raws, present=not self.alarm)

    @property
    def ready(self) -> bool | None:
        """True if the drive says that a reset can work now; None if it does not report it."""
        raws = {code: r.raw for code, r in self.readings.items() if r.raw is not None}
        return reset_ready(self.profile, raws)

    def reset(self) -> ResetText:
        """Return how the fault is reset."""
        help_ = self.hint if isinstance(self.hint, FaultHelp) else None
        return reset_text(help_, self.ready, RESET_BY, self.follows())

    def follows(self) -> str:
        """The motor's reaction to a reset now, with the inputs that are closed."""
        raws = {code: r.raw for code, r in self.readings.items() if r.raw is not None}
        return reset_follows(self.profile, raws, raws)


def fault_text(profile: Profile, state: DriveState) -> str:
    """Return the present fault with its name; empty without one. It says if it is not known."""
    faults = profile.data.faults
    if state.fault is not None:
        return f"{state.fault.code}, {state.fault.name}"
    if state.kind == "fault":
        is_unread = faults.parameter and state.fault_raw is None
        return "code not read" if is_unread else "no code reported"
    excluded = fault_code(profile) and state.fault_raw == faults.none
    return "not known" if state.kind == "unknown" and not excluded else ""


def alarms_text(profile: Profile, state: DriveState, readings: Mapping[str, Reading]) -> str:
    """Return the present alarms; "none" only if every word that shows alarms was read."""
    if state.alarms:
        return ", ".join(bit.name for bit in state.alarms)
    if state.alarm:
        return "shown by the status word"
    words = alarm_words(profile)
    is_marked = any(chart.alarm for chart in profile.data.charts)
    good = {code for code, reading in readings.items() if reading.quality is Quality.GOOD}
    if not good.issuperset(words) or (is_marked and state.kind == "unknown"):
        return "not known"
    return "none" if words or is_marked else "not reported by this drive"


def direction_row(profile: Profile, state: DriveState) -> list[tuple[str, str]]:
    """Return the row of the direction; none if the family does not report it."""
    if state.direction is None and not any(chart.direction for chart in profile.data.charts):
        return []
    return [("Direction", state.direction or "not known")]


async def find_out(
    console: DriveConsole, state: DriveState, readings: Mapping[str, Reading]
) -> FaultFinding | None:
    """Read the parameters to check for the fault, else for the first alarm; None without either.

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


class _AdviceFields(TypedDict):
    """The fields of an advice."""

    causes: list[str]
    checks: list[str]
    ruled_out: list[ExcludedPart]
    supported: list[ExcludedPart]
    look_at: list[LookField]
    confidence: str | None
    source: str | None


def fault_field(state: DriveState, found: FaultFinding | None) -> FaultField | None:
    """The drive's fault with causes and checks; None without a fault."""
    from ..documents.parts import FaultField

    fault = state.fault
    if fault is None and state.kind != "fault":
        return None
    return FaultField(
        raw=fault.raw if fault else None,
        code=fault.code if fault else None,
        name=fault.name if fault else None,
        **_advice_fields(found if found is not None and not found.alarm else None),
        reset=_reset_field(found) if found else None,
    )


def alarm_field(found: FaultFinding | None) -> AlarmField | None:
    """The first alarm of a drive without a fault, with causes and checks; None without one."""
    from ..documents.parts import AlarmField

    if found is None or not found.alarm:
        return None
    return AlarmField(name=found.alarm, **_advice_fields(found))


def _advice_fields(found: FaultFinding | None) -> _AdviceFields:
    hint = found.hint if found is not None else None
    left = found.advice if found is not None else None
    return {
        "causes": list(left.probable) if left else [],
        "checks": list(left.check) if left else [],
        "ruled_out": _decided_parts(left.excluded if left else ()),
        "supported": _decided_parts(left.supported if left else ()),
        "look_at": _look_fields(found) if found is not None else [],
        "confidence": hint.confidence if hint else None,
        "source": hint.source if hint else None,
    }


def _decided_parts(decided: Sequence[DecidedAdvice]) -> list[ExcludedPart]:
    from ..documents.parts import ExcludedPart

    return [
        ExcludedPart(
            text=advice.text,
            code=advice.code,
            reason=advice.reason,
            source=advice.source,
            confidence=advice.confidence,
        )
        for advice in decided
    ]


def _look_fields(found: FaultFinding) -> list[LookField]:
    from ..documents.parts import LookField
    from .output import value_field

    fields = []
    for look in found.hint.look_at if found.hint else ():
        reading = found.readings.get(look.code)
        value = value_field(reading) if reading is not None else None
        name = found.profile[look.code].name
        fields.append(LookField(code=look.code, name=name, why=look.why, value=value))
    return fields


def _reset_field(found: FaultFinding) -> ResetField:
    from ..documents.parts import ResetField

    help_ = found.hint if isinstance(found.hint, FaultHelp) else None
    return ResetField(
        way=help_.reset if help_ else None,
        confidence="practice",
        possible_now=found.ready,
        wait_s=help_.wait_s if help_ else None,
        follows=found.follows(),
    )


def fault_rows(found: FaultFinding | None) -> list[tuple[str, str]]:
    """Titles and texts of what a fault or an alarm points at, for a person."""
    if found is None:
        return []
    rows: list[tuple[str, str]] = []
    hint, left = found.hint, found.advice
    if hint is not None and left is not None:
        causes = "; ".join(left.probable)
        probably = f"{causes} ({TRUST[left.confidence]})" if causes else ALL_RULED_OUT
        rows.append(("  probably", f"{found.alarm}: {probably}" if found.alarm else probably))
        rows += [
            ("  supported", f"{without_stop(advice.text)}: {advice.reason}")
            for advice in left.supported
        ]
        if left.check:
            rows.append(("  check", f"{'; '.join(left.check)} ({TRUST['practice']})"))
        rows += [
            (
                "  not needed" if advice.text not in hint.probable else "  ruled out",
                f"{without_stop(advice.text)}: {advice.reason.removeprefix('ruled out, ')}",
            )
            for advice in left.excluded
        ]
        for look in hint.look_at:
            reading = found.readings.get(look.code)
            value = f"{reading.text} {reading.unit}".rstrip() if reading else "-----"
            rows.append(("  check", f"{look.code} {value}, {look.why}"))
    elif found.profile.guide.trouble:
        rows.append(("  probably", found.profile.guide.trouble))
    if not found.alarm:
        reset = found.reset()
        text = f"{reset.text}; {reset.wait}" if reset.wait else reset.text
        rows.append(("  reset", text if reset.by_drive else f"{text} ({TRUST['practice']})"))
    return rows
