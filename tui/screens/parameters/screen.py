"""Parameters: every parameter by group; edited in its unit, staged, written, read back."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.events import Resize
from textual.widgets import Input

from tui.drive.profile.search import parameter_search
from tui.drive.settings.in_force import limits_in_force
from tui.screens.parameters.detail_view import (
    SHORT,
    TALL,
    TALL_FROM,
    parameter_lines,
    status_line,
)
from tui.screens.parameters.parameter_list import FILTER_LABELS, group_lines, shows_steps, step_help
from tui.screens.parameters.table_view import head_line, layout_of, row_line
from tui.widgets.fields import JOINS_KEY, WordField
from tui.widgets.lines import Lines
from tui.widgets.palette import FAINT, KEY
from tui.widgets.plain import Plain

from ..keys.action import PARAMETERS
from ..keys.table import bindings
from .set_keys import SetKeys
from .stage_keys import StageKeys
from .write_keys import WriteKeys

NARROW, WIDE = 72, 110
"""Columns below which there is no column of groups, and from which it is wider."""


class ParametersScreen(StageKeys, WriteKeys, SetKeys):
    """A table with a cursor; the editor reads and writes."""

    CSS_PATH = "parameters.tcss"
    BINDINGS: ClassVar = bindings(PARAMETERS)
    TITLE = "Parameters"
    LOOK = 0.25
    AUTO_FOCUS = ""

    def body(self) -> ComposeResult:
        """Search and groups at the left, the table, the details of the selected parameter."""
        with Horizontal(id="middle"):
            with Vertical(id="left"):
                with Horizontal(id="find"):
                    yield Plain(Text(" / ", KEY), id="slash")
                    yield WordField(placeholder="search", id="search")
                yield Lines(id="groups")
            with Vertical(id="right"):
                yield Lines(id="columns")
                yield Lines(id="table")
        yield Lines(id="status")
        yield Lines(id="detail")

    def on_mount(self) -> None:
        """Start reading."""
        self.editor.values.start()
        self.run_worker(self.editor.recount(), exit_on_error=False)
        self.call_after_refresh(self.list_again)

    def on_unmount(self) -> None:
        """Stop reading; staged edits are kept."""
        self.editor.values.stop()
        self.editor.values.visible = ()

    @property
    def _room(self) -> int:
        return max(1, self.query_one("#table").size.height)

    def on_resize(self, event: Resize) -> None:
        """Arrange the parts for the new size, before they are drawn."""
        self.set_class(event.size.width < NARROW, "narrow")
        self.set_class(event.size.width >= WIDE, "wide")
        self.set_class(event.size.height >= TALL_FROM, "tall")

    def draw(self, width: int) -> None:
        """Draw the groups, the lines around the cursor, and the details of the selected one."""
        super().draw(width)
        self.offer_to_follow()
        self.show_results()
        editor, code = self.editor, self.listed.code
        shown = self.listed.window(self._room)
        editor.values.visible = tuple(item.code for item in shown if item.code)
        if code:
            limits = limits_in_force(
                self.session.profile, self.session.profile[code], editor.values.raws
            )
            extra = (limits.low_by, limits.high_by) if limits is not None else ()
            editor.values.visible += tuple(text for text in extra if text)
        columns = self.query_one("#table").size.width
        layout = layout_of(editor, self.listed.items, columns)
        table = [
            row_line(editor, item, layout, columns, chosen=place == self.listed.at)
            for place, item in enumerate(shown, start=self.listed.top)
        ]
        self.put("table", table or [Text(self._empty(), FAINT)])
        other = editor.other_label  # a file name keeps its lowercase letters
        self.put("columns", [head_line(layout.columns, "Factory" if other == "factory" else other)])
        self._draw_groups()
        self.put("status", [status_line(editor, self._where(), width)])
        height = TALL if self.size.height >= TALL_FROM else SHORT
        step = step_help(self.session.profile, code) if shows_steps(self.listed) else ""
        self.put("detail", parameter_lines(editor, code, width, height, step) if code else [])

    def _draw_groups(self) -> None:
        place = self.query_one("#groups")
        if place.size.height:
            entries = self.listed.entries(self.editor.facts)
            marked = self.listed.shown_as(self.editor)
            lines = group_lines(entries, marked, place.size.width, place.size.height)
            self.put("groups", lines)

    def _where(self) -> str:
        """Return the name of the list, the cursor's place in it, and its length."""
        listed = self.listed
        if self.reading:
            return self.reading
        name = listed.chosen.group or FILTER_LABELS[listed.chosen.filter]
        if listed.searched:
            name = "Found"
        return f"{name} {listed.place} of {listed.count}" if listed.count else f"{name}: none"

    def _empty(self) -> str:
        if self.query_one("#search", Input).value:
            return " No match. Press Esc to clear the search."
        return " Nothing here. Press Tab for the next group."

    # Keys that move

    def action_move(self, lines: int) -> None:
        """Move the cursor by so many lines."""
        self.listed.move(lines)
        self.look()

    def action_page(self, pages: int) -> None:
        """Move the cursor by so many screens."""
        self.listed.move(pages * max(1, self._room - 1))
        self.look()

    def action_end(self, to: int) -> None:
        """Go to the first (below 0) or the last parameter."""
        self.listed.end(to)
        self.look()

    # Keys that choose what is listed

    def action_group(self, step: int) -> None:
        """Go to the next or previous group, or to a selection above or below the groups."""
        self.listed.group(self.editor, step)
        self.clear_search()

    def action_filter(self, step: int) -> None:
        """Show the next selection that is not empty."""
        self.listed.choose_next(self.editor.facts, step)
        self.clear_search()

    def action_search(self) -> None:
        """Focus the search field immediately, so that the next key is typed into it."""
        self.set_focus(self.query_one("#search", Input))
        # its words are prepared at the first search: not while a key is typed
        prepared = asyncio.to_thread(parameter_search, self.session.profile)
        self.run_worker(prepared, group="search", exclusive=True)

    def typing_keys(self) -> Sequence[tuple[str, str]]:
        """The keys of the search field."""
        exact = (
            self.query_one("#search", Input).value.strip().casefold() == self.listed.code.casefold()
        )
        return ("Enter", "edit" if exact else "list"), JOINS_KEY, ("Esc", "clear")

    def on_input_changed(self) -> None:
        """Search while typing, and select the best match."""
        if self.query_one("#search", Input).value:
            self.listed.best()
        self.list_again()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Return to the table; edit the parameter under the cursor if its code was typed."""
        self.set_focus(None)
        code = self.listed.code
        if event.value.strip().casefold() == code.casefold() and self.can_edit(code):
            self.action_edit()

    def action_leave(self) -> None:
        """Leave the search, then a selection, then the screen."""
        search = self.query_one("#search", Input)
        if search.has_focus or search.value:
            self.set_focus(None)
            self.clear_search()
        elif not self.listed.chosen.group:
            self.listed.go_home()
            self.list_again()
        else:
            self.app.pop_screen()
