"""Texts of people, drives, files and profiles: no markup, no control of the terminal."""

from __future__ import annotations

import os
import pty
import select
import signal
import sys
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from rich.text import Text
from textual.widgets import Input

from tests.answering import read_answering
from tests.sources import calls_of
from tests.sweeps import kept
from tui.app import DrivePanelApp
from tui.drive.settings.restore_plan import RestoreItem
from tui.screens.blocks.screen import BlocksScreen
from tui.screens.choosing import Palette
from tui.screens.dialogs.ask import Ask
from tui.screens.dialogs.confirm import Confirm
from tui.screens.dialogs.pick_parameter import PickParameter
from tui.screens.faults.screen import FaultsScreen
from tui.screens.frames.screen import FramesScreen
from tui.screens.messages.screen import MessagesScreen
from tui.screens.monitor.screen import MonitorScreen
from tui.screens.parameters.edit_value import EditNumber
from tui.screens.parameters.screen import ParametersScreen
from tui.screens.parameters.set_keys import Skipped
from tui.screens.trend.screen import TrendScreen
from tui.terminal.lean import cells_of
from tui.widgets.plain import entry

from . import fakes
from .fakes import press
from .test_command_flows import Bench, bench
from .test_flows import shown, until
from .test_parameter_flows import open_file, write
from .test_start_up_screen import start_up as open_start_up

pytestmark = pytest.mark.drawn

ROOT = Path(__file__).resolve().parents[2]
MARKUP = ("[/]", "[bold]", "[@click=app.quit]x[/]", "[")
FILES = ("[bold].toml", "[@click=app.quit]x.toml", "[red.toml")
NAME = "\x1b]0;x\x07[red]"
SHOWN = "␛]0;x␇[red]"
PATIENCE = 40.0
Way = Callable[[Bench], Awaitable[None]]


@pytest.fixture(autouse=True)
def alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", list)
    monkeypatch.chdir(tmp_path)


async def dialog(made: Bench, key: str, kind: type = Ask) -> None:
    """Open a dialog, and type markup into its field."""
    for text in MARKUP:
        await press(made.pilot, key)
        await until(made.pilot, lambda: isinstance(made.app.screen, kind))
        await typed(made, text)
        if isinstance(made.app.screen, kind):
            await made.pilot.press("escape")
        await until(made.pilot, lambda: not isinstance(made.app.screen, kind))


async def typed(made: Bench, text: str) -> None:
    """Type a text into the field that has the focus, and press Enter."""
    field = made.app.focused
    assert isinstance(field, Input)
    for value in (text, text * 9):
        field.value = value
        await made.pilot.pause()
    field.value = text
    await made.pilot.press("enter")
    await made.pilot.pause()
    assert made.app.is_running


async def monitor(made: Bench) -> None:
    """The run line accepts no such character: it closes, and nothing else happens."""
    await made.armed()
    drive = made.app.chosen
    for character in ("left_square_bracket", "slash", "at", "right_square_bracket"):
        await made.pilot.press("f", "3")
        await until(made.pilot, lambda: "REFERENCE" in shown(made.app, "message"))
        await made.pilot.press(character)
        await until(made.pilot, lambda: "REFERENCE" not in shown(made.app, "message"))
        assert isinstance(made.app.screen, MonitorScreen)
        assert made.app.chosen is drive
    await dialog(made, "ctrl+p", Palette)


async def rating(made: Bench) -> None:
    await dialog(made, "(rating)")


async def inputs(made: Bench) -> None:
    assert made.app.opened is not None
    made.app.opened.simulation = made.simulation
    await dialog(made, "l")


async def teaching(made: Bench) -> None:
    await made.pilot.press("3")
    await until(made.pilot, lambda: isinstance(made.app.screen, ParametersScreen))
    await made.pilot.press("slash", *"5.01", "enter")
    await until(made.pilot, lambda: "5.01" in shown(made.app, "detail"))
    await dialog(made, "L")


async def parameters(made: Bench) -> None:
    await made.pilot.press("3")
    await until(made.pilot, lambda: isinstance(made.app.screen, ParametersScreen))
    await until(made.pilot, lambda: bool(shown(made.app, "table")))
    for text in MARKUP:
        await made.pilot.press("slash")
        await typed(made, text)
    made.app.screen.query_one("#search", Input).value = ""
    await made.pilot.press("slash", *"acc")
    made.app.screen.set_focus(None)
    await until(made.pilot, lambda: " raw " in shown(made.app, "detail"))
    await dialog(made, "enter", EditNumber)
    for key in ("ctrl+s", "ctrl+r"):
        await dialog(made, key)
    await files(made)


def reported(made: Bench) -> str:
    """Text of Scanner, or the last message."""
    newest = made.app.events.newest
    here = shown(made.app, "message") if made.app.screen.query("#message") else ""
    return f"{here} {newest.text if newest else ''}"


async def files(made: Bench) -> None:
    """A list of files whose names are markup; the message about an invalid one names it."""
    for name in FILES:
        file = Path(name)
        write(file, "format = 1\n[drive\n")
        await open_file(made, file)
        await until(made.pilot, lambda: name[:20] in reported(made))  # noqa: B023
        assert made.app.is_running


async def blocks(made: Bench) -> None:
    for slot, code in {"NCA1": "ACC", "NCA2": "DEC"}.items():
        made.drive().set(slot, made.drive().profile[code].address)
    await made.pilot.press("4", "a")
    await until(made.pilot, lambda: isinstance(made.app.screen, BlocksScreen))
    await until(made.pilot, lambda: "DEC" in shown(made.app, "second"))
    await until(made.pilot, lambda: " ARMED" in shown(made.app, "strip"))
    for key in ("ctrl+s", "(words)", "X"):
        await dialog(made, key)
    await files(made)
    await dialog(made, "enter", PickParameter)


async def faults(made: Bench) -> None:
    made.drive().provoke(18)
    await until(made.pilot, lambda: "FAULT" in shown(made.app, "state"))
    await made.pilot.press("5")
    await until(made.pilot, lambda: isinstance(made.app.screen, FaultsScreen))
    screen = made.app.screen
    await until(made.pilot, lambda: screen._recorder.latest is not None)  # type: ignore[attr-defined]
    await dialog(made, "ctrl+s")
    await made.pilot.press("7")
    await until(made.pilot, lambda: isinstance(made.app.screen, FramesScreen))
    await dialog(made, "ctrl+s")
    await made.pilot.press("8")
    await until(made.pilot, lambda: isinstance(made.app.screen, TrendScreen))
    await dialog(made, "ctrl+s")
    await made.pilot.press("m")
    await until(made.pilot, lambda: isinstance(made.app.screen, MessagesScreen))
    await dialog(made, "J")


async def connection(made: Bench) -> None:
    await made.pilot.press("1")
    await until(made.pilot, lambda: made.app.screen is made.app.connection)
    for name in ("baud", "format", "addresses", "profile"):
        for text in MARKUP:
            field = made.app.connection.query_one(f"#{name}", Input)
            field.disabled = False
            field.focus()
            field.value = text
            await made.pilot.pause()
            made.app.connection.action_scan()
            await made.pilot.pause()
            field.value = ""
    made.app.connection.drives.focus()
    await dialog(made, "n")
    await made.pilot.press("ctrl+p")
    await until(made.pilot, lambda: isinstance(made.app.screen, Palette))
    await made.pilot.press(*"bundle", "enter")
    await until(made.pilot, lambda: isinstance(made.app.screen, Ask))
    for text in MARKUP:
        made.app.screen.query_one(Input).value = text
        await made.pilot.pause()
    await made.pilot.press("escape")


async def start_up(made: Bench) -> None:
    opened = await open_start_up(made, "Identity")
    await made.pilot.press("enter")
    for text in MARKUP:
        await until(made.pilot, lambda: isinstance(made.app.screen, Ask))
        made.app.screen.query_one(Input).value = text
        await made.pilot.pause()
    await made.pilot.pause(0.4)
    await made.pilot.press("enter")
    await until(made.pilot, lambda: bool(opened.record.entries))


WAYS: dict[str, tuple[str, Way]] = {
    "monitor": ("atv71", monitor),
    "rating": ("atv21", rating),
    "teaching": ("powerdrive", teaching),
    "inputs": ("atv21", inputs),
    "parameters": ("atv312", parameters),
    "scanner": ("atv71", blocks),
    "faults": ("atv71", faults),
    "line": ("atv71", connection),
    "start-up": ("atv71", start_up),
}
QUESTION_CLASSES = {
    "rating",
    "teaching",
    "inputs",
    "Ctrl+S and report of Parameters",
    "Ctrl+S of Blocks",
    "words",
    "X",
    "Ctrl+S of Faults",
    "Ctrl+S of Frames",
    "Ctrl+S of Trend",
    "J of Messages",
    "@ of a replay",  # in test_replay
    "n",
    "bundle of the palette",
    "reference of Start-up",
}


@pytest.mark.parametrize("name", kept(WAYS, "rating", "inputs"))
@pytest.mark.sweep
async def test_markup_in_every_field_is_text(name: str) -> None:
    family, way = WAYS[name]
    async with bench(family) as made:
        await way(made)
        assert made.app._exception is None


def test_every_question_field_is_tested() -> None:
    assert len(list(calls_of("Ask"))) == len(QUESTION_CLASSES), (
        "a new question: type markup into it here too"
    )


async def test_texts_of_dialogs_notices_and_lists_are_shown_literally() -> None:
    app = fakes.app_of()
    async with app.run_test(size=(80, 24), notifications=True) as pilot:
        for text in (*MARKUP, NAME):
            as_shown = text.replace(NAME, SHOWN)
            await app.push_screen(Confirm(text, text, yes=text, no=text, loses=True))
            assert as_shown in str(app.screen.query_one("#hint").render())
            for place in ("#question", "#follows"):
                assert str(app.screen.query_one(place).render()) == as_shown
            app.screen.dismiss()
            await pilot.pause()
            await app.push_screen(Skipped(1, text, [RestoreItem(text, "skip", text=text)]))
            await pilot.pause()
            assert as_shown in picture(app)
            app.screen.dismiss()
            await pilot.pause()
            app.unreached = text, app.clock.monotonic()
            app.draw_frame()
            await until(pilot, lambda text=as_shown: text in picture(app))  # type: ignore[misc]
            app.notify(text)
            await until(pilot, lambda text=as_shown: text[:12] in shown(app, "said"))  # type: ignore[misc]
            app.clear_notifications()
            assert str(entry(Text(text)).prompt) == as_shown.replace("␇", "")
            app.connection.form.query_one("#profile", Input).value = f"<{text}>"
            in_field = f"<{as_shown}>".replace("␇", "")[:12]
            await until(pilot, lambda text=in_field: text in picture(app))  # type: ignore[misc]
        assert app._exception is None


def picture(app: DrivePanelApp) -> str:
    """Text on the screen."""
    lines = app.screen._compositor.render_strips()
    return "\n".join(strip.text for strip in lines)


def test_cell_never_has_control_characters() -> None:
    from rich.color import ColorSystem
    from rich.segment import Segment
    from textual.strip import Strip

    cells = cells_of(Strip([Segment("a\x1b[2Jb\x9b\u0301")]), ColorSystem.TRUECOLOR)
    assert [text for text, _ in cells] == ["a", "[", "2", "J", "b\u0301"]


def panel() -> None:
    """The panel on a drive with a name that no drive should have."""
    from tui.session.connect.open_line import OpenLine, open_line
    from tui.simulator import DriveSpec, Simulation

    simulation = Simulation([DriveSpec("atv71", 1, identity={0: NAME, 6: NAME})])
    simulation.start()
    line = f"serial:{simulation.serve_pty()},19200,8N1"

    def opener(_: str, **how: object) -> OpenLine:
        opened = open_line(line, **how)  # type: ignore[arg-type]
        opened.devices = (1,)
        return opened

    DrivePanelApp(open_line=opener, start=line).run()


@pytest.mark.skipif(not hasattr(pty, "fork"), reason="no pseudo-terminals here")
@pytest.mark.sweep
def test_drive_name_does_not_control_terminal() -> None:
    process, terminal = pty.fork()
    if process == 0:
        code = "from tests.ui.test_text_is_text import panel; panel()"
        environment = os.environ | {"TERM": "xterm-256color", "PYTHONPATH": str(ROOT)}
        os.chdir(ROOT)
        os.execve(sys.executable, [sys.executable, "-c", code], environment)
    try:
        seen = read_until(terminal, SHOWN.encode(), b"profile Altivar")
        os.write(terminal, b"\r")
        seen += read_until(terminal, SHOWN[:6].encode(), b"Output")
    finally:
        os.kill(process, signal.SIGTERM)
        os.close(terminal)
        os.waitpid(process, 0)
    assert b"]0;x" in seen
    assert b"\x1b]0;" not in seen
    assert b"x\x07" not in seen


def read_until(terminal: int, *wanted: bytes) -> bytes:
    """Output of a program until all of this is in it."""
    seen = b""
    end = time.monotonic() + PATIENCE
    while not all(part in seen for part in wanted):
        assert time.monotonic() < end, seen[-2000:]
        if select.select([terminal], [], [], 0.2)[0]:
            seen += read_answering(terminal)
    return seen
