"""Selection of frames, their form in the list, and their storage."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.bus.api import Frame
from tui.drive.profile import library
from tui.screens.frames.choice import FrameChoice, choice_of, chosen, decoded
from tui.screens.frames.frame_view import frame_time, frames_text, gap_text, gaps
from tui.wire.frames import sealed

ATV71 = library.load("atv71")


def frame(time: float, way: str, text: str, note: str = "") -> Frame:
    return Frame(time, "out" if way == ">" else "in", sealed(bytes.fromhex(text)), note)


LOG = (
    frame(0.000, ">", "02 03 0C81 0001"),
    frame(0.010, "<", "02 03 02 0637"),
    frame(0.500, ">", "02 06 2329 0032"),
    frame(0.510, "<", "02 86 02"),
    frame(1.000, ">", "05 03 0C81 0001"),
    frame(2.000, ">", "00 06 2329 0032"),
    frame(2.500, ">", "02 03 2329 0001"),
    frame(2.510, "<", "02 03 02 0032", "late or repeated"),
    frame(3.000, ">", "02 03 0C81 0001"),
)
READ, REFUSED, SILENT, TO_ALL, LATE, LAST = [0, 1], [2, 3], [4], [5], [6, 7], [8]
EVERYTHING = list(range(len(LOG)))


def reported(frames: Sequence[Frame]) -> list[str]:
    return decoded(frames, lambda _: ATV71, lambda _: {"INR": 1}, tcp=False)


@pytest.mark.parametrize(
    ("typed", "shown"),
    [
        ("", EVERYTHING),
        ("2", [*READ, *REFUSED, *LATE, *LAST]),
        ("5", SILENT),
        ("2 5", [*READ, *REFUSED, *SILENT, *LATE, *LAST]),
        ("write", [*REFUSED, *TO_ALL]),
        ("f6", [*REFUSED, *TO_ALL]),
        ("2 write", REFUSED),
        ("READ 5", SILENT),
        # a broadcast has no reply, and the reply to the last request may still come
        ("error", [*REFUSED, *SILENT, *LATE]),
        ("errors 2", [*REFUSED, *LATE]),
        ("acc", [*REFUSED, *TO_ALL, *LATE]),
        ("eta", [*READ, *SILENT, *LAST]),
        ("repeated", LATE),
        ("23 29", []),
        ("2329", []),
        ("nothing says so", []),
    ],
)
def test_typed_filter_selects_whole_exchanges(typed: str, shown: list[int]) -> None:
    assert chosen(LOG, choice_of(typed), reported, tcp=False) == shown


def test_filter_number_is_a_drive_and_letters_match_bytes() -> None:
    assert choice_of("2329") == FrameChoice(devices=frozenset({2329}))
    assert choice_of("0c81").words == ("0c81",)
    assert chosen(LOG, choice_of("0c81"), reported, tcp=False) == [*READ, *SILENT, *LAST]


@given(typed=st.text(max_size=20), data=st.lists(st.binary(max_size=12), max_size=6))
@pytest.mark.sweep
def test_any_filter_selects_existing_frames(typed: str, data: list[bytes]) -> None:
    log = [Frame(0.0, "out" if at % 2 else "in", item) for at, item in enumerate(data)]
    found = chosen(log, choice_of(typed), reported, tcp=False)
    assert found == sorted(set(found) & set(range(len(log))))


def test_gaps_are_those_of_the_line_whatever_the_filter() -> None:
    assert gaps(LOG)[:3] == [None, pytest.approx(0.01), pytest.approx(0.49)]
    texts = [gap_text(value) for value in (None, 0.0, 0.0123, 9.99, 10.0, 3600.0)]
    assert [text.strip() for text in texts] == [
        "", "+0.0 ms", "+12.3 ms", "+9.99 s", "+10.00 s", "+3600 s",
    ]  # fmt: skip


def test_time_of_day_has_milliseconds(utc: None) -> None:
    assert frame_time(1_795_259_250.0625) == "11:07:30.062"


def test_each_saved_frame_has_a_line_with_its_gap(utc: None) -> None:
    places = chosen(LOG, choice_of("write 2"), reported, tcp=False)
    words = [reported(LOG)[at] for at in places]
    text = frames_text(LOG, places, words, 1_795_259_250.0, ["ttyUSB0", "2 frames"])
    head, count, titles, *lines = text.splitlines()
    assert (head, count) == ("# ttyUSB0", "# 2 frames")
    assert len(titles.split("\t")) == len(lines[0].split("\t")) == 6
    assert lines[0].split("\t") == [
        "2026-11-21 11:07:30.500", "490.0", "request", "2 write ACC ← 5.0 s", "",
        "02 06 23 29 00 32 D2 60",
    ]  # fmt: skip
    assert lines[1].split("\t")[1:4] == ["10.0", "reply", "2 refuses write: exception 2"]
    assert len(lines) == 2
