"""A dialog that lists the files that can be opened, newest first."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from rich.style import Style
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.widgets import OptionList

from tui.drive.plain import plain
from tui.session.settings.backups import SUFFIX, files_in
from tui.widgets.drawing import cut
from tui.widgets.palette import ALARM, FAINT, PLAIN
from tui.widgets.plain import Plain, entry

from .question import KeyQuestion, hint

NAME_WIDTH, DRIVE_WIDTH, ABOUT_WIDTH = 24, 15, 14
"""Columns of name, drive and comparison; date and time are between name and drive."""


@dataclass(frozen=True, slots=True)
class FileAbout:
    """Kind of a file, found by reading it."""

    drive: str = ""
    reported: str = ""
    """Comparison with the open drive, in two or three words."""
    alarm: bool = False
    """True if it is of another family, or invalid."""


FileReader = Callable[[Path], FileAbout]
"""Reads a file; called in a thread, as a disk may hang."""


class PickFile(KeyQuestion[str | None]):
    """Answers with the chosen file, or the id of another choice; opening changes nothing."""

    BINDINGS: ClassVar = [Binding("enter", "pick", show=False)]

    def __init__(
        self,
        question: str,
        others: Sequence[tuple[str, str]],
        folders: Iterable[Path],
        about: FileReader | None = None,
    ) -> None:
        """`others` are choices besides files: the answer, and its text.

        With `about` each file is read after the list is shown, one after another, newest first.
        """
        super().__init__()
        self._question = question
        self._found = [*files_in(folders)]
        self._about = about
        self._others = [Text(f" {text}", PLAIN) for _, text in others]
        self._answers = [answer for answer, _ in others] + [str(path) for path in self._found]

    def dialog(self) -> ComposeResult:
        """The list and its keys."""
        waiting = FileAbout(reported="...") if self._about is not None else FileAbout()
        lines = [*self._others, *(file_line(path, waiting) for path in self._found)]
        with Vertical(id="dialog"):
            yield Plain(self._question, id="question")
            entries = (entry(line, id=str(at)) for at, line in enumerate(lines))
            yield OptionList(*entries, id="choices", compact=True)
            if not self._found:
                yield Plain(f"No {SUFFIX} file in this folder or in the backup folder.")
            yield Plain(hint(("Enter", "Open"), ("Esc or q", "Cancel")), id="hint")

    def on_mount(self) -> None:
        """Select the newest file, and start reading the files."""
        if self._found:
            self.query_one(OptionList).highlighted = len(self._others)
        if self._about is not None:
            self.run_worker(self._tell_files(self._about), exclusive=True)

    async def _tell_files(self, about: FileReader) -> None:
        for at, path in enumerate(self._found, start=len(self._others)):
            reported = await asyncio.to_thread(about, path)
            for options in self.query("#choices").results(OptionList):
                options.replace_option_prompt_at_index(at, file_line(path, reported))

    def on_option_list_option_selected(self) -> None:
        """Answer on Enter in the list."""
        self.action_pick()

    def action_pick(self) -> None:
        """Answer with the selected entry."""
        at = self.query_one(OptionList).highlighted
        if at is not None:
            self.answer(self._answers[at])


def file_line(path: Path, about: FileAbout) -> Text:
    """A file with its date, its drive and its comparison."""
    text = Text(f" {cut(plain(path.name), NAME_WIDTH)} ", PLAIN, no_wrap=True)
    try:
        when = time.strftime("%Y-%m-%d %H:%M", time.localtime(path.stat().st_mtime))
    except OSError:
        when = ""
    text.append(f"{when:<16} ", FAINT)
    style: Style = ALARM if about.alarm else PLAIN
    text.append(f"{cut(about.drive, DRIVE_WIDTH)} ", FAINT)
    text.append(cut(about.reported, ABOUT_WIDTH), style)
    return text
