"""Why a drive does not answer: one sentence, and below it what to look at next."""

from __future__ import annotations

import logging
from collections.abc import Awaitable, Callable, Iterable, Iterator
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll
from textual.events import Resize
from textual.screen import ModalScreen
from textual.worker import Worker, WorkerState

from tui.widgets.drawing import wrapped
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, FAINT, PLAIN, RUNNING, STRONG
from tui.widgets.plain import Plain

from ..frame import Framed
from .question import hint

if TYPE_CHECKING:
    from tui.session.diagnosis.diagnosis import Diagnosis

log = logging.getLogger(__name__)

WHY_WIDTH, BESIDE_WHY = 76, 6
"""Columns of the dialog at most, and those of its border, its margin and its scroll bar."""
SENTENCE_ROWS = 12
LOOKING = "Listening, then reading the drive: 5 to 15 s, up to 30 s on a sick line ..."
BULLET = "· "
WHY_KEYS = hint(("Esc", "Close"), ("N", "Repeat"), ("Up, Down", "Scroll"))

LooksWhy = Callable[[], Awaitable["Diagnosis"]]


class WhyScreen(Framed, ModalScreen[None]):
    """Results of a diagnosis; `look` runs when the screen opens, and again at N."""

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
        """Look at once."""
        self.action_again()

    def on_resize(self, _: Resize) -> None:
        """Break the lines again."""
        if not self.is_too_small:
            self._show()

    def action_again(self) -> None:
        """Look once more."""
        self._found = None
        self._show()
        self.run_worker(self._ask(), exclusive=True, group="why", exit_on_error=False)

    def on_worker_state_changed(self, event: Worker.StateChanged) -> None:
        """An error that nobody foresaw ends the question, and not the panel."""
        if event.state is WorkerState.ERROR:
            log.error("looking for why failed", exc_info=event.worker.error)
            self.app.events.add("error", f"The panel failed at this: {event.worker.error}")
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
        yield Text(LOOKING, FAINT)
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
