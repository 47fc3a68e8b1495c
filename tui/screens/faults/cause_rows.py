"""Rows of the weighed causes, each with the values for or against it; pure functions."""

from __future__ import annotations

from rich.style import Style
from rich.text import Text

from tui.drive.causes import WeighedCause
from tui.drive.hints import TRUST
from tui.drive.profile.schema import FaultHelp
from tui.widgets.drawing import cut, rule, wrapped
from tui.widgets.palette import ALARM, FAINT, PLAIN, STRONG

from .doctor_view import DoctorView

SIGN_WIDTH = 4
"""Columns of the sign before a cause."""
LIKELIEST, OPEN, EXCLUDED = "▸", "?", "×"
"""Sign of a cause: the likeliest or supported by a value, not decided, and ruled out."""
STRUCK = Style(color=FAINT.color, strike=True)


def cause_rows(view: DoctorView, width: int) -> list[list[Text]]:
    """Return the rows of each cause, the likeliest first, under the heading."""
    left = view.advice
    if view.hint is None or left is None:
        return _unweighed(view, width)
    count = len(left.probable)
    reported = f"{count} of {len(left.causes)} left, {TRUST[left.confidence]}"
    heading = [rule("Why", width, reported)]
    if isinstance(view.hint, FaultHelp) and view.hint.name:
        heading.append(Text(cut(f"  {view.hint.name}", width), PLAIN))
    if not count:
        heading.append(Text(cut("  No cause is left: the values rule out each one.", width), ALARM))
    aligned = SIGN_WIDTH + 2 + max(len(cause.text) for cause in left.causes)
    rows = [_rows(cause, not n, aligned, width) for n, cause in enumerate(left.causes)]
    return [heading, *rows]


def _unweighed(view: DoctorView, width: int) -> list[list[Text]]:
    """Return the cause that the profile names, if there is no help on the fault."""
    if view.is_quiet:
        return []
    cause = view.fault.cause if view.fault else ""
    cause = cause or view.profile.guide.trouble or "The available manual gives no cause."
    rows = [Text(f"    {part}", PLAIN) for part in wrapped(cause, width - SIGN_WIDTH - 1, 3)]
    return [[rule("Why", width)], rows]


def _rows(cause: WeighedCause, first: bool, aligned: int, width: int) -> list[Text]:
    """Return a cause, and its values beside it or, if there is no room, below it."""
    excluded = cause.verdict == "excluded"
    likely = cause.verdict == "supported" or (first and not excluded)
    sign = EXCLUDED if excluded else LIKELIEST if likely else OPEN
    text = Text("  ", no_wrap=True)
    text.append(f"{sign} ", FAINT if excluded else STRONG if likely else ALARM)
    style = STRUCK if excluded else STRONG if first else PLAIN
    text.append(cut(cause.text, min(len(cause.text), width - SIGN_WIDTH)).rstrip(), style)
    aligned = min(aligned, width // 2 + SIGN_WIDTH)
    reason = reason_text(cause)
    if max(aligned, text.cell_len + 2) + len(reason) > width:
        reason = reason_text(cause, 1)
    column = max(aligned, text.cell_len + 2)
    if column + len(reason) > width:
        column = text.cell_len + 2
    if column + len(reason) <= width:
        text.append(" " * (column - text.cell_len))
        text.append(reason, PLAIN if cause.verdict == "supported" else FAINT)
        return [text]
    if cause.verdict == "open":
        return [text]
    parts = wrapped(reason, width - SIGN_WIDTH - 2, 2)
    below = [Text(f"{' ' * (SIGN_WIDTH + 2)}{part}", PLAIN, no_wrap=True) for part in parts]
    return [text, *below]


def reason_text(cause: WeighedCause, most: int = 2) -> str:
    """Return the values that decided about a cause, `most` of them, or why none did."""
    if cause.verdict == "open":
        unknown = ", ".join(cause.unknown[:2])
        return f"not known: {unknown}" if unknown else "no value decides"
    texts = [evidence.text for evidence in cause.evidence[:most]]
    text = "; ".join(texts)
    if cause.evidence[0].basis == "now" and cause.verdict == "excluded":
        return f"not now: {text}"
    return f"now {text}" if cause.evidence[0].basis == "now" else text
