"""`drivepanel report`: the trends of the last trip and run, beside it or as text."""

from __future__ import annotations

import json
import os
import time
from pathlib import Path

import pytest

from tests.session.test_report_trends import written_run
from tui.bus.share.place import file_name_of
from tui.session.connect.line_key import line_key

from .commands import ended, refused, run, tcp_line


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


@pytest.mark.sweep
def test_page_about_each_drive_reports_one_that_cannot_be_read(tmp_path: Path) -> None:
    with tcp_line("atv71@1", "atv312@3") as line:
        page = tmp_path / "line.html"
        done = ended(3, "report", line, page, "-d", "1", "-d", "2", "-d", "3")
        assert "Device 2" in done.stderr
        text = page.read_text("utf-8")
        assert text.count("<article>") == 3
        assert "Not read" in text
        assert "ATV312" in text
        found = json.loads(run(0, "report", line, tmp_path / "all.html", "--all", "--json"))
        assert [each["device"] for each in found] == [1, 3]


def test_page_as_text_on_standard_output(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = run(0, "report", "sim:atv312", "-", "--page")
    assert text.startswith("# Drive 1:")
    assert "## Signatures" in text


def test_report_on_several_drives_needs_a_page(tmp_path: Path) -> None:
    for words in (("--all",), ("-d", "1", "-d", "2"), ("--tests", tmp_path)):
        text = ended(2, "report", "sim:atv312", tmp_path / "new.md", *words).stderr
        assert "require --page" in text
    assert not (tmp_path / "new.md").exists()


@pytest.mark.sweep
def test_page_is_not_written_if_no_drive_can_be_read(tmp_path: Path) -> None:
    with tcp_line("atv71@1") as line:
        refused(3, "report", f"{line},timeout=0.2", tmp_path / "new.html", "-d", "5", "-d", "6")
    assert not (tmp_path / "new.html").exists()
