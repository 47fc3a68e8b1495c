"""Parameters: every word of the drive by group, edited in its unit, staged, written, read back."""

from __future__ import annotations

from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.containers import Horizontal
from textual.widgets import Input

from tui.drive.errors import DriveError
from tui.drive.rows import FILTERS, FilterId, rows
from tui.session.drive_session import DriveSession
from tui.session.editor import Editor
from tui.widgets.drawing import rule
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, ATTENTION, FAINT, STRONG
from tui.widgets.parameter_view import (
    Item,
    detail_lines,
    head_line,
    items_of,
    news_lines,
    row_line,
    status_line,
)

from .actions import PARAMETERS, bindings
from .arming import Arming
from .said import news
from .set_keys import SetKeys

BELOW = 9
"""Lines below the table: four of detail, three of news, the status and the keys."""
ABOVE = 2


class ParametersScreen(SetKeys, Arming):
    """A table with a cursor; the editor does the reading and the writing."""

    CSS_PATH = "parameters.tcss"
    BINDINGS: ClassVar = bindings(PARAMETERS)
    TITLE = "Parameters"
    LOOK = 0.25
    AUTO_FOCUS = ""

    def __init__(self, session: DriveSession) -> None:
        super().__init__()
        self.session = session
        self._filter: FilterId = "settings"
        self._items: list[Item] = []
        self._at = 0
        self._top = 0
        self._seen = -1
        self._note = ""

    @property
    def editor(self) -> Editor:
        """What is known and staged; stays with the drive while the panel runs."""
        return self.app.editor(self.session)

    def compose(self) -> ComposeResult:
        """The search above, the table, the details below."""
        with Horizontal(id="top"):
            yield Lines(id="title")
            yield Input(placeholder="/ search", id="search", compact=True)
        yield Lines(id="head")
        yield Lines(id="table")
        yield Lines(id="detail")
        yield Lines(id="message")
        yield Lines(id="status")
        yield Lines(id="keys")

    def on_mount(self) -> None:
        """Begin to read."""
        self.editor.start()
        self.call_after_refresh(self._list_again)

    def on_unmount(self) -> None:
        """Read no more; what is staged stays."""
        self.editor.stop()
        self.editor.visible = ()

    # The list

    @property
    def _code(self) -> str:
        """The parameter under the cursor, or nothing."""
        return self._items[self._at].code if self._at < len(self._items) else ""

    def _list_again(self) -> None:
        """Make the list anew; the cursor stays on its parameter where that is still in it."""
        before = self._code
        search = self.query_one("#search", Input).value
        codes = rows(self.editor.facts, self._filter, search)
        headings = not search and self._filter in ("all", "settings")
        self._items = items_of(self.editor, codes, headings=headings)
        found = [at for at, item in enumerate(self._items) if item.code and item.code == before]
        self._at = found[0] if found else self._first_row(0, 1)
        self.look()

    def _first_row(self, at: int, step: int) -> int:
        """The nearest line from here on that is a parameter."""
        while 0 <= at < len(self._items) and not self._items[at].code:
            at += step
        return min(max(at, 0), max(0, len(self._items) - 1))

    def _move_to(self, at: int, step: int) -> None:
        at = min(max(at, 0), max(0, len(self._items) - 1))
        found = self._first_row(at, step)
        if self._items and not self._items[found].code:
            found = self._first_row(at, -step)
        self._at = found
        self._note = ""
        self.look()

    @property
    def _room(self) -> int:
        return max(3, self.size.height - ABOVE - BELOW)

    def draw(self, width: int) -> None:
        """The lines around the cursor, what is known of the one under it, and the news."""
        super().draw(width)
        editor, room = self.editor, self._room
        self._offer_to_follow()
        first = self._at - 1 if self._at and self._items[self._at - 1].group else self._at
        self._top = min(max(self._top, self._at - room + 1), first) if self._items else 0
        shown = self._items[self._top : self._top + room]
        editor.visible = tuple(item.code for item in shown if item.code)
        table = [
            row_line(editor, item, width, chosen=self._top + place == self._at)
            for place, item in enumerate(shown)
        ]
        if not table:
            table = [Text(self._empty(), FAINT)]
        self.put("title", [self._title()])
        self.put("head", [head_line(width, editor.other_label.capitalize())])
        self.put("table", table)
        detail = detail_lines(editor, self._code, width) if self._code else []
        self.put("detail", [rule("", width), *detail])
        self.put("message", news_lines(editor, self._code, self._message(), width))
        self.put("status", [status_line(editor, self.commander.armed_for, width)])

    def _offer_to_follow(self) -> None:
        """Ask once whether to go where the drive answers now."""
        from .confirm import Confirm

        moved = self.editor.moved
        if moved is None or self.editor.busy:
            return
        self.editor.moved = None
        if not moved.device:
            self.note(moved.text)
            return

        def told(sure: bool | None) -> None:
            if sure:
                self.app.follow(moved.line, moved.device)

        keys = "y or Enter follows it   Esc stays"
        self.app.push_screen(Confirm("Follow the drive?", moved.text, keys), told)

    def _title(self) -> Text:
        done, count = self.editor.progress
        text = Text(no_wrap=True)
        text.append(f" {self.session.profile.name} · device {self.session.device}", STRONG)
        parameters = sum(1 for item in self._items if item.code)
        style = FAINT if self._filter == "settings" else ATTENTION
        text.append(f" · {self._filter} {parameters}", style)
        if done < count:
            text.append(f"   read {done} of {count}", FAINT)
        return text

    def _empty(self) -> str:
        if self.query_one("#search", Input).value:
            return " Nothing is called so. Esc clears the search, d shows another selection."
        return f" No parameter is {self._filter}. d shows another selection."

    def _message(self) -> Text:
        editor = self.editor
        told = news(editor.said, self.app.clock.monotonic(), busy=editor.busy)
        return Text(*told) if told else Text(self._note or editor.trouble, ALARM)

    def show_differences(self) -> None:
        """Show what the drive has otherwise than the set."""
        self._filter = "differs"
        self._list_again()

    def _refuse(self, text: str) -> None:
        self.note(text)

    def note(self, text: str) -> None:
        """Say something in the line of messages."""
        self.editor.said = None
        self._note = text
        self.look()

    # Keys that move

    def action_move(self, rows: int) -> None:
        """Up or down."""
        self._move_to(self._at + rows, 1 if rows > 0 else -1)

    def action_page(self, pages: int) -> None:
        """A screen up or down."""
        self._move_to(self._at + pages * (self._room - 1), pages)

    def action_end(self, to: int) -> None:
        """The first or the last."""
        self._move_to(0 if to < 0 else len(self._items) - 1, -to)

    def action_group(self, step: int) -> None:
        """The first parameter of the next or previous group."""
        heads = [at for at, item in enumerate(self._items) if item.group]
        own = max((at for at in heads if at < self._at), default=0)
        nearest = [at for at in heads if (at > self._at if step > 0 else at < own)]
        if nearest:
            self._move_to((nearest[0] if step > 0 else nearest[-1]) + 1, 1)

    def action_search(self) -> None:
        """Into the search."""
        self.query_one("#search", Input).focus()

    def on_input_changed(self) -> None:
        """Search as one types; the best match is chosen."""
        self._at = len(self._items)
        self._list_again()

    def on_input_submitted(self) -> None:
        """Back to the table."""
        self.set_focus(None)

    def action_leave(self) -> None:
        """Out of the search, then out of a selection, then back to Monitor."""
        search = self.query_one("#search", Input)
        if search.has_focus or search.value:
            search.value = ""
            self.set_focus(None)
        elif self._filter != "settings":
            self._filter = "settings"
            self._list_again()
        else:
            self.app.pop_screen()

    def action_monitor(self) -> None:
        """Back to Monitor at once."""
        self.app.pop_screen()

    def action_filter(self, step: int) -> None:
        """The next selection that shows anything."""
        facts, at = self.editor.facts, FILTERS.index(self._filter)
        for _ in FILTERS:
            at = (at + step) % len(FILTERS)
            if rows(facts, FILTERS[at]):
                break
        self._filter = FILTERS[at]
        self._list_again()

    # Keys that stage

    def action_edit(self) -> None:
        """A dialog for the parameter under the cursor."""
        from .edit_value import dialog_for

        code = self._code
        if not code or not self._may_edit(code):
            return

        def told(answer: str | int | None) -> None:
            if answer is not None:
                self._stage(code, answer)

        dialog = dialog_for(self.editor, self.session.profile[code])()
        self.app.push_screen(dialog, told)

    def _may_edit(self, code: str) -> bool:
        """Whether it may be staged; a motor that runs hinders only the writing."""
        refused = self.editor.refusal(code)
        if refused is None or refused.reason == "running":
            if code in self.editor.raws:
                return True
            self.note(self.editor.absent.get(code) or f"{code} was not read yet.")
            return False
        if refused.reason == "unverified":
            self.action_confirm()
        else:
            self.note(refused.text)
        return False

    def _stage(self, code: str, answer: str | int) -> None:
        try:
            if isinstance(answer, str):
                remark = self.editor.stage(code, answer)
            else:
                remark = self.editor.stage_raw(code, answer)
        except DriveError as refused:
            self.note(str(refused))
        else:
            self.note(remark)

    def action_step_value(self, steps: int) -> None:
        """Stage the next value that the drive can hold."""
        code = self._code
        if not code or not self._may_edit(code):
            return
        edit = self.editor.edits.get(code)
        self._stage(code, (edit.new if edit else self.editor.raws[code]) + steps)

    def action_confirm(self) -> None:
        """Confirm an unverified parameter, or keep an edit over another's change."""
        from .confirm import Confirm

        code = self._code
        if code in self.editor.changed_elsewhere:
            self.editor.accept_changes()
            self.note("Your edits stay, against what the drive holds now.")
            return
        refused = self.editor.refusal(code) if code else None
        if refused is None or refused.reason != "unverified":
            return
        parameter = self.session.profile[code]

        def told(sure: bool | None) -> None:
            if sure:
                self.editor.confirm(code)
                self.look()

        follows = (
            f"No document at hand confirms that {code} is at {parameter.number} on this family."
            " Read it at the keypad: only if both show the same, confirm it."
            f" Here it reads {self.editor.raws.get(code, 'nothing')}."
        )
        keys = "y or Enter: the keypad shows the same   Esc: not confirmed"
        self.app.push_screen(Confirm(f"Confirm {code}?", follows, keys), told)

    def action_undo(self) -> None:
        """Take the edit under the cursor back."""
        self.editor.undo(self._code)
        self._list_again()

    def action_undo_all(self) -> None:
        """Take every edit back, after asking."""
        from .confirm import Confirm

        count = len(self.editor.edits)
        if not count:
            return

        def told(sure: bool | None) -> None:
            if sure:
                self.editor.undo_all()
                self._list_again()

        follows = f"{count} staged edits are dropped; the drive is not touched."
        self.app.push_screen(Confirm("Undo all edits?", follows, "y or Enter drops   Esc"), told)

    def action_favourite(self) -> None:
        """Mark or unmark the parameter."""
        if self._code:
            self.editor.toggle_favourite(self._code)
            self.look()

    # Keys that write

    def action_write(self, *, only: str = "") -> None:
        """Say what will be written, and write it."""
        from .confirm import Confirm
        from .write_text import write_text

        edits = [e for e in self.editor.edits if not only or e.code == only]
        if not edits:
            self.note("Nothing is staged: Enter edits the parameter under the cursor.")
            return
        if not self._armed_or_told():
            return

        def told(sure: bool | None) -> None:
            if sure and self._armed_or_told():
                self._note = ""
                self.editor.apply((only,) if only else ())
                self.look()

        codes = f"Write {only}?" if only else f"Write {len(edits)} parameters?"
        keys = "y or Enter writes, each read back   Esc writes nothing"
        self.app.push_screen(Confirm(codes, write_text(self.editor, edits), keys), told)

    def action_write_one(self) -> None:
        """Write the edit under the cursor."""
        if self._code in self.editor.edits:
            self.action_write(only=self._code)
        else:
            self.note("This parameter is not staged.")

    def action_save(self) -> None:
        """Copy to EEPROM, after saying what happens."""
        from tui.drive.memory_orders import save_order

        self._memory("Save to EEPROM?", save_order, self.editor.save)

    def action_factory(self) -> None:
        """Recall the factory settings, after saying what happens."""
        from tui.drive.memory_orders import factory_order

        self._memory("Recall the factory settings?", factory_order, self.editor.factory)

    def _memory(self, question: str, order_of: object, work: object) -> None:
        from .confirm import Confirm

        assert callable(order_of)
        assert callable(work)
        try:
            order = order_of(self.session.profile)
        except DriveError as refused:
            self.note(str(refused))
            return
        if not self._armed_or_told():
            return

        def told(sure: bool | None) -> None:
            if sure and self._armed_or_told():
                work()
                self.look()

        keys = "y or Enter does it   Esc leaves all as it is"
        self.app.push_screen(Confirm(question, order.does, keys), told)
