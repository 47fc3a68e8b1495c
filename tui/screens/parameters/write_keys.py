"""Keys of the Parameters screen that write, and the result of each edit."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import TYPE_CHECKING, ClassVar

from rich.style import Style
from rich.table import Table
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Vertical, VerticalScroll

from tui.drive.errors import DriveError
from tui.drive.plain import plain
from tui.drive.sentences import first_of
from tui.drive.settings.edits import Edit, Edits, consequences
from tui.drive.settings.limits import edit_problems
from tui.drive.settings.memory_orders import factory_order, save_effect
from tui.drive.settings.writable import cuts_line
from tui.drive.settings.write_sequence import ordered
from tui.drive.values import NOT_AVAILABLE
from tui.session.settings.applied import Applied, EditOutcome, Result, done_text
from tui.session.settings.editor import Editor
from tui.widgets.palette import ALARM, ATTENTION, FAINT, PLAIN, STRONG
from tui.widgets.plain import Plain

from ..dialogs.question import KeyQuestion, hint
from .parameter_list import ParameterKeys

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile

    from ..dialogs.now import MotorStates

OUTCOME_WORDS = {
    EditOutcome.DONE: "written",
    EditOutcome.SENT: "sent",
    EditOutcome.WAITS: "not yet written",
    EditOutcome.UNKNOWN: "not known",
}
"""Results of an edit in a word; an edit with any other result was not written."""


class Results(KeyQuestion[bool | None]):
    """A list of results; answers True to save the written values to EEPROM."""

    BINDINGS: ClassVar = [
        Binding("enter", "no", show=False),
        Binding("S", "save", show=False),
    ]

    def __init__(
        self, applied: Applied, unsaved: Collection[str] = (), *, staged: bool = False
    ) -> None:
        """`unsaved` are all settings that are not in EEPROM, those of earlier writes too.

        `staged`: edits are left, so u would first undo those.
        """
        super().__init__()
        self._applied, self._unsaved, self._staged = applied, unsaved, staged

    def dialog(self) -> ComposeResult:
        """The number of written edits, the result of each, and what is not in EEPROM."""
        with Vertical(id="dialog"):
            yield Plain(results_head(self._applied), id="question")
            with VerticalScroll(id="says"):
                yield Plain(results_table(self._applied))
            keys = [("Enter or Esc", "Close")]
            if self._unsaved:
                yield Plain(Text(unsaved_text(self._unsaved), ALARM), id="unsaved")
                keys.append(("S", "Save to EEPROM (asks)"))
            if self._applied.written and not self._staged:
                keys.append(("Esc, then u", "Stage the old values"))
            yield Plain(hint(*keys), id="hint")

    def action_save(self) -> None:
        """Close, then ask to save to EEPROM."""
        self.answer(True)


class RestQuestion(KeyQuestion[bool]):
    """Asks to write the remaining edits after one that failed."""

    NO = False
    by_itself = True
    BINDINGS: ClassVar = [Binding("y", "yes", show=False)]

    def __init__(self, applied: Applied, now: MotorStates) -> None:
        super().__init__(now)
        self._applied = applied

    def dialog(self) -> ComposeResult:
        """The failed edits, the edits that depend on them, and the remaining ones."""
        count = len(self._applied.waits)
        item = count == 1
        with Vertical(id="dialog"):
            rest = "parameter" if item else f"{count} parameters"
            yield Plain(f"Write the other {rest} anyway?", id="question")
            yield from self.now_lines()
            with VerticalScroll(id="says"):
                yield Plain(results_table(self._applied))
            keys = (("y", "Write"), ("Esc or q", "Stop here"))
            yield Plain(hint(*keys), id="hint")

    def action_yes(self) -> None:
        """Write the rest."""
        self.answer(True)


def results_head(applied: Applied) -> str:
    """Return the number of edits that were written, and that are still staged."""
    failed = len(applied.results) - len(applied.written)
    nothing = "Not known if written." if applied.unknown else "Nothing written."
    head = done_text(applied.written) or nothing
    return f"{head} {failed} still staged." if failed else head


UNSAVED_NAMED = 8
"""Settings that are named as not in EEPROM; the others are counted."""


def unsaved_text(codes: Collection[str]) -> str:
    """Return which settings are not in EEPROM."""
    return f"Not in EEPROM, lost at power-off: {first_of(sorted(codes), UNSAVED_NAMED)}."


def results_table(applied: Applied) -> Table:
    """One row per edit: code, result, old and new value; below it, why it was not written."""
    table = Table.grid(padding=(0, 2, 0, 0))
    for result in applied.results:
        edit = result.edit
        values = f"{edit.old_text or NOT_AVAILABLE} → {edit.text}"
        word = OUTCOME_WORDS.get(result.outcome, "NOT WRITTEN")
        table.add_row(
            Text(edit.code, STRONG, no_wrap=True),
            Text(word, _style(result), no_wrap=True),
            Text(plain(values), PLAIN),
        )
        if not result.done and result.outcome is not EditOutcome.WAITS:
            table.add_row(Text(), Text(), Text(plain(result.text), FAINT))
    return table


def _style(result: Result) -> Style:
    if result.done:
        return PLAIN
    return ATTENTION if result.outcome is EditOutcome.WAITS else ALARM


EDITS_NAMED = 9
"""Edits that are listed; the others are counted."""


def write_text(editor: Editor, edits: Sequence[Edit]) -> str:
    """Old and new value of each edit in the order of writing, then all warnings."""
    profile, raws = editor.session.profile, editor.values.raws
    chosen = Edits(tuple(edits))
    order = ordered(profile, chosen, raws)
    codes = max(len(e.code) for e in order)
    olds = max(len(e.old_text or NOT_AVAILABLE) for e in order)
    lines = [
        f"{e.code:<{codes}}  {e.old_text or NOT_AVAILABLE:>{olds}} → {e.text}"
        for e in order[:EDITS_NAMED]
    ]
    if len(order) > EDITS_NAMED:
        lines.append(f"and {len(order) - EDITS_NAMED} more")
    reported = list(edit_problems(profile, chosen, raws).values())
    reported += [r.text for e in order if (r := editor.refusal(e.code)) is not None]
    reported += [edit.warning for edit in order if edit.warning]
    reported += consequences(profile, chosen, raws, editor.values.lacking)
    reported += editor.wear_text(order).splitlines()
    reported += [
        f"{e.code} changes the drive's line settings. It then answers only at the new settings."
        for e in order
        if cuts_line(profile, profile[e.code])
    ]
    return "\n".join([*lines, *([""] if reported else []), *dict.fromkeys(reported)])


class WriteKeys(ParameterKeys):
    """States what follows, and writes after a confirmation; the drive must be armed."""

    def action_write(self, *, only: str = "") -> None:
        """Ask with the list of writes, then write."""

        edits = [e for e in self.editor.staging.edits if not only or e.code == only]
        if not edits:
            self.note("Nothing is staged.", "Press Enter to edit the parameter under the cursor.")
            return
        if not self._may_write():
            return

        def work(stamp: int) -> None:
            self.editor.apply((only,) if only else (), stamp)

        many = f"{len(edits)} parameters" if len(edits) > 1 else "1 parameter"
        text = write_text(self.editor, edits)
        self._ask(f"Write {only or many}?", text, "Write and read back", "Cancel", work)

    def action_write_one(self) -> None:
        """Write the edit under the cursor."""
        if self.listed.code in self.editor.staging.edits:
            self.action_write(only=self.listed.code)
        else:
            self.note("This parameter is not staged.")

    def action_save_eeprom(self) -> None:
        """Ask, then save the settings to EEPROM."""
        unsaved = self.editor.unsaved
        self._memory("Save to EEPROM?", lambda p: save_effect(p, unsaved), "Save", self.editor.save)

    def action_factory(self) -> None:
        """Ask, then restore the factory settings."""
        question = "Restore the factory settings?"
        self._memory(
            question, lambda profile: factory_order(profile).does, "Restore", self.editor.factory
        )

    def _memory(
        self,
        question: str,
        does: Callable[[Profile], str],
        yes: str,
        work: Callable[[int], None],
    ) -> None:
        try:
            effect = does(self.session.profile)
        except DriveError as refused:
            self._refuse(str(refused))
            return
        if self._may_write():
            wear = self.editor.wear_text() if work == self.editor.save else ""
            self._ask(question, "\n".join(filter(None, (effect, wear))), yes, "Cancel", work)

    def show_results(self) -> None:
        """Show once the result of each edit; if one failed, ask before writing the rest."""
        applied = self.editor.applied
        if applied is None or self.editor.busy or self.editor.moved is not None:
            return
        self.editor.applied = None
        failed = len(applied.results) - len(applied.written)
        if not failed and len(applied.results) < 2:
            self.list_again()
            return  # the message is enough

        self.list_again()
        stamp = applied.stamp
        if not applied.waits or applied.stopped or stamp != self.session.work.stops:
            staged = len(self.editor.staging.edits) > 0
            results = Results(applied, self.editor.unsaved, staged=staged)
            self.app.push_screen(results, lambda save: self.action_save_eeprom() if save else None)
            return

        def reported(sure: bool | None) -> None:
            if sure:
                self.editor.apply(applied.waits, stamp)
            else:
                self.note(f"Canceled. {len(applied.waits)} still staged.")
            self.look()

        self.app.push_screen(RestQuestion(applied, self.motor_state_text()), reported)

    def offer_to_follow(self) -> None:
        """Ask once to open the line at the drive's new settings."""
        from ..dialogs.confirm import Confirm

        moved = self.editor.moved
        if moved is None or self.editor.busy:
            return
        self.editor.moved = None
        if not moved.device:
            self.note(moved.text)
            return

        def reported(sure: bool | None) -> None:
            if sure:
                self.app.follow(moved.line, moved.device)

        # the line is reopened with this drive's settings: others on it are not polled then
        requested = Confirm(
            "Open the line at the drive's new settings?",
            moved.text,
            yes="Open",
            no="Stay",
            loses=len(self.app.fleet.sessions if self.app.fleet else ()) > 1,
            now=self.motor_state_text(),
            by_itself=True,
        )
        self.app.push_screen(requested, reported)
