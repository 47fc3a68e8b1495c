"""Frames and their checksum, compared with manuals, simulator and protocol library."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymodbus.framer.rtu import FramerRTU

from tests.simulator.manual import FRAMES, Frame
from tui.bus.requests import Read, ReadWrite, WriteMany
from tui.simulator.server import frames as witness
from tui.wire.frames import (
    MAX_FRAME,
    MIN_FRAME,
    crc16,
    frame,
    frame_ends,
    hex_text,
    is_whole,
    read_frame,
    read_write_frame,
    sealed,
    write_frame,
)

WORD = st.integers(0, 0xFFFF)
WORDS = st.lists(WORD, min_size=1, max_size=20)


@pytest.mark.parametrize("example", FRAMES, ids=lambda f: f"{f.family}-{f.number}")
def test_every_manual_frame_is_complete(example: Frame) -> None:
    assert is_whole(example.data)
    assert sealed(example.data[:-2]) == example.data
    assert example.printed is None or not is_whole(example.printed)


@given(st.binary(max_size=300))
def test_checksum_matches_two_other_libraries(data: bytes) -> None:
    assert crc16(data) == witness.checksum(data)
    assert crc16(data).to_bytes(2, "little") == FramerRTU.compute_CRC(data).to_bytes(2, "big")


@given(st.binary(max_size=40))
def test_complete_frames_match_the_reference_check(data: bytes) -> None:
    assert is_whole(data) == witness.is_sealed(data)
    assert is_whole(sealed(data)) == (len(data) >= 2)


@given(st.binary(max_size=8), st.integers(0, 255), st.binary(min_size=1, max_size=252))
def test_frame_ends_with_its_checksum(before: bytes, device: int, pdu: bytes) -> None:
    data = before + frame(device, pdu)
    end = frame_end(data, len(before))
    # its beginning may happen to be a shorter frame
    assert end is not None
    assert is_whole(data[len(before) : end])
    assert frame_end(data[: end - 1], len(before)) is None


def frame_end(data: bytes, start: int = 0) -> int | None:
    return frame_ends(data).get(start)


@given(st.lists(st.binary(max_size=30) | st.binary(max_size=20).map(sealed)).map(b"".join))
def test_every_complete_frame_is_found_at_any_offset(data: bytes) -> None:
    found = {}
    for start in range(len(data)):
        ends = range(start + MIN_FRAME, min(len(data), start + MAX_FRAME) + 1)
        for end in ends:
            if is_whole(data[start:end]):
                found[start] = end
                break
    assert frame_ends(data) == found


def test_unfinished_frame_does_not_end() -> None:
    assert frame_end(b"") is None
    assert frame_end(bytes(range(1, 100))) is None
    assert frame_end(frame(1, bytes(254))) is None  # one byte more than a frame may have


@given(st.integers(1, 247), st.integers(0, 0xFF00), st.integers(0, 0xFF00), WORDS)
def test_requests_match_those_of_the_line(
    device: int, address: int, other: int, words: list[int]
) -> None:
    count = len(words)
    read = Read(device, address, count)
    assert read_frame(device, address, count) == frame(device, read.pdu())
    write = WriteMany(device, address, tuple(words))
    assert write_frame(device, address, words) == frame(device, write.pdu())
    both = ReadWrite(device, other, count, address, tuple(words))
    assert read_write_frame(device, other, count, address, words) == frame(device, both.pdu())


def test_bytes_are_formatted_as_in_the_manuals() -> None:
    assert hex_text(read_frame(1, 0x1875, 5)) == "01 03 18 75 00 05 92 B3"
