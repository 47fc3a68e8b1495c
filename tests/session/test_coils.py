"""Drives commanded by coils: reads, writes and stops, on simulated drives and on a fake line."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from tui.bus.coils import ReadCoils, ReadDiscrete, WriteCoil, WriteCoils
from tui.bus.errors import RequestRefused
from tui.bus.fake import FakeLine
from tui.bus.line_events import DeviceWritten
from tui.bus.link import SerialLink
from tui.bus.model import EndedExchange
from tui.bus.program import Program
from tui.bus.requests import WriteOne
from tui.drive.errors import ValueRefused
from tui.drive.first_stop import blind_stops
from tui.drive.foreign_write import WordKind, classify_words
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import OrderId
from tui.drive.profile.stop_profile import stop_profile_of
from tui.session.arming import NotArmed
from tui.session.command.first_stop import stop_first
from tui.session.command.stop import Stopper
from tui.session.drive import DriveSession
from tui.session.journal import Journal
from tui.session.listening.words import spans_of, words_read
from tui.session.monitor.trend import Trend
from tui.session.read.reader import Reader
from tui.session.record.rebuilt_frames import frames_of
from tui.session.record.schema import reply_row
from tui.session.running.watching import outcome_of
from tui.session.settings.write import NotTaken, Writer
from tui.session.work import Outcome, OutcomeKind
from tui.simulator.ghost import GhostDrive, RecordedExchange
from tui.wire.frames import frame, wire_place
from tui.wire.observed.pairing import ObservedExchange, Pairing
from tui.wire.observed.splitting import ObservedFrame

from .test_command import Bench, bench

FILE = Path(__file__).parents[1] / "drive" / "coils.toml"
COILS, INPUTS = wire_place(1, 0), wire_place(2, 0)
RUN, REVERSE, RESET = (1, 0, 0, 0), (1, 1, 0, 0), (0, 0, 0, 1)
STOP = WriteCoils(1, 1, (0, 0, 0, 0))
DRIVE = {
    **dict.fromkeys(range(COILS + 1, COILS + 5), 0), COILS + 16: 0,
    **dict.fromkeys(range(INPUTS, INPUTS + 3), 0), 1: 0, 2: 0, 3: 0, 4: 0,
}  # fmt: skip


@pytest.fixture
def profile() -> Profile:
    return library.load_file(FILE)


def session_of(line: FakeLine, profile: Profile) -> DriveSession:
    session = DriveSession(line, 1, profile)
    session.arming.arm(seconds=math.inf)
    return session


def sent(made: Bench, function: int) -> list[bytes]:
    """The data of the requests of a function, as they were on the wire."""
    frames = (frame.data for frame in made.line.trace if frame.direction == "out")
    return [data[2:-2] for data in frames if data[1] == function]


@asynccontextmanager
async def coils(*, armed: bool = True, read_only: bool = False) -> AsyncIterator[Bench]:
    folder = library.user_folder()
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "coils.toml").write_text(FILE.read_text("utf-8"), "utf-8")
    library.load.cache_clear()
    async with bench("example-coils", armed=armed, read_only=read_only) as made:
        yield made


async def test_coils_and_inputs_are_read_as_words(profile: Profile) -> None:
    line = FakeLine({1: {**DRIVE, INPUTS: 1, INPUTS + 2: 1, COILS + 2: 1, COILS + 16: 1}})
    readings = await Reader(session_of(line, profile)).read(["STAT", "CTRL", "FAN"])
    assert {code: reading.raw for code, reading in readings.items()} == {
        "STAT": 5, "CTRL": 2, "FAN": 1,
    }  # fmt: skip
    assert {code: reading.value.text for code, reading in readings.items() if reading.value} == {
        "STAT": "16#5", "CTRL": "16#2", "FAN": "On",
    }  # fmt: skip
    assert set(line.requests) == {ReadDiscrete(1, 0, 3), ReadCoils(1, 1, 4), ReadCoils(1, 16, 1)}


def test_holder_of_the_line_polls_by_the_same_functions(profile: Profile) -> None:
    session = DriveSession(FakeLine({1: dict(DRIVE)}), 1, profile)
    planned = Reader(session).planned(["STAT", "CTRL", "FREQ"])
    reads = {(read.function, read.address, read.count) for read in planned}
    assert reads == {(2, 0, 3), (1, 1, 4), (3, 1, 1)}


async def test_coil_is_written_and_read_back(profile: Profile, journal: Journal) -> None:
    line = FakeLine({1: dict(DRIVE)})
    session = session_of(line, profile)
    writer = Writer(session, journal, session.work.permit())
    await writer.write_parameter(profile["FAN"], 1, why="setting")
    assert line.requests[-2:] == [WriteCoil(1, 16, 1), ReadCoils(1, 16, 1)]
    await writer.write_parameter(profile["CTRL"], 3, why="command")
    assert line.requests[-2:] == [WriteCoils(1, 1, REVERSE), ReadCoils(1, 1, 4)]
    with pytest.raises(ValueRefused):
        await writer.write_parameter(profile["FAN"], 2, why="setting")
    line.devices[1].take = lambda *_: None  # type: ignore[method-assign]
    with pytest.raises(NotTaken, match=r"FAN was written as Off, but the drive holds On"):
        await writer.write_parameter(profile["FAN"], 0, why="setting")
    session.arming.disarm("test")
    before = list(line.requests)
    with pytest.raises(NotArmed):
        await writer.write_parameter(profile["FAN"], 1, why="setting")
    assert line.requests == before


def test_stop_is_prepared_as_coils(profile: Profile) -> None:
    session = DriveSession(FakeLine({1: dict(DRIVE)}, link=SerialLink("/dev/null")), 1, profile)
    (prepared,) = session.prepared
    assert prepared.request == STOP
    assert prepared.frame[:-2] == bytes.fromhex("01 0F 0001 0004 01 00")
    (word,) = blind_stops([stop_profile_of(profile)])
    assert (word.address, word.values) == (COILS + 1, (0, 0, 0, 0))


@pytest.mark.internal_errors
async def test_stop_by_an_internal_error_switches_the_coils_off(
    profile: Profile, journal: Journal
) -> None:
    line = FakeLine({1: {**DRIVE, COILS + 1: 1, INPUTS: 1}})
    session = session_of(line, profile)
    Stopper(line, journal).send_prepared(session, RuntimeError("test"))
    assert line.devices[1].words[COILS + 1] == 0
    assert line.requests[0] == STOP
    (entry,) = journal.recent
    assert (entry.code, entry.address, entry.new_raw, entry.new) == ("CTRL", 1, 0, "16#0")


@pytest.mark.parametrize("named", [True, False])
async def test_drive_that_is_not_identified_is_stopped_by_its_named_profile_only(
    profile: Profile, journal: Journal, named: bool
) -> None:
    line = FakeLine({1: {**DRIVE, COILS + 1: 1}})
    names = ["example-coils"] if named else []
    done = await stop_first(line, 1, journal, [stop_profile_of(profile)], names, "stop")
    assert [item.answer for item in done.sent] == (["ok"] if named else [])
    assert line.devices[1].words[COILS + 1] == (not named)
    entries = [(entry.code, entry.address, entry.new) for entry in journal.recent]
    assert entries == ([("CTRL", 1, "16#0")] if named else [])


async def run(made: Bench, id: OrderId) -> Outcome | None:
    return await outcome_of(made.commander, lambda: made.commander.run(id, "20Hz"))


async def test_motor_runs_both_ways_and_is_stopped() -> None:
    async with coils() as made:
        outcome = await run(made, "forward")
        assert outcome is not None
        assert outcome.text == "Run: Running"
        await made.let_go_until(lambda: made.drive.motor.frequency > 19)
        made.stopper.stop([made.session])
        await made.let_go_until(lambda: made.stopped)
        assert not made.drive.motor.energised
        await made.arm()
        await run(made, "reverse")
        await made.let_go_until(lambda: made.drive.motor.frequency < -19)
        made.stopper.stop([made.session])
        await made.let_go_until(lambda: made.stopped)
        words = [data[-1] for data in sent(made, 15)]
        assert words[:2] == [1, 0]
        assert words[-2:] == [3, 0]
        assert {data[:5] for data in sent(made, 15)} == {bytes.fromhex("0001 0004 01")}


async def test_fault_is_reset_by_its_coil_and_no_motor_starts() -> None:
    async with coils() as made:
        made.drive.provoke(0)
        await made.let_go_until(lambda: made.session.state(1.0).kind == "fault")
        assert await made.order("reset") == "Fault reset: Ready"
        assert [data[-1] for data in sent(made, 15)] == [8, 0]
        assert not made.drive.motor.energised


async def test_read_only_line_writes_no_coil() -> None:
    async with coils(armed=False, read_only=True) as made:
        with pytest.raises(RequestRefused, match="read-only"):
            await made.line.write(1, COILS + 1, RUN)
        with pytest.raises(RequestRefused, match="read-only"):
            await made.line.write(1, COILS + 16, [0])
        assert sent(made, 15) == []


def test_write_to_a_register_is_none_to_a_coil(profile: Profile) -> None:
    """Coil 1 to 4 are the command; register 1 is the frequency, register 4 is unknown."""
    off = dict.fromkeys(range(1, 5), 0)
    assert {word.kind for word in classify_words(profile, off, {})} == {
        WordKind.UNKNOWN, WordKind.COMMAND,
    }  # fmt: skip
    own = {COILS + at: 0 for at in range(1, 5)}
    assert {word.kind for word in classify_words(profile, own, {})} == {WordKind.STOP}
    assert {word.kind for word in classify_words(profile, {**own, COILS + 1: 1}, {})} == {
        WordKind.COMMAND
    }
    (part,) = classify_words(profile, {COILS + 1: 0}, {})
    assert part.kind is WordKind.COMMAND, "three coils of it are not known"


def test_curve_names_the_coil_that_another_program_wrote(profile: Profile) -> None:
    trend = Trend(profile)
    program = Program("other", "other", 1)
    for place in (COILS + 16, COILS + 9, 9):
        trend.note_write(DeviceWritten(1, place, (1,), program, 1.0))
    writes = trend._marker.writes
    assert [write.codes for write in writes] == [("FAN",), ("coil 9",), ("register 9",)]


@pytest.mark.parametrize(
    ("request_", "reply", "spans", "read"),
    [
        ("01 0001 0004", "01 01 05", [(1, 1, 4, ())], (1, 0, 1, 0)),
        ("02 0000 0009", "02 02 01 01", [(2, 0, 9, ())], (1, 0, 0, 0, 0, 0, 0, 0, 1)),
        ("05 0010 FF00", "05 0010 FF00", [(1, 16, 1, (1,))], ()),
        ("05 0010 0000", "05 0010 0000", [(1, 16, 1, (0,))], ()),
        ("0F 0001 0004 01 05", "0F 0001 0004", [(1, 1, 4, (1, 0, 1, 0))], ()),
        ("0F 0001 0014 01 05", "0F 0001 0014", [], ()),
        ("0F 0001", "8F 03", [], ()),
    ],
)
def test_observed_frames_are_understood(
    request_: str, reply: str, spans: list[tuple[object, ...]], read: tuple[int, ...]
) -> None:
    request = bytes.fromhex(request_)
    found = spans_of(request)
    assert [(s.function, s.address, s.count, s.written) for s in found] == spans
    exchange = ObservedExchange(0.0, 1, request[0], "ok", request, bytes.fromhex(reply))
    assert words_read(exchange) == read


EXCHANGES = [
    ("01 0001 0004", "01 01 05", "good"),
    ("02 0000 0009", "02 02 01 01", "good"),
    ("05 0010 FF00", "05 0010 FF00", "good"),
    ("0F 0001 0004 01 05", "0F 0001 0004", "good"),
    ("01 0001 0004", "81 02", "exception"),
    ("0F 0001 0004 01 05", "8F 02", "exception"),
]


@pytest.mark.parametrize(("request_", "reply", "result"), EXCHANGES)
def test_recorded_frames_are_those_of_the_line(request_: str, reply: str, result: str) -> None:
    sent, came = bytes.fromhex(request_), bytes.fromhex(reply)
    kind = "reply" if result == "good" else result
    row = reply_row(EndedExchange(1, sent, kind, came, 1.0, 1.1, 100.0), "panel")
    assert [frame.data for frame in frames_of(row)] == [sent, came]
    assert (row.address, row.registers) == (sent[1] << 8 | sent[2], 1 if sent[0] == 5 else sent[4])


def test_recorded_coils_are_words_of_a_register_each() -> None:
    sent, came = bytes.fromhex("02 0000 0009"), bytes.fromhex("02 02 01 01")
    row = reply_row(EndedExchange(1, sent, "reply", came, 1.0, 1.1, 100.0), "")
    assert row.words == bytes.fromhex("0001 0000 0000 0000 0000 0000 0000 0000 0001")


def test_ghost_answers_from_the_bits_that_it_has() -> None:
    pairs = [(bytes.fromhex(r), bytes.fromhex(a)) for r, a, result in EXCHANGES[:2]]
    ghost = GhostDrive(1, [RecordedExchange(0.0, 0.01, *pair) for pair in pairs])

    def answer(pdu: str) -> str:
        found = ghost.answer(bytes.fromhex(pdu))
        return found.data.hex(" ") if found is not None else ""

    assert answer("01 0001 0004") == "01 01 05"
    assert answer("01 0003 0002") == "01 01 01", "coils 3 and 4"
    assert answer("02 0001 0008") == "02 01 80"
    assert answer("01 0000 0002") == "81 02"
    assert answer("02 0001 0009") == "82 02"


@pytest.mark.parametrize(
    ("reply", "paired"),
    [("01 01 05", True), ("01 02 05 00", False), ("02 01 05", False), ("03 02 0005", False)],
)
def test_observed_reply_has_the_bytes_of_its_coils(reply: str, paired: bool) -> None:
    pairing = Pairing()
    pairing.take(ObservedFrame(0.0, 0.01, frame(1, bytes.fromhex("01 0001 0004")), True))
    taken = ObservedFrame(0.02, 0.03, frame(1, bytes.fromhex(reply)), True)
    found, _ = pairing.take(taken)
    assert [exchange.answer == "ok" for exchange in found] == [paired]


async def test_refused_command_is_reported(profile: Profile) -> None:
    async with coils() as made:
        made.commander.run("forward", "60Hz")
        assert "out of range" in await made.done(OutcomeKind.REFUSED)
        assert sent(made, 15) == []


def test_write_of_a_register_at_its_number_is_another_request(profile: Profile) -> None:
    assert WriteOne(1, 1, 0).written != WriteCoil(1, 1, 0).written
