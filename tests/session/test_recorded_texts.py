"""Sentences about the past, the counters and the faults of a line, recorded for many cases.

`recorded_texts.txt` has a section for each subject. Each entry names the case and has its text.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from itertools import combinations, islice, product
from pathlib import Path
from typing import Any

import msgspec
import pytest

from tests.drive.test_whole_files import HEAD, OWN_SET
from tests.drive.test_whole_values import whole
from tests.recorded import filled, sections
from tui.bus.errors import OWNER_SILENT, LineLost, NotShared, PortBusy, PortMissing, PortRefused
from tui.bus.link import SerialLink, TcpLink
from tui.bus.transport.port_errors import PortErrors
from tui.bus.transport.ports import PortSeen
from tui.cli.shared.diagnosis_documents import changes_document
from tui.drive.errors import ProfileError
from tui.drive.profile import library
from tui.session import changes
from tui.session.bundle.redaction import Names, Redaction, is_address
from tui.session.counters import compare
from tui.session.diagnosis.diagnosis import diagnosed
from tui.session.diagnosis.evidence import AdapterSeen, DiagnosticEvidence
from tui.session.diagnosis.gateway_probe import Works
from tui.session.diagnosis.measure import Measure
from tui.session.diagnosis.reply_evidence import ReplyEvidence
from tui.session.journal import Entry
from tui.session.journal_reading import completed, selected
from tui.session.record.runs import RecordedRun
from tui.session.record.silences import LostLink
from tui.session.report import report_text
from tui.session.startup.guide import find_guide, guide_folders, read_guide
from tui.session.startup.judging import (
    AS_REQUIRED,
    NOT_AS_SET,
    TICKED,
    StepFacts,
    _hindrances,
    changed_codes,
    field_fault,
    setting_raws,
    step_rows,
)
from tui.session.startup.progress import StepRecord

TEXTS = Path(__file__).parent / "recorded_texts.txt"
NOON = datetime(2026, 1, 2, 12, 0, tzinfo=UTC).timestamp()
WRITE = Entry(
    "2026-01-02T11:00:00.000+00:00", "rtu:x", 7, "example-fan", "ACCE", 211, 30, "3.0 s", 45,
    "4.5 s", "ok", 45, "edit",
)  # fmt: skip
ENTRIES = [
    WRITE,
    replace(WRITE, time="2026-01-02T11:00:01.000+00:00", old="", old_raw=None, answer="no reply",
            read_back=None),
    replace(WRITE, time="2026-01-02T11:00:02.000+00:00", kind="read-back", answer="ok",
            of="2026-01-02T11:00:01.000+00:00", read_back=45),
    replace(WRITE, time="2026-01-02T11:01:00.000+00:00", kind="fault", code="OC", new="Overcurrent",
            answer="tripped", why="the trip was seen"),
    replace(WRITE, time="2026-01-02T11:02:00.000+00:00", kind="fault", code="OC", new="Overcurrent",
            answer="seen", why="in fault when first seen"),
    replace(WRITE, time="2026-01-02T11:03:00.000+00:00", kind="fault", code="OC", new="Overcurrent",
            answer="reset", why="the end was seen"),
    replace(WRITE, time="2026-01-02T11:04:00.000+00:00", kind="fault", code="", new="Line | lost",
            answer="tripped", why="the trip was seen"),
    replace(WRITE, time="2026-01-02T11:05:00.000+00:00", kind="proof", new="10 s, Stop",
            answer="tripped after 10.1 s", why="test of the timeout"),
    replace(WRITE, time="2026-01-02T11:06:00.000+00:00", kind="reset", code="8/10", new="0",
            why="counters"),
    replace(WRITE, time="2026-01-02T11:07:00.000+00:00", device=8, code="CTRL", old="", new="15",
            why="run forward"),
    replace(WRITE, time="2026-01-02T11:08:00.000+00:00", line="tcp:host", eeprom="save"),
    replace(WRITE, time="no time"),
]  # fmt: skip
SERIAL, NETWORK = SerialLink("/dev/ttyUSB0"), TcpLink("10.0.0.9")


def counting(evidence: Any, name: str, count: int) -> Any:
    """The evidence with one count changed."""
    return replace(evidence, **{name: count})


SIGHTS: tuple[dict[str, Any], ...] = (
    {"trouble": PortMissing("gone")}, {"trouble": PortBusy("busy")},
    {"trouble": NotShared("other")},
    {"trouble": PortRefused("x", "refused")}, {"trouble": LineLost("lost")},
    {"withheld": "A stop works."},
    {"port": PortSeen("/dev/ttyUSB0", there=False)}, {"port": PortSeen("/dev/ttyUSB0", latency=16)},
    {"port": PortSeen("/dev/ttyUSB0", permitted=False, group="dialout", user="ann")},
    {"port": PortSeen("/dev/ttyUSB0", permitted=False, group="dialout", user="ann", in_group=True)},
    {"port": PortSeen("/dev/ttyUSB0", holder="mbpoll (4711)")}, {"adapter": AdapterSeen("by-id/x")},
    {"port": PortSeen("/dev/ttyUSB0", others="minicom (12)")},
    {"adapter": AdapterSeen("by-id/x", "/dev/ttyUSB1")}, {"changed": "The drive is another one."},
    *({"heard": counting(ReplyEvidence(requested=9), name, count)}
      for name in ("answered", "late", "echoed", "misshapen", "damaged", "garbage")
      for count in (1, 4, 9)),
    {"heard": ReplyEvidence(requested=9, answered=8, late=1)},
    {"heard": ReplyEvidence(requested=5, garbage=40, compared=(40, 10))},
    {"heard": ReplyEvidence(requested=5, garbage=10, compared=(5, 20))},
    *({"heard": ReplyEvidence(requested=3, exceptions=codes)}
      for codes in ((1,), (2, 2), (3,), (4,), (5,), (6,), (10,), (11, 11, 11))),
    {"heard": ReplyEvidence(requested=3, functions=(4,))},
    {"heard": ReplyEvidence(requested=3, others=(9, 11))}, {"heard": ReplyEvidence(requested=0)},
    {"errors": PortErrors(3, 0, 0, 0)}, {"errors": PortErrors(0, 4, 0, 0)},
    {"errors": PortErrors(0, 0, 5, 0)}, {"errors": PortErrors(0, 0, 0, 6)},
    {"turnaround": 0.004}, {"turnaround": 0.9}, {"overheard": "PLC polls 3. It writes 8501."},
    *({"measure": counting(Measure(requested=60, answered=40, seconds=6.0), name, count)}
      for name in ("lost", "damaged", "late", "duplicated", "foreign", "unreached", "behind",
                   "second", "turns", "swapped", "straight") for count in (1, 3, 20)),
    {"measure": Measure(requested=60, answered=60, seconds=2.0)},
    {"works": Works("tcp:10.0.0.9")}, {"works": Works("rtu:10.0.0.9:502", 255)}, {"behind": True},
    {"idle_closed": True, "idle": 30.0}, {"neighbors": (3,)}, {"neighbors": (3, 4, 5)},
)  # fmt: skip


def named(facts: Mapping[str, object]) -> str:
    """The facts in short; errors have only their names."""
    return ", ".join(
        f"{name} {type(fact).__name__ if isinstance(fact, Exception) else fact}"
        for name, fact in facts.items()
    )


def past() -> Iterator[str]:
    for entry in ENTRIES:
        yield changes.entry_text(entry)
    for within, direction, reference, who in product(
        ((0.5, 0.5), (None, 9.0), (9.0, None), (None, None)), ("", "forward"), ("", "30.0 Hz"),
        ("", "panel (12)"),
    ):  # fmt: skip
        run = RecordedRun(7, "p", NOON, NOON + 65, *within, direction, reference, "", "", who)
        longer = run._replace(ended=NOON + 90000, least="10 Hz", most="30 Hz")
        yield changes.run_text(run)
        yield changes.change_text(changes.LineRun("rtu:x", longer))
    losses = [
        LostLink(device, NOON, ended, reason)
        for device, ended, reason in product(
            (None, 7), (None, NOON + 9.6), ("", "no reply", "gone")
        )
    ]
    for loss in losses:
        yield changes.change_text(changes.LineLoss("rtu:x", loss))
    found = changes.ChangeList(ENTRIES, [changes.LineRun("a", run)])
    found.losses += [changes.LineLoss("a", loss) for loss in losses[:2]]
    yield f"{[changes.change_text(change) for change in found.in_order]}"
    document = changes_document("journal.jsonl", found)
    for key in ("entries", "damaged", "trips", "runs", "lost", "unread"):
        yield f"{key}: {msgspec.to_builtins(getattr(document, key))}"
    now = datetime.fromtimestamp(NOON).astimezone()
    for text in ("10s", "5 m", "5m", "2h", "3d", "1w", "8:00", "13:30", "08:00:01", "24:00",
                 "2026-01-01", "2026-01-01 10:00", "x", "", "99999999999d"):  # fmt: skip
        yield f"{text!r}: {changes.parse_since(text, now)}"
    yield f"{[(e.time[14:19], e.answer, e.read_back) for e in completed(ENTRIES)]}"
    for choice in ({"device": 8}, {"lines": ["tcp:host"]}, {"since": now}, {}):
        picked = selected(ENTRIES, **choice)
        yield f"{list(choice)}: {[e.time[11:19] for e in picked]}"


def report() -> Iterator[str]:
    profile = whole()
    yield report_text(profile, OWN_SET, ENTRIES, ["trend"], ["start"])
    bare = replace(OWN_SET, raws={}, absent={}, head=replace(HEAD, identity={}, time="x"))
    yield report_text(profile, bare, [])


def counters() -> Iterator[str]:
    for before, after, low, high in product(
        (0, 65530, 400), (3, 500, 65535), (0, 4, 70000), (5, 70001)
    ):
        bounds = compare.Bounds(low, max(low, high))
        yield f"{before} {after} {bounds}: {compare.frames_since(before, after, bounds)}"
    first = compare.DriveCount(100, 5, compare.Bounds(50, 51), compare.Bounds(40, 42))
    for frames, damaged, sent, answered in product((101, 110, 112, 160, 90), (5, 6, 9, 65535, 1),
                                                   (60, 61, 20), (41, 50)):  # fmt: skip
        now = compare.DriveCount(
            frames, damaged, compare.Bounds(sent, sent + 1), compare.Bounds(answered, answered + 1)
        )
        found = compare.Comparison(first, first).with_look(now)
        kinds = [f"{each.kind} {each.count}" for each in compare.differences(found)]
        yield f"{frames} {damaged} {sent} {answered}: {found.frames} {found.damaged} {kinds}"
        yield f"  {found.counts_this_line} {now.saturated}"
    for count in (1, 2):
        now = compare.DriveCount(
            100 + count, 5 + count, compare.Bounds(51 + 2 * count, 51 + 2 * count),
            compare.Bounds(40, 42),
        )  # fmt: skip
        for each in compare.differences(compare.Comparison(first, first).with_look(now)):
            yield each.text


def diagnoses() -> Iterator[str]:
    plain = DiagnosticEvidence(SERIAL, 3, heard=ReplyEvidence(requested=9))
    profile = library.load("atv71")
    for facts in ({}, *SIGHTS):
        for link, known in ((SERIAL, None), (SERIAL, profile), (NETWORK, None)):
            found = diagnosed(replace(plain, link=link, profile=known, **facts))
            yield f"{named(facts)} {type(link).__name__} {known is not None}"
            yield f"  {found.rung}: {found.text} {found.certainty} {found.others}"
            yield from (f"  > {step}" for step in found.steps)
    for first, second in islice(combinations(SIGHTS, 2), 0, None, 11):
        if not first.keys() & second.keys():
            yield diagnosed(replace(plain, **first, **second)).rung


BUSY = PortSeen("/dev/ttyUSB0", holder="mbpoll (4711)", latency=16)
ANSWERED = ReplyEvidence(requested=3, answered=2)
MORE_SIGHTS: tuple[dict[str, Any], ...] = (
    {"trouble": PortBusy("busy", "panel (7)")}, {"trouble": PortBusy("busy"), "port": BUSY},
    {"trouble": LineLost("lost"), "port": BUSY}, {"trouble": LineLost(f"panel {OWNER_SILENT}.")},
    {"trouble": PortMissing("gone", ["/dev/ttyS0"])}, {"heard": ANSWERED, "idle": 3.0},
    {"heard": ANSWERED, "turnaround": 0.004, "changed": "Another adapter. Look at it."},
    *({"heard": ANSWERED, "turnaround": late, "port": BUSY._replace(latency=latency)}
      for late, latency in ((0.012, 16), (0.0119, 16), (0.1, 8), (0.1, 7))),
    *({"measure": replace(Measure(requested=30, answered=20, seconds=6.0, late=3), **counts)}
      for counts in ({"behind": 3}, {"behind": 4}, {"behind": 10}, {"behind": 12}, {"late": 2},
                     {"swapped": 3}, {"swapped": 2}, {"swapped": 4, "straight": 1}, {"second": 2},
                     {"turns": 2, "damaged": 2}, {"turns": 1, "damaged": 2}, {"damaged": 5})),
    *({"heard": ReplyEvidence(requested=4, garbage=count, compared=(came, due)), "errors": errors}
      for count, came, due in ((9, 9, 9), (9, 9, 7), (9, 13, 10), (9, 5, 0), (9, 0, 9))
      for errors in (PortErrors(0, 0, 0, 0), PortErrors(2, 1, 1, 0))),
    {"heard": replace(ANSWERED, damaged=2), "errors": PortErrors(1, 2, 3, 4)},
    {"heard": ReplyEvidence(requested=3, exceptions=(10, 2), functions=(4, 6))},
)  # fmt: skip


def advice() -> Iterator[str]:
    """Verdicts of more evidence, then what the manuals of families say to silence and garbage."""
    families = [library.load(name) for name in ("atv312", "atv21", "powerdrive", "varmeca")]
    plain = DiagnosticEvidence(SERIAL, 3, heard=ReplyEvidence(requested=9))
    for facts in MORE_SIGHTS:
        at_port = facts.keys() & {"port", "trouble", "errors"}
        for link, known in ((SERIAL, None), (SERIAL if at_port else NETWORK, families[0])):
            found = diagnosed(replace(plain, link=link, profile=known, **facts))
            shown = (f"{name}: {filled(fact)}" for name, fact in facts.items())
            yield f"{'; '.join(shown)} on {link}, {known is not None} {found.well}"
            yield f"  {found.rung}: {found.text} {found.certainty} {found.others}"
            yield from (f"  > {step}" for step in found.steps)
    garbled = ReplyEvidence(requested=5, garbage=40, compared=(40, 40))
    for profile in (whole(), *families):
        own_link = profile.data.link
        own = SerialLink(SERIAL.path, own_link.baud, own_link.format)
        for device, link in (
            (1, own), (3, SERIAL), (10, NETWORK), (50, SerialLink(SERIAL.path, 1200, "8O2")),
            (247, SerialLink(SERIAL.path, own_link.baud, "8O2")), (0, own),
        ):  # fmt: skip
            for heard in (ReplyEvidence(requested=9), garbled):
                found = diagnosed(DiagnosticEvidence(link, device, profile, heard=heard))
                yield f"{profile.id} {device} {link}: {found.rung}, {found.text}"
                yield from (f"  > {step}" for step in found.steps)


HOMES = "/".join(("", "home"))
"""Folders of people, invented; no file of the project may name one of this machine."""


def redactions() -> Iterator[str]:
    own = Redaction(Names(frozenset({"ann", "root"}), frozenset({"pump-pc", "localhost"}),
                          frozenset({f"{HOMES}/ann"}), frozenset({"s3cret99"})))  # fmt: skip
    texts = (
        "mqtt://bob:hunter22@broker.example:1883/x", "password = 'abcd1234'", "--token=zyxw9876",
        "Authorization: Bearer aaaabbbbcccc", "user: carl on host=hall-2", "tcp:gw.example.org:502",
        f"{HOMES}/dora/.config/x", f"{HOMES}/ann/file of ann", "s3cret99 and pump-pc and root",
        "10.0.0.9 1.2.3 ::1", "pw abcd1234 hunter22", "broker.example gw hall-2 carl bob annual",
    )  # fmt: skip
    for text in texts:
        own.learn(text)
    for text in texts:
        yield f"{own.clean(text)}"
    yield f"{own.clean({'ann': ['ann', 3, None, True], 'password': 'short'})}"
    yield f"{sorted(own.counts.items())}"
    yield f"{[is_address(text) for text in ('10.0.0.9', '::1', '1.2', 'host', '')]}"


def start_ups() -> Iterator[str]:
    """Each step of a guide: its rows, and what prevents its end in several states."""
    profile = library.load("atv71")
    none = StepFacts(profile, {}, (), (), (), False, "")
    for step in find_guide(profile).steps:
        rows = step_rows(step, StepRecord(state="deficient"))
        yield f"{step.step}: {[(row.kind, row.key, row.required) for row in rows]}"
        codes = [row.key for row in rows if row.kind in ("plate", "parameter")]
        expected = {code: next(iter(step.expect.get(code, (40,)))) for code in codes}
        known = none._replace(raws=expected, at_rest=True, identity="ATV71HU15M3, 0201")
        found: dict[str, None] = {}
        for facts, text in product(
            (
                none, known, known._replace(raws=dict.fromkeys(codes, 7)),
                known._replace(staged=codes, unsaved=("ACC",)), none._replace(absent=codes),
            ),
            ("", "4", "0,5", "x", "ATV71HU15M3Z", "ATV71H", NOT_AS_SET, TICKED, AS_REQUIRED),
        ):  # fmt: skip
            record = StepRecord(entries={row.key: text for row in rows} if text else {})
            found[f"  {text}: {list(_hindrances(step, record, facts))}"] = None
        yield from found
        fields = [row.field for row in rows if row.field is not None]
        yield f"  {[field_fault(field, text) for field in fields for text in ('', 'x', '3')]}"
        changed = StepRecord(state="done", raws=dict.fromkeys(codes, 7))
        yield f"  {changed_codes(step, changed, expected)} {setting_raws(step, known)}"


def guide_faults() -> Iterator[str]:
    """The faults of a guide for another family, and of one with one line changed."""
    text = (guide_folders()[1] / "atv71.toml").read_text("utf-8")
    for family in ("atv21", "atv312", "powerdrive"):
        yield fault_of(text.replace('profile = "atv71"', f'profile = "{family}"', 1), family)
    lines = text.splitlines()
    seen: set[tuple[str, str]] = set()
    for place, line in enumerate(lines):
        key, is_set, value = line.partition(" = ")
        if is_set and not line.startswith(("#", " ")) and (key, value[0]) not in seen:
            seen.add((key, value[0]))
            for new in ("", f"{key} = 0", f'{key} = "x"', f'{key} = ["x"]', f"{key} = [5.0, 6.0]"):
                changed = "\n".join((*lines[:place], new, *lines[place + 1 :]))
                yield f"{line} -> {new}: {fault_of(changed, 'atv71')}"


def fault_of(text: str, family: str) -> str:
    """The error of a guide with this text, or the names of its steps."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "guide.toml")
        path.write_text(text, "utf-8")
        try:
            guide = read_guide(path, library.load(family))
        except ProfileError as error:
            return str(error).replace(folder, "FOLDER")
    return f"{[step.step for step in guide.steps]}"


SECTIONS = (past, report, counters, diagnoses, advice, redactions, start_ups, guide_faults)


@pytest.mark.usefixtures("in_utc")
@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_texts_about_the_past_and_faults_of_a_line_are_the_recorded_ones(
    section: Callable[[], Iterator[str]],
) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
