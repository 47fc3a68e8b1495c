"""The list of drives on the Connection screen."""

from __future__ import annotations

from collections.abc import Mapping

from textual.widgets import OptionList
from textual.widgets.option_list import Option

from .found import FoundDrive, drive_line


class DriveList(OptionList):
    """The drives that answered, one a line, by address."""

    def __init__(self, *, id: str) -> None:
        super().__init__(id=id, compact=True)

    def fill(self, found: Mapping[int, FoundDrive]) -> None:
        """Show these drives; the cursor stays at its place."""
        width = max(20, self.size.width - 1)
        chosen = self.highlighted
        self.clear_options()
        self.add_options(
            Option(drive_line(drive, width), id=str(device))
            for device, drive in sorted(found.items())
        )
        if found:
            self.highlighted = min(chosen or 0, len(found) - 1)
