"""`drivepanel journal`: writes, by drive and time."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any, get_args, get_type_hints

import pytest

from tests.session.test_journal import entry
from tui.cli.commands.journal import entry_line, since
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
    assert entry_line(made).startswith("2026-11-26 14:05:09  1/")
    assert entry_line(replace(made, time="cut off")).startswith("cut off  1/")


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
    assert since(text, NOW) == wanted
