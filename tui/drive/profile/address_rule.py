"""Wire addresses by rule: `10 * number - 1` for a whole table of the manual.

A rule is an arithmetic text over the manual's number of a parameter. `number` is that number
without other signs: 303 for 3-03. `menu` and `item` are the parts before and behind the dash, the
dot or the space: 3 and 3. Numbers may be hexadecimal, as in 16#1000; those of the manual also as
1000H or 0x1000. The text is parsed and never run.
"""

from __future__ import annotations

import ast
import operator
import re
from collections.abc import Callable, Mapping
from typing import Any

from .toml_lines import TomlPath

LONGEST_RULE = 80
"""Most characters of a rule."""
_OPERATIONS: Mapping[type[ast.operator], Callable[[int, int], int]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.FloorDiv: operator.floordiv,
    ast.Mod: operator.mod,
}
_HEXADECIMAL = re.compile(r"16#(?=[0-9A-Fa-f])")
_HEXADECIMAL_NUMBER = re.compile(r"(?:16#|0[xX])([0-9A-Fa-f]+)|([0-9][0-9A-Fa-f]*)[hH]")
_NAMES = re.compile(r"[a-z_]")
_PARTS = re.compile(r"(\d+)[-. ](\d+)")


class RuleError(ValueError):
    """A rule that gives no address; the text gives the reason."""


def address_by_rule(rule: str, number: str, known: Mapping[str, int] | None = None) -> int:
    """Return the wire address of a parameter by its number in the manual. Raises RuleError.

    `known` are other values than those of the number, by their names in the rule.
    """
    if len(rule) > LONGEST_RULE:
        raise RuleError(f"a rule has at most {LONGEST_RULE} characters.")
    try:
        tree = ast.parse(_HEXADECIMAL.sub("0x", rule).strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise RuleError(f"{rule!r} is not a rule. Write it like {EXAMPLE}.") from None
    try:
        address = _value(tree.body, _known(number) if known is None else known, rule, number)
    except ZeroDivisionError:
        raise RuleError(f"{rule!r} divides by 0 for {number}.") from None
    if not 0 <= address <= 0xFFFF:
        raise RuleError(f"{rule!r} gives {address} for {number}; an address is 0 to 65535.")
    return address


EXAMPLE = "'10 * number - 1' or '16#1000 + 256 * menu + item'"


def _known(number: str) -> dict[str, int]:
    """Return the values that a rule can use, by name."""
    text = number.strip()
    if match := _HEXADECIMAL_NUMBER.fullmatch(text):
        return {"number": int(match[1] or match[2], 16)}
    if _HEXADECIMAL.match(text):
        return {}
    found = {}
    if digits := re.sub(r"\D", "", text):
        found["number"] = int(digits[:9])
    if parts := _PARTS.search(text):
        found |= {"menu": int(parts[1][:9]), "item": int(parts[2][:9])}
    return found


def _value(node: ast.expr, known: Mapping[str, int], rule: str, number: str) -> int:
    match node:
        case ast.Constant(value=int(value)) if not isinstance(value, bool):
            return value
        case ast.Name(id=("number" | "menu" | "item" | "index" | "sub") as name):
            if name not in known:
                raise RuleError(f"{rule!r} needs {name}, and {number!r} has none.")
            return known[name]
        case ast.BinOp(left=left, op=op, right=right) if type(op) in _OPERATIONS:
            values = (_value(part, known, rule, number) for part in (left, right))
            return _OPERATIONS[type(op)](*values)
    raise RuleError(
        f"{rule!r} is not a rule: use number, menu, item, whole numbers and + - * // %, as in"
        f" {EXAMPLE}."
    )


def fill_addresses(tables: Mapping[str, Any]) -> list[tuple[TomlPath, str]]:
    """Replace the rules of a profile's parameters by their addresses; return all faults by place.

    A parameter's own address or rule comes before that of its group, and that before that of the
    profile. Rules for EEPROM addresses of a group or profile are for settings kept in RAM.
    """
    rows = tables.get("parameters")
    faults: list[tuple[TomlPath, str]] = []
    for key in ("address", "eeprom_address"):
        by_group, usual = _shared_rules(tables, key)
        for index, row in enumerate(rows if isinstance(rows, list) else []):
            if not isinstance(row, dict):
                continue
            group, rule = row.get("group"), row.get(key)
            if key not in row and (key == "address" or _is_kept_in_ram(row)):
                rule = (by_group.get(group) if isinstance(group, str) else None) or usual
            number = row.get("number")
            if not isinstance(rule, str) or not isinstance(number, str) or not _NAMES.search(rule):
                # an address in quotes is not a rule, but a mistake that the form check reports
                continue
            try:
                row[key] = address_by_rule(rule, number)
            except RuleError as error:
                place: TomlPath = ("parameters", index)
                if key in row:
                    place = (*place, key)
                faults.append((place, f"parameter {row.get('code', number)}: {error}"))
    return faults


def _shared_rules(tables: Mapping[str, Any], key: str) -> tuple[dict[str, Any], Any]:
    """Return the rules of the groups by their name, and that of the profile."""
    head, groups = tables.get("profile"), tables.get("groups")
    by_group = {
        row["name"]: row.get(key)
        for row in (groups if isinstance(groups, list) else [])
        if isinstance(row, dict) and isinstance(row.get("name"), str)
    }
    return by_group, head.get(key) if isinstance(head, dict) else None


def _is_kept_in_ram(row: Mapping[str, Any]) -> bool:
    writable = row.get("access") in ("rw", "rw-stopped")
    return writable and row.get("storage") == "ram-until-saved"
