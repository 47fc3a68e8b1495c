"""Effect of a fault reset, from the command channel and the inputs that are closed now."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal

from .channel import command_channel
from .command_blocked import blocked_reason
from .orders import chart_in_force, deciding_codes, follows_from
from .profile.profile import Profile
from .profile.schema import Chart, StateKind
from .sentences import MAY_START
from .values import set_bits

NOT_IN_COMMAND = "Drive Panel does not hold the command channel"
INPUTS_NOT_READ = "Its inputs were not read: check the terminals."
NO_INPUTS = "Its inputs cannot be read over Modbus: check the terminals."
NONE_CLOSED = "No input is closed at the terminals now."


def reset_codes(profile: Profile) -> list[str]:
    """Return the codes of all words that the text of `reset_follows` depends on."""
    faults = profile.data.faults
    codes = [when.parameter for row in faults.after_reset for when in row.when]
    codes += deciding_codes(profile)
    codes += [faults.inputs.parameter] if faults.inputs else []
    return list(dict.fromkeys(codes))


def reset_follows(profile: Profile, raws: Mapping[str, int], inputs: Mapping[str, int]) -> str:
    """Describe the motor's reaction to a reset under the present command channel.

    `inputs` holds current raw values only; `raws` may hold what was read earlier.
    """
    text = _after_reset(profile, raws)
    by = command_holder(profile, raws)
    ignored = f"{NOT_IN_COMMAND}: the drive may ignore its reset." if by == "others" else ""
    return " ".join(part for part in (text, ignored, closed_inputs(profile, inputs)) if part)


def no_fault(chart: Chart, state_id: str, kind: StateKind, name: str) -> str:
    """Return a sentence if there is no fault to reset; empty if there is or may be one."""
    states = {state for order in chart.orders if order.id == "reset" for state in order.states}
    if kind in ("fault", "unknown") or state_id in states:
        return ""
    return f"No fault to reset: the drive is in the state {name}."


def not_in_command(profile: Profile, raws: Mapping[str, int]) -> str:
    """Return why a drive may have ignored its reset, with the remedy; empty if not known."""
    if command_holder(profile, raws) != "others":
        return ""
    chart = chart_in_force(profile, raws)
    held = blocked_reason(profile, chart, "forward", raws) if chart is not None else None
    why = (held.text, held.remedy) if held is not None and held.by_channel else ()
    return " ".join(
        part for part in (f"{NOT_IN_COMMAND}, and the drive is still in fault.", *why) if part
    )


def command_holder(profile: Profile, raws: Mapping[str, int]) -> Literal["line", "others"] | None:
    """Return the holder of the command channel; None if not known."""
    found = command_channel(profile, raws)
    if found is not None:
        return None if found.by_line is None else "line" if found.by_line else "others"
    chart = chart_in_force(profile, raws)
    held = blocked_reason(profile, chart, "forward", raws) if chart is not None else None
    return "others" if held is not None and held.by_channel else None


def closed_inputs(profile: Profile, raws: Mapping[str, int]) -> str:
    """Return a sentence that names the closed inputs; `raws` must be current values."""
    shown_by = profile.data.faults.inputs
    if shown_by is None:
        return NO_INPUTS
    if (raw := raws.get(shown_by.parameter)) is None:
        return INPUTS_NOT_READ
    names = [bit.name for bit in set_bits(profile[shown_by.parameter].bits, raw & shown_by.mask)]
    return f"Closed at the terminals now: {', '.join(names)}." if names else NONE_CLOSED


def _after_reset(profile: Profile, raws: Mapping[str, int]) -> str:
    """Return the sentence of the first row that certainly applies, else the general one."""
    by = command_holder(profile, raws)
    for row in profile.data.faults.after_reset:
        if row.by in (None, by) and all(when.holds(raws) for when in row.when):
            return row.text
    chart = chart_in_force(profile, raws)
    return (follows_from(chart, "reset") if chart is not None else "") or MAY_START
