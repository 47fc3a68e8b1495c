"""Reading and writing words: what each family refuses, clamps, limits and loses."""

from __future__ import annotations

import struct

import pytest

from tui.drive.errors import UnknownParameter
from tui.simulator import DriveSpec, SimulatedDrive, SimulatorError

from .bench import Bench
from .small import PROFILES


def read(address: int, count: int) -> str:
    return struct.pack(">BHH", 3, address, count).hex()


# Unknown, protected and read-only words


def test_atv71_unknown_words_read_16_8000_next_to_known_ones() -> None:
    bench = Bench("atv71", {"CHCF": 1, "COP": 2})
    assert bench.ask(read(8400, 3)) == "0306800000010002"


def test_atv71_read_of_unknown_words_only_is_exception_2() -> None:
    assert Bench("atv71").ask(read(4000, 3)) == "8302"


def test_any_unknown_word_is_exception_2_if_gaps_are_unreadable() -> None:
    assert Bench("atv312").ask(read(8400, 3)) == "8302"


def test_protected_words_cannot_be_read_or_written_over_the_line() -> None:
    bench = Bench("atv71", protects=frozenset({"ACC"}))
    assert bench.ask(read(9001, 2)) == "03048000001E"
    assert bench.write("ACC", 5) == "8602"
    assert bench.drive.raw("ACC") == 30


@pytest.mark.parametrize(
    ("profile", "code", "answer"),
    [("atv71", "ETA", "8604"), ("atv312", "ETA", "8604"), ("atv21", "FD00", "8602")],
)
def test_read_only_word_refuses_like_its_family(profile: str, code: str, answer: str) -> None:
    assert Bench(profile).write(code, 1) == answer


def test_leroy_somer_is_silent_instead_of_an_exception() -> None:
    """Its manual documents no exception; it answers other refusals with silence."""
    bench = Bench("powerdrive")
    assert bench.write("10.40", 1) is None
    assert bench.ask(read(9999, 1)) is None
    assert bench.ask("2B0E0100") is None


# Values


def test_value_out_of_range_is_exception_3_and_not_written() -> None:
    bench = Bench("atv71")
    assert bench.write("SFR", 161) == "8603"
    assert bench.write("COP", 4) == "8603"
    assert bench.word("SFR") == 40


def test_value_beyond_another_parameter_is_clamped_on_71_and_refused_on_21() -> None:
    bench = Bench("atv71")
    bench.taken("HSP", 8000)
    assert bench.word("HSP") == 600
    assert Bench("atv21").write("FA01", 8001) == "8603"


def test_unknown_address_refuses_the_whole_request() -> None:
    bench = Bench("atv71")
    three = struct.pack(">BHHBHHH", 16, 9001, 3, 6, 11, 22, 33).hex()
    assert bench.ask(three) == "9002"
    assert bench.word("ACC") == 30


def test_refused_word_ends_a_multiple_write() -> None:
    bench = Bench("atv71", {"NCA1": 9001, "NCA2": 3201, "NCA3": 9002})
    assert bench.ask(struct.pack(">BHHBHHH", 16, 12761, 3, 6, 11, 1, 33).hex()) == "9004"
    assert (bench.word("ACC"), bench.word("DEC")) == (11, 30)


# Stopped-only words, busy drives


def test_stopped_only_words_refuse_while_the_motor_runs() -> None:
    bench = Bench("atv71", run_hz=20.0)
    bench.run(0.1)
    assert bench.write("SFR", 50) == "8604"
    bench.taken("ACC", 50)
    bench.drive.halt()
    bench.run(10)
    bench.taken("SFR", 50)


def test_busy_drive_refuses_writes_and_answers_reads() -> None:
    bench = Bench("atv21")
    bench.drive.busy = True
    assert bench.write("FA01", 100) == "8604"
    assert bench.word("FD00") == 0
    bench.drive.busy = False
    bench.taken("FA01", 100)


# Memory


def test_volatile_words_are_lost_at_power_down() -> None:
    bench = Bench("atv21")
    bench.taken("FA01", 3000)
    bench.taken("ACC", 77)
    bench.drive.power_cycle()
    assert bench.word("FA01") == 0
    assert bench.word("ACC") == 77, "this family writes its EEPROM at once"


@pytest.mark.parametrize(("code", "raw"), [("CMI", 2), ("SCS", 1)])
def test_altivar_71_keeps_settings_saved_by_command(code: str, raw: int) -> None:
    bench = Bench("atv71")
    bench.taken("ACC", 44)
    bench.drive.power_cycle()
    assert bench.word("ACC") == 30
    bench.taken("ACC", 44)
    bench.taken(code, raw)
    assert bench.word(code) == 0, "the command clears itself"
    bench.drive.power_cycle()
    assert bench.word("ACC") == 44


def test_nothing_can_be_written_during_an_eeprom_save() -> None:
    bench = Bench("atv71")
    bench.taken("CMI", 2)
    assert bench.word("ETI") & 1
    assert bench.write("ACC", 10) == "8604"
    bench.run(1)
    assert not bench.word("ETI") & 1
    bench.taken("ACC", 10)


def test_running_drive_does_not_save() -> None:
    bench = Bench("atv71", run_hz=20.0)
    bench.run(0.1)
    bench.taken("ACC", 44)
    bench.taken("CMI", 2)
    bench.drive.power_cycle()
    assert bench.word("ACC") == 30


def test_factory_reset_keeps_line_settings() -> None:
    bench = Bench("atv71")
    bench.taken("ACC", 44)
    bench.taken("TBR", 28)
    bench.taken("CMI", 1)
    assert bench.word("ACC") == 30
    assert bench.word("TBR") == 28


def test_settings_after_reset_are_read_back_immediately_but_apply_later() -> None:
    bench = Bench("atv21", {"F875": 2, "F876": 2})
    bench.taken("F875", 5)
    assert bench.word("F875") == 5
    frequency_first = bench.ask(read(0x1875, 2))
    bench.drive.alarm(0x80)
    assert bench.ask(read(0x1875, 2)) == frequency_first
    bench.drive.power_cycle()
    assert bench.ask(read(0x1875, 2)) != frequency_first


def test_address_after_reset_applies_after_the_power_cycle() -> None:
    bench = Bench("atv71")
    bench.taken("ADD", 9)
    assert bench.drive.address == 2
    bench.taken("CMI", 2)
    bench.drive.power_cycle()
    assert bench.drive.address == 9


def test_immediate_address_applies_immediately() -> None:
    bench = Bench("atv21")
    bench.taken("F802", 9)
    assert bench.drive.address == 9


# Values from power-up


def test_monitored_word_keeps_its_set_value() -> None:
    bench = Bench("atv21", {"FD00": 1234}, run_hz=40.0)
    bench.run(5)
    assert bench.word("FD00") == 1234
    assert bench.word("FE05") > 0, "others still follow the motor"


def test_set_option_accepts_codes_numbers_addresses_and_signs() -> None:
    bench = Bench("atv71", {"acc": 7, "W9002": 8, "16#219A": 0xFFFF, "LFR": -5})
    assert [bench.drive.raw(c) for c in ("ACC", "DEC", "LFRD", "LFR")] == [7, 8, -1, -5]


def test_set_values_survive_a_power_cycle() -> None:
    bench = Bench("atv71", {"ACC": 7})
    bench.drive.power_cycle()
    assert bench.word("ACC") == 7


def test_invalid_set_options_are_reported() -> None:
    with pytest.raises(UnknownParameter):
        SimulatedDrive(PROFILES["atv71"], DriveSpec("atv71", sets={"NOPE": 1}))
    with pytest.raises(SimulatorError, match="does not fit"):
        SimulatedDrive(PROFILES["atv71"], DriveSpec("atv71", sets={"ACC": 70000}))


# Indirect blocks


def test_read_of_several_words_is_exception_3_on_single_word_drives() -> None:
    bench = Bench("atv21")
    assert bench.ask(read(0xFD00, 1)) == "03020000"
    assert bench.ask(read(0xFD00, 2)) == "8303"
    assert bench.ask(read(0x1875, 1)) == "8303"
    assert bench.ask(read(0xFFFF, 1)) == "8302"


def test_unassigned_read_block_slot_has_no_value() -> None:
    assert Bench("atv21", {"F875": 2}).ask(read(0x1875, 2)) == "030400008000"


def test_write_block_needs_both_slots_assigned() -> None:
    write = struct.pack(">BHHBHH", 16, 0x1870, 2, 4, 0xC400, 1000).hex()
    assert Bench("atv21", {"F870": 1}).ask(write) == "9004"
    bench = Bench("atv21", {"F870": 1, "F871": 3})
    assert bench.ask(write) == "1018700002"
    assert (bench.word("FA00"), bench.word("FA01")) == (0xC400, 1000)


# Communication scanner


def test_scanner_reads_live_words_and_writes_through() -> None:
    bench = Bench("atv71", {"NMA1": 9001, "NMA2": 4000, "NMA3": 0, "NCA1": 9001})
    bench.taken("ACC", 55)
    assert bench.ask(read(12741, 3)) == "0306003780000000"
    assert bench.ask(struct.pack(">BHHBHH", 16, 12761, 2, 4, 66, 99).hex()) == "1031D90002"
    assert bench.word("ACC") == 66
    assert bench.word("NM1") == 66
    assert bench.word("NC1") == 66


def test_scanner_inputs_cannot_be_written() -> None:
    assert Bench("atv71", {"NMA1": 9001}).write("NM1", 1) == "8604"
