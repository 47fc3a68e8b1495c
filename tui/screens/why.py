"""The diagnosis of a drive that does not answer: its key, and its dialog."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterable, Iterator
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll
from textual.events import Resize
from textual.screen import ModalScreen
from textual.worker import Worker, WorkerState

from tui.bus.errors import LinkSyntaxError
from tui.bus.link import parse_link
from tui.widgets.drawing import wrapped
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, FAINT, PLAIN, RUNNING, STRONG
from tui.widgets.plain import Plain

from .dialogs.question import hint
from .dialogs.why_target import WhyTarget
from .frame import Framed

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile
    from tui.session.console import DriveConsole
    from tui.session.diagnosis.diagnosis import Diagnosis

    from .app_port import Panel

log = logging.getLogger(__name__)

WHY_WIDTH, BESIDE_WHY = 76, 6
"""Columns of the dialog at most, and those of its border, its margin and its scroll bar."""
SENTENCE_ROWS = 12
LOOKING = "Listening, then reading the drive: 5 to 15 s, up to 30 s on a poor line ..."
BULLET = "· "
WHY_KEYS = hint(("Esc", "Close"), ("N", "Repeat"), ("Up, Down", "Scroll"))

LooksWhy = Callable[[], Awaitable["Diagnosis"]]


class WhyScreen(Framed, ModalScreen[None]):
    """The result of a diagnosis; `look` runs when the dialog opens, and again at N."""

    CSS_PATH = "why.tcss"
    BINDINGS: ClassVar = [
        Binding("escape,q", "dismiss(None)", "close", show=False),
        Binding("N", "again", "again", show=False),
    ]

    def __init__(self, about: str, look: LooksWhy) -> None:
        super().__init__()
        self._about = about
        self._look = look
        self._found: Diagnosis | None = None

    def compose(self) -> ComposeResult:
        """The frame, and the lines."""
        yield from self.framed()
        with Vertical(id="why"):
            yield Lines(id="asked")
            with VerticalScroll(id="says"):
                yield Lines(id="reasons")
            yield Plain(WHY_KEYS, id="hint")

    def on_mount(self) -> None:
        """Start the diagnosis."""
        self.action_again()

    def on_resize(self, _: Resize) -> None:
        """Break the lines again."""
        if not self.is_too_small:
            self._show()

    def action_again(self) -> None:
        """Repeat the diagnosis."""
        self._found = None
        self._show()
        self.run_worker(self._ask(), exclusive=True, group="why", exit_on_error=False)

    def on_worker_state_changed(self, event: Worker.StateChanged) -> None:
        """Report an unexpected error; it closes the dialog, but not the panel."""
        if event.state is WorkerState.ERROR:
            log.error("looking for why failed", exc_info=event.worker.error)
            self.app.events.add("error", f"Internal error: {event.worker.error}")
            self.dismiss(None)

    async def _ask(self) -> None:
        self._found = found = await self._look()
        self.app.events.add("done" if found.well else "alarm", found.text)
        self._show()

    def _show(self) -> None:
        width = min(WHY_WIDTH, self.app.size.width) - BESIDE_WHY
        parts = {
            "asked": [Text(part, STRONG) for part in wrapped(self._about, width, 2)],
            "reasons": list(reason_lines(self._found, width)),
        }
        for place, lines in parts.items():
            for shown in self.query(f"#{place}").results(Lines):
                shown.show(lines)


def reason_lines(found: Diagnosis | None, width: int) -> Iterator[Text]:
    """Yield the failed check and the next steps, in lines; None: no result yet."""
    if found is None:
        yield from (Text(part, FAINT) for part in wrapped(LOOKING, width, 2))
        return
    style = RUNNING if found.well else ALARM
    yield from (Text(part, style) for part in wrapped(found.text, width, SENTENCE_ROWS))
    if found.others:
        yield from _listed(f"This is {found.certainty}. It could also be:", found.others, width)
    if found.steps:
        yield from _listed("Next steps", found.steps, width)


def _listed(head: str, items: Iterable[str], width: int) -> Iterator[Text]:
    yield Text("")
    yield Text(head, STRONG)
    for step in items:
        for number, part in enumerate(wrapped(step, width - len(BULLET), SENTENCE_ROWS)):
            yield Text("  " if number else BULLET, FAINT).append(part, PLAIN)


def ask_why(app: Panel) -> None:
    """Diagnose the drive selected on Line, else the open one, and show the failed check."""
    intended = getattr(app.screen, "why_target_now", None)
    target: WhyTarget | None = intended() if intended is not None else _open_drive(app)
    if target is None:
        app.tell("No drive is chosen. Choose a line, or a drive, on Line.")
        return
    if target.opened is None:
        try:
            parse_link(target.text)
        except LinkSyntaxError:
            app.tell("This line is not open. Press Enter to open it, then N to diagnose.")
            return

    label = target.opened.label if target.opened is not None else target.text
    about = f"Why no answer? Address {target.device} on {label}"
    app.push_screen(WhyScreen(about, partial(_kept, app, target)))


def _open_drive(app: Panel) -> WhyTarget | None:
    """The drive of the screen on top, else the open one."""
    console: DriveConsole | None = getattr(app.screen, "console", None) or app.chosen
    if console is None or app.opened is None:
        return None
    session, found = console.session, app.fleet.found if app.fleet is not None else {}
    return WhyTarget(
        app.opened.text,
        session.device,
        app.opened,
        session.profile.id,
        tuple(number for number in found if number != session.device),
    )


async def _kept(app: Panel, target: WhyTarget) -> Diagnosis:
    """Diagnose, and store the result for the drive's Wiring page."""
    found = await _looked(target)
    fleet = app.fleet
    console = fleet.console(target.device) if fleet is not None else None
    if target.opened is not None and target.opened is app.opened and console is not None:
        console.diagnosis, console.diagnosed_at = found, app.clock.wall()
    return found


async def _looked(target: WhyTarget) -> Diagnosis:
    """Collect the evidence, and find the check that fails."""
    from tui.session.diagnosis.asking import evidence_of_port, profile_remembered
    from tui.session.diagnosis.diagnosis import diagnosed
    from tui.session.diagnosis.examining import examine_line

    opened = target.opened
    link = opened.line.link if opened is not None else parse_link(target.text)
    profile = await asyncio.to_thread(_profile, target)
    profile = profile or await asyncio.to_thread(profile_remembered, link, target.device)
    if opened is None:
        seen = await asyncio.to_thread(evidence_of_port, link, target.device, target.trouble)
        return diagnosed(replace(seen, profile=profile))
    line = opened.line
    answer = [neighbor for neighbor in target.neighbors if line.device_state(neighbor).answers]
    changed = opened.known.text if opened.known is not None else ""
    return diagnosed(
        await examine_line(line, target.device, profile, changed=changed, answering=answer)
    )


def _profile(target: WhyTarget) -> Profile | None:
    from tui.drive.errors import DriveError
    from tui.drive.profile import library

    try:
        return library.load(target.profile) if target.profile else None
    except DriveError:
        return None  # Line has reported it
