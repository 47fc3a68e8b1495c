"""Terminals of simulated drives: levels that outlive trips, resets and hand-backs."""

from __future__ import annotations

import pytest

from tui.simulator import SimulatorError
from tui.simulator.plant.terminals import BY_KIND, COMPACT, Terminals

from .exchange import Exchange

AT_THE_TERMINALS = {"FR1": 1}


@pytest.mark.parametrize("family", ["atv31", "atv312", "atv71"])
def test_closed_run_input_starts_the_motor_after_a_reset(family: str) -> None:
    """2 wires, TCT = level, RSF = LI4; CMD bit 7 does nothing while the terminals command."""
    rig = Exchange(family, {**AT_THE_TERMINALS, "RSF": 132, "TCT": 0})
    rig.play("""
        @ AI1=6V
        @ LI1=1
        . 5
        > 02 03 0C82 0001
        < 02 03 02 012C
        ! OCF
        . 12
        > 02 03 0C82 0001
        < 02 03 02 0000
        > 02 06 2135 0080
        < 02 06 2135 0080
        . 5
        > 02 03 0C82 0001
        < 02 03 02 0000
        @ LI4=1
        . 5
        > 02 03 0C82 0001
        < 02 03 02 012C          # LI1 was closed all the time
    """)


def test_tct_at_transition_needs_the_input_to_open_first() -> None:
    Exchange("atv312", {**AT_THE_TERMINALS, "RSF": 132, "TCT": 1}).play("""
        @ AI1=6V
        @ LI1=1
        . 5
        ! OCF
        . 12
        @ LI4=1
        . 5
        > 02 03 0C82 0001
        < 02 03 02 0000
        @ LI1=0
        @ LI1=1
        . 5
        > 02 03 0C82 0001
        < 02 03 02 012C
    """)


def test_inputs_survive_a_power_cycle() -> None:
    rig = Exchange("atv312", AT_THE_TERMINALS)
    rig.play("""
        @ AI1=6V
        @ LI1=1
    """)
    rig.drive.power_cycle()
    rig.play("""
        . 5
        > 02 03 0C82 0001
        < 02 03 02 012C
    """)


def test_li2_runs_in_reverse_and_inputs_are_shown() -> None:
    rig = Exchange("atv312", AT_THE_TERMINALS)
    rig.play("""
        @ AI1=6V
        @ LI2=on
        . 5
        > 02 03 0C82 0001
        < 02 03 02 FED4
        > 02 03 1478 0001
        < 02 03 02 0002          # IOLR
        > 02 03 147A 0001
        < 02 03 02 1770          # AI1C: 6000 mV
    """)


@pytest.mark.parametrize("family", ["atv31", "atv312"])
def test_cmi_bit_3_is_an_external_fault_until_cleared(family: str) -> None:
    rig = Exchange(family, {"EPL": 1})
    rig.play("""
        > 02 06 2138 0008
        < 02 06 2138 0008
        > 02 03 1BD1 0001
        < 02 03 02 0008          # EPF
        > 02 06 2135 0080
        > 02 03 0C81 0001
        < 02 03 02 0208          # no reset while it is reported
        > 02 06 2138 0000
        > 02 06 2135 0000
        > 02 06 2135 0080
        > 02 03 0C81 0001
        < 02 03 02 0240
    """)


@pytest.mark.parametrize("family", ["atv31", "atv312"])
def test_cmi_bit_13_blocks_a_start_but_not_a_running_motor(
    family: str,
) -> None:
    rig = Exchange(family)
    rig.play("""
        > 02 06 2138 2000
        > 02 06 2136 00C8
        > 02 06 2135 0006
        > 02 06 2135 0007
        > 02 06 2135 000F
        . 4
        > 02 03 0C82 0001
        < 02 03 02 0000
        > 02 06 2138 0000
        . 4
        > 02 03 0C82 0001
        < 02 03 02 00C8
        > 02 06 2138 2000
        . 1
        > 02 03 0C82 0001
        < 02 03 02 00C8
    """)


def test_input_may_be_the_external_fault() -> None:
    rig = Exchange("atv71", {"ETF": 131})
    rig.play("@ LI3=1")
    assert rig.drive.fault is not None
    assert rig.drive.fault.code == "EPF1"
    assert rig.drive.fault.persists
    rig.play("@ LI3=0")
    assert not rig.drive.fault.persists


# Altivar 21


UNWATCHED = {"F803": 0, "CMOD": 0}


def test_altivar_21_reset_clears_the_volatile_words() -> None:
    """Manual 8.2: the priority bits go too, so a closed F commands until 16#C000 arrives."""
    Exchange("atv21", UNWATCHED).play("""
        @ VIA=4V
        > 02 06 FA01 0BB8
        > 02 06 FA50 0001
        > 02 06 FA00 C400
        . 9
        > 02 03 FD00 0001
        < 02 03 02 0BB8
        @ F=1
        ! OC1
        . 1
        > 02 06 FA00 E000
        < 02 06 FA00 E000
        > 02 03 FA00 0001
        < 02 03 02 0000
        > 02 03 FA01 0001
        < 02 03 02 0000
        > 02 03 FA50 0001
        < 02 03 02 0000
        > 02 03 FC90 0001
        < 02 03 02 0000
        . 9
        > 02 03 FD00 0001
        < 02 03 02 07D0          # 20.00 Hz of VIA: F is closed
        > 02 06 FA00 C000
        . 9
        > 02 03 FD00 0001
        < 02 03 02 0000
        > 02 06 FA00 0000
        . 9
        > 02 03 FD00 0001
        < 02 03 02 07D0          # handed back, and F is closed still
    """)


def test_reference_above_fh_is_exception_3() -> None:
    Exchange("atv21", {**UNWATCHED, "FH": 6000}).play("""
        > 02 06 FA01 1770
        < 02 06 FA01 1770
        > 02 06 FA01 1771
        < 02 86 03
        > 02 03 FA01 0001
        < 02 03 02 1770
    """)


@pytest.mark.parametrize(
    ("function", "off", "on"), [(4, "0000", "0000"), (38, "0000", "0001"), (39, "0001", "0000")]
)
def test_ry_follows_fa50_only_with_function_38_or_39(function: int, off: str, on: str) -> None:
    Exchange("atv21", {**UNWATCHED, "F130": function}).play(f"""
        > 02 03 FD07 0001
        < 02 03 02 {off}
        > 02 06 FA50 0001
        > 02 03 FD07 0001
        < 02 03 02 {on}
    """)


def test_input_r_with_function_48_forces_local_control() -> None:
    Exchange("atv21", {**UNWATCHED, "F112": 48}).play("""
        > 02 06 FA01 0BB8
        > 02 06 FA00 C400
        . 9
        > 02 03 FD00 0001
        < 02 03 02 0BB8
        @ R=1
        . 9
        > 02 03 FD00 0001
        < 02 03 02 0000
        > 02 03 FE45 0001
        < 02 03 02 0000
        @ R=0
        . 9
        > 02 03 FD00 0001
        < 02 03 02 0BB8
        > 02 03 FE45 0001
        < 02 03 02 0002
    """)


def test_res_resets_a_fault_and_inputs_are_in_fd06() -> None:
    Exchange("atv21", UNWATCHED).play("""
        ! OC1
        > 02 03 FC90 0001
        < 02 03 02 0001
        @ RES=1
        > 02 03 FC90 0001
        < 02 03 02 0000
        > 02 03 FD06 0001
        < 02 03 02 0004
    """)


# Leroy-Somer


def test_closed_run_input_starts_a_leroy_somer_drive_after_a_reset() -> None:
    rig = Exchange("powerdrive")
    rig.play("""
        @ RUN=1
        . 5
    """)
    assert rig.drive.motor.frequency == pytest.approx(30)
    rig.play("""
        ! 94
        . 15
        @ RESET=1
        . 5
    """)
    assert rig.drive.motor.frequency == pytest.approx(30)


# What a person types


@pytest.mark.parametrize(
    ("name", "text", "reported"),
    [
        ("li1", "1", "LI1 = 1"),
        ("LI6", " on ", "LI6 = 1"),
        ("AI1", "5", "AI1 = 50 %"),
        ("AI1", "2.5V", "AI1 = 25 %"),
        ("AI3", "12 mA", "AI3 = 60 %"),
        ("AI2", "33%", "AI2 = 33 %"),
    ],
)
def test_typed_inputs_are_set(name: str, text: str, reported: str) -> None:
    assert Terminals(COMPACT).set(name, text) == reported


@pytest.mark.parametrize(
    ("name", "text", "why"),
    [
        ("LI7", "1", "No input is called 'LI7'"),
        ("LI1", "2", "is a logic input"),
        ("AI1", "much", "is an analog input"),
        ("AI1", "11", "more than its full scale"),
        ("AI1", "-1", "is an analog input"),
        ("AI1", "21mA", "more than its full scale"),
    ],
)
def test_invalid_inputs_are_refused(name: str, text: str, why: str) -> None:
    with pytest.raises(SimulatorError, match=why):
        Terminals(COMPACT).set(name, text)


def test_inputs_are_reported_in_one_line() -> None:
    terminals = Terminals(BY_KIND["altivar21"])
    terminals.set("F", "1")
    assert terminals.reported() == "closed of F, R, RES: F; VIA 0 %, VIB 0 %"
