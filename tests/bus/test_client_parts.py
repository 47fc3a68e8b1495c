"""Parts of a client of a shared line: its welcome, what it hears and passes on, and its end."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import AsyncMock, Mock, call

import pytest

from tui.bus.errors import OWNER_SILENT, NotShared
from tui.bus.model import LineStatus
from tui.bus.program import Program
from tui.bus.share import client as clients
from tui.bus.share.client import STOOD_STILL, OwnerAway, ShareClient
from tui.bus.share.messages import Alive, NoMessage, StopGiven, TurnedAway, Welcome, packed

OWNER: Any = SimpleNamespace(program=SimpleNamespace(text="panel 7"), socket="/run/line")


class Bench:
    """A client of an owner, with messages that come, and an end of them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *messages: Any) -> None:
        self.messages = list(messages)
        self.it: Any = cast(Any, object.__new__(ShareClient))
        self.it._owner = OWNER
        self.it._inside = self.inside = Mock()
        self.inside.facts.me.id = "me"
        self.inside.clock.return_value = 7.0
        self.it._news, self.it._requested = Mock(note=""), Mock()
        self.it._polls, self.it._tell, self.it._hear_life = Mock(), Mock(), Mock()
        self.it._gone = self.it.taken_in = False
        monkeypatch.setattr(clients, "next_message", self._next)
        self.reported: list[object] = []
        monkeypatch.setattr(clients, "_report_own", lambda *of: self.reported.append(of))
        monkeypatch.setattr(clients, "_give_up_own", lambda *of: self.reported.append(of))
        monkeypatch.setattr(clients, "Heartbeat", lambda *of: of)

    async def _next(self, reader: object) -> Any:
        assert reader == "the reader"
        message = self.messages.pop(0)
        if isinstance(message, Exception):
            raise message
        return message


@pytest.mark.internal_errors
@pytest.mark.parametrize(
    ("end", "logged"),
    [
        (EOFError(), ""),
        (OSError(), ""),
        (NoMessage("odd"), "panel 7 sent a malformed message: odd"),
    ],
)
async def test_client_listens_until_its_owner_ends_or_is_not_understood(
    end: Exception, logged: str, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    bench = Bench(monkeypatch, "one", "two", end)
    bench.it._hear = Mock()
    await bench.it._listen("the reader")
    assert bench.it._hear.call_args_list == [call("one"), call("two")]
    assert bench.it._hear_life.call_args_list == [call("one"), call("two")]
    assert logged in caplog.text
    assert bool(caplog.text) == bool(logged)


@pytest.mark.parametrize("error", [EOFError(), OSError(), NoMessage("odd")])
async def test_owner_that_ends_before_its_welcome_is_away(
    error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(OwnerAway):
        await Bench(monkeypatch, error).it._welcomed("the reader")


async def test_client_that_is_turned_away_does_not_share(monkeypatch: pytest.MonkeyPatch) -> None:
    for message, why in (
        (TurnedAway("another version"), "another version"),
        (Alive(), "panel 7 owns the line and does not share it."),
    ):
        bench = Bench(monkeypatch, message)
        with pytest.raises(NotShared) as caught:
            await bench.it._welcomed("the reader")
        assert str(caught.value) == why
        bench.it._hear_life.assert_called_once_with(message)
        assert not bench.it.taken_in


@pytest.mark.parametrize("gone", [True, False])
@pytest.mark.parametrize("requested", [True, False])
async def test_welcomed_client_claims_its_drives_unless_it_counts_as_exited(
    gone: bool, requested: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    welcome = Mock(spec=Welcome, requested=requested, label="port at 9600", gone=gone)
    bench = Bench(monkeypatch, welcome)
    await bench.it._welcomed("the reader")
    assert bench.it._news.note == ("" if requested else "It is open as port at 9600.")
    assert (bench.it._gone, bench.it.taken_in) == (gone, True)
    assert bench.it._heartbeat == ("/run/line", "me")
    assert bench.inside.pace.carrier is bench.it._polls
    facts, void = bench.inside.facts, bench.inside.dispatcher.void_older
    own = (facts, bench.it._tell)
    assert bench.reported == ([(facts, STOOD_STILL), own] if gone else [own])
    assert void.call_args_list == ([call(7.0, STOOD_STILL)] if gone else [])


async def test_waiting_requests_are_passed_to_the_owner(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.inside.dispatcher.all_waiting = AsyncMock(
        side_effect=[["a", "b"], ["c"], asyncio.CancelledError()]
    )
    with pytest.raises(asyncio.CancelledError):
        await bench.it._forward()
    assert bench.it._requested.send.call_args_list == [call("a"), call("b"), call("c")]


async def test_several_works_end_with_the_first_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    bench = Bench(monkeypatch)
    bench.it._loop = asyncio.get_running_loop()
    before = len(asyncio.all_tasks())

    async def ends(error: Exception | None = None) -> None:
        if error is not None:
            raise error

    async with asyncio.timeout(5.0):
        await bench.it._until_one_ends(ends(), asyncio.Event().wait())
        with pytest.raises(OSError, match="odd"):
            await bench.it._until_one_ends(asyncio.Event().wait(), ends(OSError("odd")))
    assert len(asyncio.all_tasks()) == before


@pytest.mark.parametrize(
    ("writes", "frozen", "passes"),
    [(True, False, True), (True, True, False), (False, False, False)],
)
def test_finished_stop_is_passed_to_an_owner_that_answers(
    writes: bool, frozen: bool, passes: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(monkeypatch)
    bench.it.writer = writer = Mock() if writes else None
    bench.it.watching = Mock(frozen=frozen)
    assert bench.it.pass_on(b"stop") is passes
    assert bench.it.watching.note_stop.called == passes
    if writer is not None:
        assert writer.write.call_args_list == ([call(b"stop")] if passes else [])


@pytest.mark.parametrize("remedy", ["", "End it by its number."])
def test_requests_to_a_frozen_owner_fail_once_it_cannot_be_ended(
    remedy: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(monkeypatch)
    bench.it._reported, bench.it._say = "", Mock()
    bench.it.watching = Mock(remedy=remedy)
    bench.inside.dispatcher.take_all.return_value = ["a"]
    for _ in range(2):
        bench.it._wait_for_owner()
    text = f"panel 7 {OWNER_SILENT}. {remedy}".rstrip()
    bench.it._say.assert_called_once_with(LineStatus.LOST, text, None)
    assert bench.it._requested.send.call_args_list == [call("a")] * 2
    assert bench.it._polls.lose_all.call_count == 2
    assert bench.it._requested.fail_all.call_args_list == ([call(text)] * 2 if remedy else [])


@pytest.mark.parametrize(
    ("writer", "closing", "writes"),
    [(True, False, True), (True, True, False), (False, False, False)],
)
@pytest.mark.parametrize("stops", [True, False])
def test_message_is_written_and_a_stop_awaited_while_the_connection_is_open(
    writer: bool, closing: bool, writes: bool, stops: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = Bench(monkeypatch)
    del bench.it._tell
    bench.it.watching = Mock()
    bench.it.writer = to = Mock() if writer else None
    if to is not None:
        to.transport.is_closing.return_value = closing
    message = StopGiven((1,), (1,), "a key", Program("a", "run")) if stops else Alive()
    bench.it._tell(message)
    if to is not None:
        assert to.write.call_args_list == ([call(packed(message))] if writes else [])
    assert bench.it.watching.note_stop.called == (writes and stops)


@pytest.mark.internal_errors
def test_message_that_only_a_client_sends_is_logged(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    Bench(monkeypatch).it._hear(TurnedAway("odd"))
    assert caplog.messages == ["the owner says TurnedAway"]
