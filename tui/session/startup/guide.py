"""File of a guided start-up: found, read and checked, each fault with its line."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

import msgspec

from tui.drive.errors import ProfileError
from tui.drive.profile.help_file import decode_tables, line_of
from tui.drive.profile.library import packaged_folder, user_folder
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import StartUpStep
from tui.drive.profile.shared_rows import source_text
from tui.drive.profile.toml_lines import TomlPath
from tui.drive.sentences import any_of
from tui.drive.values import is_enumeration

from .steps import GuideField, GuideStep, GuideTables

GUIDE_FOLDER = "startup"
STOP_COMMANDS = ("stop", "quick-stop", "freewheel", "emergency-stop", "dc-braking")
NO_GUIDE = "There is no start-up for {name}. Put {id}.toml into {folder}, or press Ctrl+O."


class Guide(NamedTuple):
    """The steps of a start-up, with the texts of the profile filled in."""

    path: Path
    title: str
    steps: tuple[GuideStep, ...]

    @property
    def codes(self) -> list[str]:
        """Codes of all parameters of all steps, each once."""
        return list(dict.fromkeys(code for step in self.steps for code in step.codes))


def guide_folders() -> tuple[Path, Path]:
    """Return the folder of the user's files, which come first, and of the packaged ones."""
    return user_folder() / GUIDE_FOLDER, packaged_folder() / GUIDE_FOLDER


def find_guide(profile: Profile) -> Guide:
    """Read the file of a family. Raises ProfileError: no file, or each fault with its line."""
    name = f"{profile.id}.toml"
    found = next((folder / name for folder in guide_folders() if (folder / name).is_file()), None)
    if found is None:
        folder = guide_folders()[0]
        raise ProfileError(NO_GUIDE.format(name=profile.name, id=profile.id, folder=folder))
    return read_guide(found, profile)


def read_guide(path: Path, profile: Profile) -> Guide:
    """Read and check a file for a family. Raises ProfileError with each fault, file and line."""
    source = source_text(path)
    tables = decode_tables(source, GuideTables)
    faults = list(_faults(tables, profile))
    if faults:
        lines = [f"{path}:{line_of(source, place)}: {fault}." for place, fault in faults]
        raise ProfileError("\n".join(lines))
    known = {step.step: step for step in profile.data.start_up}
    steps = tuple(_complete(step, known) for step in tables.steps)
    return Guide(path, tables.startup.title or f"Start-up of {profile.name}", steps)


def _complete(step: GuideStep, known: Mapping[str, StartUpStep]) -> GuideStep:
    """Fill in what the step takes from the profile."""
    base = known.get(step.from_profile)
    if base is None:
        return step
    keys = ("text", "note", "source", "confidence", "parameters")
    taken = {key: getattr(base, key) for key in keys if not getattr(step, key)}
    return msgspec.structs.replace(step, **taken)


def _faults(tables: GuideTables, profile: Profile) -> Iterator[tuple[TomlPath, str]]:
    if tables.startup.profile != profile.id:
        text = f"the file is for {tables.startup.profile!r}, not for {profile.id}"
        yield ("startup", "profile"), text
        return
    seen: set[str] = set()
    for index, step in enumerate(tables.steps):
        for key, fault in (*_text_faults(step, profile), *_work_faults(step, profile)):
            yield ("steps", index, key), f"step {index + 1} {step.step!r}: {fault}"
        if step.step in seen:
            yield ("steps", index, "step"), f"there are two steps {step.step!r}"
        seen.add(step.step)


def _text_faults(step: GuideStep, profile: Profile) -> Iterator[tuple[str, str]]:
    known = [row.step for row in profile.data.start_up]
    if step.from_profile and step.from_profile not in known:
        text = f"{step.from_profile!r} is not a step of {profile.id}. It has {any_of(known)}"
        yield "from_profile", text
    elif not step.from_profile:
        for key in ("text", "source", "confidence"):
            if not getattr(step, key):
                yield "step", f"`{key}` is missing, and there is no `from_profile`"
    for key in ("parameters", "plate", "expect"):
        for code in getattr(step, key):
            yield from _code_faults(key, code, profile)
    for key in ("rated", "reverse"):
        if code := getattr(step, key):
            yield from _code_faults(key, code, profile)


def _code_faults(key: str, code: str, profile: Profile) -> Iterator[tuple[str, str]]:
    parameter = profile.get(code)
    if parameter is None:
        yield key, f"{code!r} is not a parameter of {profile.name}"
    elif key in ("plate", "rated") and (parameter.bits or is_enumeration(parameter)):
        yield key, f"{code} is not a number"
    elif key in ("plate", "rated") and not parameter.unit and parameter.scale == "1":
        yield key, f"the scale of {code} is unknown: a typed number cannot be compared"
    elif key == "reverse" and len(profile.names(parameter)) != 2:
        yield key, f"{code} does not have exactly two values"


def _work_faults(step: GuideStep, profile: Profile) -> Iterator[tuple[str, str]]:
    if step.kind == "record" and not step.fields:
        yield "kind", "a step that is only recorded needs `fields`"
    if step.kind == "speeds" and (not step.hz or profile.quantity("output_frequency") is None):
        yield "kind", f"{profile.name} needs an output frequency, and the step needs `hz`"
    if step.kind == "direction":
        if len(step.hz) > 1:
            yield "hz", "a direction check has one reference"
        if not step.reverse and not step.remedy:
            yield "kind", "name `reverse` or `remedy`, for a motor that turns the wrong way"
    by_address = any(parameter.eeprom_address is not None for parameter in profile.parameters)
    if step.kind == "save" and profile.data.memory.save is None and not by_address:
        yield "kind", f"{profile.name} has no command that saves to EEPROM"
    if step.kind == "loss" and profile.data.communication_fault is None:
        yield "kind", f"{profile.name} has no communication timeout"
    if step.kind == "stops" and not step.methods:
        yield "kind", "`methods` is missing"
    orders = {order.id for chart in profile.data.charts for order in chart.orders}
    stops = [name for name in STOP_COMMANDS if name in orders]
    for method in step.methods:
        if method not in stops:
            text = f"{method!r} is not a stop of {profile.name}. It has {any_of(stops)}"
            yield "methods", text
    yield from _field_faults(step.fields)


def _field_faults(fields: list[GuideField]) -> Iterator[tuple[str, str]]:
    kinds = {field.name: field.kind for field in fields}
    if len(kinds) < len(fields):
        yield "fields", "two fields have the same name"
    for field in fields:
        if field.least and (field.kind, kinds.get(field.least)) != ("number", "number"):
            yield "fields", f"{field.name!r} and its `least` {field.least!r} must be number fields"
