"""Number of rows of each part of Monitor for a terminal's size; pure functions."""

from __future__ import annotations

from dataclasses import dataclass

OUTSIDE = 4
"""Rows of the frame: strip, tabs, message, keys."""
READOUT_ROWS = 5
"""The upper edge with the name, three rows of digits, the lower edge with a bar."""
ROOMY, VERY_ROOMY = 18, 30
"""Rows between tabs and message from which words have two rows, and from which values have more."""
WIDE = 110
"""Columns from which there is a third readout, and tables of bits are side by side."""
VALUE_COLUMN, WIDE_VALUE_COLUMN = 19, 26
"""Cells of a value: its name, its number, its unit."""
VALUE_ROWS_MOST = 3
STATE_WIDTH, STATE_WIDTH_MOST = 29, 44
AXIS_ROWS, SHORT_AXIS_ROWS = 2, 1
"""Rows below the curve: marks and clock times, which share one row if there are few."""
SHORT_CURVE = 6
"""Rows of the part of the curve up to which its axis is short."""
BAND_FROM = 14
"""Rows of curves from which the current has a band of its own."""
BAND_LEAST, BAND_MOST = 3, 10


@dataclass(frozen=True, slots=True)
class Arrangement:
    """Rows of the parts, from the top."""

    width: int
    height: int
    top: int
    values: int
    columns: int
    """Columns of values."""
    curve: int
    """The curve with its heading and axis, or a table in its place."""
    bottom: int
    lean: bool = False
    """True if as little as possible is sent: no third readout, no second curve."""

    @property
    def wide(self) -> bool:
        """True if tables of bits are side by side."""
        return self.width >= WIDE

    @property
    def third(self) -> bool:
        """True if there is a third readout."""
        return self.wide and not self.lean

    @property
    def lead(self) -> int:
        """Empty lines above the readouts."""
        return self.top - READOUT_ROWS

    @property
    def state_width(self) -> int:
        """Columns of the block at the right."""
        return STATE_WIDTH if self.width < 100 else min(STATE_WIDTH_MOST, self.width * 2 // 7)

    @property
    def axis(self) -> int:
        """Rows of the axis."""
        return SHORT_AXIS_ROWS if self.curve <= SHORT_CURVE else AXIS_ROWS

    @property
    def band(self) -> int:
        """Rows of the band of the current, without the line above it; 0 for none."""
        rows = self.curve - 1 - self.axis
        return (
            max(BAND_LEAST, min(BAND_MOST, rows // 4)) if rows >= BAND_FROM and not self.lean else 0
        )

    @property
    def plot(self) -> int:
        """Rows of the first curve."""
        band = self.band
        return self.curve - 1 - self.axis - (band + 1 if band else 0)


def arrange(width: int, height: int, count: int, *, lean: bool = False) -> Arrangement:
    """The parts in a terminal of that size, for a drive with so many values.

    The curve gets the rows that the others leave.
    """
    room = height - OUTSIDE
    very = room >= VERY_ROOMY
    columns = max(1, width // (VALUE_COLUMN if width < WIDE else WIDE_VALUE_COLUMN))
    values = min(
        -(-count // columns), 1 if room < ROOMY + 4 else 2 if room < 40 else VALUE_ROWS_MOST
    )
    if -(-count // max(1, values)) < columns:
        columns = max(1, -(-count // max(1, values)))  # room for whole names
    top = READOUT_ROWS + int(very)
    bottom = 1 + int(room >= ROOMY) + int(very)
    curve = room - top - values - bottom
    return Arrangement(width, height, top, values, columns, curve, bottom, lean)
