"""Requests that end unsent, and counts of a line, to the exact argument."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.errors import NoAnswer
from tui.bus.model import Priority
from tui.bus.requests import Diagnose, Read, Request, WriteOne
from tui.bus.schedule.queue import Job
from tui.bus.schedule.unsent import ends_unsent, refusal_of
from tui.bus.stop_counts import is_newer
from tui.bus.tally import Tally

from .conftest import WIDE

READ, WRITE, RESTART = Read(4, 100, 2), WriteOne(4, 100, 7), Diagnose(4, 1, 0)
POLL, COMMAND, STOP = Priority.POLL, Priority.OPERATOR_WRITE, Priority.STOP


@pytest.mark.parametrize(
    ("request_", "priority", "program", "paused", "refused"),
    [
        (WRITE, COMMAND, "me", False, "refused"), (WRITE, COMMAND, "me", True, "paused"),
        (WRITE, COMMAND, "", True, ""), (WRITE, STOP, "me", True, ""),
        (READ, POLL, "me", True, "paused"), (READ, POLL, "me", False, ""),
        (RESTART, COMMAND, "me", False, "refused"),
    ],
)  # fmt: skip
def test_write_is_refused_by_the_state_that_the_programs_share(
    request_: Request, priority: Priority, program: str, paused: bool, refused: str
) -> None:
    heard: list[object] = []

    def refusal(*of: object, writes: bool) -> str:
        heard.append((*of, writes))
        return "refused"

    facts = SimpleNamespace(paused={4: ("x", "paused")} if paused else {}, refusal=refusal)
    job = Job(request_, priority, WIDE, program=program, stamp=9)
    assert refusal_of(job, cast(Any, facts)) == refused
    if refused == "refused":
        assert heard == [("me", 4, 9, request_ is not RESTART)]
    else:
        assert heard == []


def test_poll_of_a_silent_device_fails_with_the_time_of_the_next_one() -> None:
    job = Job(READ, POLL, WIDE, within=0.25)
    heard: list[object] = []

    def backed_off(*of: object) -> float:
        heard.append(of)
        return 2.5

    devices: Any = SimpleNamespace(backed_off=backed_off)
    assert ends_unsent(job, devices, cast(Any, None), 8.0)
    assert heard == [(4, POLL, 8.0, 0.25)]
    error = job.answer.exception(0)
    assert isinstance(error, NoAnswer)
    assert str(error).startswith("Device 4 does not answer.")
    assert (error.device, error.function, error.address, error.retry_in) == (4, 3, 100, 2.5)


def test_counts_of_a_line_and_of_its_devices_rise_by_one() -> None:
    tally = Tally()
    for _ in range(2):
        tally.count_sent(4, 8)
        tally.count_reply(4, 0.0)
        tally.count_end(4, 0.5, 6)
    device = tally.of(4)
    assert (tally.requests, tally.replies, tally.bytes_out, tally.busy_seconds) == (2, 2, 16, 1.0)
    assert (device.requests, device.replies, device.bytes_out, device.bytes_in) == (2, 2, 16, 12)
    assert (device.turnarounds[0], sum(device.turnarounds)) == (2, 2)


@pytest.mark.parametrize(
    ("count", "than", "newer"),
    [(1, 0, True), (0, 0, False), (0, 1, False), (0x7FFF, 0, True), (0x8000, 0, False)],
)
def test_count_is_newer_by_less_than_half_of_all_counts(
    count: int, than: int, newer: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tui.bus.stop_counts.STOPS_WRAP", 0x10000)
    assert is_newer(count, than) == newer
    assert is_newer((count + 0xFFF0) % 0x10000, (than + 0xFFF0) % 0x10000) == newer
