"""A line that is missing, lost, recovered, or used by another program."""

from __future__ import annotations

import asyncio
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest
import serial
from pymodbus.client import AsyncModbusSerialClient

from tests.line_events import on_event
from tui.bus.api import LineState, LineStatus, Priority
from tui.bus.errors import LineBehind, LineClosed, LineFailed, LineLost, PortBusy, PortMissing
from tui.bus.line import Line, Timing
from tui.bus.line_events import StateChanged
from tui.bus.link import RtuTcpLink, SerialLink, TcpLink
from tui.bus.schedule import connection as connections

from .conftest import OpenLine
from .peer import PtyPeer, TcpPeer, eventually, honest, silent
from .plain import outcome, plain_serial

QUICK = Timing(first_timeout=20.0, min_timeout=20.0, reconnect_first=0.1, reconnect_longest=0.3)


async def test_plain_client_gives_up_on_a_missing_port(tmp_path: Path) -> None:
    port = tmp_path / "port"
    client = AsyncModbusSerialClient(str(port), reconnect_delay=0.1)
    assert not await client.connect()
    with PtyPeer(honest, link=port):
        await asyncio.sleep(0.6)
        assert not client.connected
    client.close()


async def test_line_connects_when_the_port_appears(tmp_path: Path, open_line: OpenLine) -> None:
    port = tmp_path / "port"
    line = open_line(str(port), QUICK, wait=None)
    await asyncio.to_thread(eventually, lambda: line.state.status is LineStatus.LOST)
    assert "does not exist" in line.state.reason
    assert line.state.next_try is not None
    with pytest.raises(LineLost, match="does not exist"):
        await line.read(1, 5)
    with PtyPeer(honest, link=port):
        await asyncio.to_thread(eventually, lambda: line.state.status is LineStatus.CONNECTED)
        assert (await line.read(1, 5)).words == (5,)


def test_lost_line_is_retried_soon_then_less_often(tmp_path: Path, open_line: OpenLine) -> None:
    timing = replace(QUICK, reconnect_first=0.01, reconnect_longest=0.05)
    line = open_line(str(tmp_path / "port"), timing, wait=None)
    pauses: list[float] = []

    def hear(event: StateChanged) -> None:
        if event.state.next_try is not None:
            pauses.append(event.state.next_try - time.monotonic())

    on_event(line.facts, StateChanged, hear)
    eventually(lambda: len(pauses) >= 5)
    assert max(pauses) <= 0.05
    assert any(pause > 0.02 for pause in pauses), pauses


async def test_request_made_while_connecting_is_sent(open_line: OpenLine) -> None:
    with PtyPeer(honest) as peer:
        line = open_line(peer.path, wait=None)
        assert (await line.read(1, 5)).words == (5,)


async def test_plain_client_waits_for_its_timeout_after_an_unplug() -> None:
    with PtyPeer(silent) as peer:
        async with plain_serial(peer.path, timeout=1.0) as client:
            reading = asyncio.create_task(
                outcome(client.read_holding_registers(1, count=1, device_id=1))
            )
            await asyncio.to_thread(peer.await_requests, 1)
            begun = time.monotonic()
            peer.unplug()
            assert await reading is None
            assert time.monotonic() - begun > 0.5


async def test_unplug_fails_all_requests_and_replug_reconnects(
    tmp_path: Path, open_line: OpenLine
) -> None:
    port = tmp_path / "port"
    seen: list[LineState] = []
    with PtyPeer(silent, link=port) as peer:
        line = open_line(str(port), QUICK)
        unsubscribe = on_event(line.facts, StateChanged, lambda event: seen.append(event.state))
        requests = [
            asyncio.create_task(line.read(1, n, priority=Priority.OPERATOR_READ)) for n in range(3)
        ]
        await asyncio.to_thread(peer.await_requests, 1)
        peer.unplug()
        async with asyncio.timeout(10.0):
            for result in await asyncio.gather(*requests, return_exceptions=True):
                assert isinstance(result, LineLost)
    with PtyPeer(honest, link=port):
        await asyncio.to_thread(eventually, lambda: line.state.status is LineStatus.CONNECTED)
        # another form than before, whose reply may still arrive
        assert (await line.read(1, 5, 2)).words == (5, 6)
    assert seen[0].status is LineStatus.LOST
    assert LineStatus.CONNECTED in [state.status for state in seen]
    unsubscribe()
    count = len(seen)
    line.close()
    assert len(seen) == count


@pytest.mark.parametrize("kind", [TcpLink, RtuTcpLink])
async def test_line_reconnects_to_a_server_that_hangs_up(
    kind: type[TcpLink] | type[RtuTcpLink], open_line: OpenLine
) -> None:
    from .peer import request_length, tcp_reply, tcp_request_length

    tcp = kind is TcpLink
    with TcpPeer(silent, length=tcp_request_length if tcp else request_length) as peer:
        line = open_line(kind("127.0.0.1", peer.port), QUICK)
        reading = asyncio.create_task(line.read(1, 5))
        await asyncio.to_thread(peer.await_requests, 1)
        peer.hang_up()
        async with asyncio.timeout(10.0):
            with pytest.raises(LineLost):
                await reading
        peer.script = (lambda request, _: [tcp_reply(request)]) if tcp else honest
        await asyncio.to_thread(eventually, lambda: line.state.status is LineStatus.CONNECTED)
        assert (await line.read(1, 5, 2)).words == (5, 6)


def test_open_with_wait_raises_the_error(tmp_path: Path) -> None:
    line = Line(SerialLink(str(tmp_path / "none")))
    with pytest.raises(PortMissing, match="does not exist"):
        line.open(wait=5.0)
    assert line.state.status is LineStatus.CLOSED
    with TcpPeer(honest) as peer:
        port = peer.port
    line = Line(TcpLink("127.0.0.1", port))
    with pytest.raises(LineLost, match="no program listens on that port"):
        line.open(wait=0.3)


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="needs /proc")
def test_busy_port_names_its_holder() -> None:
    script = (
        "import serial, sys; port = serial.Serial(sys.argv[1], exclusive=True);"
        "print('open', flush=True); sys.stdin.read()"
    )
    with PtyPeer(honest) as peer:
        other = subprocess.Popen(
            [sys.executable, "-c", script, peer.path],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        assert other.stdout is not None
        assert other.stdout.readline() == b"open\n"
        line = Line(SerialLink(peer.path))
        with pytest.raises(PortBusy, match=f"pid {other.pid}") as caught:
            line.open(wait=5.0)
        other.communicate()
        assert caught.value.holder is not None
        line = Line(SerialLink(peer.path))
        line.open(wait=5.0)
        with pytest.raises(serial.SerialException):
            serial.Serial(peer.path, exclusive=True)
        line.close()
        serial.Serial(peer.path, exclusive=True).close()


async def test_pseudo_terminal_without_parity_is_reported(open_line: OpenLine) -> None:
    with PtyPeer(honest) as peer:
        line = open_line(SerialLink(peer.path, 19200, "8E1"))
        assert line.state.reason == "A pseudo-terminal has no parity: opened with N."
        assert (await line.read(1, 5)).words == (5,)
        plain = open_line_of(peer)
        assert plain.state.status is LineStatus.LOST
        plain.close()


def open_line_of(peer: PtyPeer) -> Line:
    """A second line on a port that is taken; it keeps trying."""
    line = Line(SerialLink(peer.path), timing=QUICK)
    line.open()
    eventually(lambda: line.state.status is LineStatus.LOST)
    return line


async def test_close_fails_pending_requests_and_is_final(open_line: OpenLine) -> None:
    with PtyPeer(silent) as peer:
        line = open_line(peer.path)
        requests = [asyncio.create_task(line.read(1, n)) for n in range(3)]
        await asyncio.to_thread(peer.await_requests, 1)
        await asyncio.to_thread(line.close)
        line.close()
        for result in await asyncio.gather(*requests, return_exceptions=True):
            assert isinstance(result, LineClosed)
        with pytest.raises(LineClosed):
            await line.read(1, 5)
        with pytest.raises(LineClosed):
            line.open()
        with pytest.raises(LineClosed):
            line.spawn(asyncio.Event().wait, "nothing")
        assert line.state.status is LineStatus.CLOSED


def test_close_before_open_is_allowed() -> None:
    Line(SerialLink("/dev/null")).close()


async def test_idle_and_lost_lines_do_not_spin(tmp_path: Path, open_line: OpenLine) -> None:
    with PtyPeer(honest) as peer:
        idle = open_line(peer.path)
        await idle.read(1, 5)
        lost = open_line(str(tmp_path / "none"), wait=None)
        await asyncio.to_thread(eventually, lambda: lost.state.status is LineStatus.LOST)
        before = time.process_time()
        await asyncio.sleep(1.0)
        # the peer polls twenty times a second; a spinning thread would take the whole second
        assert time.process_time() - before < 0.5


# -- the life of a line, step by step --------------------------------------------------------------


class Life:
    """A connection of a line whose parts are the test's; `done` is what it did, and when."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *, shared: bool = False) -> None:
        self.now = 100.0
        self.done: list[object] = []
        self.states: list[tuple[LineStatus, str, float, float | None]] = []
        self.errors: list[type[Exception] | None] = []
        self.serves: list[Exception | None] = []
        self.steps = SimpleNamespace(recovered=None, behind="")
        self.dispatcher = SimpleNamespace(
            steps=self.steps, facts=SimpleNamespace(unkept=""), wake=None, in_flight=True,
            fail_all=self._fail_all, serve=self._serve,
        )  # fmt: skip
        timing = Timing(reconnect_first=0.5, reconnect_longest=5.0)
        around = SimpleNamespace(timing=timing, clock=lambda: self.now)
        self.last_way = SimpleNamespace(master=None, lose=lambda: self.done.append("lose"))
        self.shared: Any = None
        if shared:
            self.shared = SimpleNamespace(
                own=self._own, pause=self._sleep, unwanted=asyncio.Future,
                rest=lambda quiet: self.done.append(("rest", quiet)),
            )  # fmt: skip
        self.connection = connections.Connection(
            cast(Any, "link"), cast(Any, around), cast(Any, self.dispatcher), self._changed,
            lambda: 0.25, self.shared, cast(Any, self.last_way),
        )  # fmt: skip
        monkeypatch.setattr(connections, "open_master", self._open)
        if not shared:
            monkeypatch.setattr(connections, "asyncio", SimpleNamespace(sleep=self._sleep))

    def _changed(self, state: Any, error: Exception | None) -> None:
        self.states.append((state.status, state.reason, state.since, state.next_try))
        self.errors.append(None if error is None else type(error))

    async def _open(self, link: object, around: object, wake: object, opened: Any) -> Any:
        opened("a remark")
        return SimpleNamespace(close=lambda: self.done.append("close"))

    async def _own(self, say: Any) -> None:
        self.done.append("own")

    async def _serve(self, master: object) -> None:
        if self.shared is None:
            assert self.last_way.master is master
        self.done.append("serve")
        if not self.serves:
            raise asyncio.CancelledError
        if (error := self.serves.pop(0)) is not None:
            raise error

    def _fail_all(self, text: str, kind: type[Exception]) -> None:
        self.done.append((text, kind))

    async def _sleep(self, seconds: float) -> None:
        self.done.append(seconds)
        self.now += seconds

    async def run(self) -> None:
        with pytest.raises(asyncio.CancelledError):
            await self.connection.run()


async def test_connection_that_ends_is_opened_again_immediately(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    life = Life(monkeypatch)
    life.serves = [None]
    await life.run()
    assert life.done == ["serve", "lose", "close"] * 2
    assert [state[0] for state in life.states] == [
        LineStatus.CONNECTING, LineStatus.CONNECTED, LineStatus.CONNECTING, LineStatus.CONNECTED,
    ]  # fmt: skip
    assert life.states[1] == (LineStatus.CONNECTED, "a remark", 100.0, None)
    assert life.dispatcher.in_flight, "only a shared line is left"


async def test_lost_line_fails_its_requests_and_waits_longer_each_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    life = Life(monkeypatch)

    async def fails(*_: object) -> Any:
        if life.now > 110.0:
            raise asyncio.CancelledError
        raise LineLost("unplugged")

    monkeypatch.setattr(connections, "open_master", fails)
    await life.run()
    lost = ("unplugged", LineLost)
    assert life.done == [lost, 0.5, lost, 1.0, lost, 2.0, lost, 4.0, lost, 5.0]
    assert life.states[1:3] == [
        (LineStatus.LOST, "unplugged", 100.0, 100.5), (LineStatus.LOST, "unplugged", 100.0, 101.5),
    ]  # fmt: skip
    assert isinstance(life.connection.refusal, LineLost)


async def test_line_that_was_opened_again_begins_with_the_shortest_pause(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    life = Life(monkeypatch)
    life.serves = [LineLost("a"), LineLost("b")]
    await life.run()
    assert [pause for pause in life.done if isinstance(pause, float)] == [0.5, 0.5]
    lost = [state for state in life.states if state[0] is LineStatus.LOST]
    assert [state[2] for state in lost] == [100.0, 100.5], "since it was lost the last time"
    assert life.connection.refusal is None


@pytest.mark.internal_errors
async def test_internal_error_of_the_loop_is_a_failure_of_the_line(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    life = Life(monkeypatch)
    life.serves = [ZeroDivisionError("on purpose")]
    await life.run()
    text = "The line failed: ZeroDivisionError('on purpose')."
    assert (text, LineFailed) in life.done
    assert LineFailed in life.errors
    assert "the line's loop failed" in caplog.text


@pytest.mark.internal_errors
async def test_error_in_failing_requests_does_not_end_the_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    life = Life(monkeypatch)
    life.serves = [LineLost("a")]
    life.dispatcher.fail_all = lambda *_: 1 / 0
    await life.run()
    assert life.done.count("serve") == 2


async def test_line_that_is_behind_is_reported_and_opened_again_without_a_pause(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    life = Life(monkeypatch)
    life.serves = [LineBehind("behind"), LineLost("refused"), LineLost("refused")]
    life.steps.behind = "Replies are one behind."
    await life.run()
    assert life.done[:4] == ["serve", "lose", "close", "serve"]
    pauses = [pause for pause in life.done if isinstance(pause, float)]
    assert pauses == [0.5, 0.5], "it is opened again soon each time"
    assert set(life.errors[1:]) <= {LineBehind, None}
    assert (LineStatus.LOST, "Replies are one behind.") in [state[:2] for state in life.states]
    assert LineStatus.CONNECTED not in [state[0] for state in life.states]


async def test_shared_line_rests_after_its_last_request(monkeypatch: pytest.MonkeyPatch) -> None:
    life = Life(monkeypatch, shared=True)
    life.serves = [LineLost("a")]
    with pytest.raises(LineLost):
        await life.connection._once()
    assert life.done == ["own", "serve", "lose", "close", ("rest", 0.25)]
    assert not life.dispatcher.in_flight
