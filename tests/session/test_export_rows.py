"""Rows of values from several parameters, and frames from the rows of a record."""

from __future__ import annotations

from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.bus.model import EndedExchange
from tui.drive.profile import library
from tui.session.record.decoding import HistoryPoint
from tui.session.record.export_rows import export_rows, from_trigger
from tui.session.record.history import History, number_text
from tui.session.record.rebuilt_frames import RebuiltFrame, frames_of
from tui.session.record.schema import reply_row, stray_row

ATV71 = library.load("atv71")


def history(times: Sequence[float], *, reduced: bool = False) -> History:
    span = 9.0 if reduced else 0.0
    return History([HistoryPoint(at, at + span, at, at, at, reduced=reduced) for at in times])


def test_values_of_one_cycle_are_one_row() -> None:
    found = {"A": history([1.0, 2.0, 3.0]), "B": history([1.05, 2.05, 3.05]), "C": history([2.1])}
    rows = list(export_rows(7, found))
    assert [(row.time, sorted(row.points)) for row in rows] == [
        (1.0, ["A", "B"]), (2.0, ["A", "B", "C"]), (3.0, ["A", "B"]),
    ]  # fmt: skip
    assert {row.device for row in rows} == {7}


def test_row_has_no_value_that_was_read_more_than_a_second_after_its_first() -> None:
    rows = list(export_rows(1, {"A": history([0.0]), "B": history([1.5])}))
    assert [(row.time, list(row.points)) for row in rows] == [(0.0, ["A"]), (1.5, ["B"])]


@given(st.lists(st.floats(0, 1e5), max_size=30), st.lists(st.floats(0, 1e5), max_size=30))
def test_each_value_is_in_one_row(a: list[float], b: list[float]) -> None:
    found = {"A": history(sorted(a)), "B": history(sorted(b))}
    rows = [row for row in export_rows(1, found) if row.gap_until is None]
    for code, each in found.items():
        assert [row.points[code] for row in rows if code in row.points] == each.points
    assert [row.time for row in rows] == sorted(row.time for row in rows)


def test_time_without_readings_is_a_row_of_its_own() -> None:
    rows = list(export_rows(1, {"A": history([0, 1, 2, 3, 20, 21, 22])}))
    (gap,) = [row for row in rows if row.gap_until is not None]
    assert (gap.time, gap.gap_until, gap.points) == (3, 20, {})
    assert rows.index(gap) == 4


def test_distances_of_reduced_rows_are_no_gaps() -> None:
    rows = list(export_rows(1, {"A": history([0, 10, 20, 30], reduced=True)}))
    assert [row.gap_until for row in rows] == [None] * 4


def test_time_before_the_nearest_trigger_is_negative() -> None:
    assert from_trigger(95.0, (100.0, 200.0)) == -5.0
    assert from_trigger(130.0, (100.0, 200.0)) == 30.0
    assert from_trigger(190.0, (100.0, 200.0)) == -10.0
    assert from_trigger(1.0, ()) is None


@pytest.mark.parametrize(
    ("code", "value", "text"),
    [("RFR", 40.0, "40.0"), ("RFR", 39.97, "40.0"), ("ETA", 567.0, "567")],
)
def test_number_has_the_decimals_of_its_scale(code: str, value: float, text: str) -> None:
    assert number_text(History((), "Hz", ATV71[code]), value) == text


def test_number_of_an_unknown_scale_is_not_rounded_to_another() -> None:
    assert number_text(History((), "raw", ATV71["RFR"]), 1234.5) == "1234.5"


EXCHANGES = {
    "read": ("03 0C81 0002", "03 04 0637 01A9"),
    "input registers": ("04 0C81 0001", "04 02 0637"),
    "write": ("06 2135 0006", "06 2135 0006"),
    "write several": ("10 2135 0002 04 0006 0007", "10 2135 0002"),
    "read and write": ("17 0C81 0002 2135 0001 02 0006", "17 04 0637 01A9"),
    "identity": ("2B 0E 01 00", "2B 0E 01 01 00 00 01 00 03 41 5456"),
    "diagnostics": ("08 0000 1234", "08 0000 1234"),
}


@pytest.mark.parametrize("name", EXCHANGES)
def test_frames_of_a_row_are_those_of_its_exchange(name: str) -> None:
    request, reply = (bytes.fromhex(text) for text in EXCHANGES[name])
    ended = EndedExchange(2, request, "reply", reply, 10.0, 10.5, 1e9)
    assert list(frames_of(reply_row(ended, ""))) == [
        RebuiltFrame(2, request, 1e9 - 0.5, request=True),
        RebuiltFrame(2, reply, 1e9, request=False),
    ]


@pytest.mark.parametrize("result", ["exception", "copy"])
@pytest.mark.parametrize("name", EXCHANGES)
def test_checked_reply_that_is_not_good_is_a_frame_too(name: str, result: str) -> None:
    request = bytes.fromhex(EXCHANGES[name][0])
    reply = bytes([request[0] | 0x80, 2])
    sent, came = frames_of(reply_row(EndedExchange(2, request, result, reply, 10.0, 10.5, 1e9), ""))
    assert (sent.data, came.data, came.checked) == (request, reply, True)


@pytest.mark.parametrize("result", ["damaged", "wrong", "unsure"])
def test_bytes_that_are_no_reply_are_kept_as_received(result: str) -> None:
    request, received = bytes.fromhex(EXCHANGES["write"][0]), b"\2\x06\xff"
    ended = EndedExchange(2, request, result, received, 10.0, 10.5, 1e9)
    sent, came = frames_of(reply_row(ended, ""))
    assert sent.data == request
    assert (came.data, came.checked, came.wall) == (received, False, 1e9)


@pytest.mark.parametrize("result", ["nothing", "sent"])
@pytest.mark.parametrize("name", EXCHANGES)
def test_request_without_a_reply_is_one_frame(name: str, result: str) -> None:
    request = bytes.fromhex(EXCHANGES[name][0])
    (sent,) = frames_of(reply_row(EndedExchange(2, request, result, b"", 10.0, 10.5, 1e9), ""))
    assert (sent.data, sent.request) == (request, True)


def test_stray_frame_is_kept_as_received() -> None:
    data = b"\5\3\2\0\1\xaa\xbb"
    ended = EndedExchange(2, b"", "nothing", b"", 10.0, 10.5, 1e9, strays=(data,))
    (came,) = frames_of(stray_row(ended, data))
    assert (came.data, came.request, came.checked) == (data, False, False)
