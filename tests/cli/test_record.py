"""`drivepanel record`: the file has what was read, always or around triggers."""

from __future__ import annotations

import errno
import json
import os
import signal
import sqlite3
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import Any
from unittest.mock import Mock

import pytest

from tests.programs import DRIVEPANEL, port_of, served, simulated
from tests.ui import fakes
from tui.cli.commands import record
from tui.drive.profile import library
from tui.session.recording.triggers import TriggeredRows

from .commands import ended, run, tcp_line

SHORT = ("--every", "0.1")


def rows(path: Path) -> list[tuple[Any, ...]]:
    columns = "device, function, address, registers, quality, words"
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as base:
        return base.execute(f"SELECT {columns} FROM reply ORDER BY id").fetchall()


def events(path: Path, kind: str) -> list[str]:
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as base:
        found = base.execute("SELECT text FROM event WHERE kind = ? ORDER BY id", (kind,))
        return [text for (text,) in found]


def test_record_has_the_words_of_the_named_codes_and_their_form(tmp_path: Path) -> None:
    path = tmp_path / "values.sqlite"
    with tcp_line("atv71@2", "atv71@3", "--set", "ACC=123") as line:
        drives = ("-d", "2", "-d", "3")
        text = run(
            0, "record", line, "ACC", "ULN", "acc", *drives, *SHORT, "--out", path, "--for", "1"
        )
    found = rows(path)
    assert text == f"Recorded {len(found)} values to {path}.\n"
    assert len(found) >= 8
    assert {row[:5] for row in found} == {
        (device, 3, address, 1, 0) for device in (2, 3) for address in (9001, 3207)
    }
    assert {row[5] for row in found if row[2] == 9001} == {b"\0\x7b"}
    forms = [json.loads(text) for text in events(path, "parameter")]
    assert [form["code"] for form in forms] == ["ACC", "ULN"] * 2
    assert {json.loads(text)["profile"] for text in events(path, "profile")} == {"atv71"}


def test_trigger_records_the_seconds_around_it_and_ends_after_the_count(tmp_path: Path) -> None:
    path = tmp_path / "values.sqlite"
    with tcp_line("atv71@2", "--run", "20") as line:
        done = ended(
            0, "record", line, "-d", "2", "RFR", *SHORT, "--out", path, "--trigger", "RFR>10,1",
            "--before", "0.5", "--after", "0.5", "--count", "1", "--json",
        )  # fmt: skip
    reported = json.loads(done.stdout)
    assert [item["device"] for item in reported["triggers"]] == [2]
    assert reported["triggers"][0]["text"].startswith("RFR ")
    assert (reported["values"], reported["lost"]) == (len(rows(path)), 0)
    assert 3 <= reported["values"] <= 15
    assert events(path, "trigger") == [reported["triggers"][0]["text"]]


def test_nothing_is_recorded_without_a_trigger_that_fires(tmp_path: Path) -> None:
    path = tmp_path / "values.sqlite"
    with tcp_line("atv71@2") as line:
        arguments = ("-d", "2", "RFR", *SHORT, "--out", path, "--trigger", "fault", "--for", "0.5")
        run(0, "record", line, *arguments)
    assert rows(path) == []


def test_disk_that_refuses_and_accepts_again_is_reported_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A full disk has room for a moment: that is not the end of it."""

    class Disk:
        path = tmp_path / "values.sqlite"
        trouble = ""

        def write(self) -> None:
            pass

    times = iter((101.0, 102.0, 103.0, 104.0, 130.0))
    monkeypatch.setattr(time, "monotonic", lambda: next(times))
    disk = Disk()
    recording = record.Recording(None, disk)  # type: ignore[arg-type]
    for disk.trouble in ("full", "", "full", "", ""):
        recording._write()
    reported = capsys.readouterr().err.splitlines()
    assert reported == [
        f"drivepanel: {disk.path} cannot be written: full. Trying again.",
        f"drivepanel: {disk.path} is written again.",
    ]


@pytest.mark.sweep
def test_ctrl_c_ends_the_recording_with_a_whole_file(tmp_path: Path) -> None:
    path = tmp_path / "values.sqlite"
    with simulated("atv71@2", "--tcp", "127.0.0.1:0") as simulation:
        line = f"tcp:127.0.0.1:{port_of(simulation.ready)}"
        command = (
            "record",
            line,
            "-d",
            "2",
            "RFR",
            *SHORT,
            "--out",
            str(path),
            "--trigger",
            "RFR<1",
        )
        with served([*DRIVEPANEL, *command], ready="RFR 0 < 1") as recording:
            status, _ = recording.end(signal.SIGINT)
    assert status == 130
    assert rows(path)


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (("RFR", "--out", "there.sqlite"), "there.sqlite already exists"),
        (("RFR", "--out", "new.sqlite", "--trigger", "faults"), "'faults' is not a trigger"),
        (("RFR", "--out", "new.sqlite", "--count", "1"), "--count requires --trigger"),
        (("RFR", "--out", "-"), "it needs a FILE"),
        (("RFR", "--out", "pipe", "--force"), "pipe is not a regular file"),
        (("XYZQ", "--out", "new.sqlite"), "no parameter 'XYZQ'"),
        (("RFR", "--out", "new.sqlite", "--trigger", "XYZQ>5"), "no parameter 'XYZQ'"),
        (("RFR", "--out", "there.sqlite", "--force", "--trigger", "XYZQ>5"), "no parameter 'XYZQ'"),
        (("RFR", "--out", "none/new.sqlite/x"), "none"),
    ],
)
def test_refused_recording_writes_no_file(
    arguments: tuple[str, ...], text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    os.mkfifo("pipe")
    (tmp_path / "there.sqlite").write_text("mine")
    (tmp_path / "none").write_text("")
    done = ended(2, "record", "sim:atv71", *arguments)
    assert text in done.stderr
    assert (tmp_path / "there.sqlite").read_text() == "mine"
    assert not (tmp_path / "new.sqlite").exists()


def test_disk_without_room_for_a_file_is_refused_and_leaves_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full = Mock(side_effect=OSError(errno.ENOSPC, "x"))
    monkeypatch.setattr("tui.session.record.record_file.RecordFile._prepare", full)
    path = tmp_path / "values.sqlite"
    done = ended(2, "record", "sim:atv71", "RFR", "--out", path)
    assert f"{path} cannot be written: the disk is full." in done.stderr
    assert not path.exists()


def test_drive_that_is_lost_and_comes_back_is_reported_once_each(
    capsys: pytest.CaptureFixture[str],
) -> None:
    profile = library.load("atv71")
    good = fakes.snapshot_of(profile, fakes.RUNNING)
    lost = replace(good, error="Device 2 did not answer.")
    drive = record.RecordedDrive(
        Mock(device=2, profile=profile), ["RFR"], (), TriggeredRows(0, 0, always=True)
    )
    work = record.Recording(Mock(as_json=False), Mock())
    for cycle in (good, lost, lost, good, good):
        work._take(drive, cycle)
    assert capsys.readouterr().err.splitlines() == [
        "drivepanel: Device 2 did not answer.",
        "drivepanel: Device 2 is recorded again.",
    ]


def test_drive_that_does_not_answer_ends_with_3_and_keeps_the_file(tmp_path: Path) -> None:
    path = tmp_path / "values.sqlite"
    path.write_text("mine")
    ended(3, "record", "sim:atv71@2", "-d", "9", "RFR", "--out", path, "--force")
    assert path.read_text() == "mine"
