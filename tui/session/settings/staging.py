"""The edits of one drive that are staged: typed, checked and not written yet."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

from tui.drive.errors import ValueRefused
from tui.drive.settings.edits import Edit, Edits
from tui.drive.settings.restore_plan import RestorePlan

from ..drive import DriveSession
from .applied import Result


@dataclass(slots=True)
class Staging:
    """Staged edits, and the results of their last write."""

    session: DriveSession
    busy: Callable[[], bool]
    """True if something is being written: nothing is staged meanwhile."""
    edits: Edits = field(default_factory=Edits)
    results: dict[str, Result] = field(default_factory=dict)
    """Result of the last write of each parameter."""

    @property
    def _raws(self) -> Mapping[str, int]:
        return self.session.image.raws

    @property
    def _lacking(self) -> frozenset[str]:
        return self.session.image.lacking

    @property
    def changed_elsewhere(self) -> dict[str, int]:
        """Staged codes that somebody else has changed since, with the value before."""
        if self.busy():
            return {}
        raws = self._raws
        return {
            edit.code: edit.old
            for edit in self.edits
            if edit.old is not None and raws.get(edit.code, edit.old) != edit.old
        }

    def stage(self, code: str, typed: str) -> str:
        """Stage what was typed; returns what should be shown at once. Raises ValueRefused."""
        edits = self.edits.stage(self.session.profile, code, typed, self._raws, self._lacking)
        return self._staged(code, edits)

    def stage_raw(self, code: str, raw: int) -> str:
        """Stage a raw value: a name of a list, a word of bits. Raises ValueRefused."""
        edits = self.edits.stage_raw(self.session.profile, code, raw, self._raws, self._lacking)
        return self._staged(code, edits)

    def _staged(self, code: str, edits: Edits) -> str:
        if self.busy():
            raise ValueRefused("Something is being written; wait until that is done.")
        self.edits = edits
        self.results.pop(code, None)
        edit = edits.get(code)
        return edit.remark if edit else ""

    def undo(self, code: str) -> None:
        """Take one edit back."""
        self.edits = self.edits.undo(code, self.session.profile, self._raws, self._lacking)
        self.results.pop(code, None)

    def stage_old(self) -> str:
        """Stage what the drive held before the last write; says what was staged."""
        done = [result.edit for result in self.results.values() if result.done]
        olds = [(edit.code, edit.old) for edit in done if edit.old is not None]
        staged = 0
        for code, old in olds:
            with suppress(ValueRefused):
                self.stage_raw(code, old)
                staged += 1
        if not olds:
            return "Nothing is staged, and no old value is known that could be."
        return f"{staged} {'old value is' if staged == 1 else 'old values are'} staged."

    def undo_all(self) -> None:
        """Take every edit back."""
        self.edits, self.results = Edits(), {}

    def accept_changes(self) -> None:
        """Take what others wrote for the value before, knowingly."""
        self.edits = self.edits.now(self.session.profile, self._raws, self._lacking)

    def take_plan(self, plan: RestorePlan) -> None:
        """Stage what a plan would write."""
        profile = self.session.profile
        self.edits = self.edits.stage_many(profile, plan.edits.requested, self._raws, self._lacking)

    def only(self, codes: Iterable[str]) -> tuple[Edits, tuple[Edit, ...]]:
        """The edits of these codes, of all where there are none; and those held back."""
        wanted = frozenset(codes) or frozenset(edit.code for edit in self.edits.requested)
        chosen = Edits(tuple(edit for edit in self.edits.requested if edit.code in wanted))
        return chosen, tuple(edit for edit in self.edits.requested if edit.code not in wanted)

    def take_left(self, left: Sequence[Edit]) -> None:
        """Keep the edits that a write has left; an unchanged value only while its scale waits.

        Kept, it would become one silently once another program sets that parameter otherwise.
        """
        changing = {edit.code for edit in self.edits}
        waits = {edit.code for edit in left if edit.code in changing}
        profile = self.session.profile

        def stays(edit: Edit) -> bool:
            scale = profile[edit.code].scale_by
            return edit.code in waits or (scale is not None and scale.parameter in waits)

        self.edits = Edits(tuple(edit for edit in left if stays(edit)))

    def take_result(self, result: Result) -> None:
        """One edit was written, or could not be."""
        self.results = {**self.results, result.edit.code: result}

    def drop_written(self) -> list[str]:
        """Unstage the values that the drive has; return their codes."""
        done = [result.edit.code for result in self.results.values() if result.done]
        self.edits = Edits(tuple(edit for edit in self.edits.requested if edit.code not in done))
        return done

    def drop_held(self) -> None:
        """Unstage the values that the drive already held at the last read."""
        raws = self._raws
        self.edits = Edits(tuple(e for e in self.edits.requested if raws.get(e.code) != e.new))
