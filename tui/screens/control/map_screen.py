"""Communication map: the channels with their words, and four words of the user's choice."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.widgets import OptionList

from tui.bus.errors import LineError
from tui.drive.blocks.user_words import COUNT, UserWord
from tui.session.communication_map import CommunicationMap, MapRow
from tui.session.console import DriveConsole
from tui.session.control_paths import ControlPaths
from tui.widgets.drawing import fitted_names, rule, wrapped
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, FAINT, PLAIN, STRONG
from tui.widgets.plain import entry

from ..base import PanelScreen
from ..keys.action import MAP
from ..keys.table import bindings

MAP_REREAD_EVERY = 2.0
"""Seconds between two reads of the words."""
HEAD_CELLS, TEXT_CELLS = 16, 12
"""Cells of the head of a row, and of its text."""
ROW_LINES = 3
"""Lines of one row at most."""
WORD_CELLS = 36
"""Cells of a chosen word without its name: place, value, format."""
USED_ROWS = 10
"""Rows of the frame, the titles and the chosen words."""
NO_WORD = "none: press Enter to choose a parameter"


def row_lines(row: MapRow, width: int) -> list[Text]:
    """Return a row of the map; a long one takes several lines."""
    first = Text(f"  {row.head:<{HEAD_CELLS}} ", FAINT, no_wrap=True)
    indent = " " * (HEAD_CELLS + 3)
    room = width - HEAD_CELLS - 4
    if not row.detail or len(row.head) > HEAD_CELLS or len(row.text) > TEXT_CELLS:
        parts = wrapped(f"{row.text} {row.detail}".strip(), room, ROW_LINES)
        lines = [first.append(parts[0] if parts else "", PLAIN)]
        return [*lines, *(Text(f"{indent}{part}", PLAIN) for part in parts[1:])]
    first.append(f"{row.text:<{TEXT_CELLS}} ", ALARM if row.text == "not known" else STRONG)
    parts = wrapped(row.detail, room - TEXT_CELLS - 1, ROW_LINES)
    lines = [first.append(parts[0] if parts else "", PLAIN)]
    rest = " " * (TEXT_CELLS + 1)
    return [*lines, *(Text(f"{indent}{rest}{part}", PLAIN) for part in parts[1:])]


class WordList(OptionList, inherit_bindings=False):
    """The chosen words; the keys of pages scroll the map above it."""

    BINDINGS: ClassVar = [
        Binding("up", "cursor_up", show=False),
        Binding("down", "cursor_down", show=False),
        Binding("enter", "select", show=False),
    ]


def word_lines(words: Sequence[tuple[UserWord, str, str]], width: int) -> list[Text]:
    """Return a line for each chosen word: code, name, value in its format, and the format."""
    names = tuple(name for word, name, _ in words if word.address)
    room = max(8, width - WORD_CELLS)
    fitted = fitted_names(names, room)
    lines = []
    for place, (word, name, value) in enumerate(words, 1):
        line = Text(f" {place} ", FAINT, no_wrap=True)
        if not word.address:
            lines.append(line.append(NO_WORD, FAINT))
            continue
        line.append(f"{fitted[name]:<{min(room, max(map(len, fitted.values())))}} ", PLAIN)
        line.append(f"{value:>20}", STRONG)
        lines.append(line.append(f"  {word.format}", FAINT))
    return lines


class MapScreen(PanelScreen):
    """The map of one drive; it writes nothing to the drive."""

    CSS_PATH = "control.tcss"
    BINDINGS: ClassVar = bindings(MAP)
    TITLE = "Map"
    LOOK = 0.5

    def __init__(self, console: DriveConsole) -> None:
        super().__init__()
        self.console = console
        self._map = CommunicationMap(console)
        self._trouble = ""
        self._top = 0
        """First line of the map that is shown."""
        self._room = 1

    def body(self) -> ComposeResult:
        """The rows of the map, the chosen words, and a hint."""
        yield Lines(id="map")
        yield WordList(id="words", compact=True)
        yield Lines(id="hint")

    def on_mount(self) -> None:
        """Read all words, again and again."""
        self.query_one(OptionList).focus()
        self._list()
        self._read_again(again=False)
        self.set_interval(MAP_REREAD_EVERY, self._read_again)

    def _read_again(self, *, again: bool = True) -> None:
        if not any(worker.group == "map" and worker.is_running for worker in self.workers):
            self.run_worker(self._read(again=again), group="map")

    async def _read(self, *, again: bool) -> None:
        codes = [*ControlPaths(self.console.session).codes, *self._map.codes]
        try:
            await self.console.read(list(dict.fromkeys(codes)), again=again)
            await self._map.read_own()
        except LineError as error:
            self._trouble = str(error)
        else:
            self._trouble = ""
        self.look()

    def draw(self, width: int) -> None:
        """Draw the map; the list is only filled again if a word of it changed."""
        super().draw(width)
        lines = [line for row in self._map.rows for line in row_lines(row, width)]
        trouble = [Text(f"  {part}", ALARM) for part in wrapped(self._trouble, width - 4, 2)]
        self._room = max(1, self.size.height - USED_ROWS - len(trouble))
        self._top = max(0, min(self._top, len(lines) - self._room))
        shown = lines[self._top : self._top + self._room]
        place = f"{self._top + 1} to {self._top + len(shown)} of {len(lines)}, PgUp, PgDn"
        head = rule("Channels and words", width, place if len(shown) < len(lines) else "")
        self.put_all("map", [head, *shown, rule("Words of your choice", width)])
        self.put("hint", trouble)
        self._list()

    def _list(self) -> None:
        """Show the chosen words; the cursor stays on its place."""
        options = self.query_one(OptionList)
        words = [(word, *self._map.own_text(word)) for word in self._map.own]
        lines = word_lines(words, self.size.width)
        if options.option_count != COUNT:
            options.clear_options()
            options.add_options([entry(line) for line in lines])
            options.highlighted = 0
            return
        for at, line in enumerate(lines):
            if options.get_option_at_index(at).prompt != line:
                options.replace_option_prompt_at_index(at, line)

    @property
    def _place(self) -> int:
        return self.query_one(OptionList).highlighted or 0

    def on_option_list_option_selected(self) -> None:
        """Choose the parameter of the word under the cursor."""
        self.action_choose_word()

    def action_choose_word(self) -> None:
        """Choose the parameter of the word under the cursor, or none."""
        from ..dialogs.pick_parameter import PickParameter

        place = self._place

        def chosen(code: str | None) -> None:
            if code is not None:
                self._map.choose(place, "" if code == "none" else code)
                self._read_again(again=False)
                self.look()

        profile = self.console.session.profile
        useful = self._map.useful
        self.app.push_screen(PickParameter(profile, None, f"word {place + 1}", useful), chosen)

    def action_page(self, step: int) -> None:
        """Scroll the map by its visible rows, `step` times."""
        self._top = max(0, self._top + step * self._room)
        self.look()

    def action_turn_format(self, step: int) -> None:
        """Give the word under the cursor the next format, or the previous one."""
        self._map.turn_format(self._place, step)
        self.look()

    def action_clear_word(self) -> None:
        """Clear the place under the cursor."""
        self._map.choose(self._place, "")
        self.look()

    def action_other_page(self) -> None:
        """Go back to the switches."""
        self.action_leave()
