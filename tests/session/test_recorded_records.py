"""Files of a record as text: their rows, and what histories, replays and ghosts make of them.

`recorded_records.txt` has a section for each subject. The drives are invented, with bad replies,
a lost line, trips, a block, and profiles that change.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import replace
from decimal import Decimal
from itertools import product
from operator import itemgetter
from pathlib import Path

import pytest

from tests.recorded import sections
from tests.sources import ROOT
from tui.bus.errors import LineError
from tui.bus.link import SerialLink, TcpLink
from tui.bus.model import EndedExchange
from tui.bus.poll_plan import PlannedRead
from tui.drive.profile.library import load, load_file
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.drive.taught_profile import with_taught
from tui.drive.teaching import TaughtScale
from tui.drive.values import word_count
from tui.session.record.columns import gaps_of, history_columns, reach_of_points
from tui.session.record.export_rows import export_rows
from tui.session.record.history import number_text, oldest_reply, read_history, recorded_events
from tui.session.record.newest import ends_of_cycles
from tui.session.record.rebuilt_frames import frames_of
from tui.session.record.repeated_cycles import cycles_of
from tui.session.record.replay_line import ReplayLine, wire_frame
from tui.session.record.ring import record_path
from tui.session.record.runs import (
    RecordedRun,
    RecordedTrip,
    history_of,
    lost_lines,
    read_events,
)
from tui.session.record.schema import ReplyRow, reply_row, stray_row
from tui.session.record.silences import LostLink

from .invented_record import (
    ACC,
    ATV71,
    BACK,
    BEGIN,
    BLOCK,
    DRIVE_EVENTS,
    LFT,
    READY,
    RUN,
    drive_rows,
    event,
    profile,
    reply,
    seconds,
    written,
)

TEXTS = Path(__file__).parent / "recorded_records.txt"
TAUGHT = with_taught(load("atv312"), {"RFR": TaughtScale(Decimal("0.5"), "rpm", signed=True)})

# Rows

REQUESTS = {
    "bits": (b"\1\0\5\0\x0a", b"\1\2\x0d\2"), "inputs": (b"\2\0\5\0\3", b"\2\1\5"),
    "words": (b"\3\1\x64\0\2", b"\3\4\0\1\x80\2"), "input words": (b"\4\1\x64\0\1", b"\4\2\7\7"),
    "coil": (b"\5\0\5\xff\0", b"\5\0\5\xff\0"), "word": (b"\6\1\x64\2\7", b"\6\1\x64\2\7"),
    "echo": (b"\x08\0\0\xab\xcd", b"\x08\0\0\xab\xcd"),
    "coils": (b"\x0f\0\5\0\x0a\2\1\2", b"\x0f\0\5\0\x0a"),
    "many": (b"\x10\1\x64\0\2\4\0\1\0\2", b"\x10\1\x64\0\2"),
    "report": (b"\x11", b"\x11\3\1\2\3"),
    "both": (b"\x17\1\x64\0\1\2\0\0\1\2\0\7", b"\x17\2\0\x09"),
    "identity": (b"\x2b\x0e\1\0", b"\x2b\x0e\1\1\0\0\1\0\3ABC"),
}  # fmt: skip
RESULTS = ("reply", "exception", "nothing", "damaged", "wrong", "copy", "unsure", "sent")


def rows() -> Iterator[str]:
    """The row of each kind of request and result, and the frames that are made of it again."""
    for (name, (request, good)), kind in product(REQUESTS.items(), RESULTS):
        reply = {"reply": good, "copy": good, "exception": bytes([request[0] | 0x80, 3])}
        reply |= {"nothing": b"", "sent": b""}
        ended = EndedExchange(
            9, request, kind, reply.get(kind, b"\x09" + good[:3]), 4.75, 4.7712346, BEGIN + 0.5,
            "id", 1,
        )  # fmt: skip
        yield f"{name}, {kind}"
        yield from row_texts(reply_row(ended, "panel (12)"))
    late = ended._replace(sent=5.0)
    yield from row_texts(reply_row(late, ""))
    yield from row_texts(stray_row(late, b"\4\3\2\0\1\xaa\xbb"))


def row_texts(row: ReplyRow) -> Iterator[str]:
    yield f"  {row_text(row)}"
    for frame in frames_of(row):
        yield f"  > {frame._replace(data=b'')} {frame.data.hex()}"
        for link in (SerialLink("x"), TcpLink("x")):
            wire = wire_frame(frame, link)
            yield f"    {wire.direction} {wire.time} {wire.data.hex()} {wire.note}"


def row_text(row: ReplyRow) -> str:
    return " ".join(part.hex() if isinstance(part, bytes) else str(part) for part in row)


CODES = ("ETA", "RFR", "THD", "LCR", "LFT", "ACC", "SMIL", "INR", "gone")


def histories() -> Iterator[str]:
    """Each parameter, as replies and reduced, in several times."""
    for expired, (since, until) in product((0, 90, 1000), ((-1, 500), (62, 111), (300, 400))):
        with written((list(drive_rows()), DRIVE_EVENTS), expired=expired) as files:
            for code in CODES:
                yield f"{code} from {since} to {until}, reduced to {expired}"
                yield from history_texts(files, code, since, until)
    other = (list(drive_rows()), (profile(3, "atv71"), profile(60, "atv31", digest="0" * 64),
                                  profile(90, "atv312"), profile(140, "gone", digest="0"),
                                  event(160, "profile", "no JSON", 1)))  # fmt: skip
    with written(other, (list(drive_rows()), ())) as files:
        for own in (None, load("atv312"), TAUGHT):
            for code in ("RFR", "ACC", "ETI"):
                yield f"{code} of several profiles"
                yield from history_texts(files, code, -1, 500, own)
        files[0].write_bytes(b"no database")
        yield from history_texts(files, "RFR", -1, 2 * 86400)
        yield from history_texts(files[:1], "RFR", -1, 2 * 86400)


def history_texts(
    files: Sequence[Path], code: str, since: float, until: float, own: Profile | None = None
) -> Iterator[str]:
    """A history, the extent of its points, and its gaps and columns."""
    found = read_history(files, 1, code, BEGIN + since, BEGIN + until, own=own)
    entry = found.entry.code if found.entry else None
    yield f"  {entry} {found.unit!r} {[text[:150] for text in found.troubles]}"
    lines = [f"{seconds(p.time)} {seconds(p.end)} {p[2:]}" for p in found.points]
    yield from (f"  {line}" for line in (lines[:12] + lines[12::9]))
    reach = reach_of_points(found.points)
    gaps = [(seconds(begin), seconds(end)) for begin, end in gaps_of(found.points, reach)]
    yield f"  {reach:.3f} {gaps} {[number_text(found, n) for n in (0, 1.25, -3e7)]}"
    for column in history_columns(found.points, BEGIN, 200.0, 7):
        yield f"  {column and tuple(each if each is None else round(each, 4) for each in column)}"


WORDS = (0, 1, 7, 0x7FFF, 0x8000, 0xFFFE, 300)


def families() -> Iterator[str]:
    """Parameters of each kind of each family: its words as replies, and reduced."""
    for name in ("whole", "coils", "pump", "atv31"):
        path = ROOT / "tests" / "drive" / f"{name}.toml"
        known = load_file(path) if path.exists() else load(name)
        kinds: dict[tuple[object, ...], Parameter] = {}
        for entry in known.data.parameters:
            kind = entry.function, entry.type, bool(entry.bits), bool(entry.values), entry.mask
            kinds.setdefault((*kind, bool(entry.scale_by), entry.low_word_first), entry)
        rows = []
        for place, entry in enumerate(kinds.values()):
            count = word_count(entry)
            for at in range(14):
                words = [WORDS[(at + place + part) % 7] for part in range(count)]
                words = [word & 1 for word in words] if entry.function < 3 else words
                words = words if at < 7 else words[:1] * count
                rows.append(reply(30 * (at // 7) + at % 7 + place / 100, words, entry.address,
                                  function=entry.function))  # fmt: skip
        rows.sort(key=lambda row: row.utc)
        for expired in (0, 1000):
            with written((rows, (profile(0, known),)), expired=expired) as files:
                for entry in kinds.values():
                    found = read_history(files, 1, entry.code, BEGIN - 1, BEGIN + 99, own=known)
                    values = [point[2:] for point in found.points][:: 1 if expired else 3]
                    yield f"{name} {entry.code} {found.unit} {values}"


def pasts() -> Iterator[str]:
    """Runs, trips and losses, of exact and of reduced rows."""
    rows, drive2 = list(drive_rows()), [row._replace(device=2) for row in drive_rows()]
    further = [reply(at, (RUN, 200, 250 + at % 7, 90)) for at in range(300, 310)]
    further += [reply(at, (READY, 0, 0, 0)) for at in range(400, 404)]
    further += [reply(at, (BACK, 200, 65000, 90)) for at in range(410, 420)]
    further += [reply(at, quality="silent", registers=4) for at in (420, 421, 422, 440)]
    events = (event(500, "line", "lost Again."),)
    for expired in (0, 75, 1000):
        parts = (rows + drive2, (*DRIVE_EVENTS, profile(8, "atv312", 2))), (further, events)
        with written(*parts, expired=expired) as files:
            damaged = record_path(files[0].parent, "line-1", 1)
            damaged.write_bytes(b"no database")
            record = read_events([damaged, *files])
            yield f"reduced to {expired}: {record.line} {record.profiles} {len(record.files)}"
            yield f"  {[text.replace(str(files[0].parent), '') for text in record.unread]}"
            yield f"  {[event.text for event in record.of('line')]} {list(record.of('stop', 2))}"
            yield from (past_text(loss) for loss in lost_lines(record))
            span = ((-10.0, 1000.0), (45.0, 125.0), (600.0, 700.0))
            for device, name, (since, until) in product((1, 2), ("atv71", "atv312", "x"), span):
                found = history_of(record, device, name, BEGIN + since, BEGIN + until)
                yield f"drive {device}, {name}, from {since} to {until}"
                yield from (past_text(each) for part in found for each in part)
            each = ((1,), (9, 2), (9,))
            yield f"{[oldest_reply([damaged, *files], devices) for devices in each]}"
            for since, until in ((0.0, 41.0), (60.0, 100.5), (100.5, 900.0)):
                found_events = recorded_events(files, BEGIN + since, BEGIN + until)
                yield f"{[f'{seconds(each.utc / 1e6)} {each.kind}' for each in found_events]}"
            names = ("RFR", "LCR", "ETA")
            several = {
                code: read_history(files, 1, code, BEGIN + 80, BEGIN + 420) for code in names
            }
            for row in list(export_rows(1, several))[::5]:
                values = {code: point.mean for code, point in row.points.items()}
                yield f"  {seconds(row.time)} {row.device} {values} {seconds(row.gap_until)}"


def past_text(found: RecordedRun | RecordedTrip | LostLink) -> str:
    """A run, a trip or a loss, with its times since the begin."""
    parts = {**found._asdict(), "begun": seconds(found.begun), "ended": seconds(found.ended)}
    rounded = [round(part, 3) if isinstance(part, float) else part for part in parts.values()]
    return f"  {type(found).__name__} {rounded}"


PLACES = ((3, 3201, 4), (3, 3203, 1), (3, 3204, 2), (3, LFT, 1), (3, ACC, 1), (3, 9999, 1),
          (3, 9998, 1), (3, 9997, 1), (3, BLOCK, 2), (3, BLOCK + 1, 1), (4, 3201, 1),
          (3, ATV71["THD"].address, 1))  # fmt: skip
IDENTITY = reply(1.2, function=43, address=0, sent=b"\x2b\x0e\1\0",
                 received=b"\x2b\x0e\1\1\0\0\1\0\3ABC")  # fmt: skip
REPORT = reply(2.2, function=17, address=0, sent=b"\x11", received=b"\x11\3\1ab")


def replays() -> Iterator[str]:
    """Known values at some times, by one replay that moves there, and by one that begins then."""
    rows = [*drive_rows(), IDENTITY, REPORT, *(reply(at, (7,), device=2) for at in (3, 199.5))]
    rows += [
        stray_row(EndedExchange(1, b"", "reply", b"", 0, BEGIN, BEGIN + 5, strays=()), b"\1\2")
    ]
    rows += [reply(at, registers=1, quality="silent", device=2) for at in (30, 31, 32)]
    for expired in (0, 92):
        with written((sorted(rows, key=itemgetter(0)), DRIVE_EVENTS), expired=expired) as files:
            moved = ReplayLine(files[0], files=files)
            with closing(moved):
                use_profile(moved)
                yield f"reduced to {expired}: {moved.link} {moved.span} {moved.devices} {moved.at}"
                yield f"  {[(seconds(each.utc / 1e6), each.kind) for each in moved.events]}"
                yield f"  {moved.identification(1, 43)} {moved.identification(1, 17)}"
                yield f"  {moved.identification(2, 43)}"
                for at in (0.2, 3.5, 22.015, 60.45, 75, 88, 100.02, 103.5, 152, 160.5, 199.8):
                    moved.clock.skip_to(BEGIN + at)
                    yield f"at {at}"
                    known = list(known_texts(moved))
                    yield from known
                    with closing(ReplayLine(files[0], BEGIN + at, files=files)) as line:
                        use_profile(line)
                        different = [text for text in known_texts(line) if text not in known]
                        yield f"  at once: {different}"
                yield f"{moved.counters}".replace("), ", "),\n  ")
                yield from cycle_texts(moved)


def use_profile(line: ReplayLine) -> None:
    places = {entry.code: (entry.function, entry.address) for entry in ATV71.data.parameters}
    line.use_profile(1, {(3, 3202): True, (3, 3204): False}.get, places.get)


def known_texts(line: ReplayLine) -> Iterator[str]:
    """All that a replay knows of its drives at its time."""

    async def read(device: int, place: tuple[int, int, int]) -> str:
        try:
            found = await line.read(device, *place[1:], function=place[0])
        except LineError as error:
            return f"{type(error).__name__}: {error}"
        return f"{found.words} {seconds(found.time)}"

    async def read_all() -> list[str]:
        return [f"  {device} {place}: {await read(device, place)}" for device, place in
                product((1, 2), PLACES[: 9])]  # fmt: skip

    yield from asyncio.run(read_all())
    last = line.last_replies(1, PLACES)
    yield f"  {[(each.words, seconds(each.time)) if each else None for each in last]}"
    for device in (1, 2):
        state = line.device_state(device)
        heard, silent = seconds(state.heard), seconds(state.silent_since)
        yield f"  {replace(state, heard=heard, silent_since=silent)}"
        note = line.profile_note(device)
        places = dict(line.in_block(device, round(line.clock.wall() * 1e6)))
        yield f"  {note and seconds(note.utc / 1e6)} {places}"
    yield f"  {replace(line.state, since=0)} {seconds(line.state.since)}"
    frames = [f"{seconds(each.time)} {each.direction} {each.data.hex()}" for each in line.trace]
    yield f"  {frames[-8:]} {len(frames)}"


def cycle_texts(line: ReplayLine) -> Iterator[str]:
    """The cycles of a monitor in the record, by what it reads."""
    plans = ([PlannedRead(3201, 4)], [PlannedRead(3204, 1), PlannedRead(LFT, 1)],
             [PlannedRead(ACC, 2)], [PlannedRead(9999, 1)])  # fmt: skip
    for reads, since in product(plans, (0, 80, 190)):
        found, is_end = cycles_of(line, 1, BEGIN + since, reads)
        cycles = [(seconds(each.begun / 1e6), seconds(each.last.ended / 1e6), each.block)
                  for each in found]  # fmt: skip
        yield f"{[read.address for read in reads]} from {since}: {len(found)} {is_end}"
        yield f"  {cycles[:12] + cycles[12::20]}"
        lost = line.lost_within(BEGIN + since, BEGIN + since + 72)
        yield f"  {lost and (lost.reason, seconds(lost.since))}"
    for since, at, most in ((0, 9, 4), (80, 99.5, 6), (170, 300, 3)):
        for found_in in (line.last_before(1, BEGIN + since, BEGIN + at, most),
                         line.last_of_each(1, BEGIN + since, BEGIN + at)):  # fmt: skip
            last = [(seconds(each.ended / 1e6), each.address, each.quality) for each in found_in]
            yield f"  {last}"
    replies = line.replies_from(1, BEGIN + 84.5)[:16]
    yield f"  {[seconds(each) for each in ends_of_cycles(replies, BEGIN + 95.8)]}"


SECTIONS = (rows, histories, families, pasts, replays)


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_files_of_a_record_give_what_is_recorded(section: Callable[[], Iterator[str]]) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
