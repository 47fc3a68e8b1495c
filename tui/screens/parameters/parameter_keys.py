"""Common parts of the keys of the Parameters screen: the list, the editor, messages."""

from __future__ import annotations

from textual.widgets import Input

from tui.session.console import DriveConsole
from tui.session.settings.editor import Editor
from tui.widgets.fields import WordField

from ..command.teaching import TeachKeys
from .parameter_list import ParameterList


class ParameterKeys(TeachKeys):
    """The base of the keys that stage, write and handle parameter sets."""

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self.session = console.session
        self.listed = ParameterList()
        self.reading = ""
        """Progress of reading for a file or a comparison; empty without one."""

    @property
    def editor(self) -> Editor:
        """Known values and staged edits; stays with the drive while the panel runs."""
        return self.console.editor

    def list_again(self) -> None:
        """Fill the list again, for the present choice and search."""
        for search in self.query(WordField):  # none once the screen was left
            self.listed.fill(self.editor, search.words)
            self.look()

    def clear_search(self) -> None:
        """Clear the search, and show the chosen group or selection."""
        for search in self.query("#search").results(Input):
            with search.prevent(Input.Changed):
                search.value = ""
        self.list_again()

    def note(self, text: str, keys: str = "") -> None:
        """Report the result of a key, and the next `keys` on this screen."""
        self._add("told", text)
        if keys:
            self.hint_keys(keys)

    def _refuse(self, text: str) -> None:
        """Report why something was not done."""
        self._add("refused", text)

    def _add(self, kind: str, text: str) -> None:
        if text:
            self.app.events.add(kind, text, self.session.device)
        self.look()
