"""Texts on the progress of a scan."""

from __future__ import annotations

from typing import TYPE_CHECKING

from tui.drive.sentences import counted

if TYPE_CHECKING:
    from tui.session.connect.search import Search

IN_MINUTES = 100
"""Seconds from which a remaining time is shown in minutes."""


def left_text(search: Search | None, later: float) -> str:
    """Return the remaining time of a search plus `later` seconds; empty if it is unknown."""
    if search is None or search.ended or not search.cost:
        return ""
    seconds = search.left + later
    return f"{seconds / 60:.0f} min" if seconds >= IN_MINUTES else f"{max(1, round(seconds))} s"


def far_text(search: Search, later: float, room: int) -> str:
    """Return the progress of a search in `room` cells, with the remaining time if it is known."""
    forms = _far_forms(search, later)
    return next((form for form in forms if len(form) <= room), forms[-1])


def _far_forms(search: Search, later: float) -> list[str]:
    """Return the progress of a search, the longest text first."""
    left = left_text(search, later)
    requested = search.text.partition(",")[0]
    forms = [search.text, requested]
    return [*(f"{form}, {left} left" for form in forms), *forms] if left else forms


def scan_forms(search: Search | None, later: float) -> list[str]:
    """Return the scan for the title of the drives, the longest text first; empty without one."""
    if search is None:
        return []
    if not search.ended:
        return [f"scan {form}" for form in _far_forms(search, later)]
    answered = f"{len(search.answered)} of "
    answered += counted(len(search.devices), "1 address", "{count} addresses")
    return [f"scan {search.ended}: {answered}", answered]
