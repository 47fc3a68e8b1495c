"""`status` over several lines, side by side: what one of them lacks keeps no other back."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from tui.drive.plain import plain

from .drive_status import (
    Status,
    drive_in_a_line,
    status_document,
    status_of_drive,
    status_table,
)
from .drives import failed, failed_line
from .errors import DONE, failure_of
from .every_drive import every_drive
from .options import Target, connect_drive
from .output import print_json
from .say import say, say_row
from .several_lines import LineWish, connected
from .silence import silence_hint
from .watch_outputs import LabelsNeeded

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine

    from ..documents.document import Document

LEFT_INDENT = 5
STATUS_TITLES = 18
"""Width of the column of titles, with its gap."""


@dataclass(frozen=True, slots=True)
class StatusWish:
    """Options of `status` besides lines and drives."""

    every: bool
    """True if every drive that answers is reported, a line each."""
    addresses: str | None
    hold: float | None
    """Seconds for which the drives are kept polled."""
    as_json: bool

    def where(self, wish: LineWish) -> str | None:
        """Addresses of a line that are searched; those behind its `@` go before all others."""
        return wish.addresses or self.addresses


@dataclass(slots=True)
class LineField:
    """State of one line."""

    found: list[Status] = field(default_factory=list)
    documents: list[Document] = field(default_factory=list)
    worst: int = DONE


def say_status(status: Status) -> None:
    """Show a person everything about one drive."""
    for title, text in status_table(status):
        say_row(title, plain(text) or "-----", STATUS_TITLES)


def say_in_a_line(status: Status, before: str = "") -> None:
    """Show a person one drive in a line, and in another one a motor that was left running."""
    say(f"{before}{plain(drive_in_a_line(status))}")
    if status.left:
        text = plain(status.left.sentence(status.session.line_text))
        say(f"{'':{LEFT_INDENT}}{text}", indent=LEFT_INDENT)


async def status_of_lines(lines: Sequence[tuple[OpenLine, LineWish]], wanted: StatusWish) -> int:
    """Report the drives of several lines, in order; problems of one are reported as they occur.

    Returns the highest exit status. Raises what nobody foresaw.
    """
    from ..running.holding import hold_lines_on

    each = await asyncio.gather(*(_read_line(opened, wish, wanted) for opened, wish in lines))
    if wanted.as_json:
        print_json([document for field in each for document in field.documents])
    else:
        names = [wish.name for _, wish in lines]
        for name, field in zip(names, each, strict=True):
            for status in field.found:
                _say(status, name, max(map(len, names)), wanted)
    await hold_lines_on(
        [
            (wish.name, opened, [status.session for status in field.found])
            for (opened, wish), field in zip(lines, each, strict=True)
        ],
        wanted.hold,
    )
    return max(field.worst for field in each)


def _say(status: Status, name: str, width: int, wanted: StatusWish) -> None:
    if wanted.every:
        say_in_a_line(status, f"{plain(name):<{width}}  ")
    else:
        several = LabelsNeeded(lines=True, drives=True)
        say(f"{several.named(name, status.session.device)}:")
        say_status(status)


async def _read_line(opened: OpenLine, wish: LineWish, wanted: StatusWish) -> LineField:
    """The drives of one line."""
    reported = LineField()
    try:
        await connected(opened, wish.name)
        drives: Sequence[Target] = wish.on(opened)
        if wanted.every:
            drives = (await every_drive(opened, wish.drives[0], wanted.where(wish))).each()
    except Exception as error:
        failure = failure_of(error)
        reported.worst = failure.status
        if wanted.every:  # which drives it has is not known
            reported.documents = [
                failed_line(wish.text, wish.name, failure.message, failure.status)
            ]
        else:
            reported.documents = [
                failed(drive, failure.message, failure.status, wish.name) for drive in wish.drives
            ]
        return reported
    for drive in drives:
        await _read_drive(opened, wish, drive, reported)
    return reported


async def _read_drive(opened: OpenLine, wish: LineWish, drive: Target, reported: LineField) -> None:
    try:
        session = await connect_drive(opened, drive)
        status = await status_of_drive(session, opened)
    except Exception as error:
        failure = failure_of(error)
        text = failure.message + silence_hint(error, opened, drive)
        reported.documents.append(failed(drive, text, failure.status, wish.name))
        reported.worst = max(reported.worst, failure.status)
        return
    reported.found.append(status)
    reported.worst = max(reported.worst, status.status)
    reported.documents.append(status_document(wish.text, status))
