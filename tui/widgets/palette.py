"""Colors and signs of the panel: gray while all is well, color for a state that needs attention."""

from __future__ import annotations

from rich.style import Style
from textual.theme import Theme

GROUND = "#202326"
SURFACE = "#2a2e32"
TEXT = "#c9ced2"
DIM = "#838b92"
RULE = "#4a5158"
FOCUS = "#7fb0dc"
RED = "#ff6b64"
AMBER = "#e6ac3c"
CYAN = "#52c4d0"
GREEN = "#74c47a"

THEME = Theme(
    name="drivepanel",
    dark=True,
    primary=FOCUS,
    secondary=CYAN,
    accent=FOCUS,
    warning=AMBER,
    error=RED,
    success=GREEN,
    foreground=TEXT,
    background=GROUND,
    surface=SURFACE,
    panel=SURFACE,
    variables={
        "border": FOCUS,
        "border-blurred": RULE,
        "input-cursor-text-style": "reverse",
        "block-cursor-foreground": "#ffffff",
        "block-cursor-background": "#2f4f6b",
        "block-cursor-text-style": "none",
        "block-cursor-blurred-foreground": TEXT,
        "block-cursor-blurred-background": "#33393e",
        "footer-key-foreground": FOCUS,
    },
)

PLAIN = Style(color=TEXT)
FAINT = Style(color=DIM)
LINE = Style(color=RULE)
TITLE = Style(color=DIM)
STRONG = Style(color="#ffffff", bold=True)
KEY = Style(color=FOCUS, bold=True)
REFERENCE_STYLE = Style(color=FOCUS)
"""Curve of a reference."""
FAULT = Style(color=RED, bold=True)
FAULT_BLOCK = Style(color="#ffffff", bgcolor="#a8281f", bold=True)
ALARM = Style(color=AMBER, bold=True)
ALARM_BLOCK = Style(color="#2b2005", bgcolor=AMBER, bold=True)
STALE = Style(color=AMBER, dim=False)
RUNNING = Style(color=GREEN, bold=True)
ATTENTION = Style(color=CYAN, bold=True)
ATTENTION_BLOCK = Style(color="#10282b", bgcolor=CYAN, bold=True)
REPLAY_BLOCK = Style(color="#14171a", bgcolor="#d7dbdf", bold=True)
REPLAY_FAINT = Style(color="#5b646c", bgcolor="#d7dbdf")
REPLAY_SIGN = Style(color="#1f4e79", bgcolor="#d7dbdf")
STOP_KEY = Style(color=RED, bold=True)
BAR = Style(color="#8fa3b3")
BAR_REST = Style(color="#3a4046")
CURSOR = Style(bgcolor="#2f4f6b")
MARK = Style(color="#ffffff", bold=True)


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
