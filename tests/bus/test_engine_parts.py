"""Parts of the thread of a line, without a thread: what enters its loop, and what it does there."""

from __future__ import annotations

import asyncio
import threading
from functools import partial
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import Mock, call

import pytest

from tui.bus.api import Priority
from tui.bus.errors import LineClosed, LineLost
from tui.bus.line_events import StateChanged
from tui.bus.link import Link, RtuTcpLink, SerialLink, TcpLink
from tui.bus.model import EndedExchange, LineState, LineStatus, Timing
from tui.bus.requests import Read
from tui.bus.schedule import engine as engines
from tui.bus.schedule.engine import Engine
from tui.bus.schedule.inside import LineInside
from tui.bus.schedule.queue import Job
from tui.bus.shared_state import SharedState
from tui.wire.frames import frame

from .conftest import WIDE


def an_engine() -> Any:
    engine = cast(Any, object.__new__(Engine))
    engine._lock, engine._accepting, engine._closed = threading.Lock(), True, False
    engine._loop, engine._dispatcher, engine._workers = Mock(), Mock(), set()
    engine._connection = SimpleNamespace(refusal=None)
    return engine


def a_read() -> Job:
    return Job(Read(1, 100, 1), Priority.POLL, WIDE)


def test_request_enters_the_loop_with_its_program_its_stops_and_its_time() -> None:
    engine, job = an_engine(), a_read()
    engine.facts, engine._clock = Mock(), lambda: 7.5
    engine.facts.me.id = "me"
    engine.facts.stops.stamp = {1: 4}.__getitem__
    engine.submit(job)
    assert (job.program, job.stamp, job.requested) == ("me", 4, 7.5)
    assert engine._loop.call_soon_threadsafe.call_args == call(engines._do, engine._take, job)


def test_change_from_any_thread_wakes_the_dispatcher() -> None:
    engine = an_engine()
    engine._wake()
    engine._loop.call_soon_threadsafe.assert_called_once_with(engine._dispatcher.wake)


def test_request_is_queued_unless_the_line_is_closed_or_refused() -> None:
    engine, job = an_engine(), a_read()
    engine._take(job)
    assert engine._dispatcher.mock_calls == [call.submit(job)]
    engine._connection.refusal = LineLost("unplugged")
    engine._take(job)
    assert engine._dispatcher.mock_calls[1:] == [call.fail(job, "unplugged")]
    engine._closed = True
    engine._take(job)
    assert len(engine._dispatcher.mock_calls) == 2
    with pytest.raises(LineClosed):
        job.answer.result(0)


async def test_worker_is_kept_until_it_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    engine, worker = an_engine(), Mock()
    monkeypatch.setattr(engines, "Worker", lambda *of: worker if of[:2] == ("work", "w") else None)
    assert engine.spawn("work", "w") is worker
    assert engine._loop.call_soon_threadsafe.call_args == call(engines._do, engine._begin, worker)
    task = worker.start.return_value = asyncio.ensure_future(asyncio.sleep(0))
    engine._begin(worker)
    assert engine._workers == {task}
    await task
    await asyncio.sleep(0)
    assert engine._workers == set()
    worker.start.return_value = None
    engine._begin(worker)
    assert engine._workers == set()


def test_worker_of_a_line_that_is_closed_is_abandoned() -> None:
    engine, worker = an_engine(), Mock()
    engine._closed = True
    engine._begin(worker)
    assert worker.mock_calls == [call.abandon()]
    engine._loop = None
    with pytest.raises(LineClosed):
        engine.spawn("work", "w")


def test_thread_leaves_the_line_closed_however_it_ends() -> None:
    async def nothing() -> None:
        """End at once."""

    engine, loop, reported = an_engine(), asyncio.new_event_loop(), Mock()
    engine._connection = SimpleNamespace(run=nothing)
    engine._end, engine._changed, engine._clock = nothing, reported, lambda: 3.0
    engine._work(loop)
    assert loop.is_closed()
    assert reported.mock_calls == [call(LineState(LineStatus.CLOSED, "", 3.0))]
    assert not engine._accepting
    with pytest.raises(LineClosed):
        engine.start(None)


@pytest.mark.internal_errors
def test_internal_error_reaches_the_caller_that_waits(caplog: pytest.LogCaptureFixture) -> None:
    error, given = ValueError("on purpose"), Mock()
    engines._do(Mock(side_effect=error), given)
    assert given.mock_calls == [call.break_off(error)]
    assert caplog.messages == ["an internal error of the line"]


class Made:
    """An engine with substitutes for its parts, and the arguments of which they were made."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, link: Link, *, shared: Any = None) -> None:
        self.arguments: dict[str, tuple[tuple[Any, ...], dict[str, Any]]] = {}
        self.parts: dict[str, Mock] = {}
        for name in ("Dispatcher", "LastWay", "Connection", "Devices"):
            monkeypatch.setattr(engines, name, self._part(name))
        self.insides: list[LineInside] = []
        self.facts = SharedState()
        share = None if shared is None else partial(self._share, shared)
        self.timing = Timing(trace_length=3, late_reply=2.5)
        self.engine = Engine(link, self.timing, lambda: 7.5, self.facts, share)

    def _share(self, shared: Any, inside: LineInside) -> Any:
        self.insides.append(inside)
        return shared

    def _part(self, name: str) -> Any:
        def make(*arguments: Any, **named: Any) -> Mock:
            self.arguments[name] = arguments, named
            self.parts[name] = Mock()
            return self.parts[name]

        return make


@pytest.mark.parametrize(
    ("link", "gateway", "buffers"),
    [(SerialLink("/dev/x"), False, False), (TcpLink("plc"), True, True),
     (RtuTcpLink("plc", 4001), False, True)],
)  # fmt: skip
def test_parts_of_a_line_are_made_for_its_link(
    link: Link, gateway: bool, buffers: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = Made(monkeypatch, link)
    engine = made.engine
    assert made.arguments["Devices"] == ((made.timing,), {"mistakable": not gateway})
    (devices, tally, timing, clock), named = made.arguments["Dispatcher"]
    assert (devices, tally, timing, clock()) == (engine.devices, engine.tally, made.timing, 7.5)
    assert named == {"gateway": gateway, "buffers": buffers, "facts": made.facts}
    context = made.arguments["Connection"][0][1]
    stray = made.parts["Dispatcher"].stray
    assert (context.timing, context.trace, context.tally, context.clock, context.stray) == (
        made.timing, engine.trace, engine.tally, clock, stray,
    )  # fmt: skip
    connection = made.arguments["Connection"][0]
    assert (connection[0], connection[2], connection[5], connection[6]) == (
        link, made.parts["Dispatcher"], None, made.parts["LastWay"],
    )  # fmt: skip
    assert made.parts["Dispatcher"].last_way is made.parts["LastWay"]
    assert engine.state == LineState(LineStatus.CLOSED, "", 7.5)
    for number in range(5):
        engine.trace.add(float(number), "out", b"")
    assert len(engine.trace.frames()) == 3
    assert Engine(link, made.timing, clock).facts is not made.facts


@pytest.mark.parametrize("accepts", [True, False])
def test_last_way_of_a_shared_line_leads_through_its_owner(
    accepts: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    shared = Mock()
    shared.pass_on.return_value = accepts
    made = Made(monkeypatch, SerialLink("/dev/x"), shared=shared)
    to_owner, wake, opened, note = made.arguments["LastWay"][0]
    assert to_owner(b"frame") is accepts
    assert shared.mock_calls == [call.pass_on(b"frame")]
    assert wake is made.parts["Dispatcher"].wake
    transports = Mock()
    monkeypatch.setattr(engines, "open_transport", transports)
    opened()
    around = made.arguments["Connection"][0][1]
    assert transports.mock_calls == [call(SerialLink("/dev/x"), around, alone=False)]
    note(b"\x01\x06\x21\x35\x00\x00\x93\xc8")
    (frame,) = made.engine.trace.frames()
    assert (frame.time, frame.direction, len(frame.data)) == (7.5, "out", 8)
    (inside,) = made.insides
    assert (inside.link, inside.around, inside.dispatcher) == (
        SerialLink("/dev/x"), around, made.parts["Dispatcher"],
    )  # fmt: skip
    assert (inside.devices, inside.pace) == (made.engine.devices, made.engine.pace)
    assert inside.state() is made.engine.state
    alone = Made(monkeypatch, SerialLink("/dev/x"))
    assert alone.arguments["LastWay"][0][0](b"frame") is False


@pytest.mark.parametrize(
    ("link", "data", "sent"),
    [
        (SerialLink("/dev/x"), frame(3, b"\x06\x21\x35\x00\x07"), (3, b"\x06\x21\x35\x00\x07")),
        (TcpLink("plc"), bytes(5) + b"\x06\x03\x06\x21\x35\x00\x07", (3, b"\x06\x21\x35\x00\x07")),
        (SerialLink("/dev/x"), b"\x03", None),
    ],
)
def test_finished_frame_is_recorded_if_it_can_be_read(
    link: Link, data: bytes, sent: tuple[int, bytes] | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(engines, "time", lambda: 99.0)
    made, records = Made(monkeypatch, link), list[EndedExchange]()
    note = made.arguments["LastWay"][0][3]
    note(data)
    made.facts.record = records.append
    note(data)
    assert [(each.time, each.direction, each.data) for each in made.engine.trace.frames()] == [
        (7.5, "out", data)
    ] * 2
    expected = [] if sent is None else [EndedExchange(*sent, "sent", b"", 7.5, 7.5, 99.0)]
    assert records == expected
    with pytest.raises(LineClosed):
        made.engine.send_prepared([], Mock())


@pytest.mark.parametrize(
    ("in_flight", "busy", "last_reply", "quiet"),
    [(False, False, 0.0, 0.0), (True, False, 0.0, 2.5), (False, True, 0.0, 2.5),
     (False, False, 8.5, 1.0), (True, True, 12.5, 5.0)],
)  # fmt: skip
def test_line_is_quiet_once_no_reply_may_come(
    in_flight: bool, busy: bool, last_reply: float, quiet: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = Made(monkeypatch, SerialLink("/dev/x"))
    dispatcher = made.parts["Dispatcher"]
    dispatcher.in_flight, dispatcher.proof.busy = in_flight, busy
    made.parts["Devices"].last_reply_by.side_effect = lambda now: max(now, last_reply)
    assert made.arguments["Connection"][0][4]() == quiet


@pytest.mark.internal_errors
def test_change_of_a_line_is_passed_on_whatever_fails(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    shared, events = Mock(), list[object]()
    made = Made(monkeypatch, SerialLink("/dev/x"), shared=shared)
    made.facts.events.subscribe(events.append)
    changed = made.arguments["Connection"][0][3]
    state, error = LineState(LineStatus.LOST, "gone", 8.0), LineLost("gone")
    changed(state, error)
    assert (made.engine.state, made.insides[0].error()) == (state, error)
    assert (shared.mock_calls, events) == ([call.tell_state()], [StateChanged(state)])
    shared.tell_state.side_effect = ValueError
    monkeypatch.setattr(made.facts.events, "emit", Mock(side_effect=ValueError))
    changed(LineState(LineStatus.CONNECTED, "", 9.0))
    assert made.insides[0].error() is None
    assert caplog.messages == [
        "the line's state was not sent to the programs on it",
        "a change of the line was not passed on",
    ]
