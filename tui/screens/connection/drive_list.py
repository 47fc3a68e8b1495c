"""The list of drives on the Connection screen."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from rich.text import Text
from textual.widgets import OptionList

from tui.widgets.plain import entry

from .found import FoundState, drive_line

if TYPE_CHECKING:
    from tui.session.fleet import FoundDrive


class DriveList(OptionList):
    """The drives that answered, one a line, by address; a new state moves nothing.

    The cursor stays on its drive, whatever comes above it.
    """

    def __init__(self, *, id: str) -> None:
        super().__init__(id=id, compact=True)
        self._drawn: dict[str, Text] = {}

    @property
    def chosen(self) -> str | None:
        """The address under the cursor."""
        at = self.highlighted
        return None if at is None else self.get_option_at_index(at).id

    def fill(
        self,
        found: Mapping[int, FoundDrive],
        states: Mapping[int, FoundState],
        *,
        sort: bool = True,
    ) -> None:
        """Show these drives; without `sort` new ones come last, and no other changes its place."""
        width = max(20, self.size.width - 1)
        lines = {
            str(device): drive_line(drive, states[device], width) for device, drive in found.items()
        }
        if not sort:
            stay = [id for id in self._drawn if id in lines]
            new = [id for id in lines if id not in self._drawn]
            lines = {id: lines[id] for id in (*stay, *new)}
        before, self._drawn = self._drawn, lines
        if list(lines) == list(before):
            for id in [id for id in lines if lines[id] != before[id]]:
                self.replace_option_prompt(id, lines[id])
            return
        chosen = self.chosen
        self.clear_options()
        self.add_options(entry(line, id=id) for id, line in lines.items())
        if chosen in lines:
            with self.prevent(OptionList.OptionHighlighted):  # nobody has chosen anything
                self.highlighted = list(lines).index(chosen)
        elif lines:
            self.highlighted = 0
