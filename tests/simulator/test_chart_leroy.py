"""Control word 6.42 and status word 10.40 of the Leroy-Somer drives."""

from __future__ import annotations

import struct

import pytest

from tui.drive.profile import library
from tui.simulator import DriveSpec, SimulatedDrive

from .bench import Bench

READY, ACTIVE, STANDS, REACHED, REVERSE = 1, 2, 4, 1 << 5, 1 << 13


def test_control_word_runs_the_motor_if_enabled() -> None:
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


def test_control_word_reverses_and_stops() -> None:
    bench = Bench("powerdrive", {"6.43": 1})
    bench.taken("6.42", 0x0009)
    bench.run(4)
    assert bench.drive.motor.frequency == pytest.approx(-30)
    assert bench.word("10.40") & REVERSE
    bench.taken("6.42", 0x0001)
    bench.run(4)
    assert bench.word("10.40") & (ACTIVE | STANDS) == STANDS


def test_locking_the_drive_disables_the_output() -> None:
    bench = Bench("powerdrive", {"6.43": 1})
    bench.taken("6.42", 0x0003)
    bench.run(4)
    bench.taken("6.42", 0)
    bench.run(0.1)
    assert bench.drive.motor.frequency == 0
    assert bench.drive.motor.rotor > 10


def test_control_word_cannot_be_enabled_while_unlocked() -> None:
    bench = Bench("powerdrive", run_hz=25.0)
    bench.run(4)
    assert bench.write("6.43", 1) is None
    assert bench.word("6.43") == 0
    bench.drive.halt()
    bench.run(4)
    bench.taken("6.43", 1)


def test_fault_clears_ready_until_bit_13() -> None:
    bench = Bench("powerdrive", {"6.43": 1})
    bench.taken("6.42", 0x0003)
    bench.run(4)
    bench.drive.provoke(94)
    assert bench.word("10.40") & READY == 0
    bench.taken("6.42", 0)
    bench.taken("6.42", 0x2000)
    assert bench.word("10.40") & READY


def test_jog_runs_at_jog_speed() -> None:
    bench = Bench("powerdrive", {"6.43": 1})
    bench.taken("6.42", 0x0005)
    bench.run(4)
    assert bench.drive.motor.frequency == pytest.approx(5)


PRESET_WORD = 0x0103
"""Unlock, run forward, and bit 8: the preset reference."""


def library_drive(**sets: int) -> SimulatedDrive:
    """A Powerdrive by the profile that comes with the panel, commanded by its control word."""
    words = {"6.43": 1, **sets}
    return SimulatedDrive(library.load("powerdrive"), DriveSpec("powerdrive", sets=words))


def written(drive: SimulatedDrive, code: str, word: int) -> bool:
    """Return True if the drive accepted a word of the line."""
    pdu = struct.pack(">BHH", 6, drive.profile[code].address, word)
    return drive.line_side.answer(1, pdu) == pdu


def after(drive: SimulatedDrive, seconds: float) -> float:
    """The output frequency after some time."""
    for _ in range(round(seconds / 0.05)):
        drive.step(0.05)
    return drive.motor.frequency


def test_bit_8_chooses_the_first_preset_in_rpm() -> None:
    drive = library_drive()
    assert written(drive, "1.21", 600)
    assert written(drive, "6.42", PRESET_WORD)
    assert drive.raw("1.42") == 1
    assert after(drive, 5) == pytest.approx(20)
    assert written(drive, "1.21", 1200), "a motor that runs follows it"
    assert after(drive, 5) == pytest.approx(40)
    assert written(drive, "6.42", 0x0003)
    assert after(drive, 5) == pytest.approx(30), "the analogue reference at the terminals"


def test_preset_does_not_exceed_the_maximum() -> None:
    drive = library_drive(**{"1.06": 900})
    assert written(drive, "1.21", 1500)
    assert written(drive, "6.42", PRESET_WORD)
    assert after(drive, 5) == pytest.approx(30)


def test_other_words_of_unknown_scale_cannot_be_written() -> None:
    assert not written(library_drive(), "1.06", 3000)
