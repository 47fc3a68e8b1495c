"""The list of drives on the Connection screen."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from rich.text import Text
from textual.widgets import OptionList

from tui.widgets.plain import entry

from .found import State, drive_line

if TYPE_CHECKING:
    from tui.session.fleet import FoundDrive


class DriveList(OptionList):
    """The drives that answered, one a line, by address; a new state moves nothing."""

    def __init__(self, *, id: str) -> None:
        super().__init__(id=id, compact=True)
        self._drawn: dict[str, Text] = {}

    def fill(self, found: Mapping[int, FoundDrive], states: Mapping[int, State]) -> None:
        """Show these drives; the cursor stays at its place, and the list where it was scrolled."""
        width = max(20, self.size.width - 1)
        lines = {
            str(device): drive_line(drive, states[device], width) for device, drive in found.items()
        }
        before, self._drawn = self._drawn, lines
        if lines.keys() == before.keys():
            for id in [id for id in lines if lines[id] != before[id]]:
                self.replace_option_prompt(id, lines[id])
            return
        chosen = self.highlighted
        self.clear_options()
        self.add_options(entry(line, id=id) for id, line in lines.items())
        if lines:
            self.highlighted = min(chosen or 0, len(lines) - 1)
