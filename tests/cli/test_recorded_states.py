"""States of drives as `status`, `block`, `why` and `counters` print them, in text and as JSON.

`recorded_states.txt` has a section for each subject. The drives are invented, without a wire.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import product
from pathlib import Path

import msgspec
import pytest

from tests.cli.test_recorded_values import printed
from tests.drive.test_whole_values import HELD, OTHER, whole
from tests.recorded import sections
from tests.session.test_recorded_texts import NETWORK, SERIAL, SIGHTS
from tests.ui.fakes import ALARM, CHANNELS, FAULT, StillClock
from tui.bus.api import DeviceCounters, LastMinute
from tui.bus.errors import LineError, NoAnswer
from tui.bus.fake import FakeLine
from tui.bus.transport.port_errors import PortErrors
from tui.bus.transport.ports import PortSeen
from tui.cli.shared.block_output import show_blocks, show_neighbors
from tui.cli.shared.control import control_field, control_row, way_to_take
from tui.cli.shared.diagnosis_documents import counters_document, drive_documents, why_document
from tui.cli.shared.drive_status import (
    Status,
    drive_cells,
    read_until,
    status_document,
    status_of_drive,
    status_table,
)
from tui.cli.shared.left_behind import LeftBehind
from tui.cli.shared.output import drive_fields, json_text
from tui.cli.shared.pending_timeouts import (
    timeout_field,
    timeout_warning,
    watch_field,
    watch_text,
)
from tui.cli.shared.status_words import eeprom_field, eeprom_rows
from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.words import to_words
from tui.session.blocks.mapping import BlockView, Force, Slot
from tui.session.changes import ChangeList
from tui.session.connect.identify import DriveIdentity
from tui.session.connect.open_line import OpenLine
from tui.session.counters.compare import Bounds, Comparison, Difference, DriveCount
from tui.session.counters.watch import CountersNow
from tui.session.diagnosis.diagnosis import diagnosed
from tui.session.diagnosis.evidence import DiagnosticEvidence
from tui.session.diagnosis.measure import Measure
from tui.session.diagnosis.reply_evidence import ReplyEvidence
from tui.session.drive import DriveSession
from tui.session.eeprom_counts import DriveCounts
from tui.session.fleet import Fleet
from tui.session.journal import Journal
from tui.session.read.proof import SlotMatch
from tui.session.reading import Reading
from tui.session.shown import Quality
from tui.session.starts.record import StartRecord
from tui.session.timeout_report import Timeout, TimeoutWatch

TEXTS = Path(__file__).parent / "recorded_states.txt"
WALL = StillClock().wall()
STATES = {
    "running": {**HELD, "TRIP": 0},
    "ready, another commands": {**OTHER, "STAT": 0x0001},
    "alarm": {**OTHER, "STAT": 0x0800},
    "fault with help": {**HELD, "STAT": 0x0408, "TRIP": 1, "FOUT": 499},
    "fault, reset does not work": {**HELD, "STAT": 0x0008, "TRIP": 1, "FOUT": 500},
    "fault without help": {**HELD, "STAT": 0x0408, "TRIP": 7},
    "unknown fault": {**HELD, "STAT": 0x0408, "TRIP": 99},
    "fault state alone": {**OTHER, "STAT": 0x0008, "TRIP": 0},
    "off": {**HELD, "STAT": 0, "TRIP": 0, "TOUT": 0, "CHAN": 0},
}
LACKING: dict[str, tuple[str, ...]] = {
    "its timeout": ("TOUT",), "its state": ("STAT",), "most": ("STAT", "FOUT", "CHST"),
}  # fmt: skip


def registers(raws: Mapping[str, int], profile: Profile) -> dict[int, int]:
    """The words of a drive with these values."""
    found: dict[int, int] = {}
    for code, raw in raws.items():
        parameter = profile[code]
        try:
            words = to_words(parameter, raw, found.get(parameter.address, 0))
        except DriveError:
            continue
        found |= dict(enumerate(words, parameter.address))
    return found


def session_of(raws: Mapping[str, int], profile: Profile | None = None) -> DriveSession:
    family = profile or whole()
    line = FakeLine({7: registers(raws, family)})
    identity = DriveIdentity(7, "Example", "EXFAN-22", "1.2", "", family.id, (family.id,))
    return DriveSession(line, 7, family, identity)


def status_of(session: DriveSession) -> Status:
    return asyncio.run(status_of_drive(session, OpenLine("rtu:x", session.line)))


def described(status: Status) -> Iterator[str]:
    yield from (f"{title}: {text}" for title, text in status_table(status))
    yield f"{drive_cells(status)} {status.status}"
    yield json_text(status_document("pump", status))


def states() -> Iterator[str]:
    for name, raws in STATES.items():
        yield f"-- {name}"
        yield from described(status_of(session_of(raws)))
    for name, codes in LACKING.items():
        yield f"-- {name} cannot be read"
        session = session_of({c: r for c, r in STATES["running"].items() if c not in codes})
        yield from described(status_of(session))
    for family, raws in (
        ("atv71", {**ALARM, **CHANNELS}), ("atv71", {**FAULT, **CHANNELS}), ("atv21", {}),
        ("powerdrive", {}),
    ):  # fmt: skip
        profile = library.load(family)
        yield f"-- {family}"
        known = {parameter.code: 0 for parameter in profile.parameters}
        yield from described(status_of(session_of(known | raws, profile)))


def parts_of_a_status() -> Iterator[str]:
    """Parts that a status may have, each alone."""
    session = session_of(STATES["running"])
    status = status_of(session)
    start = StartRecord(
        "rtu:x", 7, "example-fan", "", "", "", "", "forward", "", 4711, "", "run", True, "12:00"
    )
    counts = DriveCounts("rtu:x", 7, "example-fan")
    for number in range(6):
        counts.of("").add(WALL - 60 * number)
        counts.of("ACCE").add(WALL - 1800 * number)
    still = replace_clock(session)
    values = dict(status.readings)
    old = {code: replace(each, quality=Quality.STALE) for code, each in values.items()}
    for name, changed in {
        "left behind": replace(status, left=LeftBehind(start, True, "It runs.")),
        "written often": replace(status, session=still, eeprom=counts),
        "never written": replace(status, eeprom=DriveCounts("rtu:x", 7, "example-fan")),
        "old values": replace(status, readings=old),
        "no values": replace(status, readings={}, channels=dict.fromkeys(status.channels, "")),
        "switches": replace(status, switches=["One.", "Two."], refused="Not now."),
        "unread": replace(status, unread=["STAT", "TOUT"], watch=None),
        "no watch": replace(status, watch=None),
        "timeout unknown": replace(status, timeout=Timeout(known=False)),
    }.items():  # fmt: skip
        yield f"-- {name}"
        before = set(status_table(status))
        yield from (f"{row}" for row in status_table(changed) if row not in before)
        document = msgspec.to_builtins(status_document("pump", changed))
        plain = msgspec.to_builtins(status_document("pump", status))
        yield from (f"{key}: {item}" for key, item in document.items() if plain.get(key) != item)
    read_only = session_of(STATES["running"])
    read_only.line.read_only = True  # type: ignore[misc]
    yield f"{status_of(read_only).refused}"
    yield f"{eeprom_field(still, None)} {eeprom_rows(still, None)} {eeprom_rows(still, counts)}"


def replace_clock(session: DriveSession) -> DriveSession:
    """The same drive, with a clock that never goes on."""
    return DriveSession(session.line, 7, session.profile, session.identity, StillClock())


def timeouts() -> Iterator[str]:
    """Each reaction of a drive to lost polling, in all texts and fields."""
    rules = whole().data.communication_fault
    assert rules is not None
    session = session_of(STATES["running"])
    other = DriveSession(session.line, 7, library.load("atv71"), session.identity)
    yield f"{watch_text(None)} {watch_field(None)}"
    for reaction, seconds, active, sure, fault in product(
        (None, *rules.reactions), (0.25, 10.0), (False, True), (False, True), ("", "COM")
    ):
        watch = TimeoutWatch(seconds, reaction, active, "TOUT", fault, sure)
        yield f"{reaction and reaction.name} {seconds} {active} {sure} {fault}"
        yield f"  {watch_text(watch)} {watch_field(watch)}"
        yield f"  {timeout_field(Timeout(True, watch))}"
        yield f"  {timeout_warning(session, Timeout(True, watch), 'my line')}"
    for timeout in (Timeout(known=False), Timeout(known=True)):
        yield f"{timeout_field(timeout)} {timeout_warning(other, timeout, 'rtu:x')!r}"


def controls() -> Iterator[str]:
    for family, raws in product(("example-fan", "atv71", "varmeca", "powerdrive"), (0, 1, None)):
        profile = whole() if family == "example-fan" else library.load(family)
        session = session_of({}, profile)
        if raws is not None:
            found = {p.code: Reading(p, raws, None, Quality.GOOD, 1e9) for p in profile.parameters}
            session.image.take(found)
        yield f"{family} {raws}: {control_field(session)} {control_row(session)}"
        yield f"  {way_to_take(session)}"


def late_words() -> Iterator[str]:
    """Words of which some fail, or do not come in time."""
    codes = ["CHAN", "STAT", "TYPE", "FREF"]

    async def found(failing: Iterable[int], late: bool) -> tuple[dict[str, Reading], list[str]]:
        session = session_of(STATES["running"])
        line = session.line
        assert isinstance(line, FakeLine)
        for address in failing:
            line.fail_read(7, address, NoAnswer(7, 3, address))
        fleet = Fleet(line, Journal())
        try:
            now = asyncio.get_running_loop().time()
            return await read_until(fleet.take(session), codes, now + 5 - 6 * late)
        finally:
            fleet.forget()

    places = {code: whole()[code].address for code in codes}
    for failing, late in product(((), ("STAT",), ("CHAN", "TYPE"), codes), (False, True)):
        try:
            values, unread = asyncio.run(found([places[code] for code in failing], late))
            yield f"{failing} {late}: {[(code, r.text) for code, r in values.items()]} {unread}"
        except (LineError, TimeoutError) as error:
            yield f"{failing} {late}: {type(error).__name__} {error}"


def blocks() -> Iterator[str]:
    """Blocks with slots in every state."""
    for family, block in (
        (whole(), "scan"),
        (library.load("atv71"), ""),
        (library.load("atv21"), ""),
    ):
        found = next((each for each in family.data.blocks if each.id == block or not block), None)
        if found is None:
            continue
        session = session_of({}, family)
        first = next(each for each in family.parameters if each.unit and each.access == "r")
        direct = Reading(first, 7, None, Quality.GOOD, 1e9)
        states = list(product(SlotMatch, Force))
        slots = [
            Slot(code, first.address, first, 12, "1.2 Hz", direct if number % 2 else None,
                 *states[number * 5 % len(states)], "XYZ" if number % 3 == 2 else "")
            for number, code in enumerate(found.slots)
        ]  # fmt: skip
        unused = [Slot(code, 0, verdict=SlotMatch.UNUSED) for code in found.slots]
        for shown, trouble in (
            (slots, ""), (unused, "It did not answer."), ([slots[0], *unused[1:]], ""),
            ([unused[0], *slots[1:-1], unused[-1]], ""), ([Slot(found.slots[0], None)], "x"),
            ([Slot(found.slots[0], 9), *unused[1:]], ""),
        ):  # fmt: skip
            for effective in ("at-once", "after-reset"):
                kind = msgspec.structs.replace(found, effective=effective)
                view = BlockView(kind, tuple(shown), trouble)
                yield f"-- {family.id} {effective} {len(shown)}"
                for as_json in (False, True):
                    with printed() as lines:
                        show_blocks(session, "pump", [view, view], as_json=as_json)
                    if not as_json:
                        yield from lines[: len(lines) // 2 + 1]
                    elif effective == "after-reset":
                        yield " ".join(line.strip() for line in lines)[:4000]
    for family in (library.load("atv312"), library.load("powerdrive")):
        for as_json in (False, True):
            with printed() as lines:
                show_neighbors(session_of({}, family), "pump", as_json=as_json)
            yield " ".join(line.strip() for line in lines)


def diagnoses() -> Iterator[str]:
    documents, profile = drive_documents(), library.load("atv71")
    session = session_of({}, profile)
    plain = DiagnosticEvidence(SERIAL, 3, heard=ReplyEvidence(requested=9))
    full = replace(
        plain, profile=profile, turnaround=0.01234, port=PortSeen("/dev/x", latency=16),
        errors=PortErrors(1, 2, 3, 4), link=NETWORK,
        heard=ReplyEvidence(
            requested=9, answered=1, late=2, echoed=3, damaged=4, garbage=5, exceptions=(2, 4),
            functions=(3, 43), others=(8, 9),
        ),
        measure=Measure(
            requested=60, answered=20, lost=1, damaged=2, late=3, duplicated=4, foreign=5,
            unreached=6, behind=7, second=8, seconds=6.1234,
        ),
    )  # fmt: skip
    for evidence in (plain, full, *(replace(plain, **facts) for facts in SIGHTS[:3])):
        found = diagnosed(evidence)
        yield json_text(why_document("pump", 3, None, found))
    yield json_text(why_document("pump", 3, drive_fields("pump", session), diagnosed(full)))
    yield f"{documents.why('pump', 3, None, diagnosed(plain))}"
    yield f"{documents.why('pump', 7, session, diagnosed(full))}"


def counters() -> Iterator[str]:
    session = session_of({})
    since = DeviceCounters(
        11, 9, 2, checksum=1, wrong=3, repeats=4, exceptions={11: 2, 2: 1}, bytes_out=80,
        bytes_in=90, busy_seconds=1.234567, turnarounds=tuple(range(10)),
        minute=LastMinute(7, 1, 2, 3, 4, 5),
    )  # fmt: skip
    first = DriveCount(100, 5, Bounds(50, 50), Bounds(40, 40))
    last = DriveCount(160, 65535, Bounds(110, 110), Bounds(100, 100))
    for found in (
        CountersNow(since, DeviceCounters(), 12.34567, 0.25, 0.125, "panel (pid 7)",
                    (("Line", Comparison(first, last, 60, 7)), ("Own", Comparison(first, first))),
                    "It refused.", (Difference("strays", 2, "2."),), LastMinute(9, 1, 0, 0, 2, 3)),
        CountersNow(DeviceCounters(), since, 0.0, None, None, "", (), ""),
    ):  # fmt: skip
        for reset in (False, True):
            fields = drive_fields("pump", session)
            yield json_text(counters_document(fields, found, 30, 29, reset=reset))
        sent = {"frames": 5, "answered": 4}
        yield f"{drive_documents().counters('pump', session, found, sent)}"
    yield f"{drive_documents().journal('journal.jsonl', ChangeList())}"


SECTIONS = (
    states, parts_of_a_status, timeouts, controls, late_words, blocks, diagnoses, counters,
)  # fmt: skip


@pytest.mark.usefixtures("in_utc")
@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_states_are_printed_as_recorded(section: Callable[[], Iterator[str]]) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
