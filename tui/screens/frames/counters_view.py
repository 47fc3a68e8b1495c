"""Counters page: our counts, the drive's own, turnarounds and differences. Pure functions."""

from __future__ import annotations

import math
from collections.abc import Sequence

from rich.text import Text

from tui.session.counters.compare import Comparison, TurnaroundBar, bars
from tui.session.counters.watch import CountersNow
from tui.widgets.drawing import cut_at_word, rule, short, whole_sentences, wrapped
from tui.widgets.palette import ALARM, BAR, BAR_REST, FAINT, FAULT, PLAIN, RUNNING, STRONG

EIGHTHS = " ▁▂▃▄▅▆▇█"
"""Bar characters from 0 to 8 eighths of a row."""
LEFT, NARROW_LEFT, WHOLE_COUNTS = 42, 24, 79
"""Columns of our counts, also in a page of less than so many; the drive's own counters are to their
right."""
BAR_WIDTH = 7
TALL, TALL_BARS, LOW_BARS = 30, 6, 1
"""Minimum rows of the page for tall bars; rows of tall bars and of low bars."""
LOAD_CELLS = 20
MOST_LINES_OF_ONE = 4
RESET_KEYS = "C restart counts, Z reset drive's counters"
BAD = frozenset({"never-arrived", "not-answered", "damaged-there", "damaged-here", "no-answer"})
"""Kinds of differences that mean lost frames."""


def counters_lines(found: CountersNow, who: str, width: int, height: int) -> list[Text]:
    """Lay out the page in at most `height` rows; `who` names the drive in the heading."""
    by = f"counted by {found.counted_by}" if found.counted_by else "counted by this panel"
    lines = [rule(f"Counters of {who}", width, by)]
    left = LEFT if width >= WHOLE_COUNTS else NARROW_LEFT
    lines += beside(our_lines(found, left), drive_lines(found, width - left), width, left)
    lines += load_lines(found, LOAD_CELLS if width >= WHOLE_COUNTS else LOAD_CELLS // 2)
    lines.append(rule("Turnaround of the drive, in ms", width, "since the line was opened"))
    tall = TALL_BARS if height >= TALL else LOW_BARS
    lines += bar_lines(bars(found.total.turnarounds), tall)
    lines.append(rule("Differences", width, RESET_KEYS))
    lines += message(found, width, max(1, height - len(lines)))
    return lines[:height]


def our_lines(found: CountersNow, width: int = LEFT) -> list[Text]:
    """Return the counts since the line was opened, and since the last reset.

    They are those of the program that holds the line. A narrow column has only the latter.
    """
    total, since = found.total, found.since
    counts, cells = ("since open", 12) if width >= LEFT else ("", 0)
    head = Text(f" {'This panel':<10}{counts:>{cells + 5 if cells else 0}}", FAINT)
    head.append(f"{time_text(found.seconds):>{width - 2 - head.cell_len}}")
    rows = [
        ("frames sent", total.requests, since.requests),
        ("answered", total.replies, since.replies),
        ("timeouts", total.timeouts, since.timeouts),
        ("damaged", total.checksum, since.checksum),
        ("unexpected", total.wrong, since.wrong),
        ("refused", sum(total.exceptions.values()), sum(since.exceptions.values())),
        ("repeated", total.repeats, since.repeats),
        ("bytes sent", total.bytes_out, since.bytes_out),
        ("bytes received", total.bytes_in, since.bytes_in),
    ]
    lost = {"timeouts", "damaged", "unexpected"}
    lines = [head]
    for name, all_of_them, lately in rows:
        text = Text(f" {name:<15}", FAINT, no_wrap=True)
        text.append(f"{all_of_them:>{cells}}" if cells else "", PLAIN)
        style = ALARM if name in lost and lately else STRONG
        text.append(f"{lately:>{width - 2 - text.cell_len}}", style)
        lines.append(text)
    return lines


def time_text(seconds: float) -> str:
    """Return a duration: `last 95 s`, `last 12 min`, `last 3 h`."""
    if seconds < 2 * 60:
        return f"last {seconds:.0f} s"
    return f"last {seconds / 60:.0f} min" if seconds < 2 * 3600 else f"last {seconds / 3600:.0f} h"


def drive_lines(found: CountersNow, width: int) -> list[Text]:
    """Return the drive's own counters since the first reading, and refusals by exception code."""
    refused = ", ".join(f"{code}: {n}" for code, n in sorted(found.total.exceptions.items()))
    codes = [Text(f"Refused, by code  {refused}", FAINT)] if refused else []
    if found.trouble:
        reported = wrapped(found.trouble, width - 2, 3)
        return [Text("The drive's own", FAINT), *(Text(line, ALARM) for line in reported), *codes]
    if not found.drive:
        none = Text("None reported or read yet.", FAINT)
        return [Text("The drive's own", FAINT), none, *codes]
    cells = min(16, width - 21)
    head = short("The drive", cells) if cells < 16 else "The drive itself"
    lines = [Text(f"{head:<{cells}}{'now':>6}{'since':>7}{'sent':>8}", FAINT)]
    for name, comparison in found.drive:
        lines += _pair(name, comparison, cells)
    return [*lines, *codes]


def _pair(name: str, comparison: Comparison, cells: int) -> list[Text]:
    """Return two rows for a pair of counters: frames, and frames with a bad checksum.

    Names have `cells`. The columns are: now, since the first reading, sent by us since then.
    """
    # counters of another port are shown but not compared
    other = comparison.counts_this_line is False
    strong, sent = FAINT if other else STRONG, comparison.sent
    ours = min(max(comparison.frames, sent.low), sent.high)
    frames = Text(f"{short(name, cells - 1):<{cells}}", FAINT if other else PLAIN, no_wrap=True)
    frames.append(f"{comparison.last.frames:>6}").append(f"{comparison.frames:>7}", strong)
    frames.append("" if other else f"{ours:>8}", PLAIN if ours == comparison.frames else ALARM)
    errors = Text(f"{'  bad checksum':<{cells}}", FAINT, no_wrap=True)
    most = (
        f">{comparison.last.damaged}" if comparison.last.saturated else str(comparison.last.damaged)
    )
    errors.append(f"{most:>6}", PLAIN)
    errors.append(f"{comparison.damaged:>7}", ALARM if comparison.damaged else strong)
    return [frames, errors]


def beside(
    left: Sequence[Text], right: Sequence[Text], width: int, column: int = LEFT
) -> list[Text]:
    """Join two columns of rows; the right one starts at this column."""
    lines = []
    for at in range(max(len(left), len(right))):
        text = left[at].copy() if at < len(left) else Text(no_wrap=True)
        if at < len(right):
            text.append(" " * max(0, column - text.cell_len)).append_text(right[at])
        text.truncate(width, overflow="ellipsis")
        lines.append(text)
    return lines


def load_lines(found: CountersNow, cells: int = LOAD_CELLS) -> list[Text]:
    """Return a row with the load of the line since the last reset; dashes if unknown."""
    text = Text(" load of the line ", FAINT, no_wrap=True)
    if found.line_load is None or found.device_load is None:
        return [text.append("-----", FAINT)]
    full = round(cells * found.line_load)
    text.append("▕", FAINT).append("█" * full, BAR).append("·" * (cells - full), BAR_REST)
    text.append("▏", FAINT).append(f"{100 * found.line_load:>4.0f} %", STRONG)
    text.append("   with this drive ", FAINT).append(f"{100 * found.device_load:.0f} %", PLAIN)
    return [text]


def bar_lines(shown: Sequence[TurnaroundBar], rows: int) -> list[Text]:
    """Return the bars in `rows` rows, then their counts, then their upper limits in ms."""
    most = max((bar.count for bar in shown), default=0)
    heights = [math.ceil(8 * rows * bar.count / most) if most else 0 for bar in shown]
    lines = []
    for row in reversed(range(rows)):
        cells = [EIGHTHS[min(8, max(0, height - 8 * row))] * 4 for height in heights]
        lines.append(Text("".join(f"{cell:>{BAR_WIDTH}}" for cell in cells), BAR, no_wrap=True))
    counts = Text(no_wrap=True)
    for bar in shown:
        counts.append(f"{bar.count:>{BAR_WIDTH}}", PLAIN if bar.count else BAR_REST)
    ends = [str(bar.up_to_ms) if bar.up_to_ms is not None else "more" for bar in shown]
    return [*lines, counts, Text("".join(f"{end:>{BAR_WIDTH}}" for end in ends), FAINT)]


NOT_COMPARED = "Not compared: the drive's own counters were not read."


def message(found: CountersNow, width: int, room: int) -> list[Text]:
    """Return the differences, lost frames first, or one row if the counters agree.

    If they exceed `room` rows, each is shortened to one row.
    """
    if found.trouble and not found.differences:
        text = Text(no_wrap=True).append(" ■ ", ALARM)
        return [text.append(short(NOT_COMPARED, width - 4), PLAIN)]
    if found.agree:
        text = Text(no_wrap=True).append(" ● ", RUNNING)
        return [text.append(short(found.agreeing, width - 4), PLAIN)]
    worst = sorted(found.differences, key=lambda item: item.kind not in BAD)
    parts = [wrapped(difference.text, width - 5, MOST_LINES_OF_ONE) for difference in worst]
    if sum(map(len, parts)) > room:
        # the first sentence of every difference matters more than advice on the worst
        texts = [whole_sentences(difference.text, width - 5) for difference in worst]
        parts = [[cut_at_word(text, width - 5)] for text in texts]
    lines: list[Text] = []
    for difference, reported in zip(worst, parts, strict=True):
        sign = FAULT if difference.kind in BAD else ALARM
        for at, part in enumerate(reported):
            text = Text(no_wrap=True).append("   " if at else " ■ ", sign)
            lines.append(text.append(part, PLAIN))
    return lines
