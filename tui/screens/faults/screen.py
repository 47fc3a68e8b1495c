"""Faults: what tripped the drive, its history with what it stored, the seconds before."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Horizontal
from textual.widgets import OptionList

from tui.bus.errors import LineError
from tui.screens.faults.view import fault_lines, history_line, record_lines, stored_lines
from tui.session.console import DriveConsole
from tui.session.monitor.fault_record import FaultRecord, Recorder, record_name, record_text
from tui.session.paths import state_folder
from tui.session.reading import Reading
from tui.widgets.drawing import armed_text, rule
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, STRONG
from tui.widgets.plain import entry

from ..command.command_keys import OrderKeys
from ..command.news import news
from ..dialogs.files import fault_of_new
from ..keys.table import FAULTS, bindings

LEFT = 36
STORED = 52
"""Columns of what the drive stored, where there is room: values stay beside their names."""
STEP = 5
"""Rows of the record that a key moves by."""


class FaultsScreen(OrderKeys):
    """Reads the history when it opens, and again after a trip."""

    CSS_PATH = "faults.tcss"
    BINDINGS: ClassVar = bindings(FAULTS)
    TITLE = "Faults"
    LOOK = 0.5

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self.session = console.session
        self._readings: dict[str, Reading] = {}
        self._shown: FaultRecord | None = None
        self._message = Text(" reading the history", STRONG)
        self._offset = 0

    @property
    def _recorder(self) -> Recorder:
        return self.console.recorder

    def body(self) -> ComposeResult:
        """The fault, the history beside what was stored, the record."""
        yield Lines(id="title")
        yield Lines(id="fault")
        with Horizontal(id="middle"):
            yield OptionList(id="history", compact=True)
            yield Lines(id="stored")
        yield Lines(id="record")
        yield Lines(id="message")

    def on_mount(self) -> None:
        """Read the history; who opens this screen has seen the trip."""
        self._recorder.acknowledge()
        self._shown = self._recorder.latest
        self._list()
        self.query(OptionList).focus()
        self._read_again()

    def _read_again(self) -> None:
        self.run_worker(self._read(), exclusive=True, group="faults")

    async def _read(self) -> None:
        faults = self.session.profile.data.faults
        codes = [*faults.history, *(code for stored in faults.stored for code in stored)]
        try:
            self._readings = await self.console.read(list(dict.fromkeys(codes)))
        except LineError as error:
            self._message = Text(f" {error}", ALARM)
        else:
            self._message = Text("")
        self._list()
        self.look()

    def _list(self) -> None:
        if not (found := self.query(OptionList)):
            return  # the screen was left before it stood
        options = found.first()
        at = options.highlighted or 0
        profile = self.session.profile
        options.clear_options()
        for number, code in enumerate(profile.data.faults.history, start=1):
            options.add_option(entry(history_line(profile, number, code, self._readings, LEFT - 2)))
        if profile.data.faults.history:
            options.highlighted = at
        else:
            options.add_option(entry(Text(" not known on this drive"), disabled=True))

    def on_option_list_option_highlighted(self) -> None:
        """Another fault of the history is looked at."""
        self.look()

    def draw(self, width: int) -> None:
        """Show what there is; a new trip counts as seen."""
        super().draw(width)
        record = self._recorder.latest
        if record is not self._shown:
            self._shown, self._offset = record, 0
            self._recorder.acknowledge()
            self._read_again()
        latest = self.console.monitor.latest
        present = latest is not None and latest.state.kind == "fault"
        fault = latest.state.fault if latest and present else record.fault if record else None
        who = f"Faults · {self.session.profile.name} · device {self.session.device}"
        title = rule(who, width - 12, self.app.clock.time_of_day())
        self.put("title", [title.append_text(armed_text(self.commander.armed_for))])
        self.put("fault", fault_lines(fault, present, width))
        room = min(STORED, width - LEFT)
        stored = stored_lines(self.session.profile, self._stored(), self._readings, room)
        self.put("stored", stored)
        room = self.size.height - 1 - 4 - self.query_one("#middle").size.height - 2
        self.put("record", record_lines(record, width, room, self._offset))
        now = self.app.clock.monotonic()
        told = news(self.session.work.outcome, now, busy=self.session.work.busy)
        self.put("message", [Text(f" {told[0]}", told[1]) if told else self._message])

    def _stored(self) -> list[str]:
        """Codes that the drive keeps of the chosen fault."""
        stored = self.session.profile.data.faults.stored
        at = self.query_one(OptionList).highlighted or 0
        return stored[at] if at < len(stored) else []

    def action_move_record(self, rows: int) -> None:
        """Older or newer values of the record."""
        most = len(self._shown.moments) + len(self._shown.writes) - 1 if self._shown else 0
        self._offset = max(0, min(most, self._offset + rows * STEP))
        self.look()

    def action_save_file(self) -> None:
        """Write the record to a file whose name the person may change."""
        from ..dialogs.ask import Ask

        record = self._recorder.latest
        if record is None:
            self._message = Text(" Nothing to save: no trip was seen.", ALARM)
            self.look()
            return
        proposed = str(state_folder() / record_name(self.session, record))

        def told(name: str | None) -> None:
            if name:
                self._write(Path(name).expanduser(), record)

        about = "Markdown, with the values, what the drive stored, and what was written."
        asked = Ask(
            "Save the trip as", fault_of_new, text=proposed, about=about, takes="writes the file"
        )
        self.app.push_screen(asked, told)

    def _write(self, path: Path, record: FaultRecord) -> None:
        stored = self.session.profile.data.faults.stored
        rows = [
            (code, reading.parameter.name, f"{reading.text} {reading.unit}".rstrip())
            for code in (stored[0] if stored else [])
            if (reading := self._readings.get(code)) is not None
        ]
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(record_text(self.session, record, rows), encoding="utf-8")
        except OSError as error:
            self._message = Text(f" Not saved: {error.strerror or error}: {path}", ALARM)
        else:
            self._message = Text(f" Saved: {path}", STRONG)
        self.look()
