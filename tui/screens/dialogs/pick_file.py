"""A list of the files that can be opened here, newest first: no name has to be typed."""

from __future__ import annotations

import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.widgets import OptionList

from tui.drive.plain import plain
from tui.widgets.drawing import short
from tui.widgets.palette import FAINT, PLAIN
from tui.widgets.plain import Plain, entry

from .question import KeyQuestion, hint

FILES_LISTED = 200
"""Files that are listed at most, the newest."""
WIDTH = 60
SUFFIX = ".toml"


class PickFile(KeyQuestion[str | None]):
    """Gives the chosen file back, or the name of another choice; opening changes nothing."""

    BINDINGS: ClassVar = [Binding("enter", "pick", show=False)]

    def __init__(self, question: str, others: Sequence[tuple[str, str]], folders: Iterable[Path]):
        """`others` are choices beside files: the answer, and how it reads."""
        super().__init__()
        self._question = question
        found = [*files_in(folders)]
        self._answers = [answer for answer, _ in others] + [str(path) for path in found]
        self._lines = [Text(f" {text}", PLAIN) for _, text in others]
        self._lines += [_line(path) for path in found]
        self._files = len(found)

    def dialog(self) -> ComposeResult:
        """The list and its keys."""
        with Vertical(id="dialog"):
            yield Plain(self._question, id="question")
            entries = (entry(line, id=str(at)) for at, line in enumerate(self._lines))
            yield OptionList(*entries, id="choices", compact=True)
            if not self._files:
                yield Plain(f"No {SUFFIX} file in this folder, nor where backups are kept.")
            yield Plain(hint(("Enter", "opens it"), ("Esc or q", "opens nothing")), id="hint")

    def on_option_list_option_selected(self) -> None:
        """Enter in the list."""
        self.action_pick()

    def action_pick(self) -> None:
        """Give the choice back."""
        at = self.query_one(OptionList).highlighted
        if at is not None:
            self.answer(self._answers[at])


def files_in(folders: Iterable[Path]) -> list[Path]:
    """The files of some folders that may be opened, the newest first; none is read."""
    found: dict[Path, float] = {}
    for folder in folders:
        try:
            for path in folder.iterdir():
                if path.suffix == SUFFIX and path.is_file():
                    found[path] = path.stat().st_mtime
        except OSError:
            continue
    return sorted(found, key=lambda path: -found[path])[:FILES_LISTED]


def _line(path: Path) -> Text:
    text = Text(f" {short(plain(path.name), WIDTH - 20):<{WIDTH - 20}}", PLAIN, no_wrap=True)
    try:
        when = time.strftime("%Y-%m-%d %H:%M", time.localtime(path.stat().st_mtime))
    except OSError:
        when = ""
    text.append(f" {when}", FAINT)
    return text
