"""Teaching a raw value in the panel, and running by a taught reference: a simulated Powerdrive."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
from textual.widgets import Input, OptionList

from tui.screens.command.teaching import PickWord, _known
from tui.screens.dialogs.ask import Ask
from tui.screens.dialogs.confirm import Confirm
from tui.screens.parameters.screen import ParametersScreen
from tui.session.command.stop_report import Phase

from .test_command_flows import Bench, bench, writes
from .test_flows import shown, until

pytestmark = pytest.mark.long


async def pick(made: Bench, code: str) -> None:
    """Select a value on Monitor and open the question for its display value."""
    await made.pilot.press("L")
    await until(made.pilot, lambda: isinstance(made.app.screen, PickWord))
    listed = made.app.screen.query_one(OptionList)
    listed.highlighted = made.app.screen._codes.index(code)  # type: ignore[attr-defined]
    await made.pilot.pause(0.4)
    await made.pilot.press("enter")
    await until(made.pilot, lambda: isinstance(made.app.screen, Ask))


async def look(made: Bench, text: str) -> None:
    """Type the display value, and Enter once the question accepts it."""
    await made.pilot.press(*text)
    await made.pilot.pause(0.4)
    await made.pilot.press("enter")
    await until(made.pilot, lambda: not isinstance(made.app.screen, Ask))


async def two_readings(
    made: Bench, code: str, first: tuple[int, str], second: tuple[int, str]
) -> None:
    """Learn the scale of a value on Monitor; the value of the drive is set at its keypad."""
    for raw, text in (first, second):
        made.drive().set(code, raw)
        await pick(made, code)
        await look(made, text)
        await made.message(code, "1 count is" if text == second[1] else "another value")


@pytest.mark.sweep
async def test_two_readings_set_the_scale_and_a_disagreeing_third_discards_it() -> None:
    async with bench("powerdrive") as made:
        app, pilot = made.app, made.pilot
        await until(pilot, lambda: "Output ?" in shown(app, "readouts"))
        await two_readings(made, "5.01", (300, "30.0Hz"), (503, "50.3"))
        await until(pilot, lambda: "Output taught" in shown(app, "readouts"))
        await until(pilot, lambda: "Hz" in shown(app, "readouts"))
        assert "Current ?" in shown(app, "readouts"), "it was not taught"
        made.drive().set("5.01", 400)
        await pick(made, "5.01")
        assert "Learned scale: 1 count is 0.1 Hz" in str(app.screen.query_one("#about").render())
        await look(made, "20.0")
        await made.message("shown raw again")
        await until(pilot, lambda: "Output ?" in shown(app, "readouts"))
        assert writes(app) == []


async def test_invalid_display_number_is_reported_in_question() -> None:
    async with bench("powerdrive") as made:
        await pick(made, "5.01")
        await made.pilot.press(*"fast")
        await made.pilot.pause(0.4)
        await made.pilot.press("enter")
        fault = made.app.screen.query_one("#fault")
        await until(made.pilot, lambda: "not a displayed value" in str(fault.render()))
        await made.pilot.press("escape")


async def test_space_stops_while_a_display_value_is_typed() -> None:
    async with bench("powerdrive") as made:
        await pick(made, "5.01")
        await made.pilot.press("5", "space")
        assert made.app.fleet is not None
        stopper = made.app.fleet.stopper
        await until(made.pilot, lambda: 1 in stopper.reports)
        await until(made.pilot, lambda: not isinstance(made.app.screen, Ask))
        await until(made.pilot, lambda: stopper.reports[1].phase is Phase.STOPPED)
        console = made.app.chosen
        assert console is not None
        assert console.teacher.looks("5.01") == ()


async def test_enter_or_l_on_a_raw_value_asks_for_the_display_value() -> None:
    async with bench("powerdrive") as made:
        app, pilot = made.app, made.pilot
        for key, raw, text in (("enter", 84, "8.4A"), ("L", 120, "12.0")):
            made.drive().set("4.01", raw)
            await app.open_parameter("4.01")
            await until(pilot, lambda: isinstance(app.screen, ParametersScreen))
            await until(pilot, lambda: "4.01" in shown(app, "detail"))
            if key == "enter":  # then it has a scale
                await until(pilot, lambda: "L or Enter" in " ".join(shown(app, "detail").split()))
            await pilot.press(key)
            await until(pilot, lambda: isinstance(app.screen, Ask))
            await look(made, text)
        await until(
            pilot,
            lambda: "Learned scale: 1 count is 0.1 A" in " ".join(shown(app, "detail").split()),
        )
        await until(pilot, lambda: "12.0 A" in shown(app, "table"))


async def test_l_on_a_scaled_parameter_says_that_its_scale_is_known() -> None:
    async with bench("powerdrive") as made:
        app, pilot = made.app, made.pilot
        await app.open_parameter("15.07")
        await until(pilot, lambda: isinstance(app.screen, ParametersScreen))
        await until(pilot, lambda: "15.07" in shown(app, "detail"))
        await pilot.press("L")
        await until(pilot, lambda: "is already known" in " ".join(shown(app, "said").split()))
        assert not isinstance(app.screen, Ask)


@pytest.mark.sweep
async def test_learned_preset_is_suggested_confirmed_and_used_to_run() -> None:
    async with bench("powerdrive") as made:
        app, pilot = made.app, made.pilot
        await pilot.press("R")
        await made.message("teach 1.21")
        for raw, text in ((900, "900rpm"), (600, "600")):
            made.drive().set("1.21", raw)
            await pick(made, "1.21")
            await look(made, text)
            await made.message("1.21", f"raw {raw}")
        await until(pilot, lambda: isinstance(app.screen, Confirm))
        assert "bit 8 of 6.42" in str(app.screen.query_one("#follows").render())
        await pilot.pause(0.4)
        await pilot.press("enter")
        assert isinstance(app.screen, Confirm), "Enter confirms nothing"
        await pilot.press("y")
        await made.message("1.21 now takes the reference, in rpm")
        await made.armed()
        await made.answer("t", "y")
        await made.message("Control by Modbus")
        await pilot.press("r")
        await made.message("RUN FORWARD", "rpm", "Enter run")
        await pilot.press(*"1200")
        await pilot.pause(0.4)
        await pilot.press("enter")
        await until(pilot, lambda: made.drive().raw("1.21") == 1200)
        await until(pilot, lambda: made.drive().raw("6.42") == 0x0103)
        await until(pilot, lambda: made.speed() > 35)
        await pilot.press("space")
        await made.stopped()
        assert made.drive().raw("6.42") & 0x002E == 0
        await made.answer("R", "y")
        await made.message("no longer sets the reference")


async def test_family_with_a_reference_has_no_preset_to_learn() -> None:
    async with bench("atv71") as made:
        await made.pilot.press("R")
        await made.message("needs no learned scale for its reference")
        await made.pilot.press("L")
        await made.message("No value here needs a learned scale")
        assert not made.app.screen.query(Input)


def test_question_shows_the_present_value_and_what_was_learned() -> None:
    looks = [SimpleNamespace(text="raw 40 is 4.0 Hz"), SimpleNamespace(text="raw 50 is 5.0 Hz")]
    raws: dict[str, int] = {}
    scales: dict[str, Any] = {}
    console: Any = SimpleNamespace(
        session=SimpleNamespace(image=SimpleNamespace(raws=raws)),
        teacher=SimpleNamespace(scales=scales, looks=lambda code: looks if code == "A" else []),
    )
    assert _known(console, "B") == "Two readings at different values give the scale."
    seen = "Earlier readings: raw 40 is 4.0 Hz, raw 50 is 5.0 Hz. Read at another value."
    assert _known(console, "A") == seen
    raws["A"] = 7
    assert _known(console, "A") == f"Present raw value: 7. {seen}"
    scales["A"] = SimpleNamespace(text="0.1 Hz")
    learned = "Learned scale: 0.1 Hz. A reading that disagrees discards it."
    assert _known(console, "A") == f"Present raw value: 7. {learned}"
