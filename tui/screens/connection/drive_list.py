"""The list of drives on Line: a row for each, the cursor on a drive and not on a place."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from rich.text import Text
from textual.widgets import OptionList

from tui.widgets.plain import entry


class DriveList(OptionList):
    """The drives that answered, one a line; a new state draws its line and moves nothing.

    The cursor stays on its drive, whatever comes above it.
    """

    def update_node_styles(self, animate: bool = True) -> None:
        """Nothing is styled before it is on a screen: then it is, as a whole."""
        if self.is_attached:
            super().update_node_styles(animate)

    def __init__(self, *, id: str) -> None:
        super().__init__(id=id, compact=True)
        self._drawn: dict[int, Text] = {}

    @property
    def chosen(self) -> int | None:
        """The device under the cursor."""
        at = self.highlighted
        return None if at is None else int(self.get_option_at_index(at).id or 0)

    def point_at(self, device: int) -> None:
        """Put the cursor on a drive, where it is listed."""
        if device in self._drawn:
            self.highlighted = list(self._drawn).index(device)

    def fill(self, lines: Mapping[int, Text], order: Iterable[int], *, sort: bool = True) -> None:
        """Show these lines in order; without `sort` none changes its place, new ones are last."""
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
            with self.prevent(OptionList.OptionHighlighted):  # nobody has chosen anything
                self.highlighted = wanted.index(chosen)
        elif lines:
            self.highlighted = 0
            return
        self.scroll_to(y=top, animate=False, force=True)
