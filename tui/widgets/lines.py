"""A widget of text lines that sends to the terminal only the lines that changed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache

from rich.console import Console
from rich.segment import Segment
from rich.style import Style
from rich.text import Span, Text
from textual.geometry import Region, Size
from textual.strip import Strip
from textual.widget import Widget

from tui.drive.plain import plain
from tui.terminal.pen import CURSOR_MOVE


class Lines(Widget):
    """Text lines at fixed places; showing the same lines again costs nothing."""

    DEFAULT_CSS = "Lines { height: auto; width: 1fr; }"

    def __init__(
        self,
        *,
        id: str | None = None,
        classes: str | None = None,
        fit: Callable[[int], Sequence[Text]] | None = None,
    ) -> None:
        """`fit` makes the first lines, once the width of the widget is known."""
        super().__init__(id=id, classes=classes)
        self._fit = fit
        self._lines: list[Text] = []
        self._strips: dict[int, Strip] = {}
        self._under: Style | None = None
        """The background style of the widget; cached, as reading it costs more than a line."""
        self.redrawn = 0
        """Number of lines redrawn so far, for tests and benchmarks."""

    @property
    def lines(self) -> list[Text]:
        """The lines shown now."""
        return list(self._lines)

    def show(self, lines: Sequence[Text]) -> None:
        """Show these lines; only lines that differ from the present ones are drawn."""
        old, self._fit = self._lines, None
        self._lines = list(lines)
        changed = [
            y
            for y in range(max(len(old), len(lines)))
            if y >= len(old) or y >= len(lines) or not same(old[y], lines[y])
        ]
        width = self.size.width if changed else 0
        regions = [region for y in changed for region in self._redraw(y, width)]
        if regions:
            self.redrawn += len(changed)
            self.refresh(*regions)
        if len(old) != len(lines) and self.styles.is_auto_height:
            self.refresh(layout=True)

    def _redraw(self, y: int, width: int) -> list[Region]:
        """Draw a line again, and return the regions in which it looks different."""
        before = self._strips.pop(y, None)
        if not width:
            return []
        self._strips[y] = self._draw(y, width)
        return [Region(x, y, end - x, 1) for x, end in runs(before, self._strips[y])]

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """One row per line."""
        self._fill(width)
        return len(self._lines)

    def _fill(self, width: int) -> None:
        """Make the first lines, if the width is known by now."""
        if self._fit is not None and width:
            self._lines = list(self._fit(width))

    def notify_style_update(self) -> None:
        """Draw again when colors change."""
        self._strips.clear()
        self._under = None
        super().notify_style_update()

    def render_lines(self, crop: Region) -> list[Strip]:
        """The lines of a region; without a border, so most of Textual's work is skipped."""
        width = self.size.width
        if self.size != self.outer_size:
            return super().render_lines(crop)
        strips = [self._strip(y, width) for y in crop.line_range]
        for filter_ in self.get_line_filters():
            background = self.background_colors[1]
            strips = [strip.apply_filter(filter_, background) for strip in strips]
        if crop.column_span != (0, width):
            strips = [strip.crop(*crop.column_span) for strip in strips]
        return strips

    def render_line(self, y: int) -> Strip:
        """A line, cut or padded to the width."""
        return self._strip(y, self.size.width)

    def _strip(self, y: int, width: int) -> Strip:
        strip = self._strips.get(y)
        if strip is None or strip.cell_length != width:
            if y == 0:
                self._fill(width)
            strip = self._draw(y, width)
            self._strips[y] = strip
        return strip

    def _draw(self, y: int, width: int) -> Strip:
        if self._under is None:
            self._under = self.rich_style
        if y >= len(self._lines):
            return Strip.blank(width, self._under)
        line = self._lines[y]
        return strip_of(line.plain, tuple(line.spans), line.style, width, self._under)


@lru_cache(maxsize=1)
def _names_of_styles() -> Console:
    return Console(markup=False)


@lru_cache(maxsize=1024)
def strip_of(
    text: str, spans: tuple[Span, ...], style: Style | str, width: int, under: Style
) -> Strip:
    """A line in exactly `width` cells, over the style `under`.

    Cached, because most lines that change return to an earlier text.
    """
    text = plain(text)
    segments = piece_by_piece(text, spans, style)
    if segments is None:
        styled = Text(text, end="")
        styled.stylize(style)  # rich drops the style of a text that has no spans
        for span in spans:
            styled.stylize(span.style, span.start, span.end)
        segments = list(styled.render(_names_of_styles(), end=""))
    strip = Strip(segments).apply_style(under).adjust_cell_length(width, under)
    return strip.simplify()


def piece_by_piece(text: str, spans: Sequence[Span], style: Style | str) -> list[Segment] | None:
    """The segments of a text whose spans do not overlap; None for any other text."""
    if not isinstance(style, Style):
        if style:
            return None
        style = Style.null()
    found, at = [], 0
    for start, end, over in spans:
        if start < at or end > len(text) or not isinstance(over, Style):
            return None
        if start > at:
            found.append(Segment(text[at:start], style))
            at = start
        if end > start:
            found.append(Segment(text[start:end], style + over))
            at = end
    if at < len(text):
        found.append(Segment(text[at:], style))
    return found


def runs(before: Strip | None, after: Strip) -> list[tuple[int, int]]:
    """Column ranges, each as first and one after last, in which two strips of a row differ.

    Ranges with a short gap are merged: moving the cursor costs as much as writing a few cells.
    """
    if before is after:
        return []
    width = after.cell_length
    old, new = looks(before) if before is not None else ("", []), looks(after)
    if len(old[0]) != width or len(new[0]) != width:
        return [(0, width)]
    found: list[tuple[int, int]] = []
    for x, (was, was_style, now, now_style) in enumerate(zip(*old, *new, strict=True)):
        if was == now and (was_style is now_style or was_style == now_style):
            continue
        if found and x - found[-1][1] < CURSOR_MOVE:
            found[-1] = (found[-1][0], x + 1)
        else:
            found.append((x, x + 1))
    return found


def looks(strip: Strip) -> tuple[str, list[Style | None]]:
    """The characters of a strip and their styles; fewer than its cells if some are wide."""
    styles: list[Style | None] = []
    for text, style, _ in strip:
        styles += [style] * len(text)
    return strip.text, styles


def same(text: Text, other: Text) -> bool:
    """Return True if two lines look the same, including their colors."""
    if text is other:
        return True
    return text.plain == other.plain and text.spans == other.spans and text.style == other.style
