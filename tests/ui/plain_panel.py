"""The same drive in stock widgets, as the peer for the panel's bytes.

As a program it monitors the simulated Altivar 71 that `drivepanel demo` has, with the same refresh:
large digits, a sparkline, a table whose cells are updated one by one.
"""

from __future__ import annotations

import asyncio
from typing import ClassVar

from textual.app import App, ComposeResult
from textual.containers import Horizontal
from textual.widgets import DataTable, Digits, Footer, Sparkline

from tui.drive.profile import library
from tui.screens.frame import FRAME_LOOK
from tui.session.connect.open_line import OpenLine, demo_line
from tui.session.drive import DriveSession
from tui.session.monitor.monitor import Monitor
from tui.session.reading import reading_of, with_text

LARGE = ("RFR", "LCR", "RFRD", "OTR")


class PlainPanel(App[None]):
    """Stock widgets, set again at every refresh."""

    BINDINGS: ClassVar = [("q", "quit", "Quit")]
    CSS = "Horizontal { height: 3; } Digits { width: 1fr; } Sparkline { height: 4; }"

    def __init__(self, opened: OpenLine, device: int) -> None:
        super().__init__()
        self._opened = opened
        self._session = DriveSession(opened.line, device, library.load("atv71"))
        self._monitor = Monitor(self._session)

    def compose(self) -> ComposeResult:
        """Digits above, a sparkline below them, all values in a table."""
        with Horizontal():
            for code in LARGE:
                yield Digits("", id=code)
        yield Sparkline([], id="trend")
        yield DataTable(id="table")
        yield Footer()

    def on_mount(self) -> None:
        """Watch the drive."""
        table = self.query_one(DataTable)
        for column in ("code", "name", "value", "unit", "age"):
            table.add_column(column, key=column)
        profile = self._session.profile
        for value in profile.data.monitoring.values:
            parameter = profile[value.parameter]
            row = (parameter.code, parameter.name, "-----", parameter.unit, "")
            table.add_row(*row, key=parameter.code)
        self._monitor.start()
        self.set_interval(FRAME_LOOK, self.look)

    def look(self) -> None:
        """Set everything from the latest snapshot."""
        monitor = self._monitor
        if (snapshot := monitor.latest) is None:
            return
        now = asyncio.get_running_loop().time()
        for code in LARGE:
            self.query_one(f"#{code}", Digits).update(reading_of(snapshot.readings[code]).text)
        points = [point.values[0] or 0.0 for point in monitor.trend][-80:]
        self.query_one(Sparkline).data = points
        table = self.query_one(DataTable)
        for code, reading in with_text(snapshot.readings).items():
            if code in table.rows:
                table.update_cell(code, "value", reading.text)
                table.update_cell(code, "age", f"{reading.age(now):.1f} s")


def main() -> None:
    """Show the running drive until the terminal closes."""
    opened = demo_line({"atv71": 50.0})
    try:
        PlainPanel(opened, 1).run()
    finally:
        opened.close()


if __name__ == "__main__":
    main()
