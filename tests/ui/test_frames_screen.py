"""Frames on a simulated line: filter, find, hold, save, and its page of counters."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from tui.screens.dialogs.ask import Ask
from tui.screens.dialogs.confirm import Confirm
from tui.screens.frames.screen import FramesScreen
from tui.screens.monitor.screen import MonitorScreen
from tui.simulator.troubles import FaultRates

from .test_frame import Panel, panel

pytestmark = pytest.mark.long


@asynccontextmanager
async def on_frames() -> AsyncIterator[Panel]:
    async with panel() as made:
        await made.pilot.press("7")
        await made.until(lambda: isinstance(made.app.screen, FramesScreen))
        await made.until(lambda: "→" in made.shown("frames"))
        yield made


def listed(made: Panel) -> list[str]:
    return made.shown("frames").splitlines()[1:]


async def test_nothing_has_the_focus_so_that_space_stops() -> None:
    async with on_frames() as made:
        assert made.app.screen.focused is None
        await made.until(lambda: "Space STOP" in made.shown("keys"))
        await made.pilot.press("O")
        await made.until(lambda: "keep" in made.shown("keys"))
        assert "Space STOP" in made.shown("keys")
        await made.pilot.press("enter")
        assert made.app.screen.focused is None
        await made.pilot.press("space")
        await made.until(lambda: "STOP" in made.shown("strip") or "STANDBY" in made.shown("strip"))


async def test_filter_applies_while_typed_and_esc_clears_it() -> None:
    async with on_frames() as made:
        await made.until(lambda: len(listed(made)) > 8)
        await made.pilot.press("O", *"rfr")
        await made.until(lambda: "filter: rfr" in made.shown("frames"))
        await made.until(lambda: bool(listed(made)))
        assert all("RFR" in line for line in listed(made))
        await made.pilot.press("enter")
        await made.until(lambda: "filter: rfr" in made.shown("frames"))
        assert not made.app.screen.query_one("#wanted").display
        await made.pilot.press("escape")
        await made.until(lambda: "filter" not in made.shown("frames"))
        assert isinstance(made.app.screen, FramesScreen)
        await made.pilot.press("escape")
        await made.until(lambda: isinstance(made.app.screen, MonitorScreen))


@pytest.mark.sweep
async def test_errors_filter_shows_errors_with_their_requests() -> None:
    async with on_frames() as made:
        assert made.app.opened is not None
        await made.pilot.press("O", *"error", "enter")
        await made.until(lambda: "filter: error" in made.shown("frames"))
        made.simulation.faults.rates = FaultRates(lost=1.0)
        await made.until(lambda: len(listed(made)) > 2)
        made.simulation.faults.rates = FaultRates()
        assert any("→" in line for line in listed(made))


async def test_find_pauses_the_list_and_continues_to_older_frames() -> None:
    async with on_frames() as made:
        await made.until(lambda: made.shown("frames").count("RFR") > 8)
        screen = made.app.screen
        assert isinstance(screen, FramesScreen)
        await made.pilot.press("j", *"RFR", "enter")
        await made.until(lambda: "(paused)" in made.shown("frames"))
        first = screen._found
        assert first is not None
        await made.pilot.press("enter")
        await made.until(lambda: screen._found is not first)
        assert screen._found is not None
        assert screen._found.time < first.time
        await made.pilot.press("escape", "j", *"no such thing", "enter")
        await made.until(lambda: "No frame matches" in made.shown("said"))
        await made.pilot.press("escape", "h")
        await made.until(lambda: "(paused)" not in made.shown("frames"))


@pytest.mark.sweep
async def test_scrolling_pauses_and_stops_at_the_ends() -> None:
    async with on_frames() as made:
        await made.until(lambda: len(listed(made)) > 15)
        await made.pilot.press("up")
        await made.until(lambda: "(paused)" in made.shown("frames"))
        newest = listed(made)
        for _ in range(110):
            await made.pilot.press("pageup")
        oldest = listed(made)
        assert len(oldest) == len(newest)
        await made.pilot.press("up")
        assert listed(made) == oldest
        for _ in range(110):
            await made.pilot.press("pagedown")
        await made.pilot.press("up")
        assert listed(made) == newest


async def test_shown_frames_are_saved_as_text(tmp_path: Path) -> None:
    async with on_frames() as made:
        await made.pilot.press("O", *"1-read", "enter", "h", "ctrl+s")
        await made.until(lambda: isinstance(made.app.screen, Ask))
        field = made.app.screen.query_one("#answer")
        path = tmp_path / "new" / "frames.txt"
        field.value = str(path)  # type: ignore[attr-defined]
        await made.pilot.press("enter")
        await made.until(lambda: "Saved:" in made.shown("said"))
        text = path.read_text("utf-8")
        lines = [line for line in text.splitlines() if not line.startswith("#")]
        assert lines
        assert all(line.split("\t")[3].startswith("1 ") for line in lines)
        assert "filter: 1 read" in text


@pytest.mark.sweep
async def test_counters_of_the_open_drive_are_shown_for_both_sides() -> None:
    async with on_frames() as made:
        await made.pilot.press("tab", "tab")
        await made.until(lambda: "Counters of drive 1" in made.shown("frames"))
        await made.until(lambda: "function 8" in made.shown("frames"))
        await made.until(lambda: "All were sent here" in made.shown("frames"))
        screen = made.app.screen
        assert isinstance(screen, FramesScreen)
        watch = screen.console.counters
        made.simulation.faults.rates = FaultRates(lost=1.0)
        await made.until(lambda: watch.trouble)
        await made.until(lambda: "Device 1 did not" in made.shown("frames"))
        made.simulation.faults.rates = FaultRates()
        await made.until(lambda: not watch.trouble and watch.now().differences)
        await made.until(lambda: "■ The drive received" in made.shown("frames"))
        await made.pilot.press("C")
        await made.until(lambda: "The drive received" not in made.shown("frames"))
        await made.until(lambda: "Counts restarted" in made.shown("said"))
        await made.pilot.press("tab")
        await made.until(lambda: "Frames on the line" in made.shown("frames"))


async def test_drive_counters_are_reset_only_after_confirmation() -> None:
    async with on_frames() as made:
        await made.pilot.press("Z")
        await made.until(lambda: "Press Tab to show the counters first" in made.shown("said"))
        await made.pilot.press("tab", "tab")
        await made.until(lambda: "function 8" in made.shown("frames"))
        counters = made.simulation.drive(1).server.counters
        before = counters.frames
        await made.pilot.press("Z")
        await made.until(lambda: "Not armed" in made.shown("said"))
        await made.pilot.press("2", "a")
        await made.until(lambda: " ARMED" in made.shown("strip"))
        await made.pilot.press("7", "tab", "tab", "Z")
        await made.until(lambda: isinstance(made.app.screen, Confirm))
        await made.pilot.press("n")
        await made.until(lambda: isinstance(made.app.screen, FramesScreen))
        assert counters.frames >= before
        screen = made.app.screen
        assert isinstance(screen, FramesScreen)
        for ended in (True, False):  # the minute of arming may end while the question is open
            await made.pilot.press("Z")
            await made.until(lambda: isinstance(made.app.screen, Confirm))
            if ended:
                screen.session.arming.disarm("Disarmed: no key pressed for 60 s.")
            await made.pilot.press("y")
            output = "Counters not reset: " if ended else "The drive's counters were reset."
            await made.until(lambda output=output: output in made.shown("said"))  # type: ignore[misc]
            assert (counters.frames >= before) is ended
            screen.session.arming.arm()
