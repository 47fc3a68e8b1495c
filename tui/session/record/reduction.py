"""Replies of 10 s as minimum, mean and maximum of each register.

A register has no sign of its own: the profile gives it one. So the reduction holds for both: its
blob has one of three forms, which differ in their length.

| bytes for each register | if |
|---|---|
| 2: the word | no register changed |
| 8: minimum, maximum (words), mean (float) | no register changed its highest bit |
| 16: minimum and maximum unsigned, then signed, mean unsigned, share of negative words | else |
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from typing import NamedTuple

from .schema import GOOD, RECORDED_READS, ReplyRow

REDUCED_OVER = 10_000_000
"""Microseconds of the monotonic clock that one reduced row covers."""
CLOCK_JUMP = 500_000
"""Microseconds by which the time of day must differ from the monotonic clock to have jumped."""
_NEGATIVE = 0x8000
_LIMIT = 0x10000
_STEADY, _SIGNED = 8, 16


class Extent(NamedTuple):
    """Minimum, mean and maximum of one register."""

    least: int
    mean: float
    most: int


class ReducedRow(NamedTuple):
    """Replies to one read in one window, in the table `reduced`."""

    utc: int
    mono: int
    took: int
    device: int
    function: int
    address: int | None
    registers: int
    good: int
    bad: int
    words: bytes | None
    """See the module; None if no reply was good."""


class ReductionWindow:
    """Replies of the current window, by request; one thread uses it."""

    def __init__(self) -> None:
        self._number: int | None = None
        self._offset = 0
        self._rows: dict[tuple[int, int, int | None, int], list[ReplyRow]] = {}

    def add(self, row: ReplyRow) -> list[ReducedRow]:
        """Add a reply; return the rows of the window that it ends."""
        offset = row.utc - row.mono
        jumped = abs(offset - self._offset) > CLOCK_JUMP
        ended = self.end(None if jumped else row.mono)
        if row.function in RECORDED_READS:
            self._number, self._offset = row.mono // REDUCED_OVER, offset
            key = row.device, row.function, row.address, row.registers
            self._rows.setdefault(key, []).append(row)
        return ended

    def end(self, mono: int | None = None) -> list[ReducedRow]:
        """Return the rows of the window if it does not include `mono`; without, in any case."""
        if mono is not None and self._number in (None, mono // REDUCED_OVER):
            return []
        ended = [_reduced(rows) for rows in self._rows.values()]
        self._rows, self._number = {}, None
        return ended


def _reduced(rows: Sequence[ReplyRow]) -> ReducedRow:
    first, last = rows[0], rows[-1]
    blobs = [row.words for row in rows if row.quality == GOOD and row.words]
    return ReducedRow(
        first.utc, first.mono, last.mono + last.took - first.mono, first.device, first.function,
        first.address, first.registers, len(blobs), len(rows) - len(blobs), _blob(blobs),
    )  # fmt: skip


def _blob(blobs: Sequence[bytes]) -> bytes | None:
    if not blobs:
        return None
    if len(set(blobs)) == 1:
        return blobs[0]
    form = struct.Struct(f">{len(blobs[0]) // 2}H")
    columns = list(zip(*map(form.unpack, blobs), strict=True))
    extents = [(min(column), max(column), sum(column) / len(column)) for column in columns]
    if all(least & _NEGATIVE == most & _NEGATIVE for least, most, _ in extents):
        return b"".join(struct.pack(">HHf", *extent) for extent in extents)
    return b"".join(
        struct.pack(">HHHHff", least, most, *_signed_extent(column), mean, _share(column))
        for column, (least, most, mean) in zip(columns, extents, strict=True)
    )


def _signed_extent(column: Sequence[int]) -> tuple[int, int]:
    """Return the words with the least and the greatest signed value."""
    shifted = [word ^ _NEGATIVE for word in column]
    return min(shifted) ^ _NEGATIVE, max(shifted) ^ _NEGATIVE


def _share(column: Sequence[int]) -> float:
    return sum(word >= _NEGATIVE for word in column) / len(column)


def extent_of(words: bytes, registers: int, index: int, *, signed: bool) -> Extent:
    """Return the extent of one register of a reduced row, from its blob."""
    size = len(words) // registers
    part = words[index * size : (index + 1) * size]
    if size < _STEADY:
        word = int.from_bytes(part, "big", signed=signed)
        return Extent(word, float(word), word)
    if size < _SIGNED:
        least, most, mean = struct.unpack(">HHf", part)
        shift = _LIMIT if signed and least >= _NEGATIVE else 0
        return Extent(least - shift, mean - shift, most - shift)
    if not signed:
        least, most, _, _, mean, _ = struct.unpack(">HHHHff", part)
        return Extent(least, mean, most)
    _, _, least, most, mean, share = struct.unpack(">HHhhff", part)
    return Extent(least, mean - share * _LIMIT, most)
