"""Staged edits of one drive's settings: what was typed, what it becomes, in which order.

Everything here is pure: nothing is written. Applying them is session/applying.py.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from decimal import Decimal

from ..errors import ValueRefused
from ..profile.profile import Profile
from ..profile.schema import Parameter
from ..shown import number_of, scale_sources, shown
from ..values import check_raw, encode
from .writable import CUTTING, line_setting, never_set, warning


@dataclass(frozen=True, slots=True)
class Edit:
    """One setting that is to be written."""

    code: str
    typed: str
    """What the person typed, encoded anew when its scale changes; empty for a raw value."""
    old: int | None
    """Raw value that the drive held when it was staged; None where it was not read."""
    new: int
    text: str = ""
    """The new value as the drive will hold it."""
    old_text: str = ""
    rounded: bool = False
    """True where the drive cannot hold exactly what was typed."""
    warning: str = ""
    """What is dangerous about it; else empty."""

    @property
    def remark(self) -> str:
        """What a person should be told at once: rounding and danger."""
        held = f"{self.code}: {self.typed} is held as {self.text}." if self.rounded else ""
        return f"{held} {self.warning}".strip()


@dataclass(frozen=True, slots=True)
class Edits:
    """Edits in the order in which they were staged; each change gives a new object."""

    asked: tuple[Edit, ...] = ()
    """All that was staged, also what the drive holds as it is: under another scale it may not."""

    @property
    def items(self) -> tuple[Edit, ...]:
        """Those that change something."""
        return tuple(edit for edit in self.asked if edit.new != edit.old)

    def __iter__(self) -> Iterator[Edit]:
        return iter(self.items)

    def __len__(self) -> int:
        return len(self.items)

    def __contains__(self, code: object) -> bool:
        return any(edit.code == code for edit in self.items)

    def get(self, code: str) -> Edit | None:
        """The edit of a parameter, or None."""
        return next((edit for edit in self.items if edit.code == code), None)

    def stage(
        self,
        profile: Profile,
        code: str,
        typed: str,
        raws: Mapping[str, int],
        absent: Collection[str] = (),
    ) -> Edits:
        """Stage what a person typed for a parameter; raises ValueRefused and UnknownParameter.

        `raws` is what the drive holds, by code; `absent` what it has not. What equals the held
        value is no edit. Edits whose scale this one changes keep their engineering value.
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
        """Stage a raw value, whatever its scale comes to; raises ValueRefused."""
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
        """Stage several at once, so that each is encoded with the scales after all of them."""
        return self._with(list(edits), profile, raws, absent)

    def undo(
        self,
        code: str,
        profile: Profile,
        raws: Mapping[str, int],
        absent: Collection[str] = (),
    ) -> Edits:
        """Without the edit of one parameter; those that follow its scale are encoded anew."""
        left = [edit for edit in self.asked if edit.code != code]
        return Edits(_resolve(left, profile, raws, absent))

    def now(self, profile: Profile, raws: Mapping[str, int], absent: Collection[str] = ()) -> Edits:
        """The same edits against other held values; those that the drive holds are no edits."""
        fresh = [replace(edit, old=raws.get(edit.code, edit.old)) for edit in self.asked]
        return Edits(_resolve(fresh, profile, raws, absent))

    def after(self, raws: Mapping[str, int]) -> dict[str, int]:
        """The raw values of the drive once all of this is written."""
        return {**raws, **{edit.code: edit.new for edit in self.items}}

    def _with(
        self,
        edits: list[Edit],
        profile: Profile,
        raws: Mapping[str, int],
        absent: Collection[str],
    ) -> Edits:
        merged = {edit.code: edit for edit in (*self.asked, *edits)}
        return Edits(_resolve(list(merged.values()), profile, raws, absent))


def _resolve(
    edits: list[Edit], profile: Profile, raws: Mapping[str, int], absent: Collection[str]
) -> tuple[Edit, ...]:
    """The edits encoded with the scales that hold after all of them, scale sources first."""
    after = dict(raws)
    done: dict[str, Edit] = {}
    for follows in (False, True):
        for edit in edits:
            parameter = profile[edit.code]
            if (parameter.scale_by is not None) is follows:
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
    names = profile.names(parameter)
    scale = profile.scale(parameter, after, absent)
    raw, rounded = edit.new, False
    if edit.typed:
        conversion = encode(parameter, edit.typed, names, scale)
        raw, rounded = conversion.raw, conversion.rounded
    else:
        check_raw(parameter, raw, names, scale)
    if raw != edit.old and (why := never_set(profile, parameter, raw)):
        raise ValueRefused(why)
    old = "" if edit.old is None else shown(profile, parameter, edit.old, raws, absent).display
    return replace(
        edit,
        new=raw,
        text=shown(profile, parameter, raw, after, absent).display,
        old_text=old,
        rounded=rounded,
        warning=warning(profile, parameter, raw),
    )


# Limits between parameters


def limit_pairs(profile: Profile) -> list[tuple[str, str]]:
    """Pairs of codes of which the first must never be above the second, in the same unit."""
    pairs: dict[tuple[str, str], None] = {}
    for parameter in profile.parameters:
        if parameter.min_from:
            pairs[parameter.min_from, parameter.code] = None
        if parameter.max_from:
            pairs[parameter.code, parameter.max_from] = None
    return [(low, high) for low, high in pairs if profile[low].unit == profile[high].unit]


def edit_problems(profile: Profile, edits: Edits, raws: Mapping[str, int]) -> dict[str, str]:
    """By code, why an edit cannot be applied with the values after all of them."""
    after = edits.after(raws)
    found: dict[str, str] = {}
    for low, high in limit_pairs(profile):
        if low not in edits and high not in edits:
            continue
        least, most = (_engineering(profile, code, after) for code in (low, high))
        if least is None or most is None or least <= most:
            continue
        code, other, side = (low, high, "above") if low in edits else (high, low, "below")
        texts = [shown(profile, profile[c], after[c], after).display for c in (code, other)]
        found[code] = (
            f"{code} = {texts[0]} would be {side} {other} = {texts[1]}: change {other} too,"
            " or another value."
        )
    return found


def _engineering(profile: Profile, code: str, raws: Mapping[str, int]) -> Decimal | None:
    raw = raws.get(code)
    return None if raw is None else number_of(profile, profile[code], raw, raws)


def consequences(
    profile: Profile, edits: Edits, raws: Mapping[str, int], absent: Collection[str] = ()
) -> list[str]:
    """What changes its engineering value though nobody edits it, because its scale changes."""
    after = edits.after(raws)
    told: list[str] = []
    for parameter in profile.parameters:
        follows = parameter.scale_by
        raw = raws.get(parameter.code)
        if follows is None or follows.parameter not in edits or parameter.code in edits:
            continue
        if raw is None or raws.get(follows.parameter) is None:
            continue
        before = shown(profile, parameter, raw, raws, absent)
        later = shown(profile, parameter, raw, after, absent)
        if before.number != later.number and raw:
            told.append(
                f"{parameter.code} keeps its raw value {raw}: {before.display} becomes"
                f" {later.display}."
            )
    return told


# The order of writing

RESETS_OTHERS = ("cfg", "bfr", "lac")
"""Codes, in small letters, whose writing changes other settings, in the order of writing:
macro configuration, standard frequency of the motor, access level (Altivar 31, 312, 71)."""


def ordered(profile: Profile, edits: Edits, raws: Mapping[str, int]) -> list[Edit]:
    """The edits in the order in which they are written.

    First what changes other settings, then scale sources, then the rest in the profile's order
    with each limit moved out of the way before what it limits, and the line's own settings last.
    """
    places = {parameter.code: place for place, parameter in enumerate(profile.parameters)}
    sources = scale_sources(profile)
    waiting = sorted(
        edits, key=lambda edit: (_rank(profile, edit.code, sources), places[edit.code])
    )
    before = _before(profile, edits, raws)
    done: list[Edit] = []
    while waiting:
        left = {edit.code for edit in waiting}
        free = (edit for edit in waiting if not before.get(edit.code, set()) & left)
        # a ring of limits can only come from values that contradict each other already
        chosen = next(free, waiting[0])
        waiting.remove(chosen)
        done.append(chosen)
    return done


def _rank(profile: Profile, code: str, sources: Collection[str]) -> int:
    folded = code.casefold()
    if folded in RESETS_OTHERS:
        return RESETS_OTHERS.index(folded)
    setting = line_setting(profile, code)
    if setting is not None:
        late = {"address": 3, "baud": 2, "format": 2, "parity": 2, "protocol": 2}
        return len(RESETS_OTHERS) + 2 + late.get(setting.role, 1)
    return len(RESETS_OTHERS) + (0 if code in sources else 1)


def _before(profile: Profile, edits: Edits, raws: Mapping[str, int]) -> dict[str, set[str]]:
    """By code, which others must be written first."""
    after = edits.after(raws)
    found: dict[str, set[str]] = {}
    for low, high in limit_pairs(profile):
        if low not in edits or high not in edits:
            continue
        old_high, new_low = _engineering(profile, high, raws), _engineering(profile, low, after)
        old_low, new_high = _engineering(profile, low, raws), _engineering(profile, high, after)
        down = old_low is not None and new_high is not None and new_high < old_low
        up = old_high is None or new_low is None or new_low > old_high
        if down and not up:
            found.setdefault(high, set()).add(low)
        else:
            found.setdefault(low, set()).add(high)
    return found


def cuts_line(profile: Profile, parameter: Parameter) -> bool:
    """Whether writing it at once ends the conversation at the present line settings."""
    setting = line_setting(profile, parameter.code)
    return setting is not None and setting.role in CUTTING and parameter.effective == "at-once"
