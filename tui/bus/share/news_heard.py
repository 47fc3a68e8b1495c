"""The news of a line as a client hears them from its owner."""

from __future__ import annotations

from ..errors import LineError
from ..model import LineState, LineStatus
from ..schedule.inside import LineInside, Say
from ..trace import Frame
from .carried import error_of
from .messages import News


class NewsHeard:
    """Keeps this program's picture of the line as its owner describes it; in the line's loop."""

    def __init__(self, inside: LineInside, say: Say) -> None:
        self.note = ""
        """Added to the state of a connected line, after a space."""
        self._inside = inside
        self._say = say
        self._state: LineState | None = None
        self._failure: LineError | None = None

    def hear(self, news: News) -> None:
        """Take the news over."""
        inside = self._inside
        for device, state in news.devices.items():
            inside.devices.copy(device, state)
        inside.around.tally.copy(news.counters, news.counted)
        inside.pace.others, inside.pace.stretch = news.shares, news.stretch
        for frame in news.frames:
            inside.around.trace.append(Frame(*frame))
        if news.state != self._state:
            self._state = news.state
            self._failure = error_of(*news.failure) if news.failure is not None else None
            self.tell_state()

    def tell_state(self) -> None:
        """Give the line the state that the owner named last."""
        if self._state is not None:
            connected = self._state.status is LineStatus.CONNECTED
            reason = self._shared_with() if connected else self._state.reason
            self._say(self._state.status, reason, self._failure)

    def _shared_with(self) -> str:
        """The programs that share the line, and its settings if others were meant."""
        names = ", ".join(other.text for other in self._inside.facts.others)
        return f"{f'Shared with {names}.' if names else ''}{self.note}".strip()
