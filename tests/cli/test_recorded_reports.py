"""Reports of commands while they work: a scan, traffic, stops, writes, troubles, tests of profiles.

`recorded_reports.txt` has a section for each command. The events are invented, no line is opened.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import click
import msgspec
import pytest

from tests.cli.test_recorded_states import session_of
from tests.cli.test_recorded_values import Terminal, printed, terminal
from tests.drive.test_whole_values import whole
from tests.recorded import sections
from tests.session.test_listening import BOTH, BOTH_REPLY, Heard, named
from tests.ui.fakes import readings_of
from tests.wire.test_observed import COMMAND, READ, REFUSED, WORDS
from tui.bus.api import LineCounters
from tui.bus.errors import LineLost, NoAnswer
from tui.bus.fake import FakeLine
from tui.bus.link import Link, RtuTcpLink, SerialLink, TcpLink
from tui.cli.documents.drive_documents import ScanEndDocument
from tui.cli.main import main
from tui.cli.running import confirming
from tui.cli.running.profile_proof import untested
from tui.cli.running.scan_telling import Hit, Progress, ScanTelling
from tui.cli.running.stop_telling import StopTelling
from tui.cli.shared.drives import failed, failed_line
from tui.cli.shared.errors import DIFFERENT, LINE_TROUBLE
from tui.cli.shared.holding import Holding
from tui.cli.shared.listen_outputs import ListenJsonOutput, ListenNoOutput, ListenTextOutput
from tui.cli.shared.options import Target
from tui.cli.shared.output import json_text
from tui.cli.shared.profile_choice import believe_the_person, unidentified
from tui.cli.shared.say import Messages, say
from tui.cli.shared.sets import (
    ResultTelling,
    complain_absent,
    need_way_to_save,
    result_fields,
    say_afterwards,
    status_of_results,
)
from tui.cli.shared.silence import about_silence, silence_hint
from tui.drive.finding import LineSetting, WatchingFamily
from tui.drive.first_stop import FirstWord
from tui.drive.profile import library
from tui.drive.profile.schema import EvidenceDrive, EvidenceFinding, ProfileEvidence
from tui.drive.profile.stop_profile import stop_profile
from tui.drive.settings.edits import Edit
from tui.session.command.first_stop import SentFirst
from tui.session.connect.contradiction import Contradiction
from tui.session.connect.identify import DriveIdentity, ScanResult
from tui.session.connect.open_line import OpenLine
from tui.session.drive import DriveSession
from tui.session.drive_state import drive_state
from tui.session.monitor.look import Look
from tui.session.settings.applied import EditOutcome, Result
from tui.session.timeout_report import Timeout
from tui.simulator.proving.proof_bench import ProofStep

TEXTS = Path(__file__).parent / "recorded_reports.txt"
SETTING = LineSetting(19200, "8E1")
KNOWN = DriveIdentity(3, "Maker", "ATV71HU15M3", "0201", "Pump", "atv71", ("atv71",))
IDENTITIES = (
    KNOWN,
    replace(KNOWN, reference="", version="", name="", profile="atv312"),
    DriveIdentity(4, "", "", "", "", None, ("atv31", "atv312", "powerdrive")),
    DriveIdentity(5, "Other\x1b", "X9", "1", "", None, ()),
    DriveIdentity(6, "", "", "", "", None, ()),
)


def scans() -> Iterator[str]:
    """Everything that a scan reports, on a terminal and as JSON."""
    for as_json, on_terminal in product((False, True), repeat=2):
        err = Terminal() if on_terminal else None
        with terminal(), printed(err=err) as lines:
            telling = ScanTelling("pump", as_json=as_json)
            telling.families([])
            telling.families(
                [WatchingFamily("a", "A", "TTO", True), WatchingFamily("b", "B", "TT", False)]
            )
            telling.progress(Progress(SETTING, 12, 31, 2, 3.6, settings_left=1))
            telling.progress(Progress(SETTING, 13, 31, 2, 0.2))
            for identity, setting in product(IDENTITIES, (None, SETTING)):
                telling.hit(Hit(setting, identity, "" if setting else "function 43"))
            telling.progress(Progress(None, 13, 31, 2, 0.2))
            telling.slow([SETTING, LineSetting(300, "8N2")], 12.345, "These take long.")
            telling.progress(Progress(None, 13, 31, 2, 70.5, 2))
            for by, setting in product(("", "left alone"), (None, SETTING)):
                telling.unclear(setting, ScanResult(9, None, "Damaged.", by))
            telling.progress(Progress(None, 31, 31, 2, 0.0))
            telling.ended(
                lambda line: ScanEndDocument(
                    command="scan", line=line, done=True, found=1, addresses="1-9", settings=[],
                    not_tried=0, held_back=None, remarks=[], text="Ended.",
                )
            )  # fmt: skip
        yield f"-- {as_json} {on_terminal}"
        yield from map(repr, lines)


def heard() -> Iterator[str]:
    """Traffic of another master, decoded in three ways."""
    for families, times in ((named("atv31", "atv71"), True), (None, False)):
        made = Heard(families, times=times)
        for readings in ((READ, WORDS), (READ, REFUSED), (COMMAND, COMMAND), (BOTH, BOTH_REPLY)):
            made.say(*readings)
            made.say(*readings, every=0.1)
        made.say(READ, WORDS, WORDS, b"\x07\x07", READ).rest()
        for output in (
            ListenTextOutput(made.families), ListenJsonOutput("pump", made.families),
            ListenNoOutput(),
        ):  # fmt: skip
            with printed() as lines:
                for exchange in made.reported:
                    output.exchange(exchange, 1_767_362_400.25)
                output.summary(made.summary, 1_767_362_460.5)
            yield f"-- {type(output).__name__} {times}"
            yield from lines


def stops() -> Iterator[str]:
    families = stop_profile()[:2]
    for as_json in (False, True):
        session = session_of({})
        session.timeout = Timeout(known=False)
        with printed() as lines:
            telling = StopTelling("pump", as_json=as_json)
            word = FirstWord(8501, 6, (6,), "CMD", "stop", families)
            telling.sent_first(7, [SentFirst(word, "ok"), SentFirst(word, "no answer")], "it is X")
            telling.sent_first(8, [], "it names nothing")
            telling.stopped(session, "Device 7: stopped", may_coast=False)
            telling.stopped(session, "Device 7: may still coast", may_coast=True)
            telling.gave_back("Device 7: given back")
            telling.failed(8, None, "Device 8: NOT STOPPED", 4)
            telling.failed(9, "atv71", "Device 9: NOT STOPPED", 3)
            telling.silent([1, 2, 3, 5], 0)
            telling.silent([4, 6], 3)
        yield from lines
        yield from map(json_text, telling.documents)


def writes() -> Iterator[str]:
    """Results of settings, one after the other, and what follows from them."""
    edits = [Edit(f"P{at}", "3 s" if at % 2 else "", 10 if at % 3 else None, 30, "3.0 s",
                  "1.0 s" if at % 3 else "", rounded=at % 2 == 0) for at in range(10)]  # fmt: skip
    alike = (
        EditOutcome.DONE, EditOutcome.REFUSED, EditOutcome.REFUSED, EditOutcome.REFUSED,
        EditOutcome.SENT, EditOutcome.UNKNOWN, EditOutcome.NOT_SENT, EditOutcome.NOT_SENT,
    )  # fmt: skip
    results = [
        Result(edit, outcome, f"{edit.code} {outcome}", held=at)
        for at, (edit, outcome) in enumerate(zip(edits, alike, strict=False))
    ]
    for as_json, upto in product((False, True), (0, 1, 4, len(results))):
        messages = Messages(as_json=as_json)
        telling = ResultTelling(messages)
        with printed() as lines:
            for at, result in enumerate(results[:upto]):
                telling(at + 1, len(results), result)
        yield f"-- {as_json} {upto}"
        yield from lines
        yield f"{telling.interrupted().format_message()} {telling.interrupted().exit_code}"
        yield f"{messages.texts}"
    yield from map(json_text, result_fields(results))
    for first, second in product((None, *EditOutcome), repeat=2):
        found = [Result(edits[0], each, "") for each in (first, second) if each is not None]
        yield f"{first} {second}: {status_of_results(found)}"
    for voided, beyond in product((False, True), repeat=2):
        result = Result(edits[0], EditOutcome.NOT_SENT, "", voided=voided, is_beyond_limit=beyond)
        yield f"{voided} {beyond}: {status_of_results([result])}"
    absent = {"A": "Exception 2, register 7", "B": "Exception 2, register 8", "C": "No reply"}
    for codes in ("", "ABC", "A"):
        with printed() as lines:
            complain_absent(Messages(as_json=False), {code: absent[code] for code in codes})
        yield from lines


def saves() -> Iterator[str]:
    """Settings that are lost at power-off, for families with each way to save."""
    for family in ("atv71", "atv21", "powerdrive", "example-fan", "v20"):
        profile = whole() if family == "example-fan" else library.load(family)
        settings = [each.code for each in profile.parameters if each.access == "rw"][:3]
        for codes, save in product(([], settings), (False, True)):
            with printed() as lines:
                try:
                    need_way_to_save(profile, codes, save=save)
                except click.UsageError as error:
                    yield f"{family} {codes}: {error.format_message()}"
                say_afterwards(Messages(as_json=False), profile, codes[:2], codes, saved=save)
            yield f"{family} {codes} {save}"
            yield from lines


def silences() -> Iterator[str]:
    """Advice for each kind of line without an answer."""
    serial = SerialLink("/dev/ttyS9", 19200, "8E1")
    links: tuple[tuple[Link, str], ...] = (
        (serial, "serial:/dev/ttyS9,19200,8E1"), (serial, "/dev/ttyS9"),
        (serial, "/dev/ttyS9,19200"),
        (replace(serial, format="8N1"), "/dev/ttyS9"), (TcpLink("h"), "tcp:h"),
        (RtuTcpLink("h", 502), "rtu-tcp:h:502"),
    )  # fmt: skip
    for (link, text), by_profile, stale in product(links, (False, True), (0, 1)):
        line = FakeLine({}, link=link)
        line.counters = LineCounters(stale=stale)
        opened = OpenLine(text, line)
        yield f"{text} {by_profile} {stale}"
        yield f"  {about_silence(opened, text, 3, by_profile=by_profile)}"
        for error in (NoAnswer(3, 3, 8501), LineLost("gone")):
            yield f"  {silence_hint(error, opened, text, by_profile=by_profile)!r}"
    late = FakeLine({}, link=serial)
    state = replace(late.device_state(3), lateness=1.0)
    late.device_state = lambda device: state  # type: ignore[method-assign]
    yield about_silence(OpenLine("x", late), "x", 3, by_profile=False)
    simulated = OpenLine("x", FakeLine({}, link=serial), cast(Any, object()))
    yield repr(about_silence(simulated, "x", 3, by_profile=False))


def failures() -> Iterator[str]:
    target = Target("serial:/dev/x", 7, None)
    for text, line_name in product(("Device 7 did not answer.", "It is off."), ("", "pump")):
        with printed() as lines:
            document = failed(target, text, LINE_TROUBLE, line_name)
        yield from (*lines, json_text(document))
    with printed() as lines:
        document = failed_line("serial:/dev/x", "pump", "It is gone.", DIFFERENT)
    yield from (*lines, json_text(document))
    for count in (1, 2, 3):
        targets = Target("x", 1, "p", 2.0, True, tuple(range(2, 1 + count)), True).each()
        yield f"{targets}"


def holdings() -> Iterator[str]:
    """Drives that are lost, answer again, and fall into faults, one look after the other."""

    def state(raws: dict[str, int]) -> Look:
        return Look(drive_state(whole(), readings_of(whole(), raws, 0.0)), "", 0.0, None)

    lost, rests = Look(None, "No answer.", 0.0, None), state({"STAT": 1, "TRIP": 0})
    fault, other = state({"STAT": 8, "TRIP": 1}), state({"STAT": 8, "TRIP": 7})
    looks: dict[int, Look] = {}
    reports: list[str] = []
    fleet: Any = SimpleNamespace(line_watch=SimpleNamespace(looks=looks))
    holding = Holding(fleet, lambda event, device, text: reports.append(f"{event} {device} {text}"))
    for number, look in enumerate(
        (rests, lost, lost, rests, fault, fault, other, lost, other, rests, fault, lost, rests)
    ):
        looks.update({7: look, 8: rests if number % 2 else fault})
        holding.look()
        yield f"{reports}"
        reports.clear()


def long_lines() -> Iterator[str]:
    """Lines on a terminal, broken at words, and unbroken in a file and to copy."""
    texts = (
        "short", "one two three four five six seven eight nine ten eleven twelve thirteen fourteen",
        "a" * 70, "漢字" * 20 + " and more", "  indented " + "word " * 15, "two\nlines\x1b[31m",
        "x" * 30 + " " * 40 + "y", "aaaa " * 12 + "b" * 61, "a" * 60, "a" * 61,
    )  # fmt: skip
    for text, indent in product(texts, (0, 4, 30)):
        with terminal(), printed(Terminal(), Terminal()) as lines:
            say(text, indent=indent)
            say(text, to_copy=True)
            say(text, err=True)
        yield f"-- {indent}"
        yield from lines
    with printed() as lines:
        say("word " * 30)
    yield from lines


def choices() -> Iterator[str]:
    """Drives without a profile, and drives that contradict theirs."""
    for identity in IDENTITIES:
        yield unidentified(identity).format_message()
    for forced, by_recipe, given, reported in product((False, True), repeat=4):
        session = DriveSession(FakeLine({7: {}}), 7, library.load("atv71"))
        session.identity = replace(KNOWN, profile="atv312" if reported else None)
        session.contradiction = "It is another one."
        with click.Context(main) as context, printed() as lines:
            context.params["force_profile"] = given
            try:
                believe_the_person(session, forced=forced, by_recipe=by_recipe)
            except Contradiction as error:
                yield f"{error}"
        yield f"{forced} {by_recipe} {given} {reported}: {lines} {session.arming.barred!r}"


def evidence() -> Iterator[str]:
    """Evidence about a profile, as a person sees it."""

    def finding(subject: str, name: str, result: str) -> EvidenceFinding:
        row = {"subject": subject, "name": name, "statement": "Read it.", "result": result,
               "seen": f"{name} seen"}  # fmt: skip
        return msgspec.convert(row, EvidenceFinding)

    subjects = ("address", "range", "value", "frame", "command", "reference", "identity")
    rows = [
        finding(*row) for row in product(subjects, ("N",), ("confirmed", "contradicted", "open"))
    ]
    many = [finding("value", f"V{number}", "confirmed") for number in range(23)]
    right = [row for row in rows if row.result != "contradicted"]
    for kind, found in (
        ("drive", rows), ("drive", right), ("drive", many[:1]), ("simulated", many),
        ("unknown", right), ("drive", [row for row in right if row.subject != "value"]),
        ("drive", []), ("drive", many[:21]), ("drive", many[:20]),
        ("drive", [row for row in right if row.subject == "command"]),
    ):  # fmt: skip
        tested = EvidenceDrive(vendor="V", reference="R", firmware="1", kind=kind, link="RTU")  # type: ignore[arg-type]
        made = ProfileEvidence(profile="p", date="d", program="1", tested=tested, findings=found)
        for err in (False, True):
            with printed() as lines:
                confirming._say_findings(made, err=err)
                confirming._say_result(made, Path("x.json"), err=err)
            yield f"-- {kind} {len(found)}"
            yield from lines if not err else (text[:9] for text in lines[:1])
        yield json_text(confirming._document(made, Path("x.json")))
    for link in (SerialLink("/dev/x", 9600, "8N1"), RtuTcpLink("h", 1), TcpLink("h")):
        line = FakeLine({7: {}}, link=link)
        yield confirming._link_text(DriveSession(line, 7, whole()))
    for simulation in (None, cast(Any, object())):
        yield asyncio.run(confirming.drive_kind(OpenLine("x", line, simulation)))


def proofs() -> Iterator[str]:
    """Subjects of a profile that no step tested."""
    steps = [ProofStep((part, 0), title) for part, title in (
        ("charts", "forward"), ("references", "all agree"), ("communication_fault", "it trips"),
        ("memory", "settings are saved"), ("frames", "read"),
    )]  # fmt: skip
    for family in ("example-fan", "atv71", "powerdrive"):
        profile = whole() if family == "example-fan" else library.load(family)
        for at in range(len(steps) + 1):
            yield f"{family} {at}: {untested(profile, [*steps[:at], *steps[at + 1 :]])}"
        yield f"{family}: {untested(profile, ())}"


SECTIONS = (
    scans, heard, stops, writes, saves, silences, failures, holdings, long_lines, choices, evidence,
    proofs,
)  # fmt: skip


@pytest.mark.usefixtures("in_utc")
@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_reports_are_printed_as_recorded(section: Callable[[], Iterator[str]]) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
