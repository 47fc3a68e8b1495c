"""Parsing of TOML from any source; errors are a sentence with the line.

The parser does not catch some errors of Python, and takes minutes for some malicious texts.
"""

from __future__ import annotations

import re
from typing import Any

import tomli

DEEPEST = 24
"""Most nesting of tables and lists; a profile needs six levels."""
_PARTS = re.compile(rf"""^[ \t]*\[{{0,2}}(?:[^=\n"'#.\]]*\.){{{DEEPEST}}}""", re.MULTILINE)
_OPENED = re.compile(rf"(?:[\[{{][ \t\r\n]*(?:[\w-]+[ \t]*=[ \t\r\n]*)?){{{DEEPEST}}}")


def toml_tables(text: str) -> dict[str, Any]:
    """Parse a text; raises tomli.TOMLDecodeError for every kind of error."""
    for pattern in (_PARTS, _OPENED):
        if found := pattern.search(text):
            raise _too_deep(text, found.start())
    try:
        tables = tomli.loads(text)
    except RecursionError:
        raise _too_deep(text, 0) from None
    except tomli.TOMLDecodeError:
        raise
    except (ValueError, OverflowError, ArithmeticError) as error:
        # a number or a date that Python cannot represent
        raise tomli.TOMLDecodeError(str(error).split(";")[0].rstrip("."), text, 0) from None
    if _is_deep(tables):
        raise _too_deep(text, 0)
    return tables


def _too_deep(text: str, at: int) -> tomli.TOMLDecodeError:
    return tomli.TOMLDecodeError("Tables or lists are nested too deep", text, at)


def _is_deep(tables: dict[str, Any]) -> bool:
    level: list[Any] = [tables]
    for _ in range(DEEPEST):
        level = [
            inner
            for item in level
            for inner in (item.values() if isinstance(item, dict) else item)
            if isinstance(inner, dict | list)
        ]
        if not level:
            return False
    return True
