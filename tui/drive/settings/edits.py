"""Staged edits of one drive's settings, as typed and as raw values.

Pure: nothing is written here; `tui.session.settings.apply` does that.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from ..errors import ValueRefused
from ..profile.profile import Profile
from ..sentences import all_of
from ..shown import raw_of_text, shown
from ..values import check_raw
from .writable import never_set, warning


@dataclass(frozen=True, slots=True)
class Edit:
    """One setting to write."""

    code: str
    typed: str
    """Typed text, encoded again if its scale changes; empty for a raw value."""
    old: int | None
    """Raw value that the drive held when it was staged; None if it was not read."""
    new: int
    text: str = ""
    """The new value as the drive will hold it."""
    old_text: str = ""
    rounded: bool = False
    """True if the drive cannot store exactly the typed value."""
    lossy: bool = False
    """True if rounding changes the value: to 0, or to one of two equally near values."""
    warning: str = ""
    """Danger of the value; else empty."""

    @property
    def loss(self) -> str:
        """Why writing it requires consent to rounding; empty if it does not."""
        return f"{self.code}: {self.typed} would be rounded to {self.text}" if self.lossy else ""

    @property
    def remark(self) -> str:
        """Remark shown immediately: rounding and danger."""
        held = f"{self.code}: {self.typed} is rounded to {self.text}." if self.rounded else ""
        return f"{held} {self.warning}".strip()


@dataclass(frozen=True, slots=True)
class Edits:
    """Edits in the order in which they were staged; each change gives a new object."""

    requested: tuple[Edit, ...] = ()
    """All staged edits, including values that the drive already holds: they count if their scale
    changes."""

    @property
    def items(self) -> tuple[Edit, ...]:
        """Edits that change a value."""
        return tuple(edit for edit in self.requested if edit.new != edit.old)

    def __iter__(self) -> Iterator[Edit]:
        return iter(self.items)

    def __len__(self) -> int:
        return len(self.items)

    def __contains__(self, code: object) -> bool:
        return any(edit.code == code for edit in self.items)

    def get(self, code: str) -> Edit | None:
        """Return the edit of a parameter; None if there is none."""
        return next((edit for edit in self.items if edit.code == code), None)

    def stage(
        self,
        profile: Profile,
        code: str,
        typed: str,
        raws: Mapping[str, int],
        absent: Collection[str] = (),
    ) -> Edits:
        """Stage a typed value; raises ValueRefused and UnknownParameter.

        `raws` are the drive's raw values by code, `absent` the codes that it lacks. A value that
        the drive already holds is not an edit. Edits whose scale this one changes keep their
        engineering value.
        """
        edit = Edit(profile[code].code, typed, raws.get(code), 0)
        return self._with([edit], profile, raws, absent)

    def stage_raw(
        self,
        profile: Profile,
        code: str,
        raw: int,
        raws: Mapping[str, int],
        absent: Collection[str] = (),
    ) -> Edits:
        """Stage a raw value, independent of its scale; raises ValueRefused."""
        return self._with(
            [Edit(profile[code].code, "", raws.get(code), raw)], profile, raws, absent
        )

    def stage_many(
        self,
        profile: Profile,
        edits: Iterable[Edit],
        raws: Mapping[str, int],
        absent: Collection[str] = (),
    ) -> Edits:
        """Stage several edits together, so that each is encoded with the resulting scales."""
        return self._with(list(edits), profile, raws, absent)

    def undo(
        self,
        code: str,
        profile: Profile,
        raws: Mapping[str, int],
        absent: Collection[str] = (),
    ) -> Edits:
        """Return the edits without that of one parameter; those that depend on its scale are
        encoded again."""
        left = [edit for edit in self.requested if edit.code != code]
        return Edits(_resolve(left, profile, raws, absent))

    def now(self, profile: Profile, raws: Mapping[str, int], absent: Collection[str] = ()) -> Edits:
        """Return the same edits for other present values; values that the drive holds are not
        edits."""
        fresh = [replace(edit, old=raws.get(edit.code, edit.old)) for edit in self.requested]
        return Edits(_resolve(fresh, profile, raws, absent))

    def after(self, raws: Mapping[str, int]) -> dict[str, int]:
        """Return the drive's raw values after all edits are written."""
        return {**raws, **{edit.code: edit.new for edit in self.items}}

    def _with(
        self,
        edits: list[Edit],
        profile: Profile,
        raws: Mapping[str, int],
        absent: Collection[str],
    ) -> Edits:
        merged = {edit.code: edit for edit in (*self.requested, *edits)}
        return Edits(_resolve(list(merged.values()), profile, raws, absent))


def _resolve(
    edits: list[Edit], profile: Profile, raws: Mapping[str, int], absent: Collection[str]
) -> tuple[Edit, ...]:
    """Return the edits encoded with the scales that apply after all of them, scale sources
    first."""
    after = dict(raws)
    done: dict[str, Edit] = {}
    for follows in (False, True):
        for edit in edits:
            parameter = profile[edit.code]
            if bool(parameter.scale_source) is follows:
                done[edit.code] = _encoded(edit, profile, raws, after, absent)
        after.update({edit.code: edit.new for edit in done.values()})
    return tuple(done[edit.code] for edit in edits)


def _encoded(
    edit: Edit,
    profile: Profile,
    raws: Mapping[str, int],
    after: Mapping[str, int],
    absent: Collection[str],
) -> Edit:
    parameter = profile[edit.code]
    raw, rounded, lossy = edit.new, False, False
    if edit.typed:
        conversion = raw_of_text(profile, parameter, edit.typed, after, absent)
        raw, rounded, lossy = conversion.raw, conversion.rounded, conversion.lossy
    else:
        scale = profile.scale(parameter, after, absent)
        check_raw(parameter, raw, profile.names(parameter), scale)
    if raw != edit.old and (why := never_set(profile, parameter, raw)):
        raise ValueRefused(why)
    old = "" if edit.old is None else shown(profile, parameter, edit.old, raws, absent).display
    return replace(
        edit,
        new=raw,
        text=shown(profile, parameter, raw, after, absent).display,
        old_text=old,
        rounded=rounded,
        lossy=lossy,
        warning=warning(profile, parameter, raw),
    )


COMMANDED_ELSEWHERE = (
    "{codes} {decides} who commands the motor. If a run command is on at the new source, the motor"
    " starts."
)


def command_settings(profile: Profile) -> set[str]:
    """Return the codes of the settings that decide who commands the motor."""
    found: set[str] = set()
    for path in profile.data.signal_paths:
        if path.carries == "command":
            others = (switch.other.parameter for switch in path.switches)
            found.update((path.first.parameter, *others))
            found.update(condition.parameter for condition in path.when)
            found.update(switch.parameter for switch in path.switches)
    return {code for code in found if code and profile[code].access.startswith("rw")}


def commander_changes(profile: Profile, edits: Edits) -> list[str]:
    """Return a warning if edits change who commands the motor, else nothing."""
    decides = command_settings(profile)
    codes = [edit.code for edit in edits if edit.code in decides and edit.old != edit.new]
    if not codes:
        return []
    verb = "decides" if len(codes) == 1 else "decide"
    return [COMMANDED_ELSEWHERE.format(codes=all_of(codes), decides=verb)]


def consequences(
    profile: Profile, edits: Edits, raws: Mapping[str, int], absent: Collection[str] = ()
) -> list[str]:
    """List what follows from edits besides themselves: another command source, and values that
    change in engineering units because their scale changes."""
    after = edits.after(raws)
    reported = commander_changes(profile, edits)
    for parameter in profile.parameters:
        follows = parameter.scale_source
        raw = raws.get(parameter.code)
        if not follows or follows not in edits or parameter.code in edits:
            continue
        if raw is None or raws.get(follows) is None:
            continue
        before = shown(profile, parameter, raw, raws, absent)
        later = shown(profile, parameter, raw, after, absent)
        if before.number != later.number and raw:
            reported.append(
                f"{parameter.code} keeps its raw value {raw}: {before.display} becomes"
                f" {later.display}."
            )
    return reported
