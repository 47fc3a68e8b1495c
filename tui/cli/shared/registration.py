"""Registration of a command: its line of help and its exit statuses, where it is defined.

`python -m tui.cli.derived` collects the registrations: the index of commands, the manual page, the
JSON Schema, and the table in docs/cli.md.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from .errors import (
    DONE,
    DRIVE_REFUSED,
    ENDED_AFTER_WRITING,
    LINE_TROUBLE,
    REFUSED_HERE,
    USAGE,
    reported,
)

ON_LINE = (LINE_TROUBLE, DRIVE_REFUSED, REFUSED_HERE)
"""Exit statuses of a command that reads a drive."""
GROUPS = ("Watch", "Run", "Set up", "Troubleshoot", "Share", "Profiles", "Further")
"""Headings of the commands in the help, in their order."""
WRITING = (*ON_LINE, ENDED_AFTER_WRITING)
"""Exit statuses of a command that writes to a drive."""


class RegisteredCommand(click.Command):
    """A command of drivepanel."""

    group: str = ""
    """Its heading in the help, one of GROUPS; empty for the last one."""
    statuses: tuple[int, ...] = ()
    """Exit statuses besides 0, 2, 70, 74, 130, and 128 with the number of a signal."""

    @property
    def all_statuses(self) -> list[int]:
        """Exit statuses besides 70, 74, 130, and 128 with the number of a signal."""
        return sorted({DONE, USAGE, *self.statuses})


def command(
    summary: str,
    *,
    group: str = "",
    statuses: tuple[int, ...] = (),
    acts: bool = False,
    **attributes: Any,
) -> Callable[[Callable[..., Any]], RegisteredCommand]:
    """Register a function as the command of its name; `attributes` go to click.

    `summary` is its line in `drivepanel --help`, under the heading `group` of GROUPS. With `acts`
    the status is the result for a drive, even if nothing reads the output. Errors become an exit
    status and one or two lines.
    """

    def register(function: Callable[..., Any]) -> RegisteredCommand:
        made = click.command(cls=RegisteredCommand, short_help=summary, **attributes)(
            reported(function, acts=acts)
        )
        made.statuses = tuple(sorted(statuses))
        made.group = group
        return made

    return register
