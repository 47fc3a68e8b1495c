"""Enter on the rows of a start-up: records what a person typed or the trend shows.

Nothing here writes to a drive or moves a motor: a row that needs it goes to the screen with the
keys for it, and names them.
"""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

from tui.drive.errors import DriveError
from tui.drive.settings.writable import is_setting
from tui.session.settings.backups import newest_backup
from tui.session.startup.judging import (
    FILE,
    TICKED,
    StepRow,
    field_fault,
    plate_fault,
    plate_raw,
)
from tui.session.startup.start_up import StartUp, begin_again

from ..dialogs.ask import Ask
from ..dialogs.confirm import Confirm
from ..dialogs.now import MotorStates
from .run_rows import RunRows

BEGINS_AGAIN = (
    "All steps are open again, for another drive of this reference at this address. The results"
    " until now are kept in a file, but no report has them any more. No setting is changed."
)


def _filled(text: str) -> str:
    return "" if text.strip() else "Enter a text."


class RowKeys(RunRows):
    """Records entries and results of the present step."""

    # Enter

    async def action_open(self) -> None:
        """Do what the row under the cursor says."""
        start_up = self.start_up
        if start_up is None:
            return
        row = start_up.chosen
        match row.kind:
            case "parameter":
                await self.app.open_parameter(row.key)
            case "field":
                self._record_field(row)
            case "plate" | "reference" | "retest":
                self._record_text(row)
            case "run" | "speed" | "stop":
                self._record_run(start_up, row)
            case "turned":
                self._record_direction(start_up, row)
            case "test":
                self._record_test(start_up)
            case "backup":
                await self._record_backup(start_up)
            case "save" | "report":
                action = "eeprom" if row.kind == "save" else "report"
                self.app.call_later(self.app.run_action, action)
            case "done":
                self._finish(start_up)
            case "deficient" | "skip":
                self._end(row)
        self.look()

    def _enter(self, row: StepRow, key: str, text: str) -> None:
        """Record an entry, and go to the next row."""
        start_up = self.start_up
        if start_up is not None:
            start_up.enter(key, text)
            if row in start_up.rows:
                start_up.row = start_up.rows.index(row) + 1
            self.look()

    def _ask(
        self,
        question: str,
        check: Callable[[str], str],
        work: Callable[[str], object],
        *,
        text: str = "",
        about: str = "",
        number: bool = False,
    ) -> None:
        """Ask for a text about the present step; a stop of the drive cancels the question."""
        start_up = self.start_up
        step = start_up.step if start_up is not None else None

        def reported(answer: str | None) -> None:
            # another program of this panel may have gone to another step
            if answer is not None and self.start_up is start_up and start_up is not None:
                if start_up.step is step:
                    work(answer)
                self.look()

        requested = Ask(
            question,
            check,
            text=text,
            about=about,
            takes="Record",
            number=number,
            now=MotorStates(self.app, [self.session]),
        )
        self.app.push_screen(requested, reported)

    def _record_field(self, row: StepRow) -> None:
        field, start_up = row.field, self.start_up
        if field is None or start_up is None:
            return
        held = start_up.record.entries.get(row.key, "")
        if field.kind == "tick":
            self._enter(row, row.key, "no" if held == TICKED else TICKED)
            return
        unit = f" ({field.unit})" if field.unit else ""
        self._ask(
            f"{field.name}{unit}",
            lambda text: field_fault(field, text),
            lambda text: self._enter(row, row.key, text),
            text=held,
            about="Only recorded." if not field.least else "Judged only by a limit that you type.",
            number=field.kind == "number",
        )

    def _record_text(self, row: StepRow) -> None:
        """Record what the nameplate shows, or how a deficiency was tested again."""
        start_up = self.start_up
        if start_up is None:
            return
        held = start_up.record.entries.get(row.key, "")
        if row.kind != "plate":
            about = "As printed on the drive." if row.kind == "reference" else start_up.record.text
            question = row.key if row.kind == "reference" else "How was it tested again?"
            self._ask(
                question, _filled, lambda text: self._enter(row, row.key, text), text=held,
                about=about,
            )  # fmt: skip
            return
        parameter = self.session.profile[row.key]
        unit = f" ({parameter.unit})" if parameter.unit else ""

        def check(text: str) -> str:
            try:
                plate_raw(self.facts(), row.key, text)
            except DriveError as refused:
                return str(refused)
            return ""

        self._ask(
            f"{parameter.name} on the nameplate{unit}",
            check,
            lambda text: self._compare_plate(row, text),
            text=held,
            about="Read it from the nameplate. It is compared with the drive's value.",
            number=True,
        )

    def _compare_plate(self, row: StepRow, text: str) -> None:
        """Record a number of the nameplate; propose it for a setting that differs."""
        self._enter(row, row.key, text)
        facts = self.facts()
        fault = plate_fault(facts, row.key, text)
        parameter = self.session.profile[row.key]
        if fault and row.key in facts.raws and is_setting(self.session.profile, parameter):
            # in the new screen: this one gets no answer once it is closed
            self.app.call_later(self.app.open_parameter, row.key, plate_raw(facts, row.key, text))
        if fault:
            self.app.tell(fault)

    async def _record_backup(self, start_up: StartUp) -> None:
        """Record the newest backup, if no earlier step has changed since; or make one."""
        row, step = start_up.chosen, start_up.step
        newest = await asyncio.to_thread(newest_backup, self.session)
        try:
            at = newest.stat().st_mtime if newest is not None else 0.0
        except OSError:
            newest, at = None, 0.0
        if start_up.step is not step:
            return
        if newest is None or at < start_up.newest_before():
            self.app.call_later(self.app.run_action, "back_up")
            self.app.tell("After the backup: press B, and Enter again.")
            return
        when = time.strftime("%Y-%m-%d %H:%M", time.localtime(at))
        self._enter(row, FILE, f"{newest.name}, {when}")

    def action_begin_again(self) -> None:
        """Ask, and begin the start-up again: another drive of this reference is at the address."""
        start_up = self.start_up
        if start_up is None:
            return

        def reported(sure: bool | None) -> None:
            if sure and self.start_up is start_up:
                try:
                    self.console.start_up = begin_again(start_up, self.app.line_text)
                except OSError as error:
                    self.app.tell(f"Not begun again: {error.strerror or error}.")
                self.read_again()
                self.look()

        requested = Confirm(
            "Begin the start-up again?",
            BEGINS_AGAIN,
            yes="Begin again",
            no="Cancel",
            loses=True,
            now=MotorStates(self.app, [self.session]),
        )
        self.app.push_screen(requested, reported)

    # Results

    def _finish(self, start_up: StartUp) -> None:
        name = start_up.step.step
        if why := start_up.finish(self.facts()):
            self.app.tell(why)
            return
        self.app.tell(f"{name}: done.")
        start_up.go_on()
        self.read_again()

    def _end(self, row: StepRow) -> None:
        """Ask for a deficiency, or for the reason of a skip."""
        start_up = self.start_up
        if start_up is None:
            return
        name = start_up.step.step
        if row.kind == "deficient":
            self._ask(
                f"Deficiency of {name}", _filled, start_up.note_deficiency,
                about="It stays open until it has been tested again.",
            )  # fmt: skip
            return

        def skip(reason: str) -> None:
            if why := start_up.skip(reason):
                self.app.tell(why)
            else:
                start_up.go_on()
                self.read_again()

        self._ask(f"Reason to skip {name}", _filled, skip, about="It is in the report.")

    def read_again(self) -> None:
        """Read the present step's parameters."""
        raise NotImplementedError
