"""Row of each drive, from its monitor or its last check."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ..state_words import state_cell, value_cell
from .found import profile_text
from .wall import WallRow

if TYPE_CHECKING:
    from tui.bus.api import Contact
    from tui.session.console import DriveConsole
    from tui.session.drive_state import DriveState
    from tui.session.fleet import Fleet, FoundDrive
    from tui.session.monitor.look import Look
    from tui.session.shown import Shown

TRUSTED_LOOKS = 3
"""Number of check periods after which a value no longer counts as current."""

VAIN: Mapping[str, tuple[str, str]] = {
    "silent": ("no answer", "lost"),
    "refused": ("refuses reads", "refuses reads"),
    "damaged": ("bad replies", "bad replies"),
    "swapped": ("bytes swapped", "bytes swapped"),
    "not_polled": ("not polled", "not polled"),
}
"""Words for a failed check: while the values are current, and once they are too old."""

Seen = tuple["DriveState | None", Mapping[str, "Shown"], float | None, bool, "Contact"]
"""State, readings, their age in s, True if that is too old, result of the last check."""


def rows_of(fleet: Fleet, now: float, *, connected: bool) -> dict[int, WallRow]:
    """Return a row for each drive found, by device; `now` is on the line's clock."""
    looks, period = fleet.line_watch.looks, fleet.line_watch.glance_period
    return {
        device: _row(drive, fleet, looks.get(device), (now, period), connected)
        for device, drive in fleet.found.items()
    }


def _row(
    drive: FoundDrive, fleet: Fleet, look: Look | None, at: tuple[float, float], connected: bool
) -> WallRow:
    identity, console = drive.identity, drive.console
    who = identity.reference or profile_text(drive) or "unknown drive"
    if console is None:
        return WallRow(identity.device, who, identity.name, words="no profile")
    state, readings, age, old, contact = _seen(console, look, *at)
    report = fleet.stopper.reports.get(identity.device)
    kind, words = state_cell(console.session, state, report, at[0], readings)
    if kind not in ("stop", "stop failed"):
        words = _called(state, words)
    if kind == "running" and fleet.left_behind(console):
        words = f"no commander, {words}"
    if not connected:
        kind, words, old = "none", "not known", True
    elif contact != "answers":
        kind, words = "none" if contact == "not_polled" else "unknown", VAIN[contact][old]
    return WallRow(
        device=identity.device,
        drive=who,
        name=identity.name,
        kind=kind or "none",
        words=words,
        frequency=_figure(console, readings, "output_frequency")[0],
        current=_figure(console, readings, "motor_current")[0],
        current_unit=_figure(console, readings, "motor_current")[1],
        share=_share(console, readings),
        age=None if age is None else float(int(age)),  # whole seconds: fewer redraws
        old=old,
    )


def _seen(console: DriveConsole, look: Look | None, now: float, period: float) -> Seen:
    """Return the newest values, from monitor or check; if the check failed, those before it.

    `now` and `period` are in seconds.
    """
    snapshot = console.latest
    if snapshot is not None and (look is None or snapshot.time >= look.time):
        heard = max((reading.time for reading in snapshot.readings.values()), default=None)
        age = None if heard is None else max(0.0, now - heard)
        each = max(snapshot.period, 1.0) if console.monitor.running else period
        longest = TRUSTED_LOOKS * each
        old = age is None or age > longest
        return snapshot.state, snapshot.readings, age, old, snapshot.contact
    if look is None:
        return None, {}, None, False, "not_polled"
    brought = look.before if look.error else look
    if brought is None:
        return None, {}, None, True, look.contact
    age = max(0.0, now - brought.time)
    return brought.state, brought.readings, age, age > TRUSTED_LOOKS * period, look.contact


def _called(state: DriveState | None, words: str) -> str:
    """Return the state of the status bar in lower case; a fault by its code and name."""
    if state is not None and state.kind == "fault" and state.fault is not None:
        return f"{state.fault.code} {state.fault.name.lower()}".strip()
    return words.lower()


def _figure(console: DriveConsole, readings: Mapping[str, Shown], quantity: str) -> tuple[str, str]:
    """Return text and unit of a value; `?` marks a parameter not verified for this family."""
    from tui.drive.profile.profile import is_verified  # imported late: speeds up the start

    text, unit = value_cell(console.session, readings, quantity)
    parameter = console.session.profile.quantity(quantity)  # type: ignore[arg-type]
    sign = "?" if text and parameter is not None and not is_verified(parameter) else ""
    return text + sign, unit


def _share(console: DriveConsole, readings: Mapping[str, Shown]) -> float | None:
    from tui.session.monitor.load import share_of_limit  # imported late: speeds up the start

    parameter = console.session.profile.quantity("motor_current")
    return share_of_limit(console.session, readings.get(parameter.code) if parameter else None)
