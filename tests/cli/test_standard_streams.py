"""Standard output and error of a command: a closed reader is reported on one only."""

from __future__ import annotations

import errno
import json
import os
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.sources import ROOT
from tui.cli.plant.broker import broker_of
from tui.cli.shared.errors import OUTPUT_LOST, USAGE, Failure, file_failures
from tui.cli.shared.standard_streams import (
    STANDARD,
    ForgivingFile,
    keep_streams,
    output_lost,
)
from tui.drive.small_file import supplied

from .commands import invoked, refused
from .test_accept import HEAD, STILL


def pipe_without_reader() -> int:
    reading, writing = os.pipe()
    os.close(reading)
    return writing


def test_lost_reader_is_reported_only_if_pipes_are_to_report_it() -> None:
    number = pipe_without_reader()
    with pytest.raises(BrokenPipeError):
        ForgivingFile(number, pipes=True).write(b"text")
    forgiving = ForgivingFile(number, pipes=False)
    assert forgiving.write(b"text") == 4
    assert isinstance(forgiving.lost, BrokenPipeError)
    os.close(number)


def test_only_standard_output_reports_a_lost_reader(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    for name in ("stdout", "stderr"):
        monkeypatch.setattr(sys, name, getattr(sys, name))
    keep_streams()
    streams: list[Any] = [sys.stdout, sys.stderr]
    files = [stream.buffer.raw for stream in streams]
    assert [(file.fileno(), file._pipes) for file in files] == [(1, True), (2, False)]
    assert streams[1].line_buffering
    assert output_lost() == ""
    files[0].lost = OSError(28, "No space left on device")
    assert output_lost() == "No space left on device"


# `-` in place of a file


@pytest.fixture
def input_once() -> Iterator[None]:
    """Standard input is read again, and no file has the name `-`."""
    supplied.clear()
    yield
    supplied.clear()
    assert not Path("-").exists()


@pytest.mark.usefixtures("input_once")
def test_acceptance_test_and_password_are_read_from_standard_input(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    done = invoked("accept", "-", "sim:atv312", "--check", typed=HEAD + STILL)
    assert (done.exit_code, done.output) == (0, "T: 1 steps. None moves the motor.\n")
    supplied[Path("-")] = b"secret\nmore"
    monkeypatch.setattr("tui.cli.plant.broker.need_mqtt", lambda: None)
    assert broker_of("mqtt://me@h", Path("-")).password == "secret"


@pytest.mark.sweep
@pytest.mark.usefixtures("input_once")
def test_diagram_and_evidence_are_alone_on_standard_output() -> None:
    plan = (ROOT / "docs" / "plan" / "hall-2.toml").read_text("utf-8")
    drawn = invoked("plan", "-", "--svg", "-", typed=plan)
    assert drawn.exit_code == 0
    assert drawn.stdout.startswith("<svg ")
    assert drawn.stdout.rstrip().endswith("</svg>")
    confirmed = invoked("profiles", "confirm", "v20", "sim:v20", "--to", "-")
    assert json.loads(confirmed.stdout)["profile"] == "v20"


def test_cycles_are_csv_alone_on_standard_output() -> None:
    done = invoked("watch", "sim:v20", "SPEED", "--every", "0.2", "--count", "2", "--csv", "-")
    head, *rows = done.stdout.splitlines()
    assert head.startswith("time,SPEED [rpm]")
    assert [row.split(",")[1] for row in rows] == ["0", "0"]


@pytest.mark.parametrize(
    ("words", "reported"),
    [
        (("replay", "-"), "A record is a database"),
        (("export", "-", "RFR", "--out", "x"), "A record is a database"),
        (("simulate", "--from", "-@1", "--pty", "x"), "A record is a database"),
        (("watch", "sim:v20", "--csv", "-", "--json"), "both write to standard output"),
        (("watch", "sim:v20", "--csv", "-", "--rotate", "day"), "not standard output"),
        (("listen", "sim:v20", "--pcap", "-", "--json"), "both write to standard output"),
    ],
)
def test_dash_that_is_no_file_is_refused_plainly(words: tuple[str, ...], reported: str) -> None:
    assert reported in refused(2, *words)
    assert not Path("-").exists()


@pytest.mark.sweep
def test_frames_are_alone_on_standard_output(capfdbinary: pytest.CaptureFixture[bytes]) -> None:
    invoked("listen", "sim:atv312", "--pcap", "-", "--for", "1")
    data = capfdbinary.readouterr().out
    assert data.startswith(b"\x0a\x0d\x0d\x0a")
    assert b"Listening" not in data


def test_full_disk_behind_standard_output_exits_with_74() -> None:
    full = OSError(errno.ENOSPC, "No space left on device")
    text = "standard output cannot be written: No space"
    with pytest.raises(Failure, match=text) as lost, file_failures(STANDARD):
        raise full
    assert lost.value.exit_code == OUTPUT_LOST
    with pytest.raises(Failure, match=r"x\.csv cannot be") as other, file_failures(Path("x.csv")):
        raise full
    assert other.value.exit_code == USAGE
    with pytest.raises(BrokenPipeError), file_failures(STANDARD):
        raise BrokenPipeError
