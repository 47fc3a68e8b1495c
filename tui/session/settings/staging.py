"""Staged edits of one drive: typed and checked, but not written yet."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field

from tui.drive.errors import ValueRefused
from tui.drive.sentences import counted
from tui.drive.settings.edits import Edit, Edits
from tui.drive.settings.restore_plan import RestorePlan

from ..drive import DriveSession
from .applied import Result


@dataclass(slots=True)
class Staging:
    """Staged edits, and the results of their last write."""

    session: DriveSession
    busy: Callable[[], bool]
    """Returns True while something is being written; then nothing can be staged."""
    edits: Edits = field(default_factory=Edits)
    results: dict[str, Result] = field(default_factory=dict)
    """Result of the last write of each parameter; none once it is staged again."""
    _before: dict[str, int] = field(default_factory=dict)
    """Raw values before the last write of staged edits, by code."""

    @property
    def _raws(self) -> Mapping[str, int]:
        return self.session.image.raws

    @property
    def _lacking(self) -> frozenset[str]:
        return self.session.image.lacking

    @property
    def changed_elsewhere(self) -> dict[str, int]:
        """Staged codes that another source has changed since, with the value before."""
        if self.busy():
            return {}
        raws = self._raws
        return {
            edit.code: edit.old
            for edit in self.edits
            if edit.old is not None and raws.get(edit.code, edit.old) != edit.old
        }

    def pending(self, code: str) -> Edit | None:
        """Return a staged edit, unless the write in progress has put it into the drive already."""
        edit = self.edits.get(code)
        if edit is not None and self.busy() and self._raws.get(code) == edit.new:
            return None
        return edit

    def stage(self, code: str, typed: str) -> str:
        """Stage a typed value; return a remark to show immediately. Raises ValueRefused."""
        edits = self.edits.stage(self.session.profile, code, typed, self._raws, self._lacking)
        return self._staged(code, edits)

    def stage_raw(self, code: str, raw: int) -> str:
        """Stage a raw value, for a name of a list or a word of bits. Raises ValueRefused."""
        edits = self.edits.stage_raw(self.session.profile, code, raw, self._raws, self._lacking)
        return self._staged(code, edits)

    def _staged(self, code: str, edits: Edits) -> str:
        if self.busy():
            raise ValueRefused("Not staged: a write is in progress. Wait until it ends.")
        self.edits = edits
        self.results.pop(code, None)
        edit = edits.get(code)
        return edit.remark if edit else ""

    def undo(self, code: str) -> None:
        """Unstage one edit."""
        self.edits = self.edits.undo(code, self.session.profile, self._raws, self._lacking)
        self.results.pop(code, None)

    def stage_old(self) -> str:
        """Stage the values before the last write; return the result as text."""
        olds = {c: old for c, old in self._before.items() if self._raws.get(c) != old}
        staged = 0
        for code, old in olds.items():
            with suppress(ValueRefused):
                self.stage_raw(code, old)
                staged += 1
        if not olds:
            return "Nothing is staged: no old values are known."
        return counted(staged, "1 old value is staged.", "{count} old values are staged.")

    def undo_all(self) -> None:
        """Unstage every edit."""
        self.edits, self.results = Edits(), {}

    def accept_changes(self) -> None:
        """Accept values that other sources have written as the values before the edits."""
        self.edits = self.edits.now(self.session.profile, self._raws, self._lacking)

    def take_plan(self, plan: RestorePlan) -> None:
        """Stage the edits of a restore plan."""
        profile = self.session.profile
        self.edits = self.edits.stage_many(profile, plan.edits.requested, self._raws, self._lacking)

    def only(self, codes: Iterable[str]) -> tuple[Edits, tuple[Edit, ...]]:
        """Return the edits of these codes (default: all), and the other edits."""
        wanted = frozenset(codes) or frozenset(edit.code for edit in self.edits.requested)
        chosen = Edits(tuple(edit for edit in self.edits.requested if edit.code in wanted))
        return chosen, tuple(edit for edit in self.edits.requested if edit.code not in wanted)

    def take_left(self, left: Sequence[Edit]) -> None:
        """Keep the edits that a write has left; an unchanged value only while its scale waits.

        Otherwise it would silently become an edit once another program sets that parameter.
        """
        changing = {edit.code for edit in self.edits}
        waits = {edit.code for edit in left if edit.code in changing}
        profile = self.session.profile

        def stays(edit: Edit) -> bool:
            return edit.code in waits or profile[edit.code].scale_source in waits

        self.edits = Edits(tuple(edit for edit in left if stays(edit)))

    def begin_write(self) -> None:
        """Forget the results and the old values of the write before."""
        self.results, self._before = {}, {}

    def take_result(self, result: Result) -> None:
        """Note the result of one edit."""
        edit = result.edit
        self.results = {**self.results, edit.code: result}
        if result.done and edit.old is not None:
            self._before[edit.code] = edit.old

    def drop_written(self) -> list[Result]:
        """Unstage the values that the drive has; return their results."""
        done = [result for result in self.results.values() if result.done]
        codes = {result.edit.code for result in done}
        self.edits = Edits(tuple(edit for edit in self.edits.requested if edit.code not in codes))
        return done

    def drop_held(self) -> None:
        """Unstage the values that the drive already held at the last read."""
        raws = self._raws
        self.edits = Edits(tuple(e for e in self.edits.requested if raws.get(e.code) != e.new))
