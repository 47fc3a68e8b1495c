"""Look of a drive's state and of a value's age, on every screen."""

from __future__ import annotations

from rich.style import Style

from .palette import ALARM, FAULT_BLOCK, PLAIN, RUNNING

STATE_STYLES: dict[str, Style] = {
    "running": RUNNING,
    "fault": FAULT_BLOCK,
    "unknown": ALARM,
    "stopping": PLAIN,
}
STATE_SIGNS = {"running": "▶", "fault": "■", "unknown": "?"}


def age_text(seconds: float) -> str:
    """An age in at most five characters."""
    if seconds < 100:
        return f"{seconds:.0f}s"
    if seconds < 6000:
        return f"{seconds / 60:.0f}m"
    return f"{seconds / 3600:.0f}h"
