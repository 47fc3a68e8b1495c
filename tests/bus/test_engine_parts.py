"""Parts of the thread of a line, without a thread: what enters its loop, and what it does there."""

from __future__ import annotations

import asyncio
import threading
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import Mock, call

import pytest

from tui.bus.api import Priority
from tui.bus.errors import LineClosed, LineLost
from tui.bus.requests import Read
from tui.bus.schedule import engine as engines
from tui.bus.schedule.engine import Engine
from tui.bus.schedule.queue import Job

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


@pytest.mark.internal_errors
def test_internal_error_reaches_the_caller_that_waits(caplog: pytest.LogCaptureFixture) -> None:
    error, given = ValueError("on purpose"), Mock()
    engines._do(Mock(side_effect=error), given)
    assert given.mock_calls == [call.break_off(error)]
    assert caplog.messages == ["an internal error of the line"]
