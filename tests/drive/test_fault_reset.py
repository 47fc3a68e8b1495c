"""Effects of a fault reset: one sentence per family and command channel, and the inputs."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from tui.drive.fault_reset import (
    INPUTS_NOT_READ,
    NO_INPUTS,
    NONE_CLOSED,
    NOT_IN_COMMAND,
    no_fault,
    not_in_command,
    reset_codes,
    reset_follows,
)
from tui.drive.profile import library
from tui.drive.sentences import MAY_START

LINE = "runs only on a new run command"
BY_LINE: Mapping[str, Mapping[str, int]] = {
    "atv71": {"CHCF": 1, "CCC": 8},
    "atv31": {"LAC": 2, "CHCF": 1, "ETA": 0x0200, "rFC": 96, "Fr1": 164},
    "atv312": {"LAC": 2, "CHCF": 1, "ETA": 0x0200, "rFC": 96, "Fr1": 164},
    "atv21": {"FD01": 0, "CMOD": 2},
    "powerdrive": {"6.43": 1},
    "proxidrive": {"6.43": 1},
    "varmeca": {"6.43": 1},
}
BY_TERMINALS: Mapping[str, Mapping[str, int]] = {
    "atv71": {"CHCF": 1, "CCC": 1},
    "atv31": {"LAC": 2, "CHCF": 1, "ETA": 0x0200, "rFC": 96, "Fr1": 1},
    "atv312": {"LAC": 2, "CHCF": 1, "ETA": 0x0200, "rFC": 96, "Fr1": 1},
    "atv21": {"FD01": 0, "CMOD": 0},
    "powerdrive": {"6.43": 0},
    "proxidrive": {"6.43": 0},
    "varmeca": {"6.43": 0},
}


@pytest.mark.parametrize("family", BY_LINE)
def test_reset_follows_by_line_needs_a_new_run_command(family: str) -> None:
    text = reset_follows(library.load(family), BY_LINE[family], {})
    assert LINE in text
    assert "may start" not in text
    assert NOT_IN_COMMAND not in text


@pytest.mark.parametrize("family", BY_TERMINALS)
def test_reset_follows_by_terminals_names_the_closed_input(family: str) -> None:
    profile = library.load(family)
    text = reset_follows(profile, BY_TERMINALS[family], {})
    assert "closed run input" in text
    assert LINE not in text
    takes_priority = family == "atv21"  # 16#E000 takes the command with the reset
    assert (NOT_IN_COMMAND in text) is not takes_priority
    assert bool(not_in_command(profile, BY_TERMINALS[family])) is not takes_priority


@pytest.mark.parametrize("family", BY_LINE)
def test_reset_follows_is_general_if_nothing_was_read(family: str) -> None:
    profile = library.load(family)
    assert reset_follows(profile, {}, {}).startswith(MAY_START)
    for row in profile.data.faults.after_reset:
        assert row.source
        assert row.text.endswith(".")


def test_reset_follows_2_wire_by_level_starts_the_motor() -> None:
    atv71 = library.load("atv71")
    level = {**BY_TERMINALS["atv71"], "TCC": 0, "TCT": 0}
    assert "closed run input starts the motor (2-wire by level)" in reset_follows(atv71, level, {})
    edge = {**BY_TERMINALS["atv71"], "TCC": 0, "TCT": 1}
    assert "closed run input may start the motor" in reset_follows(atv71, edge, {})


@pytest.mark.parametrize(
    ("family", "word", "raw", "expected"),
    [
        ("atv71", "IL1R", 0b101, "Closed at the terminals now: LI1, LI3."),
        ("atv71", "IL1R", 0, NONE_CLOSED),
        ("atv312", "IOLR", 0x0182, "Closed at the terminals now: LI2."),
        ("atv31", "IOLR", 0x0180, NONE_CLOSED),
        ("atv21", "FD06", 1, "Closed at the terminals now: F."),
    ],
)
def test_reset_follows_names_closed_inputs(family: str, word: str, raw: int, expected: str) -> None:
    profile = library.load(family)
    assert word in reset_codes(profile)
    assert reset_follows(profile, {}, {word: raw}).endswith(expected)
    # an earlier value is not a current one
    assert reset_follows(profile, {word: raw}, {}).endswith(INPUTS_NOT_READ)


def test_reset_follows_without_an_input_word_says_so() -> None:
    assert reset_follows(library.load("varmeca"), {}, {}).endswith(NO_INPUTS)


@pytest.mark.parametrize("family", BY_LINE)
def test_fault_interlock_is_empty_without_a_fault_state(family: str) -> None:
    chart = library.load(family).data.charts[0]
    states = {state.id: no_fault(chart, state.id, state.kind, state.name) for state in chart.states}
    faults = [state.id for state in chart.states if state.kind == "fault"]
    assert faults
    assert not any(states[id] for id in faults)
    running = next(state for state in chart.states if state.kind == "running")
    assert states[running.id] == f"No fault to reset: the drive is in the state {running.name}."
