"""What a person reads when an error of the panel itself ends it: a line, and no traceback."""

from __future__ import annotations

from abc import abstractmethod

from rich.text import Text
from textual.app import App


class LastWords(App[None]):
    """An app that tells of an error of its own in words; Textual's traceback is not shown."""

    @abstractmethod
    def last_words(self, error: Exception) -> str:
        """What a person is told once the screen is left; here the log gets all of it."""

    def _handle_exception(self, error: Exception) -> None:
        words = self.last_words(error)
        super()._handle_exception(error)
        self._exit_renderables[:] = [Text(words)]
