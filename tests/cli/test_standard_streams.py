"""Standard output and error of a command: a closed reader is reported on one only."""

from __future__ import annotations

import os
import sys
from typing import Any

import pytest

from tui.cli.shared.standard_streams import ForgivingFile, keep_streams, output_lost


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
