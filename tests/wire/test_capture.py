"""Files of frames as tshark reads them, which the project did not write."""

from __future__ import annotations

import shlex
import struct
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.programs import PATIENCE
from tui.wire.capture.forms import (
    READ_RAW,
    ModbusTcpForm,
    PacketForm,
    RtuForm,
    interface_block,
    packet_block,
    section_block,
)

LINE = "serial:/dev/ttyUSB0,19200,8E1"
WALL = 1_767_225_600.25
EXCHANGES = [
    (2, "030C810002", "030406 37 01A9"),
    (3, "0621350006", "0621350006"),
    (3, "1021350002040006 0007", "9002"),
    (2, "2B0E0100", "2B0E010100000100 03 41 5456"),
    (2, "17 0C81 0002 2135 0001 02 0006", "17 04 0637 01A9"),
]
BROADCAST = "0621350000"

Peer = Callable[[str, str], str]


def file_of(form: PacketForm, path: Path) -> Path:
    """A file with exchanges of several functions, noise and a broadcast."""
    blocks = [section_block("drivepanel"), interface_block(form.link_type, LINE)]
    wall = WALL

    def add(device: int, pdu: str, *, request: bool) -> None:
        nonlocal wall
        packet = form.frame_packet(device, bytes.fromhex(pdu), request=request)
        blocks.append(packet_block(packet.data, wall, packet.comment))
        wall += 0.125

    for device, request, reply in EXCHANGES:
        add(device, request, request=True)
        add(device, reply, request=False)
    if noise := form.noise_packet(b"\x00\xff"):
        blocks.append(packet_block(noise.data, wall, noise.comment))
    add(0, BROADCAST, request=True)
    path.write_bytes(b"".join(blocks))
    return path


def reported(program: str, path: Path, *options: str) -> str:
    """Output of tshark for a file."""
    done = subprocess.run(
        [program, *options, "-r", str(path)],
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def fields(program: str, path: Path, *names: str, options: tuple[str, ...] = ()) -> list[list[str]]:
    """Fields of each packet, as tshark takes them out."""
    wanted = [part for name in names for part in ("-e", name)]
    text = reported(program, path, *options, "-T", "fields", "-E", "separator=;", *wanted)
    return [line.split(";") for line in text.splitlines()]


def test_tshark_decodes_modbus_tcp_without_configuration(peer: Peer, tmp_path: Path) -> None:
    path = file_of(ModbusTcpForm(), tmp_path / "frames.pcapng")
    found = fields(
        peer("tshark", "tshark"), path,
        "_ws.col.Protocol", "mbtcp.unit_id", "mbtcp.trans_id", "modbus.func_code", "ip.dst",
    )  # fmt: skip
    assert {row[0] for row in found} == {"Modbus/TCP"}
    sent = [row for row in found if row[4].startswith("192.0.2.")]
    requested = [(d, int(request[:2], 16)) for d, request, _ in EXCHANGES]
    assert [(int(row[1]), int(row[3])) for row in sent] == [*requested, (0, 6)]
    assert [row[4] for row in sent] == [f"192.0.2.{item[1]}" for item in sent]
    # a reply has the number of its request
    assert [row[1:4] for row in found[0:-1:2]] == [item[1:4] for item in found[1::2]]


@pytest.mark.sweep
def test_tshark_finds_values_and_no_errors_in_modbus_tcp(peer: Peer, tmp_path: Path) -> None:
    path = file_of(ModbusTcpForm(), tmp_path / "frames.pcapng")
    program = peer("tshark", "tshark")
    checked = ("-o", "ip.check_checksum:TRUE", "-o", "tcp.check_checksum:TRUE")
    assert reported(program, path, *checked, "-Y", "_ws.malformed or tcp.analysis.flags") == ""
    sums = fields(program, path, "ip.checksum.status", "tcp.checksum.status", options=checked)
    assert {tuple(sum_) for sum_ in sums} == {("1", "1")}
    (values,) = [
        field
        for field in fields(program, path, "modbus.regnum16", "modbus.regval_uint16")
        if field[0] == "3201,3202"
    ]
    assert values[1] == "1591,425"
    (refused,) = [field for field in fields(program, path, "modbus.exception_code") if field[0]]
    assert refused == ["2"]


def test_file_has_times_line_and_noise(peer: Peer, tmp_path: Path) -> None:
    path = file_of(ModbusTcpForm(), tmp_path / "frames.pcapng")
    found = fields(
        peer("tshark", "tshark"), path, "frame.time_epoch", "frame.interface_name", "frame.comment"
    )
    assert found[0] == ["1767225600.250000000", LINE, ""]
    assert float(found[1][0]) == WALL + 0.125
    assert found[-1][2] == "before it, no frame: 00 FF"


def test_tshark_reads_raw_frames_as_configured(peer: Peer, tmp_path: Path) -> None:
    """By the very option that the command names, on a file with a checksum fault."""
    program = peer("tshark", "tshark")
    path = file_of(RtuForm(), tmp_path / "raw.pcapng")
    _, *options, last, file = shlex.split(READ_RAW)
    assert (last, file) == ("-r", "FILE")
    names = ("_ws.col.Protocol", "mbrtu.unit_id", "mbrtu.crc16.status")
    whole = fields(program, path, *names, options=tuple(options))[: 2 * len(EXCHANGES)]
    requested = [[str(device)] * 2 for device, _, _ in EXCHANGES]
    assert whole == [["Modbus RTU", device, "1"] for pair in requested for device in pair]
    damaged = tmp_path / "damaged.pcapng"
    damaged.write_bytes(path.read_bytes().replace(bytes.fromhex("0637"), b"\x06\x38", 1))
    checked = fields(program, damaged, *names, options=tuple(options))
    assert [row[2] for row in checked[:3]] == ["1", "0", "1"]


def test_raw_packets_have_the_bytes_of_the_line() -> None:
    form = RtuForm()
    assert form.frame_packet(1, bytes.fromhex("0318750005"), request=True).data.hex() == (
        "010318750005" + "92b3"
    )
    noise = form.noise_packet(b"\x01")
    assert noise is not None
    assert noise.data == b"\x01"


@pytest.mark.parametrize("length", range(9))
def test_every_block_has_padded_and_repeated_length(length: int) -> None:
    block = packet_block(bytes(length), WALL, "x" * length)
    first, last = struct.unpack("<I", block[4:8])[0], struct.unpack("<I", block[-4:])[0]
    assert first == last == len(block)
    assert len(block) % 4 == 0


def test_sequence_numbers_wrap() -> None:
    form = ModbusTcpForm()
    for _ in range(0x10001):
        packet = form.frame_packet(1, bytes.fromhex("0318750005"), request=True)
    assert struct.unpack(">H", packet.data[40:42])[0] == 1
