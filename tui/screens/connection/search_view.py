"""Progress of a search and its remaining time, in the words of Line. Pure functions."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tui.session.connect.search import Search

IN_MINUTES = 100
"""Seconds from which on a time is given in minutes."""


def left_text(search: Search | None, later: float) -> str:
    """Return the remaining time of a search, with `later` seconds of those that follow; empty if
    unknown."""
    if search is None or search.ended or not search.cost:
        return ""
    seconds = search.left + later
    return f"{seconds / 60:.0f} min" if seconds >= IN_MINUTES else f"{max(1, round(seconds))} s"


def far_text(search: Search, later: float, room: int) -> str:
    """Return the progress of a search in `room` cells, with the remaining time if it is known."""
    left = left_text(search, later)
    if not left:
        return search.text
    requested = search.text.partition(",")[0]
    forms = (f"{search.text}, {left} left", f"{requested}, {left} left", f"{requested}, {left}")
    return next((form for form in forms if len(form) <= room), forms[-1])
