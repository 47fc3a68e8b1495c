"""Row of each drive, from its monitor or its last check, and texts about a drive that answered."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

from rich.text import Text

from tui.drive.plain import plain
from tui.drive.sentences import any_of
from tui.widgets.drawing import short, wrapped
from tui.widgets.palette import ATTENTION, FAINT

from ..frame_source import other_commander
from ..state_words import state_cell, state_words, value_cell
from .wall import WallRow, aligned, spaced_age

if TYPE_CHECKING:
    from tui.bus.api import Contact, ModbusLine
    from tui.drive.profile.schema import Quantity
    from tui.session.console import DriveConsole
    from tui.session.drive_state import DriveState
    from tui.session.fleet import Fleet, FoundDrive
    from tui.session.monitor.alarms import PresentFault
    from tui.session.monitor.look import Look
    from tui.session.shown import Shown

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


def drive_names(fleet: Fleet) -> list[str]:
    """Return the name or else the model of each drive, as the list shows it."""
    return [drive.identity.name or shown_model(drive) for drive in fleet.found.values()]


def shown_model(drive: FoundDrive) -> str:
    """Return the reference of a drive, else its family."""
    return drive.identity.reference or profile_text(drive) or "unknown drive"


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


TRUSTED_LOOKS = 3
"""Number of check periods after which a value no longer counts as current."""

VAIN: Mapping[Contact, str] = {
    "silent": "NO ANSWER",
    "refused": "REFUSES READS",
    "damaged": "BAD REPLIES",
    "swapped": "BYTES SWAPPED",
    "not_polled": "not polled",
}
"""Words for a failed check."""
NO_COMMANDER = "no commander"


class Seen(NamedTuple):
    """Values read last from a drive."""

    state: DriveState | None
    readings: Mapping[str, Shown]
    age: float | None
    """Age of the readings in seconds; None if there are none."""
    old: bool
    """True if they no longer count as current."""
    contact: Contact
    """Result of the last check."""


class RowMessage(NamedTuple):
    """Fault, alarm or silence of a drive."""

    parts: tuple[str, str] = ("", "")
    brief: str = ""
    kind: str = ""


def rows_of(
    fleet: Fleet,
    now: float,
    *,
    connected: bool,
    wall: float = 0.0,
    curves: Mapping[int, tuple[str, ...]] | None = None,
) -> dict[int, WallRow]:
    """Return a row for each drive found, by device.

    `now` is on the line's clock, `wall` the same moment in seconds since 1970. `curves` are drawn
    curves by device.
    """
    looks, period = fleet.line_watch.looks, fleet.line_watch.glance_period
    faults = {fault.device: fault for fault in fleet.alarms.active}
    rows = [
        _row(drive, fleet, looks.get(device), (now, period), connected)._replace(
            curve=(curves or {}).get(device, ())
        )
        for device, drive in fleet.found.items()
    ]
    rows = [_with_fault(row, faults.get(row.device), wall) for row in rows]
    frequencies = aligned([row.frequency for row in rows])
    currents = aligned([row.current for row in rows])
    return {
        row.device: row._replace(
            frequency=frequency,
            current=current,
            reference=_padded(row.reference, row.frequency, frequency),
        )
        for row, frequency, current in zip(rows, frequencies, currents, strict=True)
    }


def _padded(reference: str, frequency: str, shown: str) -> str:
    """Return a reference with the spaces by which its frequency was aligned."""
    return reference + " " * (len(shown) - len(frequency)) if reference else ""


def _row(
    drive: FoundDrive, fleet: Fleet, look: Look | None, at: tuple[float, float], connected: bool
) -> WallRow:
    identity, console = drive.identity, drive.console
    model = shown_model(drive)
    if console is None:
        return WallRow(identity.device, identity.name, model, words="no profile")
    seen = _seen(console, look, *at)
    report = fleet.stopper.reports.get(identity.device)
    kind, words = state_cell(console.session, seen.state, report, at[0], seen.readings)
    message = _message(console, fleet, seen)
    if not connected:
        kind, words, seen = "none", "not known", seen._replace(old=True)
        message = _silent(console, look, seen)
    elif seen.contact != "answers":
        kind, words = "none" if seen.contact == "not_polled" else "unknown", VAIN[seen.contact]
        message = _silent(console, look, seen)
        seen = seen._replace(old=True)
    elif seen.old and seen.age is not None:
        message = RowMessage((f"{spaced_age(seen.age)} old", ""), spaced_age(seen.age), "alarm")
    current, unit = _figure(console, seen.readings, "motor_current")
    return WallRow(
        device=identity.device,
        name=identity.name,
        model=model,
        kind=kind or "none",
        words=words,
        frequency=_figure(console, seen.readings, "output_frequency")[0],
        reference=_ahead(console, seen) if kind == "running" and not seen.old else "",
        current=current,
        current_unit=unit,
        share=_share(console, seen.readings),
        # whole seconds, and only if it is shown: fewer rows are drawn again
        age=float(int(seen.age)) if seen.old and seen.age is not None else None,
        old=seen.old,
        message=message.parts,
        brief=message.brief,
        message_kind=message.kind,
    )


def _message(console: DriveConsole, fleet: Fleet, seen: Seen) -> RowMessage:
    """Return the alarm of a drive that answers, or its commander if that is another one."""
    state = seen.state
    if state is None or state.kind == "fault":
        return RowMessage()
    if state.alarm or state.alarms:
        named = f"▲ {state.alarms[0].name.lower()}" if state.alarms else "▲ alarm"
        more = f"and {len(state.alarms) - 1} more" if len(state.alarms) > 1 else ""
        return RowMessage((named, more), "▲", "alarm")
    if state.kind == "running" and fleet.left_behind(console):
        return RowMessage((NO_COMMANDER, ""), "!", "alarm")
    by = other_commander(fleet, console.device, state)
    return RowMessage((f"by {by}", "")) if by else RowMessage()


def _silent(console: DriveConsole, look: Look | None, seen: Seen) -> RowMessage:
    """Return how old the values of a drive are that is not read now, and its last state."""
    if seen.age is None:
        return RowMessage(kind="alarm")
    age = spaced_age(seen.age)
    before = look.before if look is not None and look.error else look
    state = seen.state or (before.state if before is not None else None)
    was = state_words(console.session, state, seen.readings)[1] if state is not None else ""
    return RowMessage((f"for {age}", f"was {was}" if was else ""), age, "alarm")


def _with_fault(row: WallRow, fault: PresentFault | None, wall: float) -> WallRow:
    """Return the row with the name of its fault and the time since the trip."""
    if fault is None or row.kind != "fault":
        return row
    since = spaced_age(max(0.0, wall - fault.wall))
    if not fault.tripped:
        since = f">{since}"  # it was in fault when first read
    at = time.strftime("%H:%M:%S", time.localtime(fault.wall))
    parts = fault.name.lower(), f"{since} · {at}" if fault.tripped else f"{since} · seen {at}"
    return row._replace(message=parts, brief=since, message_kind="fault")


def _seen(console: DriveConsole, look: Look | None, now: float, period: float) -> Seen:
    """Return the newest values, from monitor or check; if the check failed, those before it.

    `now` and `period` are in seconds.
    """
    snapshot = console.latest
    if snapshot is not None and (look is None or snapshot.time > look.time):
        heard = max((reading.time for reading in snapshot.readings.values()), default=None)
        age = None if heard is None else max(0.0, now - heard)
        each = max(snapshot.period, 1.0) if console.monitor.running else period
        longest = TRUSTED_LOOKS * each
        old = age is None or age > longest
        return Seen(snapshot.state, snapshot.readings, age, old, snapshot.contact)
    if look is None:
        return Seen(None, {}, None, False, "not_polled")
    brought = look.before if look.error else look
    if brought is None:
        return Seen(None, {}, None, True, look.contact)
    age = max(0.0, now - brought.time)
    old = age > TRUSTED_LOOKS * period
    return Seen(brought.state, brought.readings, age, old, look.contact)


def _figure(console: DriveConsole, readings: Mapping[str, Shown], quantity: str) -> tuple[str, str]:
    """Return text and unit of a value; `?` marks a parameter not verified for this family."""
    from tui.drive.profile.profile import is_verified  # imported late: speeds up the start

    text, unit = value_cell(console.session, readings, quantity)
    parameter = console.session.profile.quantity(quantity)  # type: ignore[arg-type]
    sign = "?" if text and parameter is not None and not is_verified(parameter) else ""
    return text + sign, unit


REACHED = 0.05
"""Difference in Hz up to which a frequency has reached its reference."""


def _ahead(console: DriveConsole, seen: Seen) -> str:
    """Return the reference of a motor that has not reached it; empty if it has, or if unknown."""
    profile = console.session.profile
    found = []
    quantities: tuple[Quantity, ...] = ("frequency_reference", "output_frequency")
    for quantity in quantities:
        parameter = profile.quantity(quantity)
        reading = seen.readings.get(parameter.code) if parameter else None
        found.append(reading.current_number if reading is not None else None)
    reference, frequency = found
    if reference is None or frequency is None or abs(abs(reference) - abs(frequency)) <= REACHED:
        return ""
    return _figure(console, seen.readings, "frequency_reference")[0]


def _share(console: DriveConsole, readings: Mapping[str, Shown]) -> float | None:
    from tui.session.monitor.line_watch import share_of_limit  # imported late: speeds up the start

    parameter = console.session.profile.quantity("motor_current")
    return share_of_limit(console.session, readings.get(parameter.code) if parameter else None)
