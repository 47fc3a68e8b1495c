"""`drivepanel report`: identity, settings and journal of a drive as Markdown."""

from __future__ import annotations

import codecs
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..shared.drives import USUAL_SEARCH
from ..shared.errors import INTERRUPTED, Failure, end_with
from ..shared.options import Target, json_option, line_argument, never_forced, several_settings
from ..shared.output import drive_fields, print_json
from ..shared.registration import ON_LINE, command
from ..shared.say import Messages
from ..shared.sets import file_argument, force_option, refuse_output, set_of_drive, write_down
from ..shared.standard_streams import STANDARD

if TYPE_CHECKING:
    from tui.session.report_trends import ReportTrend
    from tui.widgets.curve import CurveSigns, Samples


CURVE_COLUMNS, CURVE_ROWS = 64, 7
CURVE_LABEL_CELLS = 7


def curve_text(trend: ReportTrend) -> list[str]:
    """Return the curves of frequency and current as a code block, one below the other.

    They are made of ASCII characters if the output has no others.
    """
    from tui.widgets.curve import curve_signs

    points = trend.curve.points
    hertz = [(point.time, point.hertz) for point in points]
    amperes = [(point.time, point.amperes) for point in points]
    is_utf = codecs.lookup(output_encoding()).name.startswith("utf")
    signs = curve_signs(plain=not is_utf, braille=True)
    lines = ["```", *_curve_rows(hertz, "Hz", trend, signs)]
    if any(value is not None for _, value in amperes):
        lines += _curve_rows(amperes, "A", trend, signs)
    return [*lines, *_axis(trend), "```"]


def output_encoding() -> str:
    """The encoding of standard output."""
    return sys.stdout.encoding or "ascii"


def _curve_rows(samples: Samples, unit: str, trend: ReportTrend, signs: CurveSigns) -> list[str]:
    """The rows of one curve, with the ends of its scale at the left."""
    from rich.style import Style

    from tui.widgets.curve import Curve, Plot, curve_texts, round_up, scale_of

    values = [value for _, value in samples if value is not None]
    high = round_up(max(map(abs, values)))
    scale = scale_of(-high if min(values) < 0 else 0.0, high, CURVE_ROWS)
    start, end = trend.curve.points[0].time, trend.curve.points[-1].time
    # a little longer, so that the last value is inside
    span = (end - start) * (1 + 0.5 / CURVE_COLUMNS)
    plot = Plot(start, span, scale, CURVE_COLUMNS, CURVE_ROWS, signs)
    labels = {plot.row(value): f"{value:g} {unit}" for value in (scale.low, scale.high)}
    rows = curve_texts(Curve(samples, Style()), plot, trend.reach)
    return [
        f"{labels.get(number, ''):>{CURVE_LABEL_CELLS}} {row}".rstrip()
        for number, row in enumerate(rows)
    ]


def _axis(trend: ReportTrend) -> list[str]:
    """The times of both ends below them, and those of the marks."""
    from tui.session.changes import local_time

    first, last = (local_time(trend.curve.points[at].time) for at in (0, -1))
    ends = f"{first:%H:%M:%S}", f"{last:%H:%M:%S}"
    line = f"{'':>{CURVE_LABEL_CELLS}} {ends[0]}{ends[1]:>{CURVE_COLUMNS - len(ends[0])}}"
    marks = [f"{text} at {local_time(time):%H:%M:%S}" for time, text in trend.curve.marks]
    return [line, *(f"{'':>{CURVE_LABEL_CELLS}} {mark}" for mark in marks)]


@command("Write a report on a drive to a file.", group="Watch", statuses=ON_LINE)
@line_argument
@file_argument
@force_option
@click.option("--page", is_flag=True, help="Write one page for the customer (.md, .html, .txt).")
@click.option(
    "--tests",
    type=click.Path(path_type=Path, exists=True, file_okay=False),
    metavar="FOLDER",
    help="Search FOLDER for results of accept (default: FILE's).",
)
@click.option("--all", "every", is_flag=True, help="Write a page about every drive that answers.")
@click.option(
    "--addresses",
    metavar="LIST",
    help=f"Scan these addresses with --all (default: {USUAL_SEARCH}).",
)
@json_option
@several_settings
@never_forced
def report(
    target: Target,
    file: Path,
    force: bool,
    page: bool,
    tests: Path | None,
    every: bool,
    addresses: str | None,
    as_json: bool,
) -> None:
    """Write a report on a drive to FILE, as Markdown; `-` is standard output.

    It has identification, line settings, settings changed from the factory, control source,
    scanner, reaction to a communication loss, faults, and writes by Drive Panel. The trends of the
    last trip and the last run are SVG files next to FILE; on standard output they are text.

    With --page it is one page for the customer instead, with the tests that `accept` has passed and
    lines for signatures. The suffix of FILE selects its form, and .html needs no --page. Several -d
    or --all write a page for each drive.
    """
    from tui.session.connect.recorded_line import record_files
    from tui.session.journal import Journal
    from tui.session.journal_reading import entries_of
    from tui.session.report import report_text as text_of
    from tui.session.report_trends import TREND_KINDS, report_trends, trend_file
    from tui.session.startup.progress import start_up_lines

    from ..documents.setting_documents import ReportDocument

    refuse_output(file, force=force, as_json=as_json)
    if addresses and not every:
        raise click.UsageError("--addresses requires --all.")
    if page or file.suffix.casefold() in (".html", ".htm"):
        from ..running.customer_page import PageWriter

        wanted = PageWriter(target, file, tests, every, addresses, force, as_json)
        end_with(wanted.write())
        return
    if every or tests or target.others:
        raise click.UsageError("--all, --tests and several -d require --page.")
    if file != STANDARD:
        for kind in TREND_KINDS:
            drawing = file.with_name(trend_file(file.stem, kind))
            refuse_output(drawing, force=force, as_json=as_json)
    try:
        session, values = set_of_drive(target)
    except KeyboardInterrupt:
        raise Failure("Ended by Ctrl-C: nothing was written.", INTERRUPTED) from None
    entries = entries_of(Journal(), session.line_text, target.device)
    record = record_files(target.line_text)
    trends = report_trends(record, target.device, session.profile, entries, time.time())
    lines = _written_trends(trends, file, force=force)
    text = text_of(
        session.profile, values, entries, lines, start_up_lines(session, target.line_text)
    )
    write_down(file, text, force=force)
    messages = Messages(as_json=as_json or file == STANDARD)
    messages.tell(f"{file}: report on {session.profile.name} at address {target.device}")
    if as_json:
        print_json(
            ReportDocument(
                **drive_fields(target.line_text, session),
                file=str(file),
                parameters=len(values.raws),
                absent=dict(values.absent),
                messages=messages.texts,
            )
        )


def _written_trends(trends: Sequence[ReportTrend], file: Path, *, force: bool) -> list[str]:
    """Write the curves beside the report; return its part about them. Raises Failure."""
    from tui.session.report_trends import linked, report_trend_lines, trend_files

    if file == STANDARD:
        return report_trend_lines(trends, {trend.kind: curve_text(trend) for trend in trends})
    drawn = trend_files(trends, file.stem)
    for name, svg in drawn.values():
        write_down(file.with_name(name), svg, force=force)
    return report_trend_lines(trends, linked(drawn))
