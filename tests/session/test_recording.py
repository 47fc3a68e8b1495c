"""Recordings of named codes: triggers, the seconds around them, and the file."""

from __future__ import annotations

import time
from contextlib import closing
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace
from typing import cast

import pytest

from tests.programs import wait_until
from tests.ui import fakes
from tui.drive.profile import library
from tui.drive.profile.schema import Parameter
from tui.session.record.reader import RecordReader
from tui.session.record.record_file import RecordFile
from tui.session.recording import recording_file
from tui.session.recording.recording_file import (
    RecordingFile,
    rows_of_cycle,
    values_in,
)
from tui.session.recording.triggers import (
    CycleSeen,
    Trigger,
    TriggeredRows,
    TriggerError,
    parse_trigger,
)

from .test_record import EVER, REGISTER, row_of


def at(text: str) -> float:
    return datetime.fromisoformat(f"2026-11-26T{text}").timestamp()


def look(
    wall: str = "12:00:00", fault: str = "", command: int | None = None, **numbers: float
) -> CycleSeen:
    return CycleSeen(at(wall), numbers, fault, command)


def firings(trigger: Trigger, looks: list[CycleSeen]) -> list[bool]:
    return [bool(trigger.fired(item)) for item in looks]


def test_level_fires_again_only_after_the_value_was_back() -> None:
    above = [look(LCR=value) for value in (9.0, 9.1, 9.5, 8.5, 9.2, 8.0, 9.2)]
    assert firings(parse_trigger("LCR>9,8"), above) == [0, 1, 0, 0, 0, 0, 1]
    assert firings(parse_trigger("LCR>9"), above) == [0, 1, 0, 0, 1, 0, 1]
    below = [look(RFR=value) for value in (5.0, 4.0, 5.5, 4.0, 6.0, 4.0)]
    assert firings(parse_trigger("RFR < 5 , 6"), below) == [0, 1, 0, 0, 0, 1]


def test_level_does_not_fire_without_a_value() -> None:
    assert firings(parse_trigger("LCR>9"), [look(), look(RFR=20), look(LCR=10)]) == [0, 0, 1]


def test_fault_fires_when_it_appears_and_not_if_it_was_there_before() -> None:
    looks = [look(fault="OCF"), look(fault="OCF"), look(), look(fault="SLF")]
    assert firings(parse_trigger("fault"), looks) == [0, 0, 0, 1]


def test_command_fires_when_the_command_word_changes() -> None:
    looks = [look(command=command) for command in (6, 6, None, 15, 15, 7)]
    assert firings(parse_trigger("Command"), looks) == [0, 0, 0, 1, 0, 1]


def test_time_fires_once_when_it_passes_and_not_at_the_start() -> None:
    times = ("14:29:59", "14:30:00", "14:30:01", "14:31:00")
    assert firings(parse_trigger("14:30"), [look(time) for time in times]) == [0, 1, 0, 0]
    assert firings(parse_trigger("14:30"), [look("14:30:01"), look("14:30:02")]) == [0, 0]
    # a clock that is set forward over it
    assert firings(parse_trigger("9:05:07"), [look("08:00:00"), look("11:00:00")]) == [0, 1]


@pytest.mark.parametrize(
    "text", ["", "faults", "25:00", "LCR", "LCR>", "LCR>x", "LCR>9,10", "R<5,4"]
)
def test_invalid_trigger_is_refused(text: str) -> None:
    with pytest.raises(TriggerError, match=r"trigger|wrong side"):
        parse_trigger(text)


def test_rows_of_the_seconds_around_a_trigger_are_passed_on_once() -> None:
    rows = TriggeredRows(before=2.0, after=1.0, always=False)
    passed = [
        row.mono
        for second in range(10)
        for row in rows.take(second, [row_of(second, mono=second)], fired=second == 5)
    ]
    first = row_of(0, mono=0).mono
    assert [(mono - first) // 1_000_000 for mono in passed] == [3, 4, 5, 6]


def test_rows_without_triggers_are_all_passed_on() -> None:
    rows = TriggeredRows(before=0.0, after=0.0, always=True)
    assert [len(rows.take(second, [row_of(1)], fired=False)) for second in range(3)] == [1, 1, 1]


def test_rows_that_the_disk_refuses_are_written_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError("database or disk is full")

    file = RecordingFile(tmp_path / "values.sqlite", "serial:x", "record")
    with monkeypatch.context() as patch:
        patch.setattr(RecordFile, "write", full)
        file.add([row_of(1, mono=1)])
        file.write()
        wait_until(lambda: bool(file.trouble), "trouble")
    file.add([row_of(2, mono=2)])
    file.close()
    assert (file.trouble, file.written, file.lost) == ("", 2, 0)
    with closing(RecordReader(file.path)) as reader:
        assert [item.word for item in reader.words(1, REGISTER, *EVER)] == [1, 2]
        assert sum(item.good for item in reader.reduced(1, REGISTER, *EVER)) == 2


def test_value_has_the_time_of_its_reply_and_not_of_the_end_of_its_cycle() -> None:
    now = time.monotonic()
    reading = fakes.readings_of(library.load("atv71"), {"RFR": 300}, now - 2.0)["RFR"]
    (row,) = rows_of_cycle(1, [reading], wall=1e9)
    assert row.utc / 1e6 == pytest.approx(1e9 - 2.0, abs=1.0)
    assert row.mono == round((now - 2.0) * 1e6)


def test_failed_reads_are_recorded_and_count_as_no_values(tmp_path: Path) -> None:
    file = RecordingFile(tmp_path / "values.sqlite", "serial:x", "record")
    file.add([row_of(1, mono=1), row_of(0, mono=2, result="exception")])
    file.close()
    assert file.written == 1
    place = cast("Parameter", SimpleNamespace(function=3, address=REGISTER))
    assert values_in(file.path, [(1, place)]) == 1
    with closing(RecordReader(file.path)) as reader:
        assert [item.word for item in reader.words(1, REGISTER, *EVER)] == [1, None]


def test_recording_is_flushed_in_time_for_a_power_cut(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recording_file, "FLUSHED_EVERY", 0.0)
    file = RecordingFile(tmp_path / "values.sqlite", "serial:x", "record")
    for word in (1, 2):
        file.add([row_of(word, mono=word)])
        file.write()
        wait_until(lambda word=word: file.written == word, "the row is written")  # type: ignore[misc]
    cut = tmp_path / "cut.sqlite"
    cut.write_bytes(file.path.read_bytes())  # without the log, as it is not flushed
    with closing(RecordReader(cut)) as reader:
        assert [item.word for item in reader.words(1, REGISTER, *EVER)] == [1]
    file.close()


def test_clock_that_jumps_is_recorded_and_reported(tmp_path: Path) -> None:
    reported: list[str] = []
    file = RecordingFile(tmp_path / "values.sqlite", "serial:x", "record", reported.append)
    ahead = [row_of(word, mono=word, wall=1000.0 + word) for word in (1, 2)]
    file.add(ahead)
    file.add([row_of(3, mono=3, wall=1000.0 + 3 - 3600)])
    file.close()
    assert reported == ["The computer's clock jumped by -3600.000 s."]
    with closing(RecordReader(file.path)) as reader:
        assert [item.word for item in reader.words(1, REGISTER, *EVER)] == [1, 2, 3]
        (jump,) = [event.text for event in reader.events(*EVER) if event.kind == "clock"]
    assert jump == reported[0]
