"""Commands and status of the Altivar 21."""

from __future__ import annotations

import pytest

from .bench import Bench

RUN_FORWARD, RUN_REVERSE, STOP = 0xC400, 0xC600, 0xC000


UNWATCHED = {"F803": 0}


def started() -> Bench:
    """A drive commanded to run at 30.00 Hz."""
    bench = Bench("atv21", UNWATCHED)
    bench.taken("FA01", 3000)
    bench.taken("FA00", RUN_FORWARD)
    return bench


def test_priority_bits_run_the_motor_whatever_the_sources() -> None:
    bench = started()
    assert bench.word("FE45") == 2
    assert bench.word("FE46") == 4
    bench.run(7)
    assert bench.word("FD00") == 3000
    assert bench.word("FD01") == 0x6400
    bench.taken("FA00", STOP)
    bench.run(1)
    assert 0 < bench.word("FD00") < 3000
    bench.run(6)
    assert bench.word("FD01") == 0x4000


def test_without_priority_the_sources_decide() -> None:
    bench = Bench("atv21", UNWATCHED)
    bench.taken("FA01", 3000)
    bench.taken("FA00", 0x0400)
    bench.run(3)
    assert bench.word("FD00") == 0
    assert (bench.word("FE45"), bench.word("FE46")) == (0, 1)
    bench = Bench("atv21", {**UNWATCHED, "CMOD": 2, "FMOD": 4})
    bench.taken("FA01", 3000)
    bench.taken("FA00", 0x0400)
    bench.run(7)
    assert bench.word("FD00") == 3000


def test_reverse_bit_reverses_the_motor() -> None:
    bench = started()
    bench.taken("FA00", RUN_REVERSE)
    bench.run(7)
    assert bench.word("FD00") == 3000
    assert bench.word("FD01") & 1 << 9
    assert bench.drive.motor.frequency == pytest.approx(-30)


def test_coast_stop_disables_the_output() -> None:
    bench = started()
    bench.run(7)
    bench.taken("FA00", RUN_FORWARD | 0x0800)
    bench.run(0.1)
    assert bench.word("FD00") == 0
    assert bench.drive.motor.rotor > 20
    assert bench.word("FD01") & 1 << 11


def test_preset_speeds_override_the_reference() -> None:
    bench = started()
    bench.taken("FA00", RUN_FORWARD | 2)
    assert bench.word("FE46") == 255
    bench.run(5)
    assert bench.word("FD00") == 1000, "preset 2 of a profile without preset speeds"


def test_emergency_stop_works_without_priority_and_trips() -> None:
    bench = Bench("atv21", UNWATCHED, run_hz=30.0)
    bench.run(7)
    bench.taken("FA00", 0x1000)
    bench.run(0.1)
    assert bench.word("FC90") == 17
    assert bench.word("FD01") & 1 << 12
    assert bench.word("FD01") & 0x4003 == 3


def test_reset_needs_the_command_and_an_edge() -> None:
    bench = Bench("atv21", UNWATCHED)
    bench.drive.provoke("OC1")
    assert bench.word("FC90") == 1
    bench.taken("FA00", 0x2000)
    assert bench.word("FC90") == 1, "the line has no command"
    bench.taken("FA00", 0xE000)
    assert bench.word("FC90") == 1, "no edge"
    bench.taken("FA00", STOP)
    bench.taken("FA00", 0xE000)
    assert bench.word("FC90") == 0
    assert bench.word("FE10") == 1


def test_pre_fault_words_stay_during_the_fault() -> None:
    bench = started()
    bench.run(7)
    running = bench.word("FD01")
    bench.drive.provoke("OC1")
    bench.run(1)
    assert bench.word("FE01") == running
    assert bench.word("FE00") == 3000
    assert bench.word("FD00") == 0
    assert bench.word("FE03") > 0, "values of the FE series are frozen"


def test_fault_history_shifts() -> None:
    bench = Bench("atv21", UNWATCHED)
    for fault in ("OC1", "Err5"):
        bench.drive.provoke(fault)
        bench.taken("FA00", STOP)
        bench.taken("FA00", 0xE000)
    assert (bench.word("FE10"), bench.word("FE11")) == (24, 1)


def test_released_command_returns_to_the_terminals() -> None:
    bench = Bench("atv21", UNWATCHED, run_hz=20.0)
    bench.run(5)
    assert bench.word("FD00") == 2000
    bench.taken("FA00", STOP)
    bench.run(5)
    assert bench.word("FD00") == 0
    bench.taken("FA00", 0)
    bench.run(5)
    assert bench.word("FD00") == 2000, "the run order there is still given"


def test_priority_bits_are_lost_at_power_down() -> None:
    bench = started()
    bench.run(2)
    bench.drive.power_cycle()
    assert bench.word("FA00") == 0
    assert bench.word("FE45") == 0


def test_alarms_show_in_the_status_word() -> None:
    bench = started()
    bench.run(7)
    bench.drive.alarm(0x0080)
    assert bench.word("FC91") == 0x0080
    assert bench.word("FD01") == 0x6404
