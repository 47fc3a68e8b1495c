"""What many panels in one process need not do again: parse the same style sheets."""

from __future__ import annotations

from typing import Any

from textual.css.stylesheet import Stylesheet

_parse = Stylesheet._parse_rules
_parsed: dict[object, Any] = {}


def parse_once(sheet: Stylesheet, *source: Any, **how: Any) -> Any:
    """The rules of a source; parsed once for each theme, whichever panel asks."""
    key = (source, tuple(how.items()), tuple(sheet._variables.items()))
    if key not in _parsed:
        _parsed[key] = _parse(sheet, *source, **how)
    return _parsed[key]
