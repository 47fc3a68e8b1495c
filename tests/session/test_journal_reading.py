"""Journals of any content: every whole entry is read, everything else is reported."""

from __future__ import annotations

import json
import os
from dataclasses import asdict, replace
from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.session import journal_reading
from tui.session.journal import Entry
from tui.session.journal_reading import DamagedLine, completed, read_journal, selected

from .test_journal import entry


def line_of(entry: Entry) -> bytes:
    return json.dumps(asdict(entry)).encode() + b"\n"


def reported(file: Path) -> list[Entry | DamagedLine]:
    return list(read_journal([file]))


@given(garbage=st.lists(st.binary(max_size=80).filter(lambda b: b.strip()), max_size=6))
def test_whole_entries_are_found_among_garbage(
    garbage: list[bytes], tmp_path_factory: pytest.TempPathFactory
) -> None:
    file = tmp_path_factory.mktemp("journal") / "journal.jsonl"
    parts = [line_of(entry(0))]
    for number, data in enumerate(garbage, start=1):
        parts += [data.replace(b"\n", b" ") + b"\n", line_of(entry(number))]
    file.write_bytes(b"".join(parts))
    numbers = [item.new_raw for item in reported(file) if isinstance(item, Entry)]
    assert numbers == list(range(len(garbage) + 1))


ODD = {
    "deep": b"[" * 200_000,
    "deep table": b'{"a":' * 100_000,
    "no table": b"[1, 2]",
    "huge number": b'{"device": ' + b"9" * 10_000 + b"}",
    "NUL": b"\0" * 5000,
    "another type": line_of(entry(1)).strip().replace(b'"device": 1', b'"device": "1"'),
    "a field less": b'{"time": "now", "line": "x"}',
    "UTF-16": '{"time": "now"}'.encode("utf-16"),
    "another kind": line_of(entry(1)).strip().replace(b'"write"', b'"lie"'),
    "long": b"x" * 1_000_000,
}


@pytest.mark.parametrize("name", ODD)
def test_odd_lines_are_reported_and_hide_no_entry(name: str, tmp_path: Path) -> None:
    file = tmp_path / "journal.jsonl"
    file.write_bytes(line_of(entry(1)) + ODD[name] + b"\n" + line_of(entry(2)) + b"half")
    item, odd, two, half = reported(file)
    assert (item, two) == (entry(1), entry(2))
    assert isinstance(odd, DamagedLine)
    assert isinstance(half, DamagedLine)
    assert (odd.number, half.number, half.text) == (2, 4, "half")
    assert len(odd.text) <= journal_reading.DAMAGE_SHOWN


def test_lone_surrogate_in_a_name_is_not_damage(tmp_path: Path) -> None:
    file = tmp_path / "journal.jsonl"
    odd = replace(entry(1), line="\ud83d\x1b]0;x\x07")
    file.write_bytes(line_of(odd))
    assert reported(file) == [odd]


def test_entries_of_earlier_versions_are_read(tmp_path: Path) -> None:
    file = tmp_path / "journal.jsonl"
    old = asdict(entry(1))
    del old["kind"], old["of"]
    file.write_text(json.dumps(old) + "\n" + json.dumps({**asdict(entry(2)), "new field": 1}))
    assert reported(file) == [entry(1), entry(2)]


def test_endless_file_is_read_at_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(journal_reading, "READ_MOST", 1000)
    file = tmp_path / "journal.jsonl"
    file.write_bytes(b"".join(line_of(entry(number)) for number in range(50)))
    found = [item.new_raw for item in reported(file) if isinstance(item, Entry)]
    assert 0 < len(found) < 10
    assert found == list(range(50 - len(found), 50))


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
def test_pipe_instead_of_the_file_does_not_block(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "journal.jsonl")
    with pytest.raises(OSError, match="not a regular file"):
        reported(tmp_path / "journal.jsonl")


def test_read_back_completes_only_its_own_write() -> None:
    item = replace(entry(1), time="t1", answer="no answer.")
    two = replace(entry(1), time="t2", answer="no answer.", device=2)
    back = replace(item, time="t3", kind="read-back", of="t1", answer="Taken.", read_back=1)
    lone = replace(back, of="t0")
    assert completed([item, two, back, lone]) == [
        replace(item, answer="no answer. Taken.", read_back=1),
        two,
        lone,
    ]


def test_entries_are_selected_by_drive_line_and_time() -> None:
    here = [
        replace(entry(1), time="2026-03-01T08:00:00.000+00:00", line="tcp:Host:502"),
        replace(entry(2), time="2026-03-01T09:00:00.000+00:00", line="tcp:host:502", device=2),
        replace(entry(3), time="2026-03-01T10:00:00.000+00:00", line="other"),
        replace(entry(4), time="no time"),
    ]

    def numbers(**how: object) -> list[int]:
        return [item.new_raw for item in selected(here, **how)]  # type: ignore[arg-type]

    assert numbers() == [1, 2, 3, 4]
    assert numbers(device=2) == [2]
    # however it was typed
    assert numbers(lines=["tcp:HOST"]) == [1, 2]
    assert numbers(lines=["tcp:host"], device=1) == [1]
    # undecidable entries are kept
    assert numbers(since=datetime(2026, 3, 1, 9, tzinfo=UTC)) == [2, 3, 4]
