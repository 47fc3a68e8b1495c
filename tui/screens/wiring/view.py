"""The page of a family as lines; pure functions."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.text import Text

from tui.drive.family_page import PageLine, PageRow, PageSection
from tui.widgets.palette import ALARM, FAINT, PLAIN, STRONG

if TYPE_CHECKING:
    from tui.session.diagnosis.diagnosis import Diagnosis


def trouble_sections(found: Diagnosis | None, wall: float) -> list[PageSection]:
    """The verdict of N with its steps, measured at this time; none if the drive answers well."""
    if found is None or found.well:
        return []
    rows = [PageRow("!", found.text, warns=True)]
    if found.others:
        rows.append(PageRow("Certainty", f"{found.certainty}. It could also be:"))
        rows += [PageRow("", other) for other in found.others]
    heads = ["Next steps", *("" for _ in found.steps)]
    rows += [PageRow(head, step) for head, step in zip(heads, found.steps, strict=False)]
    at = time.strftime("%H:%M:%S", time.localtime(wall))
    return [PageSection(f"Trouble, measured at {at}", tuple(rows))]


def wiring_lines(page: Sequence[PageLine]) -> list[Text]:
    """The lines of a page with their colors: amber where it warns, else grey."""
    return [_line(line) for line in page]


def _line(line: PageLine) -> Text:
    if line.kind == "title":
        return Text(f" {line.head}", STRONG, no_wrap=True)
    text = Text(line.head, FAINT, no_wrap=True)
    if line.kind == "warning":
        text.stylize(ALARM)
    text.append(line.text, PLAIN)
    return text


def section_tops(page: Sequence[PageLine]) -> list[int]:
    """Return the first line of each section."""
    return [number for number, line in enumerate(page) if line.kind == "title"]
