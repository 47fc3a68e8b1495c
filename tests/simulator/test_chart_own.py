"""Drives of other makes follow the chart of their own profile: raw exchanges."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import msgspec
import pytest

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Chart, ProfileData, State
from tui.simulator.charts.own_words import with_bit, words_showing

from .exchange import Exchange
from .small import head, parameter, profile

README = Path(__file__).parents[2] / "profiles" / "README.md"


def pump() -> Profile:
    """The example of profiles/README.md."""
    [text] = re.findall(
        r"^```toml\n(\[profile\]\n.*?)^```$", README.read_text("utf-8"), re.M | re.S
    )
    return Profile(msgspec.toml.decode(text.encode(), type=ProfileData))


def test_example_pump_runs_trips_on_timeout_and_is_reset() -> None:
    Exchange(pump()).play("""
        > 02 03 0064 0003
        < 02 03 06 0001 0000 0000      # ready, 0.0 Hz, no fault
        @ AI1=4V
        @ RUN=1
        . 4
        > 02 03 0064 0003
        < 02 03 06 0002 00C8 0000      # running, 20.0 Hz
        . 5.1                          # TOUT is 5 s
        > 02 03 0064 0003
        < 02 03 06 0004 0000 0007      # COM
        @ RUN=0
        @ RESET=1
        > 02 03 0064 0003
        < 02 03 06 0001 0000 0000
    """)


def test_closed_run_input_starts_the_pump_after_the_reset() -> None:
    Exchange(pump()).play("""
        @ AI1=4V
        @ RUN=1
        . 4
        ! OC
        . 1
        > 02 03 0064 0003
        < 02 03 06 0004 0000 0001
        @ RESET=1
        . 4
        > 02 03 0064 0003
        < 02 03 06 0002 00C8 0000
    """)


# A drive of single words, as many makers build them

RUN, REVERSE_BIT, STATES = 0x0012, 0x0020, ("fault", "run", "stopping", "stop")


def words(**more: Any) -> Profile:
    """Commands at 8192, reference at 8193, reset at 8194, status at 8449, fault at 8448."""
    hz: dict[str, Any] = {"scale": "0.01", "unit": "Hz", "storage": "ram"}
    chart: dict[str, Any] = {
        "id": "words",
        "name": "Words",
        "kind": "io",
        "status": "STATUS",
        "command": "COMMAND",
        "states": [
            {"id": "stop", "name": "Stop", "kind": "ready", "mask": 3, "value": 0},
            {"id": "stopping", "name": "Decelerating", "kind": "stopping", "mask": 3, "value": 1},
            {"id": "run", "name": "Run", "kind": "running", "mask": 3, "value": 3},
            {"id": "fault", "name": "Fault", "kind": "fault", "mask": 3, "value": 2},
        ],
        "orders": [
            {"id": "forward", "name": "Forward", "words": [0x12], "states": ["stop", "run"]},
            {"id": "reverse", "name": "Reverse", "words": [0x22], "states": ["stop", "run"]},
            {"id": "stop", "name": "Stop", "words": [0x01]},
            {"id": "reset", "name": "Reset", "words": [2], "parameter": "RESET"},
        ],
        "interlocks": [{"parameter": "SOURCE", "values": [2], "text": "Not by the line."}],
        "direction": {"parameter": "STATUS", "bit": 4},
        "reached": {"parameter": "STATUS", "bit": 8},
        **more,
    }
    return profile(
        {
            "profile": head("words"),
            "link": {"baud": 9600, "format": "8N2"},
            "functions": [{"code": 3, "name": "3", "max_read": 8}, {"code": 6, "name": "6"}],
            "charts": [chart],
            "references": [{"parameter": "SETPOINT", "kind": "frequency"}],
            "faults": {
                "parameter": "ERROR",
                "codes": [
                    {"raw": 1, "code": "OC", "name": "Overcurrent"},
                    {"raw": 54, "code": "CE1", "name": "Communication"},
                ],
            },
            "communication_fault": {
                "timeout": "SILENCE",
                "off": 0,
                "starts": "After a command.",
                "needs_write": True,
                "fault": 54,
            },
            "parameters": [
                parameter("COMMAND", 8192, storage="ram"),
                parameter("SETPOINT", 8193, **hz),
                parameter("RESET", 8194, storage="ram"),
                parameter("ERROR", 8448, "r"),
                parameter("STATUS", 8449, "r"),
                parameter("OUTPUT", 8451, "r", quantity="output_frequency", scale="0.01")
                | {"unit": "Hz"},
                parameter("SOURCE", 33, values={"0": "Keypad", "2": "Line"}, factory=0),
                parameter("SILENCE", 2307, scale="0.1", unit="s", factory=20, max=1000),
            ],
        }
    )


def _way_down(stop: int) -> list[int]:
    """State words of a drive with two states of the kind stopping, from a run to standstill."""
    states = [
        ("stop", "ready", 0), ("off3", "stopping", 1), ("off2", "stopping", 4),
        ("run", "running", 3), ("fault", "fault", 2), ("locked", "blocked", 5),
    ]  # fmt: skip
    steps = [
        ("stop", "run", 0x12), ("run", "off3", 1), ("run", "off2", 4), ("locked", "run", 0x12),
        ("off3", "stop", None), ("off2", "locked", None), ("fault", "stop", 2),
        ("run", "stop", 8),
    ]  # fmt: skip
    drive = Exchange(
        words(
            states=[
                {"id": id, "name": id, "kind": kind, "mask": 7, "value": value}
                for id, kind, value in states
            ],
            transitions=[
                {"source": source, "target": target}
                | ({} if command is None else {"command": command})
                for source, target, command in steps
            ],
            orders=[
                {"id": "forward", "name": "Forward", "words": [0x12]},
                {"id": "stop", "name": "Stop", "words": [1]},
                {"id": "quick-stop", "name": "Straight to standstill", "words": [8]},
                {"id": "freewheel", "name": "Freewheel", "words": [4]},
                {"id": "reset", "name": "Reset", "words": [2], "states": ["fault"]},
            ],
            interlocks=[],
        )
    )
    drive.play("""
        > 02 06 2001 07D0
        > 02 06 2000 0012
        . 1
    """)
    shown = [drive.word("STATUS") & 7]
    drive.play(f"> 02 06 2000 {stop:04X}")
    for _ in range(400):
        drive.wait(0.1)
        drive.play("> 02 03 2101 0001")
        if (word := drive.word("STATUS") & 7) != shown[-1]:
            shown.append(word)
    return shown


@pytest.mark.parametrize(("stop", "states"), [(1, [3, 1, 0]), (4, [3, 4, 5]), (8, [3, 0])])
def test_drive_slows_in_the_state_that_the_transition_declares(
    stop: int, states: list[int]
) -> None:
    assert _way_down(stop) == states


def test_single_word_drive_runs_stops_trips_and_is_reset() -> None:
    Exchange(words()).play("""
        > 02 03 2100 0004
        < 02 83 02                     # 8450 is in no profile
        > 02 03 2101 0001
        < 02 03 02 0000
        > 02 06 2001 03E8
        < 02 06 2001 03E8
        > 02 06 2000 0012
        < 02 06 2000 0012
        . 1.5
        > 02 03 2101 0001
        < 02 03 02 0103                # running, reference reached
        > 02 03 2103 0001
        < 02 03 02 03E8
        > 02 06 2000 0022
        . 1.9
        > 02 03 2101 0001
        < 02 03 02 0113                # the other way
        > 02 06 2000 0001
        . 0.3
        > 02 03 2101 0001
        < 02 03 02 0011                # slows down
        . 1.5
        > 02 03 2100 0002
        < 02 03 04 0000 0000
        . 2.1                          # the watch over the line runs
        > 02 03 2100 0002
        < 02 03 04 0036 0002
        > 02 06 2000 0012
        . 1
        > 02 03 2100 0002
        < 02 03 04 0036 0002           # no run in a fault
        > 02 06 2002 0002
        < 02 06 2002 0002
        > 02 03 2100 0002
        < 02 03 04 0000 0000
    """)


def test_command_with_an_unmet_interlock_has_no_effect() -> None:
    Exchange(words(), {"SOURCE": 0}).play("""
        > 02 06 2001 03E8
        > 02 06 2000 0012
        . 1
        > 02 03 2101 0001
        < 02 03 02 0000
        > 02 06 0021 0002
        > 02 06 2000 0012
        . 1
        > 02 03 2101 0001
        < 02 03 02 0103
    """)


def test_local_control_ends_the_run_and_ignores_run_commands() -> None:
    rig = Exchange(words(local={"parameter": "STATUS", "bit": 9}), {"SOURCE": 2}, run_hz=20.0)
    rig.play(". 3")
    rig.drive.keypad["LOC"]()
    rig.play("""
        . 3
        > 02 06 2000 0012
        . 1
        > 02 03 2101 0001
        < 02 03 02 0200                # local, stopped
    """)
    rig.drive.keypad["REM"]()
    rig.play("""
        . 1
        > 02 06 2000 0012
        . 1.5
        > 02 03 2101 0001
        < 02 03 02 0103
    """)


def test_motor_left_running_by_another_master_is_stopped_by_the_line() -> None:
    Exchange(words(), run_hz=20.0).play("""
        . 1.5
        > 02 03 2001 0001
        < 02 03 02 07D0
        . 1.5
        > 02 03 2101 0001
        < 02 03 02 0103
        > 02 06 2000 0001
        . 1.9
        > 02 03 2101 0001
        < 02 03 02 0000
    """)


def test_command_of_several_words_applies_with_the_last_word() -> None:
    orders = [
        {"id": "forward", "name": "Forward", "words": [6, 7, 15]},
        {"id": "stop", "name": "Stop", "words": [7]},
    ]
    rig = Exchange(words(orders=orders, interlocks=[]))
    rig.play("""
        > 02 06 2001 03E8
        > 02 06 2000 0006
        > 02 06 2000 000F
        . 0.5
        > 02 03 2101 0001
        < 02 03 02 0000
        > 02 06 2000 0006
        > 02 06 2000 0007
        > 02 06 2000 000F
        . 1.5
        > 02 03 2101 0001
        < 02 03 02 0103
    """)


def test_transitions_pass_intermediate_states() -> None:
    states = [
        {"id": "fault", "name": "Fault", "kind": "fault", "mask": 8, "value": 8},
        {"id": "off", "name": "Off", "kind": "blocked", "mask": 0x40, "value": 0x40},
        {"id": "ready", "name": "Ready", "kind": "ready", "mask": 7, "value": 1},
        {"id": "on", "name": "On", "kind": "running", "mask": 7, "value": 7},
    ]
    transitions = [
        {"source": "off", "target": "ready", "command": 6},
        {"source": "ready", "target": "on", "command": 15},
        {"source": "on", "target": "ready", "command": 6},
        {"source": "fault", "target": "off", "command": 0x80, "edge_bit": 7},
    ]
    bare: dict[str, Any] = {"orders": [], "interlocks": [], "direction": None, "reached": None}
    Exchange(words(states=states, transitions=transitions, **bare)).play("""
        > 02 03 2101 0001
        < 02 03 02 0001
        > 02 06 2001 03E8
        > 02 06 2000 000F
        . 1.5
        > 02 03 2101 0001
        < 02 03 02 0007
        > 02 06 2000 0006
        . 1.5
        > 02 03 2101 0001
        < 02 03 02 0001
        ! OC
        > 02 03 2101 0001
        < 02 03 02 0008
        > 02 06 2000 0080
        > 02 03 2101 0001
        < 02 03 02 0040
        > 02 06 2000 0006
        > 02 03 2101 0001
        < 02 03 02 0001
    """)


def states(*marks: tuple[str, int, int]) -> Chart:
    return Chart(
        id="c",
        name="C",
        kind="io",
        status="S",
        states=[State(id=i, name=i, kind="ready", mask=m, value=v) for i, m, v in marks],
    )


@pytest.mark.parametrize(
    ("marks", "word"),
    [
        ([("first", 2, 2), ("wanted", 1, 1)], 1),
        ([("first", 4, 0), ("wanted", 1, 1)], 5),
        ([("first", 4, 0), ("second", 12, 4), ("wanted", 1, 1)], 13),
    ],
)
def test_status_word_matches_its_state_only(marks: list[tuple[str, int, int]], word: int) -> None:
    chart = states(*marks)
    assert words_showing(chart, chart.states[-1]) == {chart.status: word}


def test_extra_bit_is_omitted_if_it_would_show_another_state() -> None:
    chart = states(("first", 3, 3), ("wanted", 1, 1))
    code, words = chart.status, {chart.status: 1}
    assert with_bit(chart, words, code, 1, on=True) == 1
    assert with_bit(chart, words, code, 8, on=True) == 0x101


def relative() -> Profile:
    """A drive with the Drivecom chart of another family, its words named by the chart alone."""
    plain = {"storage": "ram"}
    return profile(
        {
            "profile": head("relative"),
            "functions": [{"code": 3, "name": "3", "max_read": 8}, {"code": 6, "name": "6"}],
            "link": {"baud": 19200, "format": "8E1"},
            "charts": [
                {
                    "id": "d",
                    "name": "Drivecom",
                    "kind": "drivecom",
                    "status": "STATE",
                    "command": "ORDER",
                    "states": [],
                }
            ],
            "faults": {
                "parameter": "LFT",
                "codes": [{"raw": 9, "code": "OCF", "name": "Overcurrent"}],
            },
            "parameters": [
                parameter("ORDER", 8501, **plain),
                parameter("LFR", 8502, scale="0.1", unit="Hz", quantity="command_frequency")
                | plain,
                parameter("STATE", 3201, "r"),
                parameter("RFR", 3202, "r", quantity="output_frequency", scale="0.1", unit="Hz"),
                parameter("LFT", 7121, "r"),
            ],
        }
    )


def test_own_family_with_the_drivecom_chart_follows_it() -> None:
    Exchange(relative()).play("""
        > 02 06 2136 00C8
        > 02 06 2135 0006
        > 02 06 2135 0007
        > 02 03 0C81 0001
        < 02 03 02 0223
        > 02 06 2135 000F
        . 4
        > 02 03 0C81 0002
        < 02 03 04 0627 00C8
        ! OCF
        > 02 03 0C81 0001
        < 02 03 02 0208
        > 02 06 2135 0080
        > 02 03 0C81 0001
        < 02 03 02 0240
    """)


def test_copy_of_a_family_without_its_words_uses_its_own_chart() -> None:
    data = words(kind="altivar21")
    Exchange(data).play("""
        > 02 06 2001 03E8
        > 02 06 2000 0012
        . 1.5
        > 02 03 2101 0001
        < 02 03 02 0103
    """)
