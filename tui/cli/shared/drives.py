"""One command at several drives of a line, in turn, or at every drive that answers."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Sequence
from typing import TYPE_CHECKING

from .errors import DONE, LINE_TROUBLE, Failure, end_with, failure_of
from .options import Target, on_line
from .output import command_name, print_json
from .say import say

if TYPE_CHECKING:
    from tui.session.connect.identify import ScanResult
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

    from ..documents.document import Document, ErrorDocument

DriveWork = Callable[["OpenLine", Target], Awaitable[tuple["Document", int]]]
"""Work for one drive of a line: reports its lines, returns its document and exit status."""


def on_each_drive(
    target: Target,
    work: DriveWork,
    *,
    as_json: bool,
    read_only: bool,
    choose: Callable[[OpenLine], Awaitable[Target]] | None = None,
    titled: bool = True,
    hold: float | None = None,
    held: Sequence[DriveSession] = (),
) -> None:
    """Open the line, do the work at every drive of the target, and close the line.

    `choose` names the drives once the line is open. With `as_json` one document is printed, or the
    list of several. The `held` drives are kept polled for `hold` seconds afterwards. Raises Exit
    with the highest status other than 0, and what the work raises if there is one drive only.
    """

    async def at_drives(opened: OpenLine) -> int:
        from .holding import hold_on

        chosen = target if choose is None else await choose(opened)
        status = await _each_drive(opened, chosen, work, as_json=as_json, titled=titled)
        await hold_on(opened, held, hold)
        return status

    end_with(on_line(target, at_drives, read_only=read_only))


async def _each_drive(
    opened: OpenLine, target: Target, work: DriveWork, *, as_json: bool, titled: bool
) -> int:
    """Do the work at every drive; with `as_json` print one document, or the list of several.

    With `titled`, the address of each of several drives is printed above its output. An error at
    one of several drives is reported, and the others follow. Returns the highest exit status.
    """
    targets = target.each()
    documents: list[Document] = []
    worst = DONE
    for item in targets:
        if len(targets) > 1 and titled and not as_json:
            say(f"Device {item.device}:")
        document: Document
        try:
            document, status = await work(opened, item)
        except Exception as error:
            if len(targets) == 1:
                raise
            failure = failure_of(error)
            document, status = failed(item, failure.message, failure.status), failure.status
        documents.append(document)
        worst = max(worst, status)
    if as_json:
        print_json(documents if len(targets) > 1 else documents[0])
    return worst


def failed(target: Target, text: str, status: int, line_name: str = "") -> ErrorDocument:
    """Report what is wrong with one of several drives; the same as a document.

    `line_name` is the name of its line if there are several.
    """
    from ..documents.document import ErrorDocument

    where = f"{line_name}: " if line_name else ""
    who = "" if text.startswith(f"Device {target.device}") else f"Device {target.device}: "
    say(f"drivepanel: {where}{who}{text}", err=True)
    return ErrorDocument(
        command=command_name(),
        line=target.line_text,
        device=target.device,
        error=text,
        status=status,
    )


def failed_line(line_text: str, line_name: str, text: str, status: int) -> ErrorDocument:
    """Report what is wrong with one of several lines; the same as a document without a device."""
    from ..documents.document import ErrorDocument

    say(f"drivepanel: {line_name}: {text}", err=True)
    return ErrorDocument(command=command_name(), line=line_text, error=text, status=status)


USUAL_SEARCH = "1-10"
"""Addresses that are searched unless others are named."""


async def every_drive(opened: OpenLine, target: Target, addresses: str | None) -> Target:
    """The target with every drive that answers at the addresses, or on a simulated line.

    Raises LinkSyntaxError for invalid addresses, Failure if no drive answers.
    """
    from tui.session.connect.addresses import parse_addresses
    from tui.session.connect.search import Search

    wanted = opened.devices if addresses is None and opened.devices else None
    devices = wanted or parse_addresses(addresses or USUAL_SEARCH)
    found: list[int] = []

    async def take(result: ScanResult) -> None:
        found.append(result.device)

    await Search(devices, patient=opened.simulation is not None).run(opened.line, take)
    if not found:
        raise Failure(f"No answer at {addresses or USUAL_SEARCH}.", LINE_TROUBLE)
    first, *others = sorted(found)
    return target._replace(device=first, others=tuple(others))
