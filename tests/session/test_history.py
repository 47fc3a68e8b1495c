"""The history of a parameter: what was recorded comes back, reduced or not, with its gaps."""

from __future__ import annotations

import json
import random
from collections.abc import Callable, Sequence
from operator import itemgetter
from pathlib import Path
from typing import NamedTuple

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from msgspec import structs

from tui.drive.profile.library import load
from tui.drive.profile.profile import Profile, digest_of
from tui.drive.values import from_words
from tui.session.record.columns import gaps_of, history_columns, reach_of_points
from tui.session.record.decoding import UNKNOWN_SCALE, WITHOUT_VALUE, HistoryPoint
from tui.session.record.history import read_history
from tui.session.record.reader import RecordReader
from tui.session.record.record_file import RAW_KEPT, RecordFile
from tui.session.record.ring import files_of_line, record_path
from tui.session.record.schema import EventRow, ReplyRow

LINE = "line-1"
DAY = 20_000
WALL = DAY * 86_400 * 1_000_000 + 40_000_000_000
"""Time of day of the first reply, in microseconds."""
MONO = 7_000_000_000
TOOK = 15_000
ATV71 = load("atv71")
SECOND = 1_000_000


def high_first(code: str) -> Profile:
    """The Altivar 71, with the other word order of one parameter."""
    rows = [
        structs.replace(item, low_word_first=False, type="int32") if item.code == code else item
        for item in ATV71.data.parameters
    ]
    return Profile(structs.replace(ATV71.data, parameters=rows))


OTHER = high_first("SMIL")


class Sent(NamedTuple):
    """One read of a parameter: seconds since the first, words, and number of the quality."""

    at: float
    words: tuple[int, ...]
    quality: int = 0


def row_of(sent: Sent, address: int, *, registers: int = 0) -> ReplyRow:
    at = round(sent.at * SECOND)
    good = sent.quality == 0
    words = b"".join(word.to_bytes(2, "big") for word in sent.words) if good else None
    return ReplyRow(
        WALL + at, MONO + at, TOOK, 1, 3, address, registers or len(sent.words), sent.quality,
        words, None, None if good else b"\x83\x02", 0, "",
    )  # fmt: skip


def profile_event(profile: Profile, at: float = 0.0, digest: str = "") -> EventRow:
    about = json.dumps({"profile": profile.id, "hash": digest or digest_of(profile)})
    return EventRow(WALL + round(at * SECOND), MONO, 1, "profile", about)


def written(
    folder: Path, rows: Sequence[ReplyRow], events: Sequence[EventRow], day: int = DAY
) -> RecordFile:
    file = RecordFile(record_path(folder, LINE, day), "serial:x", "")
    file.write(rows, events)
    return file


def expire(file: RecordFile, before: float) -> None:
    """Remove the reads of the seconds before a time, which are then only reduced."""
    mono = (MONO + before * SECOND + RAW_KEPT) / SECOND
    file.end_window(round(mono * SECOND))
    file._boot = "another"
    file._begun = MONO
    wall = (WALL + before * SECOND + RAW_KEPT) / SECOND
    while file.expire(wall, MONO / SECOND):
        pass


def points(
    folder: Path, code: str, profile: Profile = ATV71, span: tuple[float, float] = (-1e5, 1e5)
) -> Sequence[HistoryPoint]:
    files = files_of_line(folder, LINE)
    start = WALL / SECOND
    return read_history(files, 1, code, start + span[0], start + span[1], own=profile).points


def expected(profile: Profile, code: str, sent: Sent) -> float:
    entry = profile[code]
    return from_words(entry, sent.words) * float(entry.scale)


WORD = st.one_of(st.integers(0, 0xFFFF), st.integers(0x7FFE, 0x8001))
PAUSE = st.sampled_from([0.25, 1.0, 4.0, 12.0])


@st.composite
def reads(draw: Callable[..., object], count: int) -> list[Sent]:
    """Reads of `count` registers, with pauses and refusals."""
    form = st.lists(st.tuples(PAUSE, st.tuples(*[WORD] * count), st.sampled_from([0, 0, 0, 1, 2])))
    found, at = [], 0.0
    for pause, words, quality in draw(form):  # type: ignore[attr-defined]
        at += pause
        found.append(Sent(at, words, quality))
    return found


@settings(max_examples=15, deadline=None)
@given(
    st.sampled_from([("RFR", ATV71, 1), ("LCR", ATV71, 1), ("SMIL", ATV71, 2), ("SMIL", OTHER, 2)]),
    st.data(),
)
def test_history_has_each_reply_once_raw_or_reduced(
    tmp_path_factory: pytest.TempPathFactory, what: tuple[str, Profile, int], data: st.DataObject
) -> None:
    code, profile, count = what
    sent = data.draw(reads(count))
    cut = data.draw(st.floats(-1, sent[-1].at + 20)) if sent else 0.0
    folder = tmp_path_factory.mktemp("record")
    rows = [row_of(item, profile[code].address) for item in sent]
    file = written(folder, rows, [profile_event(profile)])
    expire(file, cut)
    file.close()
    found = points(folder, code, profile)
    assert sum(point.good for point in found) == sum(item.quality == 0 for item in sent)
    assert sum(point.bad for point in found) == sum(item.quality != 0 for item in sent)
    left = [item.at for item in sent if item.at > cut]
    assert all(not point.reduced for point in found if point.time - WALL / SECOND > cut + 10)
    assert len(found) >= len(left) / 50
    for point in found:
        _compare(point, profile, code, sent)


def _compare(point: HistoryPoint, profile: Profile, code: str, sent: Sequence[Sent]) -> None:
    """Compare a point with the replies in its time, by brute force."""
    begin, end = point.time - WALL / SECOND, point.end - WALL / SECOND
    offset = 0.0 if point.reduced else TOOK / SECOND
    inside = [item for item in sent if begin - offset - 1e-4 <= item.at <= end - offset + 1e-4]
    values = [expected(profile, code, item) for item in inside if item.quality == 0]
    assert len(values) == point.good
    if not values:
        assert (point.least, point.mean, point.most) == (None, None, None)
        assert point.quality != "good"
        return
    assert point.least is not None
    assert point.mean is not None
    assert point.most is not None
    assert point.quality == "good"
    assert point.least <= min(values) + 1e-6
    assert point.most >= max(values) - 1e-6
    if point.exact:
        assert point.least == pytest.approx(min(values))
        assert point.most == pytest.approx(max(values))
    size = max(abs(point.least), abs(point.most), 1.0)
    assert point.mean == pytest.approx(sum(values) / len(values), abs=size * 1e-6 + 0.02)


def test_rows_removed_while_a_file_is_read_are_taken_from_the_reduced_ones(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sent = [Sent(at, (at % 300,)) for at in range(2000)]
    file = written(tmp_path, [row_of(item, 3202) for item in sent], [profile_event(ATV71)])
    first_raw = RecordReader.first_raw

    def expire_first(reader: RecordReader) -> tuple[int, int] | None:
        expire(file, 1503)
        return first_raw(reader)

    monkeypatch.setattr(RecordReader, "first_raw", expire_first)
    found = points(tmp_path, "RFR")
    assert sum(point.good for point in found) == len(sent)
    file.close()


def test_history_joins_the_files_of_several_days(tmp_path: Path) -> None:
    for day in (DAY, DAY + 1):
        at = (day - DAY) * 86_400.0
        sent = [Sent(at, (10 + day - DAY,)), Sent(at + 1, (20,))]
        rows = [row_of(item, 3202) for item in sent]
        written(tmp_path, rows, [profile_event(ATV71, at)], day).close()
    assert [point.mean for point in points(tmp_path, "RFR")] == [1.0, 2.0, 1.1, 2.0]
    assert [point.mean for point in points(tmp_path, "RFR", span=(-10, 1000))] == [1.0, 2.0]


def test_reduced_row_that_begins_before_the_time_is_included(tmp_path: Path) -> None:
    file = written(tmp_path, [row_of(Sent(at, (at,)), 3202) for at in range(8)], [])
    file.write((), [profile_event(ATV71)])
    expire(file, 100)
    file.close()
    (point,) = points(tmp_path, "RFR", span=(5, 50))
    assert (point.least, point.good) == (0, 8)
    assert point.most == pytest.approx(0.7)
    assert points(tmp_path, "RFR", span=(8, 50)) == []


def test_word_for_no_value_in_a_longer_read_is_a_gap(tmp_path: Path) -> None:
    rows = [row_of(Sent(0, (0x8000, 5)), 3202), row_of(Sent(1, (0x8000,)), 3202)]
    rows.append(row_of(Sent(2, (7, 0x8000)), 3202))
    written(tmp_path, rows, [profile_event(ATV71)]).close()
    found = points(tmp_path, "RFR")
    assert [(point.mean, point.quality) for point in found] == [
        (None, WITHOUT_VALUE), (pytest.approx(-3276.8), "good"), (pytest.approx(0.7), "good"),
    ]  # fmt: skip


def test_word_for_no_value_in_a_reduced_row_is_a_gap(tmp_path: Path) -> None:
    rows = [row_of(Sent(at, (word, 5)), 3202) for at, word in enumerate((3, 0x8000, 4))]
    file = written(tmp_path, rows, [profile_event(ATV71)])
    expire(file, 100)
    file.close()
    assert [(point.mean, point.quality) for point in points(tmp_path, "RFR")] == [
        (None, WITHOUT_VALUE)
    ]


def test_scale_is_the_one_recorded_for_the_time(tmp_path: Path) -> None:
    acc, inr = ATV71["ACC"].address, ATV71["INR"].address
    rows = [
        row_of(Sent(0, (30,)), acc), row_of(Sent(1, (1,)), inr), row_of(Sent(2, (30,)), acc),
        row_of(Sent(3, (0,)), inr), row_of(Sent(4, (30,)), acc),
    ]  # fmt: skip
    written(tmp_path, rows, [profile_event(ATV71)]).close()
    found = points(tmp_path, "ACC")
    assert [(point.mean, point.quality) for point in found] == [
        (None, UNKNOWN_SCALE), (3.0, "good"), (pytest.approx(0.3), "good"),
    ]  # fmt: skip


def test_profile_of_the_record_decodes_and_a_changed_one_is_reported(tmp_path: Path) -> None:
    rows = [row_of(Sent(0, (30,)), 3202)]
    written(tmp_path, rows, [profile_event(ATV71, digest="0" * 64)]).close()
    files = files_of_line(tmp_path, LINE)
    start = WALL / SECOND
    found = read_history(files, 1, "RFR", start - 5, start + 5)
    assert [point.mean for point in found.points] == [3.0]
    assert "has changed since the record" in found.troubles[0]
    assert found.unit == "Hz"


def test_values_of_an_unknown_profile_are_not_decoded(tmp_path: Path) -> None:
    about = json.dumps({"profile": "gone", "hash": ""})
    rows = [row_of(Sent(0, (30,)), 3202)]
    written(tmp_path, rows, [EventRow(WALL, MONO, 1, "profile", about)]).close()
    start = WALL / SECOND
    found = read_history(files_of_line(tmp_path, LINE), 1, "RFR", start - 5, start + 5, own=ATV71)
    assert found.points == []
    assert "The values are not decoded" in found.troubles[0]


def test_each_value_is_decoded_with_the_profile_of_its_time(tmp_path: Path) -> None:
    rows = [row_of(Sent(at, (5, 0)), 8607) for at in (0, 10)]
    events = [profile_event(ATV71), profile_event(OTHER, 5)]
    written(tmp_path, rows, events).close()
    assert [point.mean for point in points(tmp_path, "SMIL", OTHER)] == [5, 5 * 65536]


def test_damaged_file_is_reported_and_the_others_are_read(tmp_path: Path) -> None:
    written(tmp_path, [row_of(Sent(0, (30,)), 3202)], [profile_event(ATV71)]).close()
    record_path(tmp_path, LINE, DAY - 1).write_bytes(b"no database at all" * 100)
    start = WALL / SECOND
    found = read_history(files_of_line(tmp_path, LINE), 1, "RFR", start - 9e4, start + 5, own=ATV71)
    assert [point.mean for point in found.points] == [3.0]
    assert "cannot be read" in found.troubles[0]


# Columns and gaps


def point_of(at: float, value: float | None, end: float | None = None) -> HistoryPoint:
    good = value is not None
    return HistoryPoint(
        at, at if end is None else end, value, value, value, "good" if good else "no reply",
        int(good), int(not good), end is not None,
    )  # fmt: skip


VALUES = st.lists(
    st.tuples(st.floats(0, 99, width=32), st.one_of(st.none(), st.floats(-50, 50, width=32)))
)


@settings(max_examples=40, deadline=None)
@given(VALUES, st.integers(1, 30), st.floats(-10, 50), st.floats(1, 120))
def test_columns_have_the_extent_and_mean_of_their_points(
    values: list[tuple[float, float | None]], count: int, start: float, span: float
) -> None:
    found = history_columns(
        [point_of(at, value) for at, value in sorted(values, key=itemgetter(0))], start, span, count
    )
    assert len(found) == count
    for place, column in enumerate(found):
        inside = [
            value
            for at, value in values
            if value is not None and (at - start) * (count / span) // 1 == place
        ]
        if not inside:
            assert column is None
            continue
        assert column is not None
        assert (column.least, column.most, column.good) == (min(inside), max(inside), len(inside))
        assert column.mean == pytest.approx(sum(inside) / len(inside), abs=1e-6)


def test_reduced_point_is_in_each_column_that_it_reaches() -> None:
    found = history_columns([point_of(0, 5, 9), point_of(12, 6)], 0, 20, 10)
    assert [column is not None and column.reduced for column in found] == [True] * 5 + [False] * 5
    assert found[6] is not None
    assert found[6].mean == 6


def test_gaps_are_failed_reads_and_times_without_any() -> None:
    taken = [point_of(at, 1.0) for at in range(10)]
    taken += [point_of(at, 1.0) for at in range(20, 30)]
    taken[5] = point_of(5, None)
    reach = reach_of_points(taken)
    assert reach == 3
    assert gaps_of(taken, reach) == [(4, 6), (9, 20)]
    assert gaps_of([point_of(0, None), point_of(2, None)], 3) == [(0, 2)]


def test_gaps_never_include_a_value() -> None:
    chance = random.Random(5)
    for _ in range(200):
        at, taken = 0.0, []
        for _ in range(chance.randrange(20)):
            at += chance.choice((0.5, 1, 9))
            taken.append(point_of(at, chance.choice((None, 1.0, 1.0))))
        gaps = gaps_of(taken, 3)
        for point in taken:
            inside = [gap for gap in gaps if gap[0] < point.time < gap[1]]
            edge = [gap for gap in gaps if gap[0] <= point.time <= gap[1]]
            assert not inside if point.mean is not None else edge


def block_event(at: float, places: dict[int, str]) -> EventRow:
    about = json.dumps({"places": places, "since": at})
    return EventRow(WALL + round(at * SECOND), MONO, 1, "block", about)


@pytest.mark.parametrize("reduced", [False, True])
def test_words_of_a_block_are_values_of_the_parameters_that_were_in_it(
    tmp_path: Path, *, reduced: bool
) -> None:
    """Near a change they are of neither parameter: the drive may have changed earlier."""
    register = ATV71.data.blocks[0].address
    rows = [row_of(Sent(at, (at,)), register) for at in range(100)]
    events = [block_event(10, {register: "LCR"}), block_event(40.5, {register: "RFR"})]
    events += [block_event(70.5, {register: "RFR", register + 1: "LCR"})]
    file = written(tmp_path, rows, [profile_event(ATV71), *events])
    if reduced:
        expire(file, 200)
    file.close()
    for code, first, last in (("LCR", 10, 35), ("RFR", 41, 99)):
        found = points(tmp_path, code)
        assert all(point.reduced is reduced for point in found)
        ends = [10 * value for point in found for value in (point.least, point.most) if value]
        assert first <= min(ends) <= first + 10 * reduced
        assert last - 10 * reduced <= max(ends) <= last
