"""The key that sets the inputs of a simulated drive; a real line has none to be set."""

from __future__ import annotations

import pytest

from tui.screens.dialogs.ask import Ask
from tui.screens.monitor.run_keys import NOT_SIMULATED
from tui.widgets.plain import Plain

from .test_command_flows import Bench, bench, output, writes
from .test_flows import until


@pytest.fixture(autouse=True)
def no_ports(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", list)


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
