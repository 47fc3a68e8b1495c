"""Frames in words: every example of the manuals, and random bytes."""

from __future__ import annotations

from collections.abc import Mapping

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.bus.line import Frame
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.screens.frames.choice import decoded
from tui.wire.frames import sealed

ATV71 = library.load("atv71")


def profile_of(device: int) -> Profile | None:
    return ATV71 if device == 2 else None


def no_raws(device: int) -> Mapping[str, int]:
    return {"INR": 1}


def reported(*frames: tuple[str, str], tcp: bool = False) -> list[str]:
    """Decoded frames; each with its direction and its bytes without the checksum."""
    made = []
    for direction, text in frames:
        data = bytes.fromhex(text)
        whole = data if tcp else sealed(data)
        made.append(Frame(0.0, "out" if direction == ">" else "in", whole))
    return decoded(made, profile_of, no_raws, tcp=tcp)


@pytest.mark.parametrize(
    ("frames", "output"),
    [
        ([(">", "02 03 0C81 0001"), ("<", "02 03 02 0637")], ["2 read ETA", "2 ETA 16#0637"]),
        ([(">", "02 06 2329 0032")], ["2 write ACC ← 5.0 s"]),
        ([(">", "02 06 2329 0032"), ("<", "02 06 2329 0032")][1:], ["2 wrote ACC 5.0 s"]),
        ([(">", "02 10 2329 0002 04 0032 001E")], ["2 write ACC ← 5.0 s · DEC ← 3.0 s"]),
        ([(">", "02 03 0C81 0001"), ("<", "02 83 02")][1:], ["2 refuses read: exception 2"]),
        ([("<", "02 03 02 0637")], ["2 1 word"]),
        ([(">", "05 03 0C81 0002")], ["5 read 3201 (16#0C81), 2 words"]),
        ([(">", "00 06 2135 0000")], ["all write 8501 ← 16#0000"]),
        ([(">", "02 2B 0E 01 00")], ["2 identify"]),
    ],
)
def test_frames_are_explained(frames: list[tuple[str, str]], output: list[str]) -> None:
    assert reported(*frames) == output


def test_value_that_a_simulated_drive_guesses_is_marked_in_its_reply() -> None:
    made = [
        Frame(0.0, way, sealed(bytes.fromhex(text)))  # type: ignore[arg-type]
        for way, text in (("out", "02 03 0C81 0002"), ("in", "02 03 04 0637 01F4"))
    ]
    texts = decoded(made, profile_of, no_raws, lambda _: {"RFR"}, tcp=False)
    assert texts == ["2 read ETA RFR", "2 ETA 16#0637 · RFR 50.0 Hz (guess)"]
    assert decoded(made, profile_of, no_raws, tcp=False)[1] == "2 ETA 16#0637 · RFR 50.0 Hz"


def test_reply_of_another_drive_is_not_decoded_by_the_last_request() -> None:
    assert reported((">", "02 03 0C81 0001"), ("<", "03 03 02 0637"))[1] == "3 1 word"


def test_modbus_tcp_header_precedes_the_device() -> None:
    assert reported((">", "0001 0000 0006 02 03 0C81 0001"), tcp=True) == ["2 read ETA"]


@given(
    frames=st.lists(st.tuples(st.sampled_from(["out", "in"]), st.binary(max_size=40)), max_size=6),
    tcp=st.booleans(),
)
def test_random_bytes_are_decoded_or_omitted(frames: list[tuple[str, bytes]], tcp: bool) -> None:
    made = [Frame(0.0, "out" if way == "out" else "in", data) for way, data in frames]
    assert len(decoded(made, lambda _: ATV71, no_raws, tcp=tcp)) == len(made)
