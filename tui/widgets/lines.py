"""A widget of text lines that sends to the terminal only the lines that changed."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from rich.style import Style
from rich.text import Text
from textual.geometry import Region, Size
from textual.strip import Strip
from textual.widget import Widget

from tui.drive.plain import plain
from tui.terminal.lean import CURSOR_MOVE


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
        """With `fit` the first lines are made for the width that the place turns out to have."""
        super().__init__(id=id, classes=classes)
        self._fit = fit
        self._lines: list[Text] = []
        self._strips: dict[int, Strip] = {}
        self.redrawn = 0
        """How many lines were sent so far, for tests and benchmarks."""

    @property
    def lines(self) -> list[Text]:
        """What is shown."""
        return list(self._lines)

    def show(self, lines: Sequence[Text]) -> None:
        """Show these lines; only those that differ from the ones before are drawn."""
        old, self._fit = self._lines, None
        self._lines = list(lines)
        changed = [
            y
            for y in range(max(len(old), len(lines)))
            if y >= len(old) or y >= len(lines) or not same(old[y], lines[y])
        ]
        regions = [region for y in changed for region in self._redraw(y)]
        if regions:
            self.redrawn += len(changed)
            self.refresh(*regions)
        if len(old) != len(lines) and self.styles.is_auto_height:
            self.refresh(layout=True)

    def _redraw(self, y: int) -> list[Region]:
        """Draw a line anew; the parts of it that look different now."""
        before = self._strips.pop(y, None)
        if not (width := self.size.width):
            return []
        self._strips[y] = self._draw(y, width)
        return [Region(x, y, end - x, 1) for x, end in runs(before, self._strips[y])]

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        """One row a line."""
        self._fill(width)
        return len(self._lines)

    def _fill(self, width: int) -> None:
        """Make the first lines, now that there is a width for them."""
        if self._fit is not None and width:
            self._lines = list(self._fit(width))

    def notify_style_update(self) -> None:
        """Draw anew when colours change."""
        self._strips.clear()
        super().notify_style_update()

    def render_line(self, y: int) -> Strip:
        """A line, cut or filled to the width."""
        width = self.size.width
        strip = self._strips.get(y)
        if strip is None or strip.cell_length != width:
            if y == 0:
                self._fill(width)
            strip = self._draw(y, width)
            self._strips[y] = strip
        return strip

    def _draw(self, y: int, width: int) -> Strip:
        style = self.rich_style
        if y >= len(self._lines):
            return Strip.blank(width, style)
        line = self._lines[y]
        # rich drops the style of a text that has no spans
        styled = Text(plain(line.plain), end="")
        styled.stylize(line.style)
        for span in line.spans:
            styled.stylize(span.style, span.start, span.end)
        segments = list(styled.render(self.app.console, end=""))
        strip = Strip(segments).apply_style(style).adjust_cell_length(width, style)
        return strip.simplify()


def runs(before: Strip | None, after: Strip) -> list[tuple[int, int]]:
    """Columns, first and behind the last, in which two strips of one row differ.

    Runs with little between them are one: to move costs as much as to write some cells again.
    """
    width = after.cell_length
    old, new = cells(before) if before is not None else [], cells(after)
    if len(old) != width or len(new) != width:
        return [(0, width)]
    found: list[tuple[int, int]] = []
    for x in range(width):
        if old[x] == new[x]:
            continue
        if found and x - found[-1][1] < CURSOR_MOVE:
            found[-1] = (found[-1][0], x + 1)
        else:
            found.append((x, x + 1))
    return found


def cells(strip: Strip) -> list[tuple[str, Style | None]]:
    """The characters of a strip with their colours; fewer than its cells where some are wide."""
    return [(character, style) for text, style, _ in strip for character in text]


def same(one: Text, other: Text) -> bool:
    """Whether two lines look the same, their colours too."""
    return one.plain == other.plain and one.spans == other.spans and one.style == other.style
