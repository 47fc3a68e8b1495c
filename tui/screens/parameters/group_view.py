"""The column of groups as lines; pure functions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from rich.text import Text

from tui.drive.settings.selection import Choice
from tui.widgets.drawing import fitted_names
from tui.widgets.palette import ALARM, ATTENTION, CURSOR, FAINT, PLAIN, STRONG

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
