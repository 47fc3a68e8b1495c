"""The progress of a search: one line that is overwritten, on a terminal only."""

from __future__ import annotations

import sys

import pytest

from tui.cli.running.scan_telling import Progress, ScanTelling
from tui.drive.finding import LineSetting

PROGRESS = Progress(LineSetting(19200, "8E1"), 12, 31, 2, 3.4, settings_left=1)


@pytest.mark.parametrize("is_terminal", [True, False])
def test_progress_is_drawn_on_a_terminal_only(
    is_terminal: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: is_terminal)
    telling = ScanTelling("/dev/ttyUSB0", as_json=False)
    telling.progress(PROGRESS)
    drawn = capsys.readouterr().err
    assert (PROGRESS.text in drawn) is is_terminal
    telling.note("Device 3 is left out.")
    *cleared, last = capsys.readouterr().err.split("\r")
    assert last == "drivepanel: Device 3 is left out.\n"
    assert any(part.isspace() for part in cleared) is is_terminal


def test_progress_is_described_in_words() -> None:
    assert PROGRESS.text.startswith("19200")
    assert "12 of 31" in PROGRESS.text
    assert "2 found, 1 more setting, 3 s left" in PROGRESS.text
    assert Progress(None, 1, 2, 0, 0.2).text.endswith("0 found, 1 s left")
    assert Progress(None, 2, 2, 1, 0.2).text == "2 of 2 asked, 1 found"
