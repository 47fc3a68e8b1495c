"""True if a drive's control can be taken from its terminals, and given back; pure."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .orders import chart_in_force, order_target
from .profile.profile import Profile
from .profile.schema import OrderId


@dataclass(frozen=True, slots=True)
class ControlTaking:
    """Which of the two commands a drive has, and who has the control as far as that is known."""

    can_take: bool
    can_give_back: bool
    taken: bool | None
    """True if the line has it; None if no word shows it."""


def control_taking(profile: Profile, raws: Mapping[str, int]) -> ControlTaking | None:
    """Return what can be done about a drive's control; None if it has neither command."""
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
