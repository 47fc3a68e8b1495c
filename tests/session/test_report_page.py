"""The page for the customer: its parts, its forms, and the results of tests that it shows."""

from __future__ import annotations

import json
from html.parser import HTMLParser
from pathlib import Path

import pytest

from tui.drive.profile import library
from tui.drive.settings.factory import factory_raw
from tui.drive.settings.parameter_set import ParameterSet, SetHead
from tui.session.acceptance.result import settings_hash
from tui.session.connect.named_lines import ReportNames, line_settings, settings_file
from tui.session.journal import FAULT_WHYS, Entry
from tui.session.read.upload import setting_codes
from tui.session.report_page import (
    ROWS_A4,
    ROWS_TEXT,
    TEXT_WIDTH,
    TRIPS_SHOWN,
    ReportPage,
    ReportSection,
    page_form,
    pages_html,
    pages_markdown,
    pages_text,
    report_page,
    unread_page,
)
from tui.session.stored_results import results_in, results_of

PROFILE = library.load("atv71")
HEAD = SetHead(
    "atv71", "1.0", "Altivar 71", "2026-11-22T09:40:54+01:00", "tcp:192.168.0.10", 4, "0.2.1",
    {"reference": "ATV71HU15M3", "name": "<b>PUMP</b>"},
)  # fmt: skip
NAMES = ReportNames("Drives & Co", "A. Person", "Waterworks", "B. Person")


def values_of(**changed: int) -> ParameterSet:
    """Factory settings, with others for some codes."""
    factory = {p.code: factory_raw(PROFILE, p, {}, frozenset()) for p in PROFILE.parameters}
    raws = {code: raw for code, raw in factory.items() if raw is not None}
    return ParameterSet(HEAD, {**raws, **changed})


VALUES = values_of(ACC=77)


def stored(folder: Path, **changed: object) -> Path:
    """Store a result of an acceptance test in a subfolder, as `accept` does."""
    raws = {code: VALUES.raws[code] for code in setting_codes(PROFILE) if code in VALUES.raws}
    result = {
        "schema": 1, "command": "accept", "line": "tcp:192.168.0.10:502", "device": 4,
        "profile": "atv71", "name": "Pump test", "passed": True, "why_not": None,
        "begun": "2026-11-21T10:00:00+01:00", "by": "A. Person",
        "identity": {"reference": "ATV71HU15M3"},
        "settings_hash_after": settings_hash(ParameterSet(HEAD, raws)),
        "steps": [{"outcome": "passed", "number": 1}, {"outcome": "passed"}],
    }  # fmt: skip
    path = folder / f"run-{len(list(folder.iterdir()))}" / "pump-test.json"
    path.parent.mkdir()
    path.write_text(json.dumps({**result, **changed}), "utf-8")
    return path


def page(folder: Path, values: ParameterSet = VALUES, entries: list[Entry] | None = None) -> str:
    """The page as Markdown."""
    made = report_page(PROFILE, values, entries or [], results_in(folder), NAMES)
    return pages_markdown([made])


def test_page_has_identity_settings_tests_and_signers(tmp_path: Path) -> None:
    stored(tmp_path)
    text = page(tmp_path)
    assert "Drives & Co for Waterworks" in text
    assert "- Reference: ATV71HU15M3" in text
    assert "| ACC | Acceleration time | 3.0 s ? | 7.7 s |" in text
    assert "| DEC |" not in text
    row = "| 2026-11-21 | Pump test | PASSED | 2 of 2 | unchanged | A. Person |"
    assert row in text
    assert "| Drives & Co, A. Person |  |  |" in text
    assert "| Waterworks, B. Person |  |  |" in text


def test_settings_that_changed_after_the_test_are_reported(tmp_path: Path) -> None:
    stored(tmp_path)
    assert "| 2 of 2 | CHANGED |" in page(tmp_path, values_of(ACC=78))


def test_failed_test_is_reported_as_not_passed(tmp_path: Path) -> None:
    stored(tmp_path, passed=False, why_not="Failed: step 2.")
    assert "| NOT PASSED. Failed: step 2. |" in page(tmp_path)


def test_newest_result_of_a_test_counts(tmp_path: Path) -> None:
    stored(tmp_path, begun="2026-11-22T09:00:00+01:00", passed=False, why_not="x")
    stored(tmp_path, begun="2026-11-22T07:59:00+00:00")
    (found,) = results_of(results_in(tmp_path), VALUES)
    assert not found.passed


@pytest.mark.parametrize(
    "other",
    [
        {"device": 5},
        {"line": "tcp:192.168.0.11"},
        {"profile": "atv312"},
        {"identity": {"reference": "ATV71HU22M3"}},
        {"command": "report"},
        {"steps": "none"},
        {"begun": "yesterday"},
    ],
)
def test_result_of_another_drive_is_not_shown(tmp_path: Path, other: dict[str, object]) -> None:
    stored(tmp_path, **other)
    (tmp_path / "bad.json").write_bytes(b'{"command": "accept\xff')
    (tmp_path / "deep.json").write_text("[" * 100_000, "utf-8")
    text = page(tmp_path)
    assert "Pump test" not in text
    assert "No result of `drivepanel accept`" in text


def test_trips_are_newest_first_and_counted(tmp_path: Path) -> None:
    known = ("tcp:192.168.0.10", 4, "atv71", "OCF", 0, None, "", 9, "Overcurrent")
    why = FAULT_WHYS["tripped"]
    entries = [
        Entry(f"2026-11-0{n}T10:00:00.000+01:00", *known, "tripped", None, why, kind="fault")
        for n in range(1, 9)
    ]
    rows = [row for row in page(tmp_path, entries=entries).splitlines() if "Overcurrent" in row]
    assert len(rows) == TRIPS_SHOWN
    assert rows[0].startswith("| 2026-11-08 10:00:00 | OCF |")
    assert "3 more are not shown." in page(tmp_path, entries=entries)


class Tags(HTMLParser):
    """Collects the tags of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.tags: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        assert not {name for name, _ in attrs} & {"src", "href"}


def test_html_page_escapes_texts_and_loads_nothing(tmp_path: Path) -> None:
    stored(tmp_path, name="<script>x</script>\x1b")
    made = report_page(PROFILE, VALUES, [], results_in(tmp_path), NAMES)
    html = pages_html([made, unread_page(5, "No answer <b>.", NAMES)])
    parser = Tags()
    parser.feed(html)
    assert "script" not in parser.tags
    assert "b" not in parser.tags
    assert parser.tags.count("article") == 2
    assert "\x1b" not in html
    assert "No answer &lt;b&gt;." in html


def wide_page() -> ReportPage:
    """A page with the longest texts and the most rows of each section."""
    long, wide = "Wide name " * 4, "W" * 60
    rows = [("WWWW", long, wide, wide)] * 90
    test = ("2026-11-11", long, f"NOT PASSED. {wide}", "10 of 10", "CHANGED", wide)
    trip = ("2026-11-11 11:11:11", "WWW", wide, "2026-11-11 11:11:11")
    adapter = "serial:/dev/serial/by-id/usb-FTDI_FT232R_USB_UART_A50285BI-if00-port0 19200 8E1"
    pairs = [("Line", f"{adapter}, address 100"), *((f"Key {n}", long) for n in range(9))]
    tested = ("date", "test", "result", "steps", "settings", "by")
    sections = [
        ReportSection("Identity", pairs),
        ReportSection("Settings", rows, ("code", "name", "factory", "now"), long * 4),
        ReportSection("Tests", [test] * 5, tested, "3 more are not shown."),
        ReportSection("Trips", [trip] * 5, ("seen", "fault", "name", "reset"), wide + long * 2),
        ReportSection("Operation", [("Energy consumed", "3671 kWh")] * 3),
    ]
    return ReportPage("W" * 80, f"{wide} for {wide}", sections, [f"{wide}, {wide}"] * 2)


def test_text_page_fits_a_sheet_and_counts_what_it_omits() -> None:
    text = pages_text([wide_page()] * 2)
    first, second = text.split("\f")
    assert first == second
    lines = first.splitlines()
    assert max(len(line) for line in lines) <= TEXT_WIDTH
    assert len(lines) <= 70
    assert sum(line.startswith("  WWWW") for line in lines) == ROWS_TEXT
    assert f"{90 - ROWS_TEXT} more are not shown." in first.replace("\n", " ")
    assert sum("NOT PASSED" in line for line in lines) == 5


def test_html_page_counts_what_it_omits() -> None:
    html = pages_html([wide_page()])
    assert html.count("<td>WWWW</td>") == ROWS_A4
    assert f"{90 - ROWS_A4} more are not shown." in html


def test_suffix_selects_the_form() -> None:
    forms = {".html": pages_html, ".HTM": pages_html, ".txt": pages_text, ".md": pages_markdown}
    for suffix, form in {**forms, "": pages_markdown}.items():
        assert page_form(Path(f"report{suffix}")) is form


def test_names_are_those_of_the_settings_file() -> None:
    path = settings_file()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        '[report]\ncompany = "Drives & Co"\nname = 5\nplace = "x"\n[lines]\npump = "tcp:1.2.3.4"\n',
        "utf-8",
    )
    found = line_settings()
    assert found.names == ReportNames("Drives & Co")
    assert [fault.removeprefix(f"{path}:") for fault in found.faults] == [
        "3: report.name: expected a text of 60 characters at most.",
        "4: report.place: only company, name, customer, customer_name are known here.",
    ]
    assert "pump" in found.lines


def test_page_of_an_unreadable_drive_gives_the_reason() -> None:
    assert "- Reason: No answer." in pages_markdown([unread_page(5, "No answer.", NAMES)])
