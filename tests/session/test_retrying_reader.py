"""Reads for work that must not end at one lost reply: three attempts, and a rest if polls pause."""

from __future__ import annotations

import pytest

from tui.bus.api import Priority
from tui.bus.errors import ChecksumFault, NoAnswer
from tui.session.clock import Clock
from tui.session.drive import DriveSession
from tui.session.read.retrying_reader import RetryingReader, neighbors

from .fakes import OneDrive, parameter, profile_of

PROFILE = profile_of(*(parameter(f"P{address}", address) for address in (10, 11, 90)))


class CountedSleep(Clock):
    """Time that is only counted."""

    def __init__(self) -> None:
        self.slept: list[float] = []

    async def sleep(self, seconds: float) -> None:
        self.slept.append(seconds)


class LosesReplies(OneDrive):
    """A drive whose first replies are lost."""

    def __init__(self, *errors: Exception) -> None:
        super().__init__({10: 7, 11: 8, 90: 9})
        self.errors = list(errors)
        self.attempts = 0

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        self.attempts += 1
        if self.errors:
            raise self.errors.pop(0)


def lost(retry_in: float | None = None) -> NoAnswer:
    return NoAnswer(1, 3, 10, retry_in=retry_in)


def bench(drive: LosesReplies, priority: Priority) -> tuple[RetryingReader, CountedSleep]:
    clock = CountedSleep()
    session = DriveSession(drive, 1, PROFILE, clock=clock)
    return RetryingReader(session, priority=priority), clock


@pytest.mark.parametrize(
    ("error", "priority", "slept"),
    [
        (lost(0.5), Priority.POLL, [0.5]),
        (lost(60.0), Priority.POLL, [3.0]),
        (lost(), Priority.POLL, [0.0]),
        (lost(60.0), Priority.OPERATOR_READ, []),
        (ChecksumFault(1, 3, 10), Priority.POLL, []),
    ],
)
async def test_lost_reply_is_requested_again_after_a_pause(
    error: Exception, priority: Priority, slept: list[float]
) -> None:
    reader, clock = bench(LosesReplies(error), priority)
    assert await reader.ask_raws(["P10"]) == {"P10": 7}
    assert clock.slept == slept


async def test_third_lost_reply_is_the_result() -> None:
    drive = LosesReplies(*(lost(0.5) for _ in range(3)))
    reader, clock = bench(drive, Priority.POLL)
    with pytest.raises(NoAnswer):
        await reader.ask(["P10"])
    assert (drive.attempts, clock.slept) == (3, [0.5, 0.5])


async def test_refused_parameter_has_its_reason() -> None:
    reader, _ = bench(LosesReplies(), Priority.POLL)
    del reader.session.line.devices[1].words[11]  # type: ignore[attr-defined]
    assert await reader.ask_many(["P10", "P11", "P90"]) == {"P10": 7, "P90": 9}
    assert "refused" in reader.why_absent("P11")
    assert reader.why_absent("P10") == ""


def test_neighbors_are_split_if_no_read_spans_the_gap() -> None:
    assert neighbors(PROFILE, ["P90", "P11", "P10"]) == [["P10", "P11"], ["P90"]]
    wide = profile_of(*(parameter(f"P{address}", address) for address in range(100, 221)))
    parts = neighbors(wide, [parameter.code for parameter in wide.parameters])
    assert [len(part) for part in parts] == [60, 60, 1]
    apart = profile_of(parameter("P1", 1), parameter("P30", 30), parameter("P60", 60))
    assert neighbors(apart, ["P1", "P30", "P60"]) == [["P1", "P30"], ["P60"]]
