"""The palette: every action of the panel, found by its words, and carried out."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical
from textual.events import Resize
from textual.widgets import OptionList

from tui.screens.keys.finding import FoundAction, find
from tui.widgets.drawing import cut, fitted_names
from tui.widgets.fields import JOINS_KEY, WordField
from tui.widgets.palette import FAINT, KEY, PLAIN
from tui.widgets.plain import Plain, entry

from .base import PanelScreen
from .dialogs.question import Question, hint, matches_text

if TYPE_CHECKING:
    from .app_port import Panel

PLACE_WIDTH, KEY_WIDTH = 14, 5
"""Cells of the screen and the key; an action of this screen has those of the place for its name."""
WIDEST_PALETTE, AROUND_PALETTE = 110, 6
"""Cells of the dialog at most, and those around a line."""


MORE = "Typing also searches the other screens."


def action_lines(found: Sequence[FoundAction], width: int) -> list[Text]:
    """Return a line for each action: its name, its screen if that is another, its key."""
    keys = max([KEY_WIDTH, *(len(item.action.shown) for item in found)])
    here = max(1, width - keys - 1)
    room = {True: here, False: max(1, here - PLACE_WIDTH - 1)}
    fitted = {
        place: fitted_names(tuple(item.name for item in found if item.here is place), cells)
        for place, cells in room.items()
    }
    return [
        _action_line(item, f"{fitted[item.here][item.name]:<{room[item.here]}}", keys)
        for item in found
    ]


def _action_line(found: FoundAction, name: str, keys: int) -> Text:
    text = Text(no_wrap=True)
    if found.here:
        text.append(name, PLAIN)
    else:
        text.append(f"{name} ", FAINT)
        text.append(cut(found.screen.capitalize(), PLACE_WIDTH), FAINT)
    return text.append(f"{found.action.shown:>{keys}} ", KEY)


class Palette(Question[FoundAction | None]):
    """Answers with the chosen action, or None.

    Nothing is selected until typed words begin words of an action.
    """

    BINDINGS: ClassVar = [
        Binding("up", "step(-1)", show=False, priority=True),
        Binding("down", "step(1)", show=False, priority=True),
    ]

    def __init__(self, screen: str) -> None:
        super().__init__()
        self._of = screen
        self._found: list[FoundAction] = []

    def dialog(self) -> ComposeResult:
        """A field, and the actions that match the typed text."""
        with Vertical(id="dialog"):
            yield Plain("Find an action", id="question")
            yield WordField(
                placeholder="Type a word, for example eeprom, ramp, frames", id="search"
            )
            yield OptionList(id="choices", compact=True)
            yield Plain("", id="count")
            yield Plain("", id="hint")

    def on_mount(self) -> None:
        """List the possible actions."""
        self.query_one(OptionList).can_focus = False
        self._list("")

    def on_input_changed(self) -> None:
        """List the matching actions."""
        self._list(self.query_one(WordField).words)

    def _list(self, query: str) -> None:
        self._found = find(query, self._of)
        options = self.query_one(OptionList)
        options.clear_options()
        width = min(WIDEST_PALETTE, self.app.size.width) - AROUND_PALETTE
        options.add_options([entry(line) for line in action_lines(self._found, width)])
        ready = bool(self._found) and self._found[0].ready
        options.highlighted = 0 if ready else None
        count = matches_text(len(self._found)) if query or not self._found else MORE
        self.query_one("#count", Plain).update(count)
        self._tell_keys()

    def on_resize(self, _: Resize) -> None:
        """Give the names the new width; the choice stays."""
        options = self.query_one(OptionList)
        at = options.highlighted
        self._list(self.query_one(WordField).words)
        options.highlighted = at
        self._tell_keys()

    def action_step(self, step: int) -> None:
        """Move the cursor in the list; the first step selects the first action."""
        options = self.query_one(OptionList)
        if not options.option_count:
            return
        at = options.highlighted
        at = 0 if at is None else at + step
        options.highlighted = min(max(0, at), options.option_count - 1)
        self._tell_keys()

    def _tell_keys(self) -> None:
        """Show the effect of Enter."""
        at = self.query_one(OptionList).highlighted
        keys = [("Up, Down", "Choose")] if self._found else []
        keys.append(JOINS_KEY)
        if at is not None:
            found = self._found[at]
            keys.append(("Enter", "Run" if found.here else f"Go to {found.screen.capitalize()}"))
        self.tell_keys(hint(*keys, ("Esc", "Cancel")))

    def on_input_submitted(self) -> None:
        """Answer with the selected action, if any."""
        at = self.query_one(OptionList).highlighted
        if at is not None:
            self.answer(self._found[at])

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Answer with the clicked action."""
        self.answer(self._found[event.option_index])


def open_palette(app: Panel) -> None:
    """Ask for an action and run it; for an action of another screen, go to that screen."""
    below = app.screen
    if not isinstance(below, PanelScreen):
        return  # a question or the help is open

    def chosen(found: FoundAction | None) -> None:
        if found is None or app.screen is not below:
            return
        if found.here:
            app.call_later(app.run_action, found.action.id, app if found.action.app else below)
        else:
            app.action_goto(found.screen)
            key = found.action.shown or "^p"  # without a key, it is chosen again from there
            app.tell(f"Press {key} on {found.screen.capitalize()}: {found.action.help}")

    app.push_screen(Palette(app.place), chosen)
