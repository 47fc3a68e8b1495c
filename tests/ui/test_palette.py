"""The palette: actions of every screen by their words; dangerous ones need their full name."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from textual.widgets import OptionList

from tests.sweeps import kept
from tui.screens.blocks.screen import BlocksScreen
from tui.screens.choosing import Palette
from tui.screens.connection.screen import ConnectionScreen
from tui.screens.control.screen import ControlSourceScreen
from tui.screens.dialogs.ask import Ask
from tui.screens.dialogs.confirm import Confirm
from tui.screens.faults.screen import FaultsScreen
from tui.screens.frames.screen import FramesScreen
from tui.screens.keys.finding import BY_NAME, MOVES, NOT_FOUND, find
from tui.screens.keys.table import ACTIONS, EVERYWHERE
from tui.screens.monitor.screen import MonitorScreen
from tui.screens.parameters.screen import ParametersScreen

from .test_command_flows import Bench, bench, reported
from .test_flows import shown, until
from .test_questions import writes
from .walk import every_step

pytestmark = pytest.mark.long

SCREENS = {
    "line": ConnectionScreen,
    "monitor": MonitorScreen,
    "frames": FramesScreen,
    "control": ControlSourceScreen,
    "faults": FaultsScreen,
    "parameters": ParametersScreen,
    "scanner": BlocksScreen,
}
WORDS = sorted({word for action in ACTIONS for word in action.help.casefold().split()})


def test_every_typed_word_is_in_the_results() -> None:
    for query in ("eeprom", "save eeprom", "EEPROM sav", "frames", "ramp", "trip file"):
        found = find(query, "monitor")
        assert found
        for hit in found:
            action = hit.action
            text = f"{action.help} {action.label} {action.id} {hit.screen}".casefold()
            assert all(word.casefold() in text for word in query.split())
    assert [action.action.id for action in find("eeprom", "monitor")] == ["eeprom"]
    assert find("eeprom stop", "monitor") == []
    assert find("eprm", "monitor") == []  # letters here and there are no word


def test_best_match_comes_first() -> None:
    assert find("frames", "monitor")[0].action.id == "goto('frames')"
    assert find("parameters", "monitor")[0].action.id == "goto('parameters')"
    assert find("undo", "parameters")[0].screen == "parameters"
    assert find("w", "parameters")[0].action.id == "write"
    assert find("W", "parameters")[0].action.id == "write_one"


@pytest.mark.parametrize("screen", kept(EVERYWHERE, "line", "monitor", "control"))
@pytest.mark.sweep
def test_every_action_is_found_on_every_screen(screen: str) -> None:
    for action in ACTIONS:
        if action.id.startswith(NOT_FOUND):
            continue
        here = screen in action.screens
        only_moves = action.id.startswith(MOVES)
        query = " ".join([*BY_NAME.get(action.id, ()), *action.help.rstrip(".").split()[:3]])
        query = "".join(c if c.isalnum() or c == " " else " " for c in query)
        found = [item for item in find(query, screen) if item.action.help == action.help]
        if here or not only_moves:
            assert found, (screen, action.id, query)
            assert found[0].here is any(
                screen in item.screens for item in ACTIONS if item.help == action.help
            )


@given(st.lists(st.sampled_from(WORDS), max_size=3), st.sampled_from(EVERYWHERE))
def test_motor_commands_need_their_full_name(words: list[str], screen: str) -> None:
    for action in find(" ".join(words), screen):
        names = BY_NAME.get(action.action.id, ())
        called = {name for name in names if any(word.startswith(name) for word in words)}
        assert bool(called) or not names
        if action.ready:
            assert called == set(names)


def test_palette_names_are_action_names() -> None:
    ids = {action.id for action in ACTIONS}
    assert set(BY_NAME) <= ids
    heads = ("stop", "arm", "run_line", "stop_as", "ask_stop_as", "take_")
    asks = {"stop_by_space", "stop_scan", "run_line('reference')"}
    assert {i for i in ids if i.startswith(heads)} - asks == set(BY_NAME)


async def typed(made: Bench, query: str) -> OptionList:
    """Open the palette and type."""
    await made.pilot.press("ctrl+p")
    await until(made.pilot, lambda: isinstance(made.app.screen, Palette))
    await made.pilot.press(*("minus" if character == " " else character for character in query))
    await made.pilot.pause()
    return made.app.screen.query_one(OptionList)


def reports(made: Bench) -> dict[int, object]:
    """Stops made, by device."""
    return dict(made.app.fleet.stopper.reports) if made.app.fleet else {}


async def test_eeprom_finds_saving_and_no_stop() -> None:
    async with bench("atv71", "atv21", "atv312") as made:
        for device in (1, 2, 3):
            made.drive(device).run(30.0)
        await until(made.pilot, lambda: all(made.speed(device) > 2 for device in (1, 2, 3)))
        await typed(made, "eeprom")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, ParametersScreen))
        await until(made.pilot, lambda: "Not armed" in output(made))
        assert not reports(made)
        assert writes(made.app) == []
        assert all(made.speed(device) > 2 for device in (1, 2, 3))


async def test_nothing_is_selected_until_a_word_is_typed() -> None:
    async with bench("atv71") as made:
        for query in ("", "oto", "run", "all", "forward"):
            options = await typed(made, query)
            assert options.option_count
            assert options.highlighted is None
            await made.pilot.press("enter", "enter")
            assert isinstance(made.app.screen, Palette)
            await made.pilot.press("escape")
            await until(made.pilot, lambda: isinstance(made.app.screen, MonitorScreen))
        assert "ARMED" not in shown(made.app, "strip")
        assert not reports(made)


async def test_arming_and_stopping_work_by_name() -> None:
    async with bench("atv71", "atv21") as made:
        made.drive(2).run(30.0)
        await until(made.pilot, lambda: made.speed(2) > 2)
        await typed(made, "arm")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: " ARMED" in shown(made.app, "strip"))
        await typed(made, "stop")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: bool(reports(made)))
        assert set(reports(made)) == {1}
        assert made.speed(2) > 2
        await typed(made, "stop all")
        await made.pilot.press("enter")
        await made.stopped(2)


@pytest.mark.sweep
async def test_action_of_the_current_screen_is_executed() -> None:
    async with bench("atv71") as made:
        options = await typed(made, "rated current")
        assert options.highlighted == 0
        await made.pilot.press("down", "up", "enter")
        await until(made.pilot, lambda: "gives its current in A" in reported(made.app))
        await typed(made, "line typ")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, ConnectionScreen))
        await until(made.pilot, lambda: "n on Line" in reported(made.app))
        await typed(made, "user words")
        await made.pilot.press("enter")
        await until(made.pilot, lambda: "^p on Scanner" in reported(made.app))
        assert not isinstance(made.app.screen, Ask)


@pytest.mark.sweep
async def test_every_screen_is_reached_from_every_other() -> None:
    async with bench("atv71") as made:
        before = ""
        for place in every_step(SCREENS):
            made.app.action_goto(place)
            await until(made.pilot, lambda: bool(made.app.screen.query("#keys")))
            assert made.app.place == place, before
            assert isinstance(made.app.screen, SCREENS[place]), before
            before = f"from {place}"


async def test_palette_does_not_open_over_a_question() -> None:
    async with bench("atv71") as made:
        await made.armed()
        await made.pilot.press("z")
        await until(made.pilot, lambda: isinstance(made.app.screen, Ask | Confirm))
        requested = made.app.screen
        await made.pilot.press("ctrl+p")
        made.app.action_command_palette()
        await made.pilot.pause()
        assert made.app.screen is requested


def output(made: Bench) -> str:
    """Last message."""
    newest = made.app.events.newest
    return newest.text if newest is not None else ""
