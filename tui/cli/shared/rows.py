"""Rows of the command line: as lines that grow, as a table, as CSV, from the same columns."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple

from tui.drive.plain import plain

from .say import say

if TYPE_CHECKING:
    from rich.table import Table

GAP = 2
"""Spaces between two columns."""
LEAST_FOLDED = 4
"""Characters that are left to a column that is folded."""


class Column(NamedTuple):
    """A column of rows; widths are in characters."""

    name: str = ""
    unit: str = ""
    width: int = 0
    """Least width in a line; an empty cell of a column without one takes no place."""
    most: int | None = None
    """Longest text in a line; a longer one is cut."""
    right: bool = False
    """True if the cells are aligned to the right."""
    omitted: int = 0
    """Place in the order in which a narrow table omits its columns; 0: never."""
    readable: int | None = None
    """Width to which a narrow table folds the column; None: its texts are never broken."""

    @property
    def title(self) -> str:
        """The name with the unit."""
        return f"{self.name} [{self.unit}]" if self.unit else self.name


def titled(width: int) -> tuple[Column, Column]:
    """Return the columns of rows that are a title, so wide at least, and its text."""
    return Column(width=width), Column()


def row_text(columns: Sequence[Column], cells: Sequence[str]) -> str:
    """Return a row as a line of text, whatever its cells contain."""
    parts = [
        f"{plain(cell)[: column.most]:{'>' if column.right else '<'}{column.width}}"
        for column, cell in zip(columns, cells, strict=True)
    ]
    return (" " * GAP).join(part for part in parts if part).rstrip()


def say_row(columns: Sequence[Column], cells: Sequence[str]) -> None:
    """Print a row at once; what does not fit goes below its last column."""
    say(row_text(columns, cells), indent=sum(column.width + GAP for column in columns[:-1]))


def table_of(
    columns: Sequence[Column],
    rows: Sequence[Sequence[str]],
    title: str = "",
    *,
    width: int | None = None,
    cut: bool = False,
    dim: Collection[int] = (),
) -> Table:
    """Return a table; the rows with the numbers in `dim` are dimmed.

    With a `width` in characters, columns that do not fit are omitted. A column that folds is broken
    at words, or `cut` so that every row is one line.
    """
    from rich.cells import cell_len
    from rich.table import Table
    from rich.text import Text

    cells = [tuple(column.title for column in columns), *rows]
    widths = [max(map(cell_len, texts)) for texts in zip(*cells, strict=True)]
    shown = list(range(len(columns))) if width is None else _fitting(columns, widths, width)
    table = Table(box=None, padding=(0, GAP, 0, 0), header_style="dim", title_justify="left")
    table.title = Text(title, style="bold") if title else None
    for at in shown:
        column = columns[at]
        if column.readable is None:
            justify: Literal["left", "right"] = "right" if column.right else "left"
            # a number that lost a digit would be another one
            table.add_column(column.title, justify=justify, no_wrap=True, min_width=widths[at])
        elif width is None:
            table.add_column(column.title, overflow="fold")
        else:
            others = sum(widths[other] for other in shown if other != at) + GAP * (len(shown) - 1)
            most = max(LEAST_FOLDED, min(widths[at], width - others))
            table.add_column(column.title, no_wrap=cut, max_width=most, overflow="fold")
    for number, row in enumerate(rows):
        style = "dim" if number in dim else ""
        table.add_row(*(Text(row[at]) for at in shown), style=style)
    return table


def _fitting(columns: Sequence[Column], widths: Sequence[int], width: int) -> list[int]:
    """Return the columns that fit next to readable ones."""
    needed = [
        least if column.readable is None else min(least, column.readable)
        for column, least in zip(columns, widths, strict=True)
    ]
    shown = list(range(len(columns)))
    for at in sorted(
        (at for at in shown if columns[at].omitted), key=lambda at: columns[at].omitted
    ):
        if sum(needed[other] for other in shown) + GAP * (len(shown) - 1) <= width:
            break
        shown.remove(at)
    return shown
