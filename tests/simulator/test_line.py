"""Several drives on one line: replies, broadcasts, and drives with other settings."""

from __future__ import annotations

import struct

import pytest

from tui.simulator import DriveSpec, LineTiming, SimulatedDrive, SimulatorError
from tui.simulator.server.answering import in_group
from tui.simulator.server.conversation import SimulatedLine
from tui.simulator.server.frames import seal

from .small import PROFILES


def line(*specs: DriveSpec, timing: LineTiming | None = None) -> SimulatedLine:
    timing = timing or LineTiming()
    drives = [SimulatedDrive(PROFILES[s.profile], s, timing=timing) for s in specs]
    return SimulatedLine(drives, timing)


def requested(on: SimulatedLine, address: int, pdu: bytes) -> bytes | None:
    reply = on.receive(seal(bytes([address]) + pdu))
    return reply.data[:-2] if reply else None


def read(address: int, count: int = 1) -> bytes:
    return struct.pack(">BHH", 3, address, count)


def write(address: int, word: int) -> bytes:
    return struct.pack(">BHH", 6, address, word)


TWO = (DriveSpec("atv71", 2), DriveSpec("atv21", 3))


def test_each_drive_answers_at_its_own_address_only() -> None:
    on = line(*TWO)
    assert requested(on, 2, read(9001)) == bytes.fromhex("020302001E")
    assert requested(on, 3, read(9)) == bytes.fromhex("0303020064")
    assert requested(on, 4, read(9)) is None


def test_broadcast_is_executed_by_all_and_not_answered() -> None:
    on = line(DriveSpec("atv71", 2), DriveSpec("atv312", 3))
    assert requested(on, 0, write(9001, 55)) is None
    assert [on.drive(a).raw("ACC") for a in (2, 3)] == [55, 55]


def test_only_broadcast_functions_are_executed() -> None:
    on = line(DriveSpec("powerdrive", 2), DriveSpec("atv71", 3))
    many = struct.pack(">BHHBH", 16, 104, 1, 2, 7)
    assert requested(on, 0, many) is None
    assert on.drive(2).raw("1.05") == 0, "Leroy-Somer: function 6 only"
    requested(on, 0, write(104, 7))
    assert on.drive(2).raw("1.05") == 7
    requested(on, 0, struct.pack(">BHHHHBH", 23, 9001, 1, 9001, 1, 2, 9))
    assert on.drive(3).raw("ACC") == 30


@pytest.mark.parametrize(
    ("own", "called", "intended"),
    [
        (11, 10, True),
        (19, 10, True),
        (21, 10, False),
        (1, 10, False),
        (115, 105, True),
        (115, 110, True),
        (125, 110, False),
        (115, 100, True),
        (5, 5, False),
        (5, 0, False),
    ],
)
def test_group_addresses_select_their_drives(own: int, called: int, intended: bool) -> None:
    assert in_group(own, called) is intended


def test_leroy_somer_drives_execute_group_requests_silently() -> None:
    on = line(DriveSpec("powerdrive", 12), DriveSpec("powerdrive", 15), DriveSpec("atv71", 21))
    assert requested(on, 10, write(104, 9)) is None
    assert [on.drive(a).raw("1.05") for a in (12, 15)] == [9, 9]
    assert requested(on, 10, read(104)) is None


def test_altivar_answers_at_an_address_ending_in_zero() -> None:
    on = line(DriveSpec("powerdrive", 12), DriveSpec("atv71", 10))
    assert requested(on, 10, read(9001)) == bytes.fromhex("0A0302001E")


def test_leroy_somer_drive_never_answers_at_a_group_address() -> None:
    assert requested(line(DriveSpec("powerdrive", 10)), 10, read(104)) is None


# Servers


def test_atv71_has_three_servers_each_at_its_address() -> None:
    sets = {"AMOA": 54, "AMOC": 104, "%MW20": 0x54, "IPC1": 139}
    on = line(DriveSpec("atv71", 2, sets=sets))
    assert requested(on, 2, read(9001)) is not None
    assert requested(on, 54, read(20, 2)) == bytes.fromhex("36030400540000")
    assert requested(on, 104, read(60006)) == bytes.fromhex("680302008B")
    assert requested(on, 54, read(9001)) == bytes.fromhex("368302")
    assert requested(on, 104, write(60006, 1)) == bytes.fromhex("688604")
    assert requested(on, 54, write(20, 7)) == bytes.fromhex("360600140007")
    assert requested(on, 54, read(20)) == bytes.fromhex("3603020007")


def test_server_whose_address_is_0_is_off() -> None:
    on = line(DriveSpec("atv71", 2))
    assert requested(on, 54, read(20)) is None


def test_requests_to_a_card_affect_neither_timeout_nor_counters() -> None:
    on = line(DriveSpec("atv71", 2, sets={"AMOA": 54, "TTO": 10}))
    drive = on.drive(2)
    requested(on, 2, write(8501, 0))
    for _ in range(4):
        drive.step(0.3)
        requested(on, 54, read(20))
    assert drive.fault is not None
    assert requested(on, 2, bytes.fromhex("08000E0000")) == bytes.fromhex("0208000E0002")


# What a drive does not understand


def test_bad_checksum_is_counted_by_the_addressed_drive() -> None:
    on = line(*TWO)
    frame = bytearray(seal(b"\x02" + read(9001)))
    frame[-1] ^= 1
    assert on.receive(bytes(frame)) is None
    assert requested(on, 2, bytes.fromhex("08000C0000")) == bytes.fromhex("0208000C0001")


def test_two_joined_frames_are_ignored() -> None:
    frame = seal(b"\x02" + read(9001))
    assert line(*TWO).receive(frame + frame) is None


@pytest.mark.parametrize("garbage", ["", "02", "0203", "020308"])
def test_fragments_are_ignored(garbage: str) -> None:
    assert line(*TWO).receive(bytes.fromhex(garbage)) is None


def test_drive_without_supply_is_silent() -> None:
    on = line(*TWO)
    on.drive(2).power_off()
    assert requested(on, 2, read(9001)) is None
    on.drive(2).power_on()
    assert requested(on, 2, read(9001)) is not None


def test_drive_with_other_settings_than_the_line_is_silent() -> None:
    on = line(DriveSpec("atv71", 2), timing=LineTiming(9600, "8N2"))
    drive = on.drive(2)
    assert (drive.raw("TBR"), drive.raw("TFO")) == (28, 5)
    requested(on, 2, write(6003, 32))
    assert requested(on, 2, read(9001)) is not None, "not before the next power-up"
    requested(on, 2, write(8504, 2))
    drive.power_cycle()
    assert requested(on, 2, read(9001)) is None


def test_drive_with_another_baud_is_silent() -> None:
    assert requested(line(DriveSpec("atv71", 2, sets={"TBR": 28})), 2, read(9001)) is None


def test_unknown_drive_address_is_reported() -> None:
    with pytest.raises(SimulatorError, match="Addresses: 2, 3"):
        line(*TWO).drive(9)


def test_time_passes_only_while_the_line_runs() -> None:
    now = [100.0]
    spec = DriveSpec("atv71", 2, run_hz=30.0)
    on = SimulatedLine([SimulatedDrive(PROFILES["atv71"], spec)], LineTiming(), lambda: now[0])
    now[0] += 1
    on.advance()
    assert on.drive(2).motor.frequency == 0
    on.start()
    now[0] += 0.6
    on.advance()
    assert on.drive(2).motor.frequency == pytest.approx(10, abs=0.1)
    now[0] += 0.001
    on.advance(at_least=0.004)
    assert on.drive(2).motor.frequency == pytest.approx(10, abs=0.1)


def test_request_costs_steps_of_the_addressed_drive_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [100.0]
    drives = [SimulatedDrive(PROFILES["atv71"], DriveSpec("atv71", a)) for a in range(1, 32)]
    on = SimulatedLine(drives, LineTiming(), lambda: now[0])
    on.start()
    stepped: list[tuple[int, float]] = []
    monkeypatch.setattr(
        SimulatedDrive, "step", lambda drive, dt: stepped.append((drive.address, dt))
    )
    now[0] += 0.5
    assert requested(on, 7, read(3201)) is not None
    assert stepped == [(7, 0.5)]
    on.advance()
    assert sorted(stepped) == [(address, 0.5) for address in range(1, 32)]


def test_turnaround_comes_from_the_profile_or_the_drive_delay() -> None:
    on = line(DriveSpec("atv71", 2), DriveSpec("powerdrive", 3))
    assert on.drive(2).station.turnaround == pytest.approx(0.005)
    assert on.drive(3).station.turnaround == pytest.approx(0.010)
    requested(on, 3, write(1505, 40))
    assert on.drive(3).station.turnaround == pytest.approx(0.040)


def test_altivar_21_with_another_protocol_is_silent_after_power_up() -> None:
    on = line(*TWO)
    assert requested(on, 3, write(0x829, 2)) is not None
    assert requested(on, 3, read(9)) is not None
    on.drive(3).power_cycle()
    assert requested(on, 3, read(9)) is None
