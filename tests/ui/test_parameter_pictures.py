"""Pictures of the parameter editor in its main states, at both sizes."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from rich.text import Text
from textual.pilot import Pilot

from tui.drive.profile import library
from tui.screens.parameters.screen import ParametersScreen
from tui.screens.parameters.view import news_lines
from tui.session.console import DriveConsole
from tui.session.drive_state import DriveState
from tui.session.reading import Reading
from tui.session.settings.applied import EditOutcome, Result
from tui.session.settings.editor import Editor
from tui.session.settings.favourites import Marks
from tui.session.settings.watched_values import WatchedValues
from tui.session.work import Outcome as WorkOutcome
from tui.session.work import OutcomeKind

from . import fakes
from .test_pictures import SIZES, Compare

HELD = {
    "INR": 1, "ACC": 30, "DEC": 30, "AC2": 50, "DE2": 50, "HSP": 500, "LSP": 0, "TFR": 600,
    "BFR": 0, "NPR": 15, "UNS": 400, "NCR": 41, "NSP": 1450, "FRS": 500, "ITH": 41, "CTT": 3,
    "SFR": 40, "STT": 0, "CHCF": 1, "FR1": 164, "CD1": 10, "CCS": 98, "TTO": 100, "SLL": 6,
    "LAC": 0, "ADD": 2, "TBR": 32, "TFO": 3, "BRA": 1, "RPT": 0, "CLI": 62,
}  # fmt: skip


class StillValues(WatchedValues):
    """Values that do not change."""

    def start(self) -> None:
        """Nothing is read."""

    def stop(self) -> None:
        """Nothing was read."""


def still_editor(console: DriveConsole, state: Callable[[], DriveState | None]) -> Editor:
    """An editor whose values do not change."""
    editor = Editor(console.session, console.journal, state)
    editor.values = StillValues(console.session, lambda: editor.state, lambda: None)
    return editor


def editor_of(
    state: dict[str, int], *, armed: float | None = None, reading: bool = False
) -> DriveConsole:
    """An Altivar 71 with an editor that stands still."""
    profile = library.load("atv71")
    snapshot = fakes.snapshot_of(profile, state)
    console = fakes.console_of(snapshot, armed=armed)
    editor = still_editor(console, lambda: snapshot.state)
    editor.marks = Marks(favourites=("ACC", "HSP"))
    rest = {} if reading else {p.code: 0 for p in profile.parameters if p.access != "w"}
    image = console.session.image
    for code, raw in {**rest, **state, **HELD}.items():
        image.confirm(code, raw, fakes.NOW)
    if not reading:
        image.take({"SPAT": Reading.bad(profile["SPAT"], fakes.NOW, "exception 2")})
    console.editor = editor
    return console


def say(editor: Editor, kind: OutcomeKind, text: str) -> None:
    """Said at the moment of every fake."""
    editor.session.work.outcome = WorkOutcome(kind, text, fakes.NOW)


def plain(_: Editor) -> None:
    """Nothing staged."""


def staged(editor: Editor) -> None:
    editor.staging.stage("ACC", "5.03")
    editor.staging.stage("DEC", "4.0")
    editor.staging.stage("HSP", "45")


def refused(editor: Editor) -> None:
    staged(editor)
    edit = editor.staging.edits.get("HSP")
    assert edit is not None
    text = (
        "HSP: the drive refused with exception 4, not written. The drive is running forward."
        " Stop the motor and write again."
    )
    editor.staging.results = {"HSP": Result(edit, EditOutcome.DRIVE_REFUSED, text, 500)}
    say(editor, OutcomeKind.REFUSED, "2 written and read back; 1 still staged: HSP")


def elsewhere(editor: Editor) -> None:
    staged(editor)
    editor.session.image.confirm("HSP", 300, fakes.NOW)


def done(editor: Editor) -> None:
    editor.unsaved = {"ACC", "DEC"}
    editor.waits_for_reset = {"ADD"}
    say(editor, OutcomeKind.DONE, "3 written and read back")


def compared(editor: Editor) -> None:
    editor.other = {**editor.values.raws, "ACC": 60, "HSP": 400, "TTO": 50}
    editor.other_label = "pump-2.toml"


WALL = 1_795_259_250.0
FILES = (
    "pump-2.toml",
    "atv71-2-20261120-0959.toml",
    "a-name-that-is-longer-than-its-column-2026.toml",
)
"""Files that can be opened, the newest first."""
STATES: dict[str, tuple[Any, dict[str, int], float | None, list[str]]] = {
    "settings": (plain, fakes.READY, None, []),
    "found": (plain, fakes.READY, None, ["slash", *"ramp", "enter"]),
    "nothing-found": (plain, fakes.READY, None, ["slash", *"xyz", "enter"]),
    "staged": (staged, fakes.READY, 52.0, ["slash", *"speed", "enter"]),
    "locked": (staged, fakes.RUNNING, 52.0, ["slash", *"rated", "enter"]),
    "write": (staged, fakes.READY, 52.0, ["w"]),
    "not-armed": (staged, fakes.READY, None, ["w"]),
    "refused": (refused, fakes.RUNNING, 52.0, ["slash", *"hsp", "enter"]),
    "elsewhere": (elsewhere, fakes.READY, 52.0, ["slash", *"hsp", "enter"]),
    "done": (done, fakes.READY, 52.0, ["d", "d"]),
    "compared": (compared, fakes.READY, 52.0, ["d", "d"]),
    "number": (plain, fakes.READY, 52.0, ["slash", *"acc", "enter", "enter", *"5.03"]),
    "out-of-range": (plain, fakes.READY, 52.0, ["slash", *"hsp", "enter", "enter", *"9999"]),
    "names": (plain, fakes.READY, 52.0, ["slash", *"stt", "enter", "enter"]),
    "confirm": (plain, fakes.READY, 52.0, ["slash", *"fry", "enter", "y"]),
    "save": (done, fakes.READY, 52.0, ["S"]),
    "open": (plain, fakes.READY, None, ["ctrl+o", "down"]),
    "factory": (done, fakes.READY, 52.0, ["F"]),
    "help": (plain, fakes.READY, 52.0, ["question_mark"]),
}


@SIZES
@pytest.mark.parametrize("state", STATES)
def test_parameters(
    snap_compare: Compare,
    state: str,
    size: tuple[int, int],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
) -> None:
    prepare, drive, armed, keys = STATES[state]
    monkeypatch.setenv("TEXTUAL_ANIMATIONS", "none")
    time.tzset()
    monkeypatch.chdir(tmp_path)
    for age, name in enumerate(FILES):
        (tmp_path / name).touch()
        os.utime(tmp_path / name, (WALL - 90_000 * age,) * 2)
    console = editor_of(drive, armed=armed)
    prepare(console.editor)
    app = fakes.app_of()
    app.opened = fakes.opened()
    fakes.choose(app, console)

    async def show(pilot: Pilot[None]) -> None:
        await app.push_screen(ParametersScreen(console))
        await pilot.pause()
        await pilot.press(*keys)
        await pilot.pause()
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=show)


@SIZES
def test_while_it_is_read(snap_compare: Compare, size: tuple[int, int]) -> None:
    console = editor_of(fakes.READY, reading=True)
    app = fakes.app_of()
    app.opened = fakes.opened()
    fakes.choose(app, console)

    async def show(pilot: Pilot[None]) -> None:
        await app.push_screen(ParametersScreen(console))
        await pilot.pause()
        await pilot.press("tab", "tab")
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=show)


def test_another_hands_value_is_told_as_the_drive_counts_it() -> None:
    """An Altivar 31 without a ramp increment counts in tenths; that is not an unknown scale."""
    console = fakes.console_of(None, family="atv31")
    editor = still_editor(console, lambda: None)
    image = console.session.image
    image.confirm("ACC", 50, 1.0)
    increment = console.session.profile["Inr"]
    image.take({"Inr": Reading.bad(increment, 1.0, "exception 2", absent=True)})
    editor.staging.stage("ACC", "7 s")
    image.confirm("ACC", 30, 2.0)
    said = "\n".join(line.plain for line in news_lines(editor, "ACC", Text(""), 100))
    assert "it was 5.0 s" in said
