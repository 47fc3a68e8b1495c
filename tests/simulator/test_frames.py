"""Checksum and announced length of RTU frames, against the frames of the manuals."""

from __future__ import annotations

import pytest

from tui.simulator.server.frames import checksum, is_sealed, request_length, seal

from .manual import FRAMES, Frame


@pytest.mark.parametrize("frame", FRAMES, ids=lambda frame: f"{frame.family}-{frame.number}")
def test_frames_of_the_manuals_have_the_computed_checksum(frame: Frame) -> None:
    assert is_sealed(frame.data)
    assert seal(frame.data[:-2]) == frame.data


@pytest.mark.parametrize("frame", [f for f in FRAMES if f.printed], ids=lambda f: f"{f.number}")
def test_misprinted_checksum_is_detected(frame: Frame) -> None:
    assert frame.printed is not None
    assert not is_sealed(frame.printed)
    assert frame.printed[:-2] == frame.data[:-2]


def test_there_are_72_frames_of_which_5_are_misprinted() -> None:
    assert len(FRAMES) == 72
    assert sum(frame.printed is not None for frame in FRAMES) == 5


def test_checksum_of_nothing_is_its_start_value() -> None:
    assert checksum(b"") == 0xFFFF


@pytest.mark.parametrize(
    "frame", [f for f in FRAMES if f.direction == "request"], ids=lambda f: f"{f.number}"
)
def test_request_length_is_known_from_its_header(frame: Frame) -> None:
    wrong_byte_count = frame.meaning.startswith("Announces three bytes")
    expected = len(frame.data) - (1 if wrong_byte_count else 0)
    assert request_length(frame.data) == expected


@pytest.mark.parametrize("head", ["", "01", "0110FA010001", "0199", "01170C1E000423290002"])
def test_length_is_unknown_before_its_bytes(head: str) -> None:
    assert request_length(bytes.fromhex(head)) is None
