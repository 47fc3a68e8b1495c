"""Readings as JSON, as a table, as CSV."""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from datetime import UTC, datetime
from decimal import Decimal
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tui.session.drive_session import DriveSession
    from tui.session.readings import Reading


def print_json(data: object, *, compact: bool = False) -> None:
    """Print JSON on standard output, at once."""
    text = json.dumps(data, ensure_ascii=False, indent=None if compact else 2)
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


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

    The value of a name or a bit word is its raw number.
    """
    number = reading.value.number if reading.value else None
    value = reading.raw if number is None else _plain(number)
    return {
        "address": reading.parameter.address,
        "raw": reading.raw,
        "value": value,
        "unit": reading.unit,
        "text": reading.text,
        "quality": str(reading.quality),
    }


def _plain(number: Decimal) -> int | float:
    """A JSON number: an integer where the value has no decimals."""
    return int(number) if int(number.as_tuple().exponent) >= 0 else float(number)


def iso_time(wall: float) -> str:
    """A time with its zone, to the millisecond."""
    return datetime.fromtimestamp(wall, UTC).astimezone().isoformat(timespec="milliseconds")


def print_readings(session: DriveSession, readings: Mapping[str, Reading]) -> None:
    """A table with the three notations of each address."""
    from rich.console import Console
    from rich.table import Table

    from tui.drive.profile import is_verified, notations

    table = Table(box=None, pad_edge=False, header_style="dim")
    for title, justify in (
        ("Code", "left"),
        ("Name", "left"),
        ("Value", "right"),
        ("Unit", "left"),
        ("Raw", "right"),
        ("Number", "left"),
        ("Wire address", "left"),
        ("", "left"),
    ):
        table.add_column(title, justify=justify, no_wrap=title not in ("Name", ""))  # type: ignore[arg-type]
    for reading in readings.values():
        code, number, wire = notations(reading.parameter)
        mark = "" if is_verified(reading.parameter) else " ?"
        physical = f"{reading.physical.display}" if reading.physical else ""
        raw = "" if reading.raw is None else str(reading.raw)
        table.add_row(
            code + mark,
            reading.parameter.name,
            reading.text,
            reading.unit,
            raw,
            number,
            wire,
            physical or _why(reading),
        )
    Console(soft_wrap=True).print(table)


def _why(reading: Reading) -> str:
    if reading.error:
        return reading.error
    return "" if reading.quality == "good" else str(reading.quality)
