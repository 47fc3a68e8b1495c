"""Runs and lost links of a record, and all changes on the lines since a time."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Sequence
from contextlib import closing
from dataclasses import asdict, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest

from tui.drive.profile import library
from tui.session.changes import (
    ChangeList,
    LineLoss,
    LineRun,
    change_text,
    entry_text,
    loss_text,
    read_changes,
    run_text,
)
from tui.session.journal_file import JOURNAL_NAME
from tui.session.record.record_file import RecordFile
from tui.session.record.ring import record_path
from tui.session.record.runs import RecordedRun
from tui.session.record.schema import GOOD, SILENT, EventRow, ReplyRow
from tui.session.record.silences import LostLink

from .test_journal import entry

DAY = 20_000
START = DAY * 86_400 + 79_200
"""22:00 UTC of the day."""
READY, FORWARD, REVERSE = 0x0231, 0x0637, 0x8637
STATUS, COMMAND, REFERENCE = 3201, 8501, 8502
ETA, CMD, LFR = "ETA", "CMD", "LFR"
PROGRAM = "panel on pts/3 (pid 812)"
LINE = "tcp:10.0.0.5:502"


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of the record, in a state folder without a journal."""
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path))
    return tmp_path / "record"


def row(
    second: float, address: int, word: int | None, *, function: int = 3, device: int = 1,
    who: str = "", registers: int = 1,
) -> ReplyRow:  # fmt: skip
    """A reply of one register, `second` seconds after START."""
    words = None if word is None else word.to_bytes(2, "big") * registers
    at = round((START + second) * 1e6), round(second * 1e6)
    quality = SILENT if word is None else GOOD
    return ReplyRow(
        *at, 0, device, function, address, registers, quality, words, None, None, 0, who
    )


def status(second: float, word: int | None, device: int = 1) -> ReplyRow:
    return row(second, STATUS, word, device=device)


def event(second: float, kind: str, text: str, device: int | None = None) -> EventRow:
    return EventRow(round((START + second) * 1e6), round(second * 1e6), device, kind, text)


def write(
    folder: Path,
    rows: Sequence[ReplyRow],
    events: Sequence[EventRow] = (),
    *,
    day: int = DAY,
    line: str = LINE,
    name: str = "line-1",
    profile: str = "atv71",
    reduced: bool = False,
) -> None:
    """Write a closed file of a line with one profile; `reduced` removes the replies to reads."""
    path = record_path(folder, name, day)
    file = RecordFile(path, line, "test")
    about = json.dumps({"profile": profile, "hash": ""})
    devices = sorted({item.device for item in rows})
    named = [event(-1 - day, "profile", about, device) for device in devices]
    file.write(sorted(rows, key=lambda item: item.mono), [*named, *events])
    file.close()
    if reduced:
        with closing(sqlite3.connect(path)) as base, base:
            base.execute("DELETE FROM reply WHERE function = 3")


def found(folder: Path, **wanted: object) -> ChangeList:
    return read_changes(folder, **wanted)  # type: ignore[arg-type]


def the_run(folder: Path) -> RecordedRun:
    (run,) = found(folder).runs
    return run.run


def seconds(wall: float | None) -> float:
    assert wall is not None
    return round(wall - START, 3)


def each_second(begin: int, end: int, word: int) -> list[ReplyRow]:
    return [status(second, word) for second in range(begin, end)]


def test_run_has_begin_end_direction_reference_and_program(folder: Path) -> None:
    rows = [*each_second(0, 10, READY), *each_second(10, 20, FORWARD), *each_second(20, 25, READY)]
    rows.append(row(9.2, COMMAND, 0x6, function=6, who="gateway"))
    rows.append(row(9.5, COMMAND, 0xF, function=6, who=PROGRAM))
    rows += [row(second + 0.5, REFERENCE, 400) for second in range(9, 24)]
    write(folder, rows)
    run = the_run(folder)
    assert (seconds(run.begun), seconds(run.ended)) == (10, 20)
    assert (run.direction, run.reference, run.who) == ("forward", "40.0 Hz", PROGRAM)
    assert (run.least, run.most) == ("", "")
    for within in (run.begin_within, run.end_within):
        assert within is not None
        assert within == 1


def test_reference_that_changes_has_its_extent_until_the_stop(folder: Path) -> None:
    rows = [status(0, READY), *each_second(1, 20, REVERSE), status(20, READY)]
    rows += [row(2.5, REFERENCE, 400), row(5.5, REFERENCE, 250), row(15.5, REFERENCE, 0)]
    write(folder, rows, [event(12, "stop", "Space", 1)])
    run = the_run(folder)
    assert (run.direction, run.reference) == ("reverse", "40.0 Hz")
    assert (run.least, run.most) == ("25.0 Hz", "40.0 Hz")


@pytest.mark.parametrize(
    ("word", "numbers", "texts"),
    [
        (REVERSE, (-250, -250), ("25.0 Hz", "", "")),
        (REVERSE, (-250, -400), ("25.0 Hz", "25.0 Hz", "40.0 Hz")),
        (REVERSE, (-250, 0), ("25.0 Hz", "0.0 Hz", "25.0 Hz")),
        (REVERSE, (-250, 100), ("-25.0 Hz", "-25.0 Hz", "10.0 Hz")),  # it turned the other way too
        (FORWARD, (-250, -250), ("-25.0 Hz", "", "")),
    ],
)
def test_sign_of_a_reference_is_shown_as_the_direction_of_the_run(
    word: int, numbers: tuple[int, int], texts: tuple[str, str, str], folder: Path
) -> None:
    rows = [status(0, READY), *each_second(1, 20, word), status(20, READY)]
    rows += [row(2.5 + at, REFERENCE, raw & 0xFFFF) for at, raw in enumerate(numbers)]
    write(folder, rows)
    run = the_run(folder)
    assert (run.reference, run.least, run.most) == texts
    assert f"RUN {run.direction} at {texts[0]} " in run_text(run)


def test_direction_of_a_run_is_that_of_the_motor_once_it_turns(folder: Path) -> None:
    starts = [status(0, READY), *each_second(1, 3, FORWARD)]
    write(folder, [*starts, *each_second(3, 9, REVERSE), status(9, READY)])
    assert the_run(folder).direction == "reverse"


@pytest.mark.parametrize(
    ("second", "function", "quality", "who"),
    [(9.5, 6, GOOD, PROGRAM), (9.5, 16, GOOD, PROGRAM), (9.5, 6, SILENT, ""), (-30, 6, GOOD, "")],
)
def test_program_of_a_run_is_the_one_whose_command_the_drive_took(
    second: float, function: int, quality: int, who: str, folder: Path
) -> None:
    command = row(second, COMMAND, 0xF, function=function, who=PROGRAM)._replace(quality=quality)
    write(folder, [status(9, READY), command, status(10, FORWARD), status(11, READY)])
    run = the_run(folder)
    assert run.who == who
    assert ("by another source" in run_text(run)) is (not who)


def test_motor_that_runs_at_both_ends_of_the_record_is_reported_so(folder: Path) -> None:
    write(folder, each_second(0, 5, FORWARD))
    run = the_run(folder)
    assert (run.begin_within, run.end_within) == (None, None)
    text = run_text(run)
    assert "last seen running at" in text
    assert "it ran when first read" in text
    assert "another source" not in text  # the begin was not seen


def test_times_without_a_reading_end_a_run(folder: Path) -> None:
    rows = [*each_second(0, 5, FORWARD), *each_second(70, 75, FORWARD), status(76, READY)]
    write(folder, rows)
    first, second = (item.run for item in found(folder).runs)
    assert first.end_within is None
    assert seconds(first.ended) == 4
    assert (second.begin_within, seconds(second.ended)) == (None, 76)


def test_reduced_rows_give_the_times_to_10_s(folder: Path) -> None:
    rows = [*each_second(0, 25, READY), *each_second(25, 55, FORWARD), *each_second(55, 80, READY)]
    rows += [row(second + 0.5, REFERENCE, 400) for second in range(26, 54)]
    write(folder, rows, reduced=True)
    run = the_run(folder)
    assert run.begin_within is not None
    assert run.end_within is not None
    begin, end = seconds(run.begun), seconds(run.ended)
    assert 0 < abs(begin - 25) <= run.begin_within <= 10
    assert 0 < abs(end - 55) <= run.end_within <= 10
    assert run.reference == "40.0 Hz"
    assert "times to " in run_text(run)


def test_reduced_rows_are_used_only_for_what_has_expired(folder: Path) -> None:
    rows = [*each_second(0, 20, READY), *each_second(20, 40, FORWARD), *each_second(40, 60, READY)]
    write(folder, rows)
    with closing(sqlite3.connect(record_path(folder, "line-1", DAY))) as base, base:
        base.execute("DELETE FROM reply WHERE utc < ?", (round((START + 25) * 1e6),))
    run = the_run(folder)
    assert seconds(run.begun) == 20
    assert seconds(run.ended) == 40
    assert run.end_within is not None
    assert run.end_within == 1  # whole replies give it


def test_run_over_midnight_is_one_run(folder: Path) -> None:
    midnight = 7200
    write(folder, [status(midnight - 2, READY), status(midnight - 1, FORWARD)])
    rows = [status(midnight + 1, FORWARD), status(midnight + 2, READY)]
    write(folder, rows, day=DAY + 1)
    run = the_run(folder)
    assert (seconds(run.begun), seconds(run.ended)) == (midnight - 1, midnight + 2)


@pytest.mark.parametrize(("channel", "runs"), [(1, 0), (3, 1)])
def test_chart_is_the_one_that_the_drive_uses(channel: int, runs: int, folder: Path) -> None:
    """Only with the I/O profile, bit 2 alone is a running motor."""
    words = status(1, READY), status(2, 0x0004), status(3, READY)
    write(folder, [row(0, 8401, channel), *words])
    assert len(found(folder).runs) == runs


def test_status_word_of_no_state_does_not_end_a_run(folder: Path) -> None:
    unknown = 0x0004  # in no state of the drive's own profile
    rows = [status(0, READY), status(1, FORWARD), status(2, unknown), status(3, FORWARD)]
    write(folder, [row(0, 8401, 1), *rows, *each_second(4, 70, unknown)])
    run = the_run(folder)
    assert (seconds(run.begun), seconds(run.ended)) == (1, 3)
    assert run.end_within is None


def test_unknown_or_damaged_records_hide_no_others(folder: Path) -> None:
    write(folder, each_second(0, 5, FORWARD), name="line-1")
    write(folder, each_second(0, 5, FORWARD), name="line-2", profile="nothing", line="tcp:a:502")
    path = record_path(folder, "line-3", DAY)
    path.write_bytes(b"no record" * 100)
    changes = found(folder)
    assert [item.line for item in changes.runs] == [LINE]
    (text,) = changes.unread
    assert text.startswith(f"{path}: ")


def test_lost_line_has_its_begin_end_and_reason(folder: Path) -> None:
    events = [
        event(0, "line", "connected"),
        event(10, "line", "lost No such device"),
        event(11, "line", "connecting"),
        event(14, "line", "lost No such device"),
        event(40, "line", "connected"),
        event(50, "line", "lost Broken pipe"),
    ]
    silent = [status(second, None) for second in range(11, 40, 3)]
    write(folder, [status(1, READY), *silent, status(41, READY)], events)
    first, second = found(folder).losses  # that of the drive is the line's
    assert (first.loss.device, seconds(first.loss.begun), seconds(first.loss.ended)) == (
        None, 10, 40,
    )  # fmt: skip
    assert loss_text(first.loss).endswith("(30 s): No such device")
    assert second.loss.ended is None
    assert loss_text(second.loss) == "LINE LOST since then: Broken pipe"


@pytest.mark.parametrize(("bad", "lost"), [(1, False), (2, False), (6, True)])
@pytest.mark.parametrize("reduced", [True, False])
def test_drive_without_replies_is_a_lost_link(
    bad: int, lost: bool, reduced: bool, folder: Path
) -> None:
    silent = [status(11 + second, None) for second in range(bad)]
    rows = [*each_second(0, 10, READY), *silent, *each_second(60, 70, READY)]
    if reduced and bad == 6:
        rows = [*rows, *[status(20 + second, None) for second in range(9)]]
    write(folder, rows, reduced=reduced)
    losses = found(folder).losses
    assert bool(losses) is lost
    if lost:
        loss = losses[0].loss
        assert loss.device == 1
        assert seconds(loss.ended) == 60
        assert loss_text(loss).startswith("NO ANSWER until ")


def test_changes_are_selected_by_drive_line_and_time(folder: Path) -> None:
    rows = [status(0, READY), *each_second(1, 5, FORWARD), status(5, READY)]
    later = [item._replace(utc=item.utc + 3_600_000_000, mono=item.mono + 3_600_000_000)
             for item in rows]  # fmt: skip
    other = [item._replace(device=2) for item in later]
    write(folder, [*rows, *later, *other])
    write(folder, rows, name="line-2", line="serial:/dev/ttyNone,19200,8E1")
    assert len(found(folder).runs) == 4
    since = datetime.fromtimestamp(START + 1800, UTC)
    assert [item.run.device for item in found(folder, since=since).runs] == [1, 2]
    assert len(found(folder, since=since, device=2).runs) == 1
    assert len(found(folder, lines=["tcp:10.0.0.5"]).runs) == 3
    assert len(found(folder, lines=["/dev/ttyNone"]).runs) == 1


def test_record_of_a_single_line_has_the_name_of_that_line(folder: Path, tmp_path: Path) -> None:
    own = tmp_path / "own"
    write(own, each_second(0, 5, FORWARD), line="serial:/dev/pts/3,19200,8E1")
    private = {"sim:atv71": own}
    (run,) = found(folder, private=private).runs
    assert run.line == "sim:atv71"
    assert found(folder, private=private, lines=["sim:atv31"]).runs == []


def test_file_that_was_set_aside_as_damaged_is_not_read_again(folder: Path) -> None:
    folder.mkdir()
    (folder / "2024-10-04_line-1.damaged-1728079200.sqlite").write_bytes(b"x")
    assert found(folder).unread == []


def test_run_that_began_before_the_time_has_its_begin(folder: Path) -> None:
    write(folder, [status(0, READY), *each_second(1, 50, FORWARD), status(50, READY)])
    since = datetime.fromtimestamp(START + 30, UTC)
    (run,) = found(folder, since=since).runs
    assert seconds(run.run.begun) == 1


def test_changes_of_journal_and_record_are_in_order_of_time(folder: Path) -> None:
    write(folder, [status(0, READY), status(1, FORWARD), status(2, READY)])
    begin = datetime.fromtimestamp(START, UTC)
    entries = [
        replace(entry(1), time=(begin - timedelta(seconds=5)).isoformat()),
        replace(entry(2), time="cut off"),
        replace(entry(3), time=(begin + timedelta(seconds=5)).isoformat()),
    ]
    text = "".join(json.dumps(asdict(item)) + "\n" for item in entries)
    (folder.parent / JOURNAL_NAME).write_text(text)
    changes = found(folder).in_order
    kinds = [getattr(item, "new_raw", "run") for item in changes]
    assert kinds == [1, 2, "run", 3]
    assert all(change_text(item) for item in changes)


def test_trips_of_two_drives_are_kept_apart(folder: Path) -> None:
    trip = replace(
        entry(1), kind="fault", code="ObF", new="Overbraking", answer="tripped",
        why="the trip was seen",
    )  # fmt: skip
    end = replace(trip, answer="reset", why="the end was seen", time="later")
    folder.parent.mkdir(exist_ok=True)
    text = "".join(json.dumps(asdict(item)) + "\n" for item in (trip, replace(trip, device=2), end))
    (folder.parent / JOURNAL_NAME).write_text(text)
    first, second = found(folder).trips
    assert (first.device, first.trip.code, first.trip.reset) == (1, "ObF", "later")
    assert (second.device, second.trip.reset) == (2, "")


@pytest.mark.parametrize(
    ("failed", "answered", "lost"),
    [
        ((11.0, 11.2, 11.4, 12.7), 20, [(11.0, 20.0)]),  # it was polled ever less often
        ((11.0, 11.2, 11.4), 20, []),  # one request with its tries
        ((11.0, 11.2, 12.7), 14, []),  # short
        ((11.0, 11.2, 11.4, 12.7), 200, []),  # no program polled it
    ],
)
def test_drive_whose_status_word_is_not_read_is_a_lost_link(
    failed: tuple[float, ...], answered: int, lost: list[tuple[float, float]], folder: Path
) -> None:
    rows = [row(second, LAST_FAULT, 5) for second in (*range(11), answered)]
    rows += [row(second, LAST_FAULT, None) for second in failed]
    write(folder, sorted(rows, key=lambda item: item.utc))
    losses = [(item.loss.begun - START, item.loss.ended) for item in found(folder).losses]
    assert [(begun, (ended or 0.0) - START) for begun, ended in losses] == lost


def test_every_change_has_a_text() -> None:
    run = RecordedRun(1, "atv71", 0, 9, 1, 1)
    loss = LostLink(3, 0, 90, "damaged reply")
    assert change_text(LineRun("x", run)).startswith("RUN until ")
    assert change_text(LineLoss("x", loss)).endswith("(90 s): damaged reply")


FAULT, LAST_FAULT, TRIPPED_ON = 0x0238, 7121, 9
"""A status word in fault; the word of the last fault, and the code for OCF."""


def tripped(begin: int, end: int) -> list[ReplyRow]:
    """A drive at standstill in fault from one second to another; the code is read a cycle later."""
    rows = [*each_second(0, begin, READY), *each_second(begin, end, FAULT)]
    rows += [row(second + 0.1, LAST_FAULT, 5) for second in range(begin + 1)]
    rows += [row(second + 0.1, LAST_FAULT, TRIPPED_ON) for second in range(begin + 1, end)]
    return [*rows, *each_second(end, end + 5, READY)]


def test_trip_of_the_record_is_listed_without_an_entry_of_the_journal(folder: Path) -> None:
    write(folder, tripped(20, 40))
    assert [(item.answer, item.code, item.device) for item in found(folder).entries] == [
        ("tripped", "OCF", 1),
        ("reset", "OCF", 1),
    ]
    (trip,) = found(folder).trips
    times = [datetime.fromisoformat(text) for text in (trip.trip.tripped, trip.trip.reset)]
    assert [seconds(time.timestamp()) for time in times] == [20, 40]
    since = datetime.fromtimestamp(START + 30, UTC)
    assert [item.answer for item in found(folder, since=since).entries] == ["reset"]


def test_reset_while_the_drive_was_lost_has_the_seconds_that_are_not_known(folder: Path) -> None:
    lost = [row for row in tripped(20, 40) if not START + 25 < row.utc / 1e6 < START + 39.5]
    write(folder, lost)
    assert [entry_text(item) for item in found(folder).entries] == [
        "FAULT OCF Overcurrent: tripped",
        "FAULT OCF Overcurrent: reset (time to 15 s)",
    ]
    (trip,) = found(folder).trips
    assert trip.trip.tripped


def test_reset_that_the_journal_has_noted_during_a_gap_is_listed_once(folder: Path) -> None:
    noted = [
        replace(
            entry(1), kind="fault", code="OCF", new="Overcurrent", answer=answer, why="seen",
            line="tcp:10.0.0.5", time=datetime.fromtimestamp(START + at, UTC).isoformat(),
        )
        for answer, at in (("tripped", 20), ("reset", 28))
    ]  # fmt: skip
    lines = "".join(json.dumps(asdict(item)) + "\n" for item in noted)
    (folder.parent / JOURNAL_NAME).write_text(lines)
    lost = [row for row in tripped(20, 40) if not START + 25 < row.utc / 1e6 < START + 39.5]
    write(folder, lost)
    assert [item.answer for item in found(folder).entries] == ["tripped", "reset"]


def test_begin_of_a_record_that_does_not_reach_back_far_enough_is_reported(folder: Path) -> None:
    write(folder, each_second(0, 5, READY))
    begin = datetime.fromtimestamp(START, UTC)
    (text,) = found(folder, since=begin - timedelta(hours=1)).unread
    assert text.startswith(f"Nothing of {LINE} is recorded before 20")
    assert found(folder, since=begin + timedelta(seconds=2)).unread == []
    assert found(folder).unread == []


def test_trip_that_the_journal_has_noted_is_listed_once(folder: Path) -> None:
    noted = replace(
        entry(1), kind="fault", code="OCF", new="Overcurrent", answer="tripped",
        why="the trip was seen", line="tcp:10.0.0.5",
        time=datetime.fromtimestamp(START + 21, UTC).isoformat(),
    )  # fmt: skip
    (folder.parent / JOURNAL_NAME).write_text(json.dumps(asdict(noted)) + "\n")
    write(folder, tripped(20, 40))
    assert [(item.answer, item.line) for item in found(folder).entries] == [
        ("tripped", noted.line),
        ("reset", noted.line),
    ]
    (trip,) = found(folder).trips
    assert trip.trip.reset


def test_fault_that_was_there_first_and_last_is_seen_and_has_no_end(folder: Path) -> None:
    write(folder, each_second(0, 5, FAULT))
    (item,) = found(folder).entries
    assert (item.answer, item.code, item.new) == ("seen", "", "")


def test_fault_word_that_shows_present_faults_decides(folder: Path) -> None:
    """The Altivar 21 has the fault in a word of its own."""
    words = [(0, 0), (1, 0), (2, 1), (3, 1), (4, 0)]
    address = library.load("atv21")["FC90"].address
    write(folder, [row(at, address, word) for at, word in words] + [row(0, 64769, 0x4000)],
          profile="atv21")  # fmt: skip
    assert [(item.answer, item.code) for item in found(folder).entries] == [
        ("tripped", "OC1"),
        ("reset", "OC1"),
    ]
