"""Every screen and dialog at any size: no error, and a sentence if the terminal is too small."""

from __future__ import annotations

import random
from typing import Any

import pytest

from tests.sweeps import kept
from tui.app import DrivePanelApp
from tui.widgets.small import is_too_small

from . import fakes
from .test_dialog_keys import DIALOGS, on_monitor
from .test_flows import picture, until

SMALLEST, LARGEST = (5, 3), (300, 100)
AWKWARD = [(22, 60), (20, 40), (22, 100), (5, 3), (59, 100), (300, 15), (60, 16), (300, 100)]
"""Sizes that ended the panel, and the edges."""
SCREENS = {
    "Line": "1", "Monitor": "2", "Parameters": "3", "Scanner": "4", "Faults": "5", "Control": "6",
    "Frames": "7", "Messages": "m", "Wiring": "I", "Start-up": "B", "run line": "f",
    "search": "slash",
}  # fmt: skip
"""Keys that lead from Monitor to each screen."""


async def resized(pilot: Any, app: DrivePanelApp, size: tuple[int, int]) -> None:
    """Give the terminal a size; below the least size only the sentence is there."""
    await pilot.resize_terminal(*size)
    app.look_around()
    if is_too_small(*size):
        await until(pilot, lambda: "Space" in picture(app) or size[1] < 6 or size[0] < 12)


async def resizes(
    monkeypatch: pytest.MonkeyPatch, sizes: list[tuple[int, int]], place: str
) -> None:
    """Show a place, give it all sizes, and stop from it while the terminal is too small."""
    app = fakes.app_of()
    async with app.run_test(size=(80, 24)) as pilot:
        console, stopped = await on_monitor(app, pilot, monkeypatch)
        if place in DIALOGS:
            app.push_screen(DIALOGS[place](app, console))
        else:
            await pilot.press(SCREENS[place])
        await pilot.pause()
        for size in sizes:
            await resized(pilot, app, size)
        await pilot.resize_terminal(22, 60)
        stopped.clear()
        assert app.take_stop_key("space")
        assert stopped == [False]


def random_sizes(count: int, seed: int) -> list[tuple[int, int]]:
    chance = random.Random(seed)
    return [
        (chance.randint(SMALLEST[0], LARGEST[0]), chance.randint(SMALLEST[1], LARGEST[1]))
        for _ in range(count)
    ]


PLACES = [*SCREENS, *DIALOGS]


@pytest.mark.parametrize("place", kept(PLACES, *PLACES[::12]))
@pytest.mark.sweep
async def test_screens_survive_awkward_sizes(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    await resizes(monkeypatch, [*AWKWARD, *random_sizes(3, PLACES.index(place))], place)


@pytest.mark.sweep
@pytest.mark.parametrize("place", PLACES)
async def test_screens_survive_random_sizes(place: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """1,000 sizes over all places."""
    await resizes(monkeypatch, random_sizes(1000 // len(PLACES) + 1, PLACES.index(place)), place)
