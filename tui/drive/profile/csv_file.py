"""Text of a new profile from the parameter table of a manual, as a CSV file.

The first line names the columns. Limits and factory settings are in the unit, as manuals print
them, and become raw values by the scale of their row. Nothing is guessed: a cell that cannot be
converted is an error with its line.
"""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Iterator, Mapping
from decimal import Decimal, InvalidOperation
from typing import Any

from ..errors import ProfileError
from ..plain import escaped_toml
from .address_rule import RuleError, address_by_rule
from .new_file import IDENTIFIER, row_as_toml

COLUMNS: Mapping[str, str] = {
    "code": "code", "parameter": "code",
    "name": "name", "description": "name",
    "number": "number", "no": "number", "address": "address", "register": "address",
    "type": "type", "unit": "unit", "units": "unit", "scale": "scale", "resolution": "scale",
    "offset": "offset", "min": "min", "minimum": "min", "max": "max", "maximum": "max",
    "factory": "factory", "default": "factory", "values": "values", "access": "access",
    "group": "group", "menu": "group", "storage": "storage", "quantity": "quantity",
    "note": "note", "function": "function", "mask": "mask", "shift": "shift",
}  # fmt: skip
"""Field by heading, in small letters."""
ACCESS: Mapping[str, str] = {
    "": "r", "r": "r", "ro": "r", "r/o": "r", "read": "r",
    "rw": "rw", "r/w": "rw", "rw-stopped": "rw-stopped", "w": "w", "wo": "w",
}  # fmt: skip
MOST_RAW_DIGITS = 12
"""Most digits of a raw value, so that an absurd exponent takes no time."""
IN_UNIT = ("min", "max", "factory")
_NAMED = re.compile(r"\s*(-?\d+)\s*[=:]\s*(.+?)\s*")
_HEAD = """\
[profile]
id = "{id}"
name = "{id}"
vendor = "Unknown"
version = "0.1"
{address}

[[sources]]
id = "table"
title = "Parameter table of the manufacturer: write title and edition here"

# The factory settings of the line: change them to those of the drive.
[link]
baud = 9600
format = "8N1"

[[functions]]
code = 3
name = "Read holding registers"
# Most words of one request, a guess: raise it to the limit of the manual.
max_read = {most}

[[functions]]
code = 6
name = "Write single register"
{more}
# Commands, states and references come here: see docs/own-drive.md.

[monitoring]
values = [{watched}]

"""
MOST_MONITORED = 8
"""Values that a new profile monitors at most."""
_FUNCTION = """
[[functions]]
code = {code}
name = "{name}"
{limit} = 2
"""
_FURTHER = {1: "Read coils", 2: "Read discrete inputs", 4: "Read input registers"}
PAIRS = """
# Which of the two words of a long value is first: an example frame of the manual shows it.
[reading]
# low_word_first = false
"""


def profile_from_table(text: str, new_id: str, file: str, rule: str = "") -> str:
    """Return a profile with a row for each line of a table. Raises ProfileError.

    `rule` gives the addresses of the rows without one, over the number of the manual.
    """
    rows = list(_rows(text, file))
    if not rows:
        raise ProfileError(f"{file}: it has no line with a parameter.")
    for row in rows if rule else ():
        if "address" not in row:
            try:
                address_by_rule(rule, row["number"])
            except RuleError as error:
                raise ProfileError(f"{file}: {row['code']}: {error}") from None
    return _profile_of(rows, new_id, rule)


def profile_of_rows(cells: Iterable[dict[str, str]], new_id: str) -> str:
    """Return a profile with a row for each set of cells, by field. Raises ProfileError."""
    try:
        return _profile_of([_converted(row) for row in cells], new_id)
    except ValueError as error:
        raise ProfileError(str(error)) from None


def _profile_of(rows: list[dict[str, Any]], new_id: str, rule: str = "") -> str:
    if not IDENTIFIER.fullmatch(new_id):
        raise ProfileError(
            f"{new_id!r} is not an id. Use small letters, digits, - and _, with a letter first."
        )
    more, most, order = "", 1, ""
    read = {row.get("function") for row in rows}
    for code, name in _FURTHER.items():
        if code in read:
            more += _FUNCTION.format(code=code, name=name, limit="max_read")
    if any(row.get("function") == 1 and row["access"] != "r" for row in rows):
        more += _FUNCTION.format(code=5, name="Write single coil", limit="max_write")
    if any(str(row.get("type", "")).endswith("32") for row in rows):
        more += _FUNCTION.format(code=16, name="Write registers", limit="max_write")
        most, order = 2, PAIRS
    watched = [row["code"] for row in rows if "quantity" in row and row["access"] == "r"]
    values = ", ".join(
        f"{{ parameter = {escaped_toml(code)} }}" for code in watched[:MOST_MONITORED]
    )
    parts = (row_as_toml("parameters", row) for row in rows)
    address = f"address = {escaped_toml(rule)}" if rule else '# address = "10 * number - 1"'
    head = _HEAD.format(id=new_id, more=more + order, most=most, watched=values, address=address)
    return head + "\n".join(parts)


def _rows(text: str, file: str) -> Iterator[dict[str, Any]]:
    reader = csv.reader(io.StringIO(text), delimiter=_separator(text))
    try:
        yield from _rows_of(reader, file)
    except csv.Error as error:
        raise ProfileError(f"{file}:{reader.line_num}: it is not a table: {error}.") from None


def _separator(text: str) -> str:
    """Return the most frequent separator of the first line."""
    first = text.partition("\n")[0]
    return max(",;\t", key=first.count)


def _rows_of(reader: Any, file: str) -> Iterator[dict[str, Any]]:
    headings = [cell.strip().casefold().rstrip(".") for cell in next(reader, [])]
    fields = [COLUMNS.get(heading, "") for heading in headings]
    unknown = [h for h, field in zip(headings, fields, strict=True) if h and not field]
    twice = {field for field in fields if field and fields.count(field) > 1}
    if unknown or twice or "code" not in fields or "name" not in fields:
        names = ", ".join(dict.fromkeys(COLUMNS.values()))
        if unknown:
            raise ProfileError(f"{file}:1: {unknown[0]!r} is not a column. Columns: {names}.")
        if twice:
            raise ProfileError(f"{file}:1: the column {min(twice)} occurs twice.")
        raise ProfileError(f"{file}:1: it needs the columns code and name. Columns: {names}.")
    for cells in reader:
        line = reader.line_num
        if len(cells) > len(fields):
            # a decimal comma without quotes has moved the cells behind it into other columns
            raise ProfileError(
                f"{file}:{line}: it has more cells than the first line. Quote a text with the"
                " separator in it."
            )
        row = {f: c.strip() for f, c in zip(fields, cells, strict=False) if f and c.strip()}
        if row:
            try:
                yield _converted(row)
            except ValueError as error:
                raise ProfileError(f"{file}:{line}: {error}") from None


def _converted(row: dict[str, str]) -> dict[str, Any]:
    """Return the fields of a parameter in the order of a profile. Raises ValueError."""
    if not row.get("code") or not row.get("name"):
        raise ValueError("a parameter needs a code and a name.")
    code, access = row["code"], row.get("access", "").casefold()
    if access not in ACCESS:
        raise ValueError(f"{code}: access {row['access']!r} is not r, rw, rw-stopped or w.")
    found: dict[str, Any] = {"code": code, "name": row["name"], "number": row.get("number", code)}
    if address := row.get("address"):
        found["address"] = _address(address)
    if "number" not in row and not isinstance(found.get("address"), int) and _is_hex(code):
        # a rule would take the decimal digits alone: 8 of A8
        digits, plain = code.upper().rstrip("H"), re.sub("[^0-9]", "", code)
        raise ValueError(
            f"{code}: this code may be hexadecimal. Give its number, such as 16#{digits} or"
            f" {plain}, or its address."
        )
    if function := row.get("function"):
        if function not in ("1", "2", "3", "4"):
            raise ValueError(f"{code}: function {function!r} is not 1, 2, 3 or 4.")
        found["function"] = int(function)
    found |= {f: _field(code, f, row[f]) for f in ("mask", "shift") if f in row}
    found |= {f: row[f] for f in ("type", "unit") if f in row}
    found |= {f: row[f].replace(",", ".") for f in ("scale", "offset") if f in row}
    found |= {f: _counts(code, f, row, found) for f in IN_UNIT if f in row}
    if values := row.get("values"):
        found["values"] = _names(code, values)
    found["access"] = ACCESS[access]
    found |= {f: row[f] for f in ("storage", "quantity", "note") if f in row}
    return {**found, "group": row.get("group", "Table"), "source": "table",
            "confidence": "unverified"}  # fmt: skip


def _is_hex(code: str) -> bool:
    """Return True if a code with letters and digits could be a hexadecimal number."""
    return bool(re.fullmatch(r"(?=.*[0-9])(?=.*[A-Fa-fHh])[0-9A-Fa-f]+[Hh]?", code))


def _address(text: str) -> int | str:
    """Return a wire address: 9001, 16#2329, 0x2329 or 2329H; any other text is a rule."""
    plain = text.replace(" ", "")
    if re.fullmatch(r"[0-9]+", plain):
        return int(plain)
    if match := re.fullmatch(r"(?:16#|0[xX])([0-9A-Fa-f]+)|([0-9A-Fa-f]+)[hH]", plain):
        return int(match[1] or match[2], 16)
    return text


def _field(code: str, field: str, text: str) -> int:
    """Return the mask or shift of a part of a word. Raises ValueError."""
    number = _address(text)
    if isinstance(number, int):
        return number
    raise ValueError(f"{code}: {field} {text!r} is not a number, such as 16#FF00 or 8.")


def _counts(code: str, field: str, row: Mapping[str, str], found: Mapping[str, Any]) -> int:
    """Return a value in the unit as a raw value. Raises ValueError."""
    try:
        number = Decimal(row[field].replace(",", "."))
        counts = (number - Decimal(found.get("offset", "0"))) / Decimal(found.get("scale", "1"))
        usable = counts.is_finite() and counts.adjusted() < MOST_RAW_DIGITS
    except (InvalidOperation, ZeroDivisionError):
        usable = False
    if not usable:
        raise ValueError(f"{code}: {field} {row[field]!r} is not a number.")
    if counts != counts.to_integral_value():
        scale = found.get("scale", "1")
        raise ValueError(f"{code}: {field} {row[field]} is not a whole number of steps of {scale}.")
    return int(counts)


def _names(code: str, text: str) -> dict[str, str]:
    """Return the names of raw values: `0=Off; 1=On`. Raises ValueError."""
    found = {}
    for part in re.split(r"[;|]", text):
        match = _NAMED.fullmatch(part)
        if match is None:
            raise ValueError(f"{code}: values {part.strip()!r} is not written as 0=Off; 1=On.")
        found[match[1]] = match[2]
    return found
