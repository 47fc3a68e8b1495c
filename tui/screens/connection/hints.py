"""Next step after an error, by its kind."""

from __future__ import annotations

from tui.bus import errors as line
from tui.drive import errors as drive

HINTS: tuple[tuple[type[Exception], str], ...] = (
    (line.PortBusy, "Press Enter to try again."),
    (line.PortMissing, "Plug in the adapter and press Enter, or choose another line."),
    (line.PortRefused, "Ask for the right to use the port (group dialout), or choose another."),
    (line.LinkSyntaxError, "Press n to type the line again."),
    (line.NoAnswer, "Press N to diagnose, s to scan again."),
    (line.ChecksumFault, "Press N to diagnose, s to scan again."),
    (line.LineLost, "Check cable, gateway and network; press Enter to try again."),
    (line.LineError, "Press Enter to try again, or choose another line."),
    (drive.UnknownProfile, "Clear or correct the profile, then s."),
    (drive.ProfileError, "Fix the file. `drivepanel profiles --check` lists all errors."),
)


def hint_for(error: Exception) -> str:
    """Return what to try next."""
    return next((hint for kind, hint in HINTS if isinstance(error, kind)), "Try again.")
