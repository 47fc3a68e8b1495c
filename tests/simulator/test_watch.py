"""Communication timeout of a drive: its start, its refresh, its reactions."""

from __future__ import annotations

import pytest

from .bench import Bench


def running(reaction: int, profile: str = "atv71") -> Bench:
    """A drive at 30 Hz with a timeout of 1.0 s."""
    bench = Bench(profile, {"TTO": 10, "SLL": reaction, "ACC": 5, "DEC": 20})
    bench.taken("LFR", 300)
    for command in (6, 7, 15):
        bench.taken("CMD", command)
    bench.run(0.8)
    assert bench.word("RFR") == 300
    return bench


def test_reads_restart_the_timeout() -> None:
    bench = running(1)
    for _ in range(6):
        bench.run(0.8)
        bench.word("ETA")
    assert bench.drive.fault is None


def test_communication_loss_trips_after_the_timeout() -> None:
    bench = running(1)
    bench.run(0.96)
    assert bench.drive.fault is None
    bench.run(0.1)
    assert bench.drive.fault is not None
    assert bench.drive.raw("LFT") == 5
    assert bench.drive.motor.frequency == 0


def test_timeout_starts_with_the_first_command() -> None:
    bench = Bench("atv71", {"TTO": 10, "SLL": 1})
    bench.word("ETA")
    bench.run(3)
    assert bench.drive.fault is None
    bench.taken("LFR", 0)
    bench.run(3)
    assert bench.drive.fault is not None


def test_command_of_another_master_applies_after_first_request() -> None:
    bench = Bench("atv71", {"TTO": 10, "SLL": 1}, run_hz=30.0)
    bench.run(3)
    assert bench.drive.fault is None
    bench.word("ETA")
    bench.run(3)
    assert bench.drive.fault is not None


@pytest.mark.parametrize(("reaction", "seconds"), [(5, 1.3), (6, 0.35)])
def test_ramp_and_fast_stop_precede_the_fault(reaction: int, seconds: float) -> None:
    bench = running(reaction)
    bench.run(1.04)
    assert bench.drive.raw("ETA") & 0x4F == 0x0F
    assert bench.drive.motor.frequency > 20
    bench.run(seconds)
    assert bench.drive.motor.frequency == 0
    assert bench.drive.raw("ETA") & 0x4F == 0x08


def test_dc_injection_precedes_the_fault() -> None:
    bench = running(7)
    bench.run(1.1)
    assert bench.drive.motor.braking
    bench.run(6)
    assert bench.drive.raw("ETA") & 0x4F == 0x08
    assert not bench.drive.motor.braking


def test_ignored_communication_loss_changes_nothing() -> None:
    bench = running(0)
    bench.run(5)
    assert bench.drive.motor.frequency == pytest.approx(30)
    assert bench.drive.fault is None


def test_fallback_reactions_last_as_long_as_the_loss() -> None:
    for reaction, frequency in ((2, 0), (3, 10), (4, 30)):
        bench = running(reaction)
        bench.run(4)
        assert bench.drive.motor.frequency == pytest.approx(frequency, abs=0.1)
        assert bench.drive.fault is None
        bench.taken("LFR", 200)
        bench.run(0.9)
        assert bench.drive.motor.frequency == pytest.approx(20, abs=0.1)


def test_altivar_312_without_monitoring_never_trips() -> None:
    bench = running(1, "atv312")
    bench.taken("CMI", 1 << 14)
    bench.run(3)
    assert bench.drive.fault is None


@pytest.mark.parametrize(("reaction", "hertz"), [(0, 0), (1, 25), (2, 0)])
def test_altivar_21_timeout_starts_with_the_first_frame(reaction: int, hertz: float) -> None:
    bench = Bench("atv21", {"F803": 1, "F603": reaction}, run_hz=30.0)
    bench.run(8)
    assert bench.drive.fault is None, "no frame came yet"
    bench.word("FD00")
    bench.run(1.1)
    assert bench.drive.raw("FC90") == 24
    bench.run(0.5)
    assert bench.drive.motor.frequency == pytest.approx(hertz, abs=4)
    assert bench.drive.motor.braking == (reaction == 2)


def test_timeout_of_0_is_off() -> None:
    bench = Bench("atv21", {"F803": 0})
    bench.word("FD00")
    bench.run(10)
    assert bench.drive.fault is None


def test_leroy_somer_trips_only_if_its_timeout_is_set() -> None:
    for timeout, trips in ((0, False), (20, True)):
        bench = Bench("powerdrive", {"15.07": timeout})
        bench.word("10.40")
        bench.run(3)
        assert (bench.drive.fault is not None) is trips
        assert bench.drive.raw("10.01") == (not trips)


def test_communication_fault_can_be_reset_and_recurs() -> None:
    bench = running(1)
    bench.run(2)
    bench.taken("CMD", 0)
    bench.taken("CMD", 0x80)
    assert bench.drive.fault is None
    bench.run(2)
    assert bench.drive.fault is not None


def test_power_cycle_restarts_the_timeout() -> None:
    bench = running(1)
    bench.drive.power_cycle()
    bench.run(5)
    assert bench.drive.fault is None
