"""What bytes that form no frame say about the speed at which they were sent; pure."""

from __future__ import annotations

from math import log

from tui.bus.link import SerialLink

from .sight import Sight

USUAL_BAUDS = (1200, 2400, 4800, 9600, 19200, 38400, 57600, 115200)
SAME_SPEED = 1.3
"""Times by which the bytes that came may differ from those due where the speed is the same."""


def speed_told(sight: Sight) -> str:
    """What so many bytes in place of those due say: a receiver at half the speed gets half."""
    came, due = sight.heard.compared
    if not came or not due:
        return ""
    ratio = came / due
    counts = f"{came} bytes came where {due} were due"
    if 1 / SAME_SPEED < ratio < SAME_SPEED:
        return f"{counts}: the speed is right, the format hardly"
    likely = likely_baud(sight)
    at = f", at {likely} bit/s most likely" if likely else ""
    return f"{counts}: the drive sends {'slower' if ratio > 1 else 'faster'}{at}"


def likely_baud(sight: Sight) -> int | None:
    """The baud of the family that the bytes fit best; None behind a device server."""
    came, due = sight.heard.compared
    if not came or not due or not isinstance(sight.link, SerialLink):
        return None
    known = sight.profile.data.link.bauds if sight.profile is not None else ()
    wanted = sight.link.baud * due / came
    others = [baud for baud in known or USUAL_BAUDS if baud != sight.link.baud]
    return min(others, key=lambda baud: abs(log(baud / wanted)), default=None)
