"""Rules for writing a parameter as a setting, with the reasons against it. Pure functions."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

from ..profile.profile import Profile, group_by_id, group_holds, is_verified
from ..profile.schema import Block, LinkSetting, Parameter, Quantity, StateKind

RefusalReason = Literal["read-only", "forbidden", "order", "unverified", "running"]

ORDER_QUANTITIES: frozenset[Quantity] = frozenset(
    {
        "command_word",
        "command_word_2",
        "extended_command_word",
        "command_frequency",
        "command_speed",
        "save_settings",
        "digital_inputs",
        "digital_outputs",
    }
)
"""Quantities that are commands or outputs; they are never written as settings."""
OUTPUTS: frozenset[Quantity] = frozenset({"digital_inputs", "digital_outputs"})
AT_REST: frozenset[StateKind] = frozenset({"blocked", "ready", "stopped", "fault"})
"""Kinds of state in which the motor is certainly not commanded to turn."""
CUTTING = frozenset({"address", "baud", "format", "parity", "protocol"})
"""Roles of line settings that decide whether the drive can communicate on this line."""


@dataclass(frozen=True, slots=True)
class Refusal:
    """Reason why a parameter is not written: a sentence, and a keyword for decisions."""

    reason: RefusalReason
    text: str


def is_order(profile: Profile, parameter: Parameter) -> bool:
    """Return True if a word is a command, a reference or an output, and not a setting."""
    if (
        parameter.access == "w"
        or parameter.storage == "ram"
        or parameter.quantity in ORDER_QUANTITIES
    ):
        return True
    if parameter.holds == "command":
        return True
    # the command channel is a setting, although profiles list it among the commands
    if group_holds(profile, parameter) == "commands" and parameter.quantity != "command_channel":
        return True
    return parameter.code in _order_codes(profile)


def is_setting(profile: Profile, parameter: Parameter) -> bool:
    """Return True if a parameter is a setting: neither a measurement nor a command."""
    if parameter.access not in ("rw", "rw-stopped"):
        return False
    if group_holds(profile, parameter) == "measurements":
        return False
    return not is_order(profile, parameter)


def needs_standstill(profile: Profile, parameter: Parameter) -> bool:
    """Return True if the motor must be at standstill, by the parameter's access or its block's
    rule."""
    block = slot_of(profile, parameter.code)
    return parameter.access == "rw-stopped" or (block is not None and block.write_when == "stopped")


def slot_of(profile: Profile, code: str) -> Block | None:
    """Return the indirect block or scanner that has this parameter as a slot, or None."""
    return next((block for block in profile.data.blocks if code in block.slots), None)


def line_setting(profile: Profile, code: str) -> LinkSetting | None:
    """Return the line setting that a parameter represents, or None."""
    return next((s for s in profile.data.link.settings if s.parameter == code), None)


def write_refusal(
    profile: Profile,
    parameter: Parameter,
    state: StateKind | None,
    confirmed: Collection[str] = (),
) -> Refusal | None:
    """Return why a parameter must not be written as a setting now; None if it may be.

    `state` is the kind of the drive's state, None if unknown. `confirmed` are codes of unverified
    parameters that the user has confirmed.
    """
    code = parameter.code
    if parameter.forbidden:
        return Refusal(
            "forbidden", f"{code} is never written by Drive Panel: {parameter.forbidden}"
        )
    if parameter.access == "r":
        return Refusal("read-only", f"{code} can only be read.")
    if is_order(profile, parameter):
        return Refusal("order", _order_text(profile, parameter))
    if not is_verified(parameter) and code not in confirmed:
        return Refusal(
            "unverified",
            f"{code} is unverified: no document of this family confirms its address"
            f" {parameter.number}. Compare it with the keypad, then confirm it (y on Parameters,"
            f" or --confirm {code}).",
        )
    if needs_standstill(profile, parameter) and state not in AT_REST:
        text = _NOT_AT_REST if state else _STATE_NOT_KNOWN
        return Refusal("running", text.format(code=code, state=state))
    return None


def _order_text(profile: Profile, parameter: Parameter) -> str:
    """Return why a word that is not a setting is not written, and what to use instead."""
    code = parameter.code
    if any(code in block.values for block in profile.data.blocks):
        return f"{code} is the value of a slot, not a setting. Press X on Scanner."
    memory = profile.data.memory
    moves = parameter.quantity in ORDER_QUANTITIES - OUTPUTS - {"save_settings"}
    if moves or code in _motor_codes(profile):
        return f"{code} is a command, not a setting. Use Monitor, or `run` and `stop`."
    if memory.factory is not None and code == memory.factory.parameter:
        return f"{code} restores the factory settings. Press F on Parameters."
    if parameter.quantity == "save_settings" or (
        memory.save is not None and code == memory.save.parameter
    ):
        return f"{code} saves the settings. Press S on Parameters, or use `write --save`."
    return f"{code} is an output or a command, not a setting. Drive Panel has no command for it."


_NOT_AT_REST = (
    "{code} can be written only with the motor stopped; the drive is now {state}. Stop it first."
)
_STATE_NOT_KNOWN = (
    "{code} can be written only with the motor stopped; the drive's state is unknown."
    " Stop it first."
)

_STORAGE = {
    "ram": "lost at power-off",
    "eeprom": "stored at once (EEPROM)",
    "ram-until-saved": "lost at power-off until saved",
    "unknown": "",
}


def option_code(profile: Profile, parameter: Parameter) -> Parameter | None:
    """Return the word that must have its factory value before the parameter may be written."""
    group = group_by_id(profile).get(parameter.group)
    code = group.needs_factory if group is not None else ""
    return profile.get(code) if code != parameter.code else None


def marks(profile: Profile, parameter: Parameter) -> tuple[str, ...]:
    """Return short remarks to show before a parameter is written."""
    block = slot_of(profile, parameter.code)
    later = parameter.effective == "after-reset" or (
        block is not None and block.effective == "after-reset"
    )
    setting = line_setting(profile, parameter.code)
    found = (
        "stopped only" if needs_standstill(profile, parameter) else "",
        "takes effect after a reset of the drive" if later else "",
        _STORAGE[parameter.storage],
        "changes the line itself" if setting is not None and setting.role in CUTTING else "",
        "" if is_verified(parameter) else "unverified",
    )
    return tuple(mark for mark in found if mark)


def cuts_line(profile: Profile, parameter: Parameter) -> bool:
    """Return True if a write takes effect immediately and cuts the present communication."""
    setting = line_setting(profile, parameter.code)
    return setting is not None and setting.role in CUTTING and parameter.effective == "at-once"


def waits_for_reset(profile: Profile, parameter: Parameter) -> bool:
    """Return True if a written value takes effect only when the drive is reset or switched on."""
    block = slot_of(profile, parameter.code)
    if block is not None and block.effective == "after-reset":
        return True
    return parameter.effective == "after-reset"


def never_set(profile: Profile, parameter: Parameter, raw: int) -> str:
    """Return why Drive Panel never writes this value; empty if it may."""
    watch = profile.data.communication_fault
    if watch is None or parameter.code != watch.reaction:
        return ""
    if not any(r.never_set and r.raw == raw for r in watch.reactions):
        return ""
    return (
        f"{parameter.code} = {raw} is never written by Drive Panel: after a communication loss, a"
        " motor would run on unnoticed. If you need this value, set it on the keypad."
    )


def warning(profile: Profile, parameter: Parameter, raw: int) -> str:
    """Return the danger of a value of the drive's communication timeout; else empty."""
    watch = profile.data.communication_fault
    if watch is None:
        return ""
    if parameter.code == watch.timeout and raw == watch.off:
        return (
            "This switches the communication timeout of the drive off: a motor then runs on after a"
            " communication loss."
        )
    if parameter.code == watch.reaction:
        reaction = next((r for r in watch.reactions if r.raw == raw), None)
        if reaction is not None and reaction.motor_keeps_running:
            return f"{reaction.name}: a motor then runs on after a communication loss."
    return ""


# cached because every row of a table calls it, and a profile does not change
@lru_cache(maxsize=32)
def _order_codes(profile: Profile) -> frozenset[str]:
    """Return the codes of command words, references, and values that a block writes."""
    values = {code for block in profile.data.blocks for code in block.values}
    return _motor_codes(profile) | values - {""}


@lru_cache(maxsize=32)
def _motor_codes(profile: Profile) -> frozenset[str]:
    """Return the codes of command words and references."""
    codes = {reference.parameter for reference in profile.data.references}
    for chart in profile.data.charts:
        codes.add(chart.command)
        codes.update(option.parameter for option in chart.options)
        codes.update(order.parameter for order in chart.orders)
    # the command channel is a setting, although the command to take control writes it too
    channel = profile.quantity("command_channel")
    return frozenset(codes - {"", channel.code if channel else ""})
