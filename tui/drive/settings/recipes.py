"""Recipes of a line: for each drive, the settings of the machine and those of the drive itself.

Both are parameter sets. A value of the drive counts instead of the same one of the machine.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta

from ..errors import DriveError, ProfileError
from ..profile import library
from ..profile.help_file import decode_tables, line_of
from ..profile.profile import Profile
from ..profile.schema import Table
from ..profile.shared_rows import source_text
from ..shown import depends_on
from ..small_file import read_small_text
from .compare import ComparedRow, Side, compare_settings, side_of
from .parameter_set import ParameterSet
from .set_file import read_set
from .writable import CUTTING

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
    recipes: Annotated[list[Recipe], Meta(min_length=1, max_length=247)]


@dataclass(frozen=True, slots=True)
class DriveRecipe:
    """Settings that one drive is to have."""

    device: int
    profile: Profile
    raws: Mapping[str, int]
    ignore: frozenset[str]

    def differences(self, values: ParameterSet, *, all_rows: bool = False) -> list[ComparedRow]:
        """Return the settings of the recipe that differ in the drive; all with `all_rows`.

        Address, baud rate and format belong to the line and are not compared.
        """
        links = self.profile.data.link.settings
        left = {s.parameter: "line setting" for s in links if s.role in CUTTING}
        sides = Side("recipe", self.raws, left=left), side_of("drive", values)
        rows = compare_settings(self.profile, *sides, all_rows=all_rows)
        return [row for row in rows if row.code in self.raws and row.code not in self.ignore]


def is_recipe_file(path: Path) -> bool:
    """Return True if a file has recipes, right or wrong."""
    try:
        return path.suffix == ".toml" and _HEAD.search(read_small_text(path)) is not None
    except (OSError, UnicodeDecodeError):
        return False


def read_recipes(path: Path) -> list[DriveRecipe]:
    """Read a recipe file and its sets. Raises ProfileError with each fault, its file and line."""
    source = source_text(path)
    recipes = decode_tables(source, RecipeList).recipes
    faults: list[str] = []
    found: list[DriveRecipe] = []
    for index, recipe in enumerate(recipes):
        twice = any(other.device == recipe.device for other in recipes[:index])
        texts = [f"device {recipe.device} has two recipes."] if twice else []
        try:
            profile = library.load(recipe.profile)
            texts += _faults(recipe, profile)
            sets = [_set(path, name, profile) for name in (recipe.machine, recipe.drive) if name]
            raws = {code: raw for each in sets for code, raw in each.raws.items()}
            absent = {code for each in sets for code in each.absent}
            texts += _scale_faults(profile, raws, absent)
            found.append(DriveRecipe(recipe.device, profile, raws, frozenset(recipe.ignore)))
        except DriveError as error:
            texts.append(str(error))
        line = line_of(source, ("recipes", index))
        faults += [f"{path}:{line}: {text}" for text in texts]
    if faults:
        raise ProfileError("\n".join(faults))
    return found


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
