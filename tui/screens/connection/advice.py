"""Advice shown on Line while it lists no drive: event, next step, families. Pure functions."""

from __future__ import annotations

from typing import NamedTuple

from rich.style import Style
from rich.text import Text

from tui.bus import errors as faults
from tui.drive import errors as drive_faults
from tui.widgets.drawing import wrapped
from tui.widgets.palette import ALARM, FAINT, FAULT, PLAIN

ERROR_KIND, ALARM_KIND = "error", "alarm"
ADVICE = 4
"""Maximum rows of the event, and of the next step."""
FAMILIES = 7
"""Maximum rows of the families that react to lost polling."""
READ_ONLY = "Read-only: nothing is written to a drive, not even a stop."
ADVICE_INDENT = 3


class Advice(NamedTuple):
    """Event with the next step; `kind` is error, alarm or empty, and sets the color."""

    now: str
    next_step: str
    kind: str = ""


def advice_lines(
    advice: Advice, width: int, *, left: str = "", families: str = "", read_only: bool = False
) -> list[Text]:
    """Lay out the advice in `width` columns.

    `left` is the remaining time of a scan as text; empty if it is unknown. An error or alarm hides
    the families.
    """
    style = {ERROR_KIND: FAULT, ALARM_KIND: ALARM}.get(advice.kind, PLAIN)
    now = f"{advice.now} {left} left." if left else advice.now
    lines = [Text(""), *_part(now, width, ADVICE, style)]
    lines += _part(advice.next_step, width, ADVICE, FAINT)
    if families and not advice.kind:
        lines += [Text(""), *_part(families, width, FAMILIES, PLAIN)]
    if read_only:
        lines += [Text(""), *_part(READ_ONLY, width, 2, FAINT)]
    return lines


def _part(text: str, width: int, most: int, style: Style) -> list[Text]:
    return [
        Text(f"  {part}", style) for part in wrapped(text, max(10, width - ADVICE_INDENT), most)
    ]


HINTS: tuple[tuple[type[Exception], str], ...] = (
    (faults.PortBusy, "Press Enter to try again."),
    (faults.PortMissing, "Plug in the adapter and press Enter, or choose another line."),
    (faults.PortRefused, "Get permission to use the port (group dialout), or choose another."),
    (faults.LinkSyntaxError, "Press n to type the line again."),
    (faults.NoAnswer, "Press N to diagnose, or s to scan again."),
    (faults.ChecksumFault, "Press N to diagnose, or s to scan again."),
    (faults.LineLost, "Check the cable, gateway and network. Press Enter to try again."),
    (faults.LineError, "Press Enter to try again, or choose another line."),
    (drive_faults.UnknownProfile, "Clear or correct the profile, then press s."),
    (drive_faults.ProfileError, "Fix the file. `drivepanel profiles --check` lists all errors."),
)


def hint_for(error: Exception) -> str:
    """Return the next step after an error."""
    return next((hint for kind, hint in HINTS if isinstance(error, kind)), "Try again.")
