"""Keys of the Parameters screen that write: what is staged, EEPROM, factory settings."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from tui.drive.errors import DriveError

from .parameter_keys import ParameterKeys

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile
    from tui.drive.profile.schema import MemoryOrder


class WriteKeys(ParameterKeys):
    """Says what follows, and writes it once it is confirmed; the drive must be armed."""

    def action_write(self, *, only: str = "") -> None:
        """Say what will be written, and write it."""
        from .write_text import write_text

        edits = [e for e in self.editor.staging.edits if not only or e.code == only]
        if not edits:
            self.note("Nothing is staged.", "Press Enter to edit the parameter under the cursor.")
            return
        if not self._require_armed():
            return

        def work(stamp: int) -> None:
            self.editor.apply((only,) if only else (), stamp)

        many = f"{len(edits)} parameters" if len(edits) > 1 else "1 parameter"
        yes = "write it, read back" if len(edits) == 1 else "write, each read back"
        no = "write nothing"
        self._ask(f"Write {only or many}?", write_text(self.editor, edits), yes, no, work)

    def action_write_one(self) -> None:
        """Write the edit under the cursor."""
        if self.listed.code in self.editor.staging.edits:
            self.action_write(only=self.listed.code)
        else:
            self.note("This parameter is not staged.")

    def action_save_eeprom(self) -> None:
        """Copy to EEPROM, after saying what happens."""
        from tui.drive.settings.memory_orders import save_order

        self._memory("Save to EEPROM?", save_order, self.editor.save)

    def action_factory(self) -> None:
        """Recall the factory settings, after saying what happens."""
        from tui.drive.settings.memory_orders import factory_order

        self._memory("Recall the factory settings?", factory_order, self.editor.factory)

    def _memory(
        self, question: str, order_of: Callable[[Profile], MemoryOrder], work: Callable[[int], None]
    ) -> None:
        try:
            order = order_of(self.session.profile)
        except DriveError as refused:
            self._refuse(str(refused))
            return
        if self._require_armed():
            self._ask(question, order.does, "Continue", "Cancel", work)

    def show_results(self) -> None:
        """Report once the result of each edit; where one failed, ask before the rest."""
        applied = self.editor.applied
        if applied is None or self.editor.busy or self.editor.moved is not None:
            return
        self.editor.applied = None
        failed = len(applied.results) - len(applied.written)
        if not failed and len(applied.results) < 2:
            self.list_again()
            return  # the message says it all
        from .results import RestQuestion, Results

        self.list_again()
        stamp = applied.stamp
        if not applied.waits or applied.stopped or stamp != self.session.work.stops:
            results = Results(applied, staged=len(self.editor.staging.edits) > 0)
            self.app.push_screen(results, lambda save: self.action_save_eeprom() if save else None)
            return

        def reported(sure: bool | None) -> None:
            if sure:
                self.editor.apply(applied.waits, stamp)
            else:
                self.note(f"{len(applied.waits)} not written; they stay staged.")
            self.look()

        self.app.push_screen(RestQuestion(applied, self.motor_state_text()), reported)

    def offer_to_follow(self) -> None:
        """Ask once whether to go where the drive answers now."""
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

        # the line is opened anew as this drive wants it: others on it are not asked meanwhile
        requested = Confirm(
            "Follow the drive?",
            moved.text,
            yes="Follow",
            no="Stay",
            loses=len(self.app.fleet.sessions if self.app.fleet else ()) > 1,
            now=self.motor_state_text(),
            by_itself=True,
        )
        self.app.push_screen(requested, reported)
