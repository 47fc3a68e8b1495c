"""The list of the Parameters screen: its lines, its cursor and its visible part."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from tui.drive.settings.selection import (
    FILTERS,
    Choice,
    FilterContext,
    FilterId,
    chosen_codes,
    group_order,
    home_group,
    rows,
)
from tui.session.settings.editor import Editor

from .group_view import GroupEntry
from .start_up_view import start_up_items
from .table_view import TableLine, items_of

FIRST: tuple[FilterId, ...] = ("not factory", "favorites", "staged", "unsaved")
"""Filters above the groups; after a comparison also `differs`."""
LAST: tuple[FilterId, ...] = ("recent", "unverified", "read-only", "settings", "all")
"""Filters below the groups."""


@dataclass(slots=True)
class ParameterList:
    """Lines of parameters and headings; the cursor is on a parameter, if there is one."""

    chosen: Choice = field(default_factory=Choice)
    searched: bool = False
    """True if it shows the result of a search instead of the chosen group or filter."""
    items: Sequence[TableLine] = field(default_factory=list)
    at: int = 0
    """The line of the cursor."""
    top: int = 0
    """The first line that is shown."""
    groups: Sequence[str] = ()
    home: str = ""

    @property
    def code(self) -> str:
        """The parameter under the cursor; empty if none."""
        return self.items[self.at].code if self.at < len(self.items) else ""

    @property
    def count(self) -> int:
        """Number of parameters."""
        return sum(1 for item in self.items if item.code)

    @property
    def place(self) -> int:
        """Position of the parameter under the cursor among all, from 1."""
        return sum(1 for item in self.items[: self.at + 1] if item.code)

    def shown_as(self, editor: Editor) -> Choice:
        """The choice to highlight; during a search, the group of the selected parameter."""
        if self.searched and self.code:
            return Choice(group=editor.session.profile[self.code].group)
        return self.chosen

    def fill(self, editor: Editor, search: str) -> None:
        """Fill the list; the cursor stays on its parameter if that is still listed."""
        profile, before = editor.session.profile, self.code
        if not self.groups:
            self.groups, self.home = group_order(profile), home_group(profile)
            self.chosen = Choice(group=self.home)
        if self.searched and not search and before and self.chosen.group:
            # after a search, the group of the found parameter is shown
            self.chosen = Choice(group=profile[before].group)
        self.searched = bool(search.split())
        facts = editor.facts
        codes = rows(facts, "all", search) if self.searched else chosen_codes(facts, self.chosen)
        headings = not self.searched and self.chosen.filter in ("all", "settings")
        headings = headings and not self.chosen.group
        self.items = items_of(editor, codes, headings=headings)
        if shows_steps(self):
            self.items = start_up_items(profile)
        found = [at for at, item in enumerate(self.items) if item.code and item.code == before]
        self.at = found[0] if found else self._first_row(0, 1)

    def best(self) -> None:
        """Make the next `fill` select the first parameter."""
        self.at = len(self.items)

    def entries(self, facts: FilterContext) -> list[GroupEntry]:
        """The lines of the column at the left."""
        # counted without making the rows, as this is drawn four times a second
        known = sum(facts.profile.get(code) is not None for code in facts.favorites)
        counts = {"favorites": known, "staged": len(facts.edits), "unsaved": len(facts.unsaved)}
        counts["not factory"] = len(rows(facts, "not factory"))
        first = [
            GroupEntry(Choice(literal_type), counts[literal_type], pinned=True)
            for literal_type in FIRST
        ]
        if facts.other:
            first.append(GroupEntry(Choice("differs"), len(rows(facts, "differs")), pinned=True))
        groups = [GroupEntry(Choice(group=group)) for group in self.groups]
        if facts.profile.data.start_up:
            groups.insert(0, GroupEntry(Choice("start-up")))
        return [*first, *groups, *(GroupEntry(Choice(literal_type)) for literal_type in LAST)]

    def choose(self, choice: Choice) -> None:
        """Choose a group or a filter; the next `fill` shows it."""
        self.chosen, self.searched = choice, False
        self.best()

    def go_home(self) -> None:
        """Return to the group that the screen starts with."""
        self.choose(Choice(group=self.home))

    def choose_next(self, facts: FilterContext, step: int) -> None:
        """Choose the next or previous filter that is not empty."""
        at = FILTERS.index("settings" if self.chosen.group else self.chosen.filter)
        for _ in FILTERS:
            at = (at + step) % len(FILTERS)
            if rows(facts, FILTERS[at]):
                break
        self.choose(Choice(FILTERS[at]))

    def group(self, editor: Editor, step: int) -> None:
        """Choose the next or previous entry of the left column that is not empty."""
        entries = self.entries(editor.facts)
        marked = self.shown_as(editor)
        at = next((n for n, entry in enumerate(entries) if entry.choice == marked), 0)
        for _ in entries:
            at = (at + step) % len(entries)
            if chosen_codes(editor.facts, entries[at].choice):
                break
        self.choose(entries[at].choice)

    def move_to(self, at: int, step: int) -> None:
        """Move the cursor to this line, or to the next parameter in the direction of `step`."""
        at = self._within(at)
        found = self._first_row(at, step)
        if self.items and not self.items[found].code:
            found = self._first_row(at, -step)
        self.at = found

    def move(self, lines: int) -> None:
        """Move the cursor down by so many lines; negative is up."""
        self.move_to(self.at + lines, 1 if lines > 0 else -1)

    def end(self, to: int) -> None:
        """Move the cursor to the first parameter for a negative number, else to the last."""
        self.move_to(0 if to < 0 else len(self.items) - 1, -to)

    def window(self, room: int) -> Sequence[TableLine]:
        """The visible lines, with the cursor and the headings just above it."""
        first = self.at
        while first > max(0, self.at - room + 1) and not self.items[first - 1].code:
            first -= 1
        self.top = min(max(self.top, self.at - room + 1), first) if self.items else 0
        return self.items[self.top : self.top + room]

    def _within(self, at: int) -> int:
        return min(max(at, 0), max(0, len(self.items) - 1))

    def _first_row(self, at: int, step: int) -> int:
        """The first parameter line from `at` on, in the direction of `step`."""
        while 0 <= at < len(self.items) and not self.items[at].code:
            at += step
        return self._within(at)


def shows_steps(listed: ParameterList) -> bool:
    """Return True if a list shows the commissioning steps."""
    chosen = listed.chosen
    return chosen.filter == "start-up" and not chosen.group and not listed.searched
