"""Form check of a profile's tables: every fault, with the allowed values."""

from __future__ import annotations

import difflib
import math
import re
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import msgspec.inspect as shapes

from tui.drive.sentences import any_of, counted

from .schema import ProfileData
from .toml_lines import TomlPath

LISTED_SINGLY = 14
"""Most allowed values to list; of a longer list, only the nearest are named."""
TEXT_FORMS = {
    r"^[0-9]+(\.[0-9]+)?$": 'a decimal number in quotes, such as "0.1"',
    r"^[a-z][a-z0-9_-]*$": "small letters, digits, - and _, a letter first",
    r"^8[NEO][12]$": "8N1, 8N2, 8E1 or 8O1",
}
_ABSENT = object()


@dataclass(slots=True)
class FormFaults:
    """Form errors of some tables, and the tables with the errors corrected."""

    found: list[tuple[TomlPath, str]] = field(default_factory=list)
    invented: list[TomlPath] = field(default_factory=list)
    """Places with a made-up value, which later checks must skip."""


@lru_cache(maxsize=4)
def shape_of(form: type) -> shapes.Type:
    """Return the fields of a form of files, with their types."""
    return shapes.type_info(form)


def form_faults(
    tables: dict[str, Any], form: type = ProfileData
) -> tuple[FormFaults, dict[str, Any]]:
    """Return all faults of form, and tables without them, so that further checks can run."""
    faults = FormFaults()
    mended = _mended(shape_of(form), tables, (), faults)
    return faults, mended if isinstance(mended, dict) else {}


def _mended(shape: shapes.Type, value: Any, path: TomlPath, faults: FormFaults) -> Any:
    """Return the value if its form is correct; else note the fault and return _ABSENT."""
    shape = _described(shape)
    if isinstance(shape, shapes.StructType) and isinstance(value, dict):
        return _struct(shape, value, path, faults)
    if isinstance(shape, shapes.ListType) and isinstance(value, list):
        return _list(shape, value, path, faults)
    if isinstance(shape, shapes.DictType) and isinstance(value, dict):
        kept = {k: _mended(shape.value_type, v, (*path, k), faults) for k, v in value.items()}
        return {key: item for key, item in kept.items() if item is not _ABSENT}
    if isinstance(shape, shapes.UnionType):
        inner = next(t for t in shape.types if not isinstance(t, shapes.NoneType))
        return _mended(inner, value, path, faults)
    if fault := _scalar_fault(shape, value):
        faults.found.append((path, fault))
        return _ABSENT
    return value


def _struct(
    shape: shapes.StructType, value: dict[str, Any], path: TomlPath, faults: FormFaults
) -> dict[str, Any]:
    fields = {field.encode_name: field for field in shape.fields}
    kept: dict[str, Any] = {}
    for key, inner in value.items():
        if key not in fields:
            faults.found.append(
                ((*path, key), _instead(f"`{key}` is not a field of this table", key, list(fields)))
            )
            continue
        item = _mended(fields[key].type, inner, (*path, key), faults)
        if item is not _ABSENT:
            kept[key] = item
    for key, one_field in fields.items():
        if one_field.required and key not in kept:
            if key not in value:
                faults.found.append((path, f"the field `{key}` is missing: {allowed(one_field)}"))
            faults.invented.append((*path, key))
            kept[key] = _invented(one_field.type)
    return kept


def _list(shape: shapes.ListType, value: list[Any], path: TomlPath, faults: FormFaults) -> Any:
    kept = []
    for index, inner in enumerate(value):
        item = _mended(shape.item_type, inner, (*path, index), faults)
        if item is _ABSENT:
            # the place stays in the list, so that the following ones keep their lines
            faults.invented.append((*path, index))
            item = _invented(shape.item_type)
        kept.append(item)
    if shape.min_length and len(value) < shape.min_length:
        faults.found.append((path, f"must have at least {_entries(shape.min_length)}"))
        return _ABSENT
    if shape.max_length and len(value) > shape.max_length:
        faults.found.append((path, f"must have at most {_entries(shape.max_length)}"))
        return _ABSENT
    return kept


def _entries(count: int) -> str:
    return counted(count, "1 entry", "{count} entries")


def _scalar_fault(shape: shapes.Type, value: Any) -> str:
    reported = _kind_of(value)
    match shape:
        case shapes.BoolType():
            return "" if isinstance(value, bool) else f"must be true or false, not {reported}"
        case shapes.IntType() | shapes.FloatType():
            return _number_fault(shape, value)
        case shapes.StrType(pattern=pattern):
            if not isinstance(value, str):
                return f"must be a text in quotes, not {reported}"
            if pattern and not re.search(pattern, value):
                form = TEXT_FORMS.get(pattern, pattern)
                return f"{value!r} has the wrong form; use {form}"
        case shapes.LiteralType(values=values):
            if value not in values or isinstance(value, bool):
                named = [text for text in values if text != ""]
                return _instead(f"{value!r} is not an allowed value", value, named)
        case shapes.ListType():
            single = reported.replace("a ", "a single ", 1)
            return f"must be {_kind(shape)}, not {single}"
        case _:
            return f"must be {_kind(shape)}, not {reported}"
    return ""


def _kind_of(value: Any) -> str:
    """Return the kind of a value in a TOML file, in words."""
    kinds = {
        bool: "true or false", int: "a number", float: "a number with a point", str: "a text",
        dict: "a table", list: "a list",
    }  # fmt: skip
    return kinds.get(type(value), "a date or time")


def _number_fault(shape: shapes.IntType | shapes.FloatType, value: Any) -> str:
    low, high = shape.ge, shape.le
    kinds = (int,) if isinstance(shape, shapes.IntType) else (int, float)
    if isinstance(value, bool) or not isinstance(value, kinds):
        wanted = "a whole number" if len(kinds) == 1 else "a number"
        return _within(f"must be {wanted}, not {_kind_of(value)}", low, high)
    if not math.isfinite(value):
        return _within(f"must be a finite number, not {value}", low, high)
    if low is not None and value < low:
        return _within(f"must be >= {low}, not {value}", low, high)
    if high is not None and value > high:
        return _within(f"must be <= {high}, not {value}", low, high)
    return ""


def _within(fault: str, low: object, high: object) -> str:
    """Return a fault of a number with the range, if it has one."""
    return fault if low is None and high is None else f"{fault}; allowed is {low} to {high}"


def _instead(fault: str, wrong: object, choice: Any) -> str:
    """Return a fault with the allowed values: all of them, or the nearest of very many."""
    texts = [str(item) for item in choice]
    near = difflib.get_close_matches(str(wrong), texts, n=3, cutoff=0.5)
    text = f"{fault}; did you mean {any_of(near)}?" if near else f"{fault}."
    if len(texts) <= LISTED_SINGLY:
        return f"{text} Allowed: {', '.join(texts)}"
    return f"{text} `drivepanel profiles --schema` lists all {len(texts)} allowed values"


def _described(shape: shapes.Type) -> shapes.Type:
    """Return the type of a field that has a description."""
    return shape.type if isinstance(shape, shapes.Metadata) else shape


def _kind(shape: shapes.Type) -> str:
    shape = _described(shape)
    match shape:
        case shapes.StructType():
            return f"a table with {', '.join(f.encode_name for f in shape.fields[:LISTED_SINGLY])}"
        case shapes.DictType():
            return "a table of names by raw value"
        case shapes.ListType():
            return f"a list whose entries are each {_kind(shape.item_type)}"
        case shapes.LiteralType(values=values):
            listed = ", ".join(map(str, values[:LISTED_SINGLY]))
            return f"the value {listed}" if len(values) == 1 else f"one of {listed}"
        case shapes.IntType(ge=low, le=high) | shapes.FloatType(ge=low, le=high):
            no_limit = low is None and high is None
            return "a number" if no_limit else f"a number from {low} to {high}"
        case shapes.BoolType():
            return "true or false"
        case shapes.UnionType(types=types):
            return _kind(types[0])
    return "a text in quotes"


def allowed(field: shapes.Field) -> str:
    """Return the allowed values of a field in words."""
    return _kind(field.type)


def _invented(shape: shapes.Type) -> Any:
    shape = _described(shape)
    match shape:
        case shapes.StructType(fields=fields):
            return {field.encode_name: _invented(field.type) for field in fields if field.required}
        case shapes.LiteralType(values=values):
            return values[0]
        case shapes.IntType(ge=low) | shapes.FloatType(ge=low):
            return low or 0
        case shapes.BoolType():
            return False
        case shapes.DictType():
            return {}
        case shapes.ListType(item_type=item, min_length=least):
            return [_invented(item) for _ in range(least or 0)]
        case shapes.UnionType(types=types):
            return _invented(types[0])
        case shapes.StrType(pattern=pattern):
            return {r"^8[NEO][12]$": "8E1", r"^[0-9]+(\.[0-9]+)?$": "1"}.get(pattern or "", "x")
    return None


def place_label(tables: dict[str, Any], path: TomlPath) -> str:
    """Return a place in words: keys, rows by number, and the code of the row in brackets."""
    steps = ".".join(str(s) if isinstance(s, str) else f"#{s + 1}" for s in path)
    node: Any = tables
    owner = ""
    for step in path:
        try:
            node = node[step]
        except (KeyError, IndexError, TypeError):
            break
        if isinstance(node, dict):
            owner = str(node.get("code") or node.get("id") or owner)
    place = steps or "the file"
    return f"{place} ({owner})" if owner else place
