"""Faults screen: a fault with its causes, the history, and the seconds before a trip."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult

from tui.bus.errors import LineError
from tui.drive.fault_reset import reset_codes
from tui.drive.hints import alarms_on, codes_to_read
from tui.drive.profile.schema import FaultCode
from tui.session.console import DriveConsole
from tui.session.journal_reading import entries_of, time_of
from tui.session.monitor.fault_record import FaultRecord, Recorder, record_name, record_text
from tui.session.monitor.watched import SeenTrip, Watched, last_trip
from tui.session.paths import state_folder
from tui.session.shown import Shown
from tui.widgets.curve import curve_signs
from tui.widgets.drawing import rule
from tui.widgets.lines import Lines

from ..command.command_keys import OrderKeys
from ..dialogs.ask import Ask, fault_of_new
from ..keys.action import FAULTS
from ..keys.table import bindings
from .doctor import doctor_lines
from .doctor_view import DoctorView
from .view import record_lines, stored_lines, stored_text

STORED = 52
"""Most columns of the drive's stored values, so that values stay close to their names."""
STEP = 5
"""Rows of the record that a key press scrolls."""
READ_AGAIN = 2.0
"""Seconds between two reads of the parameters to check."""
OLD = 3 * READ_AGAIN
"""Age in seconds above which a value is shown as old."""
BESIDE = 36
"""Least terminal rows to show the seconds before the trip below the doctor."""
DOCTOR_ROWS = 24
SAME_TRIP = 5.0
"""Seconds between a trip in the journal and in the trend that are the same one."""


class FaultsScreen(OrderKeys):
    """Present or last fault of the drive, or a selected fault of its history."""

    CSS_PATH = "faults.tcss"
    BINDINGS: ClassVar = bindings(FAULTS)
    TITLE = "Faults"
    LOOK = 0.5

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self.session = console.session
        self._readings: dict[str, Shown] = {}
        self._shown: FaultRecord | None = None
        self._chosen: tuple[int, FaultCode] | None = None
        """Place and fault selected in the history; None for the present or last fault."""
        self._unread = True
        self._at: int | None = None
        """Row of the cursor; None until a person has moved it."""
        self._last: SeenTrip | None = None
        """Last trip in the journal."""
        self._journal_read = False
        self._offset = 0
        self._before = False
        """True if the seconds before the trip are shown instead of the doctor."""

    @property
    def _recorder(self) -> Recorder:
        return self.console.recorder

    def body(self) -> ComposeResult:
        """Create the doctor and, below it, the record."""
        yield Lines(id="doctor")
        yield Lines(id="record")

    def on_mount(self) -> None:
        """Acknowledge the trip, which is visible now, and start reading the history."""
        self._see()
        self._shown = self._recorder.latest
        self._read_again()
        self.set_interval(READ_AGAIN, self._read_again)
        self.run_worker(self._read_journal(), group="journal")

    def _see(self) -> None:
        self._recorder.acknowledge()
        if self.app.fleet is not None:
            self.app.fleet.alarms.acknowledge(self.session.device)

    def _read_again(self) -> None:
        if self.is_current:
            # pass the method: a coroutine that is replaced before it starts causes a warning
            self.run_worker(self._read, exclusive=True, group="faults")  # type: ignore[arg-type]

    async def _read_journal(self) -> None:
        """Find the last trip in the journal, away from the loop: it may wait for the disk."""
        session = self.session
        try:
            entries = await asyncio.to_thread(
                entries_of, self.console.journal, session.line_text, session.device
            )
        except OSError as error:
            self.app.notify(f"The journal could not be read: {error}", severity="warning")
            return
        self._last, self._journal_read = last_trip(entries), True
        self.look()

    async def _read(self) -> None:
        faults = self.session.profile.data.faults
        view = self.doctor()
        codes = []
        if view.present or view.hint is not None:
            codes = codes_to_read(self.session.profile, view.hint)
        if view.present:
            codes += reset_codes(self.session.profile)
        ageing = tuple(codes)  # what the drive has stored has no age: it may be of another trip
        if (place := view.stored_place) is not None and place < len(faults.stored):
            codes += faults.stored[place]
        if self._unread or self.app.replay is not None:  # the next read of it may be due now
            codes += [*faults.history, *(code for stored in faults.stored for code in stored)]
        if not codes:
            return
        try:
            found = await self.console.read(list(dict.fromkeys(codes)))
        except LineError as error:
            if self._unread:
                self.app.notify(f"The history could not be read: {error}", severity="warning")
            self._take_known(ageing)
        else:
            self._readings = {**self._readings, **found}
            self._unread = False
        self.look()

    def _take_known(self, codes: Iterable[str]) -> None:
        """Show what other screens have read, with its age, if it is newer."""
        now = self.app.clock.monotonic()
        known = {code: item.aged(now, 0.0) for code, item in self.console.known(codes).items()}
        newer = {
            code: item
            for code, item in known.items()
            if code not in self._readings or self._readings[code].time < item.time
        }
        self._readings = {**self._readings, **newer}

    def doctor(self) -> DoctorView:
        """Return the contents: the present fault, else an alarm, else the last trip.

        A fault selected in the history takes precedence over all three.
        """
        latest, record = self.console.monitor.latest, self._recorder.latest
        present = latest is not None and not latest.error and latest.state.kind == "fault"
        fault = latest.state.fault if latest is not None and present else None
        if fault is None and not present:
            fault = record.fault if record else None
        alarms = self._alarms()
        if alarms and not present:
            fault = None  # a present alarm takes precedence over a past trip
        place = None
        if self._chosen is not None:
            place, chosen = self._chosen
            present = present and place == 0 and fault is not None and fault.raw == chosen.raw
            fault = chosen
        now = self.app.clock.monotonic()
        if record is not None and (record.fault != fault or not (fault or present) or place):
            record = None
        active = self.app.fleet.alarms.active if self.app.fleet is not None else ()
        ours = (
            present_fault for present_fault in active if present_fault.device == self.session.device
        )
        since = next(ours, None) if present else None
        tripped = record.wall if record is not None else since.wall if since is not None else None
        view = DoctorView(
            profile=self.session.profile,
            fault=fault,
            present=present,
            record=record,
            now=now,
            since=since,
            readings=self._read_since(now),
            cursor=self._at,
            unread=self._unread,
            raws=self.session.image.raws,
            alarms=alarms,
            monitored=self._monitored(now),
            place=place,
            changed=self._changed_since(tripped),
            wall=self.app.clock.wall(),
            armed=self.session.arming.armed,
            barred=self.session.arming.hindrance,
            signs=curve_signs(
                plain=self.app.plain_signs,
                braille=self.app.has_braille,
                grid=self.app.has_colors,
            ),
        )
        return replace(view, watched=self._watched()) if view.is_quiet else view

    def _read_since(self, now: float) -> dict[str, Shown]:
        """Return what was read; nothing from before a trip that is not drawn yet."""
        if self._recorder.latest is not self._shown:
            return {}
        return {code: reading.aged(now, OLD) for code, reading in self._readings.items()}

    def _monitored(self, now: float) -> dict[str, Shown]:
        latest = self.console.monitor.latest
        readings = latest.readings if latest is not None else {}
        return {code: reading.aged(now, OLD) for code, reading in readings.items()}

    def _changed_since(self, wall: float | None) -> frozenset[str]:
        """Return the settings that this program wrote after a time in seconds since 1970."""
        if wall is None:
            return frozenset()
        mine = (self.session.line_text, self.session.device)
        return frozenset(
            entry.code
            for entry in self.console.journal.recent
            if (entry.line, entry.device) == mine
            and (when := time_of(entry)) is not None
            and when.timestamp() > wall
        )

    def _watched(self) -> Watched:
        clock, points = self.app.clock, self.console.monitor.trend
        trips = [point for point in points if point.mark == "trip"]
        last = self._last
        at = clock.wall_of(trips[-1].time) if trips else 0.0
        if trips and (last is None or last.wall < at - SAME_TRIP):
            last = SeenTrip(at, "".join(trips[-1].codes[:1]), tripped=True)
        return Watched(self._recorder.since, points, last, self._journal_read)

    def _alarms(self) -> list[tuple[str, int, str]]:
        """Return the active alarms in the monitor's values, as word, bit and name."""
        latest = self.console.monitor.latest
        if latest is None or latest.error:
            return []
        raws = {c: r.raw for c, r in latest.readings.items() if r.raw is not None}
        return alarms_on(self.session.profile, raws)

    def draw(self, width: int) -> None:
        """Draw the doctor and the record; acknowledge a new trip, which is visible now."""
        super().draw(width)
        record = self._recorder.latest
        if record is not self._shown:
            self._shown, self._offset, self._unread, self._chosen = record, 0, True, None
            self._at = None
            # what the drive had stored belongs to an earlier trip
            self._readings = {}
            self._read_again()
        self._see()
        rows = self.size.height - 4
        doctor, below = rows, 0
        if self._before:
            doctor, below = 0, rows
        elif self.size.height >= BESIDE and self._shown is not None:
            doctor = max(DOCTOR_ROWS, rows * 3 // 5)
            below = rows - doctor
        self.query_one("#doctor", Lines).display = doctor > 0
        self.query_one("#record", Lines).display = below > 0
        lines = doctor_lines(self.doctor(), width, doctor) if doctor else []
        # always the same number of rows, so that the record below does not move
        self.put("doctor", [*lines, *[Text("")] * (doctor - len(lines))])
        self.put("record", self._past(width, below) if below else [])

    def _past(self, width: int, rows: int) -> list[Text]:
        """Return the seconds before the trip; on their own page also the fault's stored values."""
        stored = []
        if self._before:
            codes = self._stored()
            stored = stored_lines(self.session.profile, codes, self._readings, min(STORED, width))
            stored = [rule("Stored by the drive", width), *stored, Text("")]
        room = max(3, rows - len(stored))
        return [*stored, *record_lines(self._shown, width, room, self._offset)]

    def _stored(self) -> list[str]:
        """Return the codes of the values that the drive stores for the fault under the cursor."""
        stored = self.session.profile.data.faults.stored
        view = self.doctor()
        at = max(0, view.at - len(view.rows))
        return stored[at] if at < len(stored) else []

    def action_move(self, rows: int) -> None:
        """Move the cursor by `rows` through the parameters to check and the history."""
        view = self.doctor()
        most = len(view.rows) + len(view.history) - 1
        self._at = max(0, min(most, view.at + rows))
        self.look()

    async def action_open(self) -> None:
        """Open the parameter under the cursor in the editor, or show that past fault."""
        view = self.doctor()
        if view.at < len(view.rows):
            await self.app.open_parameter(view.rows[view.at].code)
            return
        place = view.at - len(view.rows)
        code = view.history[place] if place < len(view.history) else ""
        reading = self._readings.get(code)
        known = self.session.profile.fault(reading.raw or 0) if reading else None
        if known is None or known.raw == self.session.profile.data.faults.none:
            self.app.tell("No fault is recorded here.")
            return
        self._chosen, self._at = (place, known), None
        self._read_again()
        self.look()

    def action_other_page(self) -> None:
        """Switch between the doctor and the seconds before the trip."""
        self._before = not self._before
        self.look()

    def action_leave(self) -> None:
        """Return from a past fault or the record to the present fault, then to Monitor."""
        if self._chosen is not None or self._before:
            self._chosen, self._before, self._at = None, False, None
            self.look()
        else:
            self.app.pop_screen()

    def action_move_record(self, rows: int) -> None:
        """Scroll the record by `rows` times STEP; a positive number shows older values."""
        most = len(self._shown.moments) + len(self._shown.writes) - 1 if self._shown else 0
        self._offset = max(0, min(most, self._offset + rows * STEP))
        self.look()

    def action_save_file(self) -> None:
        """Prompt for a file name and save the latest record as Markdown."""
        record = self._recorder.latest
        if record is None:
            self.app.tell("Nothing to save: no trip since monitoring of this drive began.")
            return
        proposed = str(state_folder() / record_name(self.session, record))

        def reported(name: str | None) -> None:
            if name:
                self._write(Path(name).expanduser(), record)

        about = "Markdown, with the values, the drive's stored values, and all writes."
        requested = Ask("Save the trip as", fault_of_new, text=proposed, about=about, takes="Save")
        self.app.push_screen(requested, reported)

    def _write(self, path: Path, record: FaultRecord) -> None:
        stored = self.session.profile.data.faults.stored
        rows = [
            (code, reading.parameter.name, stored_text(reading))
            for code in (stored[0] if stored else [])
            if (reading := self._readings.get(code)) is not None
        ]
        values = {code: stored_text(reading) for code, reading in self._readings.items()}
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            text = record_text(self.session, record, rows, values, self.doctor().known)
            path.write_text(text, encoding="utf-8")
        except OSError as error:
            self.app.notify(f"Not saved: {error.strerror or error}: {path}", severity="error")
        else:
            self.app.tell(f"Saved: {path}")
