"""Parameters: every word of the drive by group, edited in its unit, staged, written, read back."""

from __future__ import annotations

from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Horizontal
from textual.widgets import Input

from tui.screens.parameters.view import (
    head_line,
    news_lines,
    parameter_lines,
    row_line,
    status_line,
)
from tui.widgets.drawing import rule
from tui.widgets.fields import Field
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, ATTENTION, FAINT, STRONG

from ..command.news import news
from ..keys.table import PARAMETERS, bindings
from .parameter_list import USUAL
from .set_keys import SetKeys
from .stage_keys import StageKeys
from .write_keys import WriteKeys

LINES_BELOW_TABLE = 9
"""Lines below the table: four of detail, three of news, the status and the keys."""
ABOVE = 2


class ParametersScreen(StageKeys, WriteKeys, SetKeys):
    """A table with a cursor; the editor does the reading and the writing."""

    CSS_PATH = "parameters.tcss"
    BINDINGS: ClassVar = bindings(PARAMETERS)
    TITLE = "Parameters"
    LOOK = 0.25
    AUTO_FOCUS = ""

    def body(self) -> ComposeResult:
        """The search above, the table, the details below."""
        with Horizontal(id="top"):
            yield Lines(id="title")
            yield Field(placeholder="/ search", id="search")
        yield Lines(id="head")
        yield Lines(id="table")
        yield Lines(id="detail")
        yield Lines(id="message")
        yield Lines(id="status")

    def on_mount(self) -> None:
        """Begin to read."""
        self.editor.values.start()
        self.call_after_refresh(self.list_again)

    def on_unmount(self) -> None:
        """Read no more; what is staged stays."""
        self.editor.values.stop()
        self.editor.values.visible = ()

    @property
    def _room(self) -> int:
        return max(3, self.size.height - ABOVE - LINES_BELOW_TABLE)

    def draw(self, width: int) -> None:
        """The lines around the cursor, what is known of the one under it, and the news."""
        super().draw(width)
        editor, room = self.editor, self._room
        self.offer_to_follow()
        shown = self.listed.window(room)
        editor.values.visible = tuple(item.code for item in shown if item.code)
        table = [
            row_line(editor, item, width, chosen=place == self.listed.at)
            for place, item in enumerate(shown, start=self.listed.top)
        ]
        self.put("table", table or [Text(self._empty(), FAINT)])
        self.put("title", [self._title()])
        other = editor.other_label  # a file keeps its name as it is
        self.put("head", [head_line(width, "Factory" if other == "factory" else other)])
        code = self.listed.code
        detail = parameter_lines(editor, code, width) if code else []
        self.put("detail", [rule("", width), *detail])
        self.put("message", news_lines(editor, code, self._message(), width))
        self.put("status", [status_line(editor, self.commander.armed_for, width)])

    def _title(self) -> Text:
        done, count = self.editor.values.progress
        text = Text(no_wrap=True)
        text.append(f" {self.session.profile.name} · device {self.session.device}", STRONG)
        style = FAINT if self.listed.chosen == USUAL else ATTENTION
        text.append(f" · {self.listed.chosen} {self.listed.count}", style)
        if done < count:
            text.append(f"   read {done} of {count}", FAINT)
        return text

    def _empty(self) -> str:
        if self.query_one("#search", Input).value:
            return " Nothing is called so. Esc clears the search, d shows another selection."
        return f" No parameter is {self.listed.chosen}. d shows another selection."

    def _message(self) -> Text:
        editor = self.editor
        now = self.app.clock.monotonic()
        told = news(editor.said, now, busy=editor.busy, passed=self.passed)
        return Text(*told) if told else Text(self.remark or editor.values.trouble, ALARM)

    # Keys that move

    def _moved(self) -> None:
        self.remark = ""
        self.look()

    def action_move(self, lines: int) -> None:
        """Up or down."""
        self.listed.move(lines)
        self._moved()

    def action_page(self, pages: int) -> None:
        """A screen up or down."""
        self.listed.move(pages * (self._room - 1))
        self._moved()

    def action_end(self, to: int) -> None:
        """The first or the last."""
        self.listed.end(to)
        self._moved()

    def action_group(self, step: int) -> None:
        """The first parameter of the next or previous group."""
        self.listed.group(step)
        self._moved()

    # Keys that choose what is listed

    def action_search(self) -> None:
        """Into the search."""
        self.query_one("#search", Input).focus()

    def on_input_changed(self) -> None:
        """Search as one types; the best match is chosen."""
        self.listed.best()
        self.list_again()

    def on_input_submitted(self) -> None:
        """Back to the table."""
        self.set_focus(None)

    def action_filter(self, step: int) -> None:
        """The next selection that shows anything."""
        self.listed.choose_next(self.editor.facts, step)
        self.list_again()

    def action_leave(self) -> None:
        """Out of the search, then out of a selection, then back to Monitor."""
        search = self.query_one("#search", Input)
        if search.has_focus or search.value:
            search.value = ""
            self.set_focus(None)
        elif self.listed.chosen != USUAL:
            self.listed.chosen = USUAL
            self.list_again()
        else:
            self.app.pop_screen()
