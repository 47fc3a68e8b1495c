"""Number of rows of each part of Monitor for a terminal's size; pure functions."""

from __future__ import annotations

from dataclasses import dataclass

OUTSIDE = 4
"""Rows of the frame: strip, tabs, message, keys."""
READOUT_ROWS = 5
"""A heading, three rows of digits, a bar."""
BIG_WIDTH = 56
"""Columns below which the readouts are plain lines."""
WIDE_WORDS = (110, 36)
"""Columns and rows from which all words are side by side."""
ROOMY = 18
"""Rows between the tabs and the message from which empty lines keep the parts apart."""
VALUE_COLUMN = 25
"""Cells of a value: its name, its number, its unit."""
VALUE_COLUMNS_MOST = 4
VALUE_ROWS = 3
"""Rows of values that most drives have."""
WORD_ROWS = 16
"""A heading, and as many bits as the words of the drives in hand have at most."""
WORD_WIDTH = 29
TREND_LEAST = 4
"""A heading or an empty line, two rows, the axis."""
STATE_BLOCK_WIDTH = 22


@dataclass(frozen=True, slots=True)
class Arrangement:
    """Rows of the parts, from the top, their empty lines included."""

    width: int
    height: int
    wide: bool
    """True if words are side by side below the trends of frequency and current."""
    big: bool
    """True if the readouts are large."""
    top: int
    values: int
    columns: int
    trend: int
    words: int
    bottom: int

    @property
    def lead(self) -> int:
        """Empty lines above the readouts and above each other part."""
        return int(self.height - OUTSIDE >= ROOMY)

    @property
    def state_width(self) -> int:
        """Columns of the block at the right."""
        return STATE_BLOCK_WIDTH if self.width < 100 else min(60, self.width // 3)


def arrange(width: int, height: int, count: int) -> Arrangement:
    """The parts in a terminal of that size, for a drive with so many values.

    What there is no room for gets no rows: first the trend, then words, then values. The
    readouts and the state stay.
    """
    room = max(1, height - OUTSIDE)
    wide = width >= WIDE_WORDS[0] and height >= WIDE_WORDS[1]
    lead = int(room >= ROOMY)
    columns = max(1, min(VALUE_COLUMNS_MOST, (width - 2) // VALUE_COLUMN))
    if wide:
        columns = 3
    if count <= 2 * VALUE_ROWS:
        columns = min(columns, 2)  # room for whole names
    big = width >= BIG_WIDTH and room >= READOUT_ROWS
    top = min(room, READOUT_ROWS + lead)
    bottom = min(room - top, 2 if wide else 3 + lead)
    rest = room - top - bottom
    words = WORD_ROWS + lead if wide else 0
    rest -= words
    rows = -(-count // columns)
    values = min(rest, rows + int(rest > rows))
    trend = rest - values
    if trend < TREND_LEAST:
        trend, bottom = 0, bottom + trend
    return Arrangement(width, height, wide, big, top, values, columns, trend, words, bottom)
