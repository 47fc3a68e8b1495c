"""CSV files of `watch`: started, continued or replaced as configured, and rotated."""

from __future__ import annotations

import csv
import os
import re
import sys
from collections.abc import Sequence
from contextlib import suppress
from datetime import date, datetime
from pathlib import Path
from typing import TextIO

import click

from tui.drive.plain import csv_text, plain_cells

from .errors import USAGE, Failure, file_failures
from .standard_streams import STANDARD

_SIZE = re.compile(r"(\d{1,9}(?:\.\d{1,9})?)\s*(k|M|G)i?B?", re.IGNORECASE)
_FACTORS = {"k": 1_000, "m": 1_000_000, "g": 1_000_000_000}
DAY = "day"


def rotation(_: click.Context, option: click.Parameter, text: str | None) -> int | str | None:
    """When a file is put aside and a new one begun: bytes for a size such as 10MB, or `day`."""
    if text is None or text.strip().lower() == DAY:
        return text and DAY
    match = _SIZE.fullmatch(text.strip())
    size = int(float(match[1]) * _FACTORS[match[2].lower()]) if match else 0
    if not size:
        wrong = f"{text!r} is neither a size, such as 500kB or 10MB, nor day."
        raise click.BadParameter(wrong, param=option)
    return size


def refuse_unasked(path: Path, *, append: bool, force: bool) -> None:
    """Raise Failure where a file exists and is neither to be continued nor replaced."""
    if path.exists() and not (append or force):
        raise Failure(f"{path} already exists. Choose another name, --append or --force.", USAGE)


class CsvFile:
    """Rows in a CSV file or on standard output, each flushed as it is written.

    Raises Failure if the file exists without --append or --force, if its columns differ, or if it
    cannot be written.
    """

    def __init__(
        self,
        path: Path,
        titles: Sequence[str],
        *,
        append: bool = False,
        force: bool = False,
        rotate: int | str | None = None,
    ) -> None:
        self.path = path
        self.rows = 0
        """Rows written by this command."""
        self._titles = plain_cells(titles)
        self._rotate = rotate
        refuse_unasked(path, append=append, force=force or path == STANDARD)
        self._day = date.today()
        self._file = self._opened(append=append)

    def _opened(self, *, append: bool) -> TextIO:
        with file_failures(self.path):
            if not append or not self.path.exists() or not self.path.stat().st_size:
                return self._begun()
            self._check_titles()
            self._day = date.fromtimestamp(self.path.stat().st_mtime)
            whole = _ends_with_a_line(self.path)
            file = self.path.open("a", newline="", encoding="utf-8")
            if not whole:  # a row that a crash has cut
                file.write("\r\n")
            return file

    def _begun(self) -> TextIO:
        if self.path == STANDARD:
            file = sys.stdout
        else:
            file = self.path.open("w", newline="", encoding="utf-8")
        try:
            file.write(csv_text([self._titles]))
            file.flush()
        except OSError:
            with suppress(OSError):
                file.close()
            raise
        return file

    def _check_titles(self) -> None:
        with self.path.open(newline="", encoding="utf-8", errors="replace") as file:
            found = next(csv.reader(file), [])
        if found != self._titles:
            raise Failure(
                f"{self.path} has other columns ({', '.join(found)[:200]}): use another name.",
                USAGE,
            )

    def write(self, cells: Sequence[str]) -> None:
        """Write a row; raises Failure where the disk does not take it."""
        row = csv_text([cells])
        with file_failures(self.path):
            if self._due(len(row.encode())):
                self._put_aside()
            self._file.write(row)
            self._file.flush()
        self.rows += 1

    def _due(self, more: int) -> bool:
        if self._rotate == DAY:
            return date.today() != self._day
        if not isinstance(self._rotate, int):
            return False
        size = os.fstat(self._file.fileno()).st_size
        head = len(",".join(self._titles)) + 2
        return size > head and size + more > self._rotate

    def _put_aside(self) -> None:
        """Give the written file a name of its own, and start a new one."""
        self._file.close()
        by_day = self._rotate == DAY
        when = self._day.isoformat() if by_day else f"{datetime.now():%Y-%m-%dT%H%M%S}"
        aside, number = self._named(when), 2
        while aside.exists():
            aside, number = self._named(f"{when}-{number}"), number + 1
        self.path.rename(aside)
        self._day = date.today()
        self._file = self._opened(append=False)

    def _named(self, part: str) -> Path:
        return self.path.with_name(f"{self.path.stem}-{part}{self.path.suffix}")

    def close(self) -> None:
        """Close the file; a full disk was reported at the time of writing."""
        if self.path != STANDARD:
            with suppress(OSError):
                self._file.close()


def _ends_with_a_line(path: Path) -> bool:
    with path.open("rb") as file:
        file.seek(-1, os.SEEK_END)
        return file.read(1) == b"\n"
