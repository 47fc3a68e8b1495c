"""Reader of the journal's files, line by line; it accepts any content."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path

import msgspec

from tui.drive.small_file import open_regular

from .connect.line_key import line_key
from .journal import Entry, Journal

LONGEST_LINE = 64_000
"""Longest line in bytes that may be an entry."""
READ_MOST = 20_000_000
"""Bytes at the end of a file that are read; each file is shorter unless it is damaged."""
DAMAGE_SHOWN = 200
"""Characters of a damaged line that are shown."""


@dataclass(frozen=True, slots=True)
class DamagedLine:
    """A damaged line: half of an entry, or something else altogether."""

    file: Path
    number: int
    text: str
    """The beginning of it, unchanged."""


def entries_of(journal: Journal, line: str, device: int) -> list[Entry]:
    """Return the entries of the journal's files about a drive of a line, oldest first.

    Waits a few seconds for entries that are not on the disk yet. Damaged lines are skipped.
    """
    journal.flush()
    found = [entry for entry in read_journal(journal.files) if isinstance(entry, Entry)]
    return completed(entry for entry in found if (entry.line, entry.device) == (line, device))


def read_journal(files: Iterable[Path]) -> Iterator[Entry | DamagedLine]:
    """Yield the entries of files in their order, and damaged lines.

    Missing files are skipped. Raises OSError for a file that cannot be read.
    """
    for file in files:
        for number, line in _lines(file):
            entry = _entry(line)
            if entry is not None:
                yield entry
            elif not _is_mark(line):
                text = line[: DAMAGE_SHOWN * 4].decode("utf-8", "replace")
                yield DamagedLine(file, number, text[:DAMAGE_SHOWN])


def completed(entries: Iterable[Entry]) -> list[Entry]:
    """Return the entries; merge a value that was read back later into the entry of its write."""
    found: list[Entry] = []
    places: dict[tuple[str, str, int, str], int] = {}
    for entry in entries:
        if entry.kind == "read-back":
            place = places.get((entry.of, entry.line, entry.device, entry.code))
            if place is not None:
                before = found[place]
                answer = f"{before.answer} {entry.answer}"
                found[place] = replace(before, answer=answer, read_back=entry.read_back)
                continue
        else:
            places[entry.time, entry.line, entry.device, entry.code] = len(found)
        found.append(entry)
    return found


def selected(
    entries: Iterable[Entry],
    *,
    device: int | None = None,
    lines: Iterable[str] = (),
    since: datetime | None = None,
) -> list[Entry]:
    """Select entries by drive, by lines however they were typed, and by time.

    An entry without a valid time is kept, because it may be in the range.
    """
    wanted = {line_key(line) for line in lines}
    keys: dict[str, str] = {}

    def fits(item: Entry) -> bool:
        if device is not None and item.device != device:
            return False
        if wanted and keys.setdefault(item.line, line_key(item.line)) not in wanted:
            return False
        when = time_of(item)
        return since is None or when is None or when >= since

    return [entry for entry in entries if fits(entry)]


def time_of(entry: Entry) -> datetime | None:
    """Return the time of an entry; None if its text is not a time."""
    try:
        return datetime.fromisoformat(entry.time).astimezone()
    except (ValueError, OverflowError, OSError):
        return None


def _lines(file: Path) -> Iterator[tuple[int, bytes]]:
    """Yield the lines of a file with their numbers; skip the rest of one that is too long."""
    try:
        handle = open_regular(file)
    except FileNotFoundError:
        return
    with os.fdopen(handle, "rb") as opened:
        size = os.fstat(handle).st_size
        number = 1
        if size > READ_MOST:
            opened.seek(size - READ_MOST)
            opened.readline(LONGEST_LINE)
        while line := opened.readline(LONGEST_LINE):
            whole = line.endswith(b"\n")
            if stripped := line.strip():
                yield number, stripped
            while not whole and (rest := opened.readline(LONGEST_LINE)):
                whole = rest.endswith(b"\n")
            number += 1


def _entry(line: bytes) -> Entry | None:
    try:
        # not by msgspec alone: it takes no half of a character, which a drive's name may hold
        return msgspec.convert(json.loads(line), Entry)
    except (ValueError, RecursionError, msgspec.ValidationError):
        return None


def _is_mark(line: bytes) -> bool:
    """Return True if a line only marks the previous one as incomplete."""
    try:
        reported = json.loads(line)
    except (ValueError, RecursionError):
        return False
    return isinstance(reported, dict) and reported.get("kind") == "mended"
