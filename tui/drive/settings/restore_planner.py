"""Planning of a restore: the values of a set to write, those the drive has, and the rest."""

from __future__ import annotations

from collections.abc import Iterable

from ..errors import ValueRefused
from ..profile.profile import Profile, is_verified
from ..profile.schema import Parameter, Predecessor, Quantity
from ..shown import number_of, scale_sources, shown
from .edits import Edit, Edits
from .limits import edit_problems
from .parameter_set import ParameterSet, lacking
from .rating import rated, same_rating
from .restore_plan import (
    NO_OPTIONS,
    Held,
    ItemKind,
    Options,
    RestoreItem,
    RestorePlan,
    SkipReason,
)
from .writable import CUTTING, is_setting, line_setting, needs_standstill

ACROSS: tuple[Quantity, ...] = (
    "acceleration",
    "deceleration",
    "acceleration_2",
    "deceleration_2",
    "max_frequency",
    "high_speed",
    "low_speed",
    "rated_frequency",
    "rated_voltage",
    "rated_current",
    "rated_speed",
    "motor_poles",
    "thermal_current",
    "switching_frequency",
    "preset_speed_1",
    "preset_speed_2",
    "preset_speed_3",
    "preset_speed_4",
    "preset_speed_5",
    "preset_speed_6",
    "preset_speed_7",
)
"""Quantities with the same meaning in every family, which can be transferred between families."""


def plan_restore(
    profile: Profile,
    held: Held,
    source: ParameterSet,
    source_profile: Profile,
    options: Options = NO_OPTIONS,
) -> RestorePlan:
    """Plan the writes that restore a parameter set to a drive.

    `profile` and `held` are the drive's, `source_profile` is the set's. Values of another family
    are carried over in engineering values: by the table of a predecessor in the profile, or else by
    quantity.
    """
    across = profile.id != source_profile.id
    planner = _Planner(profile, held, source, source_profile, options, across)
    table = next((p for p in profile.data.predecessors if p.profile == source_profile.id), None)
    if table is not None:
        planner.add_table(table)
    elif across:
        planner.add_quantities()
    else:
        planner.add_codes()
    planner.settle()
    return RestorePlan(
        items=tuple(planner.items.values()),
        edits=planner.edits,
        same_rating=planner.same_rating,
        needs_stop=any(needs_standstill(profile, profile[e.code]) for e in planner.edits),
        across=across,
        mapped_by=table.source if table is not None else "",
    )


class _Planner:
    """Sorts the parameters of a set into those to write, equal ones and the rest."""

    def __init__(
        self,
        profile: Profile,
        held: Held,
        source: ParameterSet,
        source_profile: Profile,
        options: Options,
        across: bool,
    ) -> None:
        self.profile = profile
        self.held = held
        self.source = source
        self.source_profile = source_profile
        self.options = options
        self._across = across
        self.same_rating = same_rating(profile, held, source, across=across)
        self.items: dict[str, RestoreItem] = {}
        self.edits = Edits()
        self._wanted: dict[str, Edit] = {}

    def add_codes(self) -> None:
        """Add every parameter of a set of the same family."""
        sources = scale_sources(self.profile)
        for parameter in sorted(self.profile.parameters, key=lambda p: p.code not in sources):
            raw = self.source.raws.get(parameter.code)
            if raw is None:
                continue
            typed = self._typed(self.profile, parameter, raw) if parameter.scale_source else ""
            self._consider(parameter, typed, raw)
        for code, text in self.source.unknown.items():
            self._skip(code, "unknown", f"the profile {self.profile.id} does not have it", text)
        for code, why in self.source.absent.items():
            parameter_of = self.profile.get(code)
            if parameter_of is not None and is_setting(self.profile, parameter_of):
                self._skip(code, "absent", f"it is not in the set: {why}")

    def add_quantities(self) -> None:
        """Add values that both families name as the same quantity."""
        taken: set[str] = set()
        for quantity in ACROSS:
            theirs = self.source_profile.quantity(quantity)
            ours = self.profile.quantity(quantity)
            if theirs is None or ours is None or theirs.code not in self.source.raws:
                continue
            raw = self.source.raws[theirs.code]
            typed = self._typed(self.source_profile, theirs, raw)
            if not is_setting(self.source_profile, theirs) or theirs.unit != ours.unit:
                continue
            taken.add(theirs.code)
            if theirs.code in self.source.lossy and not self.options.rounded:
                self._skip(ours.code, "rounding", self.source.notes[theirs.code])
                continue
            self._consider(ours, typed, raw)
        for parameter in self.source_profile.parameters:
            code = parameter.code
            if code in self.source.raws and code not in taken:
                self._skip_theirs(parameter)

    def add_table(self, table: Predecessor) -> None:
        """Add the settings of a predecessor that its table maps, and those that it does not map."""
        pairs: list[tuple[Parameter, Parameter]] = []
        for theirs in self.source_profile.parameters:
            if theirs.code not in self.source.raws or not is_setting(self.source_profile, theirs):
                continue
            ours = self.profile.get(table.counterpart(theirs.code))
            if ours is None or ours.unit != theirs.unit:
                self._skip_theirs(theirs, table.unlike.get(theirs.code, ""))
            else:
                pairs.append((theirs, ours))
        sources = scale_sources(self.profile)
        for theirs, ours in sorted(pairs, key=lambda pair: pair[1].code not in sources):
            raw = self.source.raws[theirs.code]
            if theirs.code in self.source.lossy and not self.options.rounded:
                self._skip(ours.code, "rounding", self.source.notes[theirs.code])
            else:
                self._consider(ours, self._typed(self.source_profile, theirs, raw), raw)
        for code, text in self.source.unknown.items():
            reason = f"the profile {self.source_profile.id} does not have it"
            self._skip(f"{self.source_profile.id} {code}", "unknown", reason, text)
        for code, why in self.source.absent.items():
            absent = self.source_profile.get(code)
            if absent is not None and is_setting(self.source_profile, absent):
                key = f"{self.source_profile.id} {code}"
                self._skip(key, "absent", f"it is not in the set: {why}")

    def _skip_theirs(self, parameter: Parameter, reason: str = "") -> None:
        raw = self.source.raws[parameter.code]
        raws = self.source.raws
        value = shown(self.source_profile, parameter, raw, raws, lacking(self.source_profile, raws))
        key = f"{self.source_profile.id} {parameter.code}"
        if is_setting(self.source_profile, parameter):
            text = f"{self.profile.name} has no parameter that certainly means the same"
            text = reason or text
            self._skip(key, "no counterpart", text, value.display)

    def _typed(self, profile: Profile, parameter: Parameter, raw: int) -> str:
        """Return the set's value as text with its unit, which is valid for every scale."""
        absent = lacking(profile, self.source.raws)
        number = number_of(profile, parameter, raw, self.source.raws, absent)
        if raw in profile.names(parameter) or number is None:
            return shown(profile, parameter, raw, self.source.raws, absent).text
        return f"{number:f} {parameter.unit}".rstrip()

    def _consider(self, parameter: Parameter, typed: str, raw: int) -> None:
        """Plan the write of a parameter, or note why it is skipped."""
        code = parameter.code
        if (reason := self._reason_against(parameter)) is not None:
            new = self._new_text(parameter, typed, raw)
            if reason[0] != "no setting" and self._holds(parameter, new):
                self.items[code] = RestoreItem(code, "equal", "", "", new, new)
            else:
                self._skip(code, *reason, new)
            return
        edit = Edit(code, typed, self.held.raws[code], raw)
        try:
            Edits().stage_many(
                self.profile,
                [*self._scales(parameter), edit],
                self.held.raws,
                self.held.lacking,
            )
        except ValueRefused as error:
            self._skip(code, "range", str(error), self._new_text(parameter, typed, raw))
        else:
            self._wanted[code] = edit

    def _scales(self, parameter: Parameter) -> list[Edit]:
        return [e for c, e in self._wanted.items() if c == parameter.scale_source]

    def _new_text(self, parameter: Parameter, typed: str, raw: int) -> str:
        if typed:
            return typed
        return shown(self.profile, parameter, raw, self.source.raws).display

    def _holds(self, parameter: Parameter, text: str) -> bool:
        """Return True if the drive has the same value, so that skipping it changes nothing."""
        held = self.held
        raw = held.raws.get(parameter.code)
        if raw is None:
            return False
        return shown(self.profile, parameter, raw, held.raws, held.lacking).display == text

    def _reason_against(self, parameter: Parameter) -> tuple[SkipReason, str] | None:
        code, options = parameter.code, self.options
        if not is_setting(self.profile, parameter):
            return "no setting", "it is a measurement, a counter or a command"
        if parameter.forbidden:
            return "forbidden", parameter.forbidden
        if not is_verified(parameter) and code not in options.confirmed:
            return "unverified", "no document of this family confirms its address"
        setting = line_setting(self.profile, code)
        if setting is not None and setting.role in CUTTING and not options.line_settings:
            return "line", "it is a line setting, and would change how this drive is reached"
        if self.same_rating is False and not options.rating and rated(parameter):
            return "rating", "it depends on the rating, and the set is of another rating or model"
        if code not in self.held.raws:
            return "absent", self.held.absent.get(code, "this drive does not report it")
        return None

    def settle(self) -> None:
        """Turn planned values into edits within each other's limits; note the rest as skipped."""
        while True:
            self.edits = Edits().stage_many(
                self.profile, self._wanted.values(), self.held.raws, self.held.lacking
            )
            lossy = {} if self.options.rounded else self._lossy()
            wrong = edit_problems(self.profile, self.edits, self.held.raws)
            if not (wrong or lossy):
                break
            for code, text in {**wrong, **lossy}.items():
                edit = self._wanted.pop(code)
                reason: SkipReason = "rounding" if code in lossy else "range"
                self._skip(code, reason, text, edit.typed or edit.text)
        self._tell(self.edits.requested)
        order = {p.code: place for place, p in enumerate(self.profile.parameters)}
        self.items = dict(
            sorted(self.items.items(), key=lambda pair: order.get(pair[0], len(order)))
        )

    def _lossy(self) -> dict[str, str]:
        """Return, by code, the remark on each value that rounding would change."""
        by_hand = {} if self._across else {c: self.source.notes[c] for c in self.source.lossy}
        changed = {edit.code for edit in self.edits}
        found = {edit.code: edit.loss for edit in self.edits if edit.lossy}
        return found | {
            c: text for c, text in by_hand.items() if c in changed and c in self._wanted
        }

    def _tell(self, edits: Iterable[Edit]) -> None:
        for edit in edits:
            kind: ItemKind = "equal" if edit.new == edit.old else "write"
            note = "" if self._across else self.source.notes.get(edit.code, "")
            reported = f"{note} {edit.remark}".strip()
            self.items[edit.code] = RestoreItem(
                edit.code, kind, "", reported, edit.old_text, edit.text
            )

    def _skip(self, code: str, reason: SkipReason, text: str, new: str = "") -> None:
        raw = self.held.raws.get(code)
        parameter = self.profile.get(code)
        old = ""
        if raw is not None and parameter is not None:
            raws = self.held.raws
            old = shown(self.profile, parameter, raw, raws, self.held.lacking).display
        self.items[code] = RestoreItem(code, "skip", reason, text, old, new)
