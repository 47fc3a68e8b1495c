"""Words on Monitor: the state, why a command has no effect, the bits that are 1."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from tui.bus.api import DeviceCounters, LastMinute, LineCounters
from tui.drive.orders import MOVING_ORDERS
from tui.drive.profile import library
from tui.drive.profile.schema import Bit
from tui.screens.command.control import Control, hindrance
from tui.screens.monitor.assembly import NOTICE_ROWS, framed_state, notice_lines
from tui.screens.monitor.readouts import readout_lines
from tui.screens.monitor.run_keys import _after_esc
from tui.screens.monitor.run_line import RunLine, run_lines
from tui.screens.monitor.state import _timeout, countdown, state_lines
from tui.screens.monitor.view import View
from tui.screens.monitor.words import (
    WordPage,
    _bit_line,
    bit_grid,
    bit_lines,
    word_line,
    word_pages,
)
from tui.session.timeout_report import TimeoutWatch
from tui.widgets.palette import ALARM, FAINT, PLAIN, STALE

from . import fakes
from .test_monitor_pictures import AT_TERMINALS, AT_ZERO, NO_SUPPLY, SPEEDING_UP
from .test_places import PROFILES, view_of

ATV71 = library.load("atv71")
SLOWING = {**fakes.RUNNING, "FRH": 200, "ETA": 0x0237}
TURNING_ROUND = {**fakes.RUNNING, "FRH": -500, "ETA": 0x0237}


@pytest.mark.parametrize(
    ("raws", "armed", "says"),
    [
        (fakes.RUNNING, None, "at reference"),
        (SPEEDING_UP, None, "accelerating"),
        (SLOWING, None, "decelerating"),
        (TURNING_ROUND, None, "reversing"),
        (AT_ZERO, None, "enabled, at 0 Hz"),
        (fakes.READY, None, "press a, then r"),
        (fakes.READY, 50.0, "press r to run"),
        (AT_TERMINALS, 50.0, "not commanded"),
        (NO_SUPPLY, 50.0, "not ready"),
        (fakes.FAULT, None, " FAULT ObF "),
    ],
)
def test_state_is_described_in_words(raws: dict[str, int], armed: float | None, says: str) -> None:
    control = Control(armed_for=armed, hindrance=hindrance(ATV71, raws))
    view = replace(view_of(ATV71, raws), control=control, stands_by=True)
    assert state_lines(view, 22)[0].plain == says


def test_fault_has_its_time_and_names_the_key_for_advice() -> None:
    view = replace(view_of(ATV71, fakes.FAULT), fault_at="seen since 16:28:05")
    text = "\n".join(line.plain for line in state_lines(view, 22))
    assert "seen since 16:28:05" in text
    assert "press 5 for what to do" in text


def test_commander_and_reference_source_are_distinguished() -> None:
    view = view_of(ATV71, fakes.RUNNING)
    assert view.snapshot is not None
    state = replace(view.snapshot.state, channel="terminals", reference="keypad")
    reported = replace(view, snapshot=replace(view.snapshot, state=state))
    text = [line.plain.split() for line in state_lines(reported, 22)]
    assert ["Command", "terminals"] in text
    assert ["Reference", "keypad"] in text


def test_state_block_always_has_five_lines() -> None:
    for raws in (fakes.RUNNING, fakes.FAULT, NO_SUPPLY):
        for age in (0.1, 20.0):
            view = replace(view_of(ATV71, raws, age=age), watch=TimeoutWatch(10.0, None), heard=1.0)
            assert len(state_lines(view, 22)) == 5


@pytest.mark.parametrize(
    ("family", "raws", "way"),
    [
        ("atv71", AT_TERMINALS, "Press 6 for Control."),
        ("atv71", NO_SUPPLY, "Switch the mains on."),
        ("powerdrive", {"10.40": 3, "6.43": 0}, "Press t to take control."),
        ("atv31", {"LAC": 0}, "Press 6 for Control."),
    ],
)
def test_command_without_effect_names_next_step(
    family: str, raws: dict[str, int], way: str
) -> None:
    found = hindrance(library.load(family), raws)
    assert found is not None
    assert found.way == way


@pytest.mark.parametrize("eti", [0x0002, 0x4002])
def test_idle_altivar_312_set_up_for_modbus_is_commanded_by_modbus(eti: int) -> None:
    """True if its extended status word names the channel."""
    profile = library.load("atv312")
    raws = {"LAC": 2, "CHCF": 1, "Fr1": 164, "rFC": 96, "LRS3": 0, "ETA": 0x0240, "ETI": eti}
    view = view_of(profile, raws)
    text = [" ".join(line.plain.split()) for line in state_lines(view, 22)]
    assert "Command Modbus" in text
    assert "Reference Modbus" in text
    assert hindrance(profile, raws) is None


def test_ready_drive_has_no_hindrance() -> None:
    assert hindrance(ATV71, fakes.READY) is None
    assert hindrance(library.load("powerdrive"), {"10.40": 3, "6.43": 1}) is None


@pytest.mark.parametrize("family", PROFILES)
def test_reason_for_an_ineffective_command_is_never_cut(family: str) -> None:
    profile = library.load(family)
    for chart in profile.data.charts:
        for lock in chart.interlocks:
            if "forward" not in (lock.orders or MOVING_ORDERS):
                continue
            wrong = next(raw for raw in range(0x10000) if raw & lock.mask not in lock.values)
            raws = {interlock.parameter: interlock.values[0] for interlock in chart.interlocks}
            raws |= {when.parameter: when.values[0] for when in lock.when}
            raws |= {chart.when.parameter: chart.when.values[0]} if chart.when else {}
            found = hindrance(profile, raws | {lock.parameter: wrong})
            assert found is not None
            control = Control(hindrance=found)
            view = replace(view_of(profile, {}), control=control)
            shown = " ".join(line.plain.strip() for line in notice_lines(view, 80))
            assert shown == f"No effect. {found.sentence}"
            assert len(notice_lines(view, 80)) <= NOTICE_ROWS
            line = RunLine("forward", "30", "Hz", 0.0, 0)
            reported = f"{found.text} {_after_esc(found.way)}".strip()
            lines = [row.plain for row in run_lines(line, profile, {}, 9.0, 80, reported)]
            assert reported in " ".join(" ".join(lines).split())


def test_word_line_omits_normal_bits() -> None:
    view = view_of(ATV71, {**fakes.RUNNING, "ETA": 0x0637})
    line = word_line(view, ATV71["ETA"], 79).plain
    assert line.split("16#0637")[1].strip() == (
        "● ready  ● switched on  ● enabled  ● power  ● at reference"
    )


@pytest.mark.parametrize(
    ("family", "code", "raw", "words"),
    [
        ("atv71", "ETA", 0x0217, "ready  ● switched on  ● enabled  ● power  ● quick stop active"),
        ("atv71", "ETA", 0x0227, "ready  ● switched on  ● enabled  ● no power"),
        ("atv71", "ETA", 0x0037, "ready  ● switched on  ● enabled  ● power  ● local"),
        ("atv71", "ETA", 0x0250, "power  ● switch on disabled"),
        ("atv312", "ETA", 0x0021, "ready  ● forced local"),
        (
            "atv312",
            "ETA",
            0x0207,
            "ready  ● switched on  ● enabled  ● quick stop active  ● no forced local",
        ),
        ("atv21", "FD01", 0x4000, "stop  ● standby"),
        ("powerdrive", "10.40", 0x0000, "not ready"),
    ],
)
def test_word_line_lists_bits_that_are_true_at_0(
    family: str, code: str, raw: int, words: str
) -> None:
    profile = library.load(family)
    line = word_line(view_of(profile, {code: raw}), profile[code], 100).plain
    assert line.split(f"16#{raw:04X}")[1].strip() == f"● {words}"


@pytest.mark.parametrize("family", PROFILES)
def test_word_line_lists_only_bits_lit_in_the_grid(family: str) -> None:
    profile = library.load(family)
    for word in (parameter for parameter in profile.data.parameters if parameter.bits):
        for raw in (0x0000, 0x0027, 0x0207, 0xFFFF):
            view = view_of(profile, {word.code: raw})
            listed = word_line(view, word, 2000).plain.count("● ")
            lit = sum("●" in _bit_line(bit, raw, 60).plain for bit in word.bits)
            assert listed <= lit, (word.code, raw)


def test_bit_in_columns_has_its_subject() -> None:
    """At 80 columns two bits of LRS7 read 'In force', without their channels."""
    view = view_of(ATV71, {**fakes.RUNNING, "LRS7": 0x0005})
    grid = bit_grid(view, word_pages([ATV71["LRS7"]], 15)[0], 79, 6)
    reported = "\n".join(line.plain for line in grid)
    assert "● Reference channel" in reported
    assert "● Command channel 1" in reported
    assert "In force" not in reported


@pytest.mark.parametrize("family", PROFILES)
@pytest.mark.parametrize("width", [29, 34])
def test_fault_whose_code_was_not_read_is_in_the_frame_of_the_state(
    family: str, width: int
) -> None:
    view = view_of(library.load(family), {})
    assert view.snapshot is not None
    state = replace(view.snapshot.state, kind="fault", fault=None)
    lines = framed_state(replace(view, snapshot=replace(view.snapshot, state=state)), width)
    assert "FAULT code not read" in lines[0].plain
    assert {line.cell_len for line in lines} == {width}


@pytest.mark.parametrize("code", ["ETA", "LRS6", "UNT"])
def test_name_of_a_bit_is_whole_while_a_column_is_empty(code: str) -> None:
    view = view_of(ATV71, {**fakes.RUNNING, code: 0})
    (page,) = word_pages([ATV71[code]], 33)
    grid = "\n".join(line.plain for line in bit_grid(view, page, 79, 12))
    missing = [bit.name for bit in page.bits if bit.name not in grid and bit.name[:12] in grid]
    assert missing == []


def test_answers_of_this_drive_in_the_last_minute_have_the_lower_edge() -> None:
    view = view_of(ATV71, fakes.RUNNING)
    line_minute = LastMinute(good=600, lost=3)
    for minute, text, style in (
        (LastMinute(good=119, lost=1), "119/120 in 60 s", PLAIN),
        (LastMinute(good=100, lost=5, damaged=15, silent=9), "100/129 in 60 s", ALARM),
        (LastMinute(), "-----", FAINT),
    ):
        counters = answers_of(view, minute, line_minute)
        for shown in (view, replace(view, snapshot=fakes.snapshot_of(ATV71, fakes.FAULT))):
            for width, label in ((25, "Answers"), (30, "Drive answers")):
                line = state_lines(replace(shown, counters=counters), width)[-1]
                assert line.plain == f"{label:<{width - len(text)}}{text}"
                assert line.spans[-1].style == style


def answers_of(view: View, drive: LastMinute, line: LastMinute) -> LineCounters:
    return replace(
        view.counters,
        timeouts=1,
        searched=17,
        minute=line,
        devices={view.device: DeviceCounters(minute=drive), 9: DeviceCounters(minute=line)},
    )


def test_silent_drive_has_no_answers_while_the_line_has() -> None:
    error = "Device 2 did not answer (function 3)."
    snapshot = fakes.snapshot_of(ATV71, fakes.RUNNING, age=14.0, error=error)
    view = replace(view_of(ATV71, fakes.RUNNING), snapshot=snapshot)
    counters = answers_of(view, LastMinute(silent=6), LastMinute(good=600))
    lines = state_lines(replace(view, counters=counters), 25)
    assert lines[0].plain == " NO ANSWER "
    assert lines[-1].plain == "Answers       0/6 in 60 s"
    assert lines[-1].spans[-1].style == ALARM


def test_age_of_the_last_poll_is_beside_an_active_timeout() -> None:
    view = replace(view_of(ATV71, fakes.RUNNING), watch=TimeoutWatch(10.0, None, active=True))
    for heard, text, narrow in (
        (0.4, "polled <1 s ago", "polled now"),
        (3.2, "polled 3 s ago", "6 s left"),
        (9.0, "polled 9 s ago", "1 s left"),
        (10.2, "polled 10 s ago", "expired"),
    ):
        for width, words in ((30, text), (25, narrow)):
            line = state_lines(replace(view, heard=fakes.NOW - heard), width)[3]
            assert line.plain.startswith("Timeout ")
            assert line.plain.endswith(f" 10 s, {words}")
            assert line.cell_len == width
            assert (line.spans[-1].style == STALE) == (heard >= 9.0)


def _drawn(bit: Bit, raw: int) -> tuple[str, bool]:
    """A bit as it is drawn: its words, and whether they are lit."""
    view = view_of(ATV71, {"ETA": raw})
    page = WordPage(ATV71["ETA"], (bit,), 1, 1)
    _, line = bit_lines(view, page, 60)
    lit, dim = "●" in line.plain, "·" in line.plain
    assert lit != dim
    words = line.plain.split("●" if lit else "·")[1].strip()
    return words, lit


@pytest.mark.parametrize(
    ("bit", "at_0", "at_1"),
    [
        (
            Bit(bit=11, name="Limit", off="within LSP..HSP", on="outside LSP..HSP"),
            ("Limit: within LSP..HSP", True),
            ("Limit: outside LSP..HSP", True),
        ),
        (
            Bit(bit=5, name="Quick stop", off="quick stop active", on="no quick stop"),
            ("Quick stop active", True),
            ("No quick stop", True),
        ),
        (
            Bit(bit=2, name="Quick stop", off="quick stop", on="no quick stop"),
            ("Quick stop", True),
            ("No quick stop", True),
        ),
        (
            Bit(bit=5, name="PID controller", off="Enabled", on="Off"),
            ("PID controller: Enabled", True),
            ("PID controller: Off", True),
        ),
        (Bit(bit=3, name="Fault", off="no", on="fault"), ("Fault", False), ("Fault", True)),
        (Bit(bit=3, name="Alarm", off="Normal", on="Alarm"), ("Alarm", False), ("Alarm", True)),
        (Bit(bit=3, name="Terminals"), ("Terminals", False), ("Terminals", True)),
    ],
)
def test_lit_bit_states_what_is_true(
    bit: Bit, at_0: tuple[str, bool], at_1: tuple[str, bool]
) -> None:
    assert _drawn(bit, 0) == at_0
    assert _drawn(bit, 1 << bit.bit) == at_1


@pytest.mark.parametrize("family", PROFILES)
def test_no_bit_of_a_family_is_dim_while_its_words_are_true(family: str) -> None:
    for parameter in library.load(family).data.parameters:
        for bit in parameter.bits:
            base = bit.counts.value if bit.counts else 0
            at_0, at_1 = _drawn(bit, base), _drawn(bit, base | 1 << bit.bit)
            assert at_1[1], (parameter.code, at_1)
            assert at_0[1] or at_0[0] == bit.name, (parameter.code, at_0)
            assert at_0 != at_1


@pytest.mark.parametrize(
    ("family", "raw", "lit"),
    [
        ("atv71", 0x0250, False),
        ("atv71", 0x0218, False),
        ("atv71", 0x0007, True),
        ("atv71", 0x0027, False),
        ("atv312", 0x0240, False),
        ("atv312", 0x0207, True),
    ],
)
def test_quick_stop_bit_is_lit_only_in_states_where_it_counts(
    family: str, raw: int, lit: bool
) -> None:
    """In Switch on disabled and Fault the state chart leaves bit 5 open: it is not a quick stop."""
    bit = next(item for item in library.load(family)["ETA"].bits if item.bit == 5)
    line = _bit_line(bit, raw, 40).plain
    assert ("● Quick stop active" in line) is lit
    assert lit or "active" not in line


TIMEOUT_RULES = ATV71.data.communication_fault
REACTIONS = {item.name: item for item in TIMEOUT_RULES.reactions} if TIMEOUT_RULES else {}


@pytest.mark.parametrize(
    ("reaction", "heard", "text"),
    [
        (None, 95.0, "reacts in 5 s: its own reaction"),
        (None, 80.0, "should have reacted"),
        ("DC injection", 95.0, "reacts in 5 s: DC injection"),
        ("Fast stop", 80.0, "should have reacted: fast stop"),
        ("Stop as in STT", 80.0, "should have reacted: stop as in STT"),
        ("Speed maintained", 80.0, "MAY STILL RUN: speed maintained"),
        ("Ignored", 80.0, "MAY STILL RUN: ignored"),
    ],
)
def test_reaction_of_an_unpolled_drive_is_counted_down_and_never_stated_as_a_fact(
    reaction: str | None, heard: float, text: str
) -> None:
    view = replace(
        view_of(ATV71, fakes.RUNNING, age=50.0),
        now=100.0,
        heard=heard,
        watch=TimeoutWatch(10.0, REACTIONS[reaction] if reaction else None),
        line=fakes.LOST,
    )
    assert countdown(view) == text
    assert countdown(replace(view, watch=None)) == ""
    rows = [line.plain for line in state_lines(view, 25)]
    assert not any("…" in row for row in rows), rows


@pytest.mark.parametrize(
    ("age", "text"),
    [
        (-1.0, "<1 s ago"),
        (0.99, "<1 s ago"),
        (1.0, "1 s ago"),
        (99.0, "99 s ago"),
        (100.0, "2m ago"),
        (5999.0, "100m ago"),
        (6000.0, "2h ago"),
    ],
)
def test_timeout_is_shown_with_the_age_of_the_last_answer(age: float, text: str) -> None:
    watch = TimeoutWatch(10.0, None)
    view = replace(view_of(ATV71, fakes.RUNNING), now=9000.0, heard=9000.0 - age, watch=watch)
    assert _timeout(view, 40)[0] == f"10 s, polled {text}"


def test_extremes_name_the_seconds_that_they_cover() -> None:
    view = view_of(ATV71, fakes.RUNNING)
    just_turned, full = view, replace(view, apart=19.0)
    just_opened = replace(full, trend=view.trend[-5:])
    for shown, covered in ((just_turned, "39 s"), (full, "58 s"), (just_opened, "4 s")):
        row = readout_lines(shown, 50)[3].plain
        assert re.findall(r"\d+ s", row) == [covered]


@pytest.mark.parametrize(("age", "late"), [(5.0, False), (5.1, True)])
def test_half_of_the_timeout_without_an_answer_is_marked(age: float, late: bool) -> None:
    watch = TimeoutWatch(10.0, None)
    view = replace(view_of(ATV71, fakes.RUNNING), now=100.0, heard=100.0 - age, watch=watch)
    assert _timeout(view, 40)[1] == (STALE if late else PLAIN)


@pytest.mark.parametrize(
    ("watch", "width", "text"),
    [
        (None, 40, "none known"),
        (TimeoutWatch(0.5, None), 40, "0.5 s"),
        (TimeoutWatch(10.0, None, active=False), 60, "10 s, starts when commanded"),
        (TimeoutWatch(10.0, None, active=False), 22, "10 s, at run"),
    ],
)
def test_timeout_of_a_drive_that_was_not_polled_yet(
    watch: TimeoutWatch | None, width: int, text: str
) -> None:
    view = replace(view_of(ATV71, fakes.RUNNING), watch=watch, heard=None)
    assert _timeout(view, width)[0] == text
