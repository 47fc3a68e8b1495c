"""Assignments as text: TOML, one line per slot, to be read, compared and edited by hand."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any

import tomli

from ..errors import DriveError
from ..plain import plain
from ..profile.profile import Profile
from ..profile.schema import Block
from ..toml_text import toml_tables
from .assignment import UNUSED, Assignment, MappingError, slot_target
from .picking import raw_named

BLOCK_FILE_FORMAT = 1
HEAD = "mapping"
END_OF_BLOCKS = "end"
_AT = re.compile(r"\(at line (\d+), column \d+\)|\(at end of document\)")
_TABLE = re.compile(r"\s*\[\s*\"?([A-Za-z0-9_.-]+)\"?\s*\]")
_KEY = re.compile(r"\s*(?:\"([^\"]*)\"|'([^']*)'|([A-Za-z0-9_-]+))\s*=")


def dump_blocks(profile: Profile, plans: Sequence[Assignment], note: str = "") -> str:
    """Return the text of a file with these assignments; `note` is put into its first lines."""
    lines = [f"# {plain(line)}" for line in note.splitlines()]
    lines += [f"[{HEAD}]", f"format = {BLOCK_FILE_FORMAT}", f"profile = {json.dumps(profile.id)}"]
    for plan in plans:
        lines += ["", f"[{plan.block.id}]"]
        lines += [_line(profile, plan.block, slot, raw) for slot, raw in plan.slots.items()]
    count = sum(len(plan.raws) for plan in plans)
    return "\n".join([*lines, "", f"[{END_OF_BLOCKS}]", f"slots = {count}", ""])


def load_blocks(text: str, file: str, profile: Profile) -> dict[str, Assignment]:
    """Return the assignments in a text, by the id of their block.

    Raises MappingError, with file and line, if the text is cut short, is of another family, or has
    an invalid slot or value.
    """
    try:
        tables = toml_tables(text)
    except tomli.TOMLDecodeError as error:
        raise _syntax(text, file, error) from error
    lines = _lines(text)
    _check_head(tables, file, lines, profile)
    blocks = {block.id: block for block in profile.data.blocks}
    found: dict[str, Assignment] = {}
    for name, table in tables.items():
        if name in (HEAD, END_OF_BLOCKS):
            continue
        if name not in blocks or not isinstance(table, dict):
            known = ", ".join(blocks) or "none"
            raise _fault(
                file, lines, name, "", f"{profile.name} has no block {name!r}. It has {known}."
            )
        found[name] = _assignment(profile, blocks[name], table, file, lines)
    _check_end(tables, file, text, lines, sum(len(plan.raws) for plan in found.values()))
    return found


def _line(profile: Profile, block: Block, slot: str, raw: int) -> str:
    parameter = slot_target(profile, block, raw)
    if raw == UNUSED:
        return f'{slot} = "none"'
    if parameter is None:
        return f"{slot} = {raw}  # not known"
    comment = plain(f"{parameter.number} {parameter.name}")
    return f"{slot} = {json.dumps(parameter.code)}  # {comment}"


def _assignment(
    profile: Profile,
    block: Block,
    table: Mapping[str, Any],
    file: str,
    lines: Mapping[tuple[str, str], int],
) -> Assignment:
    for slot in table:
        if slot not in block.slots:
            slots = ", ".join(block.slots)
            text = f"{slot!r} is not a slot of {block.name}. Use {slots}."
            raise _fault(file, lines, block.id, slot, text)
    missing = [slot for slot in block.slots if slot not in table]
    if missing:
        text = f'{missing[0]} is missing in [{block.id}]. Write "none" for an unused slot.'
        raise _fault(file, lines, block.id, "", text)
    raws = []
    for slot in block.slots:
        try:
            raws.append(_raw(profile, block, table[slot]))
        except DriveError as error:
            raise _fault(file, lines, block.id, slot, f"{slot}: {error}") from error
    return Assignment(block, tuple(raws))


def _raw(profile: Profile, block: Block, value: object) -> int:
    """Return the raw value of a slot: a text names a parameter, a number is the raw value
    itself."""
    if isinstance(value, str):
        return raw_named(profile, block, value)
    if isinstance(value, bool) or not isinstance(value, int):
        raise MappingError(f"{value!r} is neither a code nor a number.")
    if not 0 <= value <= 0xFFFF:
        raise MappingError(f"{value} is not a word. Use 0 to 65535.")
    if (
        value != UNUSED
        and block.selects_by == "choice"
        and slot_target(profile, block, value) is None
    ):
        count = len(block.choices)
        raise MappingError(f"{value} is not one of the {count} choices of the block.")
    return value


def _check_head(
    tables: Mapping[str, Any],
    file: str,
    lines: Mapping[tuple[str, str], int],
    profile: Profile,
) -> None:
    head = tables.get(HEAD)
    if not isinstance(head, dict) or "format" not in head:
        raise MappingError(f"{file}:1: not an assignment: [{HEAD}] with format is missing.")
    if head["format"] != BLOCK_FILE_FORMAT:
        text = (
            f"this assignment has format {head['format']}; this panel reads format"
            f" {BLOCK_FILE_FORMAT}."
        )
        raise _fault(file, lines, HEAD, "format", text)
    if head.get("profile") != profile.id:
        text = f"this assignment is for {head.get('profile')!r}, the drive is {profile.id!r}."
        raise _fault(file, lines, HEAD, "profile", text)


def _check_end(
    tables: Mapping[str, Any],
    file: str,
    text: str,
    lines: Mapping[tuple[str, str], int],
    count: int,
) -> None:
    """Raise MappingError unless the end states the number of slots in the file."""
    end = tables.get(END_OF_BLOCKS)
    if not isinstance(end, dict):
        last = text.count("\n") + 1
        raise MappingError(
            f"{file}:{last}: the file is cut short: its [{END_OF_BLOCKS}] is missing."
        )
    if end.get("slots") != count:
        reported = f"[{END_OF_BLOCKS}] states {end.get('slots')} slots, the file has {count}."
        raise _fault(file, lines, END_OF_BLOCKS, "slots", reported)


def _syntax(text: str, file: str, error: Exception) -> MappingError:
    match = _AT.search(str(error))
    line = int(match[1]) if match and match[1] else text.count("\n") + 1
    return MappingError(f"{file}:{line}: not an assignment: {_AT.sub('', str(error)).strip()}.")


def _fault(
    file: str, lines: Mapping[tuple[str, str], int], table: str, key: str, text: str
) -> MappingError:
    line = lines.get((table, key)) or lines.get((table, "")) or 1
    return MappingError(f"{file}:{line}: {text}")


def _lines(text: str) -> dict[tuple[str, str], int]:
    """Return line numbers by table and key; a table's own line has an empty key."""
    found: dict[tuple[str, str], int] = {}
    table = ""
    for number, line in enumerate(text.splitlines(), start=1):
        if match := _TABLE.match(line):
            table = match[1]
            found.setdefault((table, ""), number)
        elif match := _KEY.match(line):
            found.setdefault((table, match[1] or match[2] or match[3] or ""), number)
    return found
