"""Readings as JSON and as a table."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from decimal import Decimal
from typing import TYPE_CHECKING, Any, Literal

from tui.drive.plain import escaped_json, plain

if TYPE_CHECKING:
    from rich.console import Console
    from rich.segment import Segment
    from rich.table import Table

    from tui.session.drive import DriveSession
    from tui.session.reading import Reading

COLUMNS = {
    "Code": False,
    "Name": False,
    "Value": True,
    "Unit": False,
    "Raw": True,
    "Number": False,
    "Wire address": False,
    "": False,
}
"""Headings of a table of readings, and whether the column is aligned to the right."""

NAME_COLUMN = tuple(COLUMNS).index("Name")
GAP = 2

PIPE_WIDTH = 200
"""Width of a table that goes to a file or another program, in characters."""


def print_json(data: object, *, compact: bool = False) -> None:
    """Print JSON on standard output, at once."""
    sys.stdout.write(json_text(data, compact=compact) + "\n")
    sys.stdout.flush()


def json_text(data: object, *, compact: bool = True) -> str:
    """JSON that a terminal may be given: every character that could command one is escaped."""
    return escaped_json(json.dumps(data, ensure_ascii=False, indent=None if compact else 2))


def readings_json(
    line: str, session: DriveSession, readings: Mapping[str, Reading]
) -> dict[str, Any]:
    """The object that `read` and `watch` print."""
    return {
        "line": line,
        "device": session.device,
        "profile": session.profile.id,
        "values": {code: reading_json(reading) for code, reading in readings.items()},
    }


def reading_json(reading: Reading) -> dict[str, Any]:
    """One value; `raw` and `value` are null where there is none.

    The value of a name or a bit word is its raw number. `unsure` is there where no document says
    what so high a raw value means.
    """
    number = reading.value.number if reading.value else None
    value = reading.raw if number is None else _plain(number)
    return {
        "address": reading.parameter.address,
        "raw": reading.raw,
        "value": value,
        "unit": reading.unit,
        "text": reading.text,
        "taught": reading.value.taught if reading.value else False,
        "quality": str(reading.quality),
        **({"unsure": True} if reading.value is not None and reading.value.unsure else {}),
    }


def _plain(number: Decimal) -> int | float:
    """A JSON number: an integer where the value has no decimals."""
    return int(number) if int(number.as_tuple().exponent) >= 0 else float(number)


def iso_time(wall: float) -> str:
    """A time with its zone, to the millisecond."""
    return datetime.fromtimestamp(wall, UTC).astimezone().isoformat(timespec="milliseconds")


def console() -> Console:
    """A console on standard output, wide where that is no terminal, so that no line is folded.

    Nothing that is printed on it is markup, and no control character of a text reaches it.
    Raises BrokenPipeError where its reader went away.
    """
    from rich.console import Console
    from rich.segment import Segment

    class Plain(Console):
        def on_broken_pipe(self) -> None:
            raise BrokenPipeError

        def render(self, *args: Any, **how: Any) -> Iterator[Segment]:
            for text, style, control in super().render(*args, **how):
                yield Segment(text if control else plain(text, lines=True), style, control)

    return Plain(
        width=None if sys.stdout.isatty() else PIPE_WIDTH,
        highlight=False,
        markup=False,
        emoji=False,
    )


def print_readings(readings: Mapping[str, Reading]) -> None:
    """Print a table of readings."""
    console().print(readings_table(readings))


def readings_table(
    readings: Mapping[str, Reading], title: str = "", *, width: int | None = None
) -> Table:
    """A table of readings with the three notations of each address.

    With a `width` in characters every row is one line, and names are cut to fit.
    """
    from rich.cells import cell_len
    from rich.table import Table
    from rich.text import Text

    rows = [_cells(reading) for reading in readings.values()]
    widths = [max(map(cell_len, column)) for column in zip(tuple(COLUMNS), *rows, strict=True)]
    name_width = None
    if width is not None:
        others = sum(widths) - widths[NAME_COLUMN] + GAP * (len(widths) - 1)
        name_width = max(4, min(widths[NAME_COLUMN], width - others))
    table = Table(box=None, padding=(0, GAP, 0, 0), header_style="dim", title_justify="left")
    table.title = Text(title, style="bold") if title else None
    for index, (heading, right) in enumerate(COLUMNS.items()):
        justify: Literal["left", "right"] = "right" if right else "left"
        if index == NAME_COLUMN:
            table.add_column(heading, no_wrap=width is not None, max_width=name_width)
        else:
            # a number that lost a digit would be another one
            table.add_column(heading, justify=justify, no_wrap=True, min_width=widths[index])
    for cells, reading in zip(rows, readings.values(), strict=True):
        style = "" if reading.quality == "good" else "dim"
        table.add_row(*(Text(cell) for cell in cells), style=style)
    return table


def _cells(reading: Reading) -> tuple[str, ...]:
    from tui.drive.profile.profile import is_verified, notations

    code, number, wire = notations(reading.parameter)
    return (
        code if is_verified(reading.parameter) else f"{code} ?",
        reading.parameter.name,
        reading.text,
        reading.unit,
        "" if reading.raw is None else str(reading.raw),
        number,
        wire,
        _remark(reading),
    )


def _remark(reading: Reading) -> str:
    """What a table says beside a value: what it is in its rating's unit, or what is wrong."""
    if reading.raw is None:
        return "no value"
    if reading.quality != "good":
        return str(reading.quality)
    if reading.value is not None and reading.value.taught:
        return "taught"
    return reading.physical.display if reading.physical else ""
