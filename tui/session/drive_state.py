"""State of a drive in words, from the readings of one cycle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from decimal import Decimal
from typing import TypeVar

from tui.drive.chart import ChartState, Direction, read_chart
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Bit, FaultCode, Parameter, StateKind
from tui.drive.values import Value, is_signed_type, set_bits

from .shown import Quality, Shown

Signed = TypeVar("Signed", float, Decimal)
"""A number with the sign of a direction."""


@dataclass(frozen=True, slots=True)
class DriveState:
    """The state of a drive; a part is None if its words were not read."""

    id: str
    name: str
    kind: StateKind
    motion: StateKind
    """Kind for callers that need a motor at standstill: a fault word alone is not a standstill."""
    direction: Direction | None
    reached: bool | None
    alarm: bool | None
    local: bool | None
    channel: str
    """Commander of the drive, if its words show it."""
    reference: str
    """Source of its reference, if its words show it."""
    fault: FaultCode | None
    """The present fault."""
    fault_raw: int | None
    """Raw fault code as read; some families keep the code of the last fault."""
    alarms: tuple[Bit, ...]
    headline: str
    """The state in a word or two; empty if its words are not among the readings."""


def drive_state(profile: Profile, readings: Mapping[str, Shown]) -> DriveState:
    """Return the state that these readings show; ignores stale and bad ones."""
    raws = {
        code: reading.raw
        for code, reading in readings.items()
        if reading.raw is not None and reading.quality is Quality.GOOD
    }
    chart = read_chart(profile, raws)
    fault_raw = raws.get(profile.data.faults.parameter)
    fault = _present_fault(profile, chart, fault_raw)
    return DriveState(
        id=chart.state.id,
        name=chart.state.name,
        kind=chart.kind,
        motion=chart.motion,
        direction=chart.direction,
        reached=chart.reached,
        alarm=chart.alarm,
        local=chart.local,
        channel=chart.channel,
        reference=chart.reference,
        fault=fault,
        fault_raw=fault_raw,
        alarms=_alarms(profile, raws),
        headline=_headline(chart, fault) if _requested(profile, readings) else "",
    )


def _requested(profile: Profile, readings: Mapping[str, Shown]) -> bool:
    """Return True if the words of the state are among the readings, of any quality."""
    return any(readings.keys() >= {*chart.status_codes} for chart in profile.data.charts)


def _present_fault(profile: Profile, chart: ChartState, raw: int | None) -> FaultCode | None:
    """Return the present fault; a stored last fault counts only while the state is a fault."""
    if raw is None or raw == profile.data.faults.none or chart.kind != "fault":
        return None
    return profile.fault(raw) or FaultCode(raw=raw, code=f"code {raw}", name="Not in the profile")


def _alarms(profile: Profile, raws: Mapping[str, int]) -> tuple[Bit, ...]:
    found: list[Bit] = []
    for code, raw in raws.items():
        found += [bit for bit in set_bits(profile[code].bits, raw) if bit.alarm]
    return tuple(found)


_WORDS: dict[StateKind, str] = {
    "starting": "starting up",
    "blocked": "not ready",
    "ready": "ready",
    "stopped": "stopped",
    "running": "running",
    "stopping": "stopping",
    "fault": "fault",
    "unknown": "unknown state",
}


def _headline(chart: ChartState, fault: FaultCode | None) -> str:
    words = _WORDS[chart.kind]
    if chart.kind == "running" and chart.direction is not None:
        return f"{words} {chart.direction}"
    if chart.kind == "fault" and fault is not None:
        return f"{words} {fault.code}"
    return words


def with_direction(parameter: Parameter, number: Signed, state: DriveState) -> Signed:
    """Return a frequency with the sign of its direction.

    Some drives report it without a sign, and the direction in the status word.
    """
    reverse = state.direction == "reverse" and not is_signed_type(parameter)
    return -number if reverse and number else number  # 0.0 has no sign


def channel_text(parameter: Parameter, value: Value) -> str:
    """Name the commander or reference source, from an enumeration or from the bits of a word."""
    if parameter.bits:
        return ", ".join(bit.name for bit in set_bits(parameter.bits, value.raw)) or "none"
    return value.text
