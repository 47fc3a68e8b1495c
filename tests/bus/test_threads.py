"""One line used by many threads and loops at the same time."""

from __future__ import annotations

import asyncio
import logging
import random
import signal
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.api import LineStatus, Priority
from tui.bus.errors import LineClosed, LineError
from tui.bus.line import Line
from tui.bus.link import SerialLink
from tui.bus.schedule.engine import Engine
from tui.bus.transport.ports import is_pseudo_terminal, list_ports

from .conftest import WIDE, OpenLine
from .peer import PtyPeer, eventually, honest, silent


def test_many_threads_get_their_own_replies(open_line: OpenLine) -> None:
    wrong: list[tuple[int, tuple[int, ...]]] = []

    def ask(line: Line, seed: int) -> None:
        chance = random.Random(seed)

        async def work() -> None:
            for _ in range(30):
                address, count = chance.randrange(60000), chance.randrange(1, 6)
                got = await line.read(1, address, count, priority=chance.choice(list(Priority)))
                if got.words != tuple(range(address, address + count)):
                    wrong.append((address, got.words))

        asyncio.run(work())

    with PtyPeer(honest) as peer:
        line = open_line(SerialLink(peer.path, 115200))
        threads = [threading.Thread(target=ask, args=(line, seed)) for seed in range(6)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert wrong == []
        assert line.counters.replies == 180


def test_cancelling_at_any_moment_does_not_shift_replies(open_line: OpenLine) -> None:
    chance = random.Random(1)

    async def work(line: Line) -> int:
        answered = 0
        for address in range(120):
            task = asyncio.create_task(line.read(1, address))
            await asyncio.sleep(chance.random() * 0.006)
            task.cancel()
            try:
                got = await task
            except asyncio.CancelledError:
                continue
            assert got.words == (address,)
            answered += 1
        assert (await line.read(1, 999)).words == (999,)
        return answered

    with PtyPeer(honest) as peer:
        line = open_line(SerialLink(peer.path, 115200))
        asyncio.run(work(line))


def test_threads_of_a_line_take_no_signal(open_line: OpenLine) -> None:
    """Only the main thread runs handlers: in a script it may sleep while its motor runs."""
    blocked: list[set[int]] = []

    def look() -> None:
        blocked.append(set(signal.pthread_sigmask(signal.SIG_BLOCK, ())))

    async def work() -> None:
        look()
        await asyncio.to_thread(look)

    with PtyPeer(honest) as peer:
        line = open_line(SerialLink(peer.path, 115200))
        line.spawn(work, "a look")
        eventually(lambda: len(blocked) == 2)
    assert all({signal.SIGTERM, signal.SIGINT, signal.SIGHUP} <= found for found in blocked)


def test_closing_at_any_moment_ends_all_requests() -> None:
    async def ask(line: Line) -> None:
        while True:
            await line.read(1, 5)

    def run(line: Line, ended: list[BaseException]) -> None:
        try:
            asyncio.run(ask(line))
        except LineError as error:
            ended.append(error)

    with PtyPeer(honest) as peer:
        for turn in range(10):
            ended: list[BaseException] = []
            line = Line(SerialLink(peer.path, 115200))
            line.describe(1, WIDE)
            line.open(wait=5.0)
            threads = [threading.Thread(target=run, args=(line, ended)) for _ in range(4)]
            for thread in threads:
                thread.start()
            threading.Event().wait(0.004 * turn)
            line.close()
            for thread in threads:
                thread.join(10.0)
            assert [type(error) for error in ended] == [LineClosed] * 4


def test_caller_that_ends_leaves_nothing_behind(
    open_line: OpenLine, caplog: pytest.LogCaptureFixture
) -> None:
    async def leave(line: Line) -> None:
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.05):
                await line.read(1, 5)

    with PtyPeer(lambda request, _: [0.2, *honest(request, 0)]) as peer:
        line = open_line(peer.path)
        asyncio.run(leave(line))
        eventually(lambda: line.counters.replies == 1)
    assert not [record for record in caplog.records if record.levelno >= logging.WARNING]


def test_worker_runs_while_the_loop_of_the_caller_hangs(open_line: OpenLine) -> None:
    seen: list[int] = []

    with PtyPeer(honest) as peer:
        line = open_line(peer.path)

        async def poll() -> None:
            while True:
                seen.extend((await line.read(1, 5)).words)

        worker = line.spawn(poll, "poll")

        async def frozen() -> None:
            # the whole loop hangs, like that of a screen at a stalled terminal
            eventually(lambda: len(seen) > 5)

        asyncio.run(frozen())
        assert not worker.done()
        worker.cancel()
        worker.cancel()
        assert worker.wait(10.0)
        assert worker.done()
        assert worker.error is None


@pytest.mark.internal_errors
def test_error_in_the_worker_is_reported(
    open_line: OpenLine, caplog: pytest.LogCaptureFixture
) -> None:
    async def fail() -> None:
        raise ValueError("on purpose")

    with PtyPeer(honest) as peer:
        line = open_line(peer.path)
        worker = line.spawn(fail, "doomed")
        assert worker.wait(10.0)
        assert isinstance(worker.error, ValueError)
        assert "doomed ended by an error" in caplog.text
        assert line.state.status is LineStatus.CONNECTED


def test_worker_may_close_its_own_line(open_line: OpenLine) -> None:
    with PtyPeer(silent) as peer:
        line = open_line(peer.path)

        async def close() -> None:
            line.close()

        worker = line.spawn(close, "closer")
        assert worker.wait(10.0)
        eventually(lambda: line.state.status is LineStatus.CLOSED)


@pytest.mark.internal_errors
def test_error_in_a_listener_does_no_harm(
    open_line: OpenLine, caplog: pytest.LogCaptureFixture
) -> None:
    def listen(_event: object) -> None:
        raise ValueError("on purpose")

    with PtyPeer(honest) as peer:
        line = Line(SerialLink(peer.path))
        line.facts.events.subscribe(listen)
        line.open(wait=5.0)
        assert asyncio.run(line.read(1, 5)).words == (5,)
        line.close()
    assert "listener" in caplog.text


def test_protocol_library_logs_nothing(
    open_line: OpenLine, capfd: pytest.CaptureFixture[str]
) -> None:
    with PtyPeer(lambda _request, _count: [b"\x01\x2b\x0e\x01\x02"]) as peer:
        line = open_line(peer.path)
        with pytest.raises(LineError):
            asyncio.run(line.identify(1))
    assert capfd.readouterr() == ("", "")


def test_ports_are_listed_in_order(tmp_path: Path) -> None:
    with PtyPeer(honest) as peer:
        assert is_pseudo_terminal(peer.path)
    assert not is_pseudo_terminal(str(tmp_path))
    assert not is_pseudo_terminal(str(tmp_path / "none"))
    assert [port.path for port in list_ports()] == sorted(port.path for port in list_ports())


def test_ports_are_ordered_by_the_numbers_in_their_names(monkeypatch: pytest.MonkeyPatch) -> None:
    names = ("ttyUSB10", "ttyUSB2", "ttyS1", "COM10", "COM9", "ttyUSB")
    found = [SimpleNamespace(device=name, description="n/a") for name in names]
    found.append(SimpleNamespace(device="ttyUSB3", description="USB-RS485"))
    found.append(SimpleNamespace(device="ttyUSB4", description=None))
    monkeypatch.setattr("tui.bus.transport.ports.system_ports.comports", lambda: found)
    ports = {port.path: port.description for port in list_ports()}
    order = ["COM9", "COM10", "ttyS1", "ttyUSB", "ttyUSB2", "ttyUSB3", "ttyUSB4", "ttyUSB10"]
    assert list(ports) == order
    assert [path for path, text in ports.items() if text] == ["ttyUSB3"]
    assert ports["ttyUSB3"] == "USB-RS485"


@pytest.mark.parametrize(("accepting", "loop"), [(False, True), (True, False), (False, False)])
def test_line_that_is_closed_takes_no_work(accepting: bool, loop: bool) -> None:
    """Work that a loop which ends never begins would be waited for without an end."""
    engine = cast(Any, object.__new__(Engine))
    begun: list[object] = []
    engine._lock, engine._accepting = threading.Lock(), accepting
    engine._loop = SimpleNamespace(call_soon_threadsafe=lambda *work: begun.append(work))
    engine._loop = engine._loop if loop else None
    with pytest.raises(LineClosed):
        engine._enter(begun.append, "a request")
    assert begun == []


def test_line_whose_loop_has_ended_takes_no_work() -> None:
    engine = cast(Any, object.__new__(Engine))

    def ended(*_: object) -> None:
        raise RuntimeError("Event loop is closed")

    engine._lock, engine._accepting = threading.Lock(), True
    engine._last_way = engine._dispatcher = SimpleNamespace(put=print, wake=print)
    engine._loop = SimpleNamespace(call_soon_threadsafe=ended)
    engine._wake()
    with pytest.raises(LineClosed):
        engine._enter(print, "a request")
    with pytest.raises(LineClosed):
        engine.send_prepared([], print)
    engine._loop = None
    with pytest.raises(LineClosed):
        engine.send_prepared([], print)
    engine._wake()
