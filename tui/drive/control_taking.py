"""Taking control of a drive from its terminals, and giving it back. Pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .orders import chart_in_force, order_target
from .profile.profile import Profile
from .profile.schema import OrderId


@dataclass(frozen=True, slots=True)
class ControlTaking:
    """Commands to take and give back control that a drive has, and its present controller."""

    can_take: bool
    can_give_back: bool
    taken: bool | None
    """True if Modbus has control; None if no word shows it."""


def control_taking(profile: Profile, raws: Mapping[str, int]) -> ControlTaking | None:
    """Return the possibilities to switch control; None if the drive has neither command."""
    chart = chart_in_force(profile, raws)
    if chart is None:
        return None
    ids: dict[OrderId, bool | None] = {}
    for order in chart.orders:
        if order.id in ("take-control", "hand-back"):
            held = raws.get(order_target(profile, chart, order).code)
            ids[order.id] = None if held is None else held == order.words[-1]
    if not ids:
        return None
    return ControlTaking("take-control" in ids, "hand-back" in ids, ids.get("take-control"))
