"""List of the drives on Line; the cursor follows its drive when rows move."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from rich.text import Text
from textual.widgets import OptionList

from tui.widgets.plain import entry


class DriveList(OptionList):
    """Drives that answered, one per row; a changed state redraws only its row.

    The cursor stays on its drive when rows are inserted above it.
    """

    def update_node_styles(self, animate: bool = True) -> None:
        """Skip styling until the list is attached; Textual then styles it as a whole."""
        if self.is_attached:
            super().update_node_styles(animate)

    def __init__(self, *, id: str) -> None:
        super().__init__(id=id, compact=True)
        self._drawn: dict[int, Text] = {}

    @property
    def chosen(self) -> int | None:
        """Address of the drive under the cursor; None without a cursor."""
        at = self.highlighted
        return None if at is None else int(self.get_option_at_index(at).id or 0)

    def point_at(self, device: int) -> None:
        """Move the cursor to a drive if it is listed."""
        if device in self._drawn:
            self.highlighted = list(self._drawn).index(device)

    def fill(self, lines: Mapping[int, Text], order: Iterable[int], *, sort: bool = True) -> None:
        """Show the lines of these devices in this order.

        Without `sort`, listed drives keep their order and new ones are added at the end.
        """
        wanted = list(order)
        if not sort:
            stay = [device for device in self._drawn if device in lines]
            wanted = [*stay, *(device for device in wanted if device not in self._drawn)]
        before, self._drawn = self._drawn, {device: lines[device] for device in wanted}
        if wanted == list(before):
            for device in wanted:
                if lines[device] != before[device] or lines[device].spans != before[device].spans:
                    self.replace_option_prompt(str(device), lines[device])
            return
        chosen, top = self.chosen, self.scroll_offset.y
        self.clear_options()
        self.add_options(entry(lines[device], id=str(device)) for device in wanted)
        if chosen is not None and chosen in lines:
            with self.prevent(OptionList.OptionHighlighted):  # the user has chosen nothing
                self.highlighted = wanted.index(chosen)
        elif lines:
            self.highlighted = 0
            return
        self.scroll_to(y=top, animate=False, force=True)
