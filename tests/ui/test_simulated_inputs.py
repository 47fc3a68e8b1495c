"""The key that sets the inputs of a simulated drive; a real line has none to be set."""

from __future__ import annotations

import re

import pytest

from tui.screens.dialogs.ask import Ask
from tui.screens.keys.finding import find
from tui.screens.monitor.run_keys import NOT_REHEARSED, NOT_SIMULATED, REHEARSAL
from tui.simulator import BENCH
from tui.simulator.plant.fault_history import fault_raw
from tui.widgets.fields import Field
from tui.widgets.plain import Plain

from .test_command_flows import Bench, bench, output, writes
from .test_flows import until

pytestmark = pytest.mark.long


async def requested(made: Bench) -> None:
    assert made.app.opened is not None
    made.app.opened.simulation = made.simulation
    await made.pilot.press("l")
    await until(made.pilot, lambda: isinstance(made.app.screen, Ask))


async def test_typed_text_sets_simulated_inputs_without_a_write() -> None:
    async with bench("atv312") as made:
        await requested(made)
        before = writes(made.app)
        await made.pilot.press(*"li4=1,ai1=5V", "enter")
        await until(made.pilot, lambda: not isinstance(made.app.screen, Ask))
        assert "LI4 = 1, AI1 = 50 %" in output(made.app)
        terminals = made.drive().terminals
        assert (terminals.closed("LI4"), terminals.level("AI1")) == (True, 0.5)
        assert writes(made.app) == before


async def test_invalid_text_is_reported_and_sets_nothing() -> None:
    async with bench("atv312") as made:
        await requested(made)
        await made.pilot.press(*"LI1=1,LI9=1", "enter")
        fault = made.app.screen.query_one("#fault", Plain)
        await until(made.pilot, lambda: "No input is called" in str(fault.render()))
        await made.pilot.press("escape")
        await until(made.pilot, lambda: not isinstance(made.app.screen, Ask))
        assert made.drive().terminals.bits() == 0


async def test_input_key_is_refused_on_a_real_line() -> None:
    async with bench("atv312") as made:
        await made.pilot.press("l")
        await until(made.pilot, lambda: NOT_SIMULATED[:40] in output(made.app))
        assert not isinstance(made.app.screen, Ask)


async def rehearsed(made: Bench, text: str) -> None:
    assert made.app.opened is not None
    made.app.opened.simulation = made.simulation
    await made.app.screen.run_action("rehearse")
    await until(made.pilot, lambda: bool(made.app.screen.query("Ask #answer")))
    made.app.screen.query_one("#answer", Field).value = text
    await made.pilot.press("enter")
    await until(made.pilot, lambda: not isinstance(made.app.screen, Ask))


async def test_rehearsed_trip_shows_the_fault_without_a_write() -> None:
    async with bench("atv312") as made:
        before = writes(made.app)
        await rehearsed(made, "trip OCF")
        # the report of the trip may replace this message before it is drawn
        await until(
            made.pilot, lambda: any("tripped with OCF" in e.text for e in made.app.events.events)
        )
        assert made.drive().fault is not None
        assert writes(made.app) == before


async def test_rehearsed_event_with_a_time_waits_for_it() -> None:
    async with bench("atv312") as made:
        await rehearsed(made, "in 0.3s: jam")
        await until(made.pilot, lambda: "waits for its time" in output(made.app))
        assert not made.drive().conditions.jammed
        await until(made.pilot, lambda: made.drive().conditions.jammed)


async def test_rehearsal_is_refused_on_a_real_line() -> None:
    async with bench("atv312") as made:
        await made.app.screen.run_action("rehearse")
        await until(made.pilot, lambda: NOT_REHEARSED[:40] in output(made.app))
        assert not isinstance(made.app.screen, Ask)


async def test_rehearsal_names_a_fault_of_the_drive() -> None:
    async with bench("atv21") as made:
        assert made.app.opened is not None
        made.app.opened.simulation = made.simulation
        await made.app.screen.run_action("rehearse")
        await until(made.pilot, lambda: bool(made.app.screen.query("Ask #about")))
        about = str(made.app.screen.query_one("#about", Plain).render())
        (code,) = re.findall(r"^trip (\w+)", about)
        await made.pilot.press("escape")
        assert made.drive().profile.fault(fault_raw(made.drive().profile, code)) is not None


def test_rehearsal_names_every_command_but_planted_defects() -> None:
    named = {text.strip().split()[0] for text in re.split(r"[·\n]", REHEARSAL)}
    assert {*BENCH} - {"plant"} <= {name.rstrip(":") for name in named}


@pytest.mark.parametrize("word", ["trip", "power", "rehearse", "jam", "wire", "load"])
def test_palette_finds_the_rehearsal_by_its_events(word: str) -> None:
    assert "rehearse" in [found.action.id for found in find(word, "monitor")][:3]
