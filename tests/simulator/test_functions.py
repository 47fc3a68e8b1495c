"""Functions and their limits: diagnostics, read and write in one, identification."""

from __future__ import annotations

import struct

import pytest

from .bench import Bench


@pytest.mark.parametrize(
    ("profile", "pdu", "answer"),
    [
        ("atv71", struct.pack(">BHH", 3, 3102, 64), "8303"),
        ("atv71", struct.pack(">BHH", 3, 3102, 0), "8303"),
        ("atv312", struct.pack(">BHH", 3, 3102, 30), "8303"),
        ("atv71", struct.pack(">BHHHHBH", 23, 3102, 21, 9001, 1, 2, 20), "9703"),
        ("atv71", struct.pack(">BHHHHB", 23, 3102, 1, 9001, 21, 42) + bytes(42), "9703"),
        ("atv71", bytes([1, 0, 0, 0, 1]), "8101"),
        ("atv312", bytes([8, 0, 0, 1, 2]), "8801"),
        ("atv21", bytes([23]) + bytes(9), "9701"),
        ("atv71", struct.pack(">BHH", 3, 3102, 1) + b"\0", "8303"),
    ],
)
def test_requests_beyond_the_limits_are_refused(profile: str, pdu: bytes, answer: str) -> None:
    assert Bench(profile).ask(pdu.hex()) == answer


@pytest.mark.parametrize(
    "pdu",
    [
        struct.pack(">BHH", 3, 104, 21),
        struct.pack(">BHHB", 16, 104, 13, 26) + bytes(26),
        struct.pack(">BHHHHBH", 23, 104, 21, 104, 1, 2, 1),
    ],
)
def test_leroy_somer_is_silent_beyond_its_limits(pdu: bytes) -> None:
    assert Bench("powerdrive").ask(pdu.hex()) is None


def test_function_23_writes_before_it_reads() -> None:
    bench = Bench("atv71")
    pdu = struct.pack(">BHHHHBHH", 23, 9001, 2, 9001, 2, 4, 20, 31)
    assert bench.ask(pdu.hex()) == "17040014001F"


def test_function_23_works_on_leroy_somer() -> None:
    bench = Bench("powerdrive")
    pdu = struct.pack(">BHHHHBH", 23, 104, 2, 105, 1, 2, 1500)
    assert bench.ask(pdu.hex()) == "1704000005DC"


# Diagnostics


def test_diagnostic_echo_has_any_length() -> None:
    assert Bench("atv71").ask("08000001020304") == "08000001020304"


def test_frame_count_is_readable_in_two_ways() -> None:
    bench = Bench("atv71")
    for _ in range(4):
        bench.word("ACC")
    assert bench.ask("08000E0000") == "08000E0005"
    assert bench.word("M1CT") == 6


def test_broadcasts_are_not_counted() -> None:
    bench = Bench("atv71")
    bench.drive.line_side.obey(struct.pack(">BHH", 6, 9001, 5))
    assert bench.ask("08000E0000") == "08000E0001"
    assert bench.word("ACC") == 5


def test_frame_counter_wraps_but_error_counter_saturates() -> None:
    bench = Bench("atv71")
    counters = bench.drive.server.counters
    counters.frames = counters.checksum_errors = 0xFFFF
    bench.drive.line_side.count_checksum_error()
    assert bench.ask("08000E0000") == "08000E0001", "a damaged frame counts too"
    assert bench.ask("08000C0000") == "08000CFFFF"
    assert bench.word("M1EC") == 0xFFFF


def test_counters_are_reset_by_command_and_by_power_down() -> None:
    bench = Bench("atv71")
    bench.drive.line_side.count_checksum_error()
    assert bench.ask("08000A0000") == "08000A0000"
    assert bench.ask("08000C0000") == "08000C0000"
    bench.drive.power_cycle()
    assert bench.ask("08000E0000") == "08000E0001"


@pytest.mark.parametrize(("pdu", "answer"), [("0800010000", "8801"), ("08000A0001", "8803")])
def test_unknown_diagnostics_are_refused(pdu: str, answer: str) -> None:
    assert Bench("atv71").ask(pdu) == answer


# Identification


@pytest.mark.parametrize(
    ("pdu", "answer"),
    [
        ("2B0D0100", "AB0E01"),
        ("2B0E0200", "AB0E01"),
        ("2B0E0101", "AB0E02"),
        ("2B0E01", "AB0E01"),
    ],
)
def test_altivar_71_refused_identification_has_the_mei_byte(pdu: str, answer: str) -> None:
    assert Bench("atv71").ask(pdu) == answer


@pytest.mark.parametrize(
    ("pdu", "answer"),
    [("2B0D0100", "AB01"), ("2B0E0400", "AB03"), ("2B0E0101", "AB03")],
)
def test_altivar_21_refused_identification_is_a_plain_exception(pdu: str, answer: str) -> None:
    assert Bench("atv21").ask(pdu) == answer


@pytest.mark.parametrize("read_id", [1, 2, 3])
def test_altivar_21_accepts_three_read_device_ids(read_id: int) -> None:
    reply = Bench("atv21").ask(f"2B0E{read_id:02X}00")
    assert reply is not None
    assert reply.startswith(f"2B0E{read_id:02X}01000003000D54656C")


def test_drive_name_has_at_most_16_characters() -> None:
    reply = Bench("atv71", name="PUMP NUMBER 1 BEHIND THE HALL").ask("2B0E0100")
    assert reply is not None
    assert bytes.fromhex(reply).endswith(b"\x06\x10PUMP NUMBER 1 BE")
