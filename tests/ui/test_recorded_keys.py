"""Keys of screens on still drives, with their effects as recorded.

`recorded_keys.txt` has a section for each scene: each key with the rows of the picture that it
changes, and the answer to each question. A checksum stands for curves and styles.
"""

from __future__ import annotations

import asyncio
import re
import tempfile
import time
from collections.abc import Awaitable, Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any
from zlib import crc32

import pytest
from textual._compositor import Compositor
from textual.css.stylesheet import Stylesheet
from textual.pilot import Pilot
from textual.screen import Screen
from textual.widgets import Input

from tests.recorded import AFTER_A_CHANGE, sections
from tests.sweeps import kept
from tui.bus.errors import PortBusy
from tui.bus.program import Program
from tui.screens.blocks.screen import BlocksScreen
from tui.screens.dialogs.confirm import Confirm
from tui.screens.dialogs.question import Question
from tui.screens.frames.screen import FramesScreen
from tui.screens.keys.table import ACTIONS
from tui.screens.monitor import run_line
from tui.screens.parameters.screen import ParametersScreen
from tui.session.connect import open_line
from tui.session.connect.open_line import OpenLine
from tui.session.events import EventLog
from tui.session.sharing.handover import DriveRequest, Handover

from . import (
    fakes,
    test_block_pictures,
    test_command_pictures,
    test_frame_pictures,
    test_line_pictures,
    test_monitor_pictures,
    test_parameter_pictures,
    test_trend_pictures,
)
from .quick import drawn_for_a_person, parse_once, wait_for_the_busy
from .test_flows import picture

TEXTS = Path(__file__).parent / "recorded_keys.txt"
SIZE = (80, 24)
NOT_PRESSED = {
    "quit",
    "stop",
    "stop_by_space",
    "stop_all",
    "redraw",
    "goto",
    "hear",
    "why",
}
"""Actions that end the panel, open a port, or only show another screen."""
WITHOUT_YES = {"(scan_settings)", "(disconnect)"}
"""Keys whose question is not answered with yes: that would close the line, or scan for long."""
PATIENCE = 20.0
"""Seconds for what a key begins."""
DRAWN = re.compile("[\u2500-\u28ff]")
"""Signs of curves, frames and large digits."""
FILE = re.compile(r"\S+-\d{8}-\d{4}\.\w+ *")
"""A proposed name, with the time of this computer."""
PATCHES: tuple[tuple[Any, str, object], ...] = (
    (open_line, "serial_ports", list),
    (Question, "_is_early", lambda _: False),
    (Input, "_toggle_cursor", lambda _: None),
    (run_line, "ENTER_COUNTS_AFTER", 0.0),
    (Stylesheet, "_parse_rules", parse_once),
    (Pilot, "_wait_for_screen", wait_for_the_busy),
    (Compositor, "render_update", drawn_for_a_person),
)
"""Replacements as in the fixtures of these tests, for `tests.recorded` too."""
Opened = tuple[Any, Callable[[Pilot[None]], Awaitable[None]]]


# -- scenes ----------------------------------------------------------------------------------------


def commanded(state: str, *keys: str) -> Callable[[pytest.MonkeyPatch], Opened]:
    """A screen above Monitor, in a state of commanding."""

    def make(patch: pytest.MonkeyPatch) -> Opened:
        patch.setitem(test_command_pictures.OVER, "", (state, list(keys)))
        return test_command_pictures.shown_over("", patch)

    return make


def foreign(patch: pytest.MonkeyPatch) -> Opened:
    """Monitor of a drive that another program commands, and that a third one requests."""
    app, show = commanded("done")(patch)
    facts = app.chosen.session.line.facts
    owner, third = Program("9", "run", 4711, "anna"), Program("8", "panel", 4712, "otto")
    facts.set_programs((facts.me, owner, third))
    facts.note_commander(2, owner.id)
    handover = Handover(app.chosen.session.line, app.events, lambda _: None, app.clock)
    handover.requests = {2: DriveRequest(2, third, fakes.NOW + 20)}
    app.fleet.handover = handover
    return app, show


def monitored(name: str) -> Callable[[pytest.MonkeyPatch], Opened]:
    def make(patch: pytest.MonkeyPatch) -> Opened:
        app, screen = test_monitor_pictures.panel(test_monitor_pictures.SCENES[name], patch)
        return app, partial(test_monitor_pictures.show, app, screen, ())

    return make


def edited(state: str) -> Callable[[pytest.MonkeyPatch], Opened]:
    def make(_: pytest.MonkeyPatch) -> Opened:
        prepare, drive, armed, keys = test_parameter_pictures.STATES[state]
        console = test_parameter_pictures.editor_of(drive, armed=armed)
        prepare(console.editor)
        app = test_parameter_pictures.panel(console)

        async def show(pilot: Pilot[None]) -> None:
            await app.push_screen(ParametersScreen(console))
            await pilot.pause()
            await pilot.press(*keys)

        return app, show

    return make


def assigned(state: str) -> Callable[[pytest.MonkeyPatch], Opened]:
    def make(_: pytest.MonkeyPatch) -> Opened:
        app, console = test_block_pictures.panel(state)

        async def show(pilot: Pilot[None]) -> None:
            await app.push_screen(BlocksScreen(console))
            await pilot.pause()

        return app, show

    return make


def on_the_wire(page: str) -> Callable[[pytest.MonkeyPatch], Opened]:
    def make(patch: pytest.MonkeyPatch) -> Opened:
        app, console = test_frame_pictures.panel(page, patch)

        async def show(pilot: Pilot[None]) -> None:
            await app.push_screen(FramesScreen(console))
            await pilot.pause()

        return app, show

    return make


def curved(name: str) -> Callable[[pytest.MonkeyPatch], Opened]:
    def make(patch: pytest.MonkeyPatch) -> Opened:
        scene = test_trend_pictures.SCENES[name]
        app, screen = test_trend_pictures.panel(scene, patch)
        return app, partial(test_trend_pictures.show, app, screen, scene)

    return make


def found(state: str) -> Callable[[pytest.MonkeyPatch], Opened]:
    """Line in a state."""

    def make(patch: pytest.MonkeyPatch) -> Opened:
        ports = list(test_line_pictures.PORTS)
        patch.setattr("tui.session.connect.open_line.serial_ports", lambda: ports)

        def busy(*_: object, **__: object) -> OpenLine:
            raise PortBusy("/dev/ttyUSB0", "mbpoll (pid 4711)")

        app = fakes.app_of(busy)
        return app, partial(test_line_pictures.STATES[state], app)

    return make


SCENES: dict[str, tuple[str, Callable[[pytest.MonkeyPatch], Opened]]] = {
    "monitor running": ("monitor", commanded("done")),
    "monitor tripped": ("monitor", commanded("tripped")),
    "monitor of another program": ("monitor", foreign),
    "monitor at the terminals": ("monitor", monitored("terminals")),
    "monitor without scales": ("monitor", monitored("raw")),
    "monitor in percent": ("monitor", monitored("percent")),
    "monitor not heard": ("monitor", monitored("not-heard")),
    "faults": ("faults", commanded("tripped", "5")),
    "no faults": ("faults", commanded("armed", "5")),
    "control": ("control", commanded("armed", "6")),
    "map": ("map", commanded("armed", "6", "tab")),
    "messages": ("messages", commanded("tripped", "m")),
    "start-up": ("start-up", commanded("armed", "B")),
    "start-up ramps": ("start-up", commanded("armed", "B", *["tab"] * 14, "down")),
    "wiring": ("wiring", commanded("armed", "I")),
    "parameters": ("parameters", edited("settings")),
    "parameters staged": ("parameters", edited("staged")),
    "parameters refused": ("parameters", edited("refused")),
    "parameters compared": ("parameters", edited("compared")),
    "scanner proposed": ("scanner", assigned("proposed")),
    "scanner differs": ("scanner", assigned("differs")),
    "scanner indirect": ("scanner", assigned("indirect")),
    "frames": ("frames", on_the_wire("words")),
    "frames lossy": ("frames", on_the_wire("lossy")),
    "trend": ("trend", curved("marks")),
    "line": ("line", found("five")),
    "line poor": ("line", found("poor-line")),
    "line closed": ("line", found("no-line")),
    "line lost": ("line", found("line-lost")),
    "everywhere": ("", commanded("armed")),
    "everywhere on line": ("", found("five")),
}
"""By scene: the screen whose keys are pressed, or none for those of the panel."""
ROWS = {"faults": 9, "control": 4, "start-up": 12, "parameters": 5, "scanner": 4, "line": 3}
"""Rows of a screen that are opened one after another, after all keys."""
QUICK = ("map", "messages")
"""Scenes of the main layer; the others are for the sweeps."""


def keys_of(screen: str) -> list[str]:
    """One key of each action; the action if it has none."""
    mine = (action for action in ACTIONS if (screen in action.screens if screen else action.app))
    left = (action for action in mine if action.id.partition("(")[0] not in NOT_PRESSED)
    own = (action for action in left if action.app is (not screen))
    return [action.keys.split(",")[0] or f"({action.id})" for action in own]


def further(screen: str) -> list[str]:
    """Keys that move a cursor to each of the next rows, and open what is under it."""
    return ["down", "enter"] * ROWS.get(screen, 0)


# -- what is recorded ------------------------------------------------------------------------------


def checksum(screen: Screen[Any]) -> str:
    """Of the picture with its styles."""
    strips = screen._compositor.render_strips()
    parts = (f"{part.style}{FILE.sub('FILE', part.text)}" for strip in strips for part in strip)
    return f"{crc32(''.join(parts).encode()):08x}"


async def settled(app: Any, pilot: Pilot[None]) -> None:
    """Draw what is new."""
    end = time.monotonic() + PATIENCE
    while not all(worker.is_finished for worker in app.workers) and time.monotonic() < end:
        if isinstance(app.screen, Question):  # a worker waits for its answer
            break
        await pilot.pause(0.01)
    if hasattr(app.screen, "look"):
        app.screen.look()
    app.draw_frame()
    await pilot.pause()


def is_typing(app: Any) -> bool:
    """True if the next letter would go into a field or the run line."""
    return isinstance(app.focused, Input) or "Esc cancel" in picture(app).splitlines()[-1]


async def step(app: Any, pilot: Pilot[None], key: str, seen: set[str]) -> list[str]:
    """Press a key; the rows of the picture that were not seen before."""
    newest = app.events.newest
    await fakes.press(pilot, key)
    await settled(app, pilot)
    screen = app.screen
    lines = FILE.sub("FILE", picture(app)).splitlines()
    rows = dict.fromkeys(row.strip(" │") for row in lines)
    texts = [row for row in rows if row not in seen and len(DRAWN.findall(row)) < 6]
    seen.update(texts)
    if app.events.newest is not newest and app.events.newest.text not in " ".join(texts):
        texts.append(f"say {app.events.newest.kind}: {app.events.newest.text}")
    return [f"> {key} {type(screen).__name__} {checksum(screen)}", *texts]


async def pressed(name: str) -> list[str]:
    """All keys of a scene, one after another; a new panel after one that left the screen.

    A question is canceled once, and answered once; a field is closed after Enter.
    """
    screen, make = SCENES[name]
    keys, found = [*keys_of(screen), *further(screen)], list[str]()
    seen = set[str]()
    while keys:
        with pytest.MonkeyPatch.context() as patch:
            app, show = make(patch)
            app.events = EventLog(app.clock.wall)
            async with app.run_test(size=SIZE) as pilot:
                await show(pilot)
                await settled(app, pilot)
                base = app.screen
                while keys and app.screen is base:
                    key = keys.pop(0)
                    found += await step(app, pilot, key, seen)
                    if isinstance(app.screen, Question) and key not in WITHOUT_YES:
                        await pilot.press("escape")
                        await fakes.press(pilot, key)
                        yes = "y" if isinstance(app.screen, Confirm) else "enter"
                        found += await step(app, pilot, yes, seen)
                    elif is_typing(app) and app.screen is base and key != "enter":
                        found += await step(app, pilot, "enter", seen)
                    for _ in range(3):
                        if app.screen is not base or is_typing(app):
                            await pilot.press("escape")
                            await pilot.pause()
                assert app._exception is None
    return found


def recorded(name: str) -> Iterator[str]:
    with pytest.MonkeyPatch.context() as patch, tempfile.TemporaryDirectory() as folder:
        for variable in ("STATE", "CONFIG"):
            patch.setenv(f"DRIVEPANEL_{variable}", f"{folder}/{variable.lower()}")
        patch.setenv("TEXTUAL_ANIMATIONS", "none")
        patch.chdir(folder)
        for target, name_of, new in PATCHES:
            patch.setattr(target, name_of, new)
        yield from asyncio.run(pressed(name))


def _section(name: str) -> partial[Iterator[str]]:
    section = partial(recorded, name)
    section.__name__ = name  # type: ignore[attr-defined]
    return section


SECTIONS = tuple(map(_section, SCENES))


@pytest.mark.parametrize("name", kept(SCENES, *QUICK))
def test_keys_of_a_scene_have_the_recorded_effects(name: str) -> None:
    assert "\n".join(recorded(name)) == sections(TEXTS)[name], AFTER_A_CHANGE
