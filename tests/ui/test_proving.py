"""The communication timeout test from Control: its question, its work, its result."""

from __future__ import annotations

from tui.screens.dialogs.confirm import Confirm

from .test_command_flows import bench
from .test_flows import arm, shown, until


async def test_p_asks_and_pauses_polling_until_the_drive_reacts() -> None:
    async with bench("atv312", sets={"ttO": 10}) as made:
        await made.pilot.press("6", "P")
        await until(made.pilot, lambda: "Not armed" in shown(made.app, "said"))
        await arm(made.pilot)
        await made.pilot.press("P")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        assert "The test takes about 5 s" in str(made.app.screen.query("#follows").first().render())
        await made.pilot.press("escape")
        await until(made.pilot, lambda: "not tested" in shown(made.app, "now"))
        await made.pilot.press("P")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        await made.pilot.press("y")
        await until(made.pilot, lambda: "Test: pause of" in shown(made.app, "said"))
        await until(made.pilot, lambda: "· tested: " in shown(made.app, "now"))
        assert any(event.text.startswith("Test: Trips ") for event in made.app.events.events)
        await until(made.pilot, lambda: "FAULT SLF" in shown(made.app, "strip"))


async def test_timeout_without_visible_effect_is_refused() -> None:
    async with bench("atv312", sets={"SLL": 0}) as made:
        await made.pilot.press("6")
        await arm(made.pilot)
        await made.pilot.press("P")
        await until(made.pilot, lambda: "no fault follows" in shown(made.app, "said"))
        assert not isinstance(made.app.screen, Confirm)
