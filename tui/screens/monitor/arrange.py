"""Number of rows of each part of Monitor for a terminal's size; pure functions."""

from __future__ import annotations

from dataclasses import dataclass

OUTSIDE = 4
"""Rows of the frame: status bar, tabs, message, keys."""
READOUT_ROWS = 5
"""Upper edge with the name, three rows of digits, lower edge with a bar."""
ROOMY, VERY_ROOMY = 18, 30
"""Least rows within the frame for a second row at the bottom, and for a third."""
WIDE = 110
"""Least terminal columns for a third readout, and for tables of bits side by side."""
VALUE_COLUMN, WIDE_VALUE_COLUMN = 19, 26
"""Least cells of a value with name, number and unit: below WIDE, and from WIDE on."""
VALUE_ROWS_MOST = 3
STATE_WIDTH, STATE_WIDTH_MOST = 29, 44
AXIS_ROWS, SHORT_AXIS_ROWS = 2, 1
"""Rows below the curve for marks and clock times; a short axis has both in one row."""
SHORT_CURVE = 6
"""Most rows of a curve, with heading and axis, that has a short axis."""
BAND_FROM = 14
"""Least rows of curves for a separate band of the current."""
BAND_LEAST, BAND_MOST = 3, 10


@dataclass(frozen=True, slots=True)
class Arrangement:
    """Rows and columns of Monitor's parts, from the top."""

    width: int
    height: int
    top: int
    values: int
    columns: int
    """Columns of values."""
    curve: int
    """Rows of the curve with its heading and axis, or of a table instead of it."""
    bottom: int
    lean: bool = False
    """True on a low-bandwidth link: no third readout and no second curve."""

    @property
    def wide(self) -> bool:
        """True if tables of bits are side by side."""
        return self.width >= WIDE

    @property
    def third(self) -> bool:
        """True if the terminal is wide enough for a third readout, and the link fast enough."""
        return self.wide and not self.lean

    @property
    def lead(self) -> int:
        """Empty lines above the readouts."""
        return self.top - READOUT_ROWS

    @property
    def state_width(self) -> int:
        """Columns of the state block at the right, with its frame."""
        return STATE_WIDTH if self.width < 100 else min(STATE_WIDTH_MOST, self.width * 2 // 7)

    @property
    def axis(self) -> int:
        """Rows of the time axis."""
        return SHORT_AXIS_ROWS if self.curve <= SHORT_CURVE else AXIS_ROWS

    @property
    def band(self) -> int:
        """Rows of the current's band, without the line above it; 0 if there is no band."""
        rows = self.curve - 1 - self.axis
        return (
            max(BAND_LEAST, min(BAND_MOST, rows // 4)) if rows >= BAND_FROM and not self.lean else 0
        )

    @property
    def plot(self) -> int:
        """Rows of the first curve, without heading and axis."""
        band = self.band
        return self.curve - 1 - self.axis - (band + 1 if band else 0)


def arrange(width: int, height: int, count: int, *, lean: bool = False) -> Arrangement:
    """Divide the terminal among the parts, for a drive with `count` values outside the readouts.

    The curve gets the remaining rows.
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
