"""Comparison of two parameter sets: of files, a drive, or the factory settings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from typing import Literal

from ..plain import csv_text, markdown_table
from ..profile.profile import Profile
from ..profile.schema import Parameter
from ..shown import shown
from ..values import Value
from .factory import factory_is_sure, factory_raw
from .parameter_set import ParameterSet, lacking
from .writable import CUTTING, is_setting

TableFormat = Literal["text", "markdown", "csv"]
NOTHING = "-"


@dataclass(frozen=True, slots=True)
class Side:
    """One of the two compared sets."""

    label: str
    raws: Mapping[str, int]
    absent: Mapping[str, str] = field(default_factory=dict)
    """Codes without a value, and why."""
    texts: Mapping[str, str] = field(default_factory=dict)
    """Text instead of a number: a factory setting that depends on the rating."""
    unsure: Mapping[str, str] = field(default_factory=dict)
    """Codes of values that no document of the family states, with the remark on it."""
    left: Mapping[str, str] = field(default_factory=dict)
    """Codes that are not compared with this side, and why."""


@dataclass(frozen=True, slots=True)
class ComparedRow:
    """A parameter with its values on both sides."""

    code: str
    name: str
    group: str
    a: str
    b: str
    a_raw: int | None
    b_raw: int | None
    differs: bool
    note: str = ""


def side_of(label: str, values: ParameterSet) -> Side:
    """Return a parameter set as a side."""
    return Side(label, values.raws, values.absent)


def factory_side(profile: Profile, other: ParameterSet) -> Side:
    """Return the factory settings of a profile as a side, for the drive with these other values.

    Address, baud rate and format are not compared, because they depend on the line.
    """
    raws: dict[str, int] = {}
    texts = {p.code: p.factory_text for p in profile.parameters if p.factory_text}
    absent = lacking(profile, other.raws)
    for parameter in profile.parameters:
        raw = factory_raw(profile, parameter, other.raws, absent)
        if raw is None:
            continue
        if parameter.set_by_drive:
            texts[parameter.code] = "set by the drive itself"
        elif parameter.factory_of is not None and _nearly(raw, other.raws.get(parameter.code)):
            raws[parameter.code] = other.raws[parameter.code]
        else:
            raws[parameter.code] = raw
    unsure = {
        p.code: "factory setting unverified"
        for p in profile.parameters
        if p.code in raws and not factory_is_sure(p)
    }
    left = {s.parameter: "line setting" for s in profile.data.link.settings if s.role in CUTTING}
    return Side("factory", raws, texts=texts, unsure=unsure, left=left)


def _nearly(factory: int, held: int | None) -> bool:
    """Return True if two values differ by one count at most.

    A product of the drive's current may be rounded differently by the drive.
    """
    return held is not None and abs(held - factory) <= 1


def compare_settings(
    profile: Profile, a: Side, b: Side, *, all_rows: bool = False
) -> list[ComparedRow]:
    """Return the differing settings in the profile's order, or every parameter with `all_rows`.

    Measurements, commands and counters are not settings, and never differ. An unknown factory
    setting differs from nothing.
    """
    rows = [
        _row(profile, parameter, a, b)
        for parameter in profile.parameters
        if any(parameter.code in known for side in (a, b) for known in (side.raws, side.absent))
    ]
    return [row for row in rows if row.differs or all_rows]


def _row(profile: Profile, parameter: Parameter, a: Side, b: Side) -> ComparedRow:
    code = parameter.code
    values = [_value(profile, parameter, side) for side in (a, b)]
    texts = [_text(parameter, side, value) for side, value in zip((a, b), values, strict=True)]
    left = next((side.left[code] for side in (a, b) if code in side.left), "")
    setting = is_setting(profile, parameter) and not left
    note = "" if setting else left or "no setting"
    if setting and values.count(None) == 1:
        bare = a if values[0] is None else b
        known = code in bare.absent
        note = bare.absent.get(code, "") if known else _missing(bare)
        differs = known
    else:
        differs = setting and not _same(*values)
    if differs and not note:
        note = next((side.unsure[code] for side in (a, b) if code in side.unsure), "")
    return ComparedRow(
        code, parameter.name, parameter.group, texts[0], texts[1],
        a.raws.get(code), b.raws.get(code), differs, note,
    )  # fmt: skip


def _missing(side: Side) -> str:
    return "factory setting unknown" if side.texts or side.label == "factory" else "missing"


def _value(profile: Profile, parameter: Parameter, side: Side) -> Value | None:
    raw = side.raws.get(parameter.code)
    if raw is None:
        return None
    return shown(profile, parameter, raw, side.raws, lacking(profile, side.raws))


def _text(parameter: Parameter, side: Side, value: Value | None) -> str:
    if value is not None:
        return f"{value.display} ?" if parameter.code in side.unsure else value.display
    return side.texts.get(parameter.code) or NOTHING


def _same(a: Value | None, b: Value | None) -> bool:
    """Return True if two values mean the same: 3.0 s is 3.00 s, whatever the words are."""
    if a is None or b is None:
        return a is b
    if a.number is not None and b.number is not None and a.unit == b.unit:
        return _plain(a.number) == _plain(b.number)
    return (a.raw, a.text, a.unit) == (b.raw, b.text, b.unit)


def _plain(number: Decimal) -> Decimal:
    return number.normalize()


# Text


def rows_text(rows: Sequence[ComparedRow], labels: tuple[str, str], format_: TableFormat) -> str:
    """Return the rows as aligned text, as a Markdown table, or as CSV with raw values."""
    if format_ == "csv":
        return _csv(rows, labels)
    return _markdown(rows, labels) if format_ == "markdown" else _plain_text(rows, labels)


def _plain_text(rows: Sequence[ComparedRow], labels: tuple[str, str]) -> str:
    if not rows:
        return f"No setting differs between {labels[0]} and {labels[1]}.\n"
    table = [("", "Code", "Name", *labels, ""), *(_cells(row) for row in rows)]
    widths = [max(len(cells[column]) for cells in table) for column in range(6)]
    lines = (
        "  ".join(cell.ljust(width) for cell, width in zip(cells, widths, strict=True)).rstrip()
        for cells in table
    )
    return "\n".join(lines) + "\n"


def _cells(row: ComparedRow) -> tuple[str, str, str, str, str, str]:
    return ("*" if row.differs else "", row.code, row.name, row.a, row.b, row.note)


def _markdown(rows: Sequence[ComparedRow], labels: tuple[str, str]) -> str:
    head = ("differs", "code", "name", *labels, "remark")
    cells = (("yes" if row.differs else "", *_cells(row)[1:]) for row in rows)
    return "\n".join(markdown_table(head, cells)) + "\n"


def _csv(rows: Sequence[ComparedRow], labels: tuple[str, str]) -> str:
    table: list[tuple[object, ...]] = [
        ("code", "name", "group", *labels, "raw a", "raw b", "differs", "remark")
    ]
    for row in rows:
        values = row.a, row.b, row.a_raw, row.b_raw
        differs = "yes" if row.differs else "no"
        table.append((row.code, row.name, row.group, *values, differs, row.note))
    return csv_text(table, end="\n")
