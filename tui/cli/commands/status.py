"""`drivepanel status`: a drive's state, its commander, and its reaction to lost polling."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import click

from tui.drive.plain import plain

from ..shared.completion import complete_line
from ..shared.drive_status import (
    LINE_COLUMNS,
    Status,
    drive_cells,
    status_document,
    status_of_drive,
    status_table,
)
from ..shared.drives import USUAL_SEARCH, every_drive, failed, failed_line, on_each_drive
from ..shared.errors import DONE, end_with, failure_of
from ..shared.line_argument import takes_line_as
from ..shared.options import (
    Target,
    connect_drive,
    drives_options,
    force_profile_option,
    hold_option,
    json_option,
    read_only_option,
)
from ..shared.output import print_json
from ..shared.registration import ON_LINE, command
from ..shared.rows import Column, row_text, say_row, titled
from ..shared.say import say
from ..shared.several_lines import FirstOfLines, LineWish, connected, lines_wished, on_lines
from ..shared.silence import silence_hint
from ..shared.watch_outputs import LabelsNeeded

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

    from ..documents.document import Document
    from ..documents.drive_documents import StatusDocument


@command("Show a drive's state, control source and fault.", group="Watch", statuses=ON_LINE)
@takes_line_as(FirstOfLines, "LINE")
@click.argument("more", nargs=-1, metavar="[LINE...]", shell_complete=complete_line)
@drives_options
@force_profile_option
@hold_option
@click.option("--all", "every", is_flag=True, help="Show every drive that answers, one line each.")
@click.option(
    "--addresses",
    metavar="LIST",
    help=f"Scan these addresses with --all (default: {USUAL_SEARCH}).",
)
@read_only_option
@json_option
def status(
    target: Target,
    more: tuple[str, ...],
    hold: float | None,
    every: bool,
    addresses: str | None,
    read_only: bool,
    as_json: bool,
) -> None:
    """Show a drive's state, control source, faults and reaction to a communication loss.

    Several LINEs are shown side by side; LINE@ADDRESS names drives on its line, as in pump@1,2.
    With --all, it gives the addresses to scan on that line.
    """
    if addresses and not every:
        raise click.UsageError("--addresses requires --all.")
    wishes = lines_wished(target, more)
    if every:  # a profile of the settings file is that of one drive
        wishes = [wish.with_profile(target.profile_id) for wish in wishes]
    wanted = StatusWish(every=every, addresses=addresses, hold=hold, as_json=as_json)
    if len(wishes) > 1:
        worst = on_lines(
            wishes,
            lambda lines: status_of_lines(list(zip(lines, wishes, strict=True)), wanted),
            read_only=read_only,
        )
        end_with(worst)
    else:
        _on_one_line(wishes[0], wanted, read_only=read_only)


def _on_one_line(wish: LineWish, wanted: StatusWish, *, read_only: bool) -> None:
    """Report the drives of the one named line. Raises Exit with the highest status."""
    first, *others = wish.drives
    target = first._replace(others=tuple(other.device for other in others))
    sessions: list[DriveSession] = []

    async def show_drive(opened: OpenLine, drive: Target) -> tuple[StatusDocument, int]:
        session = await connect_drive(opened, drive)
        sessions.append(session)
        found = await status_of_drive(session, opened)
        if wanted.every and not wanted.as_json:
            say_in_a_line(found)
        elif not wanted.as_json:
            say_status(found)
        return status_document(target.line_text, found), found.status

    async def answering(opened: OpenLine) -> Target:
        return await every_drive(opened, target, wanted.where(wish))

    on_each_drive(
        target,
        show_drive,
        as_json=wanted.as_json,
        read_only=read_only,
        choose=answering if wanted.every else None,
        titled=not wanted.every,
        hold=wanted.hold,
        held=sessions,
    )


LEFT_INDENT = 5
STATUS_TITLES = titled(16)


@dataclass(frozen=True, slots=True)
class StatusWish:
    """Options of `status` except lines and drives."""

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
        say_row(STATUS_TITLES, (title, text or "-----"))


def say_in_a_line(status: Status, name: str = "", width: int = 0) -> None:
    """Show a person one drive in a line, and in another one a motor that was left running."""
    say(row_text((Column(width=width), *LINE_COLUMNS), (name, *drive_cells(status))))
    if status.left:
        text = plain(status.left.sentence(status.session.line_text))
        say(f"{'':{LEFT_INDENT}}{text}", indent=LEFT_INDENT)


async def status_of_lines(lines: Sequence[tuple[OpenLine, LineWish]], wanted: StatusWish) -> int:
    """Report the drives of several lines, in order; problems of one are reported as they occur.

    Returns the highest exit status. Raises unexpected errors.
    """
    from ..shared.holding import hold_lines_on

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
        say_in_a_line(status, name, width)
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
        by_profile = drive.profile_id is not None
        hint = silence_hint(error, opened, drive.line_text, by_profile=by_profile)
        text = failure.message + hint
        reported.documents.append(failed(drive, text, failure.status, wish.name))
        reported.worst = max(reported.worst, failure.status)
        return
    reported.found.append(status)
    reported.worst = max(reported.worst, status.status)
    reported.documents.append(status_document(wish.text, status))
