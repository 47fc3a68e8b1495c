"""`drivepanel journal`: writes, trips, runs and lost links on the lines of this computer."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..shared.errors import USAGE, Failure
from ..shared.options import json_option
from ..shared.output import both_times, print_json, time_typed
from ..shared.registration import command
from ..shared.rows import Column
from ..shared.say import say

if TYPE_CHECKING:
    from tui.session.changes import Change, ChangeList
    from tui.session.journal import Entry


CHANGE_COLUMNS = tuple(
    map(
        Column,
        (
            *("time UTC", "time local", "kind", "line", "device", "profile", "code", "old", "new"),
            *("until UTC", "until local", "reference", "reply", "who", "why"),
        ),
    )
)
"""Columns of the CSV file."""


@dataclass(frozen=True, slots=True)
class WantedDrive:
    """Which entries: of an address, of a line, or of both."""

    device: int | None = None
    line: str = ""


def _wanted_drive(_ctx: click.Context, _option: click.Parameter, text: str) -> WantedDrive:
    """Parse `2`, `2/LINE` or `LINE`."""
    number, slash, line = text.partition("/")
    if not number.isdecimal() or (slash and not line):
        return WantedDrive(line=text)
    if not 1 <= (device := int(number[:9])) <= 247:
        raise click.BadParameter(f"{number[:9]} is not a slave address. Use 1 to 247.")
    return WantedDrive(device, line)


@command("Show writes, trips, runs and lost links of drives.", group="Watch")
@click.option(
    "--drive",
    "wanted",
    callback=_wanted_drive,
    default="",
    metavar="D/LINE",
    help="Show one drive only: its address 2, or with its line 2/LINE.",
)
@click.option(
    "--since",
    "begin",
    callback=time_typed,
    metavar="TIME",
    help="Start at: 2h, 30m, 7d, 08:30 or 2026-03-01T08:30.",
)
@click.option(
    "--csv",
    "csv_path",
    type=click.Path(dir_okay=False, writable=True, path_type=Path),
    metavar="FILE",
    help="Write a CSV file, and print nothing but errors.",
)
@click.option("--force", is_flag=True, help="Replace a CSV file that exists.")
@json_option
def journal(
    wanted: WantedDrive,
    begin: datetime | None,
    csv_path: Path | None,
    force: bool,
    as_json: bool,
) -> None:
    """Show writes to drives from this computer, trips, timeout tests, runs and lost links.

    Each write has its time, the drive, the old and new value, the drive's reply, and the reason.
    Runs and lost links are those that the record of a line shows, trips those of the journal and of
    the record. A run has its end, its reference, and the program that began it. The readable
    entries of a damaged journal are shown, too.
    """
    from tui.session.changes import read_changes
    from tui.session.journal import Journal
    from tui.session.record.ring import record_folder

    if force and csv_path is None:
        raise click.UsageError("--force requires --csv FILE.")
    path = Journal().path
    try:
        lines = [wanted.line] if wanted.line else []
        found = read_changes(record_folder(), device=wanted.device, lines=lines, since=begin)
    except OSError as error:
        raise Failure(f"{path} cannot be read: {error.strerror or error}.", USAGE) from error
    if csv_path is not None:
        _write_csv(csv_path, found, force=force)
    if as_json:
        from ..shared.diagnosis_documents import changes_document

        print_json(changes_document(str(path), found))
        return
    if csv_path is None:
        _say(found, str(path))
    for line in found.damaged:
        say(
            f"drivepanel: {line.file}, line {line.number} is not a valid entry"
            f" (cut off or damaged): {line.text[:60]}",
            err=True,
        )
    for text in found.unread:
        say(f"drivepanel: {text}", err=True)


def _say(found: ChangeList, path: str) -> None:
    changes = found.in_order
    for change in changes:
        say(change_line(change))
    if not changes:
        say("No entry of the journal fits." if found.has_more else f"The journal is empty: {path}")


def change_line(change: Change) -> str:
    """One line about a change: time, drive, text."""
    from tui.session.changes import change_text, device_of, time_of_change

    when = time_of_change(change)
    # an entry that is damaged has no valid time
    reported = f"{when:%Y-%m-%d %H:%M:%S}" if when is not None else getattr(change, "time", "")
    device = device_of(change)
    place = "line" if device is None else device
    return f"{reported}  {place}/{change.line}  {change_text(change)}"


def _write_csv(path: Path, found: ChangeList, *, force: bool) -> None:
    """Write all changes as rows, oldest first. Raises Failure."""
    from ..shared.csv_files import CsvFile

    file = CsvFile(path, [column.title for column in CHANGE_COLUMNS], force=force)
    try:
        for change in found.in_order:
            file.write(_cells(change))
    finally:
        file.close()


def _cells(change: Change) -> list[str]:
    """The cells of a change, in the order of `CHANGE_COLUMNS`."""
    from tui.session.changes import LineLoss, LineRun

    match change:
        case LineRun(line, run):
            seen = [run.reference, *((f"{run.least} to {run.most}",) if run.least else ())]
            return [
                *both_times(run.begun), "run", line, str(run.device), run.profile, "", "",
                run.direction, *both_times(run.ended), ", ".join(seen), "", run.who,
                "" if run.end_within is not None else "still running",
            ]  # fmt: skip
        case LineLoss(line, loss):
            ended = ("", "") if loss.ended is None else both_times(loss.ended)
            number = "" if loss.device is None else str(loss.device)
            begun = both_times(loss.begun)
            return [*begun, "lost", line, number, "", "", "", "", *ended, "", "", "", loss.reason]
        case _:
            return _entry_cells(change)


def _entry_cells(entry: Entry) -> list[str]:
    from tui.session.journal_reading import time_of

    when = time_of(entry)
    times = both_times(when.timestamp()) if when is not None else (entry.time, "")
    return [
        *times, entry.kind, entry.line,
        str(entry.device), entry.profile, entry.code, entry.old, entry.new, "", "", "",
        entry.answer, "", entry.why,
    ]  # fmt: skip
