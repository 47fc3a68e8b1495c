"""Steps of a connection without a port: what it reports, how it is tried again, how it ends."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import AsyncMock, Mock, call

import pytest

from tui.bus.api import LineState, LineStatus
from tui.bus.errors import LineBehind, LineError, LineFailed, LineLost, PortMissing
from tui.bus.line import Timing
from tui.bus.link import SerialLink
from tui.bus.schedule import connection as connections
from tui.bus.schedule.connection import Connection

NOW = 1000.0
LINK = SerialLink("/dev/null")


class Rig:
    """A connection whose parts note their calls."""

    def __init__(self, *, shared: bool = True, last_way: bool = True) -> None:
        self.now = NOW
        self.states: list[tuple[LineState, LineError | None]] = []
        self.dispatcher = Mock(in_flight=True, facts=Mock(unkept=""))
        self.dispatcher.steps.behind = ""
        self.shared: Any = None
        if shared:
            self.shared = Mock(pause=AsyncMock(), own=AsyncMock(), unwanted=AsyncMock())
        self.last_way = Mock(master=None) if last_way else None
        timing = Timing(reconnect_first=1.0, reconnect_longest=3.0)
        self.around = cast(Any, SimpleNamespace(timing=timing, clock=lambda: self.now))
        self.it: Any = Connection(
            LINK, self.around, self.dispatcher, lambda *of: self.states.append(of), lambda: 7.0,
            self.shared, self.last_way,
        )  # fmt: skip

    @property
    def shown(self) -> list[tuple[LineStatus, str]]:
        return [(state.status, state.reason) for state, _ in self.states]

    async def run(self, *ends: BaseException | None) -> None:
        """Run with these ends of connections, then cancel it."""
        self.it._once = AsyncMock(side_effect=[*ends, asyncio.CancelledError()])
        with pytest.raises(asyncio.CancelledError):
            await self.it.run()


async def test_line_is_opened_again_after_each_error_with_longer_pauses() -> None:
    rig = Rig()
    errors = [LineLost("unplugged"), PortMissing("it is missing"), LineFailed("odd")]
    await rig.run(None, *errors)
    assert rig.shown == [
        (LineStatus.CONNECTING, ""), *((LineStatus.LOST, str(error)) for error in errors),
    ]  # fmt: skip
    assert [error for _, error in rig.states] == [None, *errors]
    assert rig.shared.pause.await_args_list == [call(1.0), call(2.0), call(3.0)]
    assert [state.next_try for state, _ in rig.states] == [None, NOW + 1, NOW + 2, NOW + 3]
    kinds = (LineLost, LineLost, LineFailed)
    expected = [call(str(error), kind) for error, kind in zip(errors, kinds, strict=True)]
    assert rig.dispatcher.fail_all.call_args_list == expected
    assert (rig.it.refusal, rig.it._failures) == (errors[-1], 3)


@pytest.mark.internal_errors
async def test_internal_error_does_not_end_the_line(caplog: pytest.LogCaptureFixture) -> None:
    rig = Rig()
    rig.dispatcher.fail_all.side_effect = ZeroDivisionError("worse")
    await rig.run(ZeroDivisionError("odd"))
    failed = "The line failed: ZeroDivisionError('odd')."
    assert rig.shown[-1] == (LineStatus.LOST, failed)
    assert type(rig.it.refusal) is LineFailed
    assert "the line's loop failed" in caplog.text
    assert "what waits for the line was not told that it is lost" in caplog.text
    rig.shared.pause.assert_awaited_once_with(1.0)


async def test_line_that_is_behind_is_opened_again_soon_and_fails_no_stop() -> None:
    rig = Rig()
    behind = LineBehind("one behind")
    await rig.run(behind)
    assert rig.shown[1:] == [(LineStatus.LOST, "one behind")]
    assert rig.states[-1][1] is behind
    rig.shared.pause.assert_not_awaited()
    rig.dispatcher.fail_all.assert_not_called()
    rig.dispatcher.steps.behind = "one behind"
    await rig.run(LineLost("unplugged"), LineLost("unplugged"), PortMissing("it is missing"))
    kinds = [type(error) for _, error in rig.states[-3:]]
    assert kinds == [LineBehind, LineBehind, PortMissing]
    assert [pause.args[0] for pause in rig.shared.pause.await_args_list] == [1.0, 1.0, 2.0]


async def test_line_that_is_not_shared_waits_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    rig, pauses = Rig(shared=False), []

    async def sleep(seconds: float) -> None:
        pauses.append(seconds)

    monkeypatch.setattr(connections, "asyncio", SimpleNamespace(sleep=sleep))
    await rig.run(LineLost("unplugged"))
    assert pauses == [1.0]


def test_line_is_lost_since_its_first_loss() -> None:
    rig = Rig()
    for status in (LineStatus.LOST, LineStatus.LOST, LineStatus.CONNECTING, LineStatus.LOST):
        rig.it._say(status)
        rig.now += 1.0
    assert [state.since for state, _ in rig.states] == [NOW, NOW, NOW + 2, NOW + 3]


@pytest.mark.parametrize("shared", [True, False])
@pytest.mark.parametrize("error", [None, LineLost("unplugged")])
async def test_connection_is_served_then_given_back_in_order(
    shared: bool, error: LineLost | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig = Rig(shared=shared, last_way=shared)
    master = Mock()
    opened: list[tuple[object, ...]] = []

    async def open_master(*of: object) -> object:
        opened.append(of)
        return master

    async def serve(of: object) -> None:
        assert of is master
        assert (rig.it.refusal, rig.it._failures) == (None, 0)
        assert rig.last_way is None or rig.last_way.master is master
        if error is not None:
            raise error

    monkeypatch.setattr(connections, "open_master", open_master)
    rig.it._serve = serve
    rig.it.refusal, rig.it._failures = LineLost("before"), 4
    if error is None:
        await rig.it._once()
        assert rig.shown == [(LineStatus.CONNECTING, "")]
    else:
        with pytest.raises(LineLost):
            await rig.it._once()
    assert opened == [(LINK, rig.around, rig.dispatcher.wake, rig.it._say_opened)]
    master.close.assert_called_once_with()
    assert rig.dispatcher.in_flight is not shared
    if shared:
        assert rig.last_way is not None
        rig.last_way.lose.assert_called_once_with()
        rig.shared.own.assert_awaited_once_with(rig.it._say_of_owner)
        rig.shared.rest.assert_called_once_with(7.0)


async def ends(seconds: float | None, error: Exception | None) -> None:
    """Work that ends with or without an error; None if it never ends."""
    await (asyncio.Event().wait() if seconds is None else asyncio.sleep(seconds))
    if error is not None:
        raise error


@pytest.mark.parametrize(
    ("serving", "unwanted", "error"),
    [
        ((0.0, LineLost("unplugged")), (None, None), LineLost),
        ((None, None), (0.0, None), None),
        ((None, None), (0.0, LineFailed("odd")), LineFailed),
    ],
)
async def test_shared_line_is_served_until_it_is_lost_or_unwanted(
    serving: Sequence[Any], unwanted: Sequence[Any], error: type[LineError] | None
) -> None:
    rig = Rig()
    masters: list[object] = []

    async def serve(master: object) -> None:
        masters.append(master)
        await ends(*serving)

    rig.dispatcher.serve = serve
    rig.shared.unwanted = lambda: ends(*unwanted)
    before = len(asyncio.all_tasks())
    async with asyncio.timeout(5.0):
        if error is None:
            await rig.it._serve("the line")
        else:
            with pytest.raises(error):
                await rig.it._serve("the line")
    assert masters == ["the line"]
    assert len(asyncio.all_tasks()) == before, "both tasks have ended"


async def test_own_line_is_served_by_the_dispatcher_alone() -> None:
    rig = Rig(shared=False)
    rig.dispatcher.serve = AsyncMock()
    await rig.it._serve("the line")
    rig.dispatcher.serve.assert_awaited_once_with("the line")


@pytest.mark.parametrize(
    ("behind", "unkept", "note", "shown"),
    [
        ("", "", "", (LineStatus.CONNECTED, "")),
        ("", "", "no parity", (LineStatus.CONNECTED, "no parity")),
        ("", "not kept.", "no parity", (LineStatus.CONNECTED, "not kept. no parity")),
        ("one behind", "", "no parity", (LineStatus.LOST, "one behind")),
    ],
)
def test_opened_line_is_connected_unless_its_replies_were_behind(
    behind: str, unkept: str, note: str, shown: tuple[LineStatus, str]
) -> None:
    rig = Rig()
    rig.dispatcher.steps.behind, rig.dispatcher.facts.unkept = behind, unkept
    rig.it._say_opened(note)
    assert rig.shown == [shown]
    assert isinstance(rig.states[0][1], LineBehind) == bool(behind)
    rig.dispatcher.steps.recovered()
    assert rig.shown[1:] == [(LineStatus.CONNECTED, f"{unkept} {note}".strip())]


@pytest.mark.parametrize(
    ("status", "accepts"), [(LineStatus.CONNECTED, True), (LineStatus.LOST, False)]
)
def test_line_of_another_owner_accepts_requests_once_it_is_connected(
    status: LineStatus, accepts: bool
) -> None:
    rig, error = Rig(), LineLost("frozen")
    rig.it.refusal, rig.it._failures = error, 2
    rig.it._say_of_owner(status, "by another", error)
    assert (rig.it.refusal is None, rig.it._failures) == (accepts, 0 if accepts else 2)
    assert rig.shown == [(status, "by another")]
    assert rig.states[0][1] is error
