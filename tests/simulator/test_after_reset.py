"""Settings of the Altivar 21 that take effect at a power cycle or a reset, and its ramps to FH."""

from __future__ import annotations

import pytest

from tui.simulator import LineTiming

from .exchange import Exchange

CHOSEN = """
    > 02 06 0875 0001   # FD01
    < 02 06 0875 0001
    > 02 06 0876 0002   # FD00
    < 02 06 0876 0002
    > 02 03 1875 0002
    < 02 03 04 8000 8000
"""
IN_FORCE = """
    > 02 03 1875 0002
    < 02 03 04 4000 0000
"""


def test_block_takes_effect_at_a_power_cycle() -> None:
    played = Exchange("atv21")
    played.play(CHOSEN)
    played.drive.power_cycle()
    played.play(IN_FORCE)


def test_block_takes_effect_at_a_reset_at_standstill() -> None:
    played = Exchange("atv21", sets={"CMOD": 2})
    played.play(CHOSEN)
    played.play("> 02 06 FA00 2000\n> 02 06 FA00 0000")
    played.play(IN_FORCE)


def test_block_takes_effect_at_a_fault_reset_and_not_while_the_motor_runs() -> None:
    played = Exchange("atv21", sets={"CMOD": 2, "FMOD": 4, "F803": 0})
    played.play("> 02 06 FA01 0BB8\n> 02 06 FA00 0400\n. 2")
    played.play(CHOSEN)
    played.play("> 02 06 FA00 2400\n> 02 03 1875 0002\n< 02 03 04 8000 8000")
    played.play("! OC1\n. 10\n> 02 06 FA00 0000\n> 02 06 FA00 2000\n. 1")
    assert played.drive.fault is None
    played.play("> 02 06 FA00 0000\n" + IN_FORCE)


def test_other_baud_takes_effect_at_a_power_cycle() -> None:
    played = Exchange("atv21", timing=LineTiming(19200, "8E1"))
    played.play("> 02 06 0800 0000\n< 02 06 0800 0000\n> 02 03 FD01 0001\n< 02 03 02 4000")
    played.drive.power_cycle()
    played.play("> 02 03 FD01 0001\n< -")


def test_ramp_of_an_altivar_21_is_timed_to_fh() -> None:
    """ACC is the time from 0 to FH: 8.0 s to 80 Hz are 10 Hz/s."""
    played = Exchange("atv21", sets={"ACC": 80, "FH": 8000, "F803": 0})
    played.play("> 02 06 FA01 1388\n> 02 06 FA00 C400\n. 3")
    assert played.drive.motor.frequency == pytest.approx(30.0, abs=0.5)
