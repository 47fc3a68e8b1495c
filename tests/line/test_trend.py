"""Trend on a real terminal and a real line: its values are those of the keeper's record."""

from __future__ import annotations

import os
import signal
import sqlite3
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest

from tests.programs import end_keepers, wait_until

from .pty_panel import PtyPanel, panel_on_a_pty, start_panel

LIST_OF_BANDS = "code, number, address or name"
ACC = 9001


@pytest.fixture(autouse=True)
def recorded(monkeypatch: pytest.MonkeyPatch) -> None:
    """The programs of these tests record."""
    monkeypatch.delenv("DRIVEPANEL_RECORD")


def cursor_value(panel: PtyPanel, code: str) -> str:
    """The value at the cursor in the table of Trend."""
    panel.look()
    rows = [row for row in panel.text().split("\n") if row.startswith(f"  {code} ")]
    return rows[0][12:21].strip() if rows else ""


def test_another_panel_shows_what_the_keeper_has_recorded_before() -> None:
    with panel_on_a_pty() as panel:
        panel.run(20)
        panel.shows("20.0")
        panel.settle(4.0)
        panel.type("8")
        panel.shows("RFR Output frequency", "─20.0")
        with panel_beside_running(panel) as other:
            other.type("8")
            other.shows("RFR Output frequency", "─20.0")
            # the oldest record is of the standstill before, which this panel has never read
            other.settle(1.0)
            other.type("\x1b[H")
            other.shows("HELD")
            other.settle(1.0)
            seen = []
            for _ in range(12):
                seen.append(cursor_value(other, "RFR"))
                other.type("\x1b[C")
                other.settle(0.3)
            assert "0.0" in seen, seen
            other.type("\x1b[F")
            wait_until(lambda: other.look() and "HELD" not in other.text(), "the curves run")
        stops_work_on_trend(panel)


@contextmanager
def panel_beside_running(panel: PtyPanel) -> Iterator[PtyPanel]:
    """Another panel on the line, whose drive runs already."""
    started = start_panel([f"tcp:127.0.0.1:{panel.log.port}", "-d", "1"])
    other = PtyPanel(*started, panel.simulation, panel.log)
    try:
        other.shows("FORWARD")
        yield other
    finally:
        os.kill(other.pid, signal.SIGKILL)
        os.waitpid(other.pid, 0)
        os.close(other.terminal)


def stops_work_on_trend(panel: PtyPanel) -> None:
    for key in (" ", "\x1b[20~"):
        before = len(panel.log.writes)
        panel.type(key)
        wait_until(lambda b=before: panel.look() and panel.stops(b) > 0, f"{key!r} stops")  # type: ignore[misc]
    assert "RFR Output frequency" in panel.text()


def test_parameter_of_a_band_is_read_in_each_cycle_and_recorded() -> None:
    with panel_on_a_pty() as panel:
        panel.type("8")
        panel.shows("RFR Output frequency", "Tab events")
        panel.type("\r")
        panel.shows(LIST_OF_BANDS)
        panel.type(*"ACC", apart=0.1)
        panel.settle(0.5)
        panel.type("\r")
        panel.shows("ACC Acceleration")
        panel.settle(4.0)
        assert "not read" not in panel.text()
        panel.type("\x1b")
        panel.shows("a arm")  # Monitor, which does not read it
        panel.settle(1.0)
        left = time.time()
        panel.settle(2.0)
    end_keepers()
    (path,) = Path(os.environ["DRIVEPANEL_STATE"], "record").glob("*.sqlite")
    with closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as base:
        rows = base.execute(
            "SELECT utc FROM reply WHERE quality = 0 AND function = 3"
            " AND address <= ? AND address + registers > ?",
            (ACC, ACC),
        ).fetchall()
    assert len(rows) > 4
    assert [utc for (utc,) in rows if utc / 1e6 > left] == []
