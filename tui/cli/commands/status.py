"""`drivepanel status`: what a drive does, who commands it, and what it would do left alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from ..shared.completion import complete_line
from ..shared.drive_status import status_document, status_of_drive
from ..shared.drives import each_drive
from ..shared.every_drive import USUAL_SEARCH, every_drive
from ..shared.line_argument import takes_line_as
from ..shared.options import (
    Target,
    connect_drive,
    drives_options,
    force_profile_option,
    hold_option,
    json_option,
    on_line,
    read_only_option,
)
from ..shared.registration import ON_LINE, command
from ..shared.several_lines import FirstOfLines, LineWish, lines_wished, on_lines
from ..shared.status_lines import StatusWish, say_in_a_line, say_status, status_of_lines

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

    from ..documents.drive_documents import StatusDocument


@command("Show a drive's state, control source and fault.", statuses=ON_LINE)
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
    else:
        worst = _on_one_line(wishes[0], wanted, read_only=read_only)
    if worst:
        raise click.exceptions.Exit(worst)


def _on_one_line(wish: LineWish, wanted: StatusWish, *, read_only: bool) -> int:
    """Report the drives of the one named line, and the highest exit status."""
    from ..running.holding import hold_on

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

    async def work(opened: OpenLine) -> int:
        drives = target
        if wanted.every:
            drives = await every_drive(opened, target, wanted.where(wish))
        worst = await each_drive(
            drives,
            lambda drive: show_drive(opened, drive),
            as_json=wanted.as_json,
            titled=not wanted.every,
        )
        await hold_on(opened, sessions, wanted.hold)
        return worst

    return on_line(target, work, read_only=read_only)
