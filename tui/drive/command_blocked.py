"""Reasons why a command that can move the motor would have no effect now, with remedies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from .channel import Channel, command_channel
from .chart import state_now, status_bit
from .orders import MOVING_ORDERS, OrderRefused, choose, locked_by, order_target, unmet, walk
from .profile.profile import Profile
from .profile.schema import Chart, OrderId

IN_FAULT = "The drive is in fault: reset it first."

UnblockHint = Literal["", "set-up", "take-control"]
"""Remedies: empty for none in Drive Panel, another control source, taking control."""


@dataclass(frozen=True, slots=True)
class CommandBlocked:
    """Reason against a command now."""

    text: str
    remedy: str = ""
    """Remedy as a sentence."""
    way: UnblockHint = ""
    by_channel: bool = False
    """True if the reason is that another source commands the drive, or may command it."""


def blocked_reason(
    profile: Profile, chart: Chart, id: OrderId, raws: Mapping[str, int]
) -> CommandBlocked | None:
    """Return why a command would have no effect; None if it would.

    A word that the command depends on blocks it while it is unknown.
    """
    if (lock := locked_by(chart, id, raws)) is not None:
        if lock.parameter not in raws:
            return CommandBlocked(f"{lock.parameter} was not read, and may block this: {lock.text}")
        channel = _is_set_up(profile, lock.parameter)
        return CommandBlocked(lock.text, lock.remedy, "set-up" if channel else "", channel)
    if id not in MOVING_ORDERS or not chart.orders:
        return None
    found = command_channel(profile, raws)
    if found is not None and not found.by_line:
        return _by_others(profile, found)
    if (when := unmet(chart, id, raws)) is not None:
        value = profile.names(profile[when.parameter]).get(raws[when.parameter])
        shown = raws[when.parameter] if value is None else value
        text = f"The drive is not commanded by Modbus: {when.parameter} is {shown}."
        way: UnblockHint = "take-control" if _takes_control(profile, chart, when.parameter) else ""
        return CommandBlocked(text, "", way, by_channel=True)
    return _in_local(chart, raws)


IN_LOCAL = "The drive is in local control ({code} bit {bit}): it is not commanded by Modbus."


def _in_local(chart: Chart, raws: Mapping[str, int]) -> CommandBlocked | None:
    """Return the reason if the drive shows local control, or may be in it."""
    if (mark := chart.local) is None:
        return None
    code, held = mark.parameter, status_bit(mark, raws)
    if held is None:
        return CommandBlocked(f"{code}, which shows local control, was not read.")
    if not held:
        return None
    text = IN_LOCAL.format(code=code, bit=mark.bit)
    return CommandBlocked(text, "Switch it to remote at the drive.", by_channel=True)


def state_refusal(profile: Profile, chart: Chart, id: OrderId, raws: Mapping[str, int]) -> str:
    """Return why the present state does not allow such a start; empty if it does."""
    state = state_now(profile, chart, raws)
    if state.kind == "fault":
        return IN_FAULT
    try:
        if chart.runs_in is None:
            choose(chart, id, raws, state)
        else:
            walk(chart, state.id, chart.runs_in)
    except OrderRefused as refused:
        return str(refused)
    return ""


NOT_BY_LINE = "The drive is not commanded by Modbus: {name} ({code}) is {value}."
NOT_BY_LINE_NOW = "The drive is not commanded by Modbus: the active {name} ({code}) is {value}."


def _by_others(profile: Profile, found: Channel) -> CommandBlocked:
    """Return the reason if another source commands the drive, or the commander is unknown."""
    word = found.parameter
    if word is None:
        return CommandBlocked("The source of the drive's commands is unknown.", by_channel=True)
    if found.by_line is None:
        return CommandBlocked(
            f"{word.code}, which selects the source of the drive's commands, was not read."
        )
    text = NOT_BY_LINE_NOW if found.is_several else NOT_BY_LINE
    text = text.format(name=word.name, code=word.code, value=found.text)
    way: UnblockHint = "set-up" if profile.data.control_sources else ""
    return CommandBlocked(text, profile.data.channels.remedy, way, by_channel=True)


def _is_set_up(profile: Profile, code: str) -> bool:
    """Return True if a control source that Drive Panel can set up writes this word."""
    sources = profile.data.control_sources
    written = {setting.parameter for source in sources for setting in source.settings}
    return code in written or profile[code].quantity == "command_channel"


def _takes_control(profile: Profile, chart: Chart, code: str) -> bool:
    return any(
        order.id == "take-control" and order_target(profile, chart, order).code == code
        for order in chart.orders
    )
