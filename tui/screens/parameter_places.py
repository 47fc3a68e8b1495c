"""Keys that work on every screen and go to Parameters: its search, its report, its EEPROM."""

from __future__ import annotations

from .keys.action import PARAMETERS
from .places import Places


class ParameterPlaces(Places):
    """Keys that show Parameters on the open drive, and then act there."""

    async def action_find(self) -> None:
        """Go to the parameter search; what is typed next is searched for."""
        await self._ask_parameters("action_search")

    async def open_parameter(self, code: str, proposed: int | None = None) -> None:
        """Show a parameter of the open drive in the editor, under the cursor.

        With a `proposed` raw value, its dialog opens with this value, which is not staged.
        """
        from textual.widgets import Input

        from .parameters.stage_keys import StageKeys

        if shown := self.action_goto(PARAMETERS):
            await shown
        self.screen.query_one("#search", Input).value = code
        self.screen.set_focus(None)
        if proposed is not None and isinstance(self.screen, StageKeys):
            # in the new screen: the one on which Enter was pressed gets no answer once it is closed
            self.screen.call_later(self.screen.edit, code, proposed)

    async def action_eeprom(self) -> None:
        """Save the settings of the open drive to its EEPROM."""
        await self._ask_parameters("action_save_eeprom")

    async def action_back_up(self) -> None:
        """Save the settings of the open drive under a new name."""
        await self._ask_parameters("action_back_up_now")

    async def action_differ(self) -> None:
        """Compare the open drive with its newest backup."""
        await self._ask_parameters("action_compare_newest")

    async def action_report(self) -> None:
        """Write a report on the open drive to a file."""
        await self._ask_parameters("action_report")

    async def _ask_parameters(self, action: str) -> None:
        """Go to Parameters, and call this method of it."""
        if shown := self.action_goto(PARAMETERS):
            await shown
        if self.chosen is not None:
            self._ask_screen(action)
