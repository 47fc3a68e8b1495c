"""Dialog that chooses a parameter: a list that filters while typing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.events import Resize
from textual.widgets import Input, OptionList

from tui.drive.blocks.picking import choices
from tui.drive.profile.profile import Profile, is_verified
from tui.drive.profile.schema import Block, Parameter
from tui.widgets.drawing import fitted_names
from tui.widgets.fields import JOINS_KEY, WordField
from tui.widgets.palette import ALARM, FAINT, PLAIN, STRONG
from tui.widgets.plain import Plain, entry

from .question import Question, hint, matches_text

UNUSED_SLOT = " none      the slot is unused"
NO_WORD_HERE = " none      no word"
LISTED_MOST = 100
"""Parameters that are listed at most; a search shows the others."""
WIDEST = 92
"""Cells of the dialog at most: the longest names fit."""
BESIDE_NAME, AROUND = 29, 6
"""Cells of a line without its name, and of the dialog around a line."""
PICK_HINT = hint(("Up, Down", "Choose"), JOINS_KEY, ("Enter", "Stage"), ("Esc", "Cancel"))
WORD_HINT = hint(("Up, Down", "Choose"), JOINS_KEY, ("Enter", "Show"), ("Esc", "Cancel"))


class PickParameter(Question[str | None]):
    """Answers with the code of a parameter, with `none` to clear the place, or with None."""

    BINDINGS: ClassVar = [
        Binding("up", "step(-1)", "up", show=False, priority=True),
        Binding("down", "step(1)", "down", show=False, priority=True),
    ]

    def __init__(
        self, profile: Profile, block: Block | None, slot: str, proposed: Sequence[str] = ()
    ) -> None:
        """`slot` is a slot of the block, or the place of a word without one.

        The codes `proposed` are listed first until something is typed.
        """
        super().__init__()
        self._profile, self._block, self._slot = profile, block, slot
        self._proposed = proposed
        self._answers: list[str] = []

    def dialog(self) -> ComposeResult:
        """A search field, and its results."""
        with Vertical(id="dialog"):
            yield Plain(
                f"Map {self._slot} to" if self._block else f"Show as {self._slot}", id="question"
            )
            yield WordField(placeholder="code, number, address or name", id="search")
            yield OptionList(id="choices", compact=True)
            yield Plain("", id="count")
            yield Plain(PICK_HINT if self._block else WORD_HINT, id="hint")

    def on_mount(self) -> None:
        """List every parameter that the slot can be mapped to."""
        options = self.query_one(OptionList)
        options.can_focus = False
        self._list("")

    def on_input_changed(self) -> None:
        """List the matching parameters."""
        self._list(self.query_one(WordField).words)

    def _list(self, search: str) -> None:
        every = choices(self._profile, self._block, search)
        by_code = {parameter.code: parameter for parameter in every}
        first = [] if search else [by_code[code] for code in self._proposed if code in by_code]
        found = [*first, *(p for p in every[:LISTED_MOST] if p not in first)]
        self._answers = [parameter.code for parameter in found]
        options = self.query_one(OptionList)
        options.clear_options()
        lines = pick_lines(found, min(WIDEST, self.app.size.width) - AROUND)
        if not search:
            unused = Text(UNUSED_SLOT if self._block else NO_WORD_HERE, FAINT)
            self._answers.insert(len(first), "none")
            lines.insert(len(first), unused)
        options.add_options([entry(line) for line in lines])
        options.highlighted = 0 if options.option_count else None
        self.query_one("#count", Plain).update(matches_text(len(every), LISTED_MOST))

    def on_resize(self, _: Resize) -> None:
        """Give the names the new width; the choice stays."""
        options = self.query_one(OptionList)
        at = options.highlighted
        self._list(self.query_one(WordField).words)
        options.highlighted = at if at is not None else options.highlighted

    def action_step(self, step: int) -> None:
        """Move the cursor in the list."""
        options = self.query_one(OptionList)
        if options.option_count:
            at = (options.highlighted or 0) + step
            options.highlighted = min(max(0, at), options.option_count - 1)

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Answer with the selected entry."""
        self._take(self.query_one(OptionList).highlighted)

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Answer with the clicked entry."""
        self._take(event.option_index)

    def _take(self, at: int | None) -> None:
        if at is not None:
            self.answer(self._answers[at])


def pick_lines(parameters: Sequence[Parameter], width: int) -> list[Text]:
    """Return a line for each parameter; the names have what the other columns leave."""
    names = tuple(parameter.name for parameter in parameters)
    room = max(8, min(width - BESIDE_NAME, max(map(len, names), default=0)))
    fitted = fitted_names(names, room)
    return [_pick_line(parameter, f"{fitted[parameter.name]:<{room}}") for parameter in parameters]


def _pick_line(parameter: Parameter, name: str) -> Text:
    text = Text(no_wrap=True)
    sure = is_verified(parameter)
    text.append(f" {parameter.code + ('' if sure else '?'):<9} ", STRONG if sure else ALARM)
    text.append(name, PLAIN)
    text.append(f" {parameter.number:<8} 16#{parameter.address:04X}", FAINT)
    return text
