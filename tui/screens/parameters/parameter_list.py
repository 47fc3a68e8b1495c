"""The list of the Parameters screen and the column of groups; common parts of its keys."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from rich.text import Text
from textual.widgets import Input

from tui.drive.profile.profile import UNVERIFIED, Profile
from tui.drive.profile.schema import StartUpStep
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
from tui.session.console import DriveConsole
from tui.session.settings.editor import Editor
from tui.widgets.drawing import fitted_names, wrapped
from tui.widgets.fields import WordField
from tui.widgets.palette import ALARM, ATTENTION, CURSOR, FAINT, PLAIN, STRONG

from ..command.teaching import TeachKeys
from .table_view import TableLine, items_of

FILTER_LABELS: dict[str, str] = {
    "not factory": "Changed",
    "start-up": "Commissioning",
    "favorites": "Favorites",
    "staged": "Staged",
    "differs": "Differs",
    "unsaved": "Unsaved",
    "recent": "Recent",
    "settings": "All settings",
    "read-only": "Read only",
    "unverified": "All unverified",
    "all": "Everything",
}
"""Names of the filters."""
STYLES = {"staged": ATTENTION, "unsaved": ALARM}
"""Styles of filters whose number needs attention."""


@dataclass(frozen=True, slots=True)
class GroupEntry:
    """One line of the column: its choice, and the number of its parameters."""

    choice: Choice
    count: int | None = None
    """None if no number is shown."""
    pinned: bool = False
    """True if it stays above the scrolled groups."""

    @property
    def label(self) -> str:
        """Its name with its number, unless that is zero."""
        name = self.choice.group or FILTER_LABELS[self.choice.filter]
        return f"{name} {self.count}" if self.count else name


def group_lines(entries: Sequence[GroupEntry], chosen: Choice, width: int, room: int) -> list[Text]:
    """The lines that fit: the pinned ones, and those around the chosen one."""
    pinned = [entry for entry in entries if entry.pinned]
    rest = [entry for entry in entries if not entry.pinned]
    left = max(1, room - len(pinned))
    at = next((n for n, entry in enumerate(rest) if entry.choice == chosen), 0)
    top = min(max(0, at - left // 2), max(0, len(rest) - left))
    shown = rest[top : top + left]
    labels = fitted_names(tuple(entry.label for entry in entries), width - 2)
    lines = [_line(entry, chosen, labels[entry.label], width) for entry in [*pinned, *shown]]
    if (below := len(rest) - top - len(shown)) > 0 and len(shown) > 1:
        lines[-1] = Text(f" … {below + 1} more", FAINT, no_wrap=True)
    return lines[:room]


def _line(entry: GroupEntry, chosen: Choice, label: str, width: int) -> Text:
    here = entry.choice == chosen
    group = entry.choice.group or entry.choice.filter == "start-up"
    style = STRONG if here else PLAIN if entry.count or group else FAINT
    if entry.count and not here:
        style = STYLES.get(entry.choice.filter, style)
    text = Text(f" {label:<{width - 2}} ", style, no_wrap=True)
    if here:
        text.stylize(CURSOR)
    return text


TEXT_WIDTH, TEXT_LINES = 50, 4
"""Columns and lines of the text of a step without parameters, on the smallest screen."""

GROUNDS_WORDS = {
    "analogy": "as on a sister family",
    "unverified": "order of steps unverified",
    "practice": "general practice",
}
"""Source of a step and its place, if the family's own documents do not state it."""


def start_up_items(profile: Profile) -> list[TableLine]:
    """One heading per step; below it its parameters, or the text of a step without parameters."""
    found: list[TableLine] = []
    for number, step in enumerate(profile.data.start_up, start=1):
        mark = " ?" if step.confidence in UNVERIFIED else ""
        found.append(TableLine(group=f"{number} {step.step}{mark}"))
        found += [TableLine(code) for code in step.parameters]
        if not step.parameters:
            lines = wrapped(step.text, TEXT_WIDTH, TEXT_LINES)
            found += [TableLine(text=line) for line in lines]
    return found


def step_help(profile: Profile, code: str) -> str:
    """Return the text of a parameter's step; empty without a step."""
    step = next(
        (
            start_up_step
            for start_up_step in profile.data.start_up
            if code in start_up_step.parameters
        ),
        None,
    )
    return "" if step is None else _words_of_step(step)


def _words_of_step(step: StartUpStep) -> str:
    grounds = GROUNDS_WORDS.get(step.confidence, "")
    head = f"{step.step} ({grounds})" if grounds else step.step
    return f"{head}: {step.text} {step.note}".rstrip()


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


class ParameterKeys(TeachKeys):
    """The base of the keys that stage, write and handle parameter sets."""

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self.session = console.session
        self.listed = ParameterList()
        self.reading = ""
        """Progress of reading for a file or a comparison; empty without one."""

    @property
    def editor(self) -> Editor:
        """Known values and staged edits; stays with the drive while the panel runs."""
        return self.console.editor

    def list_again(self) -> None:
        """Fill the list again, for the present choice and search."""
        for search in self.query(WordField):  # none once the screen was left
            self.listed.fill(self.editor, search.words)
            self.look()

    def clear_search(self) -> None:
        """Clear the search, and show the chosen group or selection."""
        for search in self.query("#search").results(Input):
            with search.prevent(Input.Changed):
                search.value = ""
        self.list_again()

    def note(self, text: str, keys: str = "") -> None:
        """Report the result of a key, and the next `keys` on this screen."""
        self._add("told", text)
        if keys:
            self.hint_keys(keys)

    def _refuse(self, text: str) -> None:
        """Report why something was not done."""
        self._add("refused", text)

    def _add(self, kind: str, text: str) -> None:
        if text:
            self.app.events.add(kind, text, self.session.device)
        self.look()
