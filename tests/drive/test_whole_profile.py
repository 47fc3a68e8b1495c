"""All faults of a profile with a row in nearly every table, each broken in one place.

`whole_profile_faults.txt` has, for each change, its place, the new value, and below it all faults
with their places. A place is a path from the top of the file, and rows count from 0.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

from tui.drive.errors import ProfileError
from tui.drive.profile import check, library
from tui.drive.profile.converting import converted
from tui.drive.profile.rules import CHECKED_RULES
from tui.drive.profile.rules.names import named_parameters
from tui.drive.profile.schema import ProfileData
from tui.drive.profile.shared_rows import ProfileTables
from tui.drive.profile.toml_lines import TomlPath

HERE = Path(__file__).parent
WHOLE = HERE / "whole.toml"
FAULTS = HERE / "whole_profile_faults.txt"
NOTHING = "no fault"


class Placed(ProfileTables):
    """Tables whose places are shown as paths, without a file."""

    def place(self, path: TomlPath) -> tuple[str, int]:
        return ".".join(map(str, path)) or "-", 0


def faults_of(tables: dict[str, Any]) -> list[str]:
    sources = Placed(tables)
    try:
        data = converted(tables, ProfileData)
    except msgspec.ValidationError:
        faults = check._faults_of_form(sources, CHECKED_RULES)
    else:
        faults = check._in_order(check._placed(sources, check._broken_rules(data, CHECKED_RULES)))
    return [f"{fault.file}: {fault.text}" for fault in faults] or [NOTHING]


def change(tables: dict[str, Any], place: str, value: str) -> dict[str, Any]:
    """The tables with another value at a place, or without it; what stays is shared."""
    changed: Any = dict(tables)
    node: Any = changed
    *path, last = place.split(".")
    for step in path:
        key = int(step) if isinstance(node, list) else step
        node[key] = list(node[key]) if isinstance(node[key], list) else dict(node[key])
        node = node[key]
    key = int(last) if isinstance(node, list) else last
    if value == "absent":
        del node[key]
    else:
        node[key] = json.loads(value)
    return changed  # type: ignore[no-any-return]


def changes() -> Iterator[tuple[str, str, list[str]]]:
    for block in FAULTS.read_text("utf-8").split("\n\n"):
        head, *faults = block.strip("\n").split("\n")
        place, _, value = head.partition(" = ")
        yield place, value, [fault.strip() for fault in faults]


def write_faults() -> None:
    """Write the faults of the same changes as they are now."""
    tables = tomllib.loads(WHOLE.read_text("utf-8"))
    blocks = []
    for place, value, _ in changes():
        faults = faults_of(change(tables, place, value))
        blocks.append("\n".join([f"{place} = {value}", *(f"  {fault}" for fault in faults)]))
    FAULTS.write_text("\n\n".join(blocks) + "\n", "utf-8")


@pytest.mark.parametrize("part", range(8))
def test_each_change_of_a_whole_profile_has_its_faults(part: int) -> None:
    tables = tomllib.loads(WHOLE.read_text("utf-8"))
    assert faults_of(tables) == [NOTHING]
    rows = list(changes())[part::8]
    for place, value, faults in rows:
        assert faults_of(change(tables, place, value)) == faults, f"{place} = {value}"


def test_error_of_a_profile_names_ten_faults_and_counts_the_others(tmp_path: Path) -> None:
    path = tmp_path / "whole.toml"
    text = WHOLE.read_text("utf-8")
    lines = [n for n, line in enumerate(text.splitlines(), 1) if line == 'access = "r"']
    for count in (10, 12):
        path.write_text(text.replace('access = "r"', 'access = "x"', count), "utf-8")
        with pytest.raises(ProfileError) as refused:
            library.load_file(path)
        faults = str(refused.value).splitlines()
        assert [fault.split(": ")[0] for fault in faults[:10]] == [
            f"{path}:{n}" for n in lines[:10]
        ]
        more = ["... and 2 more faults; profiles --check lists all."] if count == 12 else []
        assert faults[10:] == more
        assert faults[0].endswith(
            ": parameters.#1.access (STAT): 'x' is not an allowed value. Allowed: r, rw,"
            " rw-stopped, w."
        )


def at_path(data: Any, path: TomlPath) -> Any:
    """The content of a profile at a place."""
    for step in path:
        is_row = not isinstance(data, msgspec.Struct)
        data = data[step] if is_row else getattr(data, str(step))
    return data


def texts_at(node: Any, path: TomlPath = ()) -> Iterator[tuple[TomlPath, str]]:
    """All texts of a profile, with their places."""
    match node:
        case msgspec.Struct():
            node = {name: getattr(node, name) for name in node.__struct_fields__}
        case list() | tuple():
            node = dict(enumerate(node))
    if isinstance(node, dict):
        for step, part in node.items():
            yield from texts_at(part, (*path, step))
    elif isinstance(node, str):
        yield path, node


@pytest.mark.parametrize("name", ["whole", "atv21"])
def test_each_place_that_names_a_parameter_holds_its_code(name: str) -> None:
    profile = library.load_file(WHOLE) if name == "whole" else library.load(name)
    named = dict(named_parameters(profile.data))
    for place, code in named.items():
        held = dict(texts_at(at_path(profile.data, place)))
        assert (code or "") in (held.values() if held else [""]), (place, code)


def test_each_place_that_holds_a_code_is_checked() -> None:
    """But for the code of a parameter itself, texts, and the help for faults."""
    data = library.load_file(WHOLE).data
    named = dict(named_parameters(data))
    codes = {parameter.code for parameter in data.parameters}
    left = {
        ".".join(map(str, place))
        for place, text in texts_at(data)
        if text in codes and not any(place[:length] in named for length in range(len(place) + 1))
    }
    own = {f"parameters.{index}.code" for index in range(len(data.parameters))}
    assert left - own == {
        "faults.help.0.look_at.0.code",
        "faults.help.0.supported.0.parameter",
        "signal_paths.0.switches.0.name",
    }
