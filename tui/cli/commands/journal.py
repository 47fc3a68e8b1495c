"""`drivepanel journal`: what was written to drives from here, and which trips were seen."""

from __future__ import annotations

import re
from dataclasses import asdict, dataclass
from datetime import datetime, time, timedelta
from typing import TYPE_CHECKING

import click

from ..shared.errors import USAGE, Failure
from ..shared.options import json_option
from ..shared.output import print_json
from ..shared.registration import command
from ..shared.say import say

if TYPE_CHECKING:
    from tui.session.journal import Entry
    from tui.session.journal_reading import DamagedLine

_SECONDS = {"s": 1, "m": 60, "h": 3600, "d": 86400, "w": 604800}
_AGO = re.compile(r"(\d{1,9})\s*([smhdw])")


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


def _begin(_ctx: click.Context, _option: click.Parameter, text: str | None) -> datetime | None:
    """The time that was typed, in the zone of here."""
    if text is None:
        return None
    if (found := since(text, datetime.now().astimezone())) is None:
        raise click.BadParameter(
            f"{text!r} is not a time. Examples: 2h, 30m, 7d, 08:30, 2026-03-01, 2026-03-01T08:30."
        )
    return found


def since(text: str, now: datetime) -> datetime | None:
    """The time that a text means; None where it means none. A time of day is the last one."""
    text = text.strip()
    try:
        if ago := _AGO.fullmatch(text):
            return now - timedelta(seconds=int(ago[1]) * _SECONDS[ago[2]])
        if re.fullmatch(r"\d\d?:\d\d(:\d\d)?", text):
            clock_time = time.fromisoformat(
                text.rjust(5, "0") if len(text) < 6 else text.rjust(8, "0")
            )
            then = datetime.combine(now.date(), clock_time).astimezone()
            return then if then <= now else then - timedelta(days=1)
        return datetime.fromisoformat(text).astimezone()
    except (ValueError, OverflowError, OSError):
        return None


@command("Show writes made to drives by Drive Panel.")
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
    callback=_begin,
    metavar="TIME",
    help="Start at: 2h, 30m, 7d, 08:30 or 2026-03-01T08:30.",
)
@json_option
def journal(wanted: WantedDrive, begin: datetime | None, as_json: bool) -> None:
    """Show writes to drives from this computer, trips that were seen, and timeout tests.

    Each write has its time, the drive, the old and new value, the drive's reply, and the reason.
    The readable entries of a damaged journal are shown, too.
    """
    from tui.session.journal import Entry, Journal
    from tui.session.journal_reading import DamagedLine, completed, read_journal, selected

    kept = Journal()
    try:
        lines = list(read_journal(kept.files))
    except OSError as error:
        raise Failure(f"{kept.path} cannot be read: {error.strerror or error}.", USAGE) from error
    entries = completed(line for line in lines if isinstance(line, Entry))
    shown = selected(entries, device=wanted.device, line=wanted.line, since=begin)
    damaged = [line for line in lines if isinstance(line, DamagedLine)]
    if as_json:
        from ..documents.other_documents import (
            DamagedLineField,
            JournalDocument,
            JournalEntryField,
        )

        print_json(
            JournalDocument(
                journal=str(kept.path),
                entries=[JournalEntryField(**asdict(entry)) for entry in shown],
                damaged=[
                    DamagedLineField(file=str(line.file), line=line.number, text=line.text)
                    for line in damaged
                ],
            )
        )
        return
    _say(shown, damaged, str(kept.path), filtered=len(shown) < len(entries))


def _say(entries: list[Entry], damaged: list[DamagedLine], path: str, *, filtered: bool) -> None:
    for entry in entries:
        say(entry_line(entry))
    if not entries:
        say("No entry of the journal fits." if filtered else f"The journal is empty: {path}")
    for line in damaged:
        say(
            f"drivepanel: {line.file}, line {line.number} is not a valid entry"
            f" (cut off or damaged): {line.text[:60]}",
            err=True,
        )


def entry_line(entry: Entry) -> str:
    """One line about an entry: time, drive, old and new value, answer, reason."""
    from tui.session.journal_reading import time_of

    when = time_of(entry)
    reported = f"{when:%Y-%m-%d %H:%M:%S}" if when is not None else entry.time
    head = f"{reported}  {entry.device}/{entry.line}"
    if entry.kind == "fault":
        return f"{head}  FAULT {entry.code} {entry.new}: {entry.answer}"
    if entry.kind == "proof":
        return f"{head}  {entry.why}: {entry.new}  {entry.answer}"
    if entry.kind == "reset":
        return f"{head}  {entry.code}: {entry.why} set to {entry.new}  {entry.answer}"
    if entry.kind == "read-back":
        return f"{head}  {entry.code}: {entry.answer}"
    change = f"{entry.old} -> {entry.new}" if entry.old else f"-> {entry.new}"
    return f"{head}  {entry.code}: {change}  {entry.answer}  ({entry.why})"
