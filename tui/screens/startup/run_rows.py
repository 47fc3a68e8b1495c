"""Rows about a motor that has run: what its trend shows is recorded, never commanded."""

from __future__ import annotations

import time
from collections.abc import Mapping
from datetime import datetime

from tui.drive.model import model_read
from tui.drive.settings.writable import AT_REST
from tui.session.console import DriveConsole
from tui.session.drive import DriveSession
from tui.session.journal import Entry
from tui.session.shown import Quality, Shown
from tui.session.startup.evidence import SeenStop, SteadyRun, last_run, last_steady, last_stop
from tui.session.startup.judging import (
    AS_REQUIRED,
    OTHER_WAY,
    RUN,
    TEST,
    TURNED,
    StepFacts,
    StepRow,
)
from tui.session.startup.start_up import StartUp

from ..base import PanelScreen
from ..keys.action import MONITOR, SOURCES

STOPPED_BY = "stopped: "
"""Begin of the reason of a stop in the journal."""
STOP_BEFORE = 1.0
"""Longest time in s between a stop in the journal and its first effect in the trend."""
VALUE_OLD_AFTER = 6.0
"""Age in seconds above which a value is not current."""
RUN_FIRST = "{what}: press a to arm, r, type {hz}, Enter. Then press B, and Enter again."
RUN_AT_DRIVE = "{what}: run the motor as this drive allows. Then press B, and Enter again."
STOP_FIRST = "{what}: run the motor, then stop it by {key}. Then press B, and Enter again."
KEY_OF_STOP = {
    "stop": "Space",
    "quick-stop": "k",
    "emergency-stop": "e",
    "freewheel": "z",
    "dc-braking": "b",
}
TEST_FIRST = "Test the timeout: press P. Then press B, and Enter again."
NO_RUN = "Not recorded: no run was seen since this step was due. Run the motor first."
WRONG_WAY = "turned the other way"
NOT_TURNED = "did not turn"


class RunRows(PanelScreen):
    """Facts about the drive, and the rows that record a run."""

    console: DriveConsole
    session: DriveSession

    def __init__(self) -> None:
        super().__init__()
        self.readings: Mapping[str, Shown] = {}
        """Values of the steps, as they were last read."""

    @property
    def start_up(self) -> StartUp | None:
        """The start-up of this drive; None until its steps are open."""
        raise NotImplementedError

    def aged(self, now: float) -> dict[str, Shown]:
        """Return the values with their quality at this time."""
        return {code: reading.aged(now, VALUE_OLD_AFTER) for code, reading in self.readings.items()}

    def facts(self) -> StepFacts:
        """Return what decides if a step is done."""
        readings = self.aged(self.app.clock.monotonic())
        good = {
            code: reading.raw
            for code, reading in readings.items()
            if reading.raw is not None and reading.quality is Quality.GOOD
        }
        editor, latest = self.console.begun_editor, self.console.latest
        state = self.console.current_state
        profile = self.session.profile
        reference = self.session.known_identity.reference
        model = model_read(profile, good)
        return StepFacts(
            profile,
            good,
            {code for code, reading in readings.items() if reading.absent},
            {edit.code for edit in editor.staging.edits} if editor is not None else (),
            self.session.unsaved,
            at_rest=latest is not None and state is not None and state.motion in AT_REST,
            identity=f"{reference} {model}".strip(),
        )

    def _enter(self, row: StepRow, key: str, text: str) -> None:
        """Record an entry, and go to the next row."""
        raise NotImplementedError

    def _clock_text(self, moment: float) -> str:
        return time.strftime("%H:%M:%S", time.localtime(self.app.clock.wall_of(moment)))

    def _record_run(self, start_up: StartUp, row: StepRow) -> None:
        """Record a run, a speed or a stop from the trend; or go where the motor can be run."""
        points, since, step = self.console.monitor.trend, start_up.since, start_up.step
        hertz = f"{step.hz[0]:g}" if step.hz else ""
        if row.kind == "speed":
            hertz = row.key.partition(" ")[0]
            steady = last_steady(points, float(hertz), since)
            if steady is not None:
                self._enter(row, row.key, self._speed_text(steady, step.rated))
                return
        elif row.kind == "stop":
            if (seen := last_stop(points, since)) is not None:
                when = self._clock_text(seen.end)
                if other := self._other_method(row.key, seen):
                    self.app.tell(f"Not recorded: the last stop was another one: {other}.")
                    return
                if any(when in entry for entry in start_up.record.entries.values()):
                    self.app.tell("This stop is recorded already. Run and stop the motor again.")
                    return
                text = f"{when}, {seen.hertz:.1f} Hz in {seen.seconds:.1f} s"
                self._enter(row, row.key, text)
                return
            if self._has_no_frequency and (run := last_run(points, since)) is not None:
                self._enter(row, row.key, f"{self._clock_text(run.time)}, seen by the person")
                return
        elif (run := last_run(points, since)) is not None:
            value = run.values[0] if run.values else None
            when = self._clock_text(run.time)
            self._enter(row, RUN, when if value is None else f"{when}, {abs(value):.1f} Hz")
            return
        self._go_and_run(row, hertz)

    def _other_method(self, method: str, seen: SeenStop) -> str:
        """Return the command of this program that stopped the motor, if it was another one."""
        charts = self.session.profile.data.charts
        names = {order.name for chart in charts for order in chart.orders if order.id == method}
        end = self.app.clock.wall_of(seen.end)
        sent = [
            entry.why.removeprefix(STOPPED_BY)
            for entry in self.console.journal.sent
            if entry.why.startswith(STOPPED_BY)
            and (entry.line, entry.device) == (self.session.line_text, self.session.device)
            and after(entry, end - seen.seconds - STOP_BEFORE)
            and not after(entry, end + STOP_BEFORE)
        ]
        return sent[-1] if sent and names.isdisjoint(sent) else ""

    @property
    def _has_no_frequency(self) -> bool:
        return self.session.profile.quantity("output_frequency") is None

    def _speed_text(self, steady: SteadyRun, rated: str) -> str:
        """Describe a speed with its current, and the rated current if it is known now.

        The current has the unit of the trend: % on a family that reports it so.
        """
        measured = self.session.profile.quantity("motor_current")
        unit = measured.unit if measured is not None else ""
        current = "-----" if steady.current is None else f"{steady.current:.1f} {unit}"
        reading = self.aged(self.app.clock.monotonic()).get(rated)
        number = reading.current_number if reading is not None else None
        if reading is None or number is None:
            return f"{steady.hertz:.1f} Hz, {current}"
        return f"{steady.hertz:.1f} Hz, {current}; rated {number:.1f} {reading.parameter.unit}"

    def _go_and_run(self, row: StepRow, hertz: str) -> None:
        what = f"At {row.key}" if row.kind == "speed" else row.key.capitalize()
        text = RUN_FIRST if hertz else RUN_AT_DRIVE
        if row.kind == "stop":
            text = STOP_FIRST
        self.app.action_goto(MONITOR)
        self.app.tell(text.format(what=what, hz=hertz, key=KEY_OF_STOP.get(row.key, "")))

    def _record_direction(self, start_up: StartUp, row: StepRow) -> None:
        """Record which way the motor turned; the other way is a deficiency."""
        entries, step = start_up.record.entries, start_up.step
        if RUN not in entries:
            self.app.tell(NO_RUN)
            return
        self._enter(row, TURNED, row.key)
        if row.key == AS_REQUIRED:
            start_up.row = [item.kind for item in start_up.rows].index("done")
            return
        text = WRONG_WAY if row.key == OTHER_WAY else NOT_TURNED
        start_up.note_deficiency(f"the motor {text}")
        start_up.row = 0
        if row.key != OTHER_WAY:
            self.app.tell("Recorded: the motor did not turn. Faults (5) and Control (6) help.")
            return
        raws = self.facts().raws
        if step.reverse and step.reverse in raws:
            parameter = self.session.profile[step.reverse]
            names = self.session.profile.names(parameter)
            other = next(raw for raw in names if raw != raws[step.reverse])
            self.app.call_later(self.app.open_parameter, step.reverse, other)
        elif step.reverse:
            self.app.tell(f"Change {step.reverse} with the motor stopped. Then test again.")
        else:
            self.app.tell(step.remedy)

    def _record_test(self, start_up: StartUp) -> None:
        """Record the newest communication loss test of this drive; or go to Control."""
        since = self.app.clock.wall_of(start_up.since)
        mine = (self.session.line_text, self.session.device)
        found = [
            entry
            for entry in self.console.journal.proofs
            if (entry.line, entry.device) == mine and after(entry, since)
        ]
        if not found:
            self.app.action_goto(SOURCES)
            self.app.tell(TEST_FIRST)
            return
        newest = found[-1]
        row = start_up.chosen
        self._enter(row, TEST, f"{newest.time[11:19]}, {newest.answer}: {newest.new}")


def after(entry: Entry, wall: float) -> bool:
    """Return True if an entry of the journal is newer than a time in seconds since 1970."""
    try:
        return datetime.fromisoformat(entry.time).timestamp() >= wall
    except ValueError:
        return False
