"""Delay of a stop word of a Modbus TCP client to the wire, by the record of the drives."""

from __future__ import annotations

import asyncio
import struct
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import pytest
import pytest_asyncio

from benchmarks.wire import Recording
from tui.bus.api import Priority
from tui.bus.gateway.server import TcpRequest
from tui.bus.gateway.talk import TcpClient
from tui.bus.line import Line
from tui.bus.link import RtuTcpLink
from tui.bus.schedule import back_to_back
from tui.drive.profile import library
from tui.session.gateway.drives import CHART_READ_EACH
from tui.session.gateway.gateway import Gateway
from tui.session.gateway.line import GatewayLine, HostTurns
from tui.session.gateway.rules import GatewayRules, unit_map
from tui.session.journal import Journal
from tui.simulator import DriveSpec, Simulation
from tui.simulator.server.conversation import RtuConversation

ETA, CMD, ACC, CHCF = 3201, 8501, 9001, library.load("atv71")["CHCF"].address
STOP = struct.pack(">BHH", 6, CMD, 0x0007)


@dataclass(slots=True)
class Wire:
    """A gateway to a line whose drives record every exchange."""

    line: Line
    gateway: Gateway
    recording: Recording
    client: TcpClient

    async def ask(self, pdu: bytes) -> bytes:
        return await self.gateway.answer(TcpRequest(self.client, 1, pdu))

    async def read(self, address: int) -> None:
        assert (await self.ask(struct.pack(">BHH", 3, address, 1)))[0] == 3

    def requests(self) -> list[bytes]:
        """Function, address and word of each request that reached the drives."""
        return [exchange.request[1:6] for exchange in self.recording.exchanges]

    async def known(self) -> None:
        """A client has requested the drive, and it is identified."""
        chart = struct.pack(">BHH", 3, CHCF, 1)
        while chart not in self.requests():
            await self.read(ETA)
            await asyncio.sleep(0.01)


@pytest.fixture
def simulation() -> Iterator[tuple[Simulation, Recording]]:
    with Simulation([DriveSpec("atv71", 1, sets={"CHCF": 1})]) as made:
        recording = Recording(RtuConversation(made.line, made.faults))
        made._rtu_unseen = lambda: recording  # type: ignore[method-assign]
        yield made, recording


@pytest_asyncio.fixture
async def wire(simulation: tuple[Simulation, Recording], journal: Journal) -> AsyncIterator[Wire]:
    made, recording = simulation
    line = Line(RtuTcpLink(*made.serve_rtu_tcp()))
    line.open(wait=5.0)
    rules = GatewayRules(writes=frozenset({"ACC"}))
    gateway = Gateway([GatewayLine(line, journal)], unit_map(1, ()), rules)
    yield Wire(line, gateway, recording, TcpClient(1, "10.0.0.9:5000"))
    await gateway.close()
    line.close()


async def test_stop_of_a_polling_client_is_sent_next(wire: Wire) -> None:
    await wire.known()
    before = len(wire.requests())
    assert await wire.ask(STOP) == STOP
    assert wire.requests()[before:] == [STOP]


async def test_stop_overtakes_waiting_reads(wire: Wire, monkeypatch: pytest.MonkeyPatch) -> None:
    """From the moment when the line has it: before, both threads share a busy computer."""
    write, given = wire.line.write, list[int]()

    async def noting(*words: Any, **how: Any) -> Any:
        given.append(len(wire.requests()))
        return await write(*words, **how)

    await wire.known()
    monkeypatch.setattr(wire.line, "write", noting)
    polls = [
        asyncio.create_task(wire.line.read(1, 3000 + number, priority=Priority.OPERATOR_READ))
        for number in range(50)
    ]
    await asyncio.sleep(0)
    begun = len(wire.requests())
    assert await wire.ask(STOP) == STOP
    requests, (before,) = wire.requests(), given
    assert STOP in requests[before : before + 2]
    assert [item for item in requests[begun:] if item[1] != 3000 >> 8] == [STOP]
    await asyncio.gather(*polls, return_exceptions=True)


async def test_read_of_a_client_overtakes_waiting_polls(wire: Wire) -> None:
    await wire.known()
    polls = [asyncio.create_task(wire.line.read(1, 3000 + number)) for number in range(50)]
    await asyncio.sleep(0)
    read, before = struct.pack(">BHH", 3, ACC, 1), len(wire.requests())
    assert (await wire.ask(read))[0] == 3
    assert read in wire.requests()[before : before + 2]
    await asyncio.gather(*polls, return_exceptions=True)


async def test_polls_wait_for_the_next_read_of_a_client(
    wire: Wire, monkeypatch: pytest.MonkeyPatch
) -> None:
    """However long a busy machine takes for its way."""
    monkeypatch.setattr(back_to_back, "LONGEST_PAUSE", 60.0)
    monkeypatch.setattr(back_to_back, "MARGIN", 1000.0)
    await wire.known()
    polls = [asyncio.create_task(wire.line.read(1, 3000 + number)) for number in range(50)]
    before = len(wire.requests())
    for _ in range(30):
        await asyncio.sleep(0.02)  # more than the silence between two frames
        await wire.read(ACC)
    polled = [request for request in wire.requests()[before:] if request[1] == 3000 >> 8]
    assert len(polled) < 20
    for poll in polls:
        poll.cancel()


async def test_stop_after_write_is_preceded_by_one_read(wire: Wire) -> None:
    """It may have changed the effect of the word."""
    await wire.known()
    assert (await wire.ask(struct.pack(">BHH", 6, ACC, 57)))[0] == 6
    before = len(wire.requests())
    assert await wire.ask(STOP) == STOP
    assert wire.requests()[before:] == [struct.pack(">BHH", 3, CHCF, 1), STOP]


async def test_stop_word_is_checked_after_write_of_another_program(wire: Wire) -> None:
    await wire.known()
    await wire.line.write(1, CHCF, [3])
    assert await wire.ask(STOP) == b"\x86\x01"
    assert STOP not in wire.requests(), "it runs the motor in this profile"


async def test_chart_is_read_only_occasionally(wire: Wire) -> None:
    await wire.known()
    chart = struct.pack(">BHH", 3, CHCF, 1)
    begun, count = asyncio.get_running_loop().time(), wire.requests().count(chart)
    for _ in range(30):
        await wire.read(ETA)
    span = asyncio.get_running_loop().time() - begun
    assert wire.requests().count(chart) - count <= 1 + span / CHART_READ_EACH


async def test_stops_of_one_host_do_not_delay_another_host(wire: Wire) -> None:
    await wire.known()
    wire.client.host = "10.0.0.9"
    other = TcpClient(2, "10.0.0.8:5000", "10.0.0.8")
    words = [struct.pack(">BHHHHBH", 23, ETA, count, CMD, 1, 2, 0x0007) for count in range(1, 50)]
    flood = [asyncio.create_task(wire.ask(word)) for word in words]
    await asyncio.sleep(0)
    before = len(wire.requests())
    answer = await wire.gateway.answer(TcpRequest(other, 1, STOP))
    assert answer == STOP
    assert STOP in wire.requests()[before : before + 4]
    await asyncio.gather(*flood)


async def test_stop_does_not_wait_for_the_read_of_another_stop() -> None:
    """Each is sent as soon as its own read is answered."""
    turns = HostTurns()
    order: list[tuple[str, int]] = []
    held = asyncio.Event()

    async def read(device: int) -> None:
        await held.wait()
        order.append(("read", device))

    async def send(device: int) -> None:
        order.append(("stop", device))

    async def stop(device: int) -> None:
        await turns.deciding("10.0.0.9", device, partial(read, device))
        await turns.stopping("10.0.0.9", device, partial(send, device))

    stops = [asyncio.create_task(stop(device)) for device in range(1, 9)]
    await asyncio.sleep(0)
    async with asyncio.timeout(30):
        await turns.stopping("10.0.0.9", 9, partial(send, 9))
    held.set()
    await asyncio.gather(*stops)
    pairs = [(what, device) for device in range(1, 9) for what in ("read", "stop")]
    assert order == [("stop", 9), *pairs]


async def test_flood_of_other_words_leaves_time_for_polls_and_stops(wire: Wire) -> None:
    """Reads for each of them precede polls only as long as few were in vain."""
    await wire.known()
    wire.client.host = "10.0.0.9"
    halt = struct.pack(">BHH", 6, CMD, 0x010F)  # stops in some states only, not in the current one

    async def flood() -> None:
        while True:
            assert (await wire.ask(halt))[0] & 0x80

    task = asyncio.create_task(flood())
    try:
        async with asyncio.timeout(30):
            for _ in range(20):
                await wire.line.read(1, ACC)
            other, before = TcpClient(2, "10.0.0.8:5000", "10.0.0.8"), len(wire.requests())
            assert await wire.gateway.answer(TcpRequest(other, 1, STOP)) == STOP
            assert STOP in wire.requests()[before : before + 4]
    finally:
        task.cancel()
    assert halt not in wire.requests()


async def test_equal_waiting_stops_are_sent_once(wire: Wire) -> None:
    await wire.known()
    before = len(wire.requests())
    answers = await asyncio.gather(*(wire.ask(STOP) for _ in range(50)))
    assert answers == [STOP] * 50
    assert wire.requests()[before:].count(STOP) <= 3


async def test_reads_of_one_host_do_not_delay_another_host(wire: Wire) -> None:
    await wire.known()
    wire.client.host = "10.0.0.9"
    other = TcpClient(2, "10.0.0.8:5000", "10.0.0.8")
    flood = [asyncio.create_task(wire.read(ETA)) for _ in range(100)]
    await asyncio.sleep(0)
    read, before = struct.pack(">BHH", 3, ACC, 1), len(wire.requests())
    assert (await wire.gateway.answer(TcpRequest(other, 1, read)))[0] == 3
    assert read in wire.requests()[before : before + 12]
    await asyncio.gather(*flood)
