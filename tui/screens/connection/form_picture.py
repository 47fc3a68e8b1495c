"""The fields of Line as they look before they are there: the first picture does not wait for them.

Pure; a test holds that nothing is seen of the change.
"""

from __future__ import annotations

from collections.abc import Sequence

from rich.style import Style
from rich.text import Text

from tui.drive.plain import plain
from tui.widgets.palette import SURFACE, TEXT

FIELD_NAME_CELLS = 11
FORMAT_CELLS = 4

FIELD_NAME = Style(color="#85898d")
FIELD_TEXT = Style(color=TEXT, bgcolor=SURFACE)
EMPTY = Style(color="#7a7d7f", bgcolor=SURFACE)
OFF = Style(color="#969a9e", bgcolor="#24272b")
"""The colors that Textual mixes for a name, a field, the text in an empty one, one that is off."""


def form_lines(rows: Sequence[tuple[str, Sequence[Text]]], width: int) -> list[Text]:
    """Names with their fields; the last of several fields in a row is a short one."""
    lines = []
    for name, fields in rows:
        line = Text(f" {name:<{FIELD_NAME_CELLS - 1}}", FIELD_NAME, no_wrap=True)
        short = [FORMAT_CELLS] * (len(fields) - 1)
        first = max(0, width - FIELD_NAME_CELLS - sum(short) - len(short))
        for cells, field in zip([first, *short], fields, strict=True):
            line.append(" " if line.cell_len > FIELD_NAME_CELLS else "")
            shown = field.copy()
            shown.truncate(cells, pad=True)
            line.append_text(shown)
        lines.append(line)
    return lines


def drawn_field(value: str, instead: str = "", *, off: bool = False) -> Text:
    """Return the contents of a field, or the hint in an empty one."""
    if not value:
        return Text(plain(instead), EMPTY)
    return Text(plain(value), OFF if off else FIELD_TEXT)
