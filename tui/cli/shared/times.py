"""Times that a person types, and times in files for other programs."""

from __future__ import annotations

from datetime import UTC, datetime

import click

from .output import iso_time


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
