"""Rules for commands: no stop starts a motor, and each command has an effect that can be seen."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product

from tui.drive.values import raw_range
from tui.drive.words import type_bits, unsigned

from ..schema import Chart, Order, Parameter, ProfileData, State
from ..toml_lines import TomlPath
from .charts import RUN_ORDERS, SURE_STOPS

ALL_STOPS = (*SURE_STOPS, "emergency-stop", "dc-braking")
_REST_KINDS = ("ready", "stopped", "blocked")


def stop_among_commands(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield charts with commands, none of which is a stop, although none is a run command."""
    for index, chart in enumerate(data.charts):
        ids = {order.id for order in chart.orders}
        commands = ids or {step.command for step in chart.transitions} - {None}
        if commands and not ids & (RUN_ORDERS | set(SURE_STOPS)):
            yield (
                ("charts", index, "orders"),
                f"chart {chart.id}: there is no stop among its commands. Add an order with the id"
                f" {', '.join(SURE_STOPS)}.",
            )


def starts_by_mistake(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield stops and resets whose words run the motor, and run commands that all drives take."""
    by_sign = any(way.reverse == "negative" for way in data.references)
    for index, chart in enumerate(data.charts):
        runs = [order for order in chart.orders if order.id in RUN_ORDERS and order.words]
        for place, order in enumerate(chart.orders):
            at: TomlPath = ("charts", index, "orders", place)
            if order.id in RUN_ORDERS:
                # the sign of the reference may give the direction instead of the words
                before = [] if by_sign else runs
                yield from ((at, fault) for fault in _run_faults(chart, order, before))
            for run in runs if order.id in ALL_STOPS or order.id == "reset" else ():
                if any(_same(chart, order, word, run) for word in order.words):
                    yield (
                        at,
                        f"order {order.id}: its word {run.words[-1]:#06x} is also that of"
                        f" {run.id}, so it would run the motor.",
                    )
                    break
            else:
                if fault := _starts_besides(chart, order, runs):
                    yield at, f"order {order.id}: {fault}"
        for place, lock in enumerate(chart.interlocks):
            if stops := [stop for stop in (*SURE_STOPS, "emergency-stop") if stop in lock.orders]:
                yield (
                    ("charts", index, "interlocks", place),
                    f"chart {chart.id}: an interlock prevents {', '.join(stops)}. A stop has no"
                    " conditions.",
                )


OTHER_BIT = "If another bit of it stops the motor, add the transition out of running."


def _starts_besides(chart: Chart, order: Order, runs: list[Order]) -> str:
    """Return why a command other than a start would start the motor; empty if it would not.

    The start bits are those in which a run command differs from the stop of the same register.
    On some drives, another bit of such a word stops the motor. A stop may contain them if a
    transition with it leads out of a running state, or if it is followed by the stop of all states.
    """
    if order.id in (*RUN_ORDERS, "dc-braking"):
        return ""
    states = {state.id: state for state in chart.states}
    stopping = {
        unsigned(step.command)
        for step in chart.transitions
        if step.command is not None
        and _is(states, step.source, "running")
        and not _is(states, step.target, "running")
    }
    stops = [stop for stop in chart.orders if stop.id == "stop"] or [
        stop for stop in chart.orders if stop.id in SURE_STOPS
    ]
    for run, stop in product(runs, stops):
        code = run.parameter or chart.command
        registers = {way.parameter or chart.command for way in (order, stop)}
        if registers != {code} or not stop.words or stop.when not in ([], run.when):
            continue
        last, kept = unsigned(run.words[-1]), _option_bits(chart, code)
        start = (last ^ unsigned(stop.words[-1])) & ~kept
        for word in map(unsigned, order.words):
            is_stop = order.id in (*SURE_STOPS, "emergency-stop")
            declared = is_stop and (word in stopping or bool(order.states))
            if start & last and not (word ^ last) & start and not declared:
                text = (
                    f"its word {word:#06x} contains the start bits {start:#06x}, in which"
                    f" {run.id} differs from {stop.id}, so it would run the motor."
                )
                return f"{text} {OTHER_BIT}" if is_stop else text
    return ""


def _option_bits(chart: Chart, code: str) -> int:
    """Return the bits of a command word that options keep."""
    kept = 0
    for option in chart.options:
        kept |= option.mask if option.parameter == code else 0
    return kept


def _run_faults(chart: Chart, order: Order, runs: list[Order]) -> Iterator[str]:
    if order.broadcast:
        yield f"order {order.id}: a run command must not be a broadcast to all drives."
    for other in runs[: runs.index(order)] if order in runs else ():
        same = other.id != order.id and other.when == order.when and order.words == other.words
        if same and (order.parameter or chart.command) == (other.parameter or chart.command):
            yield (
                f"order {order.id}: its words are also those of {other.id}. If the sign of the"
                ' reference gives the direction, write reverse = "negative" in [[references]].'
            )


def _same(chart: Chart, order: Order, word: int, run: Order) -> bool:
    """Return True if a word is the last one of a run command, apart from the bits of options."""
    code = run.parameter or chart.command
    if (order.parameter or chart.command) != code:
        return False
    kept = _option_bits(chart, code)
    return not (unsigned(word) ^ unsigned(run.words[-1])) & ~kept


def commands_without_effect(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield commands that lead nowhere: no state allows them, or no transition follows them."""
    for index, chart in enumerate(data.charts):
        kinds = {state.id: state.kind for state in chart.states}
        for place, order in enumerate(chart.orders):
            if fault := _leads_nowhere(chart, order, kinds):
                yield ("charts", index, "orders", place), f"order {order.id}: {fault}"
        left = {step.source for step in chart.transitions}
        for place, step in enumerate(chart.transitions):
            at: TomlPath = ("charts", index, "transitions", place)
            if step.command is not None and step.source == step.target:
                yield at, f"chart {chart.id}: the command leads from {step.source} to itself."
            elif step.target not in left and kinds.get(step.target) not in (None, "unknown"):
                yield at, f"chart {chart.id}: no transition leads out of {step.target}."


def _leads_nowhere(chart: Chart, order: Order, kinds: Mapping[str, str]) -> str:
    """Return why a command has no effect; empty if it can have one."""
    allowed = {kinds.get(state) for state in order.states}
    if order.id in RUN_ORDERS:
        rest = chart.runs_in in order.states if chart.runs_in else bool(allowed & {*_REST_KINDS})
        if order.states and not rest:
            return "it leads nowhere: none of its states is one of a motor at standstill."
    if (
        order.id == "reset"
        and order.states
        and "fault" in kinds.values()
        and "fault" not in allowed
    ):
        return "it leads nowhere: none of its states is a fault."
    if order.id in ALL_STOPS and order.states and "fault" in allowed and len(allowed) == 1:
        return "it leads nowhere: it is allowed in a fault only."
    return _without_transition(chart, order)


def _without_transition(chart: Chart, order: Order) -> str:
    """Return why no transition follows the commands of this kind; empty if one does.

    Charts without transitions by command are not judged.
    """
    steps = [step for step in chart.transitions if step.command is not None]
    states = {state.id: state for state in chart.states}
    words = [word for other in _alike(chart, order) for word in other.words]
    if order.id in RUN_ORDERS:
        into = [s for s in steps if _is(states, s.target, "running")]
        if into and not any(s.command and w & s.command == s.command for s in into for w in words):
            return "it leads nowhere: no transition to a running state has its word."
    elif order.id in SURE_STOPS:
        out = [s for s in steps if _is(states, s.source, "running")]
        out = [s for s in out if not _is(states, s.target, "running")]
        if out and not any(s.command == word for s in out for word in words):
            return "it leads nowhere: no transition out of a running state has its word."
    elif order.id == "reset":
        out = [s for s in steps if _is(states, s.source, "fault")]
        if out and not any(
            w == s.command or (s.edge_bit is not None and w >> s.edge_bit & 1)
            for s in out
            for w in words
        ):
            return "it leads nowhere: no transition out of a fault has one of its words."
    return ""


def _alike(chart: Chart, order: Order) -> list[Order]:
    """Return the commands that count as one: all run commands, or those of the same id."""
    ids = RUN_ORDERS if order.id in RUN_ORDERS else {order.id}
    return [other for other in chart.orders if other.id in ids]


def _is(states: dict[str, State], id: str, kind: str) -> bool:
    return id in states and states[id].kind == kind


def words_that_can_be_written(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield commands whose parameter is never written, or does not take their words."""
    parameters = {parameter.code: parameter for parameter in data.parameters}
    for index, chart in enumerate(data.charts):
        at: TomlPath = ("charts", index)
        rows = [
            ((*at, "orders", place), f"order {order.id}", order.parameter, order.words)
            for place, order in enumerate(chart.orders)
        ]
        rows += [
            ((*at, "transitions", place), f"chart {chart.id}", "", [step.command])
            for place, step in enumerate(chart.transitions)
            if step.command is not None
        ]
        rows += [
            ((*at, "options", place), f"option {option.id}", option.parameter, [option.mask])
            for place, option in enumerate(chart.options)
        ]
        for path, name, code, words in rows:
            parameter = parameters.get(code or chart.command)
            if parameter is not None and (fault := _refuses(parameter, words)):
                yield path, f"{name}: {fault}"


def _refuses(parameter: Parameter, words: list[int]) -> str:
    if parameter.forbidden:
        return f"{parameter.code} is never written: {parameter.forbidden}"
    low, high = raw_range(parameter)
    reserved = sum(1 << bit for bit in set(parameter.reserved))
    for word in words:
        if word > type_bits(parameter):
            return f"{word:#x} has more bits than {parameter.code} of type {parameter.type}."
        if word < 0 and parameter.type.endswith("32"):
            return f"{word} is negative. Write the 32 bits of {parameter.code} in hexadecimal."
        wire = word if low < 0 else unsigned(word)
        if not low <= wire <= high and not low <= wire - 0x10000 <= high:
            return f"{word:#06x} cannot be written to {parameter.code}: {low} to {high}."
        if wire & reserved:
            return f"{word:#06x} cannot be written to {parameter.code}: a bit of it is reserved."
    return ""


COMMAND_RULES = (
    stop_among_commands,
    starts_by_mistake,
    commands_without_effect,
    words_that_can_be_written,
)
