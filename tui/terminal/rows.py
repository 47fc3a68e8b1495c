"""A list of options that have the same number of rows each, laid out and drawn by its subclass.

Textual measures every option, and it drops everything that it drew when one prompt changes. With
the number of rows known, neither is needed.
"""

from __future__ import annotations

from textual.geometry import Size
from textual.visual import VisualType
from textual.widgets import OptionList


class EvenList(OptionList):
    """Options with `rows_each` rows each; a subclass draws what changed."""

    def __init__(self, *, id: str) -> None:
        """Begin without options, at one row for each."""
        self.rows_each = 1
        """Rows of each option; options that are listed already keep the rows they have."""
        super().__init__(id=id, compact=True)

    def forget_rows(self) -> None:
        """Drop drawn rows; called when Textual drops its own. A subclass that keeps rows does."""

    def set_prompt(self, index: int, prompt: VisualType) -> None:
        """Give an option another prompt of as many rows; the caller draws it."""
        self.get_option_at_index(index)._set_prompt(prompt)

    def lay_out(self) -> None:
        """Give new options their rows, and the list its height."""
        self._update_lines()

    def _clear_caches(self) -> None:
        self.forget_rows()
        super()._clear_caches()

    def _update_lines(self) -> None:
        """Give each option its rows; Textual would measure each of them."""
        if not self.scrollable_content_region:
            return
        cache, each = self._line_cache, self.rows_each
        for index in range(len(cache.heights), len(self.options)):
            cache.index_to_line[index] = index * each
            cache.heights[index] = each
            cache.lines.extend((index, row) for row in range(each))
        size = Size(self.scrollable_content_region.width, len(cache.lines))
        if size != self.virtual_size:
            self.virtual_size = size
            self._scroll_update(size)
