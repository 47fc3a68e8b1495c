"""Pictures of the parameter editor in its main states, at both sizes."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import pytest
from textual.pilot import Pilot
from textual.widgets import OptionList

from tests.sweeps import kept
from tui.app import DrivePanelApp
from tui.drive.profile import library
from tui.drive.settings.parameter_set import ParameterSet, SetHead, dump_set
from tui.screens.dialogs.now import MotorStates
from tui.screens.dialogs.pick_file import PickFile
from tui.screens.parameters.detail_view import parameter_lines
from tui.screens.parameters.edit_value import EditBits
from tui.screens.parameters.screen import ParametersScreen
from tui.screens.parameters.table_view import TableLine, layout_of, row_line
from tui.session.console import DriveConsole
from tui.session.drive_state import DriveState
from tui.session.events import EventLog
from tui.session.reading import Reading
from tui.session.settings.applied import Applied, EditOutcome, Result
from tui.session.settings.editor import Editor, Marks
from tui.session.settings.watched_values import WatchedValues
from tui.session.work import Outcome as WorkOutcome
from tui.session.work import OutcomeKind

from . import fakes
from .test_flows import until
from .test_pictures import SIZES, Compare

HELD = {
    "INR": 1, "ACC": 30, "DEC": 30, "AC2": 50, "DE2": 50, "HSP": 500, "LSP": 0, "TFR": 600,
    "BFR": 0, "NPR": 15, "UNS": 400, "NCR": 41, "NSP": 1450, "FRS": 500, "ITH": 41, "CTT": 3,
    "SFR": 40, "STT": 0, "CHCF": 1, "FR1": 164, "CD1": 10, "CCS": 98, "TTO": 100, "SLL": 6,
    "LAC": 0, "INV": 41, "ADD": 2, "TBR": 32, "TFO": 3, "BRA": 1, "RPT": 0, "CLI": 62,
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
    """An Altivar 71 with a paused editor."""
    profile = library.load("atv71")
    snapshot = fakes.snapshot_of(profile, state)
    console = fakes.console_of(snapshot, armed=armed)
    console.session.clock = fakes.StillClock()
    editor = still_editor(console, lambda: snapshot.state)
    editor.marks = Marks(favorites=("ACC", "HSP"))
    rest = {} if reading else {p.code: 0 for p in profile.parameters if p.access != "w"}
    image = console.session.image
    for code, raw in {**rest, **state, **HELD}.items():
        image.confirm(code, raw, fakes.NOW)
    if not reading:
        image.take({"SPAT": Reading.bad(profile["SPAT"], fakes.NOW, "exception 2")})
    console.editor = editor
    return console


TEXTS_SHOWN: list[tuple[str, str]] = []
"""Messages of the prepared state, as events of its panel."""


def panel(console: DriveConsole) -> DrivePanelApp:
    """The panel on that drive; all its events have the same time."""
    app = fakes.app_of(kind=fakes.Easel)
    app.opened = fakes.opened()
    app.events = EventLog(lambda: WALL)
    for kind, text in TEXTS_SHOWN:
        app.events.add(kind, text, console.device)
    TEXTS_SHOWN.clear()
    fakes.choose(app, console)
    return app


def say(editor: Editor, kind: OutcomeKind, text: str) -> None:
    """Said at the moment of every fake."""
    editor.session.work.outcome = WorkOutcome(kind, text, fakes.NOW)
    TEXTS_SHOWN.append((kind, text))


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
        "The drive refused HSP with exception 4, not written. The drive is running forward."
        " Stop the motor and write again."
    )
    editor.staging.results = {"HSP": Result(edit, EditOutcome.DRIVE_REFUSED, text, 500)}
    say(editor, OutcomeKind.REFUSED, "Wrote 2, all verified. 1 still staged: HSP.")


def failed(editor: Editor) -> Applied:
    """The limit was refused: values that depend on it are held back, the rest waits."""
    for code, text in (("TFR", "80"), ("HSP", "75"), ("ACC", "5.0"), ("DEC", "4.0")):
        editor.staging.stage(code, text)
    edits = {edit.code: edit for edit in editor.staging.edits}
    refusal = (
        "The drive refused TFR with exception 4, Not completed. The drive is running forward."
        " Check whether the parameter can be written in this state."
    )
    results = (
        Result(edits["TFR"], EditOutcome.DRIVE_REFUSED, refusal, 600),
        Result(
            edits["HSP"],
            EditOutcome.HELD_BACK,
            "HSP was not written: it depends on TFR, which was not written.",
            500,
        ),
        Result(edits["ACC"], EditOutcome.WAITS, "ACC is not written yet.", 30),
        Result(edits["DEC"], EditOutcome.WAITS, "DEC is not written yet.", 30),
    )
    return Applied(results, editor.staging.edits, waits=("ACC", "DEC"))


def rest(editor: Editor) -> None:
    editor.applied = failed(editor)


def stopped(editor: Editor) -> None:
    applied = failed(editor)
    editor.session.unsaved_settings.note_write("HSP", 480, 500)
    editor.applied = Applied(applied.results, applied.left, stopped="a stop came")


def written(editor: Editor) -> None:
    done(editor)
    for code, old in (("ACC", 50), ("DEC", 40)):
        editor.staging.stage_raw(code, old)
    edits = tuple(editor.staging.edits)
    editor.staging.undo_all()
    editor.staging.results = {e.code: Result(e, EditOutcome.DONE, "written", e.new) for e in edits}
    for edit in edits:
        editor.session.image.confirm(edit.code, edit.new, fakes.NOW)


def elsewhere(editor: Editor) -> None:
    staged(editor)
    editor.session.image.confirm("HSP", 300, fakes.NOW)


def done(editor: Editor) -> None:
    for code in ("ACC", "DEC"):
        editor.session.unsaved_settings.note_write(code, 30, 35)
    editor.waits_for_reset = {"ADD"}
    say(editor, OutcomeKind.DONE, "Wrote 3, all verified")


def compared(editor: Editor) -> None:
    editor.other = {**editor.values.raws, "ACC": 60, "HSP": 400, "TTO": 50}
    editor.other_label = "pump-2.toml"


def test_value_that_is_just_written_is_not_staged_any_more() -> None:
    console = editor_of(fakes.READY, armed=52.0)
    editor = console.editor
    assert editor is not None
    editor.staging.stage("ACC", "7.5")
    (edit,), busy = tuple(editor.staging.edits), False
    editor.staging.busy = lambda: busy
    layout = layout_of(editor, [TableLine("ACC")], 120)

    def drawn() -> str:
        row = row_line(editor, TableLine("ACC"), layout, 120, chosen=False)
        return " ".join(line.plain for line in (row, *parameter_lines(editor, "ACC", 120, 6)))

    assert "→ 7.5 s" in drawn()
    busy = True
    editor.session.image.confirm("ACC", edit.new, fakes.NOW)
    for results in ({}, {"ACC": Result(edit, EditOutcome.DONE, "written", edit.new)}):
        editor.staging.results = results
        assert "7.5 s" in drawn()
        assert "→" not in drawn()
    assert f"was {edit.old_text}" in drawn()
    busy = False
    assert "→" in drawn(), "a value from elsewhere leaves the edit staged"


WALL = 1_795_259_250.0
FILES = (
    "pump-2.toml",
    "atv71-2-20261120-0959.toml",
    "a-name-that-is-longer-than-its-column-2026.toml",
)
"""Files that can be opened, the newest first."""
STATES: dict[str, tuple[Any, dict[str, int], float | None, list[str]]] = {
    "settings": (plain, fakes.READY, None, []),
    "group": (plain, fakes.READY, None, ["tab", "right", "right"]),
    "changed": (plain, fakes.READY, None, ["left"] * 5),
    "start-up": (plain, fakes.READY, None, ["left"] * 3 + ["down"] * 6),
    "rest": (rest, fakes.RUNNING, 52.0, []),
    "results": (stopped, fakes.RUNNING, 52.0, []),
    "written": (written, fakes.READY, 52.0, ["slash", *"acc", "enter", "escape"]),
    "write-running": (staged, fakes.RUNNING, 52.0, ["w"]),
    "past-a-limit": (plain, fakes.READY, 52.0, ["slash", *"hsp", "enter", *"70"]),
    "found": (plain, fakes.READY, None, ["slash", *"ramp", "enter"]),
    "nothing-found": (plain, fakes.READY, None, ["slash", *"xyz", "enter"]),
    "staged": (staged, fakes.READY, 52.0, ["slash", *"speed", "enter"]),
    "locked": (staged, fakes.RUNNING, 52.0, ["slash", *"rated", "enter"]),
    "write": (staged, fakes.READY, 52.0, ["w"]),
    "not-armed": (staged, fakes.READY, None, ["w"]),
    "refused": (refused, fakes.RUNNING, 52.0, ["slash", *"hsp", "enter", "escape"]),
    "elsewhere": (elsewhere, fakes.READY, 52.0, ["slash", *"hsp", "enter", "escape"]),
    "done": (done, fakes.READY, 52.0, []),
    "compared": (compared, fakes.READY, 52.0, ["d", "d"]),
    "number": (plain, fakes.READY, 52.0, ["slash", *"acc", "enter", *"5.03"]),
    "out-of-range": (plain, fakes.READY, 52.0, ["slash", *"hsp", "enter", *"9999"]),
    "names": (plain, fakes.READY, 52.0, ["slash", *"stt", "enter"]),
    "confirm": (plain, fakes.READY, 52.0, ["slash", *"fry", "enter", "y"]),
    "save": (done, fakes.READY, 52.0, ["S"]),
    "open": (plain, fakes.READY, None, ["ctrl+o", "down"]),
    "factory": (done, fakes.READY, 52.0, ["F"]),
    "help": (plain, fakes.READY, 52.0, ["question_mark"]),
}


OF_WRITING = (
    "settings", "number", "past-a-limit", "out-of-range", "staged", "confirm", "write",
    "write-running", "written", "refused", "locked", "not-armed", "rest",
)  # fmt: skip
"""Steps on the way to a value in the drive."""

OTHER_SIZES = [
    pytest.param(state, size, id=f"{size[0]}x{size[1]}-{state}", marks=marks)
    for size, marks in (((60, 20), ()), ((200, 60), pytest.mark.sweep))
    for state in ("settings", "start-up", "staged", "number", "write-running")
]


@pytest.fixture(autouse=True)
def folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A folder with files: a set of this drive, one of another family, and no set."""
    monkeypatch.setenv("TEXTUAL_ANIMATIONS", "none")
    monkeypatch.chdir(tmp_path)
    head = SetHead("atv71", family="Altivar 71", device=2, identity={"name": "PUMP 2"})
    texts = {
        FILES[0]: dump_set(library.load("atv71"), ParameterSet(head, {**HELD, "ACC": 60})),
        FILES[1]: dump_set(
            library.load("atv312"),
            ParameterSet(SetHead("atv312", family="Altivar 312", device=3), {"ACC": 30}),
        ),
        FILES[2]: "",
    }
    for age, name in enumerate(FILES):
        (tmp_path / name).write_text(texts[name], encoding="utf-8")
        os.utime(tmp_path / name, (WALL - 90_000 * age,) * 2)


def picture(snap_compare: Compare, state: str, size: tuple[int, int]) -> None:
    """The screen in a state."""
    prepare, drive, armed, keys = STATES[state]
    console = editor_of(drive, armed=armed)
    prepare(console.editor)
    app = panel(console)

    async def show(pilot: Pilot[None]) -> None:
        await app.push_screen(ParametersScreen(console))
        await pilot.pause()
        await pilot.press(*keys)
        await pilot.pause()
        if isinstance(app.screen, PickFile):
            files = app.screen.query_one(OptionList)
            await until(pilot, lambda: not any("..." in str(o.prompt) for o in files.options))
        if isinstance(app.screen, ParametersScreen):
            app.screen.look()
        app.draw_frame()
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=show)


@SIZES
@pytest.mark.parametrize("state", kept(STATES, *OF_WRITING))
def test_parameters(snap_compare: Compare, state: str, size: tuple[int, int]) -> None:
    picture(snap_compare, state, size)


@pytest.mark.parametrize(("state", "size"), OTHER_SIZES)
def test_parameters_small_and_large(
    snap_compare: Compare, state: str, size: tuple[int, int]
) -> None:
    picture(snap_compare, state, size)


@SIZES
def test_bits(snap_compare: Compare, size: tuple[int, int]) -> None:
    console = editor_of(fakes.RUNNING, armed=52.0)
    app = panel(console)

    async def show(pilot: Pilot[None]) -> None:
        await app.push_screen(ParametersScreen(console))
        await pilot.pause()
        now = MotorStates(app, [console.session])
        app.push_screen(EditBits(console.editor, console.session.profile["CMI"], now))
        await pilot.pause()
        await pilot.press("down", "enter")
        app.draw_frame()
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=show)


@SIZES
def test_read_only(snap_compare: Compare, size: tuple[int, int]) -> None:
    console = editor_of(fakes.READY)
    cast("fakes.StillLine", console.session.line).read_only = True
    app = panel(console)
    app.read_only = True

    async def show(pilot: Pilot[None]) -> None:
        await app.push_screen(ParametersScreen(console))
        await pilot.pause()
        await pilot.press("plus", "w")
        app.draw_frame()
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=show)


@SIZES
def test_while_it_is_read(snap_compare: Compare, size: tuple[int, int]) -> None:
    app = panel(console := editor_of(fakes.READY, reading=True))

    async def show(pilot: Pilot[None]) -> None:
        await app.push_screen(ParametersScreen(console))
        await pilot.pause()
        await pilot.press("tab", "tab")
        await pilot.pause()
        cast("ParametersScreen", app.screen).look()
        app.draw_frame()
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=show)


def test_foreign_value_is_shown_in_the_scale_of_the_drive() -> None:
    """An Altivar 31 without a ramp increment counts in tenths; that is not an unknown scale."""
    console = fakes.console_of(None, family="atv31")
    editor = still_editor(console, lambda: None)
    image = console.session.image
    image.confirm("ACC", 50, 1.0)
    increment = console.session.profile["Inr"]
    image.take({"Inr": Reading.bad(increment, 1.0, "exception 2", absent=True)})
    editor.staging.stage("ACC", "7 s")
    image.confirm("ACC", 30, 2.0)
    output = "\n".join(line.plain for line in parameter_lines(editor, "ACC", 100, 5))
    assert "it was 5.0 s" in output
