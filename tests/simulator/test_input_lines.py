"""Lines that set the inputs of simulated drives."""

from __future__ import annotations

import pytest

from tui.simulator import Bench, DriveSpec, Simulation, SimulatorError

from .small import PROFILES


def simulation(*profiles: str) -> Simulation:
    drives = [DriveSpec(profile, address) for address, profile in enumerate(profiles, 2)]
    return Simulation(drives, profiles=PROFILES)


def set_inputs(made: Simulation, line: str) -> str:
    """Carry out a line that concerns one drive; return its result."""
    (result,) = Bench(made).do(line)
    assert result.inputs
    return f"{result.device}: {result.text}"


def test_line_sets_inputs_of_the_named_drive() -> None:
    made = simulation("atv312", "atv21")
    assert set_inputs(made, "2: LI1=1, AI1=5V") == "2: LI1 = 1, AI1 = 50 %"
    assert set_inputs(made, " 3:f=1 ") == "3: F = 1"
    assert made.drive(2).terminals.closed("LI1")
    assert made.drive(3).terminals.closed("F")


def test_line_without_values_reports_the_inputs() -> None:
    made = simulation("atv21")
    set_inputs(made, "2: F=1, VIA=4V")
    assert set_inputs(made, "2:") == "2: closed of F, R, RES: F; VIA 40 %, VIB 0 %"


def test_address_may_be_omitted_for_a_single_drive() -> None:
    assert set_inputs(simulation("atv21"), "F=1") == "2: F = 1"
    with pytest.raises(SimulatorError, match=r"Say which drive.*2, 3"):
        set_inputs(simulation("atv21", "atv312"), "F=1")


@pytest.mark.parametrize(
    ("line", "why"),
    [
        ("9: LI1=1", "No simulated drive has address 9"),
        ("two: LI1=1", "write it like"),
        ("2: LI1", "write an input like"),
        ("2: LI9=1", "No input is called 'LI9'"),
        ("2: LI1=5", "is a logic input"),
        ("2: LI1=1, AI1=50V", "more than its full scale"),
    ],
)
def test_invalid_line_sets_nothing(line: str, why: str) -> None:
    made = simulation("atv312")
    with pytest.raises(SimulatorError, match=why):
        set_inputs(made, line)
    assert made.drive(2).terminals.bits() == 0
