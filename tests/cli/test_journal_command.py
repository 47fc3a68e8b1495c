"""`drivepanel journal`: writes, trips, runs and lost links, by drive and time."""

from __future__ import annotations

import csv
import json
import os
from dataclasses import asdict, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest

from tests.session import test_changes as changes
from tests.session.test_journal import entry
from tui.cli.commands.journal import CHANGE_COLUMNS, change_line
from tui.session.changes import parse_since
from tui.session.journal import Entry

from .commands import ended, held, put, refused, run, tcp_line
from .printed import forms_of

NOW = datetime(2026, 3, 1, 12, 0, tzinfo=UTC)


@pytest.fixture
def journal() -> Path:
    """The journal with entries of two drives, a trip, and half a line."""
    file = Path(os.environ["DRIVEPANEL_STATE"]) / "journal.jsonl"
    file.parent.mkdir(parents=True)
    early = datetime.now(UTC) - timedelta(hours=3)
    late = datetime.now(UTC) - timedelta(minutes=5)
    entries = [
        replace(entry(1), time=early.isoformat(), line="tcp:host:502", old="3.0 s", new="4.0 s"),
        replace(entry(2), time=late.isoformat(), line="tcp:host:502", device=2, why="by \x1b[2J"),
        replace(entry(3), time=late.isoformat(), kind="fault", code="ObF", new="Overbraking"),
    ]
    file.write_text("".join(json.dumps(asdict(item)) + "\n" for item in entries) + '{"ha\x1b]0;lf')
    return file


def test_journal_lists_writes_and_reports_damage(journal: Path) -> None:
    done = ended(0, "journal")
    first, second, trip = done.stdout.splitlines()
    assert "1/tcp:host:502  ACC: 3.0 s -> 4.0 s  ok  (test)" in first
    assert "2/tcp:host:502" in second
    assert "by ␛[2J" in second
    assert "FAULT ObF Overbraking" in trip
    assert f"{journal}, line 4 is not a valid entry" in done.stderr
    assert "\x1b" not in done.output


def test_entry_begins_with_its_local_time() -> None:
    made = replace(entry(1), time="2026-11-26T14:05:09.123+00:00")
    assert change_line(made).startswith("2026-11-26 14:05:09  1/")
    assert change_line(replace(made, time="cut off")).startswith("cut off  1/")


def test_entries_are_selected_by_drive_and_time(journal: Path) -> None:
    assert len(run(0, "journal", "--drive", "2").splitlines()) == 1
    assert len(run(0, "journal", "--drive", "1/tcp:HOST").splitlines()) == 1
    assert len(run(0, "journal", "--drive", "tcp:HOST").splitlines()) == 2
    assert len(run(0, "journal", "--since", "2h").splitlines()) == 2
    assert run(0, "journal", "--since", "1m") == "No entry of the journal fits.\n"
    assert "300 is not a slave address" in refused(2, "journal", "--drive", "300")
    assert "'soon' is not a time" in refused(2, "journal", "--since", "soon")


@pytest.mark.parametrize("kind", get_args(get_type_hints(Entry)["kind"]))
def test_every_kind_of_entry_has_its_line_and_its_document(kind: Any, journal: Path) -> None:
    made = replace(entry(1), kind=kind, new="4.0 s", answer="as it was")
    journal.write_text(json.dumps(asdict(made)) + "\n")
    forms_of(run(0, "journal", "--json"))
    reported = run(0, "journal")
    assert reported.count("as it was") == 1
    assert ("->" in reported) is (kind == "write")


def test_journal_as_json_has_entries_and_damage(journal: Path) -> None:
    reported = json.loads(run(0, "journal", "--json", "--drive", "1"))
    assert reported["journal"] == str(journal)
    assert [item["new_raw"] for item in reported["entries"]] == [1, 3]
    assert set(reported["entries"][0]) == set(asdict(entry(1)))
    assert reported["damaged"] == [{"file": str(journal), "line": 4, "text": '{"ha\x1b]0;lf'}]


@pytest.fixture
def record(journal: Path) -> Path:
    """A record with a run of drive 1, and a lost line."""
    rows = [changes.status(0, changes.READY), *changes.each_second(1, 9, changes.FORWARD)]
    rows += [changes.status(9, changes.READY), changes.row(2.5, changes.REFERENCE, 400)]
    rows.append(changes.row(0.5, changes.COMMAND, 0xF, function=6, who=changes.PROGRAM))
    events = [
        changes.event(20, "line", "lost Broken pipe"),
        changes.event(25, "line", "connected"),
    ]
    folder = journal.parent / "record"
    changes.write(folder, rows, events)
    return folder


def test_journal_lists_runs_and_lost_lines_in_order(record: Path) -> None:
    run_line, lost, *entries = ended(0, "journal").stdout.splitlines()
    assert f"  1/{changes.LINE}  RUN forward at 40.0 Hz until " in run_line
    assert run_line.endswith(f" by {changes.PROGRAM}")
    assert f"  line/{changes.LINE}  LINE LOST until " in lost
    assert lost.endswith(" (5 s): Broken pipe")
    assert len(entries) == 3


def test_json_has_trips_runs_and_lost_links(record: Path) -> None:
    printed = run(0, "journal", "--json")
    forms_of(printed)
    reported = json.loads(printed)
    (found,) = reported["runs"]
    assert (found["device"], found["reference"], found["who"]) == (1, "40.0 Hz", changes.PROGRAM)
    assert (found["begin_seen"], found["end_seen"], found["least"]) == (True, True, None)
    begun, end = (datetime.fromisoformat(found[key]).timestamp() for key in ("begun", "ended"))
    assert (begun, end) == (changes.START + 1, changes.START + 9)
    assert found["within"] == pytest.approx(1, abs=0.01)
    (lost,) = reported["lost"]
    assert (lost["device"], lost["reason"]) == (None, "Broken pipe")
    (trip,) = reported["trips"]
    assert (trip["code"], trip["tripped"]) == ("ObF", None)


def test_csv_has_every_change_with_both_times(record: Path, tmp_path: Path) -> None:
    file = tmp_path / "changes.csv"
    assert run(0, "journal", "--csv", str(file)) == ""
    rows = list(csv.DictReader(file.read_text("utf-8").splitlines()))
    assert list(rows[0]) == [column.title for column in CHANGE_COLUMNS]
    assert [row["kind"] for row in rows] == ["run", "lost", "write", "write", "fault"]
    assert rows[0]["time UTC"] == "2024-10-04T22:00:01.000Z"
    assert rows[0]["until UTC"] == "2024-10-04T22:00:09.000Z"
    for row in rows:
        utc, local = (datetime.fromisoformat(row[f"time {zone}"]) for zone in ("UTC", "local"))
        assert utc == local
    assert "already exists" in refused(2, "journal", "--csv", str(file))
    assert run(0, "journal", "--csv", str(file), "--force", "--since", "1m") == ""
    assert file.read_text("utf-8").splitlines() == [",".join(rows[0])]
    assert "--force requires --csv" in refused(2, "journal", "--force")


def test_csv_of_a_run_without_an_end_says_that_it_was_running(tmp_path: Path) -> None:
    folder = Path(os.environ["DRIVEPANEL_STATE"]) / "record"
    words = [changes.READY, changes.FORWARD, changes.FORWARD]
    changes.write(folder, [changes.status(second, word) for second, word in enumerate(words)])
    run(0, "journal", "--csv", str(tmp_path / "changes.csv"))
    (row,) = csv.DictReader((tmp_path / "changes.csv").read_text("utf-8").splitlines())
    assert (row["kind"], row["why"]) == ("run", "still running")


def test_unreadable_record_is_reported_beside_the_others(record: Path) -> None:
    (record / "2024-10-04_line-9.sqlite").write_bytes(b"x" * 100)
    done = ended(0, "journal")
    assert "RUN forward" in done.stdout
    assert "2024-10-04_line-9.sqlite: " in done.stderr
    assert len(json.loads(run(0, "journal", "--json"))["unread"]) == 1


def test_missing_or_unreadable_journal_is_reported() -> None:
    state = Path(os.environ["DRIVEPANEL_STATE"])
    assert "The journal is empty" in run(0, "journal")
    state.mkdir(exist_ok=True)
    (state / "journal.jsonl").mkdir()
    assert "cannot be read: Is a directory" in refused(2, "journal")


def test_write_is_listed_in_the_journal() -> None:
    with tcp_line("atv71@1") as line:
        put(line, 9001, 50)
        run(0, "write", line, "ACC=4.0", "--arm")
        assert held(line, 9001) == 40
        assert "ACC: 5.0 s -> 4.0 s  ok" in run(0, "journal", "--drive", f"1/{line}")


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("2h", NOW - timedelta(hours=2)),
        ("90 s", NOW - timedelta(seconds=90)),
        ("1w", NOW - timedelta(days=7)),
        ("08:30", NOW.replace(hour=8, minute=30)),
        ("8:30", NOW.replace(hour=8, minute=30)),
        ("23:00", NOW.replace(hour=23) - timedelta(days=1)),
        ("2026-02-28", datetime(2026, 2, 28, tzinfo=UTC)),
        ("2026-02-28T10:00+01:00", datetime(2026, 2, 28, 9, tzinfo=UTC)),
        ("", None),
        ("999999999w", None),
        ("25:00", None),
        ("9999-99-99", None),
    ],
)
def test_since_accepts_durations_times_and_dates(text: str, wanted: datetime | None) -> None:
    assert parse_since(text, NOW) == wanted


def test_writes_to_simulated_drives_are_listed_by_their_line() -> None:
    run(0, "write", "sim:atv312", "ACC=5", "--arm")
    [written] = json.loads(run(0, "journal", "--json"))["entries"]
    assert (written["line"], written["code"]) == ("sim:atv312@1", "ACC")
    assert "ACC" in run(0, "journal", "--drive", "1/sim:atv312")
