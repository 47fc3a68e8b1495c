"""The state, the source of commands and the stop words of a small chart, word by word."""

from __future__ import annotations

from decimal import Decimal
from types import SimpleNamespace
from typing import Any, cast

import msgspec
import pytest

from tui.drive.channel import UNKNOWN_CHANNEL, Channel, command_channel
from tui.drive.chart import (
    UNKNOWN,
    UNLISTED_FAULT,
    fault_code,
    fault_number,
    read_chart,
    state_codes,
    state_now,
    watched_codes,
)
from tui.drive.orders import order_target, stop_alike, with_options
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import (
    ChannelBits,
    ChannelRow,
    Chart,
    DirectionBit,
    FullScale,
    Parameter,
    State,
    StatusBit,
    When,
)

READY = State(id="ready", name="Ready", kind="ready", mask=3, value=1)
RUNNING = State(id="running", name="Running", kind="running", mask=3, value=2)
FAULT = State(id="fault", name="Fault", kind="fault", mask=3, value=3)
NUMBERS: Any = {3: "CAn"}


def chart_of(*states: State, **more: Any) -> Chart:
    plain: dict[str, Any] = {
        "direction": DirectionBit(parameter="dir", bit=2),
        "reached": StatusBit(parameter="status", bit=4),
        "alarm": StatusBit(parameter="status", bit=5, value=0),
        "local": StatusBit(parameter="local", bit=0),
        "channel": ChannelBits(parameter="from", shift=4, mask=3, names={"2": "CANopen"}),
    }
    return Chart(
        id="small", name="Small", status="status", command="command",
        states=list(states or (READY, RUNNING, FAULT)), orders=[], **{**plain, **more},
    )  # fmt: skip


def profile_of(
    *charts: Chart, faults: tuple[str, int, bool] = ("fault", 0, False), **rows: Any
) -> Any:
    """A profile with these charts, its fault word with the value for none, and channel rows."""
    parameter, none, shows_last = faults

    class Small:
        data = SimpleNamespace(
            charts=charts,
            faults=SimpleNamespace(parameter=parameter, none=none, shows_last=shows_last),
            channels=SimpleNamespace(command=rows.get("command", []), reference=[]),
        )

        def chart(self, raws: object) -> Chart | None:
            return charts[0] if charts else None

        def __getitem__(self, code: str) -> Any:
            return SimpleNamespace(code=code, bits=rows.get("bits", ()))

        def names(self, parameter: object) -> Any:
            return NUMBERS

    return Small()


def test_state_is_read_with_its_marks() -> None:
    profile = profile_of(chart_of())
    found = read_chart(profile, {"status": 0b10010, "dir": 4, "local": 1, "from": 0x20})
    assert (found.state, found.own, found.kind) == (RUNNING, RUNNING, "running")
    assert (found.direction, found.reached, found.alarm) == ("reverse", True, True)
    assert (found.local, found.channel, found.reference) == (True, "CANopen", "")
    found = read_chart(profile, {"status": 0b100001, "dir": 8, "local": 2, "from": 0x10})
    assert (found.direction, found.reached, found.alarm, found.local, found.channel) == (
        "forward", False, False, False, "",
    )  # fmt: skip
    found = read_chart(profile, {"status": 2})
    assert (found.direction, found.local, found.channel) == (None, None, "")
    found = read_chart(profile_of(chart_of(direction=None, reached=None)), {"status": 2, "dir": 4})
    assert (found.direction, found.reached) == (None, None)


@pytest.mark.parametrize(
    ("status", "fault", "state", "motion"),
    [
        (1, 0, READY, "ready"), (1, 5, FAULT, "fault"), (2, 5, FAULT, "running"),
        (3, 0, FAULT, "fault"), (3, 5, FAULT, "fault"), (0, 0, UNKNOWN, "unknown"),
        (0, 5, FAULT, "fault"), (None, 0, UNKNOWN, "unknown"),
        (None, 5, UNLISTED_FAULT, "fault"), (1, None, READY, "ready"),
    ],
)  # fmt: skip
def test_fault_word_is_stronger_than_the_status_word(
    status: int | None, fault: int | None, state: State, motion: str
) -> None:
    raws = {code: raw for code, raw in (("status", status), ("fault", fault)) if raw is not None}
    found = read_chart(profile_of(chart_of()), raws)
    assert (found.state, found.motion) == (state, motion)


def test_state_of_a_profile_without_a_chart_is_that_of_its_fault_word() -> None:
    profile = profile_of()
    assert read_chart(profile, {"status": 1, "fault": 5}).state is UNLISTED_FAULT
    assert read_chart(profile, {"status": 1, "fault": 0}).state is UNKNOWN
    other = msgspec.structs.replace(FAULT, id="other", mask=7, value=7)
    found = read_chart(profile_of(chart_of(FAULT, other)), {"status": 7, "fault": 5})
    assert found.state is FAULT
    found = read_chart(
        profile_of(chart_of(msgspec.structs.replace(FAULT, mask=7), other)),
        {"status": 7, "fault": 5},
    )
    assert found.state is other, "the status word itself shows a fault"
    chart = chart_of(READY)
    assert state_now(profile, chart, {"status": 1, "fault": 5}) is UNLISTED_FAULT
    assert state_now(profile, chart, {"fault": 0}) is UNKNOWN


@pytest.mark.parametrize(
    ("faults", "raw", "number", "code"),
    [
        (("fault", 0, False), 5, 5, "fault"), (("fault", 0, False), 0, None, "fault"),
        (("fault", 7, False), 0, 0, "fault"), (("fault", 0, True), 5, None, ""),
    ],
)  # fmt: skip
def test_fault_word_shows_a_present_fault_or_the_last_one(
    faults: tuple[str, int, bool], raw: int, number: int | None, code: str
) -> None:
    profile = profile_of(chart_of(), faults=faults)
    assert fault_number(profile, {"fault": raw}) == number
    assert fault_code(profile) == code
    assert state_codes(profile, chart_of()) == ["status", *([code] if code else [])]
    watched = ["status", "dir", "local", "from", *([code] if code else [])]
    assert watched_codes(profile) == watched
    assert watched_codes(profile_of(faults=faults)) == []


def test_state_needs_its_other_words_too() -> None:
    """Without one of them the state is unknown."""
    local = msgspec.structs.replace(READY, id="local", also=[When(parameter="local", values=[1])])
    chart = chart_of(local, RUNNING, FAULT)
    for raws, state in (({"local": 1}, local), ({"local": 0}, UNKNOWN), ({}, UNKNOWN)):
        assert read_chart(profile_of(chart), {"status": 1, **raws}).own is state


def test_chart_is_that_whose_condition_holds_else_the_first_without_one() -> None:
    local, remote = (chart_of(when=When(parameter="local", values=[value])) for value in (1, 2))
    plain, other = chart_of(), chart_of()

    def chart(raw: int, *charts: Chart) -> Chart | None:
        profile = cast(Any, SimpleNamespace(data=SimpleNamespace(charts=charts)))
        return Profile.chart(profile, {"local": raw})

    assert chart(2, plain, local, remote) is remote
    assert chart(0, local, plain, other) is plain
    assert chart(0, local, remote) is local
    assert chart(0) is None


def test_full_scale_gives_the_value_of_a_count() -> None:
    full = FullScale(counts=16384, parameter="3-03")
    parameter = cast(Any, SimpleNamespace(full_scale=full, scale_by=None, scale="1"))
    profile = cast(Any, {"3-03": SimpleNamespace(scale="0.001")})
    assert Profile.scale(profile, parameter, {"3-03": 50000}) == Decimal(50) / 16384
    assert Profile.scale(profile, parameter, {"3-03": 0}) is None
    assert Profile.scale(profile, parameter, {}) is None
    assert cast(Any, Parameter.scale_source).fget(parameter) == "3-03"


# -- source of commands ----------------------------------------------------------------------------


def row(parameter: str, **more: Any) -> Any:
    plain = {"when": [], "mask": 0xFFFF, "shift": 0, "line": [3], "names": {}}
    return cast(ChannelRow, SimpleNamespace(parameter=parameter, **{**plain, **more}))


BITS = (SimpleNamespace(name="fieldbus", bit=0), SimpleNamespace(name="keypad", bit=1))
IF_SWITCHED = [When(parameter="switch", values=[1])]


@pytest.mark.parametrize(
    ("rows", "raws", "text", "by_line", "code", "is_several"),
    [
        ([row("Cd1")], {"Cd1": 3}, "CAn", True, "Cd1", False),
        ([row("Cd1")], {"Cd1": 4}, "Cd1 = 4", False, "Cd1", False),
        ([row("Cd1", names={"4": "Keypad"})], {"Cd1": 4}, "Keypad", False, "Cd1", False),
        ([row("Cd1", mask=0xF0, shift=4)], {"Cd1": 0x3F}, "CAn", True, "Cd1", False),
        ([row("Cd1")], {}, "", None, "Cd1", False),
        ([row("Cd2", when=IF_SWITCHED), row("Cd1")], {"Cd1": 3}, "", None, "switch", True),
        ([row("Cd2", when=IF_SWITCHED), row("Cd1")], {"switch": 0, "Cd1": 3}, "CAn", True, "Cd1",
         True),
        ([row("Cd2", when=IF_SWITCHED), row("Cd1")], {"switch": 1, "Cd2": 4}, "Cd2 = 4", False,
         "Cd2", True),
    ],
)  # fmt: skip
def test_first_row_that_applies_shows_the_source_of_commands(
    rows: Any, raws: dict[str, int], text: str, by_line: bool | None, code: str, is_several: bool
) -> None:
    found = command_channel(profile_of(command=rows), raws)
    assert isinstance(found, Channel)
    assert (found.text, found.by_line, found.is_several) == (text, by_line, is_several)
    assert found.parameter is not None
    assert found.parameter.code == code


def test_bits_name_the_source_of_commands_or_of_the_reference() -> None:
    for raw, text in ((3, "fieldbus, keypad"), (2, "keypad"), (0, "none")):
        profile = profile_of(chart_of(), command=[row("Cd1")], bits=BITS)
        found = command_channel(profile, {"Cd1": raw})
        assert found is not None
        assert found.text == text
        profile.data.channels.reference = [row("Fr1")]
        assert read_chart(profile, {"status": 2, "Fr1": raw}).reference == text


def test_source_without_a_row_is_unknown() -> None:
    rows = [row("Cd2", when=IF_SWITCHED)]
    assert command_channel(profile_of(command=rows), {"switch": 0}) is UNKNOWN_CHANNEL
    assert command_channel(profile_of(), {}) is None


# -- stop words ------------------------------------------------------------------------------------


def test_families_are_stopped_alike_if_all_have_the_same_words() -> None:
    atv312, atv31, atv71 = (library.load(id) for id in ("atv312", "atv31", "atv71"))
    assert stop_alike([atv312])
    assert stop_alike([atv312, atv312])
    assert not stop_alike([])
    assert not stop_alike([atv312, atv71])
    assert not stop_alike([atv312, atv312, atv71])
    assert stop_alike([atv31, atv312]) == stop_alike([atv312, atv31])


def test_word_keeps_its_option_bits_and_zero_stays_zero() -> None:
    option = SimpleNamespace(parameter="command", mask=0x0810)
    chart = cast(Chart, SimpleNamespace(command="command", options=[option]))
    order = cast(Any, SimpleNamespace(parameter="", words=(7, 0, -1)))
    assert with_options(chart, order, {"command": 0x0F11}) == [0x0817, 0, 0xFFFF]
    assert with_options(chart, order, {}) == [7, 0, 0xFFFF]
    option.mask = 0x0801
    assert with_options(chart, cast(Any, SimpleNamespace(parameter="", words=(6,))), {}) == [6]
    option.mask = 0x0810
    order.parameter = "another"
    assert with_options(chart, order, {"command": 0xFFFF, "another": 0xFFFF}) == [7, 0, 0xFFFF]


def test_words_of_a_command_go_to_its_own_register_or_that_of_the_chart() -> None:
    profile, chart = library.load("atv312"), library.load("atv312").data.charts[0]
    order = chart.orders[0]
    assert order_target(profile, chart, order).code == chart.command
    own = msgspec.structs.replace(order, parameter="LFr")
    assert order_target(profile, chart, own).code == "LFr"
