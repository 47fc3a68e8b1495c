"""Rules for the identification of a drive: what a family shows that no other drive shows."""

from __future__ import annotations

import re
from collections.abc import Iterator

from tui.drive.values import type_range

from ..schema import IdentityRegister, Parameter, ProfileData
from ..toml_lines import TomlPath

REFERENCE, REPORT_ID, IDENTIFY = 1, 17, 43
_BYTES = re.compile(r"16#([0-9A-Fa-f]{2}){2,}")
COMMON_BELOW = 256
"""Values below it are common: one alone identifies no family."""
SHORTEST_TEXT = 3
"""Fewest characters of a text that function 17 is searched for."""


def identity_registers(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield registers that other drives may have with the same values."""
    rows = data.identification.registers
    known = {parameter.code: parameter for parameter in data.parameters}
    for place, row in enumerate(rows):
        at: TomlPath = ("identification", "registers", place)
        parameter = known.get(row.parameter)
        if parameter is None:
            continue  # reported as a missing parameter
        if parameter.access != "r":
            yield at, f"register {row.parameter}: it can be written. Its access must be r."
        yield from ((at, f"register {row.parameter}: {text}") for text in _bad(row, parameter))
    common = len(rows) == 1 and rows[0].parameter in known and rows[0].values
    if common and min(rows[0].values) < COMMON_BELOW:
        yield (
            ("identification", "registers"),
            f"identification: values below {COMMON_BELOW} are common. Add a second register.",
        )


def _bad(row: IdentityRegister, parameter: Parameter) -> Iterator[str]:
    low, high = type_range(parameter)
    if bool(row.values) is bool(row.begins) or bool(row.begins) is not (parameter.type == "ascii"):
        yield "it needs values, or for a text (ascii) begins."
        return
    if parameter.function != 3:
        yield "an unknown drive is only read by function 3."
    if any(len(text.strip()) < SHORTEST_TEXT for text in row.begins):
        yield f"a beginning is too short: {SHORTEST_TEXT} characters at least."
    if parameter.type == "float32":
        yield "a float32 has no exact value."
        return
    for raw in row.values:
        if not low <= raw <= high:
            yield f"{raw} does not fit {parameter.type}: {low} to {high}."
        elif raw in (0, high, -1):
            yield f"{raw} is also the value of registers that a drive does not have."


def identity_texts(data: ProfileData) -> Iterator[tuple[TomlPath, str]]:
    """Yield texts by which the drive, real or simulated, would not be recognized."""
    own = data.identification
    prefixes = own.reference_prefixes
    for place, prefix in enumerate(prefixes):
        if prefix.startswith("16#") and not _BYTES.fullmatch(prefix):
            yield (
                ("identification", "reference_prefixes", place),
                f"identification: the prefix {prefix!r} needs at least two bytes, such as 16#2AFF.",
            )
        if len(prefix.strip()) < SHORTEST_TEXT:
            yield (
                ("identification", "reference_prefixes", place),
                f"identification: the prefix {prefix!r} is too short: 3 characters at least.",
            )
    functions = {function.code for function in data.functions}
    example = next((item.example for item in own.objects if item.id == REFERENCE), "")
    if prefixes and example and not example.upper().startswith(_upper(prefixes)):
        yield (
            ("identification", "objects"),
            f"identification: the reference {example!r} begins with none of reference_prefixes.",
        )
    if REPORT_ID in functions and IDENTIFY not in functions and len(example) < SHORTEST_TEXT:
        yield (
            ("identification", "objects"),
            "identification: function 17 has no text. Add it as the example of object 1.",
        )


def _upper(prefixes: list[str]) -> tuple[str, ...]:
    return tuple(prefix.strip().upper() for prefix in prefixes)


IDENTIFICATION_RULES = (identity_registers, identity_texts)
