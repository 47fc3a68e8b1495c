"""Gateways that take one connection only: a frozen owner holds it, and no stop gets past."""

from __future__ import annotations

import asyncio
import socket
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path

import pytest

from tui.bus.api import LineStatus, Priority
from tui.bus.errors import LineError, LineLost, NoAnswer
from tui.bus.line import Line
from tui.bus.link import TcpLink
from tui.bus.share.keeper_process import OTHER_CONTAINER

from .peer import Step, TcpPeer, eventually, honest_pdu, tcp_reply, tcp_request_length
from .sharing import SharedLines, frozen

STOP = 0


def answers(request: bytes, _count: int) -> Sequence[Step]:
    return [tcp_reply(request, honest_pdu(request[7:]))]


class Gateway(TcpPeer):
    """Serves one connection; others wait, are hung up on, or find nobody who listens."""

    def __init__(self, others: str) -> None:
        super().__init__(answers, length=tcp_request_length)
        self._others = others

    def _read(self) -> bytes | None:
        if self._client is not None and self._others == "hung up":
            self._listener.settimeout(0.0)
            with suppress(OSError):
                self._listener.accept()[0].close()
            self._listener.settimeout(0.05)
        if self._client is not None and self._others == "refused":
            self._listener.close()
        if self._client is None and self._others == "refused" and self._listener.fileno() < 0:
            self._listener = socket.create_server(("127.0.0.1", self.port))
            self._listener.settimeout(0.05)
        return super()._read()

    @property
    def written(self) -> list[int]:
        """The value of each single write."""
        return [one[11] for one in self.requests if one[7] == 6]


async def stop(line: Line) -> float:
    line.facts.give_stop([1], "the stop key")
    return await line.write(1, 1, [STOP], priority=Priority.STOP)


async def come(condition: Callable[[], bool]) -> None:
    await asyncio.to_thread(eventually, condition, 20.0)


@pytest.mark.parametrize("others", ["hung up", "refused"])
async def test_a_stop_fails_at_once_past_a_keeper_that_nobody_here_can_end(
    tmp_path: Path, others: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tui.bus.share.direct.GIVEN_UP", 1000.0)
    with Gateway(others) as gateway:
        lines = SharedLines(tmp_path, TcpLink("127.0.0.1", gateway.port))
        try:
            # this process is not the one that the lock file names, as in a container
            keeper, other = lines.open("keeper", pid=4711, wait=5.0), lines.open("panel")
            await other.read(1, 1)
            with frozen(keeper):
                with pytest.raises(LineLost, match="No stop gets past keeper") as caught:
                    await asyncio.wait_for(stop(other), 20)
                assert OTHER_CONTAINER in str(caught.value)
                await come(lambda: OTHER_CONTAINER in other.state.reason)
                assert gateway.written == []
        finally:
            lines.close()


@pytest.mark.parametrize("others", ["wait", "hung up", "refused"])
async def test_a_gateway_with_one_connection_is_told_of_with_what_to_do(
    tmp_path: Path, others: str
) -> None:
    with Gateway(others) as gateway:
        lines = SharedLines(tmp_path, TcpLink("127.0.0.1", gateway.port))
        try:
            owner, other = lines.open("run", pid=4711), lines.open("panel")
            await owner.read(1, 1)
            with frozen(owner):
                wrong = NoAnswer if others == "wait" else LineLost
                with pytest.raises(wrong):
                    await asyncio.wait_for(stop(other), 20)
                await come(lambda: "No stop gets past run (pid 4711)" in other.state.reason)
                assert other.state.status is LineStatus.LOST
                assert "takes one connection only is held by it" in other.state.reason
                assert "kill -9 4711" in other.state.reason
                assert gateway.written == []
            # the owner goes on: the stop goes its usual way, and the sentence goes
            await come(lambda: STOP in gateway.written)
            await come(lambda: other.state.status is LineStatus.CONNECTED)
            assert "No stop gets past" not in other.state.reason
            await other.read(1, 2, priority=Priority.OPERATOR_READ)
        finally:
            lines.close()
        assert lines.left_behind == []


async def test_once_the_frozen_owner_has_ended_the_stop_goes_out(tmp_path: Path) -> None:
    with Gateway("hung up") as gateway:
        lines = SharedLines(tmp_path, TcpLink("127.0.0.1", gateway.port))
        try:
            owner, other = lines.open("run", pid=4711), lines.open("panel")
            await owner.read(1, 1)
            with frozen(owner):
                with pytest.raises(LineError):
                    await asyncio.wait_for(stop(other), 20)
                closing = asyncio.create_task(asyncio.to_thread(owner.close))
            await closing
            await come(lambda: STOP in gateway.written)
            assert (await other.read(1, 2)).words == (2,)
        finally:
            lines.close()
        assert lines.left_behind == []


async def test_a_server_that_takes_several_connections_is_passed_as_ever(tmp_path: Path) -> None:
    class Several(Gateway):
        """Another connection takes the place of the one before."""

        def _read(self) -> bytes | None:
            self._listener.settimeout(0.0)
            with suppress(OSError):
                newer, _ = self._listener.accept()
                newer.settimeout(0.05)
                self.hang_up()
                self._client = newer
            self._listener.settimeout(0.05)
            return super()._read()

    with Several("wait") as gateway:
        lines = SharedLines(tmp_path, TcpLink("127.0.0.1", gateway.port))
        try:
            owner, other = lines.open("run", pid=4711), lines.open("panel")
            await owner.read(1, 1)
            with frozen(owner):
                await asyncio.wait_for(stop(other), 20)
                assert gateway.written == [STOP]
                assert "Stops go out past it" in other.state.reason
        finally:
            lines.close()
