"""Control word 6.42 and status word 10.40 of the Leroy-Somer drives."""

from __future__ import annotations

import pytest

from .bench import Bench

READY, ACTIVE, STANDS, REACHED, REVERSE = 1, 2, 4, 1 << 5, 1 << 13


def test_the_control_word_runs_the_motor_when_it_is_in_force() -> None:
    bench = Bench("powerdrive")
    bench.taken("6.42", 0x0003)
    bench.run(1)
    assert bench.drive.motor.frequency == 0
    bench.taken("6.42", 0)
    bench.taken("6.43", 1)
    bench.taken("6.42", 0x0003)
    bench.run(4)
    assert bench.drive.motor.frequency == pytest.approx(30)
    assert bench.word("10.40") == READY | ACTIVE | REACHED
    assert [bench.word(c) for c in ("6.15", "6.30", "6.32", "10.06")] == [1, 1, 0, 1]


def test_reverse_and_stop() -> None:
    bench = Bench("powerdrive", {"6.43": 1})
    bench.taken("6.42", 0x0009)
    bench.run(4)
    assert bench.drive.motor.frequency == pytest.approx(-30)
    assert bench.word("10.40") & REVERSE
    bench.taken("6.42", 0x0001)
    bench.run(4)
    assert bench.word("10.40") & (ACTIVE | STANDS) == STANDS


def test_locking_the_drive_lets_go_of_the_motor() -> None:
    bench = Bench("powerdrive", {"6.43": 1})
    bench.taken("6.42", 0x0003)
    bench.run(4)
    bench.taken("6.42", 0)
    bench.run(0.1)
    assert bench.drive.motor.frequency == 0
    assert bench.drive.motor.rotor > 10


def test_the_control_word_cannot_be_put_in_force_while_the_drive_is_unlocked() -> None:
    bench = Bench("powerdrive", run_hz=25.0)
    bench.run(4)
    assert bench.write("6.43", 1) is None
    assert bench.word("6.43") == 0
    bench.drive.halt()
    bench.run(4)
    bench.taken("6.43", 1)


def test_a_fault_takes_ready_away_until_bit_13() -> None:
    bench = Bench("powerdrive", {"6.43": 1})
    bench.taken("6.42", 0x0003)
    bench.run(4)
    bench.drive.provoke(94)
    assert bench.word("10.40") & READY == 0
    bench.taken("6.42", 0)
    bench.taken("6.42", 0x2000)
    assert bench.word("10.40") & READY


def test_jogging_is_slow() -> None:
    bench = Bench("powerdrive", {"6.43": 1})
    bench.taken("6.42", 0x0005)
    bench.run(4)
    assert bench.drive.motor.frequency == pytest.approx(5)
