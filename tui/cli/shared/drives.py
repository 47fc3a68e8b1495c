"""One command at several drives of a line, in turn, or at every drive that answers."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import TYPE_CHECKING

from .errors import DONE, LINE_TROUBLE, Failure, failure_of
from .options import Target
from .output import command_name, print_json
from .say import say

if TYPE_CHECKING:
    from tui.session.connect.identify import ScanResult
    from tui.session.connect.open_line import OpenLine

    from ..documents.document import Document, ErrorDocument

Work = Callable[[Target], Awaitable[tuple["Document", int]]]
"""Work for one drive: reports its lines, returns its document and exit status."""


async def each_drive(target: Target, work: Work, *, as_json: bool, titled: bool = True) -> int:
    """Do the work at every drive; with `as_json` print one document, or the list of several.

    With `titled` each of several has its address above it. What is wrong with one of several is
    told and keeps it from no other. Returns the highest exit status; raises what the work raises
    where there is one drive only.
    """
    targets = target.each()
    documents: list[Document] = []
    worst = DONE
    for item in targets:
        if len(targets) > 1 and titled and not as_json:
            say(f"Device {item.device}:")
        document: Document
        try:
            document, status = await work(item)
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

    `line_name` is what its line is called where there are several.
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
