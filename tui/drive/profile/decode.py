"""From TOML text to checked structs, with the line of a fault."""

from __future__ import annotations

import re
from typing import Any

import msgspec
import tomli

from ..errors import ProfileError
from .schema import ProfileData

_PLACE = re.compile(r" - at `\$(.*)`$")
_UNKNOWN = re.compile(r"^Object contains unknown field `(.+)`$")
_IN_WORDS: tuple[tuple[re.Pattern[str], str], ...] = (
    (_UNKNOWN, r"there is no field `\1` here; see the schema or the guide for the fields"),
    (re.compile(r"^Object missing required field `(.+)`$"), r"the field `\1` is missing"),
    (re.compile(r"^Invalid enum value (.+)$"), r"\1 is none of the values allowed here"),
    (re.compile(r"^Expected `(.+)`, got `(.+)`$"), r"must be of type \1, not \2"),
    (re.compile(r"^Expected `(?:int|float)` (<=|>=|<|>) (.+)$"), r"must be \1 \2"),
    (re.compile(r"^Expected `str` matching regex .*0-9.*$"), 'has the wrong form (write "0.1")'),
    (re.compile(r"^Expected `str` matching regex (.+)$"), r"has not the form \1"),
)
_STEP = re.compile(r"\.([^.\[\]]+)|\[(\d+|\.\.\.)\]")


def decode_profile(text: str, file: str) -> ProfileData:
    """The data of a profile's text; raises ProfileError with file, line, place and fault."""
    try:
        tables = tomli.loads(text)
    except tomli.TOMLDecodeError as error:
        raise ProfileError(f"{file}: not valid TOML: {error}.") from error
    try:
        return msgspec.convert(tables, ProfileData)
    except msgspec.ValidationError as error:
        raise ProfileError(_describe(str(error), tables, text, file)) from error


def _describe(message: str, tables: dict[str, Any], text: str, file: str) -> str:
    match = _PLACE.search(message)
    fault = message[: match.start()] if match else message
    steps: list[str | int] = []
    node: Any = tables
    for name, index in _STEP.findall(match[1] if match else ""):
        if index == "...":
            break
        step: str | int = int(index) if index else name
        steps.append(step)
        node = _child(node, step)
    unknown = _UNKNOWN.match(fault)
    line = source_line(text, [*steps, unknown[1]] if unknown else steps)
    label = ".".join(str(s) if isinstance(s, str) else f"#{s + 1}" for s in steps) or "the file"
    owner = _owner(tables, steps)
    return f"{file}:{line}: {label}{owner}: {_in_words(fault)}."


def _in_words(fault: str) -> str:
    """A decoder's message in the words of somebody who writes a profile."""
    for pattern, words in _IN_WORDS:
        if pattern.match(fault):
            return pattern.sub(words, fault)
    return fault


def _child(node: Any, step: str | int) -> Any:
    try:
        return node[step]
    except (KeyError, IndexError, TypeError):
        return None


def _owner(tables: dict[str, Any], steps: list[str | int]) -> str:
    """The code of the parameter (or id of the table) that a place belongs to, in brackets."""
    node: Any = tables
    found = ""
    for step in steps:
        node = _child(node, step)
        if isinstance(node, dict):
            found = str(node.get("code") or node.get("id") or found)
    return f" ({found})" if found else ""


def source_line(text: str, steps: list[str | int]) -> int:
    """The line, from 1, of a place such as ["parameters", 3, "scale"]; 1 if it is not found."""
    if not steps:
        return 1
    table = re.escape(str(steps[0]))
    headers = list(re.finditer(rf"^\[\[?{table}(\.[\w.-]+)?\]\]?", text, re.MULTILINE))
    tops = [h for h in headers if h[1] is None] or headers
    index = steps[1] if len(steps) > 1 and isinstance(steps[1], int) else 0
    if index >= len(tops):
        return 1
    start = tops[index].start()
    end = tops[index + 1].start() if index + 1 < len(tops) else len(text)
    position = start
    for step in steps[1:]:
        if isinstance(step, str):
            key = re.compile(rf"\b{re.escape(step)}\b\s*=|^\[.*\b{re.escape(step)}\]", re.MULTILINE)
            if hit := key.search(text, position, end):
                position = hit.start()
    return text.count("\n", 0, position) + 1
