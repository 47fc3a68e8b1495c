"""Texts on Line about a drive that answered."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rich.text import Text

from tui.drive.plain import plain
from tui.drive.sentences import any_of
from tui.widgets.drawing import short, wrapped
from tui.widgets.palette import ATTENTION, FAINT

if TYPE_CHECKING:
    from tui.bus.api import ModbusLine
    from tui.session.fleet import FoundDrive

WATCHED_ONLY = "It is monitored with that profile and cannot be armed."

WIDE_ABOUT = 120
"""Columns from which everything about a drive is in one row."""
ABOUT, LEFT_LINES = 2, 3
"""Rows about a drive, and maximum rows about a motor that no program commands."""


def profile_text(drive: FoundDrive) -> str:
    """Return the name of the drive's profile, marked if assumed or wrong; empty without one."""
    if drive.session is None:
        return ""
    if drive.session.contradiction:
        return f"{drive.session.profile.name}, which does not match"
    return drive.session.profile.name + (" ?" if drive.guessed else "")


def about_drive(drive: FoundDrive) -> str:
    """Return address, name, vendor, reference, version and profile of a drive in one line."""
    identity = drive.identity
    version = f"version {identity.version_text}" if identity.version else ""
    maker = f"{identity.vendor} {identity.reference}".strip()
    profile = f"profile {profile_text(drive)}" if drive.session else "no profile"
    parts = (str(identity.device), identity.name, maker, version, profile)
    return " · ".join(part for part in parts if part)


def next_step(drive: FoundDrive) -> str:
    """Return the next step if the profile is unknown, assumed or wrong; else an empty text."""
    if drive.session is not None and drive.session.contradiction:
        own = drive.identity.profile or "its own"
        return f"Cannot be armed: wrong profile. Enter {own} as Profile, then press s."
    candidates = drive.identity.candidates
    others = [c for c in candidates if drive.session and c != drive.session.profile.id]
    if drive.session is None:
        return "It does not identify itself. Enter its profile as Profile, then press s."
    if drive.guessed and others:
        return f"Assumed profile. If it is {any_of(others)}, enter that, then press s."
    return ""


def use_text(line: ModbusLine) -> str:
    """Return each program's share of the line's time; empty if only this panel uses the line."""
    facts = line.facts
    if not facts.others:
        return ""
    from tui.bus.program import LONGEST_NAME, readable  # imported late: speeds up the start
    from tui.bus.program_use import use_by_program

    found = use_by_program(facts.programs, line.counters.programs)
    names = [program.name for program, _ in found]
    parts = []
    for program, share in found:
        name = "this panel" if program.id == facts.me.id else readable(program.name, LONGEST_NAME)
        several = names.count(program.name) > 1 and program.id != facts.me.id
        parts.append(f"{name}{f' {program.pid}' if several else ''} {share:>3.0%}")
    total = min(1.0, sum(share for _, share in found))
    return " · ".join((f"Line use {total:>4.0%}", *parts))


def about_lines(
    drive: FoundDrive | None, left: str, width: int, line: ModbusLine | None = None
) -> list[Text]:
    """Return the rows below the lists: line health, the drive, then its next step or line use.

    `left` describes a motor that no program commands, and comes first; empty if there is none.
    """
    use = use_text(line) if line is not None else ""
    parts = [about_drive(drive), next_step(drive) or use] if drive else ["", use] if use else []
    if wide := width >= WIDE_ABOUT and line is not None:
        parts = [" · ".join(part for part in parts if part)]
    lines = [Text(f" {short(plain(part), width - 2)}", FAINT) for part in parts]
    first: list[Text] = []
    if left:
        del lines[1:]
        text = f"{left} Press Enter to open it, then Space to stop it or T to take it over."
        first = [Text(f" {row}", ATTENTION) for row in wrapped(text, width - 2, LEFT_LINES)]
    lines += [Text("")] * ((1 if wide else ABOUT) - len(lines) - len(first))
    if line is None:
        return [*first, *lines]
    from .health_view import health_lines  # imported late: speeds up the start

    # above the drive: a long notification covers the lowest rows
    device = drive.identity.device if drive else None
    return [*first, *health_lines(line.counters, device, width), *lines]
