"""The run line: keys that edit it, keys that close it, and Enter alone runs."""

from __future__ import annotations

import itertools
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from decimal import Decimal

import pytest

from tests.limits import ENTER_COUNTS_AFTER
from tests.sweeps import kept
from tui.drive.profile import library
from tui.screens.monitor import run_line
from tui.screens.monitor.run_line import RunLine, proposed, run_lines

from . import fakes
from .test_command_flows import Bench, bench, disarmed, output, writes
from .test_flows import shown, until

MOMENT = 0.3
"""Seconds before which Enter does not answer, by the safety rules."""
SETTLED = ENTER_COUNTS_AFTER
LINE = RunLine("forward", "30.0", "Hz", fakes.NOW, 0)
ARROWS = ("up", "down", "pageup", "pagedown")
CLOSING = ["escape", "q", "n", "y", "x", "r", "v", "f", "a", "3 a", "tab", "left", "delete", "f5"]


def edited(line: RunLine, keys: str) -> str:
    """The text after these characters; `<` is Backspace."""
    for key in keys:
        changed = line.erased() if key == "<" else line.typed(key)
        assert changed is not None
        line = changed
    return line.text


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ("4", "4"),
        ("45", "45"),
        ("4.5", "4.5"),
        ("4,5", "4.5"),
        ("4..5", "4.5"),
        (".5", "0.5"),
        ("<", ""),
        ("45<", "4"),
        ("<45", "45"),
        ("<.5", "0.5"),
        ("123456789", "1234567"),
    ],
)
def test_first_digit_replaces_the_suggestion_and_others_edit(keys: str, text: str) -> None:
    assert edited(LINE, keys) == text


@pytest.mark.parametrize("character", ["x", " ", "-", "e", "[", "²", "٣"])
def test_keys_that_are_not_in_a_number_are_ignored(character: str) -> None:
    assert LINE.typed(character) is None


def test_run_line_steps_end_at_the_limits() -> None:
    low, high = Decimal(20), Decimal(50)
    ends = {key: LINE.stepped(key, low, high).text for key in ARROWS}
    assert ends == {"up": "31.0", "down": "29.0", "pageup": "35.0", "pagedown": "25.0"}
    near = RunLine("reference", "49.5", "Hz", fakes.NOW, 0)
    assert near.stepped("up", low, high).text == "50"
    assert (
        RunLine("reference", "22", "Hz", fakes.NOW, 0).stepped("pagedown", low, high).text == "20"
    )
    assert RunLine("reference", "3", "Hz", fakes.NOW, 0).stepped("pagedown", None, None).text == "0"
    assert RunLine("reference", "900", "rpm", fakes.NOW, 0).stepped("up", None, None).text == "910"


def test_last_reference_given_is_suggested_else_that_of_the_drive() -> None:
    profile = library.load("atv71")
    held = {"LFR": -300}
    assert proposed(profile, "42.5 Hz", held) == ("42.5", "Hz")
    assert proposed(profile, "", held) == ("30.0", "Hz")
    assert proposed(profile, "", held | {"FRH": 500}) == ("30.0", "Hz")
    assert proposed(profile, "", {"FRH": 500}) == ("50.0", "Hz")
    assert proposed(profile, "", {}) == ("0", "Hz")
    assert proposed(library.load("varmeca"), "", {}) == ("", "")


@pytest.mark.parametrize("width", [60, 72, 80, 120])
def test_run_line_shows_whole_parts(width: int) -> None:
    profile = library.load("atv71")
    raws = {**fakes.RUNNING, "HSP": 500, "LSP": 0, "ACC": 30, "DEC": 30, "INR": 1, "FRS": 500}
    readings = fakes.snapshot_of(profile, raws).readings
    _, first, _ = run_lines(LINE, profile, readings, fakes.NOW, width, output=Decimal(0))
    assert "…" not in first.plain
    assert not first.plain.rstrip().endswith("·")
    assert ("reached in" in first.plain) == (width >= 80)


def test_run_line_waits_the_moment_of_the_safety_rules() -> None:
    assert SETTLED == MOMENT


# On a drive


@asynccontextmanager
async def ready() -> AsyncIterator[Bench]:
    """An armed drive at rest with 30 Hz as its reference."""
    async with bench("atv71") as made:
        await made.armed()
        await made.refer("30")
        yield made


def open_lines(made: Bench) -> Callable[[], bool]:
    return lambda: "Esc cancel" in output(made.app)


async def test_early_enter_runs_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    async with ready() as made:
        monkeypatch.setattr(run_line, "ENTER_COUNTS_AFTER", SETTLED)
        clock = made.app.clock
        now = clock.monotonic()
        clock.monotonic = lambda: now  # type: ignore[method-assign]
        before = writes(made.app)
        await made.pilot.press("r")
        await until(made.pilot, open_lines(made))
        for passed in (0.0, 0.1, MOMENT - 0.01):
            clock.monotonic = lambda passed=passed: now + passed  # type: ignore[method-assign,misc]
            await made.pilot.press("enter", "enter")
            await made.pilot.pause(0.2)
            assert writes(made.app) == before
            assert open_lines(made)()
            assert any(event.text.startswith("Enter ignored") for event in made.app.events.events)
        clock.monotonic = lambda: now + MOMENT + 0.01  # type: ignore[method-assign]
        await made.pilot.press("enter")
        await until(made.pilot, lambda: made.speed() > 2)


async def test_five_keys_lead_from_arming_to_a_running_motor() -> None:
    async with bench("atv71") as made:
        await made.armed()
        await made.pilot.press("r", "3", "0")
        await made.pilot.pause(0.3)
        assert writes(made.app) == []
        await made.pilot.press("enter")
        await until(made.pilot, lambda: made.speed() > 2)
        assert made.drive().raw("LFR") == 300


async def test_any_other_key_closes_the_run_line_and_is_ignored() -> None:
    async with ready() as made:
        screen, before = made.app.screen, time.monotonic()
        for keys in CLOSING:
            await made.pilot.press("v")
            await until(made.pilot, open_lines(made))
            await made.pilot.press(*keys.split())
            await until(made.pilot, lambda: not open_lines(made)())
            await made.pilot.press("enter")
            await made.pilot.pause(0.3)
            assert made.app.screen is screen, keys
            assert writes(made.app, before) == [], keys
            assert made.app.chosen is not None
            assert made.app.chosen.session.arming.armed, keys


@pytest.mark.parametrize("stop", kept(["space", "f12", "f9"], "space"))
async def test_stop_closes_the_run_line_and_a_later_enter_is_ignored(stop: str) -> None:
    async with ready() as made:
        for key, typed in itertools.product("rvf", ["", "4", "4."]):
            if not made.is_armed():
                await made.armed()
            before = made.last_stop()
            await made.pilot.press(key, *typed)
            await until(made.pilot, open_lines(made))
            await made.pilot.press(stop, "enter")
            await made.stopped(behind=before)
            await until(made.pilot, lambda: not open_lines(made)())
            assert made.drive().raw("LFR") == 300, (key, typed)
            assert made.drive().raw("CMD") == 7, (key, typed)
            await disarmed(made)


async def test_end_of_arming_closes_the_run_line() -> None:
    async with ready() as made:
        before = writes(made.app)
        await made.pilot.press("r")
        await until(made.pilot, open_lines(made))
        made.app.screen.session.arming.disarm()  # type: ignore[attr-defined]
        await until(made.pilot, lambda: not open_lines(made)())
        await made.pilot.press("enter")
        await made.pilot.pause(0.3)
        assert writes(made.app) == before


async def test_arrows_edit_the_run_line_or_step_the_reference() -> None:
    async with ready() as made:
        await made.pilot.press("f", "up", "up", "pagedown", "backspace", "2", "7")
        await until(made.pilot, lambda: "REFERENCE at 27 Hz" in output(made.app))
        assert made.drive().raw("LFR") == 300
        await made.pilot.press("enter")
        await until(made.pilot, lambda: made.drive().raw("LFR") == 270)
        await until(made.pilot, lambda: "Esc cancel" not in output(made.app))
        await made.pilot.press("down")
        await until(made.pilot, lambda: made.drive().raw("LFR") == 260)


async def test_step_beyond_a_limit_reaches_the_limit() -> None:
    async with ready() as made:
        made.drive().set("HSP", 330)
        made.drive().set("LSP", 280)
        await made.pilot.press("pageup")
        await until(made.pilot, lambda: made.drive().raw("LFR") == 330)
        await until(made.pilot, lambda: "Esc cancel" not in output(made.app))
        await made.pilot.press("pagedown")
        await until(made.pilot, lambda: made.drive().raw("LFR") == 280)


async def test_arrow_that_would_start_the_motor_opens_the_run_line() -> None:
    async with bench("atv71") as made:
        await made.armed()
        await made.refer("30")
        await made.run("r")
        await until(made.pilot, lambda: made.speed() > 2)
        await made.refer("0")
        await until(made.pilot, lambda: made.speed() == 0)
        screen = made.app.screen
        await until(made.pilot, lambda: screen._would_start())  # type: ignore[attr-defined]
        before = writes(made.app)
        await made.pilot.press("up")
        await until(made.pilot, open_lines(made))
        await made.pilot.pause(0.3)
        assert writes(made.app) == before
        assert made.speed() == 0
        await made.pilot.press("enter")
        await until(made.pilot, lambda: made.speed() > 0)


async def test_run_line_has_no_reference_if_another_source_gives_it() -> None:
    async with bench("varmeca") as made:
        await made.armed()
        await made.pilot.press("r")
        await until(made.pilot, lambda: "the reference is set at the drive" in output(made.app))
        await made.pilot.press("3")
        await until(made.pilot, lambda: "RUN FORWARD" not in output(made.app))
        await made.pilot.press("f")
        await made.message("has no known parameter")


async def test_r_at_0_hz_asks_for_a_reference() -> None:
    async with bench("atv71") as made:
        await made.armed()
        await made.pilot.press("r")
        await until(made.pilot, lambda: "The reference is 0" in output(made.app))
        before = writes(made.app)
        await made.pilot.press("enter")
        await made.message("The reference is 0. Type a reference, then Enter.")
        assert "RUN FORWARD" in output(made.app)
        assert writes(made.app) == before
        await made.pilot.press("2", "0")
        await until(made.pilot, lambda: "Type a reference" not in output(made.app))
        await made.pilot.press("enter")
        await until(made.pilot, lambda: made.speed() > 2)


async def test_run_line_shows_why_it_has_no_effect_and_what_to_do() -> None:
    async with bench("atv71") as made:
        made.drive().set("FR1", 1)  # a terminal gives command and reference
        await made.armed()
        await made.message("No effect", "not commanded by Modbus", "Press 6 for Control")
        await made.pilot.press("r", "2", "0")
        await made.message("No effect. The drive", "Press Esc, then 6 for Control")
        before = writes(made.app)
        await made.pilot.press("enter")
        await until(made.pilot, lambda: "Esc cancel" not in output(made.app))
        await made.message("The drive is not commanded by Modbus: Active command channel")
        assert writes(made.app) == before


async def test_key_line_shows_only_run_line_keys() -> None:
    async with ready() as made:
        await made.pilot.press("r")
        await until(made.pilot, lambda: shown(made.app, "keys").split() == KEYS_OF_THE_LINE)
        await made.pilot.press("escape")
        await until(made.pilot, lambda: "quit" in shown(made.app, "keys"))


KEYS_OF_THE_LINE = ["Space", "STOP", "1", "Enter", "run", "Esc", "cancel"]
