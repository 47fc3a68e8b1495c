"""Walks through the Drivecom chart of the Altivar 31, 312 and 71, and the I/O profile."""

from __future__ import annotations

import pytest

from .bench import Bench

REMOTE, POWER, REACHED, REVERSE = 0x0200, 0x0010, 0x0400, 0x8000


def started(profile: str = "atv71", **more: object) -> Bench:
    """A drive in Operation enabled at a reference of 30.0 Hz."""
    bench = Bench(profile, **more)  # type: ignore[arg-type]
    bench.taken("LFR", 300)
    for command in (6, 7, 15):
        bench.taken("CMD", command)
    return bench


def test_atv71_start_sequence_has_the_status_words_of_the_manual() -> None:
    bench = Bench("atv71")
    bench.taken("LFR", 500)
    assert bench.word("ETA") == 0x0250
    seen = []
    for command in (6, 7, 15):
        bench.taken("CMD", command)
        seen.append(bench.word("ETA"))
    assert seen == [0x0231, 0x0233, 0x0237]
    bench.run(3.2)
    assert bench.word("ETA") == 0x0637
    assert bench.word("RFR") == 500


def test_atv312_start_sequence_has_no_power_bit() -> None:
    bench = Bench("atv312")
    bench.taken("LFR", 500)
    seen = []
    for command in (6, 7, 15):
        bench.taken("CMD", command)
        seen.append(bench.word("ETA"))
    assert seen == [0x0221, 0x0223, 0x0227]
    bench.run(3.2)
    assert bench.word("ETA") == 0x0627


def test_reverse_shows_in_bit_15_once_the_motor_turns_that_way() -> None:
    bench = started()
    bench.run(2.5)
    bench.taken("CMD", 0x080F)
    assert not bench.word("ETA") & REVERSE
    bench.run(6)
    assert bench.word("ETA") == 0x8637
    assert bench.word("RFR") == 0x10000 - 300
    assert bench.word("RFRD") > 0x8000


def test_negative_reference_reverses_and_bit_11_turns_it_back() -> None:
    bench = started()
    bench.taken("LFR", -300)
    bench.run(6)
    assert bench.word("ETA") & REVERSE
    bench.taken("CMD", 0x080F)
    bench.run(6)
    assert not bench.word("ETA") & REVERSE


@pytest.mark.parametrize(
    ("command", "status"),
    [(0x0006, 0x0231), (0x0000, 0x0250), (0x000D, 0x0250)],
)
def test_shutdown_and_disable_voltage_coast_immediately(command: int, status: int) -> None:
    bench = started()
    bench.run(3)
    bench.taken("CMD", command)
    assert bench.word("ETA") == status
    bench.run(0.1)
    assert bench.word("RFR") == 0
    assert bench.drive.motor.rotor > 20, "the motor coasts"


def test_disable_operation_ramps_down_then_leaves_enabled() -> None:
    bench = started()
    bench.run(3)
    bench.taken("CMD", 7)
    bench.run(0.9)
    assert 100 < bench.word("RFR") < 250
    assert bench.word("ETA") & 0x6F == 0x27
    bench.run(3)
    assert bench.word("ETA") & 0x6F == 0x23
    assert not bench.drive.motor.energised


def test_enable_during_the_ramp_down_continues_running() -> None:
    bench = started()
    bench.run(3)
    bench.taken("CMD", 7)
    bench.run(0.5)
    bench.taken("CMD", 15)
    bench.run(3)
    assert bench.word("ETA") == 0x0637


def test_quick_stop_brakes_faster_than_the_ramp_and_locks() -> None:
    bench = started()
    bench.run(3)
    bench.taken("CMD", 2)
    assert bench.word("ETA") & 0x6F == 0x07
    bench.run(1)
    assert bench.word("RFR") == 0
    bench.taken("CMD", 15)
    assert bench.word("ETA") & 0x6F == 0x07
    bench.taken("CMD", 0)
    assert bench.word("ETA") & 0x6F == 0x40


def test_halt_stops_but_stays_enabled() -> None:
    bench = started()
    bench.run(3)
    bench.taken("CMD", 0x010F)
    bench.run(3)
    assert bench.word("RFR") == 0
    assert bench.word("ETA") == 0x0637
    bench.taken("CMD", 0x000F)
    bench.run(3)
    assert bench.word("RFR") == 300


def test_commands_out_of_order_change_nothing() -> None:
    bench = Bench("atv71")
    for command in (7, 15, 2):
        bench.taken("CMD", command)
        assert bench.word("ETA") & 0x6F == 0x40


def test_enable_from_ready_works_on_atv71_but_not_on_atv312() -> None:
    for profile, state in (("atv71", 0x27), ("atv312", 0x21)):
        bench = Bench(profile)
        bench.taken("CMD", 6)
        bench.taken("CMD", 15)
        assert bench.word("ETA") & 0x6F == state


def test_enable_below_access_level_3_starts_immediately() -> None:
    bench = Bench("atv312", {"LAC": 0})
    bench.taken("LFR", 300)
    assert bench.word("ETA") & 0x6F == 0x27, "enabled by itself at power-up"
    bench.run(1)
    assert bench.word("RFR") == 0
    bench.taken("CMD", 15)
    bench.run(2)
    assert bench.word("RFR") == 300


def test_atv312_configuration_write_returns_from_ready_to_disabled() -> None:
    for profile, state in (("atv312", 0x40), ("atv71", 0x21)):
        bench = Bench(profile)
        bench.taken("CMD", 6)
        bench.taken("SFR", 50)
        assert bench.word("ETA") & 0x6F == state


# Channels and references


def test_line_without_the_command_channel_has_no_effect() -> None:
    bench = Bench("atv71", {"FR1": 1})
    for command in (6, 7, 15):
        bench.taken("CMD", command)
    assert bench.word("ETA") & 0x6F == 0x40
    assert not bench.word("ETA") & REMOTE


def test_with_separate_channels_the_command_follows_cd1() -> None:
    for channel, state in ((1, 0x40), (10, 0x21)):
        bench = Bench("atv71", {"CHCF": 2, "CD1": channel, "FR1": 164})
        bench.taken("CMD", 6)
        assert bench.word("ETA") & 0x6F == state


def test_last_reference_applies_within_low_and_high_speed() -> None:
    bench = started()
    bench.taken("LFRD", 600)
    bench.run(3)
    assert bench.word("RFR") == 200
    bench.taken("HSP", 150)
    bench.run(3)
    assert bench.word("RFR") == 150
    assert bench.word("ETA") & 0x0800, "reference outside its limits"
    bench.taken("LFR", 100)
    bench.taken("LSP", 120)
    bench.run(3)
    assert bench.word("RFR") == 120


def test_ramps_follow_their_increment() -> None:
    bench = Bench("atv71", {"INR": 2, "ACC": 10})
    bench.taken("LFR", 500)
    for command in (6, 7, 15):
        bench.taken("CMD", command)
    bench.run(5)
    assert bench.word("RFR") == pytest.approx(250, abs=3), "10 s, not 1.0 s"


def test_high_resolution_reference_is_in_32767ths() -> None:
    bench = Bench("atv71", {"TFR": 600})
    bench.taken("CMI", 0x0200)
    bench.taken("LFR", 32767 // 2)
    for command in (6, 7, 15):
        bench.taken("CMD", command)
    bench.run(5)
    assert bench.drive.motor.frequency == pytest.approx(30, abs=0.1)
    assert bench.word("RFR") == pytest.approx(32767 // 2, abs=60)


# What another master, or the terminals, ordered before


def test_motor_left_running_by_another_master_is_taken_over_smoothly() -> None:
    bench = Bench("atv71", run_hz=40.0)
    bench.run(5)
    assert bench.word("RFR") == 400
    assert (bench.word("CMD"), bench.word("LFR")) == (0x000F, 400)
    assert bench.word("ETA") == 0x0637
    bench.taken("CMD", 15)
    bench.run(1)
    assert bench.word("RFR") == 400
    bench.taken("LFR", 100)
    bench.run(5)
    assert bench.word("RFR") == 100
    bench.taken("CMD", 7)
    bench.run(5)
    assert bench.word("ETA") & 0x6F == 0x23


def test_removed_terminal_command_stops_on_the_ramp() -> None:
    bench = Bench("atv71", {"FR1": 1}, run_hz=40.0)
    bench.run(5)
    bench.drive.halt()
    bench.run(1)
    assert 100 < bench.word("RFR") < 400
    bench.run(5)
    assert bench.word("ETA") & 0x6F == 0x40


# Faults


def test_fault_stops_the_motor_until_a_rising_edge_of_bit_7() -> None:
    bench = started()
    bench.run(3)
    bench.drive.provoke("obf")
    assert bench.word("ETA") & 0x4F == 0x08
    assert bench.word("LFT") == 18
    assert bench.word("ETI") & 4
    bench.run(0.1)
    assert bench.word("RFR") == 0
    bench.taken("CMD", 15)
    assert bench.word("ETA") & 0x4F == 0x08
    bench.taken("CMD", 0x80)
    assert bench.word("ETA") & 0x6F == 0x40
    assert bench.word("LFT") == 18, "the last fault stays readable"
    bench.run(5)
    assert bench.word("RFR") == 0, "nothing starts by itself"


def test_fault_reset_needs_an_edge_of_bit_7() -> None:
    bench = Bench("atv71")
    bench.taken("CMD", 0x80)
    bench.drive.provoke("ObF")
    bench.taken("CMD", 0x80)
    assert bench.word("ETA") & 0x4F == 0x08
    bench.taken("CMD", 0)
    bench.taken("CMD", 0x80)
    assert bench.word("ETA") & 0x6F == 0x40


def test_fault_whose_cause_is_still_there_cannot_be_reset() -> None:
    bench = Bench("atv71")
    bench.drive.provoke("ObF", persists=True)
    assert not bench.word("ETI") & 4
    bench.taken("CMD", 0x80)
    assert bench.word("ETA") & 0x4F == 0x08
    bench.drive.power_cycle()
    assert bench.word("ETA") & 0x4F == 0x08
    bench.drive.clear_cause()
    bench.taken("CMD", 0)
    bench.taken("CMD", 0x80)
    assert bench.word("ETA") & 0x6F == 0x40


@pytest.mark.parametrize(("profile", "history"), [("atv71", (9, 18)), ("atv312", (18, 0))])
def test_fault_history_shifts(profile: str, history: tuple[int, int]) -> None:
    """On the ATV71 it begins with the last fault, on the ATV312 with the one before it."""
    bench = Bench(profile)
    for fault in ("ObF", "OCF"):
        bench.drive.provoke(fault)
        bench.taken("CMD", 0)
        bench.taken("CMD", 0x80)
    assert bench.word("LFT") == 9
    assert (bench.word("DP1"), bench.word("DP2")) == history
    bench.drive.power_cycle()
    assert bench.word("DP1") == history[0], "a history outlives the power-down"


# I/O profile


def test_io_profile_runs_by_single_bits_with_its_own_status() -> None:
    bench = Bench("atv71", {"CHCF": 3, "CD1": 10, "RSF": 167})
    bench.taken("LFR", 300)
    assert bench.word("ETA") & 0x2E == 0x22
    bench.taken("CMD", 1)
    bench.run(3)
    assert bench.word("ETA") & 0x2E == 0x26
    assert bench.word("RFR") == 300
    bench.taken("CMD", 2)
    bench.run(6)
    assert bench.word("RFR") == 0x10000 - 300
    bench.taken("CMD", 0)
    bench.run(6)
    assert bench.word("ETA") & 0x2E == 0x22
    bench.drive.provoke("OCF")
    assert bench.word("ETA") & 0x0E == 0x08
    bench.taken("CMD", 0x80)
    assert bench.word("ETA") & 0x0E == 0x02


def test_word_6_in_the_io_profile_is_a_run_command() -> None:
    bench = Bench("atv71", {"CHCF": 3, "CD1": 10})
    bench.taken("LFR", 300)
    bench.taken("CMD", 6)
    bench.run(3)
    assert bench.word("RFR") == 0x10000 - 300


def test_fault_leaves_a_record_of_the_operating_values() -> None:
    bench = started()
    bench.run(3)
    status, current = bench.word("ETA"), bench.word("LCR")
    bench.drive.provoke("OCF")
    assert (bench.word("EP0"), bench.word("LCP0")) == (status, current)
    bench.taken("CMD", 0)
    bench.taken("CMD", 0x80)
    bench.drive.provoke("ObF")
    assert (bench.word("EP1"), bench.word("LCP1")) == (status, current)
    assert bench.word("LCP0") == 0


def test_access_level_3_resets_the_channels_to_factory() -> None:
    bench = Bench("atv312", {"LAC": 0, "CHCF": 2})
    bench.taken("LAC", 1)
    assert bench.word("FR1") == 164
    bench.taken("LAC", 2)
    assert [bench.word(code) for code in ("FR1", "CD1", "CHCF")] == [1, 1, 1]
