"""Parts of a line without a wire: its requests, workers, events, trace, names and connection."""

from __future__ import annotations

import asyncio
from dataclasses import replace
from typing import Any, cast
from unittest.mock import Mock, call

import pytest

from tui.bus import trace as traces
from tui.bus.api import Priority
from tui.bus.bounds import MOST_BYTES
from tui.bus.errors import RequestRefused
from tui.bus.line import Line
from tui.bus.line_events import EventHub, ProgramsChanged
from tui.bus.link import Link, RtuTcpLink, SerialLink, TcpLink, character_time, label, silence
from tui.bus.program import LONGEST_NAME, Program, readable
from tui.bus.requests import Read, ReadInput, WriteMany, WriteOne
from tui.bus.schedule.queue import Job
from tui.bus.schedule.worker import Worker
from tui.bus.share.messages import (
    LENGTH,
    LONGEST_MESSAGE,
    Alive,
    NoMessage,
    StopGiven,
    next_message,
    packed,
    unpacked,
)
from tui.bus.trace import LOOKED_LATELY, Frame, Trace
from tui.bus.transport.tcp import TcpTransport

from .conftest import WIDE

ME = Program("a", "run", 7)
LIMITS = replace(WIDE, functions=WIDE.functions | {4})


# -- requests --------------------------------------------------------------------------------------


@pytest.fixture
def answered() -> tuple[Line, list[Job]]:
    """A line whose requests are answered at 5.0, and these."""
    line, jobs = Line(TcpLink("10.0.0.5")), list[Job]()
    line.describe(1, LIMITS)

    def submit(job: Job) -> None:
        jobs.append(job)
        job.begun = job.answer.set_running_or_notify_cancel()
        job.finish(job.reply(bytes([job.request.function, 2, 0, 7]), 5.0))

    cast(Any, line._engine).submit = submit
    return line, jobs


async def test_read_has_the_form_and_the_urgency_that_were_named(
    answered: tuple[Line, list[Job]],
) -> None:
    line, jobs = answered
    reply = await line.read(1, 100)
    assert (reply.words, reply.time) == ((7,), 5.0)
    await line.read(1, 101, priority=Priority.STOP, function=4, max_age=1.5, within=0.5)
    plain, other = jobs
    assert (plain.request, plain.priority, plain.limits) == (Read(1, 100, 1), Priority.POLL, LIMITS)
    assert (plain.replaceable, plain.forbidden, plain.max_age, plain.within) == (
        False, None, 0.0, None,
    )  # fmt: skip
    assert (other.request, other.priority) == (ReadInput(1, 101, 1), Priority.STOP)
    assert (other.max_age, other.within) == (1.5, 0.5)


async def test_write_has_the_form_and_the_urgency_that_were_named(
    answered: tuple[Line, list[Job]],
) -> None:
    line, jobs = answered

    def forbidden() -> str:
        return ""

    assert await line.write(1, 8501, [7]) == 5.0
    await line.write(1, 8501, [7], priority=Priority.STOP, within=0.5)
    await line.write(1, 8502, [8], multiple=True, replaceable=True, forbidden=forbidden)
    line.describe(1, replace(WIDE, functions=frozenset({16})))
    await line.write(1, 8501, [7])
    plain, stop, several, only = jobs
    assert (plain.request, plain.priority) == (WriteOne(1, 8501, 7), Priority.OPERATOR_WRITE)
    assert (plain.replaceable, plain.forbidden, plain.within) == (False, None, None)
    assert plain.max_age == 0.0
    assert (stop.priority, stop.within) == (Priority.STOP, 0.5)
    assert several.request == WriteMany(1, 8502, (8,))
    assert (several.replaceable, several.forbidden) == (True, forbidden)
    assert only.request == WriteMany(1, 8501, (7,)), "all that the device has"


async def test_stop_is_sent_on_a_line_that_is_held_and_nothing_on_one_that_is_read_only(
    answered: tuple[Line, list[Job]],
) -> None:
    line, jobs = answered
    line.held = "Is this the right line?"
    with pytest.raises(RequestRefused, match="right line"):
        await line.write(1, 8501, [7])
    await line.write(1, 8501, [7], priority=Priority.STOP)
    line.held, line.read_only = "", True
    with pytest.raises(RequestRefused):
        await line.write(1, 8501, [7], priority=Priority.STOP)
    assert len(jobs) == 1


def test_line_reports_its_devices_and_begins_its_workers() -> None:
    line = Line(TcpLink("10.0.0.5"))
    engine = cast(Any, line)._engine = Mock()
    assert line.device_state(3) is engine.devices.state.return_value
    assert line.spawn(cast(Any, "work"), "w") is engine.spawn.return_value
    assert engine.mock_calls == [call.devices.state(3), call.spawn("work", "w")]


# -- workers ---------------------------------------------------------------------------------------


@pytest.mark.internal_errors
async def test_worker_ends_by_its_work_an_error_or_a_cancel(
    caplog: pytest.LogCaptureFixture,
) -> None:
    done: list[str] = []

    async def work() -> None:
        done.append("work")

    async def fails() -> None:
        raise ValueError("on purpose")

    loop = asyncio.get_running_loop()
    plain, failed, waits = (
        Worker(what, name, loop)
        for what, name in ((work, "plain"), (fails, "failed"), (asyncio.Event().wait, "waits"))
    )
    before = Worker(work, "before", loop)
    before.cancel()
    assert before.start() is None
    tasks = [worker.start() for worker in (plain, failed, waits)]
    assert [task and task.get_name() for task in tasks] == ["plain", "failed", "waits"]
    await asyncio.sleep(0)
    assert not waits.done()
    waits.cancel()
    await asyncio.wait([task for task in tasks if task], timeout=5.0)
    await asyncio.sleep(0)
    assert [worker.done() for worker in (plain, failed, waits, before)] == [True] * 4
    assert done == ["work"]
    assert (plain.error, repr(failed.error), waits.error) == (
        None, repr(ValueError("on purpose")), None,
    )  # fmt: skip
    assert caplog.messages == ["failed ended by an error"]


# -- events, trace, names --------------------------------------------------------------------------


@pytest.mark.internal_errors
def test_event_reaches_each_listener_until_it_ends_that(caplog: pytest.LogCaptureFixture) -> None:
    hub, heard = EventHub(), list[str]()
    hub.subscribe(Mock(side_effect=ValueError("on purpose")))
    end_first = hub.subscribe(lambda _: heard.append("first"))
    hub.subscribe(lambda _: heard.append("second"))
    hub.emit(ProgramsChanged())
    end_first()
    end_first()
    hub.emit(ProgramsChanged())
    assert heard == ["first", "second", "second"]
    assert caplog.messages == ["a listener of the line failed"] * 2


def test_trace_keeps_the_last_frames_and_knows_if_they_are_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    now = [0.0]
    monkeypatch.setattr(traces, "monotonic", lambda: now[0])
    trace = Trace(2)
    assert not trace.looked_at
    trace.add(1.0, "out", b"\x01\x03")
    trace.add(2.0, "in", bytes(MOST_BYTES + 1), "odd")
    trace.add(3.0, "out", b"\x02")
    frames = trace.frames()
    assert frames == (Frame(2.0, "in", bytes(MOST_BYTES), "odd"), Frame(3.0, "out", b"\x02", ""))
    assert trace.count == 3
    assert trace.looked_at
    now[0] = LOOKED_LATELY
    assert not trace.looked_at


def test_program_is_named_by_short_readable_texts() -> None:
    assert Program("a", "panel", 812, where="pts/3").text == "panel on pts/3 (pid 812)"
    assert Program("a", "run", 7).text == "run (pid 7)"
    long = "n" * (LONGEST_NAME + 1)
    cut = "n" * (LONGEST_NAME - 1) + "…"
    assert Program("a", long, 7, where=long).text == f"{cut} on {cut} (pid 7)"
    assert readable("abc", 3) == "abc"
    assert readable("a\x1bcd", 3) == "a?…"


@pytest.mark.parametrize(
    ("link", "text"),
    [
        (SerialLink("/dev/ttyS0"), "serial:/dev/ttyS0,19200,8E1"),
        (SerialLink("/dev/ttyS0", 9600, "8N1", 2.0), "serial:/dev/ttyS0,9600,8N1,timeout=2"),
        (TcpLink("10.0.0.5"), "tcp:10.0.0.5:502"),
        (TcpLink("::1", 503, 0.5, 255), "tcp:[::1]:503,unit=255,timeout=0.5"),
        (RtuTcpLink("::1", 4001, 2.0), "rtu-tcp:[::1]:4001,timeout=2"),
        (RtuTcpLink("moxa", 4001), "rtu-tcp:moxa:4001"),
    ],
)
def test_line_is_named_as_it_is_written(link: Link, text: str) -> None:
    assert label(link) == text


def test_line_behind_a_server_has_the_times_of_19200_baud() -> None:
    for link in (SerialLink("/dev/ttyS0"), RtuTcpLink("moxa", 4001)):
        assert character_time(link) == pytest.approx(11 / 19200)
        assert silence(link) == pytest.approx(3.5 * 11 / 19200)
    slow = SerialLink("/dev/ttyS0", 9600, "8N1")
    assert character_time(slow) == pytest.approx(10 / 9600)
    assert silence(slow) == pytest.approx(3.5 * 10 / 9600)
    assert (character_time(TcpLink("a")), silence(TcpLink("a"))) == (0.0, 0.0)


# -- messages between programs ---------------------------------------------------------------------


async def test_message_is_read_after_its_length() -> None:
    reader = asyncio.StreamReader()
    stop = StopGiven((1, 2), (3, 4), "a key", ME, 5.0)
    reader.feed_data(packed(stop) + packed(Alive()))
    reader.feed_data((LONGEST_MESSAGE + 1).to_bytes(LENGTH, "big"))
    reader.feed_data(bytes(LENGTH))
    reader.feed_eof()
    assert await next_message(reader) == stop
    head = await reader.readexactly(LENGTH)
    assert await next_message(reader, head) == Alive()
    with pytest.raises(NoMessage, match=f"^{LONGEST_MESSAGE + 1} bytes$"):
        await next_message(reader)
    with pytest.raises(NoMessage, match="truncated"):
        await next_message(reader)
    with pytest.raises(asyncio.IncompleteReadError):
        await next_message(reader)


async def test_longest_message_is_awaited_whole() -> None:
    reader = asyncio.StreamReader()
    reader.feed_data(LONGEST_MESSAGE.to_bytes(LENGTH, "big"))
    reader.feed_eof()
    with pytest.raises(asyncio.IncompleteReadError):
        await next_message(reader)


def test_stop_of_unequal_devices_and_counts_is_no_message() -> None:
    for devices, counts in (((1, 2), (3,)), ((1,), (3, 4))):
        with pytest.raises(ValueError, match="not one count for each device"):
            StopGiven(devices, counts, "a key", ME, 5.0)
    plain = packed(StopGiven((1,), (3,), "a key", ME, 5.0))[LENGTH:]
    assert unpacked(plain) == StopGiven((1,), (3,), "a key", ME, 5.0)
    with pytest.raises(NoMessage):
        unpacked(b"\xff" + plain)


# -- the connection --------------------------------------------------------------------------------


@pytest.fixture
def connected(monkeypatch: pytest.MonkeyPatch) -> tuple[TcpTransport, Mock, Mock]:
    """A connection, its socket, and the receiver of its bytes."""
    monkeypatch.setattr("tui.bus.transport.tcp.time.monotonic", lambda: 7.0)
    transport, connection, receiver = TcpTransport(), Mock(), Mock()
    connection.is_closing.return_value = False
    transport._connection = connection
    return transport, connection, receiver


def test_bytes_are_passed_on_in_their_order_with_their_time(
    connected: tuple[TcpTransport, Mock, Mock],
) -> None:
    transport, _, receiver = connected
    transport.data_received(b"a")
    transport.data_received(b"b")
    transport.start(receiver)
    transport.data_received(b"c")
    assert receiver.mock_calls == [call.received(b"ab", 7.0), call.received(b"c", 7.0)]


async def test_bytes_are_sent_while_the_connection_is_open(
    connected: tuple[TcpTransport, Mock, Mock],
) -> None:
    transport, connection, _ = connected
    await transport.send(b"stop")
    connection.is_closing.return_value = True
    with pytest.raises(OSError, match=r"^the connection is closed$"):
        await transport.send(b"stop")
    connection.write.assert_called_once_with(b"stop")
    transport._connection = None
    with pytest.raises(OSError, match=r"^the connection is closed$"):
        await transport.send(b"stop")


async def test_connection_rests_until_its_time_and_takes_in_what_has_come(
    connected: tuple[TcpTransport, Mock, Mock], monkeypatch: pytest.MonkeyPatch
) -> None:
    transport, slept = connected[0], list[float]()

    async def sleep(seconds: float) -> None:
        slept.append(seconds)

    monkeypatch.setattr("tui.bus.transport.tcp.asyncio.sleep", sleep)
    for until in (6.0, 7.0, 7.5):
        await transport.rest(until)
    assert slept == [0.5]
    await transport.take_in()
    assert slept == [0.5, 0, 0]
