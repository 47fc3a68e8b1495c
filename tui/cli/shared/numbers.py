"""Numeric options: finite numbers only, and rates that a line can achieve."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import click

from tui.drive.sentences import counted

from .errors import USAGE, Failure

if TYPE_CHECKING:
    from tui.bus.link import Link

LONGEST_TIME = 366 * 86400.0
"""Seconds; a longer time is a typing error."""
SHORTEST_CYCLE = 0.05
"""Seconds; the shortest cycle of a drive's values."""
CHARACTERS = 8 + 7
"""Characters of the shortest read with its reply."""


class FiniteRange(click.FloatRange):
    """A finite number within limits: NaN and infinity are usage errors."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """The number. Raises BadParameter."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a finite number.", param, ctx)
        return number


def seconds(shortest: float = 0.0, *, above: bool = False) -> FiniteRange:
    """Seconds from `shortest`, or above it, up to a year."""
    return FiniteRange(shortest, LONGEST_TIME, min_open=above)


_TOO_SHORT = (
    "--every {every:g} is too short: at {baud} baud, reading one word from one drive takes"
    " {needed:.2g} s. Use a longer cycle.",
    "--every {every:g} is too short: at {baud} baud, reading one word from {count} drives takes"
    " {needed:.2g} s. Use a longer cycle.",
)


def check_rate(link: Link, every: float, drives: int) -> None:
    """Raise Failure if a serial line cannot read each drive once in `every` seconds."""
    from tui.bus.link import SerialLink
    from tui.wire.frames import character_seconds, silent_seconds

    if not isinstance(link, SerialLink):
        return
    exchange = CHARACTERS * character_seconds(link.baud, link.format)
    exchange += 2 * silent_seconds(link.baud, link.format)
    needed = drives * exchange
    if every < needed:
        text = counted(drives, *_TOO_SHORT, every=every, baud=link.baud, needed=needed)
        raise Failure(text, USAGE)
