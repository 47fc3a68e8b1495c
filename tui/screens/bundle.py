"""The bundle of a line: the action that makes it, its progress, and its result."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterator
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from rich.style import Style
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll
from textual.events import Resize
from textual.screen import ModalScreen
from textual.worker import Worker, WorkerState

from tui.bus.errors import LineError, LinkSyntaxError
from tui.bus.link import Link, parse_link
from tui.drive.errors import DriveError
from tui.session.paths import state_folder
from tui.terminal.lean import screen_text
from tui.widgets.drawing import wrapped
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, ATTENTION, FAINT, PLAIN, STRONG
from tui.widgets.plain import Plain

from .dialogs.ask import Ask, fault_of_new
from .dialogs.question import hint
from .frame import Framed

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile
    from tui.session.bundle.parts import PartProgress
    from tui.session.bundle.subject import BundleSubject
    from tui.session.bundle.work import Bundle
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession
    from tui.session.fleet import Fleet

    from .app_port import Panel

log = logging.getLogger(__name__)

BUNDLE_WIDTH, BESIDE_BUNDLE = 76, 6
"""Columns of the dialog at most, and those of its border, its margin and its scroll bar."""
BUNDLE_ROWS = 6
"""Rows of one sentence at most."""
CANCELLED = "Bundle canceled. No file was written."
COLLECTING_KEYS = hint(("Esc", "Cancel"))
FINISHED_KEYS = hint(("Esc", "Close"), ("Up, Down", "Scroll"))

MakesBundle = Callable[["PartProgress"], Awaitable["Bundle"]]


class BundleScreen(Framed, ModalScreen[None]):
    """Collects a bundle and writes it to a file; Esc cancels that, or closes the result."""

    CSS_PATH = "bundle.tcss"
    BINDINGS: ClassVar = [Binding("escape,q", "end", "end", show=False)]

    def __init__(self, path: Path, make: MakesBundle) -> None:
        super().__init__()
        self._path = path
        self._make = make
        self._work: Worker[None] | None = None
        self._step: tuple[int, int, str] = (0, 0, "")
        self._bundle: Bundle | None = None
        self._trouble = ""

    def compose(self) -> ComposeResult:
        """The frame, and the lines."""
        yield from self.framed()
        with Vertical(id="bundle"):
            yield Lines(id="about")
            with VerticalScroll(id="says"):
                yield Lines(id="progress")
            yield Plain(COLLECTING_KEYS, id="hint")

    def on_mount(self) -> None:
        """Start collecting."""
        self._show()
        self._work = self.run_worker(self._collect(), group="bundle", exit_on_error=False)

    def on_resize(self, _: Resize) -> None:
        """Break the lines for the new width."""
        if not self.is_too_small:
            self._show()

    def action_end(self) -> None:
        """Cancel, or close the result."""
        if self._work is not None and not self._work.is_finished:
            self._work.cancel()
            self.app.tell(CANCELLED)
        self.dismiss(None)

    def on_worker_state_changed(self, event: Worker.StateChanged) -> None:
        """Report an unexpected error; it ends the bundle, but not the panel."""
        if event.state is WorkerState.ERROR:
            log.error("making a bundle failed", exc_info=event.worker.error)
            self.app.events.add("error", f"The bundle failed: {event.worker.error}")
            self.dismiss(None)

    async def _collect(self) -> None:
        from tui.drive.settings.set_file import write_file

        made = await self._make(self._note)
        try:
            self._path.parent.mkdir(parents=True, exist_ok=True)
            await asyncio.to_thread(write_file, self._path, made.data, private=True)
        except (OSError, DriveError) as error:
            self._trouble = f"Not saved: {error}"
            self.app.events.add("failed", self._trouble)
        else:
            self._bundle = made
            self.app.events.add("done", f"Saved: bundle of {len(made.files)} files in {self._path}")
        for keys in self.query("#hint").results(Plain):
            keys.update(FINISHED_KEYS)
        self._show()

    def _note(self, done: int, of: int, name: str) -> None:
        self._step = done, of, name
        self._show()

    def _show(self) -> None:
        width = min(BUNDLE_WIDTH, self.app.size.width) - BESIDE_BUNDLE
        about = [Text("Bundle for a colleague", STRONG)]
        for place, lines in {"about": about, "progress": list(self._lines(width))}.items():
            for shown in self.query(f"#{place}").results(Lines):
                shown.show(lines)

    def _lines(self, width: int) -> Iterator[Text]:
        if self._trouble:
            yield from _sentence(self._trouble, width, ALARM)
        elif self._bundle is None:
            done, of, name = self._step
            count = f"Collecting {done + 1} of {of}: {name}" if name else "Packing the zip."
            yield from _sentence(count, width, ATTENTION)
            yield from _sentence("Nothing is written to any drive.", width, FAINT)
        else:
            yield from result_lines(self._bundle, self._path, width)


def result_lines(bundle: Bundle, path: Path, width: int) -> Iterator[Text]:
    """The path of the file, its missing parts with their reasons, and what to do next."""
    yield from _sentence(f"Saved {len(bundle.files)} files in", width, PLAIN)
    yield from _sentence(str(path), width, STRONG)
    if bundle.missing:
        yield Text("")
        yield Text("Not collected", ALARM)
    for name, why in bundle.missing.items():
        yield from _sentence(f"{name}: {why}", width, PLAIN)
    yield Text("")
    last = "Its README.txt explains each file. Check the contents before you send it."
    yield from _sentence(last, width, FAINT)


def _sentence(text: str, width: int, style: Style) -> Iterator[Text]:
    yield from (Text(part, style) for part in wrapped(text, width, BUNDLE_ROWS))


NO_LINE_CHOSEN = "Choose a line on Line first. A simulated line must be open for a bundle."
ABOUT_BUNDLE = (
    "Port, diagnosis, frames, settings, journal, log and screens of this line. User names, host"
    " names and passwords are omitted. Drives are only read."
)


def ask_bundle(app: Panel) -> None:
    """Ask for the name of the file, then collect its contents."""
    find_target = getattr(app.screen, "why_target_now", None)
    target = find_target() if find_target is not None else None
    opened = target.opened if target is not None else app.opened
    text = target.text if target is not None else app.line_text
    try:
        link = opened.line.link if opened is not None else parse_link(text) if text else None
    except LinkSyntaxError:
        link = None
    if link is None:
        app.tell(NO_LINE_CHOSEN)
        return
    trouble = target.trouble if target is not None else None
    subject = partial(_subject, app, text, link, opened, trouble, _screens(app))
    from tui.session.bundle.subject import bundle_name

    simulated = opened is not None and not opened.is_real
    stem = bundle_name(None if simulated else link, datetime.fromtimestamp(app.panel_clock.wall()))
    dialog = Ask(
        "Save the bundle as",
        fault_of_new,
        text=str(state_folder() / f"{stem}.zip"),
        about=ABOUT_BUNDLE,
        takes="Make the bundle",
    )

    def answered(answer: str | None) -> None:

        if answer:
            path = Path(answer).expanduser()
            app.push_screen(BundleScreen(path, partial(_made, subject(), stem)))

    app.push_screen(dialog, answered)


async def _made(subject: BundleSubject, stem: str, progress: PartProgress) -> Bundle:
    from tui.session.bundle.work import make_bundle

    return await make_bundle(subject, stem, progress)


def _screens(app: Panel) -> dict[str, str]:
    """The screens below dialogs as text, by name, the lowest first."""
    return {
        str(screen.TITLE).lower(): screen_text(screen)
        for screen in app.screen_stack
        if screen.TITLE and not screen.is_modal
    }


def _subject(
    app: Panel,
    text: str,
    link: Link,
    opened: OpenLine | None,
    trouble: LineError | None,
    screens: dict[str, str],
) -> BundleSubject:
    from tui.session.bundle.line_parts import remembered_devices
    from tui.session.bundle.parts import Missing
    from tui.session.bundle.subject import BundleSubject
    from tui.session.diagnosis.asking import profile_remembered

    here = app.open_line_of(text)
    fleet: Fleet | None = here.fleet if here is not None else None

    def expected(device: int) -> Profile | None:
        console = fleet.console(device) if fleet is not None else None
        return console.session.profile if console else profile_remembered(link, device)

    async def open_drive(device: int) -> DriveSession:
        console = fleet.console(device) if fleet is not None else None
        if console is None:
            raise Missing(f"The panel has not identified drive {device}.")
        return console.session

    found = tuple(fleet.found) if fleet is not None else ()
    return BundleSubject(
        text=text,
        link=link,
        opened=opened,
        trouble=trouble,
        devices=found or remembered_devices(link) or (1,),
        open_drive=open_drive,
        documents=app.drive_documents(),
        expected_profile=expected,
        events=app.events.events,
        screens=screens,
    )
