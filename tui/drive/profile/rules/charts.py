"""Rules for state charts: a motor that can run can be stopped, and its states can be seen."""

from __future__ import annotations

from collections.abc import Iterator

from tui.drive.words import bit_count, type_bits

from ..schema import Chart, Order, Parameter, ProfileData, When
from ..toml_lines import TomlPath

RUN_ORDERS = frozenset({"forward", "reverse"})
SURE_STOPS = ("stop", "quick-stop", "freewheel")
"""Orders that bring a motor to standstill in any family."""
LONGEST_SEQUENCE = 10.0
"""Seconds that the waits of one command may take together."""
NOT_TURNING = frozenset({"blocked", "ready", "stopped"})


def names_of_states(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield unknown states in transitions and orders, and orders without words or register."""
    for index, chart in enumerate(data.charts):
        at: TomlPath = ("charts", index)
        ids = [state.id for state in chart.states]
        known = f"there are: {', '.join(ids)}."
        for place, step in enumerate(chart.transitions):
            for state in (step.source, step.target):
                if state not in ids:
                    yield (
                        (*at, "transitions", place),
                        f"chart {chart.id}: there is no state {state!r}; {known}",
                    )
        for place, order in enumerate(chart.orders):
            here = (*at, "orders", place)
            for state in order.states:
                if state not in ids:
                    yield here, f"order {order.id}: there is no state {state!r}; {known}"
            if fault := _waits_fault(chart, order):
                yield here, f"order {order.id}: {fault}"
            if not order.words or not (order.parameter or chart.command):
                yield (
                    here,
                    f"order {order.id}: it needs words, and a parameter or the command of its"
                    " chart.",
                )
        if chart.runs_in is not None and chart.runs_in not in {
            state.id for state in chart.states if state.kind == "running"
        }:
            yield (
                (*at, "runs_in"),
                f"chart {chart.id}: runs_in {chart.runs_in!r} is not a state of the kind running.",
            )


def _waits_fault(chart: Chart, order: Order) -> str:
    """Return why the waits of a command are refused; empty if they are right."""
    if not order.waits:
        return ""
    if order.id in (*SURE_STOPS, "emergency-stop"):
        return "a stop never waits. Delete its waits."
    if order.id in RUN_ORDERS and chart.runs_in is not None:
        return "its start follows the transitions and waits for each state. Delete its waits."
    if len(order.waits) >= len(order.words):
        waits, words = len(order.waits), len(order.words)
        return f"it has {waits} waits and {words} words. Waits are between words."
    ids = [state.id for state in chart.states]
    for state in (state for wait in order.waits for state in wait.states if state not in ids):
        return f"there is no state {state!r} to wait for; there are: {', '.join(ids)}."
    total = sum(wait.seconds for wait in order.waits)
    if total > LONGEST_SEQUENCE:
        return f"its waits take {total:g} s. Allowed are {LONGEST_SEQUENCE:g} s for one command."
    return ""


def states(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield states that can never be reached."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    for index, chart in enumerate(data.charts):
        for place, state in enumerate(chart.states):
            at: TomlPath = ("charts", index, "states", place)
            status = parameters.get(chart.status)
            if status is not None and state.mask & ~type_bits(status):
                text = f"{chart.status} has {bit_count(status)} bits, its mask more."
                yield at, f"chart {chart.id}: {text}"
            if state.value & ~state.mask:
                yield (
                    at,
                    f"chart {chart.id}: state {state.id} has value bits outside its mask.",
                )
            for when in state.also:
                if fault := _further_fault(chart, when, parameters.get(when.parameter)):
                    yield at, f"chart {chart.id}: state {state.id}: {fault}"
            for before in chart.states[:place]:
                same = not before.mask & ~state.mask and state.value & before.mask == before.value
                if same and all(
                    any(_implies(own, when) for own in state.also) for when in before.also
                ):
                    yield (
                        at,
                        f"chart {chart.id}: state {state.id} is never reached: {before.id} above"
                        " it fits the same words, and the first that fits counts. Move it before"
                        f" {before.id}, or give {before.id} a wider mask.",
                    )
                    break


def _further_fault(chart: Chart, when: When, parameter: Parameter | None) -> str:
    """Return why a further word of a state shows nothing; empty if it can."""
    if when.parameter in (chart.status, chart.command):
        return f"also names {when.parameter}. It is for words beside the status word."
    if parameter is None:
        return ""  # reported with the names
    if parameter.access == "w":
        return f"also names {parameter.code}, which cannot be read."
    if parameter.type == "float32" or parameter.unit:
        return f"also names {parameter.code}, which is a measurement, not a word with bits."
    mask = type_bits(parameter) if when.mask is None else when.mask
    if not when.values or any(value & ~mask for value in when.values):
        return f"a value of {parameter.code} has bits outside its mask, or none is given."
    if mask & ~type_bits(parameter):
        return f"{parameter.code} has {bit_count(parameter)} bits, its mask more."
    return ""


def _implies(own: When, other: When) -> bool:
    """Return True if a condition that holds makes another one hold."""
    same = own.parameter == other.parameter and own.mask == other.mask
    return same and set(own.values) <= set(other.values)


def stops_always(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield charts that can run a motor, but not stop it in every state."""
    for index, chart in enumerate(data.charts):
        if not _runs(chart):
            continue
        ways = [order for order in chart.orders if order.id in SURE_STOPS]
        at: TomlPath = ("charts", index, "orders")
        if not ways:
            yield (
                at,
                f"chart {chart.id}: it can run a motor but has no stop. Add an order with the id"
                f" {', '.join(SURE_STOPS)}.",
            )
        elif not any(not order.states and not order.when for order in ways):
            yield (
                at,
                f"chart {chart.id}: no stop applies in every state. One of its orders"
                f" {', '.join(dict.fromkeys(order.id for order in ways))} must have neither"
                " states nor when.",
            )


def whole_chart_words(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield commands and status words that are not whole words of 16 or 32 bits."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    for index, chart in enumerate(data.charts):
        at: TomlPath = ("charts", index)
        codes = [(chart.status, (*at, "status")), (chart.command, (*at, "command"))]
        codes += [
            (order.parameter, (*at, "orders", place)) for place, order in enumerate(chart.orders)
        ]
        for code, place in codes:
            found = parameters.get(code or "")
            if found is None:
                continue
            if not found.type.startswith("uint") and found.type != "int16":
                yield place, f"chart {chart.id}: {found.code} is {found.type}. Use uint32."
            elif found.shift or found.mask != 0xFFFF:
                yield (
                    place,
                    f"chart {chart.id}: {found.code} is a part of a register. A command word or a"
                    " status word is a whole register.",
                )


def chart_words_in_reach(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield status words that cannot be read, and command words that cannot be written.

    The word of a stop must be writable while the motor turns.
    """
    access = {parameter.code: parameter.access for parameter in data.parameters}
    for index, chart in enumerate(data.charts):
        at: TomlPath = ("charts", index)
        if access.get(chart.status) == "w":
            yield (
                (*at, "status"),
                f"chart {chart.id}: {chart.status} has access w. A status word must be readable:"
                " access r or rw.",
            )
        places = [(chart.command, (*at, "command"))]
        places += [
            (order.parameter, (*at, "orders", place)) for place, order in enumerate(chart.orders)
        ]
        for code, path in places:
            if access.get(code) == "r":
                yield (
                    path,
                    f"chart {chart.id}: {code} has access r. A command word must be writable:"
                    " access rw or w.",
                )
        for place, order in enumerate(chart.orders):
            code = order.parameter or chart.command
            if order.id in SURE_STOPS and access.get(code) == "rw-stopped":
                yield (
                    (*at, "orders", place),
                    f"order {order.id}: {code} can be written only with the motor stopped (access"
                    " rw-stopped). The word of a stop must have access rw or w.",
                )


def running(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield charts whose run command reaches no state of the kind running."""
    for index, chart in enumerate(data.charts):
        if not _runs(chart):
            continue
        kinds = {state.kind for state in chart.states}
        if "running" not in kinds:
            yield (
                ("charts", index, "states"),
                f"chart {chart.id}: it can run a motor but has no state of the kind running.",
            )
        if chart.runs_in is not None:
            for state in chart.states:
                if state.kind in NOT_TURNING and not _leads(chart, state.id, chart.runs_in):
                    yield (
                        ("charts", index, "runs_in"),
                        f"chart {chart.id}: no command leads from {state.id} to {chart.runs_in}."
                        " Add a transition with a command.",
                    )
    for index, chart in enumerate(data.charts):
        led_to = {step.target for step in chart.transitions}
        for place, state in enumerate(chart.states):
            if chart.transitions and state.kind == "running" and state.id not in led_to:
                yield (
                    ("charts", index, "states", place),
                    f"chart {chart.id}: no transition leads to the running state {state.id}.",
                )


def faults_seen(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield charts that cannot show a tripped drive."""
    if data.faults.parameter:
        return
    for index, chart in enumerate(data.charts):
        kinds = {state.kind for state in chart.states}
        if kinds != {"unknown"} and "fault" not in kinds:
            yield (
                ("charts", index, "states"),
                f"chart {chart.id}: a drive in fault would look healthy. Add a state of the kind"
                " fault, or faults.parameter with the word that holds the fault.",
            )


def conditions(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield charts without a condition, except one."""
    without = [n for n, chart in enumerate(data.charts) if chart.when is None]
    for index in without[1:]:
        yield (
            ("charts", index, "id"),
            f"chart {data.charts[index].id}: it is never used, because"
            f" {data.charts[without[0]].id} above it has no condition either. Add when.",
        )


def _runs(chart: Chart) -> bool:
    return any(order.id in RUN_ORDERS for order in chart.orders)


def _leads(chart: Chart, source: str, goal: str) -> bool:
    reached, left = {source}, [source]
    while left:
        at = left.pop()
        for step in chart.transitions:
            by_command = step.command is not None and step.edge_bit is None
            if step.source == at and by_command and step.target not in reached:
                reached.add(step.target)
                left.append(step.target)
    return goal in reached


CHART_RULES = (
    names_of_states,
    whole_chart_words,
    chart_words_in_reach,
    states,
    stops_always,
    running,
    faults_seen,
    conditions,
)
