"""Conditions that block a command, by the interlocks of each family that has some."""

from __future__ import annotations

from collections.abc import Iterator

import msgspec
import pytest

from tui.drive.command_blocked import blocked_reason
from tui.drive.orders import (
    MOVING_ORDERS,
    STOP_ORDERS,
    OrderRefused,
    choose,
    follows_from,
    interlock_codes,
    last_word,
    locked_by,
    nearest_stop,
    optional_bits,
    stop_conditions,
    unmet,
    walk,
    with_options,
)
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Chart, Interlock, Order, OrderId

LOCKED = ["atv21", "atv31", "atv312", "atv71"]
"""Families with interlocks."""


def interlocks(family: str) -> Iterator[tuple[Chart, Interlock]]:
    for chart in library.load(family).data.charts:
        for lock in chart.interlocks:
            yield chart, lock


def refusal(profile: Profile, chart: Chart, id: OrderId, raws: dict[str, int]) -> str:
    held = blocked_reason(profile, chart, id, raws)
    return held.text if held is not None else ""


def words_of(chart: Chart, lock: Interlock) -> dict[str, int]:
    """Words under which no interlock but this one could hold a command back, and it decides."""
    raws = {
        interlock.parameter: interlock.values[0]
        for interlock in chart.interlocks
        if not interlock.when
    }
    raws |= {
        interlock.parameter: raws.get(interlock.parameter, 0) | interlock.values[0]
        for interlock in chart.interlocks
    }
    return raws | {when.parameter: when.values[0] for when in lock.when}


@pytest.mark.parametrize("family", LOCKED)
def test_unread_word_blocks_every_moving_command(family: str) -> None:
    for chart, lock in interlocks(family):
        raws = {c: raw for c, raw in words_of(chart, lock).items() if c != lock.parameter}
        for id in lock.orders or MOVING_ORDERS:
            assert "was not read, and may block this" in refusal(
                library.load(family), chart, id, raws
            ), (
                id,
                lock.parameter,
            )


@pytest.mark.parametrize("family", LOCKED)
def test_no_interlock_blocks_a_stop(family: str) -> None:
    for chart, lock in interlocks(family):
        for id in STOP_ORDERS:
            assert refusal(library.load(family), chart, id, {}) == "", (id, lock.parameter)


@pytest.mark.parametrize("family", LOCKED)
def test_wrong_value_blocks_a_command_with_advice(family: str) -> None:
    for chart, lock in interlocks(family):
        raws = words_of(chart, lock)
        wrong = next(bit for bit in (1 << n for n in range(16)) if lock.mask & bit)
        raws[lock.parameter] = raws[lock.parameter] ^ wrong
        if raws[lock.parameter] & lock.mask in lock.values:
            continue
        for id in lock.orders or MOVING_ORDERS:
            assert refusal(library.load(family), chart, id, raws), (id, lock.parameter)


# -- a chart of its own ----------------------------------------------------------------------------


def made(id: OrderId, *words: int, name: str = "", **more: object) -> Order:
    return msgspec.convert({"id": id, "name": name or id, "words": list(words), **more}, Order)


def chart_of(*orders: Order, **more: object) -> Chart:
    states = [
        {"id": "off", "name": "Off", "kind": "stopped", "mask": 0xF, "value": 0},
        {"id": "ready", "name": "Ready", "kind": "ready", "mask": 0xF, "value": 1},
        {"id": "runs", "name": "Running", "kind": "running", "mask": 0xF, "value": 2},
        {"id": "trip", "name": "Fault", "kind": "fault", "mask": 0xF, "value": 8},
    ]
    table = {"id": "main", "name": "main chart", "status": "ST", "command": "CW", "states": states}
    return msgspec.structs.replace(msgspec.convert({**table, **more}, Chart), orders=list(orders))


ON = {"parameter": "X", "values": [1, 2]}
OPTIONS = [
    {"parameter": "CW", "id": "a", "name": "a", "mask": 0x0300, "choices": []},
    {"parameter": "CW", "id": "b", "name": "b", "mask": 0x1000, "choices": []},
    {"parameter": "XW", "id": "c", "name": "c", "mask": 0x0008, "choices": []},
]


def test_command_is_the_first_one_whose_state_and_conditions_hold() -> None:
    in_state, with_word, always = (
        made("stop", 1, states=["runs"]), made("stop", 2, when=[ON]), made("stop", 3)
    )  # fmt: skip
    chart = chart_of(made("forward", 9), in_state, with_word, always)
    assert choose(chart, "stop", {"ST": 2, "X": 1}) is in_state
    assert choose(chart, "stop", {"ST": 1, "X": 1}) is with_word
    assert choose(chart, "stop", {"X": 3}) is always
    assert choose(chart, "stop", {}) is always
    assert choose(chart, "stop", {"ST": 2}, chart.states[0]) is always, "the given state counts"


def test_command_that_is_not_possible_says_what_it_requires() -> None:
    chart = chart_of(
        made("forward", 9, name="Run", states=["ready", "runs"]),
        made("forward", 8, name="Run", states=["runs"]),
        made("reverse", 7, name="Run back", when=[ON, {"parameter": "Y", "values": [5]}]),
        made("reverse", 6, name="Run back", when=[{"parameter": "Z", "values": [4]}]),
    )
    for raws, state in (({"ST": 8}, "Fault"), ({}, "unknown")):
        with pytest.raises(OrderRefused) as caught:
            choose(chart, "forward", raws)
        assert str(caught.value) == (
            f"Run is possible only in these states: Ready, Running. The present state is {state}."
        )
    with pytest.raises(OrderRefused) as caught:
        choose(chart, "reverse", {"X": 1})
    assert str(caught.value) == "Run back requires X = 1 or 2 and Y = 5 or Z = 4."
    with pytest.raises(OrderRefused) as caught:
        choose(chart, "quick-stop", {})
    assert str(caught.value) == "The main chart has no command 'quick stop'."


def test_stop_that_ramps_in_a_state_ends_with_the_word_for_every_state() -> None:
    ramp, end, other = made("stop", 1, states=["runs"]), made("stop", 0), made("freewheel", 5)
    conditional = made("stop", 2, when=[ON])
    chart = chart_of(other, ramp, conditional, end)
    assert last_word(chart, ramp) is end
    assert last_word(chart, end) is None
    assert last_word(chart_of(other, ramp, conditional), ramp) is None


def test_stop_is_chosen_by_its_conditions_and_by_the_state_if_it_has_some() -> None:
    chart = chart_of(
        made("stop", 1, when=[ON]),
        made("stop", 2, when=[ON]),
        made("freewheel", 3, states=["runs"]),
    )
    assert stop_conditions(chart, "stop") == ["X"]
    assert stop_conditions(chart, "freewheel") == ["ST"]
    assert stop_conditions(chart, "quick-stop") == []


def test_command_keeps_option_bits_of_its_own_word_and_zero_stays_zero() -> None:
    chart = chart_of(options=OPTIONS)
    assert optional_bits(chart, "CW") == 0x1300
    assert optional_bits(chart, "XW") == 0x0008
    assert optional_bits(chart, "YW") == 0
    raws = {"CW": 0xFFFF, "XW": 0xFFFF}
    assert with_options(chart, made("forward", 6, 0, 15), raws) == [0x1306, 0, 0x130F]
    assert with_options(chart, made("forward", 6, parameter="XW"), raws) == [0x000E]
    assert with_options(chart, made("forward", -1), {}) == [0xFFFF]
    assert with_options(chart, made("forward", 6), {"CW": 0x0200}) == [0x0206]


def test_missing_way_to_stop_is_replaced_by_a_slower_one() -> None:
    stop, quick = made("stop", 1), made("quick-stop", 2)
    assert nearest_stop(chart_of(stop, quick), "emergency-stop") == "quick-stop"
    assert nearest_stop(chart_of(stop), "emergency-stop") == "stop"
    assert nearest_stop(chart_of(stop), "quick-stop") == "stop"
    assert nearest_stop(chart_of(made("freewheel", 3)), "quick-stop") == "quick-stop"
    assert nearest_stop(chart_of(stop, quick), "freewheel") == "freewheel"


def test_interlock_blocks_what_it_names_unless_its_word_allows_it() -> None:
    plain = {"parameter": "P", "mask": 0x0F, "values": [1, 2], "text": "It is locked."}
    chart = chart_of(interlocks=[{**plain, "when": [ON]}])
    assert locked_by(chart, "forward", {"X": 1, "P": 0xF1}) is None
    assert locked_by(chart, "forward", {"X": 1, "P": 0x03}) is chart.interlocks[0]
    assert locked_by(chart, "forward", {"X": 1}) is chart.interlocks[0], "not known"
    assert locked_by(chart, "forward", {"P": 0x03}) is chart.interlocks[0], "it may apply"
    assert locked_by(chart, "forward", {"X": 3, "P": 0x03}) is None, "it does not apply"
    assert locked_by(chart, "reset", {"X": 1, "P": 0x03}) is None
    assert locked_by(chart, "stop", {"X": 1, "P": 0x03}) is None
    named = chart_of(interlocks=[{**plain, "orders": ["reset", "stop"]}])
    assert locked_by(named, "reset", {}) is named.interlocks[0]
    assert locked_by(named, "forward", {}) is None
    assert locked_by(named, "stop", {}) is None, "nothing blocks a stop"
    assert interlock_codes(chart_of(interlocks=[{**plain, "when": [ON]}, plain])) == ["P", "X"]


def test_local_control_blocks_a_start_and_no_stop() -> None:
    profile = library.load("v20")  # without words of a channel
    local = {"parameter": "S", "bit": 9, "value": 0}
    chart = chart_of(made("forward", 1), made("stop", 0), local=local)
    held = blocked_reason(profile, chart, "forward", {"S": 0})
    assert held is not None
    assert held.text == "The drive is in local control (S bit 9): it is not commanded by Modbus."
    assert held.by_channel
    assert blocked_reason(profile, chart, "forward", {"S": 0x200}) is None
    assert blocked_reason(profile, chart, "forward", {}) is not None, "not known"
    for id in (*STOP_ORDERS, "reset"):
        assert blocked_reason(profile, chart, id, {"S": 0}) is None
    assert interlock_codes(chart) == ["S"]


def test_unmet_condition_is_named_if_every_form_of_a_command_has_one() -> None:
    first, second = (
        made("forward", 1, when=[ON]),
        made("forward", 2, when=[{**ON, "parameter": "Y"}]),
    )
    chart = chart_of(made("reverse", 3), first, second)
    assert unmet(chart, "forward", {"X": 5, "Y": 5}) is first.when[0]
    assert unmet(chart, "forward", {"X": 5, "Y": 1}) is None
    assert unmet(chart, "forward", {"X": 5}) is None, "it may hold"
    assert unmet(chart, "reverse", {}) is None


def test_path_through_a_chart_takes_no_edge_and_is_the_shortest() -> None:
    steps = [
        ("off", "trip", 9, None),
        ("off", "ready", 6, None),
        ("off", "runs", 5, 3),
        ("ready", "off", 0, None),
        ("ready", "runs", 15, None),
        ("trip", "runs", None, None),
    ]
    chart = chart_of(transitions=[
        {"source": source, "target": target}
        | ({} if word is None else {"command": word}) | ({} if bit is None else {"edge_bit": bit})
        for source, target, word, bit in steps
    ])  # fmt: skip
    assert walk(chart, "off", "runs") == [("ready", 6), ("runs", 15)]
    assert walk(chart, "off", "off") == []
    with pytest.raises(OrderRefused) as caught:
        walk(chart, "trip", "runs")
    assert str(caught.value) == "No command leads from Fault to Running."


def test_consequences_of_a_command_are_named_once() -> None:
    chart = chart_of(
        made("freewheel", 1, follows="It coasts."), made("freewheel", 2, follows="It coasts."),
        made("freewheel", 3, follows="It locks."), made("stop", 4, follows="It ramps."),
        made("freewheel", 5),
    )  # fmt: skip
    assert follows_from(chart, "freewheel") == "It coasts. It locks."
    assert follows_from(chart, "forward") == ""
