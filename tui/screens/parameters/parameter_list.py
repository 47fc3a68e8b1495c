"""The list of the Parameters screen: what it holds, where the cursor is, what fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from tui.drive.settings.selection import FILTERS, FilterContext, FilterId, rows
from tui.screens.parameters.view import TableLine, items_of
from tui.session.settings.editor import Editor

USUAL: FilterId = "settings"
"""The selection that the screen begins with and Esc comes back to."""


@dataclass(slots=True)
class ParameterList:
    """Lines of parameters and headings; the cursor is on a parameter, where there is one."""

    chosen: FilterId = USUAL
    items: Sequence[TableLine] = field(default_factory=list)
    at: int = 0
    """The line of the cursor."""
    top: int = 0
    """The first line that is shown."""

    @property
    def code(self) -> str:
        """The parameter under the cursor, or nothing."""
        return self.items[self.at].code if self.at < len(self.items) else ""

    @property
    def count(self) -> int:
        """How many parameters there are."""
        return sum(1 for item in self.items if item.code)

    def fill(self, editor: Editor, search: str) -> None:
        """Make the list anew; the cursor stays on its parameter where that is still in it."""
        before = self.code
        codes = rows(editor.facts, self.chosen, search)
        headings = not search and self.chosen in ("all", USUAL)
        self.items = items_of(editor, codes, headings=headings)
        found = [at for at, item in enumerate(self.items) if item.code and item.code == before]
        self.at = found[0] if found else self._first_row(0, 1)

    def best(self) -> None:
        """Forget the parameter under the cursor: the next filling chooses its first."""
        self.at = len(self.items)

    def choose_next(self, facts: FilterContext, step: int) -> None:
        """The next or previous selection that shows anything."""
        at = FILTERS.index(self.chosen)
        for _ in FILTERS:
            at = (at + step) % len(FILTERS)
            if rows(facts, FILTERS[at]):
                break
        self.chosen = FILTERS[at]

    def move_to(self, at: int, step: int) -> None:
        """The cursor on this line, or the nearest parameter in the direction of `step`."""
        at = self._within(at)
        found = self._first_row(at, step)
        if self.items and not self.items[found].code:
            found = self._first_row(at, -step)
        self.at = found

    def move(self, lines: int) -> None:
        """The cursor so many lines down, or up."""
        self.move_to(self.at + lines, 1 if lines > 0 else -1)

    def end(self, to: int) -> None:
        """The first parameter for a negative number, else the last."""
        self.move_to(0 if to < 0 else len(self.items) - 1, -to)

    def group(self, step: int) -> None:
        """The first parameter of the next or previous group; stays where there is none."""
        heads = [at for at, item in enumerate(self.items) if item.group]
        own = max((at for at in heads if at < self.at), default=0)
        nearest = [at for at in heads if (at > self.at if step > 0 else at < own)]
        if nearest:
            self.move_to((nearest[0] if step > 0 else nearest[-1]) + 1, 1)

    def window(self, room: int) -> Sequence[TableLine]:
        """The lines that fit, the cursor's among them, with the heading just above it."""
        first = self.at - 1 if self.at and self.items[self.at - 1].group else self.at
        self.top = min(max(self.top, self.at - room + 1), first) if self.items else 0
        return self.items[self.top : self.top + room]

    def _within(self, at: int) -> int:
        return min(max(at, 0), max(0, len(self.items) - 1))

    def _first_row(self, at: int, step: int) -> int:
        """The nearest line from here on that is a parameter."""
        while 0 <= at < len(self.items) and not self.items[at].code:
            at += step
        return self._within(at)
