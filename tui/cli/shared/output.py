"""Readings as JSON and as a table; times that a person types, and times in files."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Iterator, Mapping, Sequence
from datetime import UTC, datetime
from decimal import Decimal
from typing import TYPE_CHECKING, Any, cast

import click

from tui.drive.plain import escaped_json, plain

from .rows import Column, table_of

if TYPE_CHECKING:
    from rich.console import Console
    from rich.segment import Segment
    from rich.table import Table

    from tui.bus.api import LastMinute
    from tui.session.drive import DriveSession
    from tui.session.reading import Reading

    from ..documents.document import Document, DocumentPart, DriveFields
    from ..documents.parts import LastMinuteField, QualityText, ValueField

READING_COLUMNS = (
    Column("Code"),
    Column("Name", readable=16),
    Column("Value", right=True),
    Column("Unit"),
    Column("Raw", right=True, omitted=3),
    Column("Number", omitted=1),
    Column("Wire address", omitted=2),
    Column(),
)
"""Columns of a table of readings, with the three notations of each address."""

PIPE_WIDTH = 200
"""Width of a table that goes to a file or another program, in characters."""


def print_json(reported: Document | Sequence[Document], *, compact: bool = False) -> None:
    """Print one document, or a list of them, on standard output, at once."""
    sys.stdout.write(json_text(reported, compact=compact) + "\n")
    sys.stdout.flush()


def json_text(reported: DocumentPart | Sequence[DocumentPart], *, compact: bool = True) -> str:
    """JSON that a terminal may be given: every character that could command one is escaped."""
    import msgspec

    # not msgspec.json: names of files may have bytes that are not UTF-8
    found = msgspec.to_builtins(reported)
    return escaped_json(json.dumps(found, ensure_ascii=False, indent=None if compact else 2))


def command_name() -> str | None:
    """The name of the command that was called; None where the words name none."""
    context = click.get_current_context(silent=True)
    while context is not None and context.parent is not None and context.parent.parent is not None:
        context = context.parent
    if context is None:
        return None
    return context.invoked_subcommand if context.parent is None else context.info_name


def drive_fields(line: str, session: DriveSession) -> DriveFields:
    """The first fields of a document about a drive, with its line as it was typed."""
    from tui.session.monitor.timeout import timeout_now

    from .pending_timeouts import timeout_field

    return {
        "line": line,
        "device": session.device,
        "profile": session.profile.id,
        "timeout": timeout_field(timeout_now(session)),
    }


def value_field(reading: Reading) -> ValueField:
    """One value; `raw` and `value` are null where there is none, as for a text.

    The value of a name or a bit word is its raw number. `unsure` is set if no document explains
    so high a raw value.
    """
    from msgspec import UNSET

    from ..documents.parts import ValueField

    is_text = reading.parameter.type == "ascii"
    return ValueField(
        address=reading.parameter.address,
        raw=None if is_text else reading.raw,
        value=None if is_text else _number(reading),
        unit=reading.unit,
        text=reading.text,
        taught=reading.value.taught if reading.value else False,
        quality=cast("QualityText", str(reading.quality)),
        unsure=True if reading.value is not None and reading.value.unsure else UNSET,
    )


def _number(reading: Reading) -> int | float | None:
    number = reading.value.number if reading.value else None
    return reading.raw if number is None else plain_number(number)


def plain_number(number: Decimal) -> int | float:
    """A JSON number: an integer where the value has no decimals."""
    return int(number) if int(number.as_tuple().exponent) >= 0 else float(number)


def iso_time(wall: float) -> str:
    """A time with its zone, to the millisecond."""
    return datetime.fromtimestamp(wall, UTC).astimezone().isoformat(timespec="milliseconds")


def console() -> Console:
    """A console on standard output, wide unless that is a terminal, so that no line is folded.

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
        # bold and dim are no colors, but who wants none wants plain text
        color_system=None if os.environ.get("NO_COLOR") else "auto",
        highlight=False,
        markup=False,
        emoji=False,
    )


def print_readings(readings: Mapping[str, Reading]) -> None:
    """Print a table of readings."""
    out = console()
    out.print(readings_table(readings, width=out.width, cut=False))


def readings_table(
    readings: Mapping[str, Reading],
    title: str = "",
    *,
    width: int | None = None,
    cut: bool = True,
) -> Table:
    """Return a table of readings; those that are not good are dimmed."""
    rows = [_cells(reading) for reading in readings.values()]
    dim = [at for at, reading in enumerate(readings.values()) if reading.quality != "good"]
    return table_of(READING_COLUMNS, rows, title, width=width, cut=cut, dim=dim)


def _cells(reading: Reading) -> tuple[str, ...]:
    from tui.drive.profile.profile import is_verified, notations

    code, number, wire = notations(reading.parameter)
    return (
        code if is_verified(reading.parameter) else f"{code} ?",
        reading.parameter.name,
        reading.text,
        reading.unit,
        "" if reading.raw is None or reading.parameter.type == "ascii" else str(reading.raw),
        number,
        wire,
        _remark(reading),
    )


def _remark(reading: Reading) -> str:
    """The remark on a value: the unit of its rating, or why it is not good."""
    if reading.raw is None:
        return "no value"
    if reading.quality != "good":
        return str(reading.quality)
    if reading.value is not None and reading.value.taught:
        return "taught"
    return reading.physical.display if reading.physical else ""


def last_minute_field(minute: LastMinute, share: float | None) -> LastMinuteField:
    """The last minute of a line or a drive, with its share of good replies."""
    from dataclasses import asdict

    from ..documents.parts import LastMinuteField

    return LastMinuteField(share=None if share is None else round(share, 4), **asdict(minute))


def time_typed(_ctx: click.Context, _option: click.Parameter, text: str | None) -> datetime | None:
    """The time that was typed, in the local zone."""
    from tui.session.changes import TIME_EXAMPLES, parse_since

    if text is None:
        return None
    if (found := parse_since(text, datetime.now().astimezone())) is None:
        raise click.BadParameter(f"{text!r} is not a time. Examples: {TIME_EXAMPLES}.")
    return found


def both_times(wall: float) -> tuple[str, str]:
    """A time in seconds since 1970 in UTC and in the local zone, as RFC 3339 has them."""
    utc = datetime.fromtimestamp(wall, UTC).isoformat(timespec="milliseconds")
    return utc.replace("+00:00", "Z"), iso_time(wall)
