"""Text of a new profile from an electronic data sheet (EDS or DCF, CiA 306), which is an INI file.

It lists CANopen objects by index and sub-index. Their Modbus addresses are not in it: they follow
from a rule of the manual, which the user gives.
"""

from __future__ import annotations

import configparser
import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ..errors import ProfileError
from .address_rule import RuleError, address_by_rule
from .csv_file import profile_of_rows

NO_RULE = (
    "An EDS lists CANopen objects, not Modbus registers. If the manual maps them to registers, give"
    " its rule: --address-rule '3000 + 100 * (index - 16#2000) + sub - 1'. If it does not, this"
    " file is of no use on Modbus."
)
OWN_OBJECTS = range(0x2000, 0x6000)
"""Objects of the manufacturer; those of CANopen itself have no registers."""
_RANGE = re.compile(r"\s*([0-9A-Fa-f]{4})-([0-9A-Fa-f]{4})\s*:(.*)", re.DOTALL)
_OBJECT = re.compile(r"([0-9A-Fa-f]{1,4})(?:sub([0-9A-Fa-f]{1,2}))?", re.IGNORECASE)
_ARRAY, _RECORD = 8, 9
EDS_TYPES = {
    1: ("uint16", 1), 2: ("int16", 8), 3: ("int16", 16), 4: ("int32", 32),
    5: ("uint16", 8), 6: ("uint16", 16), 7: ("uint32", 32),
}  # fmt: skip
"""Type and bits by the number of the data type; other types have no plain registers."""
EDS_ACCESS = {"ro": "r", "const": "r", "rw": "rw", "rwr": "rw", "rww": "rw", "wo": "w"}
EDS_LIMITS = {"lowlimit": "min", "highlimit": "max", "defaultvalue": "factory"}


class _Rule(NamedTuple):
    """A rule for the addresses of some objects."""

    objects: range
    text: str


class _Object(NamedTuple):
    """An object with a value, and its section."""

    number: int
    sub: int
    section: str
    fields: configparser.SectionProxy

    @property
    def label(self) -> str:
        """Number (index) and sub-index in hexadecimal, as manuals write them."""
        return f"{self.number:04X}/{self.sub:X}"


def profile_from_eds(data: bytes, new_id: str, file: str, rules: Sequence[str]) -> str:
    """Return a profile with a row for each object that has a register. Raises ProfileError.

    A rule may begin with the objects that it is for, as in `2000-20FF: 16#100 * sub`. The first
    that fits an object gives its address; an object without one is left out.
    """
    if not rules:
        raise ProfileError(NO_RULE)
    parsed = [_parsed_rule(rule) for rule in rules]
    text = _text(data)
    left_out: list[str] = []
    rows: dict[int, dict[str, str]] = {}
    try:
        for found in _objects(text):
            rule = next((rule for rule in parsed if found.number in rule.objects), None)
            if rule is None:
                continue
            row = _row(found, rule)
            if isinstance(row, str):
                left_out.append(f"# {found.label}: {row}")
                continue
            width = 2 if row["type"].endswith("32") else 1
            first = int(row["address"])
            for address in range(first, first + width):
                if (other := rows.setdefault(address, row)) is not row:
                    raise ValueError(
                        f"{found.section}: the rule gives it address {address}, which"
                        f" {other['code']} has already."
                    )
    except configparser.Error as error:
        message = " ".join(str(error).split())
        raise ProfileError(f"{file}: it is not an EDS: {message}") from None
    except ValueError as error:
        section, _, reason = str(error).partition(": ")
        raise ProfileError(f"{file}:{_line_of(text, section)}: [{section}] {reason}") from None
    distinct = list({id(row): row for row in rows.values()}.values())
    if not distinct:
        raise ProfileError(f"{file}: it has no object that the rule gives a register.")
    _name_apart(distinct)
    made = profile_of_rows(distinct, new_id)
    note = ["", "# Objects that are left out:", *left_out] if left_out else []
    return "\n".join([made.rstrip("\n"), *note, ""])


def _parsed_rule(rule: str) -> _Rule:
    if (match := _RANGE.fullmatch(rule)) is None:
        return _Rule(OWN_OBJECTS, rule)
    objects = range(int(match[1], 16), int(match[2], 16) + 1)
    if not objects:
        raise ProfileError(f"{rule!r}: the first object is above the last one.")
    return _Rule(objects, match[3].strip())


def _text(data: bytes) -> str:
    """Return the text of a file; data sheets are ASCII, UTF-8, or older ones Latin-1."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError:
        return data.decode("latin-1")


def _objects(text: str) -> Iterator[_Object]:
    """Yield the objects that have a value. Raises configparser.Error, ValueError."""
    parser = configparser.ConfigParser(
        delimiters=("=",), comment_prefixes=(";",), interpolation=None, empty_lines_in_values=False
    )
    parser.read_string(text)
    for section in parser.sections():
        if (match := _OBJECT.fullmatch(section)) is None:
            continue
        fields, sub = parser[section], match[2]
        kind = _whole(section, "ObjectType", fields.get("objecttype", "7"))
        parent = parser[match[1]] if sub and parser.has_section(match[1]) else None
        has_parts = kind in (_ARRAY, _RECORD) and "datatype" not in fields
        counts = sub is not None and int(sub, 16) == 0 and _has_parts(section, parent)
        if not (has_parts or counts):
            yield _Object(int(match[1], 16), int(sub or "0", 16), section, fields)


def _has_parts(section: str, parent: configparser.SectionProxy | None) -> bool:
    """Return True if the sub-index 0 of an object is only the number of its parts."""
    return parent is not None and _whole(section, "ObjectType", parent.get("objecttype", "7")) in (
        _ARRAY, _RECORD,
    )  # fmt: skip


def _row(found: _Object, rule: _Rule) -> dict[str, str] | str:
    """Return the cells of an object's row, or why it has none. Raises ValueError."""
    fields, section = found.fields, found.section
    name = fields.get("parametername", "").strip()
    kind = _whole(section, "DataType", fields.get("datatype", "0"))
    access = fields.get("accesstype", "").strip().casefold()
    if kind not in EDS_TYPES:
        return f"its data type {kind} has no plain register"
    if access not in EDS_ACCESS:
        raise ValueError(f"{section}: AccessType {access!r} is not ro, rw, wo or const.")
    try:
        address = address_by_rule(rule.text, found.label, {"index": found.number, "sub": found.sub})
    except RuleError as error:
        raise ValueError(f"{section}: {error}") from None
    form, bits = EDS_TYPES[kind]
    row = {
        "code": f"{found.number:04X}.{found.sub:X}", "name": name or found.label,
        "number": found.label, "address": str(address), "type": form, "access": EDS_ACCESS[access],
        "group": f"{found.number:04X}",
    }  # fmt: skip
    for key, field in EDS_LIMITS.items() if row["access"] == "rw" else ():
        # a value with the node number of the drive belongs to CANopen
        if (value := fields.get(key, "").strip()) and "$" not in value:
            raw = _whole(section, key, value)
            signed = form.startswith("int") and raw >= 1 << (bits - 1)
            row[field] = str(raw - (1 << bits) if signed else raw)
    return row


def _whole(section: str, key: str, text: str) -> int:
    """Return a number of a data sheet: 10, 0x0A, or octal 012. Raises ValueError."""
    plain = text.strip()
    try:
        if re.fullmatch(r"0[0-7]+", plain):
            return int(plain, 8)
        return int(plain, 0)
    except ValueError:
        raise ValueError(f"{section}: {key} {plain[:40]!r} is not a whole number.") from None


def _name_apart(rows: list[dict[str, str]]) -> None:
    """Add the code to names that occur twice."""
    names = [row["name"].casefold() for row in rows]
    for row, name in zip(rows, names, strict=True):
        if names.count(name) > 1:
            row["name"] = f"{row['name']} {row['code']}"


def _line_of(text: str, section: str) -> int:
    at = text.find(f"[{section}]")
    return text.count("\n", 0, max(at, 0)) + 1
