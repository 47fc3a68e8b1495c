"""`drivepanel report`: the trends of the last trip and run, beside it or as text."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from tests.session.test_report_trends import written_run
from tui.bus.share.place import file_name_of
from tui.session.connect.line_key import line_key

from .commands import refused, run, tcp_line


def record_of(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A record of this line with a run."""
    monkeypatch.setattr("tui.session.report_trends.RUN_SOUGHT_FOR", time.time())
    monkeypatch.setenv("DRIVEPANEL_RECORD", "off")  # else this run would be older than the record
    folder = Path(os.environ["DRIVEPANEL_STATE"]) / "record"
    written_run(folder, name=file_name_of(line_key(line)))


def test_report_has_the_last_run_as_a_file_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with tcp_line("atv71@1") as line:
        record_of(line, monkeypatch)
        run(0, "report", line, tmp_path / "pump.md")
        assert "<polyline" in (tmp_path / "pump-run.svg").read_text("utf-8")
        assert "![Curve of the run](<pump-run.svg>)" in (tmp_path / "pump.md").read_text("utf-8")
        (tmp_path / "pump.md").unlink()
        text = refused(2, "report", line, tmp_path / "pump.md")
        assert "pump-run.svg already exists" in text
        assert not (tmp_path / "pump.md").exists()


def test_report_on_standard_output_has_the_last_run_as_text(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with tcp_line("atv71@1") as line:
        record_of(line, monkeypatch)
        text = run(0, "report", line, "-")
    part = text.partition("## Last run\n")[2].partition("\n## ")[0]
    assert part.count("```") == 2
    assert "15 Hz" in part
    assert list(tmp_path.glob("*.svg")) == []
