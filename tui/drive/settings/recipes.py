"""Recipes of a line: for each drive, the settings of the machine and those of the drive itself.

Both are parameter sets. A value of the drive counts instead of the same one of the machine. Motor
data, ratings and line settings count from the set of the drive only.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal, TypeVar

from msgspec import Meta

from ..errors import DriveError, ProfileError
from ..plain import escaped_toml
from ..profile import library
from ..profile.help_file import decode_tables, line_of
from ..profile.profile import Profile
from ..profile.schema import Table
from ..profile.shared_rows import source_text
from ..shown import depends_on
from ..small_file import read_small_text
from .compare import ComparedRow, Side, compare_settings, side_of
from .parameter_set import ParameterSet
from .rating import rated
from .set_file import read_set
from .writable import CUTTING, line_setting

T = TypeVar("T")

_HEAD = re.compile(r"^\s*\[\[\s*recipes\s*\]\]", re.MULTILINE)


class Recipe(Table, frozen=True, kw_only=True):
    """One drive of a recipe file."""

    device: Annotated[int, Meta(ge=1, le=247)]
    profile: str
    machine: str = ""
    """Parameter set shared by the drives of the machine, relative to this file."""
    drive: str = ""
    """Parameter set of this drive only."""
    ignore: list[str] = []
    """Codes that may differ."""


class RecipeList(Table, frozen=True, kw_only=True):
    """A recipe file."""

    format: Literal[1]
    name: str = ""
    """Name for a person, such as that of a product."""
    recipes: Annotated[list[Recipe], Meta(min_length=1, max_length=247)]


@dataclass(frozen=True, slots=True)
class DriveRecipe:
    """Settings that one drive is to have."""

    device: int
    profile: Profile
    values: ParameterSet
    """Merged set of machine and drive, without the codes that may differ."""
    left: tuple[str, ...] = ()
    """Codes of motor data and ratings in the set of the machine; they do not count."""
    name: str = ""
    """Name of the file's recipes."""

    @property
    def raws(self) -> Mapping[str, int]:
        """Raw values by code."""
        return self.values.raws

    def differences(self, values: ParameterSet, *, all_rows: bool = False) -> list[ComparedRow]:
        """Return the settings of the recipe that differ in the drive; all with `all_rows`.

        Address, baud rate and format belong to the line and are not compared.
        """
        links = self.profile.data.link.settings
        left = {s.parameter: "line setting" for s in links if s.role in CUTTING}
        sides = Side("recipe", self.raws, left=left), side_of("drive", values)
        rows = compare_settings(self.profile, *sides, all_rows=all_rows)
        return [row for row in rows if row.code in self.raws]


def is_recipe_file(path: Path) -> bool:
    """Return True if a file has recipes, right or wrong."""
    try:
        return path.suffix == ".toml" and _HEAD.search(read_small_text(path)) is not None
    except (OSError, UnicodeDecodeError):
        return False


def read_recipes(path: Path) -> list[DriveRecipe]:
    """Read a recipe file and its sets. Raises ProfileError with each fault, its file and line."""
    source = source_text(path)
    listed = decode_tables(source, RecipeList)
    recipes = listed.recipes
    faults: list[str] = []
    found: list[DriveRecipe] = []
    for index, recipe in enumerate(recipes):
        twice = any(other.device == recipe.device for other in recipes[:index])
        texts = [f"device {recipe.device} has two recipes."] if twice else []
        left: tuple[str, ...] = ()
        try:
            profile = library.load(recipe.profile)
            texts += _faults(recipe, profile)
            sets = [_set(path, name, profile) for name in (recipe.machine, recipe.drive) if name]
            if recipe.machine:
                others = [code for code in sets[0].raws if belongs_to_drive(profile, code)]
                left = tuple(code for code in others if rated(profile[code]))
                sets[0] = _without(sets[0], others)
            if sets:
                values = _merged(sets)
                texts += _scale_faults(profile, values.raws, values.absent)
                values = _without(values, recipe.ignore)
                found.append(DriveRecipe(recipe.device, profile, values, left, listed.name))
        except DriveError as error:
            texts.append(str(error))
        line = line_of(source, ("recipes", index))
        faults += [f"{path}:{line}: {text}" for text in texts]
    if faults:
        raise ProfileError("\n".join(faults))
    return found


def belongs_to_drive(profile: Profile, code: str) -> bool:
    """Return True for motor data, ratings and line settings: each drive has its own."""
    setting = line_setting(profile, code)
    return (setting is not None and setting.role in CUTTING) or rated(profile[code])


def _merged(sets: Sequence[ParameterSet]) -> ParameterSet:
    """Return one set; a value of a later set counts instead of an earlier one."""
    values = sets[0]
    for later in sets[1:]:
        earlier = _without(values, later.raws)
        values = replace(
            later,
            raws={**earlier.raws, **later.raws},
            absent={**earlier.absent, **later.absent},
            unknown={**earlier.unknown, **later.unknown},
            notes={**earlier.notes, **later.notes},
            lossy=earlier.lossy | later.lossy,
        )
    return replace(values, absent={c: t for c, t in values.absent.items() if c not in values.raws})


def _without(values: ParameterSet, codes: Collection[str]) -> ParameterSet:
    def kept(texts: Mapping[str, T]) -> dict[str, T]:
        return {code: text for code, text in texts.items() if code not in codes}

    return replace(
        values,
        raws=kept(values.raws),
        absent=kept(values.absent),
        notes=kept(values.notes),
        lossy=values.lossy - frozenset(codes),
    )


def _faults(recipe: Recipe, profile: Profile) -> Iterator[str]:
    if not recipe.machine and not recipe.drive:
        yield "name a set: machine, drive or both."
    for code in recipe.ignore:
        if profile.get(code) is None:
            yield f"ignore: {code!r} is not a parameter of {profile.name}."


def _scale_faults(
    profile: Profile, raws: Mapping[str, int], absent: Collection[str]
) -> Iterator[str]:
    """Yield each setting whose scale is not in the sets: its raw value may mean another one."""
    for code in raws:
        for source in depends_on(profile[code]):
            if source not in raws and source not in absent:
                yield f"{code} depends on {source}, which is in no set: add its line."


def _set(path: Path, name: str, profile: Profile) -> ParameterSet:
    """Return a set. Raises SetError, and ProfileError for a set of another family."""
    values = read_set(path.parent / name)
    if values.head.profile != profile.id:
        raise ProfileError(f"{name} is a set of {values.head.profile}, not of {profile.id}.")
    return values


def split_sets(
    profile: Profile, sets: Sequence[ParameterSet]
) -> tuple[ParameterSet, list[ParameterSet]]:
    """Return the set that drives of one family share, and the rest of each.

    Shared are settings with one value in all of them, on one scale. Motor data, ratings and line
    settings stay with each drive. So do the sources of scales of the settings in a rest: without
    them, a person could not edit its values in their units.
    """
    first = sets[0]
    shared = {
        code: raw
        for code, raw in first.raws.items()
        if not belongs_to_drive(profile, code) and all(s.raws.get(code) == raw for s in sets)
    }
    # a raw value means the same only if its scale is the same in all drives
    while apart := [*_on_own_scale(profile, shared), *_scales_of_rests(profile, sets, shared)]:
        for code in apart:
            shared.pop(code, None)
    head = replace(first.head, line="", device=0, identity={})
    return ParameterSet(head, shared), [_without(each, shared) for each in sets]


def _on_own_scale(profile: Profile, shared: Collection[str]) -> list[str]:
    """Return the shared settings whose scale is not shared."""
    return [code for code in shared if any(s not in shared for s in depends_on(profile[code]))]


def _scales_of_rests(
    profile: Profile, sets: Sequence[ParameterSet], shared: Collection[str]
) -> list[str]:
    """Return the shared sources of scales of settings that are not shared."""
    own = {code for each in sets for code in each.raws if code not in shared}
    return list({source for code in own for source in depends_on(profile[code])} & {*shared})


def dump_recipes(rows: Sequence[tuple[int, str, str, str]]) -> str:
    """Return the text of a recipe file; a row is device, profile, files of machine and drive."""
    keys = ("profile", "machine", "drive")
    lines = ["# Recipes of a line. See docs/parameter-sets.md.", "format = 1"]
    for device, *texts in rows:
        lines += ["", "[[recipes]]", f"device = {device}"]
        lines += [f"{k} = {escaped_toml(text)}" for k, text in zip(keys, texts, strict=True)]
    return "\n".join([*lines, ""])
