"""Wiring: warnings, waiting time, pins, rules, addresses, LEDs, command words, errata."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.events import ScreenResume

from tui.bus.errors import LineError
from tui.drive.family_page import PageLine, PageRow, PageSection, family_page, page_lines
from tui.drive.model import model_codes, model_read
from tui.drive.plain import plain
from tui.drive.profile.profile import Profile
from tui.session.console import DriveConsole
from tui.widgets.drawing import rule
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, FAINT, PLAIN, STRONG

from ..base import PanelScreen
from ..keys.action import WIRING
from ..keys.table import bindings

if TYPE_CHECKING:
    from tui.session.diagnosis.diagnosis import Diagnosis


def trouble_sections(found: Diagnosis | None, wall: float) -> list[PageSection]:
    """The diagnosis with its next steps, made at this time; empty if the drive answers well."""
    if found is None or found.well:
        return []
    rows = [PageRow("!", found.text, warns=True)]
    if found.others:
        rows.append(PageRow("Certainty", f"{found.certainty}. It could also be:"))
        rows += [PageRow("", other) for other in found.others]
    heads = ["Next steps", *("" for _ in found.steps)]
    rows += [PageRow(head, step) for head, step in zip(heads, found.steps, strict=False)]
    at = time.strftime("%H:%M:%S", time.localtime(wall))
    return [PageSection(f"Trouble, measured at {at}", tuple(rows))]


def wiring_lines(page: Sequence[PageLine]) -> list[Text]:
    """The lines of a page with their colors: amber for warnings, else gray."""
    return [_line(line) for line in page]


def _line(line: PageLine) -> Text:
    if line.kind == "title":
        return Text(f" {line.head}", STRONG, no_wrap=True)
    text = Text(line.head, FAINT, no_wrap=True)
    if line.kind == "warning":
        text.stylize(ALARM)
    text.append(line.text, PLAIN)
    return text


def section_tops(page: Sequence[PageLine]) -> list[int]:
    """Return the first line of each section."""
    return [number for number, line in enumerate(page) if line.kind == "title"]


class WiringScreen(PanelScreen):
    """A page that scrolls; it reads only the model from the drive."""

    CSS_PATH = "wiring.tcss"
    BINDINGS: ClassVar = bindings(WIRING)
    TITLE = "Wiring"

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self._profile: Profile = console.session.profile
        self._sections = family_page(self._profile)
        self._page: list[PageLine] = []
        self._drawn: tuple[int, float] = (0, 0.0)
        """Width of the page, and the time of the diagnosis on it."""
        self._model = ""
        self._top = 0

    def body(self) -> ComposeResult:
        """Title and page."""
        yield Lines(id="title")
        yield Lines(id="page")

    def on_mount(self) -> None:
        """Read the drive's model, once."""
        self.run_worker(self._ask_model(), group="model")

    def on_screen_resume(self, event: ScreenResume) -> None:
        """Show the result of a diagnosis (N), whose dialog has closed."""
        super().on_screen_resume(event)
        self.call_after_refresh(self.look)

    async def _ask_model(self) -> None:
        codes = model_codes(self._profile)
        if not codes:
            return
        try:
            found = await self.console.read(codes)
        except LineError:
            return  # the status bar shows a lost line; the page works without the model
        raws = {code: reading.raw for code, reading in found.items() if reading.raw is not None}
        self._model = model_read(self._profile, raws)
        self.look()

    def draw(self, width: int) -> None:
        """Show the page from the scroll position on."""
        super().draw(width)
        at = self.console.diagnosed_at
        if (width, at) != self._drawn:
            if at != self._drawn[1]:
                self._top = 0
            found = trouble_sections(self.console.diagnosis, at)
            self._page = page_lines([*found, *self._sections], width - 1)
            self._drawn = width, at
        room = self._room()
        self._top = max(0, min(self._top, len(self._page) - room))
        named = f"{self._profile.vendor} {self._profile.name}"
        here = f"{self._top + 1} to {min(len(self._page), self._top + room)} of {len(self._page)}"
        title = plain(f"{named}: {self._model}" if self._model else named)
        self.put("title", [rule(title, width, here)])
        self.put("page", wiring_lines(self._page[self._top : self._top + room]))

    def _room(self) -> int:
        return max(1, self.query_one("#page", Lines).size.height)

    def action_scroll(self, lines: int) -> None:
        """Scroll by so many lines; negative is up."""
        self._top = max(0, self._top + lines)
        self.look()

    def action_page(self, pages: int) -> None:
        """Scroll by so many screens, less one line each."""
        self.action_scroll(pages * max(1, self._room() - 1))

    def action_section(self, step: int) -> None:
        """Go to the beginning of the next or the previous section."""
        tops = section_tops(self._page)
        after = [top for top in tops if top > self._top]
        before = [top for top in tops if top < self._top]
        if step > 0 and after:
            self._top = after[0]
        elif step < 0 and before:
            self._top = before[-1]
        self.look()
