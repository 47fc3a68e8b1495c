"""Asking about a line that is not as it was: another adapter, or other drives, than before."""

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
AS_IT_WAS = "There is nothing to accept: the line is as it was."


class LineCheck(Panel):
    """Looks at the open line now and then; differences are confirmed once, and on demand."""

    def __init__(self) -> None:
        super().__init__()
        self._waiting_for: tuple[str, ...] = ()
        """Differences in the last question."""
        self._line_question: Confirm | None = None
        """The last question of that."""
        self._connected_since: float | None = None

    def mind_line(self) -> None:
        """Ask about differences, once no search runs and no other question is open."""
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
        """Ask again whether the line is meant as it is now."""
        known = self._known()
        if known is None or not known.changed:
            self.tell(AS_IT_WAS)
        else:
            self._ask(known)

    def _known(self) -> KnownLine | None:
        return self.opened.known if self.opened is not None else None

    def _is_busy(self) -> bool:
        search = self.fleet.search if self.fleet is not None else None
        searching = search is not None and search.goes_on
        return self.screen.is_modal or self._is_opening() or (searching and self.chosen is None)

    def _is_opening(self) -> bool:
        """True until Monitor replaces the first picture, and all that is above it."""
        from .opening import OpeningScreen

        return any(isinstance(screen, OpeningScreen) for screen in self.screen_stack)

    def _ask_again_if_hidden(self) -> None:
        """A screen may have replaced the question, or cover it; nobody has answered it then."""
        question = self._line_question
        if question is None or question.is_answered or question is self.screen:
            return
        if self.screen.is_modal:
            return
        question.void()  # nothing is asked twice by a way back to it
        self._waiting_for, self._line_question = (), None

    def _look_again(self, known: KnownLine) -> None:
        """A line that was lost may have come back with another adapter."""
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
                self._waiting_for = ()  # more has come meanwhile: all of it is asked

        requested = Confirm(
            QUESTION,
            "\n".join((*changed, FOLLOWS)),
            yes="Accept",
            no="Keep read-only",
            loses=True,
            by_itself=by_itself,
        )
        self._line_question = requested
        self.push_screen(requested, reported)
