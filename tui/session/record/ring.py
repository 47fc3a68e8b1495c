"""The files of the record in the state folder, and the room that they have together."""

from __future__ import annotations

import time
from collections.abc import Collection, Iterator
from contextlib import suppress
from datetime import UTC, date, datetime
from pathlib import Path

from ..paths import state_folder

RECORD_SUFFIX = ".sqlite"
DAMAGED_MARK = ".damaged-"
"""Part of the name of a damaged file that was renamed, before its time."""
MOST_RECORDED = 256 << 20
"""Bytes of all files of the record."""
ROOM_LEFT = 8 << 20
"""Bytes below that at which old data is removed: logs of open files, and what comes meanwhile."""
IN_USE_FOR = 3 * 3600.0
"""Seconds since its last change in which a file may be in use by the keeper of another line."""
SECONDS_A_DAY = 86400
SIDE_FILES = ("-wal", "-shm", "-journal")


def record_folder() -> Path:
    """Return the folder of the record; it may not exist."""
    return state_folder() / "record"


def record_path(folder: Path, line: str, day: int) -> Path:
    """The file of a line (a file name) for a day in UTC, counted from 1970."""
    named = datetime.fromtimestamp(day * SECONDS_A_DAY, UTC).date().isoformat()
    return folder / f"{named}_{line}{RECORD_SUFFIX}"


def day_of_record(path: Path) -> int | None:
    """Return the day of a file of the record, as in `record_path`; None for any other file."""
    with suppress(ValueError):
        return (date.fromisoformat(path.name.partition("_")[0]) - date(1970, 1, 1)).days
    return None


def files_of_line(folder: Path, line: str) -> list[Path]:
    """Return the files of a line, the oldest day first. Raises OSError."""
    return sorted(folder.glob(f"*_{line}{RECORD_SUFFIX}"))


def is_open_or_left(path: Path) -> bool:
    """True if a file is being written, or was by a program that was killed."""
    return path.with_name(path.name + SIDE_FILES[0]).exists()


def make_room(
    folder: Path, used: Collection[Path], most: int = MOST_RECORDED
) -> tuple[int, Path | None]:
    """Remove the files of the oldest days that must go as a whole.

    Return the bytes that are still too many, and the oldest file that has to lose rows: of a
    closed file only as much goes as is needed. `used` are never removed or returned, nor what
    another keeper may be writing. Raises OSError.
    """
    sizes = dict(_sizes(folder))
    excess = sum(sizes.values()) - (most - min(ROOM_LEFT, most // 16))
    for path in sorted(sizes):
        if excess <= 0:
            break
        if path in used or (is_open_or_left(path) and _is_fresh(path)):
            continue
        if sizes[path] > excess and DAMAGED_MARK not in path.name:
            return excess, path
        for part in (path, *(path.with_name(path.name + side) for side in SIDE_FILES)):
            with suppress(FileNotFoundError):
                part.unlink()
        excess -= sizes[path]
    return excess, None


def _sizes(folder: Path) -> Iterator[tuple[Path, int]]:
    """Yield each file, and its bytes with those beside it."""
    for path in folder.glob(f"*{RECORD_SUFFIX}*"):
        if path.suffix != RECORD_SUFFIX:
            continue
        size = 0
        for part in (path, *(path.with_name(path.name + side) for side in SIDE_FILES)):
            with suppress(FileNotFoundError):
                size += part.stat().st_size
        yield path, size


def _is_fresh(path: Path) -> bool:
    with suppress(FileNotFoundError):
        return abs(time.time() - path.stat().st_mtime) < IN_USE_FOR
    return False
