"""The question about a changed line: another adapter, or other drives, than before."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from .app_port import Panel

if TYPE_CHECKING:
    from tui.session.connect.known_line import KnownLine

    from .dialogs.confirm import Confirm

QUESTION = "Is this the right line?"
FOLLOWS = (
    "Until you confirm, the line is read-only: values are shown, and only stops are written to"
    " its drives."
)
UNCHANGED = "Nothing to accept: the line is unchanged."


class LineCheck(Panel):
    """Checks the open line regularly; asks once to confirm differences, and on request."""

    def __init__(self) -> None:
        super().__init__()
        self._waiting_for: tuple[str, ...] = ()
        """Differences in the last question."""
        self._line_question: Confirm | None = None
        """The last question."""
        self._connected_since: float | None = None

    def check_line(self) -> None:
        """Ask about differences, once no scan runs and no other question is open."""
        known = self._known()
        if known is None:
            self._waiting_for, self._connected_since = (), None
            return
        self._look_again(known)
        self._ask_again_if_hidden()
        if not known.changed:
            self._waiting_for = ()
        elif set(known.changed) - {*self._waiting_for} and not self._is_busy():
            self._ask(known, by_itself=True)

    def action_accept_line(self) -> None:
        """Ask again if this is the right line."""
        known = self._known()
        if known is None or not known.changed:
            self.tell(UNCHANGED)
        else:
            self._ask(known)

    def _known(self) -> KnownLine | None:
        return self.opened.known if self.opened is not None else None

    def _is_busy(self) -> bool:
        search = self.fleet.search if self.fleet is not None else None
        searching = search is not None and search.goes_on
        return self.screen.is_modal or self._is_opening() or (searching and self.chosen is None)

    def _is_opening(self) -> bool:
        """True until Monitor replaces the first screen and everything above it."""
        from .opening import OpeningScreen

        return any(isinstance(screen, OpeningScreen) for screen in self.screen_stack)

    def _ask_again_if_hidden(self) -> None:
        """Ask again if a screen replaced the question, or covers it, before it was answered."""
        question = self._line_question
        if question is None or question.is_answered or question is self.screen:
            return
        if self.screen.is_modal:
            return
        question.void()  # so that it does not reappear when the cover is closed
        self._waiting_for, self._line_question = (), None

    def _look_again(self, known: KnownLine) -> None:
        """Check the adapter after a reconnection: it may be another one."""
        assert self.opened is not None
        state = self.opened.line.state
        if state.status.value != "connected":
            return
        before, self._connected_since = self._connected_since, state.since
        if before not in (None, state.since):
            threading.Thread(target=known.look, name="line check", daemon=True).start()

    def _ask(self, known: KnownLine, *, by_itself: bool = False) -> None:
        from .dialogs.confirm import Confirm

        self._waiting_for = changed = known.changed
        self.events.add("alarm", " ".join(changed))

        def reported(sure: bool | None) -> None:
            if sure and known.changed == changed:
                # in a thread: the disk may hang, and the line is written to at once
                threading.Thread(target=known.accept, name="line check", daemon=True).start()
            elif sure:
                self._waiting_for = ()  # more differences since: ask about all of them

        requested = Confirm(
            QUESTION,
            "\n".join((*changed, FOLLOWS)),
            yes="Confirm",
            no="Keep read-only",
            loses=True,
            by_itself=by_itself,
        )
        self._line_question = requested
        self.push_screen(requested, reported)
