"""Reports on one drive and its comparison with its profile, as text.

`recorded_reports.txt` has a section for each subject; each entry has the case and its results.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import pytest

from tests.drive.test_whole_files import HEAD, OWN_SET
from tests.drive.test_whole_values import HELD, OTHER, whole
from tests.recorded import sections
from tests.session.test_recorded_texts import ENTRIES
from tui.bus.errors import LineError, NoAnswer
from tui.bus.fake import FakeLine
from tui.bus.fake_device import FakeDevice
from tui.drive.errors import DriveError
from tui.drive.profile.example_frames import ExampleFrame, FramePair, example_frames_of
from tui.drive.profile.library import load
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import EvidenceFinding, Parameter
from tui.drive.settings.factory import factory_raw
from tui.drive.settings.parameter_set import ParameterSet
from tui.drive.values import to_words, word_count
from tui.session import report, report_page
from tui.session.acceptance.result import settings_hash
from tui.session.conformance import AskDisplay, Conformance
from tui.session.connect.identify import DriveIdentity
from tui.session.connect.named_lines import ReportNames
from tui.session.drive import DriveSession
from tui.session.journal import Entry
from tui.session.read.upload import setting_codes
from tui.session.report_page import ReportSection, pages_html, pages_markdown, pages_text
from tui.session.report_trends import linked, report_trend_lines, report_trends, trend_files
from tui.session.stored_results import StoredResult, StoredStep, results_of, unchanged_since

from .invented_record import ATV71, BEGIN, DRIVE_EVENTS, drive_rows, written

TEXTS = Path(__file__).parent / "recorded_reports.txt"
NAMES = (
    ReportNames("Drives & Co", "A. Person", "Waterworks", "B. Person"),
    ReportNames("", "", "Waterworks", ""), ReportNames("Drives", "", "", "B. <Person>"),
)  # fmt: skip


def stored(number: int, **changed: object) -> StoredResult:
    """A result of an acceptance test of the invented drive."""
    profile = whole()
    raws = {code: HELD[code] for code in setting_codes(profile) if code in HELD}
    return replace_fields(
        StoredResult(
            "accept", "rtu:x", 7, "example-fan", f"Test {number}", True,
            datetime(2026, 1, number, 23, 30, tzinfo=UTC), "A. Person",
            [StoredStep("passed"), StoredStep("failed")], {"reference": "EXFAN-22"}, None,
            settings_hash(ParameterSet(HEAD, raws)),
        ),
        changed,
    )  # fmt: skip


def replace_fields(found: StoredResult, changed: Mapping[str, object]) -> StoredResult:
    for name, value in changed.items():
        setattr(found, name, value)
    return found


def pages() -> Iterator[str]:
    """Pages of drives in several states, in each form."""
    profile = whole()
    tests = [
        stored(7), stored(6, passed=False, why_not="Failed: step 2."),
        stored(5, passed=False, settings_hash_after=None),
        stored(4, settings_hash_after="x"), stored(3, identity={"reference": "EXFAN-11"}),
        stored(2, device=8), stored(1, line="rtu:y"), stored(1, profile="other"),
        stored(9, name="Test 7"), stored(8), stored(10, identity={}), stored(11), stored(12),
    ]  # fmt: skip
    own = results_of(tests, OWN_SET)
    yield f"{[(each.name, each.steps_text) for each in own]}"
    yield f"{[unchanged_since(each, profile, OWN_SET) for each in own]}"
    bare = replace(OWN_SET, raws={}, absent={}, head=replace(HEAD, identity={}, time="x"))
    named = replace(OWN_SET, raws=OTHER, head=replace(HEAD, identity={"name": "P" * 50}))
    faults = [entry for entry in ENTRIES if entry.kind == "fault"] * 4
    many = [replace(entry, time=f"2026-01-02T11:{at:02}:00.000+00:00", code=f"F{at // 3}")
            for at, entry in enumerate(faults)]  # fmt: skip
    sets: tuple[tuple[ParameterSet, list[Entry], list[StoredResult]], ...] = (
        (OWN_SET, ENTRIES, tests), (bare, [], []), (named, many, tests[:2]),
    )  # fmt: skip
    made = [report_page.report_page(profile, *each, NAMES[at]) for at, each in enumerate(sets)]
    factory = {p.code: factory_raw(ATV71, p, {}, frozenset()) for p in ATV71.parameters}
    changed = {code: raw + 1 for code, raw in factory.items() if raw is not None}
    values = ParameterSet(replace(HEAD, profile="atv71"), changed, {"X": "no reply"})
    made.append(report_page.report_page(ATV71, values, [], [], NAMES[0]))
    made.append(report_page.unread_page(9, "no reply <x>", NAMES[1]))
    sections = [ReportSection("Few", [(f"{at}", "x" * at) for at in range(17)], ("n", "code"), "")]
    made.append(made[-1]._replace(title="T" * 90, subtitle="S" * 90, sections=sections))
    for page in made:
        yield f"{page.title} {page.signers}"
        yield from (pages_markdown([page]), pages_text([page]))
        yield pages_html([page]).partition("</style>")[2]
    for form in (pages_markdown, pages_text, pages_html):
        yield f"{len(form(made))} {form(made[-2:])[:400]}"
    names = ("a.md", "b.HTML", "c.htm", "d.txt", "e", "f.pdf")
    yield f"{[report_page.page_form(Path(name)).__name__ for name in names]}"


def reports() -> Iterator[str]:
    """Reports on drives of several families with factory settings, faults and many entries."""
    many = [replace(ENTRIES[0], code=f"C{at}") for at in range(203)]
    for name in ("atv21", "atv71", "powerdrive", "varmeca"):
        profile = load(name)
        factory = {p.code: factory_raw(profile, p, {}, frozenset()) for p in profile.parameters}
        held = {code: raw for code, raw in factory.items() if raw is not None}
        own = profile.data.faults
        slots = {slot: raw for each in profile.data.blocks
                 for slot, raw in zip(each.slots, (3201, 0, 77, 0xFD00), strict=False)}  # fmt: skip
        raws = *(fault.raw for fault in own.codes[:9:4]), 999
        words = (own.parameter, *own.history)
        held |= slots | dict(zip((word for word in words if word), raws, strict=False))
        held |= {code: at * 7 for at, code in enumerate(code for row in own.stored for code in row)}
        values = ParameterSet(replace(HEAD, profile=name), held, {"X": "no reply"})
        text = report.report_text(profile, values, many if name == "atv71" else [])
        yield text if name != "atv71" else text[:9000] + text[-900:]


def trends() -> Iterator[str]:
    """Curves of the last trip and run, of whole and of reduced rows."""
    trip = replace(ENTRIES[3], device=1, time=datetime.fromtimestamp(BEGIN + 125, UTC).isoformat())
    bad = replace(trip, time="no time")
    for expired in (0, 1000):
        for entries, now in (([], 900.0), ([trip], 900.0), ([bad], 300.0), ([trip], 60.0)):
            with written((list(drive_rows()), DRIVE_EVENTS), expired=expired) as files:
                found = report_trends(files, 1, ATV71, entries, BEGIN + now)
                drawings = trend_files(found, "report")
                for trend in found:
                    marks = [(round(at - BEGIN, 2), text) for at, text in trend.curve.marks]
                    yield f"{trend.kind} {trend.title} {trend.reach} {trend.remark} {marks}"
                    points = [(round(at - BEGIN, 2), *rest) for at, *rest in trend.curve.points]
                    yield f"  {points[::7]} {len(points)}"
                yield f"{ {kind: (name, len(svg)) for kind, (name, svg) in drawings.items()} }"
                yield from report_trend_lines(found, linked(drawings))
                yield f"{report_trends(files, 2, ATV71, entries, BEGIN + now)}"


# Comparison with the profile

IDENTITIES = (
    None, DriveIdentity(1, "Example", "ATV21H075M3X", "1.2", "", "atv21", ("atv21",)),
    DriveIdentity(1, "", "", "", "Pump", None, ()),
    DriveIdentity(1, "Example", "ATV312HU15M3", "", "", "atv312", ("atv312", "atv31")),
)  # fmt: skip


def session_of(profile: Profile, changed: Mapping[str, int]) -> tuple[FakeLine, DriveSession]:
    """A drive with factory settings on a line without a wire, which lacks each 20th word."""
    words: dict[int, int] = {}
    for at, entry in enumerate(profile.parameters):
        raw = factory_raw(profile, entry, {}, frozenset())
        raw = changed.get(entry.code, 3 if raw is None else raw)
        if at % 20 != 7 or entry.code in changed:
            for place in range(word_count(entry)):
                words[entry.address + place] = to_words(entry, raw)[place]
    line = FakeLine({1: words})
    line.devices[1].identity = {0: b"Example", 1: b"EXFAN"}
    return line, DriveSession(line, 1, profile)


def texts_of(findings: list[EvidenceFinding]) -> Iterator[str]:
    for each in findings:
        yield f"  {each.subject} {each.name}: {each.result} {each.seen} {each.statement[:120]}"


def conformances() -> Iterator[str]:
    """All findings about drives: of their identity, frames, addresses and ranges."""
    for name, changed in (
        ("atv21", {}), ("atv312", {"ACC": 0, "HSP": 60000, "LSP": 600}),
        ("powerdrive", {"6.31": 7}), ("atv71", {}),
    ):  # fmt: skip
        profile = load(name)
        for identity in IDENTITIES if name == "atv312" else IDENTITIES[:1]:
            line, session = session_of(profile, changed)
            session.identity = identity
            if identity is not None:
                session = DriveSession(line, 1, profile, identity)
            test = Conformance(session)
            asyncio.run(test.run())
            yield f"{name} {identity and identity.text}: {test.codes_to_ask()}"
            shown = [each for each in test.findings if each.result != "confirmed"]
            others = [each for each in test.findings if each not in shown]
            yield from texts_of([*shown[:40], *others[:20], *others[20::15]])
            yield f"  {len(shown)} {len(others)} {len(line.requests)}"


def frame(text: str) -> ExampleFrame:
    return ExampleFrame("x", "p. 3", "request", text, "")


def frames() -> Iterator[str]:
    """Frames that are repeated or not, and the replies compared in their form."""
    line, session = session_of(load("atv312"), {})
    replies = ("010304 00010002 0000", "010302 0001 0000", "0183 02 0000", "012B0E01010000 03 0000",
               "0108 0000 1234 0000")  # fmt: skip
    requests = ("01030C81 0002 0000", "01030C81 0001 0000", "0103 0001 0001 0000",
                "0101 0C81 0009 0000", "012B0E0100 0000", "0108 0000 1234 0000",
                "0108 0001 1234 0000", "0106 2329 0001 0000", "0104 0C81 0001 0000")  # fmt: skip
    for request in requests:
        for reply in replies:
            pair = FramePair(frame(request), (frame(reply),))
            found = asyncio.run(Conformance(session).send_frame(pair))
            yield f"{request} {reply}: {found.result} {found.seen} {found.statement}"
        both = FramePair(frame(request), tuple(map(frame, replies)))
        yield f"  {asyncio.run(Conformance(session).send_frame(both)).result}"
    line.devices[1].identity = None
    for request, error in ((requests[0], 4), (requests[4], 1), (requests[1], NoAnswer(1, 3, 3201))):
        line.fail_read(1, None, error, times=9)
        pair = FramePair(frame(request), (frame("0183 04 0000"),))
        try:
            found = asyncio.run(Conformance(session).send_frame(pair))
        except LineError as raised:
            yield f"{request}: {raised}"
            continue
        yield f"{request}: {found.result} {found.seen}"
    for name in ("atv21", "atv71", "varmeca"):
        line, session = session_of(load(name), {})
        for pair in example_frames_of(session.profile):
            found = asyncio.run(Conformance(session).send_frame(pair))
            yield f"{name} {found.name}: {found.result} {found.seen}"


def displays() -> Iterator[str]:
    """Answers of a person for values of each kind, some of which change meanwhile."""
    typed = ("3.0", "3", "3.05", "3.1", "2,9 s", "3 Hz", "30", "-3", "0", "", "-", " 3.0 s ", "x",
             "terminals", "1", "50", "NAME")  # fmt: skip
    for name, code, values in (
        ("atv312", "ACC", (30, 30)), ("atv312", "ACC", (30, 35)), ("atv312", "ACC", (30, 32)),
        ("atv312", "LSP", (0, 0)),
        ("atv312", "LSP", (0, 500)), ("atv312", "rFr", (500, 30)), ("atv312", "Ctr", (1, 1)),
        ("atv312", "CHP", (0, 1)), ("atv312", "ACC", (None, None)), ("atv312", "ACC", (None, 30)),
        ("atv71", "ACC", (30, None)), ("atv71", "ULN", (3, 5)), ("atv71", "STT", (1, 2)),
    ):  # fmt: skip
        profile = load(name)
        if profile.get(code) is None:
            continue
        for text in typed:
            line, session = session_of(profile, {code: 0, "Inr": 1, "INR": 1})
            hold, ask = person_at(line.devices[1], profile, code, text, values[1])
            test = Conformance(session)
            test.findings = [
                EvidenceFinding(subject="value", name=code, result="open"),
                EvidenceFinding(subject="address", name=code, result="open"),
                EvidenceFinding(subject="value", name="other", result="open"),
            ]
            hold(values[0])
            try:
                found = asyncio.run(test.compare_display(code, ask))
            except DriveError as error:
                yield f"{name} {code} {values} {text!r}: {error}"
                continue
            left = [(each.subject, each.name) for each in test.findings]
            yield f"{name} {code} {values} {text!r}: {found.result} {found.seen} {left[1:]}"


def person_at(
    drive: FakeDevice, profile: Profile, code: str, text: str, after: int | None
) -> tuple[Callable[[int | None], None], AskDisplay]:
    """A function that sets a value of the drive, and a person who answers while it changes."""
    entry = profile[code]

    def hold(raw: int | None) -> None:
        drive.words.pop(entry.address, None)
        if raw is not None:
            drive.words[entry.address] = raw

    async def ask(_: Parameter) -> str:
        hold(after)
        names = profile.names(entry)
        return names[min(names)] if text == "NAME" and names else text

    return hold, ask


SECTIONS = (pages, reports, trends, conformances, frames, displays)


@pytest.mark.usefixtures("in_utc")
@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_reports_and_comparisons_are_the_recorded_ones(
    section: Callable[[], Iterator[str]],
) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
