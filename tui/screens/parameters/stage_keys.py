"""Keys of the Parameters screen that stage: edit, step, confirm, undo."""

from __future__ import annotations

from tui.drive.errors import DriveError
from tui.drive.settings.in_force import limit_passed
from tui.drive.taught_profile import why_not_taught
from tui.session.settings.editor import Editor

from .parameter_list import ParameterKeys

WAITING_NAMED = 3
"""Codes that are listed as waiting for standstill; more are counted."""


class StageKeys(ParameterKeys):
    """Keys that check and stage typed values; nothing here reaches the drive."""

    def action_edit(self) -> None:
        """Open a dialog for the parameter under the cursor."""
        code = self.listed.code
        if code and self._only_teaches(code):
            self.ask_look(code)
        elif code:
            self.edit(code)

    def edit(self, code: str, proposed: int | None = None) -> None:
        """Open a dialog for a parameter, with the `proposed` raw value instead of the held one."""
        from .edit_value import dialog_for

        if not self._may_edit(code):
            return

        def reported(answer: str | int | None) -> None:
            if answer is not None:
                self._stage(code, answer)

        # a stop of the drive cancels the dialog, too, as it concerns its motor
        now = self.motor_state_text()
        dialog = dialog_for(self.editor, self.session.profile[code], now, proposed)()
        self.app.push_screen(dialog, reported)

    def _only_teaches(self, code: str) -> bool:
        """Return True if learning its scale is the only thing possible with a parameter."""
        refused = self.editor.refusal(code)
        read_only = refused is not None and refused.reason == "read-only"
        return read_only and not why_not_taught(self.session.family, code)

    def action_teach(self) -> None:
        """Learn the scale of the parameter under the cursor from the drive's display."""
        if self.listed.code:
            self.ask_look(self.listed.code)

    def can_edit(self, code: str) -> bool:
        """Return True if a value may be staged; a running motor prevents only writing."""
        refused = self.editor.refusal(code) if code else None
        allowed = refused is None or refused.reason == "running"
        return bool(code) and allowed and code in self.editor.values.raws

    def _may_edit(self, code: str) -> bool:
        """Return True if it may be staged; a running motor prevents only writing."""
        refused = self.editor.refusal(code)
        if refused is None or refused.reason == "running":
            if code in self.editor.values.raws:
                return True
            self._refuse(self.editor.values.absent.get(code) or f"{code} has not been read yet.")
            return False
        if refused.reason == "unverified":
            self.action_confirm()
        else:
            self._refuse(refused.text)
        return False

    def _stage(self, code: str, answer: str | int) -> None:
        editor = self.editor
        try:
            if past := limit_of_edit(editor, code, answer):
                self._refuse(past)
                return
            if isinstance(answer, str):
                remark = self.editor.staging.stage(code, answer)
            else:
                remark = self.editor.staging.stage_raw(code, answer)
        except DriveError as refused:
            self._refuse(str(refused))
        else:
            if remark:
                self.note(remark)
            else:
                self._tell_staged(code)
            self.list_again()

    def _tell_staged(self, code: str) -> None:
        """Report what is staged, and how to write it in the present state."""
        edit, count = self.editor.staging.edits.get(code), len(self.editor.staging.edits)
        if edit is None:
            self.note(f"Not staged: {code} already has this value.")
            return
        text = f"{code} → {edit.text}. {count} staged."
        if waits := [e.code for e in self.editor.staging.edits if self._waits_for_rest(e.code)]:
            which = ", ".join(waits) if len(waits) <= WAITING_NAMED else f"{len(waits)} of them"
            self.note(f"{text} To be written only at standstill: {which}.")
            return
        them = "it" if count == 1 else "both" if count == 2 else f"all {count}"
        running = self.editor.state == "running" and not self.session.arming.hindrance
        how = self.how_to_write(them)
        self.note(text, f"{how} The motor is running." if running else how)

    def _waits_for_rest(self, code: str) -> bool:
        refused = self.editor.refusal(code)
        return refused is not None and refused.reason == "running"

    def action_step_value(self, steps: int) -> None:
        """Stage the value so many steps from the present or staged one."""
        code = self.listed.code
        if not code or not self._may_edit(code):
            return
        edit = self.editor.staging.edits.get(code)
        self._stage(code, (edit.new if edit else self.editor.values.raws[code]) + steps)

    def action_confirm(self) -> None:
        """Confirm an unverified parameter, or keep an edit of a value that changed since."""
        from ..dialogs.confirm import Confirm

        code = self.listed.code
        if code in self.editor.staging.changed_elsewhere:
            self.editor.staging.accept_changes()
            self.note("Your edits are kept. They now apply to the drive's present values.")
            return
        refused = self.editor.refusal(code) if code else None
        if refused is None or refused.reason != "unverified":
            return
        parameter = self.session.profile[code]

        def reported(sure: bool | None) -> None:
            if sure:
                self.editor.confirm(code)
                self.look()

        follows = (
            f"No available document confirms address {parameter.number} of {code} on this family."
            " Read the value at the keypad. Confirm only if both show the same."
            f" Raw value read here: {self.editor.values.raws.get(code, 'none')}."
        )
        requested = Confirm(
            f"Confirm {code}?",
            follows,
            yes="Confirm",
            no="Cancel",
            loses=True,
            now=self.motor_state_text(),
        )
        self.app.push_screen(requested, reported)

    def action_undo(self) -> None:
        """Undo the last edit; if nothing is staged, stage the values before the last write."""
        staging = self.editor.staging
        if staged := staging.edits.items:  # without edits that equal the present value
            self._take_back(staged[-1].code)
        else:
            self.note(staging.stage_old())
            if count := len(staging.edits):
                self.hint_keys(self.how_to_write("it" if count == 1 else "them"))
        self.list_again()

    def _take_back(self, code: str) -> None:
        staging = self.editor.staging
        staging.undo(code)
        left = f"{count} still staged." if (count := len(staging.edits)) else "Nothing is staged."
        self.note(f"{code} is no longer staged. {left}")

    def action_undo_this(self) -> None:
        """Undo the edit under the cursor."""
        if self.listed.code in self.editor.staging.edits:
            self._take_back(self.listed.code)
        else:
            self.note("This parameter is not staged.")
        self.list_again()

    def action_undo_all(self) -> None:
        """Ask, then undo every edit."""
        from ..dialogs.confirm import Confirm

        count = len(self.editor.staging.edits)
        if not count:
            self.note("Nothing is staged.")
            return

        def reported(sure: bool | None) -> None:
            if sure:
                self.editor.staging.undo_all()
                self.list_again()

        edits = "1 staged edit" if count == 1 else f"{count} staged edits"
        follows = f"This discards {edits}. Nothing is written to the drive."
        requested = Confirm(
            "Undo all edits?",
            follows,
            yes="Discard",
            no="Cancel",
            loses=True,
            now=self.motor_state_text(),
        )
        self.app.push_screen(requested, reported)

    def action_favorite(self) -> None:
        """Add the parameter to the favorites, or remove it."""
        if self.listed.code:
            self.editor.toggle_favorite(self.listed.code)
            self.look()


def limit_of_edit(editor: Editor, code: str, answer: str | int) -> str:
    """Return the error if an edit would exceed a limit set by another parameter; else empty.

    Raises ValueRefused if the drive cannot store the value at all.
    """
    profile, raws, edits = editor.session.profile, editor.values.raws, editor.staging.edits
    if isinstance(answer, str):
        after = edits.stage(profile, code, answer, raws, editor.values.lacking)
    else:
        after = edits.stage_raw(profile, code, answer, raws, editor.values.lacking)
    return limit_passed(profile, edits, after, raws)
