"""What panels of tests need not do: parse the same style sheets again, draw for nobody."""

from __future__ import annotations

from typing import Any

from rich.console import RenderableType
from textual._compositor import Compositor
from textual._context import active_app
from textual.css.stylesheet import Stylesheet
from textual.screen import Screen

_draw = Compositor.render_update
_parse = Stylesheet._parse_rules
_parsed: dict[object, Any] = {}


def parse_once(sheet: Stylesheet, *source: Any, **how: Any) -> Any:
    """The rules of a source; parsed once for each theme, whichever panel asks."""
    key = (source, tuple(how.items()), tuple(sheet._variables.items()))
    if key not in _parsed:
        _parsed[key] = _parse(sheet, *source, **how)
    return _parsed[key]


def drawn_for_somebody(
    self: Compositor,
    full: bool = False,
    screen_stack: list[Screen[Any]] | None = None,
    simplify: bool = False,
) -> RenderableType | None:
    """Draw where somebody looks: without a terminal Textual throws away all but whole pictures."""
    if full or not active_app.get().is_headless:
        return _draw(self, full, screen_stack, simplify)
    self._dirty_regions.clear()
    return None
