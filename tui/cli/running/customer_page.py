"""One page for the customer about each drive, for `report`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from dataclasses import replace as replaced
from pathlib import Path
from typing import TYPE_CHECKING

from ..documents.setting_documents import ReportDocument
from ..shared.drives import every_drive, failed
from ..shared.errors import DONE, INTERRUPTED, Failure, failure_of
from ..shared.options import Target, connect_drive, on_line
from ..shared.output import drive_fields, print_json
from ..shared.say import Messages
from ..shared.sets import take_set, write_down
from ..shared.standard_streams import STANDARD

if TYPE_CHECKING:
    from tui.session.connect.named_lines import LineSettings
    from tui.session.connect.open_line import OpenLine
    from tui.session.report_page import ReportPage
    from tui.session.stored_results import StoredResult

    from ..documents.document import Document

PAGES_WRITTEN = "{file}: a page about each of {count} drives", "{file}: a page about {title}"


@dataclass(frozen=True, slots=True)
class PageWriter:
    """Reads drives and writes their pages to one file; `every` scans for them."""

    target: Target
    file: Path
    tests: Path | None
    """Folder with results of acceptance tests (default: that of the file)."""
    every: bool
    addresses: str | None
    force: bool
    as_json: bool

    def write(self) -> int:
        """Return the exit status. Raises Failure, with nothing written.

        A drive that cannot be read has a page that says why, if another one can.
        """
        from tui.session.connect.named_lines import line_settings
        from tui.session.report_page import page_form
        from tui.session.stored_results import results_in

        standard = self.file == STANDARD
        results = results_in(self.tests or (Path() if standard else self.file.parent))
        settings = line_settings()
        messages = Messages(as_json=self.as_json or standard)
        for fault in settings.faults:
            messages.complain(fault)

        async def work(opened: OpenLine) -> list[tuple[ReportPage, Document, int]]:
            found = self.target
            if self.every:
                found = await every_drive(opened, found, self.addresses)
            alone = len(found.each()) == 1
            return [
                await self._page(opened, each, results, settings, alone=alone)
                for each in found.each()
            ]

        try:
            made = on_line(self.target, work, read_only=True)
        except KeyboardInterrupt:
            raise Failure("Ended by Ctrl-C: nothing was written.", INTERRUPTED) from None
        pages, documents = [page for page, _, _ in made], [document for _, document, _ in made]
        statuses = [status for _, _, status in made]
        if DONE not in statuses:
            raise Failure("No drive could be read: nothing was written.", max(statuses))
        write_down(self.file, page_form(self.file)(pages), force=self.force)
        text = PAGES_WRITTEN[len(pages) == 1]
        messages.tell(text.format(file=self.file, count=len(pages), title=pages[0].title))
        if self.as_json:
            print_json(documents if len(documents) > 1 else documents[0])
        return max(statuses)

    async def _page(
        self,
        opened: OpenLine,
        target: Target,
        results: Sequence[StoredResult],
        settings: LineSettings,
        *,
        alone: bool,
    ) -> tuple[ReportPage, Document, int]:
        """Return the page of a drive, its document and status; raises its error if `alone`."""
        from tui.session.journal import Journal
        from tui.session.journal_reading import entries_of
        from tui.session.report_page import report_page, unread_page

        try:
            session = await connect_drive(opened, target)
            values = await take_set(session)
        except Exception as error:
            if alone:
                raise
            failure = failure_of(error)
            page = unread_page(target.device, failure.message, settings.names)
            return page, failed(target, failure.message, failure.status), failure.status
        entries = entries_of(Journal(), session.line_text, target.device)
        # a simulated line has a temporary port
        line = opened.text if opened.simulation is not None else values.head.line
        values = replaced(values, head=replaced(values.head, line=line))
        document = ReportDocument(
            **drive_fields(target.line_text, session),
            file=str(self.file),
            parameters=len(values.raws),
            absent=dict(values.absent),
            messages=[],
        )
        page = report_page(session.profile, values, entries, results, settings.names)
        return page, document, DONE
