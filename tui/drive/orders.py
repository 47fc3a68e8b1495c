"""Words that carry out a command in the drive's present state. Pure functions of a profile."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping, Sequence

from tui.drive.sentences import all_of, any_of

from .channel import channel_codes
from .chart import state_of
from .errors import DriveError
from .profile.profile import Profile
from .profile.schema import Chart, Interlock, Order, OrderId, Parameter, State, When
from .words import unsigned

GENTLE_FIRST: tuple[OrderId, ...] = ("stop", "quick-stop", "freewheel")
"""Stop commands that do not trip the drive, gentlest first."""
INSTEAD: Mapping[OrderId, tuple[OrderId, ...]] = {
    "emergency-stop": ("emergency-stop", "quick-stop", "stop"),
    "quick-stop": ("quick-stop", "stop"),
}
"""Stop commands that replace one that a drive does not have."""
WAYS_TO_STOP = frozenset[OrderId]({"stop", "quick-stop", "freewheel", "emergency-stop"})


class OrderRefused(DriveError):
    """A command that is not possible now; the text gives the reason."""


def chart_in_force(profile: Profile, raws: Mapping[str, int]) -> Chart | None:
    """Return the chart that is certainly active; None if the word that selects it is unknown.

    A value that belongs to no chart counts as unknown.
    """
    found = profile.chart(raws) if raws.keys() >= set(chart_codes(profile)) else None
    return found if found is None or found.when is None or found.when.holds(raws) else None


def chart_codes(profile: Profile) -> list[str]:
    """Return the codes of the words that select the chart; none for most families."""
    codes = (chart.when.parameter for chart in profile.data.charts if chart.when)
    return list(dict.fromkeys(codes))


def deciding_codes(profile: Profile) -> list[str]:
    """Return the codes of the words that determine how a command is carried out, and its source."""
    codes = chart_codes(profile)
    for chart in profile.data.charts:
        codes += [when.parameter for order in chart.orders for when in order.when]
    return list(dict.fromkeys((*codes, *channel_codes(profile))))


def choose(chart: Chart, id: OrderId, raws: Mapping[str, int], state: State | None = None) -> Order:
    """Return the command for a state (default: that of the status word); raises OrderRefused."""
    same = [order for order in chart.orders if order.id == id]
    if not same:
        raise OrderRefused(f"The {chart.name} has no command {id.replace('-', ' ')!r}.")
    if state is None and chart.status in raws:
        state = state_of(chart, raws)
    fitting = [o for o in same if not o.states or (state is not None and state.id in o.states)]
    for order in fitting:
        if all(when.holds(raws) for when in order.when):
            return order
    if fitting:
        needed = any_of([_conditions(order) for order in fitting])
        raise OrderRefused(f"{fitting[0].name} requires {needed}.")
    names = {s.id: s.name for s in chart.states}
    allowed = ", ".join(dict.fromkeys(names[s] for order in same for s in order.states))
    now = state.name if state else "unknown"
    raise OrderRefused(
        f"{same[0].name} is possible only in these states: {allowed}. The present state is {now}."
    )


def follows_from(chart: Chart, id: OrderId) -> str:
    """Return the consequences of a command, for the person who confirms it."""
    return " ".join(dict.fromkeys(o.follows for o in chart.orders if o.id == id and o.follows))


def nearest_stop(chart: Chart, id: OrderId) -> OrderId:
    """Return the stop command of a chart that replaces one that it does not have.

    An emergency stop becomes a quick stop, else a ramp stop; never coasting or braking.
    """
    ids = {order.id for order in chart.orders}
    return next((way for way in INSTEAD.get(id, (id,)) if way in ids), id)


def stop_conditions(chart: Chart, id: OrderId) -> list[str]:
    """Return the codes of the words that select the stop word of a chart."""
    same = [order for order in chart.orders if order.id == id]
    codes = [when.parameter for order in same for when in order.when]
    if any(order.states for order in same):
        codes += chart.status_codes
    return list(dict.fromkeys(codes))


def stop_in_any(profile: Profile, raws: Mapping[str, int]) -> tuple[Chart, Order]:
    """Return the command that stops in every chart that may be active.

    By ramp if one word does that in all of them, else faster, else coasting. Raises OrderRefused if
    no word stops in all.
    """
    ordered = [chart for chart in profile.data.charts if chart.orders]
    may_hold = [chart for chart in profile.data.charts if _may_hold(chart, raws)]
    # a value that belongs to no chart selects none
    charts = [chart for chart in ordered if chart in may_hold] if may_hold else ordered
    for id in GENTLE_FIRST:
        for chart in charts:
            for order in chart.orders:
                if order.id != id or order.states or order.when:
                    continue
                if all(
                    _stops(profile, other, order_target(profile, chart, order), order.words)
                    for other in charts
                ):
                    return chart, order
    raise OrderRefused("The command words of this drive are unknown.")


def _may_hold(chart: Chart, raws: Mapping[str, int]) -> bool:
    """Return True if a chart may be active."""
    if chart.when is None:
        return True
    return chart.when.holds(raws) is not False


def _stops(profile: Profile, chart: Chart, where: Parameter, words: Sequence[int]) -> bool:
    """Return True if words written at a place stop a motor in every state of a chart."""
    return any(
        order.id in GENTLE_FIRST
        and not order.when
        and not order.states
        and list(order.words) == list(words)
        and order_target(profile, chart, order) is where
        for order in chart.orders
    )


def last_word(chart: Chart, order: Order) -> Order | None:
    """Return the command that ends operation after an enabled ramp stop to 0 Hz."""
    same = (
        item for item in chart.orders if item.id == order.id and not item.states and not item.when
    )
    return next((item for item in same if item is not order), None) if order.states else None


def stop_alike(profiles: Sequence[Profile]) -> bool:
    """Return True if the same words stop all these families, with the same state words."""
    ways = [_ways_to_stop(profile) for profile in profiles]
    return bool(ways) and all(way == ways[0] for way in ways)


def _ways_to_stop(profile: Profile) -> tuple[object, ...]:
    return tuple(
        (
            chart.when,
            tuple(profile[code].place for code in chart.status_codes),
            profile[chart.command].place if chart.command else None,
            tuple((s.id, s.kind, s.mask, s.value, tuple(s.also)) for s in chart.states),
            tuple(
                (order.id, order.parameter, order.words, order.states, order.when)
                for order in chart.orders
                if order.id in WAYS_TO_STOP
            ),
        )
        for chart in profile.data.charts
    )


def _conditions(order: Order) -> str:
    return all_of(
        [f"{when.parameter} = {any_of([str(v) for v in when.values])}" for when in order.when]
    )


STOP_ORDERS: frozenset[OrderId] = frozenset({"stop", "quick-stop", "freewheel", "emergency-stop"})
"""Orders that neither an interlock nor missing arming ever blocks."""
MOVING_ORDERS: frozenset[OrderId] = frozenset({"forward", "reverse", "dc-braking"})


def locked_by(chart: Chart, id: OrderId, raws: Mapping[str, int]) -> Interlock | None:
    """Return the first interlock that blocks a command now, or whose word is unknown."""
    if id in STOP_ORDERS:
        return None
    for lock in chart.interlocks:
        if id not in (lock.orders or MOVING_ORDERS):
            continue
        if any(when.holds(raws) is False for when in lock.when):
            continue
        raw = raws.get(lock.parameter)
        if raw is None or raw & lock.mask not in lock.values:
            return lock
    return None


def unmet(chart: Chart, id: OrderId, raws: Mapping[str, int]) -> When | None:
    """Return a condition that certainly does not hold, if every form of a command has one."""
    first = None
    for order in chart.orders:
        if order.id != id:
            continue
        wrong = next((when for when in order.when if when.holds(raws) is False), None)
        if wrong is None:
            return None
        first = first or wrong
    return first


def interlock_codes(chart: Chart) -> list[str]:
    """Return the codes of the words that block a start: those of interlocks and local control."""
    codes = [lock.parameter for lock in chart.interlocks]
    codes += [when.parameter for lock in chart.interlocks for when in lock.when]
    codes += [chart.local.parameter] if chart.local is not None else []
    return list(dict.fromkeys(codes))


def with_options(chart: Chart, order: Order, raws: Mapping[str, int]) -> list[int]:
    """Return the words of a command, with the present option bits of its word.

    Zeros are unchanged, because they return control or lock the drive.
    """
    where = order.parameter or chart.command
    kept = raws.get(where, 0) & optional_bits(chart, where)
    return [unsigned(word) | kept if word else 0 for word in order.words]


def optional_bits(chart: Chart, code: str) -> int:
    """Return the bits of a command word that carry options."""
    bits = 0
    for option in chart.options:
        if option.parameter == code:
            bits |= option.mask
    return bits


def order_target(profile: Profile, chart: Chart, order: Order) -> Parameter:
    """Return the register of a command's words."""
    return profile[order.parameter or chart.command]


def walk(chart: Chart, source: str, goal: str) -> list[tuple[str, int]]:
    """Return the shortest path through the chart: pairs of next state and command word.

    Without command edges and fault states. Raises OrderRefused if there is none.
    """
    ways: deque[tuple[str, list[tuple[str, int]]]] = deque([(source, [])])
    seen = {source}
    while ways:
        at, way = ways.popleft()
        if at == goal:
            return way
        for step in chart.transitions:
            if step.source == at and step.command is not None and step.target not in seen:
                if step.edge_bit is not None:
                    continue
                seen.add(step.target)
                ways.append((step.target, [*way, (step.target, step.command)]))
    names = {state.id: state.name for state in chart.states}
    raise OrderRefused(
        f"No command leads from {names.get(source, source)} to {names.get(goal, goal)}."
    )
