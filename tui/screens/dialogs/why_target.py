"""The drive to diagnose, and its line."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from tui.bus.errors import LineError
    from tui.session.connect.open_line import OpenLine


class WhyTarget(NamedTuple):
    """A drive, on an open line or on one that could not be opened."""

    text: str
    """The line as it was typed."""
    device: int
    opened: OpenLine | None = None
    """The line; None if it is not open."""
    profile: str = ""
    """The drive's profile, if known."""
    neighbors: tuple[int, ...] = ()
    """Other drives of the line that answer."""
    trouble: LineError | None = None
    """Why the line could not be opened."""
