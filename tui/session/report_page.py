"""One page for the customer about one drive: identity, settings, tests, trips, signatures.

Its forms are Markdown, HTML that prints on one A4 page, and text.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from html import escape
from pathlib import Path
from textwrap import wrap
from types import MappingProxyType
from typing import NamedTuple

from tui.drive.model import model_read
from tui.drive.plain import plain, plain_cells
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Quantity
from tui.drive.sentences import counted
from tui.drive.settings.compare import compare_settings, factory_side, side_of
from tui.drive.settings.parameter_set import ParameterSet
from tui.drive.values import NOT_AVAILABLE

from .connect.named_lines import ReportNames, line_settings
from .journal import Entry
from .report import ReportParts, table_markdown, trips_of, zoned_time
from .stored_results import StoredResult, results_in, results_of, unchanged_since

ROWS_A4, ROWS_TEXT = 32, 18
"""Most rows of a section, so that the page fits one sheet of paper."""
TEXT_WIDTH = 80
ROWS_OMITTED = "{left} more are not shown. The full report and a backup have all."
SIGNER_HEAD = "Name", "Date", "Signature"
SIGN_TEXT = f"{{name:<38}} {SIGNER_HEAD[1]} ______ {SIGNER_HEAD[2]} {'_' * 15}"


def page_form(path: Path) -> Callable[[Sequence[ReportPage]], str]:
    """Return the function that writes pages in the form of a file's suffix; Markdown for others."""
    return PAGE_FORMS.get(path.suffix.casefold(), pages_markdown)


def page_text(profile: Profile, values: ParameterSet, entries: Sequence[Entry], path: Path) -> str:
    """Return the page about one drive in the form of a file; it reads results beside that file.

    `entries` are the drive's journal entries, oldest first.
    """
    page = report_page(profile, values, entries, results_in(path.parent), line_settings().names)
    return page_form(path)([page])


def pages_markdown(pages: Sequence[ReportPage]) -> str:
    """Return the pages as Markdown, with a line between them."""
    return plain("\n---\n\n".join("\n".join(_markdown(page)) for page in pages), lines=True)


def _markdown(page: ReportPage) -> Iterator[str]:
    yield from (f"# {page.title}", "")
    if page.subtitle:
        yield from (page.subtitle, "")
    for section in page.sections:
        rows, note = _cut(section, ROWS_A4)
        yield from (f"## {section.title}", "")
        if section.head:
            yield from (*table_markdown(section.head, rows), "")
        else:
            yield from (*(f"- {name}: {value}" for name, value in rows), "")
        if note:
            yield from (note, "")
    yield from ("## Signatures", "")
    yield from table_markdown(
        ("", *SIGNER_HEAD[1:]), [(name or SIGNER_HEAD[0], "", "") for name in page.signers]
    )
    yield ""


def pages_text(pages: Sequence[ReportPage]) -> str:
    """Return the pages as text of 80 columns, with a form feed between them."""
    texts = ("\n".join(row.rstrip() for row in _text(page)) + "\n" for page in pages)
    return "\f".join(plain(text, lines=True) for text in texts)


def _text(page: ReportPage) -> Iterator[str]:
    yield from (_short(page.title, TEXT_WIDTH), "=" * min(len(page.title), TEXT_WIDTH))
    yield from ([_short(page.subtitle, TEXT_WIDTH)] if page.subtitle else [])
    for section in page.sections:
        rows, note = _cut(section, ROWS_TEXT)
        yield from ("", section.title.upper())
        yield from _aligned([section.head, *rows] if section.head else rows) if rows else ["None."]
        yield from wrap(note, TEXT_WIDTH)
    yield from ("", "SIGNATURES")
    for signer in page.signers:
        yield from ("", SIGN_TEXT.format(name=_short(signer or SIGNER_HEAD[0], 38)))


def _aligned(rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield rows in columns; the widest columns are shortened until they fit."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    while sum(widths) + 2 * len(widths) > TEXT_WIDTH:
        widths[widths.index(max(widths))] -= 1
    for row in rows:
        cells = (_short(cell, width).ljust(width) for cell, width in zip(row, widths, strict=True))
        yield f"  {'  '.join(cells)}"


def _short(text: str, most: int) -> str:
    return text if len(text) <= most else f"{text[: most - 3]}..."


def _cut(section: ReportSection, most: int) -> tuple[Sequence[Sequence[str]], str]:
    """Return the rows that fit, and the note with the number of the others."""
    left = len(section.rows) - most
    rows = [plain_cells(row) for row in section.rows[:most]]
    return rows, f"{section.note} {ROWS_OMITTED.format(left=left)}" if left > 0 else section.note


PAGE_STYLE = """
@page { size: A4; margin: 10mm 12mm }
* { box-sizing: border-box }
body { font: 8pt/1.25 sans-serif; color: #111; margin: 0 auto; max-width: 186mm }
article { break-after: page } article:last-child { break-after: auto }
h1 { font-size: 15pt; margin: 0 } h2 { font-size: 10pt; margin: 2.5mm 0 0.5mm }
p { margin: 1mm 0 } .columns { display: flex; gap: 5mm; align-items: start }
table { border-collapse: collapse; table-layout: fixed; width: 100% }
th, td { text-align: left; border-bottom: 0.1mm solid #999; padding: 0 1mm; height: 4mm }
h1, th, td { overflow: hidden; text-overflow: ellipsis; white-space: nowrap }
.pairs td { white-space: normal; overflow-wrap: anywhere } .pairs td:first-child { width: 36% }
.columns .rows { font-size: 7.5pt }
.sign td { height: 10mm; vertical-align: bottom } .sign th:first-child { width: 50% }
"""


def pages_html(pages: Sequence[ReportPage]) -> str:
    """Return the pages as one HTML document without references; each prints on one A4 sheet."""
    title = _html(pages[0].title) if len(pages) == 1 else f"Report on {len(pages)} drives"
    body = "\n".join(f"<article>\n{''.join(_html_page(page))}</article>" for page in pages)
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{title}</title>'
        f"\n<style>{PAGE_STYLE}</style>\n</head>\n<body>\n{body}\n</body>\n</html>\n"
    )


def _html_page(page: ReportPage) -> Iterator[str]:
    yield f"<h1>{_html(page.title)}</h1>\n"
    if page.subtitle:
        yield f"<p>{_html(page.subtitle)}</p>\n"
    for section in page.sections:
        rows, note = _cut(section, ROWS_A4)
        yield f"<h2>{_html(section.title)}</h2>\n"
        yield from _columns(section.head, rows) if rows else ["<p>None.</p>\n"]
        yield f"<p>{_html(note)}</p>\n" if note else ""
    yield "<h2>Signatures</h2>\n"
    names = [(name or SIGNER_HEAD[0], "", "") for name in page.signers]
    yield _html_table(("", *SIGNER_HEAD[1:]), names, "sign")


def _columns(head: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    """Yield the rows; pairs, and rows that one column has no room for, in two tables."""
    half = (len(rows) + 1) // 2
    kind, parts = ("rows" if head else "pairs"), [rows]
    if half > ROWS_A4 // 4 or not head:
        parts = [rows[:half], rows[half:]]
    yield f'<div class="columns">{"".join(_html_table(head, part, kind) for part in parts)}</div>\n'


COLUMN_SHARES: Mapping[str, int] = MappingProxyType(
    {"code": 14, "factory": 28, "now": 28, "steps": 8, "settings": 12, "by": 18, "date": 10}
)
"""Widths of columns in %, by heading; the others share the rest."""


def _html_table(head: Sequence[str], rows: Iterable[Sequence[str]], kind: str) -> str:
    cells = (f"<th{_width(name)}>{_html(name)}</th>" for name in head)
    top = f"<tr>{''.join(cells)}</tr>\n" if head else ""
    body = "".join(f"<tr>{''.join(f'<td>{_html(c)}</td>' for c in row)}</tr>\n" for row in rows)
    return f'<table class="{kind}">\n{top}{body}</table>\n'


def _width(name: str) -> str:
    return f' style="width: {COLUMN_SHARES[name]}%"' if name in COLUMN_SHARES else ""


def _html(text: str) -> str:
    return escape(plain(text))


PAGE_SUFFIXES = (".html", ".htm", ".txt")
"""Suffixes that only a page has; the report has others."""
PAGE_FORMS: Mapping[str, Callable[[Sequence[ReportPage]], str]] = MappingProxyType(
    {".html": pages_html, ".htm": pages_html, ".txt": pages_text, ".md": pages_markdown}
)


TESTS_SHOWN = TRIPS_SHOWN = 5
LONGEST_OWN_TEXT = 40
"""Most characters of a text of the drive."""
MOTOR_NAMEPLATE: tuple[Quantity, ...] = (
    "rated_voltage",
    "rated_current",
    "rated_frequency",
    "rated_speed",
)
OPERATION_COUNTERS: tuple[Quantity, ...] = ("energy", "run_hours", "power_on_hours")
SETTINGS_HEAD = ("code", "name", "factory", "now")


class ReportSection(NamedTuple):
    """A part of the page; without a heading its rows are pairs of a name and a value."""

    title: str
    rows: Sequence[Sequence[str]]
    head: Sequence[str] = ()
    note: str = ""


class ReportPage(NamedTuple):
    """The page about one drive, without its form."""

    title: str
    subtitle: str
    sections: Sequence[ReportSection]
    signers: Sequence[str]
    """The two persons who sign; texts may be empty."""


def report_page(
    profile: Profile,
    values: ParameterSet,
    entries: Sequence[Entry],
    results: Sequence[StoredResult],
    names: ReportNames,
) -> ReportPage:
    """Return the page; `entries` are the drive's journal entries, oldest first.

    `results` are those of all drives, newest first.
    """
    parts = ReportParts.from_entries(profile, values, entries)
    sections = [
        _identity(parts),
        _settings(parts),
        _tests(parts, results_of(results, values)),
        _trips(parts),
        *_operation(parts),
    ]
    name = values.head.identity.get("name") or profile.name
    title = f"Drive {values.head.device}: {name}"
    return ReportPage(title, _subtitle(names), sections, _signers(names))


def unread_page(device: int, why: str, names: ReportNames) -> ReportPage:
    """Return the page of a drive that could not be read."""
    section = ReportSection("Not read", [("Reason", why)])
    return ReportPage(f"Drive {device}", _subtitle(names), [section], _signers(names))


def _subtitle(names: ReportNames) -> str:
    return " for ".join(text for text in (names.company, names.customer) if text)


def _signers(names: ReportNames) -> list[str]:
    pairs = (names.company, names.name), (names.customer, names.customer_name)
    return [", ".join(text for text in pair if text) for pair in pairs]


def _identity(parts: ReportParts) -> ReportSection:
    head, profile = parts.values.head, parts.profile
    model = model_read(profile, parts.values.raws)
    motor = [parts.text(p.code) for q in MOTOR_NAMEPLATE if (p := profile.quantity(q)) is not None]
    rows = [
        ("Line", f"{head.line}, address {head.device}"),
        ("Family", profile.name),
        *((key.capitalize(), text[:LONGEST_OWN_TEXT]) for key, text in head.identity.items()),
        *([("Model", model)] if model else []),
        ("Motor settings", ", ".join(t for t in motor if t != NOT_AVAILABLE) or "not known"),
        ("Read", f"{zoned_time(head.time, parts.zone)} {parts.zone_text()}"),
        ("Drive Panel", f"{head.panel}, profile {profile.id} {head.profile_version}"),
    ]
    return ReportSection("Identity", rows)


UNSURE_FACTORY = "? marks factory settings that no document of this family states."


def _settings(parts: ReportParts) -> ReportSection:
    factory = factory_side(parts.profile, parts.values)
    rows = compare_settings(parts.profile, factory, side_of("now", parts.values))
    notes = [
        counted(
            len(factory.raws),
            "The factory setting of 1 parameter is known.",
            "The factory settings of {count} parameters are known.",
        )
    ]
    if absent := len(parts.values.absent):
        single, several = "1 parameter could not be read.", "{count} parameters could not be read."
        notes.append(counted(absent, single, several))
    if any(row.code in factory.unsure for row in rows):
        notes.append(UNSURE_FACTORY)
    cells = [(row.code, row.name, row.a, row.b) for row in rows]
    return ReportSection(
        "Settings that differ from the factory", cells, SETTINGS_HEAD, " ".join(notes)
    )


SETTINGS_SINCE: Mapping[bool | None, str] = MappingProxyType(
    {True: "unchanged", False: "CHANGED", None: "not known"}
)
"""Texts about settings that are those after a test, others, or not known."""


def _tests(parts: ReportParts, results: Sequence[StoredResult]) -> ReportSection:
    rows = [
        (
            f"{result.begun.astimezone(parts.zone):%Y-%m-%d}",
            result.name,
            "PASSED" if result.passed else f"NOT PASSED. {result.why_not or ''}".rstrip(),
            result.steps_text,
            SETTINGS_SINCE[unchanged_since(result, parts.profile, parts.values)],
            result.by,
        )
        for result in results
    ]
    head = ("date", "test", "result", "steps", "settings", "by")
    if parts.proofs:
        proof = parts.proofs[-1]
        when = zoned_time(proof.time, parts.zone)[:10]
        # first: the last rows are not shown
        rows.insert(0, (when, "Communication loss", proof.new, "", "", ""))
    note = "" if rows else "No result of `drivepanel accept` for this drive was found."
    return _limited(ReportSection("Tests", rows, head, note), TESTS_SHOWN)


def _trips(parts: ReportParts) -> ReportSection:
    rows = [
        (
            zoned_time(trip.tripped or trip.seen, parts.zone),
            trip.code,
            trip.name,
            zoned_time(trip.reset, parts.zone),
        )
        for trip in reversed(trips_of(parts.trips))
    ]
    stored = parts.profile.data.faults.parameter
    note = f"Fault or last fault in the drive: {parts.fault_text(stored)}." if stored else ""
    head = ("seen", "fault", "name", "reset")
    return _limited(ReportSection("Trips seen by Drive Panel", rows, head, note), TRIPS_SHOWN)


def _operation(parts: ReportParts) -> list[ReportSection]:
    found = [p for q in OPERATION_COUNTERS if (p := parts.profile.quantity(q)) is not None]
    rows = [(p.name, parts.text(p.code)) for p in found if p.code in parts.values.raws]
    return [ReportSection("Operation", rows)] if rows else []


def _limited(section: ReportSection, most: int) -> ReportSection:
    """Return the section with its first rows; its note counts the others."""
    left = len(section.rows) - most
    if left <= 0:
        return section
    more = counted(left, "1 more is not shown.", "{count} more are not shown.")
    return section._replace(rows=section.rows[:most], note=f"{section.note} {more}".strip())
