"""Outcome of a request at the end of its exchange; without a line or a clock."""

from __future__ import annotations

import pytest

from tui.bus.limits import CAUTIOUS
from tui.bus.master import ExchangeResult, ResultKind
from tui.bus.model import Priority, Timing
from tui.bus.requests import Read
from tui.bus.schedule.outcomes import Outcomes
from tui.bus.schedule.patience import Devices
from tui.bus.schedule.queue import Job
from tui.bus.shared_state import SharedState
from tui.bus.tally import Tally


@pytest.mark.parametrize(
    ("turnaround", "on_wire", "lay", "anew"),
    [
        (0.005, 1.2, 0.0, False),  # 61 words at 1200 baud
        (0.005, 4.7, 0.0, False),  # and at 300
        (1.2, 0.02, 0.0, True),
        (0.005, 0.02, 1.2, True),
    ],
)
def test_read_is_repeated_if_its_reply_waited_not_if_it_is_long(
    turnaround: float, on_wire: float, lay: float, anew: bool
) -> None:
    """A backup at 1200 baud requested its first long reply again and again, without an end."""
    timing, end = Timing(), turnaround + on_wire
    devices, tally = Devices(timing, mistakable=True), Tally()
    outcomes = Outcomes(devices, tally, timing, lambda: end + lay, SharedState(), gateway=False)
    job = Job(Read(1, 4201, 61), Priority.BACKGROUND, CAUTIOUS)
    devices.answered(1, job.request.expectation(), 0.005, 0.0)
    result = ExchangeResult(ResultKind.REPLY, sent=0.0, end=end, turnaround=turnaround)
    assert outcomes.waited_for_us(job, result) is anew


def test_not_polled_silent_and_refused_are_distinct_states() -> None:
    devices = Devices(Timing(), mistakable=True)
    expected = Read(1, 0, 1).expectation()
    assert devices.state(1).contact == "not_polled"
    devices.silent(1, expected, 0.0, 1.0)
    assert devices.state(1).contact == "silent"
    devices.answered(1, expected, 0.01, 2.0, refused=True)
    assert devices.state(1).contact == "refused"
    copied = Devices(Timing(), mistakable=True)
    copied.copy(1, devices.state(1))
    assert copied.state(1).contact == "refused"
    devices.answered(1, expected, 0.01, 3.0)
    assert devices.state(1).contact == "answers"
