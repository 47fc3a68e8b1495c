"""The gateway on simulated drives: forwarded and refused requests, and stops of clients."""

from __future__ import annotations

import asyncio
import os
import struct
from collections.abc import AsyncIterator, Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio

from tests.line_events import on_event
from tests.programs import wait_until
from tui.bus.gateway.server import TcpRequest
from tui.bus.gateway.talk import TcpClient
from tui.bus.line import Line
from tui.bus.line_events import DevicesStopped, NoticeReceived
from tui.bus.program import Program
from tui.drive.profile import library
from tui.session.gateway.gateway import Gateway
from tui.session.gateway.line import NONE_NAMED, GatewayLine
from tui.session.gateway.rules import GatewayRules, RulesError, allowed_codes, as_written, unit_map
from tui.session.gateway.started import StartedMotors
from tui.session.gateway.writes import ENDED_BEFORE_ANSWER
from tui.session.journal import Journal
from tui.simulator import DriveSpec, Simulation

from .test_stop import Start, start, wait_for

__all__ = ["start"]

ATV71 = library.load("atv71")
CMD, LFR, ETA, ACC = 8501, 8502, 3201, 9001
PANEL = Program("panel's id", "panel", 4711)


@dataclass(slots=True)
class Bench:
    """A gateway on one line with one client."""

    simulation: Simulation
    line: Line
    gateway: Gateway
    journal: Journal
    client: TcpClient

    async def ask(self, pdu: bytes, unit: int = 1) -> bytes:
        return await self.gateway.answer(TcpRequest(self.client, unit, pdu))

    async def read(self, address: int, count: int = 1, unit: int = 1) -> tuple[int, ...] | int:
        """The words, or the number of the exception."""
        answer = await self.ask(struct.pack(">BHH", 3, address, count), unit)
        if answer[0] & 0x80:
            return answer[1]
        return struct.unpack(f">{count}H", answer[2:])

    async def write(self, address: int, *words: int, unit: int = 1) -> int:
        """The number of the exception, 0 where it was written."""
        if len(words) == 1:
            pdu = struct.pack(">BHH", 6, address, words[0])
        else:
            data = struct.pack(f">{len(words)}H", *words)
            pdu = struct.pack(">BHHB", 16, address, len(words), len(data)) + data
        answer = await self.ask(pdu, unit)
        assert answer[0] & 0x7F == pdu[0]
        return answer[1] if answer[0] & 0x80 else 0

    def written(self) -> list[tuple[int, int]]:
        """Writes to any drive: register and first word."""
        found = []
        for frame in self.line.trace:
            if frame.direction == "out" and frame.data[1] in (6, 16, 23):
                at = 2 if frame.data[1] != 23 else 6
                (address,) = struct.unpack(">H", frame.data[at : at + 2])
                word = frame.data[4:6] if frame.data[1] == 6 else frame.data[7:9]
                found.append((address, int.from_bytes(word, "big")))
        return found


Make = Callable[..., Bench]


@pytest_asyncio.fixture
async def bench(start: Start, journal: Journal) -> AsyncIterator[Make]:
    """A gateway with these rules (default: on an Altivar 71 at address 1)."""
    gateways: list[Gateway] = []

    def make(*specs: DriveSpec, profiles: Mapping[int, str] = NONE_NAMED, **rules: object) -> Bench:
        simulation, line = start(*(specs or [DriveSpec("atv71", 1, sets={"CHCF": 1})]))
        kept = GatewayRules(**rules)  # type: ignore[arg-type]
        gate = GatewayLine(line, journal, profiles=profiles)
        gateways.append(Gateway([gate], unit_map(1, ()), kept))
        return Bench(simulation, line, gateways[-1], journal, TcpClient(1, "10.0.0.9:5000"))

    yield make
    for gateway in gateways:
        await gateway.close()


async def test_reads_pass_and_an_absent_drive_is_exception_11(bench: Make) -> None:
    made = bench()
    drive = made.simulation.drive(1)
    assert await made.read(ACC, 2) == (drive.raw("ACC"), drive.raw("DEC"))
    assert await made.read(64000) == 2  # the drive's own exception
    assert await made.read(ACC, unit=9) == 11
    assert await made.read(ACC, unit=250) == 10
    assert made.written() == []


async def test_absent_drive_does_not_block_the_line(bench: Make) -> None:
    made = bench()
    for _ in range(20):
        assert await made.read(ACC, unit=9) == 11
    requested = [f for f in made.line.trace if f.direction == "out" and f.data[0] == 9]
    assert len(requested) < 4


async def test_stop_during_identification_cancels_the_command(bench: Make) -> None:
    made = bench(commands=True)
    under_way = asyncio.create_task(made.write(LFR, 300))
    await asyncio.sleep(0)
    made.line.facts.give_stop([1], "the stop key")
    assert await under_way == 6
    assert made.written() == []
    assert await made.write(LFR, 300) == 0


async def test_only_allowed_codes_are_written(bench: Make) -> None:
    made = bench()
    before = made.simulation.drive(1).raw("ACC")
    assert await made.write(ACC, before + 5) == 1
    assert await made.write(CMD, 0x000F) == 1
    assert await made.write(LFR, 300) == 1
    assert await made.write(ACC, before + 5, before + 5) == 1
    assert made.written() == []
    assert made.simulation.drive(1).raw("ACC") == before
    assert made.journal.recent == ()


async def test_allowed_setting_is_written_and_journaled(bench: Make) -> None:
    made = bench(writes=allowed_codes("ACC"))
    before = made.simulation.drive(1).raw("ACC")
    assert await made.write(ACC, 57) == 0
    assert made.simulation.drive(1).raw("ACC") == 57
    (entry,) = made.journal.recent
    assert (entry.code, entry.old_raw, entry.new_raw, entry.new) == ("ACC", before, 57, "5.7 s")
    assert entry.why == "write of Modbus TCP client 10.0.0.9:5000"
    assert await made.write(ACC + 1, 57) == 1  # DEC is another
    assert await made.write(ACC, 60000) == 3
    assert made.written() == [(ACC, 57)]


async def test_write_cut_by_end_of_serve_is_not_recorded_as_done(
    bench: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = bench(writes=allowed_codes("ACC"))
    begun = asyncio.Event()

    async def unanswered(*_: object, **__: object) -> None:
        begun.set()
        await asyncio.Event().wait()

    monkeypatch.setattr(made.line, "write", unanswered)
    task = asyncio.create_task(made.write(ACC, 57))
    await begun.wait()
    task.cancel()
    await asyncio.wait([task])
    (entry,) = made.journal.recent
    assert (entry.code, entry.answer) == ("ACC", ENDED_BEFORE_ANSWER)


def test_codes_are_accepted_in_any_case() -> None:
    assert as_written(allowed_codes("acc, ALL")) == {"ACC", "all"}
    assert as_written(allowed_codes("f803")) == {"F803"}
    with pytest.raises(RulesError, match="No family has a parameter NOPE, nor"):
        as_written(allowed_codes("ACC,nor,NOPE"))


async def test_allow_all_excludes_commands(bench: Make) -> None:
    made = bench(writes=allowed_codes("all"))
    assert await made.write(CMD, 0x000F) == 1
    assert await made.write(LFR, 300) == 1
    assert await made.write(ATV71["CMI"].address, 0x0400) == 1
    assert await made.write(ATV71["CHCF"].address, 2) == 1
    assert made.written() == []


async def test_stop_word_needs_no_permission_and_cancels_pending_writes(bench: Make) -> None:
    made = bench()
    made.simulation.drive(1).run(30.0)
    stops = made.line.facts.stops.stamp(1)
    assert await made.write(CMD, 0x0007) == 0
    assert made.written() == [(CMD, 0x0007)]
    assert made.line.facts.stops.stamp(1) > stops
    assert "Modbus TCP client 10.0.0.9:5000" in made.line.facts.stops.by[1]
    (entry,) = made.journal.recent
    assert entry.why.startswith("stop of Modbus TCP")


async def test_stop_word_passes_while_a_panel_commands_but_a_run_word_does_not(
    bench: Make,
) -> None:
    made = bench(commands=True)
    facts = made.line.facts
    facts.set_programs((facts.me, PANEL))
    facts.note_commander(1, PANEL.id)
    assert await made.write(CMD, 0x000F) == 6
    assert await made.write(LFR, 300) == 6
    assert made.written() == []
    assert await made.write(CMD, 0x0007) == 0
    assert made.written() == [(CMD, 0x0007)]


async def test_stop_overtakes_and_cancels_writes_of_its_connection(
    bench: Make,
) -> None:
    """They may wait for a drive that is silent for many seconds."""
    made = bench(commands=True, writes=allowed_codes("ACC"))
    assert await made.write(ACC, 57) == 0
    silent = asyncio.Event()

    async def turn() -> None:
        await silent.wait()

    def send(address: int, word: int) -> asyncio.Task[bytes]:
        pdu = struct.pack(">BHH", 6, address, word)
        answer = made.gateway.answer(TcpRequest(made.client, 1, pdu, turn=turn))
        return asyncio.create_task(answer)

    before = [send(ACC, 58), send(LFR, 300), send(CMD, 0x000F)]
    stop, behind = send(CMD, 0x0007), send(LFR, 200)
    assert (await asyncio.wait_for(stop, 30))[0] == 6
    assert made.written() == [(ACC, 57), (CMD, 0x0007)]
    silent.set()
    assert [(await task)[:2] for task in before] == [bytes([0x86, 6])] * 3
    assert (await behind)[0] == 6
    assert made.written() == [(ACC, 57), (CMD, 0x0007), (LFR, 200)]


async def test_stop_word_that_depends_on_an_earlier_write_waits_for_it(bench: Make) -> None:
    """16#0007 stops in one profile of commands, and runs the motor in another."""
    made = bench(DriveSpec("atv71", 1, sets={"CHCF": 1, "TCC": 0}), writes=allowed_codes("CHCF"))
    silent = asyncio.Event()

    assert await made.write(CMD, 0x0007) == 0
    sent = made.written()
    setting = struct.pack(">BHH", 6, ATV71["CHCF"].address, 3)
    stop = struct.pack(">BHH", 6, CMD, 0x0007)
    tasks: list[asyncio.Task[bytes]] = []

    async def turn() -> None:
        await silent.wait()
        if asyncio.current_task() is not tasks[0]:
            await tasks[0]

    for pdu in (setting, stop):
        answer = made.gateway.answer(TcpRequest(made.client, 1, pdu, turn=turn))
        tasks.append(asyncio.create_task(answer))
    await asyncio.sleep(0.1)
    assert made.written() == sent
    silent.set()
    assert [(await task)[:2].hex() for task in tasks] == ["0620", "8601"]


async def test_stop_among_forbidden_words_is_sent_alone(bench: Make) -> None:
    """Controllers write command and reference together."""
    made = bench()
    assert await made.write(CMD, 0x0007, 0) == 1
    assert made.written() == [(CMD, 0x0007)]


async def test_drivecom_stop_word_does_not_pass_in_the_io_profile(bench: Make) -> None:
    made = bench(DriveSpec("atv71", 1, sets={"CHCF": 3, "TCC": 0}))
    assert await made.write(CMD, 0x0007) == 1
    assert made.written() == []
    assert await made.write(CMD, 0x0000) == 0


async def test_allowed_commands_run_and_claim_the_motor(bench: Make) -> None:
    made = bench(DriveSpec("atv71", 1, sets={"CHCF": 1, "TTO": 600}), commands=True)
    drive = made.simulation.drive(1)
    facts = made.line.facts
    assert await made.write(LFR, 300) == 0
    for word in (0x0006, 0x0007, 0x000F):
        assert await made.write(CMD, word) == 0
    await wait_for(lambda: drive.motor.frequency > 3)
    assert facts.commanders.get(1) == facts.me.id
    assert await made.write(CMD, 0x0007) == 0
    assert 1 not in facts.commanders
    await wait_for(lambda: drive.motor.frequency == 0)


async def start_motor(made: Bench) -> None:
    assert await made.write(LFR, 300) == 0
    for word in (0x0006, 0x0007, 0x000F):
        assert await made.write(CMD, word) == 0
    await wait_for(lambda: made.simulation.drive(1).motor.frequency > 3)


def recorded() -> int:
    return len(list(Path(os.environ["DRIVEPANEL_STATE"], "starts").iterdir()))


async def test_motor_started_by_a_client_is_recorded_until_standstill(bench: Make) -> None:
    made = bench(DriveSpec("atv71", 1, sets={"CHCF": 1, "TTO": 600}), commands=True)
    await start_motor(made)
    assert recorded() == 1
    assert await made.write(CMD, 0x0007) == 0
    await asyncio.to_thread(wait_until, lambda: recorded() == 0, "the record goes")
    assert made.simulation.drive(1).motor.frequency == 0


async def test_gateway_stops_motors_of_its_clients_at_its_end(bench: Make) -> None:
    made = bench(DriveSpec("atv71", 1, sets={"CHCF": 1, "TTO": 600}), commands=True)
    await start_motor(made)
    (reported,) = await made.gateway.close()
    assert "1: stopped" in reported.text
    assert made.simulation.drive(1).motor.frequency == 0
    assert made.simulation.drive(1).fault is None


async def test_repeated_run_word_does_not_undo_a_stop(bench: Make) -> None:
    """A controller that writes its word every second would start the motor again."""
    made = bench(commands=True)
    assert await made.write(LFR, 300) == 0
    facts = made.line.facts
    facts.events.emit(DevicesStopped((1,), "the stop key", PANEL))
    assert 1 not in facts.commanders
    sent = len(made.written())
    assert await made.write(CMD, 0x000F) == 6
    assert len(made.written()) == sent
    assert await made.write(CMD, 0x0007) == 0  # it has seen the stop
    assert await made.write(LFR, 100) == 0


async def test_disconnected_client_commands_nothing_and_is_reported(bench: Make) -> None:
    made = bench(commands=True)
    output: list[str] = []
    on_event(made.line.facts, NoticeReceived, lambda event: output.append(event.text))
    assert await made.write(LFR, 300) == 0
    made.gateway.gone(made.client)
    assert 1 not in made.line.facts.commanders
    assert "10.0.0.9:5000, which commanded this drive, has disconnected" in output[0]


async def test_stop_of_a_disconnected_client_is_sent_but_no_command(
    bench: Make,
) -> None:
    """The stop did not reach the motor: it waited behind another write, or for the drive."""
    made = bench(commands=True, writes=allowed_codes("ACC"))
    made.client.left = True
    assert await made.write(LFR, 300) == 6
    assert await made.write(CMD, 0x000F) == 6
    assert made.written() == []
    assert 1 not in made.line.facts.commanders
    assert await made.write(CMD, 0x0007) == 0
    assert await made.write(ACC, 57) == 0


async def test_client_that_disconnects_during_recording_starts_nothing(
    bench: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = bench(commands=True)
    assert await made.write(LFR, 300) == 0
    begin = StartedMotors.begin

    async def slow(*args: Any) -> bool:
        made.client.left = True
        return await begin(*args)

    monkeypatch.setattr(StartedMotors, "begin", slow)
    assert await made.write(CMD, 0x000F) == 6
    assert made.written() == [(LFR, 300)]


async def test_requests_queued_during_a_suspension_can_only_stop(bench: Make) -> None:
    """A client that has given up long ago would have its motor started."""
    made = bench(commands=True, writes=allowed_codes("ACC"))

    async def late(address: int, word: int) -> bytes:
        pdu = struct.pack(">BHH", 6, address, word)
        return await made.gateway.answer(TcpRequest(made.client, 1, pdu, stale=True))

    for address, word in ((LFR, 300), (CMD, 0x000F), (ACC, 57)):
        assert await late(address, word) == bytes([0x86, 6])
    assert made.written() == []
    assert (await late(CMD, 0x0007))[0] == 6


async def test_second_client_that_commands_the_drive_is_reported(bench: Make) -> None:
    made = bench(commands=True)
    output: list[str] = []
    on_event(made.line.facts, NoticeReceived, lambda event: output.append(event.text))
    assert await made.write(LFR, 300) == 0
    assert await made.write(LFR, 310) == 0
    assert output == []
    made.client = TcpClient(2, "10.0.0.10:5000")
    assert await made.write(LFR, 320) == 0
    (text,) = output
    assert "10.0.0.10:5000 now commands this drive, instead of 10.0.0.9:5000" in text


async def test_repeated_run_word_does_not_undo_a_stop_of_another_client(
    bench: Make,
) -> None:
    made = bench(commands=True)
    controller, operator = made.client, TcpClient(2, "10.0.0.10:5000")
    assert await made.write(LFR, 300) == 0
    made.client = operator
    assert await made.write(LFR, 310) == 0
    made.client = controller
    assert await made.write(LFR, 300) == 0
    made.client = operator
    assert await made.write(CMD, 0x0007) == 0
    sent = len(made.written())
    made.client = controller
    assert await made.write(CMD, 0x000F) == 6
    assert len(made.written()) == sent
    made.client = operator
    assert await made.write(LFR, 100) == 0
    made.client = TcpClient(3, "10.0.0.9:5001")  # a client that reconnects for each request
    assert await made.write(LFR, 110) == 0
    made.client = controller
    assert await made.write(CMD, 0x0007) == 0  # it has seen the stop
    assert await made.write(LFR, 120) == 0


@pytest.mark.sweep
async def test_drive_without_a_profile_is_only_read(bench: Make) -> None:
    leroy = DriveSpec("powerdrive", 1)
    made = bench(leroy, writes=allowed_codes("all"), commands=True)
    assert isinstance(await made.read(library.load("powerdrive")["10.40"].address), tuple)
    assert await made.write(641, 3) == 1
    assert await made.write(641, 1) == 1  # stops it in one state, and enables it in another
    assert made.written() == []


async def test_unidentified_drive_accepts_the_stop_word_of_all_candidates(bench: Make) -> None:
    made = bench(DriveSpec("powerdrive", 1))
    assert await made.write(641, 0) == 0
    assert made.written() == [(641, 0)]
    assert await made.write(641, 3) == 1
    assert made.written() == [(641, 0)]


async def test_named_profile_lets_its_stop_word_pass(bench: Make) -> None:
    made = bench(DriveSpec("powerdrive", 1), profiles={1: "powerdrive"})
    assert await made.write(641, 3) == 1
    assert await made.write(641, 0) == 0
    assert made.written() == [(641, 0)]


async def test_contradicted_profile_writes_nothing(bench: Make) -> None:
    made = bench(writes=allowed_codes("all"), commands=True, profiles={1: "atv31"})
    assert await made.write(ACC, 57) == 1
    assert made.written() == []


async def test_recent_value_is_not_read_again(bench: Make) -> None:
    made = bench(fresh=30.0)
    first = await made.read(ETA, 2)
    count = len(made.line.trace)
    assert await made.read(ETA, 2) == first
    assert await made.read(ETA + 1, 1) == first[1:]  # type: ignore[index]
    # besides these only identification is sent
    assert not [frame for frame in made.line.trace[count:] if frame.data[1] == 3]


async def test_identification_passes_and_unknown_functions_are_refused(bench: Make) -> None:
    made = bench(writes=allowed_codes("all"))
    answer = await made.ask(bytes.fromhex("2B0E0100"))
    assert answer[:2] == b"\x2b\x0e"
    assert b"ATV71" in answer
    for pdu in ("0100000001", "0200000001", "050000FF00", "0F000000010101", "1600000001"):
        request = bytes.fromhex(pdu)
        assert await made.ask(request) == bytes([request[0] | 0x80, 1])
    assert await made.ask(bytes([17, 0, 0, 0, 1])) == bytes([17 | 0x80, 1])
    assert made.written() == []


# Ids and codes


def test_unit_ids_cover_several_lines() -> None:
    units = unit_map(2, ["1-31=1", "101-131=2@1", "200=2@40"])
    assert units[1] == (0, 1)
    assert units[31] == (0, 31)
    assert units[101] == (1, 1)
    assert units[131] == (1, 31)
    assert units[200] == (1, 40)
    assert 32 not in units
    assert unit_map(1, ())[247] == (0, 247)


@pytest.mark.parametrize(
    ("lines", "texts"),
    [
        (2, []),
        (1, ["1=2"]),
        (1, ["5-4=1"]),
        (1, ["1-3=1", "3=1@9"]),
        (1, ["1-300=1"]),
        (1, ["240-250=1@240"]),
        (1, ["one=1"]),
    ],
)
def test_invalid_unit_ids_are_refused(lines: int, texts: list[str]) -> None:
    with pytest.raises(RulesError):
        unit_map(lines, texts)
    with pytest.raises(RulesError):
        allowed_codes(" , ")


async def test_broadcast_is_not_forwarded(bench: Make) -> None:
    made = bench(writes=allowed_codes("all"), commands=True)
    assert await made.read(ETA, unit=1) != 10
    before = len(made.line.trace)
    for word in (0, 7, 15):
        assert await made.write(CMD, word, unit=0) == 10
    assert await made.read(ETA, unit=0) == 10
    assert len(made.line.trace) == before


async def test_heartbeat_follows_the_commanding_client(start: Start, journal: Journal) -> None:
    simulation, line = start(DriveSpec("atv71", 1, sets={"CHCF": 1}))
    gate = GatewayLine(line, journal)
    gateway = Gateway([gate], unit_map(1, ()), GatewayRules(commands=True))
    made = Bench(simulation, line, gateway, journal, TcpClient(1, "10.0.0.9:5000"))
    assert gate.sign(1) is None
    for word in (6, 7, 15):
        assert await made.write(CMD, word) == 0
    started = gate.sign(1)
    assert started is not None
    await made.gateway.answer(
        TcpRequest(TcpClient(2, "10.0.0.8:1"), 1, struct.pack(">BHH", 3, ETA, 1))
    )
    assert gate.sign(1) == started
    await made.read(ETA)
    seen = gate.sign(1)
    assert seen is not None
    assert seen > started
    await gateway.close()


async def test_unproved_profile_passes_reads_and_stops_only(bench: Make) -> None:
    made = bench(DriveSpec("ms300", 1), profiles={1: "ms300"}, commands=True)
    assert await made.read(0x2103) == (0,)
    assert await made.write(0x2000, 0x12) == 1
    assert await made.write(0x2001, 3000) == 1
    assert await made.write(0x2000, 0x01) == 0
    assert made.written() == [(0x2000, 0x01)]
