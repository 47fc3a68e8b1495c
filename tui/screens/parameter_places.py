"""Keys that work on every screen and go to Parameters: its search, its report, its EEPROM."""

from __future__ import annotations

from .keys.action import PARAMETERS
from .places import Places


class ParameterPlaces(Places):
    """Keys that show Parameters on the open drive, and then act there."""

    async def action_find(self) -> None:
        """Go to the parameter search; what is typed next is searched for."""
        await self._ask_parameters("action_search")

    async def open_parameter(self, code: str) -> None:
        """Show a parameter of the open drive in the editor, under the cursor."""
        from textual.widgets import Input

        if shown := self.action_goto(PARAMETERS):
            await shown
        self.screen.query_one("#search", Input).value = code
        self.screen.set_focus(None)

    async def action_eeprom(self) -> None:
        """Save the settings of the open drive to its EEPROM."""
        await self._ask_parameters("action_save_eeprom")

    async def action_report(self) -> None:
        """Write a report on the open drive to a file."""
        await self._ask_parameters("action_report")

    async def _ask_parameters(self, action: str) -> None:
        """Go to Parameters, and call this method of it."""
        if shown := self.action_goto(PARAMETERS):
            await shown
        if self.chosen is not None:
            self._ask_screen(action)
