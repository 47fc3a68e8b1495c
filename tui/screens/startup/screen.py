"""Start-up: walks the steps of a commissioning; records, and goes where a step is carried out.

The screen itself only reads. Settings are staged and written on Parameters, motors run and stop on
Monitor, each armed and confirmed there.
"""

from __future__ import annotations

import asyncio
import time
from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult

from tui.bus.errors import LineError
from tui.drive.errors import ProfileError
from tui.drive.model import model_codes
from tui.drive.plain import plain
from tui.drive.shown import depends_on
from tui.session.console import DriveConsole
from tui.session.startup.guide import guide_folders
from tui.session.startup.judging import StepRow, plate_fault, reference_fault
from tui.session.startup.start_up import StartUp, open_start_up
from tui.widgets.drawing import wrapped
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, PLAIN

from ..keys.action import START_UP
from ..keys.table import bindings
from .row_keys import RowKeys
from .view import StartUpView, title_line, walk_lines

STEP_READ_EVERY = 2.0
"""Seconds between two reads of the present step's parameters."""
MOST_FAULTS = 12


class StartUpScreen(RowKeys):
    """The steps at the left, the present one at the right."""

    CSS_PATH = "startup.tcss"
    BINDINGS: ClassVar = bindings(START_UP)
    TITLE = "Start-up"
    LOOK = 0.5

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self.session = console.session
        self._fault = ""
        """Why there are no steps."""

    def body(self) -> ComposeResult:
        """A heading, and the steps."""
        yield Lines(id="title")
        yield Lines(id="steps")

    def on_mount(self) -> None:
        """Open the steps, and start reading."""
        if self.console.start_up is None:
            self.run_worker(self._open(None), group="open")
        self.set_interval(STEP_READ_EVERY, self.read_again)
        self.read_again()

    async def _open(self, path: Path | None) -> None:
        """Open the family's steps, or those of a file; the disk may hang."""
        try:
            opened = await asyncio.to_thread(open_start_up, self.session, self.app.line_text, path)
        except ProfileError as error:
            self._fault = str(error)
            if path is not None:
                self.app.tell(f"Not opened: {self._fault.splitlines()[0]}")
        else:
            self.console.start_up, self._fault = opened, ""
            self.read_again()
        self.look()

    @property
    def start_up(self) -> StartUp | None:
        """The start-up of this drive; None until its steps are open."""
        return self.console.start_up

    def action_load_file(self) -> None:
        """Choose a file of steps."""
        from ..dialogs.pick_file import PickFile

        def reported(name: str | None) -> None:
            if name:
                self.run_worker(self._open(Path(name)), exclusive=True, group="open")

        folders = [Path.cwd(), guide_folders()[0]]
        self.app.push_screen(PickFile("Open the steps of a start-up.", [], folders), reported)

    # Reading

    def read_again(self) -> None:
        """Read the present step's parameters; after a lost line those of all steps."""
        if self.is_current:
            self.run_worker(self._read, exclusive=True, group="startup")  # type: ignore[arg-type]

    async def _read(self) -> None:
        start_up = self.start_up
        if start_up is None:
            return
        profile, whole = self.session.profile, start_up.changes.needs_all
        codes = start_up.guide.codes if whole else start_up.step.codes
        if start_up.step.kind == "identity":
            codes = [*codes, *model_codes(profile)]
        wanted = [c for code in codes for c in (code, *depends_on(profile[code]))]
        try:
            found = await self.console.read(dict.fromkeys(wanted), again=True) if wanted else {}
        except LineError:
            start_up.changes.lost()
        else:
            self.readings = {**self.readings, **found}
            good = {c: r.raw for c, r in found.items() if r.raw is not None and not r.error}
            # a drive that lacks a word answers the others; a lost one answers none
            whole = whole and all(r.raw is not None or r.absent for r in found.values())
            start_up.take({c: raw for c, raw in good.items() if c in codes}, whole=whole)
        self.look()

    # Drawing

    def view(self, start_up: StartUp) -> StartUpView:
        """Return what is drawn now."""
        now = self.app.clock.monotonic()
        facts = self.facts()
        editor = self.console.begun_editor
        edits = editor.staging.edits.items if editor is not None else ()

        def differs(row: StepRow, entry: str) -> bool:
            if row.kind == "reference":
                return bool(reference_fault(facts, entry))
            return row.key in facts.raws and bool(plate_fault(facts, row.key, entry))

        return StartUpView(
            start_up,
            self.session.profile,
            self.aged(now),
            facts.raws,
            {edit.code: edit.text for edit in edits},
            now,
            plain(facts.identity),
            differs,
            time.strftime("%Y-%m-%d", time.localtime(self.app.clock.wall_of(now))),
        )

    def draw(self, width: int) -> None:
        """Draw the steps, or why there are none."""
        super().draw(width)
        latest, start_up = self.console.latest, self.start_up
        height = self.query_one("#steps", Lines).size.height
        if start_up is None:
            lines = [part for line in self._fault.splitlines() for part in wrapped(line, width, 3)]
            shown = [Text(f" {plain(line)}", ALARM) for line in lines[:MOST_FAULTS]]
            self.put(
                "title", [Text(" Start-up" if self._fault else " Reading the steps ...", PLAIN)]
            )
            self.put("steps", shown)
            return
        if latest is not None and latest.error:
            start_up.changes.lost()
        view = self.view(start_up)
        self.put("title", [title_line(view, width)])
        self.put("steps", walk_lines(view, width, height))

    # Keys that move

    def action_move(self, rows: int) -> None:
        """Move the cursor by so many rows."""
        if self.start_up is not None:
            self.start_up.row = max(0, min(len(self.start_up.rows) - 1, self.start_up.row + rows))
            self.look()

    def action_section(self, steps: int) -> None:
        """Go to the next or previous step."""
        if self.start_up is not None:
            self.start_up.go(steps)
            self.read_again()
            self.look()
