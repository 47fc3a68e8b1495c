"""List of the drives on Line; the cursor follows its drive when rows move."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Self

from rich.style import Style
from rich.text import Text
from textual.events import Resize
from textual.geometry import Region
from textual.reactive import reactive
from textual.strip import Strip
from textual.visual import VisualType
from textual.widgets import OptionList

from tui.terminal.rows import EvenList
from tui.widgets.lines import strip_of
from tui.widgets.plain import entry, signs

CURSOR_SIGN = "▸"
"""Replaces the first cell of the drive under the cursor, also on a terminal without colors."""
UNDER_CURSOR = "option-list--option-highlighted"


class DriveList(EvenList):
    """Drives that answered, each in the same number of rows.

    A changed state or a moved cursor draws only the rows of the drives that it concerns. The
    cursor stays on its drive when rows are inserted above it.
    """

    highlighted: reactive[int | None] = reactive(None, repaint=False)

    def update_node_styles(self, animate: bool = True) -> None:
        """Skip styling until the list is attached; Textual then styles it as a whole."""
        if self.is_attached:
            super().update_node_styles(animate)

    def __init__(
        self,
        *,
        id: str,
        moved: Callable[[], None] = lambda: None,
        resized: Callable[[], None] = lambda: None,
    ) -> None:
        """`moved` is called when the cursor moves, so that one picture shows all of its effect.

        `resized` is called when the list gets another width, in which its rows must fit.
        """
        self._moved, self._resized = moved, resized
        self._width = 0
        self._strips: dict[tuple[int, int, bool], Strip] = {}
        """Drawn rows by index, row of the drive, and True under the cursor."""
        self._under: dict[bool, Style] = {}
        super().__init__(id=id)
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
        each = max((text.plain.count("\n") + 1 for text in lines.values()), default=1)
        if wanted == list(before) and each == self.rows_each:
            for device in wanted:
                if lines[device] is not before[device] and (
                    lines[device] != before[device] or lines[device].spans != before[device].spans
                ):
                    self.replace_option_prompt(str(device), lines[device])
            return
        chosen, top = self.chosen, self.scroll_offset.y
        resized, self.rows_each = each != self.rows_each, each
        self.clear_options()
        self.forget_rows()  # they are kept by index, which another drive may have now
        self.add_options(entry(lines[device], id=str(device)) for device in wanted)
        if chosen is not None and chosen in lines:
            with self.prevent(OptionList.OptionHighlighted):  # the user has chosen nothing
                self.highlighted = wanted.index(chosen)
        elif lines:
            self.highlighted = 0
            return
        if resized:
            self.scroll_to_highlight()
        else:
            self.scroll_to(y=top, animate=False, force=True)

    # Drawing: Textual would draw the whole list for each change

    def watch_highlighted(self, before: int | None, highlighted: int | None) -> None:  # type: ignore[override]
        """Draw the two drives between which the cursor moved."""
        self._refresh_drive(before)
        self._refresh_drive(highlighted)
        super().watch_highlighted(highlighted)
        if self.is_mounted:
            self._moved()

    def replace_option_prompt(self, option_id: str, prompt: VisualType) -> Self:
        """Draw a changed drive again."""
        index = self.get_option_index(option_id)
        shown = signs(prompt) if isinstance(prompt, Text) else prompt
        self.set_prompt(index, shown)
        for row in range(self.rows_each):
            self._strips.pop((index, row, False), None)
            self._strips.pop((index, row, True), None)
        self._refresh_drive(index)
        return self

    def _refresh_drive(self, index: int | None) -> None:
        top = (index or 0) * self.rows_each - self.scroll_offset.y
        if index is not None and top + self.rows_each > 0 and top < self.size.height:
            self.refresh(Region(0, top, self.size.width, self.rows_each))

    def forget_rows(self) -> None:
        """Draw every row again when Textual would."""
        self._strips.clear()

    def on_resize(self, event: Resize) -> None:
        """Request rows for another width; the first ones are made for the present width."""
        before, self._width = self._width, event.size.width
        if before and before != self._width:
            self._resized()

    def notify_style_update(self) -> None:
        """Draw again when colors change, as with the focus."""
        self._strips.clear()
        self._under.clear()
        super().notify_style_update()

    def render_lines(self, crop: Region) -> list[Strip]:
        """Draw the rows of a region; without a border, most of Textual's work is skipped."""
        self.lay_out()
        if self.size != self.outer_size:
            return super().render_lines(crop)
        strips = [self.render_line(y) for y in crop.line_range]
        for filter_ in self.get_line_filters():
            background = self.background_colors[1]
            strips = [strip.apply_filter(filter_, background) for strip in strips]
        if crop.column_span != (0, self.scrollable_content_region.width):
            strips = [strip.crop(*crop.column_span) for strip in strips]
        return strips

    def render_line(self, y: int) -> Strip:
        """Draw one row of a drive."""
        width = self.scrollable_content_region.width
        index, row = divmod(self.scroll_offset.y + y, self.rows_each)
        if index >= len(self.options):
            return Strip.blank(width, self._style_under(chosen=False))
        key = index, row, index == self.highlighted
        strip = self._strips.get(key)
        if strip is None or strip.cell_length != width:
            strip = self._strips[key] = self._draw(*key, width)
        return strip

    def _draw(self, index: int, row: int, chosen: bool, width: int) -> Strip:
        prompt = self.options[index].prompt
        lines = prompt.split("\n") if isinstance(prompt, Text) else [Text(str(prompt))]
        line = lines[row] if row < len(lines) else Text("")
        text = line.plain
        if chosen and row == 0 and text.startswith(" "):
            text = CURSOR_SIGN + text[1:]
        strip = strip_of(text, tuple(line.spans), "", width, self._style_under(chosen=chosen))
        return strip.apply_meta({"option": index})

    def _style_under(self, *, chosen: bool) -> Style:
        """Return the colors below the text of a row; cached, as Textual computes them slowly."""
        style = self._under.get(chosen)
        if style is None:
            names = ("option-list--option", *([UNDER_CURSOR] if chosen else ()))
            style = self._under[chosen] = self.get_visual_style(*names).rich_style
        return style
