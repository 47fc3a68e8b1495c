"""Lines that are closed after the test, and limits that allow every function."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from tests.internal_errors import no_internal_errors
from tui.bus.limits import Limits
from tui.bus.line import Line, Timing
from tui.bus.link import Link, SerialLink

if TYPE_CHECKING:
    from .sharing import SharedLines

__all__ = ["no_internal_errors"]

WIDE = Limits(
    functions=frozenset({3, 6, 8, 16, 23, 43}),
    max_read=125,
    max_write=123,
    max_read_23=125,
    max_write_23=121,
    subfunctions=frozenset({0, 10, 11}),
    broadcast_functions=frozenset({6, 16}),
    answers_all=True,
)
NO_ECHO = replace(WIDE, functions=WIDE.functions - {8})
"""The same for a device without diagnostics."""

# generous: a loaded machine must not turn an answer into silence
PATIENT = Timing(first_timeout=5.0, min_timeout=5.0, late_reply=6.0)
BRISK = Timing(first_timeout=0.2, min_timeout=0.2, scan_timeout=0.2, late_reply=0.7, retries=0)

OpenLine = Callable[..., Line]


@pytest.fixture
def open_line() -> Iterator[OpenLine]:
    """Open a line to a peer; devices 1 to 9 take every function. Without probes, scripts count
    their requests alone."""
    lines: list[Line] = []

    def opened(
        link: Link | str,
        timing: Timing = PATIENT,
        *,
        read_only: bool = False,
        wait: float | None = 5.0,
        probes: bool = False,
    ) -> Line:
        link = SerialLink(link) if isinstance(link, str) else link
        line = Line(link, read_only=read_only, timing=replace(timing, probes=probes))
        lines.append(line)
        for device in range(1, 10):
            line.describe(device, WIDE)
        line.open(wait=wait)
        return line

    yield opened
    for line in lines:
        line.close()


def sent(line: Line) -> list[float]:
    """Times at which the line sent each request: on a busy machine a peer sees them late."""
    return [frame.time for frame in line.trace if frame.direction == "out"]


Share = Callable[[str], "SharedLines"]


@pytest.fixture
def share(tmp_path: Path) -> Iterator[Share]:
    """Programs that share the line to a peer, closed after the test."""
    from .sharing import SharedLines

    made: list[SharedLines] = []

    def shared(path: str) -> SharedLines:
        made.append(SharedLines(tmp_path, SerialLink(path)))
        return made[-1]

    yield shared
    for lines in made:
        lines.close()
