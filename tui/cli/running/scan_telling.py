"""Output of a scan: hits at once, progress, and the result."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from shutil import get_terminal_size
from typing import TYPE_CHECKING

from tui.drive.finding import LineSetting, WatchingFamily, watching_text
from tui.drive.plain import plain
from tui.drive.profile import library
from tui.drive.sentences import any_of, counted
from tui.session.connect.search import LEFT_ALONE

from ..shared.rows import Column, say_row
from ..shared.say import say, say_over

if TYPE_CHECKING:
    from tui.session.connect.identify import DriveIdentity, ScanResult

    from ..documents.document import Document
    from ..documents.drive_documents import Certainty, ScanEndDocument, ScanHitDocument

HIT_COLUMNS = (Column("device", width=3, right=True), Column("setting", width=10), Column("drive"))


@dataclass(frozen=True, slots=True)
class Hit:
    """A drive that answered, and at which setting; no setting over a network."""

    setting: LineSetting | None
    identity: DriveIdentity
    by: str

    @property
    def sure(self) -> Certainty:
        """Certainty of the identity: identified, likely, unknown."""
        if self.identity.profile is not None:
            return "identified"
        return "likely" if self.identity.candidates else "unknown"


@dataclass(frozen=True, slots=True)
class Progress:
    """Progress of a search."""

    setting: LineSetting | None
    requested: int
    of: int
    found: int
    left: float
    """Remaining seconds if no further drive answers."""
    settings_left: int = 0

    @property
    def text(self) -> str:
        """In one line."""
        text = _PROGRESS[self.setting is not None, bool(self.settings_left)]
        settings = counted(self.settings_left, "1 more setting", "{count} more settings")
        if self.requested >= self.of and not self.settings_left:
            text = _LAST_PROGRESS[self.setting is not None]
        return text.format(
            setting=self.setting, at=self, settings=settings, left=max(1, round(self.left))
        )


_PROGRESS = {
    (True, True): "{setting}: {at.requested} of {at.of} asked, {at.found} found,"
    " {settings}, {left} s left",
    (True, False): "{setting}: {at.requested} of {at.of} asked, {at.found} found, {left} s left",
    (False, True): "{at.requested} of {at.of} asked, {at.found} found, {settings}, {left} s left",
    (False, False): "{at.requested} of {at.of} asked, {at.found} found, {left} s left",
}
"""By whether the settings of the line are known, and whether others follow."""
_LAST_PROGRESS = (
    "{at.requested} of {at.of} asked, {at.found} found",
    "{setting}: {at.requested} of {at.of} asked, {at.found} found",
)
"""By whether the settings of the line are known."""
_TAKEN = "The address is taken."
_TAKEN_TWICE = "The address is taken, perhaps twice."


class ScanTelling:
    """Reports on one search; a hit is printed immediately."""

    def __init__(self, line_text: str, *, as_json: bool) -> None:
        self._line = line_text
        self._as_json = as_json
        self._drawn = ""
        """The line of progress on the terminal."""
        self._on_terminal = sys.stderr.isatty()

    def families(self, found: Sequence[WatchingFamily]) -> None:
        """Report possible drives that react to lost polling, before the first request."""
        text = watching_text(found)
        if not text:
            return
        reported = f"{text} Drives found are polled until this command ends."
        if self._as_json:
            from ..documents.drive_documents import ScanFamiliesDocument, WatchingFamilyField

            rows = [
                WatchingFamilyField(profile=f.id, name=f.name, timeout=f.code, sure=f.sure)
                for f in found
            ]
            self._print(ScanFamiliesDocument(line=self._line, families=rows, text=reported))
        self.note(reported)

    def slow(self, settings: Sequence[LineSetting], seconds: float, text: str) -> None:
        """The likely settings are through; those that are left take long."""
        if self._as_json:
            from ..documents.drive_documents import LineSettingField, ScanSlowDocument

            rows = [LineSettingField(baud=item.baud, format=item.format) for item in settings]
            self._print(
                ScanSlowDocument(
                    line=self._line, settings=rows, seconds=round(seconds, 1), text=text
                )
            )
        self.note(text)

    def hit(self, hit: Hit) -> None:
        """A drive has answered."""
        if self._as_json:
            self._print(hit_document(self._line, hit))
            return
        self._clear()
        where = str(hit.setting) if hit.setting else ""
        say_row(HIT_COLUMNS, (str(hit.identity.device), where, hit_text(hit)))
        sys.stdout.flush()

    def unclear(self, setting: LineSetting | None, result: ScanResult) -> None:
        """Report bytes from an address that are not an answer."""
        if self._as_json:
            from ..documents.drive_documents import ScanUnclearDocument

            self._print(
                ScanUnclearDocument(
                    line=self._line,
                    device=result.device,
                    baud=setting.baud if setting else None,
                    format=setting.format if setting else None,
                    text=result.error,
                )
            )
        taken = _TAKEN if result.by == LEFT_ALONE else _TAKEN_TWICE
        self.note(f"{result.error} {taken}")

    def progress(self, progress: Progress) -> None:
        """Show the progress in one line that is overwritten; on a terminal only."""
        if not self._on_terminal:
            return
        width = get_terminal_size().columns - 1
        text = progress.text[:width]
        say_over(text, last=False, before=len(self._drawn))
        self._drawn = text

    def note(self, text: str) -> None:
        """Something to know, on standard error."""
        self._clear()
        say(f"drivepanel: {text}", err=True)

    def ended(self, document: Callable[[str], ScanEndDocument]) -> None:
        """Print the document of the end for the LINE, with --json; the caller says its text."""
        self._clear()
        if self._as_json:
            self._print(document(self._line))

    def _clear(self) -> None:
        """Take the line of progress away."""
        if self._drawn:
            say_over("", last=False, before=len(self._drawn))
            say_over("", last=False)
            self._drawn = ""

    def _print(self, document: Document) -> None:
        from ..shared.output import print_json

        self._clear()
        print_json(document, compact=True)


def hit_document(line_text: str, hit: Hit) -> ScanHitDocument:
    """A drive that answered."""
    from ..documents.drive_documents import ScanHitDocument

    who, setting = hit.identity, hit.setting
    return ScanHitDocument(
        line=line_text,
        device=who.device,
        baud=setting.baud if setting else None,
        format=setting.format if setting else None,
        vendor=who.vendor,
        reference=who.reference,
        version=who.version,
        name=who.name,
        profile=who.profile,
        candidates=list(who.candidates),
        sure=hit.sure,
        by=hit.by or None,
    )


def hit_text(hit: Hit) -> str:
    """Which drive it is, as far as it is known."""
    who = hit.identity
    names = {listing.id: (listing.name, listing.vendor) for listing in library.listings()}
    if hit.sure == "identified":
        parts = (names[who.profile or ""][0], who.reference, who.version_text, who.name)
        return plain("  ".join(part for part in parts if part))
    if hit.sure == "likely":
        fits = [names[candidate] for candidate in who.candidates]
        vendors = any_of([*dict.fromkeys(vendor for _, vendor in fits)])
        families = any_of([name for name, _ in fits])
        return plain(f"likely {vendors}: {families}")
    if stated := " ".join(part for part in (who.vendor, who.reference, who.version_text) if part):
        return plain(f"{stated}: no profile fits")
    return "answers, but does not identify itself"
