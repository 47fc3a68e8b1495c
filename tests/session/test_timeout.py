"""Communication timeout of a drive, and detection of whether it runs."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import AsyncMock

import pytest

from tui.bus.api import Priority
from tui.bus.errors import DeviceException, NoAnswer
from tui.drive.profile import library
from tui.session.clock import REAL_CLOCK, Clock
from tui.session.drive import DriveSession
from tui.session.monitor.timeout import (
    _related_words,
    has_begun,
    polling_stop_text,
    read_timeout,
    timeout_now,
    timeout_seconds,
)
from tui.session.read.presence import presence_read
from tui.session.read.reader import ASK_AGAIN, Reader
from tui.session.timeout_report import Timeout

from .fake_clock import FakeClock
from .fakes import OneDrive, parameter, profile_of

TTO, SLL, CMD, PORT, STATE = 50, 51, 60, 70, 10
RULES: dict[str, Any] = {
    "timeout": "TTO",
    "off": 0,
    "reaction": "SLL",
    "reactions": [
        {"raw": 0, "name": "Ignored", "does": "Nothing", "trips": False, "never_set": True},
        {"raw": 1, "name": "Freewheel", "does": "The motor coasts; SLF", "trips": True},
        {"raw": 2, "name": "Stop", "does": "Stops, no fault", "trips": False},
    ],
    "starts": "With the first request.",
    "fault": 5,
    "source": "manual",
}


class Ports(OneDrive):
    """A drive that is silent, or refuses, at some addresses."""

    def __init__(self, registers: dict[int, int], *, silent: int = 0, refused: int = 0) -> None:
        super().__init__({STATE: 1, SLL: 1, CMD: 0, **registers})
        self.silent, self.refused = silent, refused
        self.read_so_far: list[int] = []

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        self.read_so_far.append(registers.start)
        if self.silent in registers:
            raise NoAnswer(device, 3, registers.start)
        if self.refused in registers:
            raise DeviceException(device, 3, registers.start, code=2)


def session_of(line: OneDrive, clock: Clock = REAL_CLOCK, **rules: Any) -> DriveSession:
    profile = profile_of(
        parameter("STATE", STATE),
        parameter("TTO", TTO, unit="s", scale="0.1"),
        parameter("SLL", SLL),
        parameter("CMD", CMD),
        parameter("PORT", PORT, unit="s", scale="0.1"),
        communication_fault=RULES | rules,
        faults={"codes": [{"raw": 5, "code": "SLF", "name": "Line"}]},
        charts=[
            {
                "id": "drivecom",
                "name": "Drivecom",
                "kind": "drivecom",
                "status": "STATE",
                "command": "CMD",
                "states": [{"id": "run", "name": "Run", "kind": "running", "mask": 3, "value": 1}],
            }
        ],
    )
    return DriveSession(line, 1, profile, clock=clock)


async def reported(session: DriveSession) -> Timeout:
    return await read_timeout(Reader(session), Priority.OPERATOR_READ)


async def test_timeout_has_seconds_reaction_and_fault() -> None:
    watch = (await reported(session_of(Ports({TTO: 30})))).watch
    assert watch is not None
    assert (watch.timeout, watch.code, watch.fault, watch.active) == (3.0, "TTO", "SLF", True)
    assert watch.reaction is not None
    assert watch.reaction.name == "Freewheel"


async def test_reaction_without_a_trip_names_no_fault() -> None:
    watch = (await reported(session_of(Ports({TTO: 30, SLL: 2})))).watch
    assert watch is not None
    assert watch.fault == ""


async def test_timeout_without_a_reaction_has_not_begun() -> None:
    session = session_of(Ports({TTO: 30, SLL: 0}))
    session.timeout = await reported(session)
    for found in (session.timeout, timeout_now(session)):
        assert found.watch is not None
        assert (found.watch.active, found.watch.acts) == (False, False)
    text = polling_stop_text(session, watch=session.timeout.watch)
    assert "goes on: its reaction is Ignored" in text
    assert "acts" not in text


async def test_off_is_distinguished_from_refused() -> None:
    assert await reported(session_of(Ports({TTO: 0}))) == Timeout(known=True)
    assert await reported(session_of(Ports({TTO: 30}, refused=TTO))) == Timeout(known=False)


async def test_shortest_timeout_of_several_ports_applies() -> None:
    for mine, other, shortest in ((0, 20, 2.0), (30, 0, 3.0), (30, 20, 2.0), (10, 20, 1.0)):
        line = Ports({TTO: mine, PORT: other})
        watch = (await reported(session_of(line, other_timeouts=["PORT"]))).watch
        assert watch is not None
        assert watch.timeout == shortest


async def test_timeout_of_a_missing_port_is_read_once() -> None:
    line = Ports({PORT: 20}, silent=TTO)
    session = session_of(line, other_timeouts=["PORT"])
    for _ in range(2):
        found = await read_timeout(Reader(session), Priority.POLL)
        assert found.watch is not None
        assert found.watch.code == "PORT"
    assert line.read_so_far.count(TTO) == 1


async def test_word_unanswered_twice_is_not_read_again() -> None:
    """One lost reply does not mean a missing word; and each silence delays requests to a drive."""
    clock = FakeClock()
    line = Ports({PORT: 20}, silent=TTO)
    session = session_of(line, clock, other_timeouts=["PORT"])
    for _ in range(5):
        await read_timeout(Reader(session), Priority.POLL)
        clock.advance(2 * ASK_AGAIN)
    assert line.read_so_far.count(TTO) == 2
    line.silent = 0
    session = session_of(line, clock, other_timeouts=["PORT"])
    line.registers[TTO] = 10
    watch = (await read_timeout(Reader(session), Priority.POLL)).watch
    assert watch is not None
    assert watch.code == "TTO"


async def test_known_word_is_read_after_an_unanswered_one() -> None:
    """Else it counts as silent, and polls and its feeding wait."""
    line = Ports({PORT: 20}, silent=TTO)
    await read_timeout(Reader(session_of(line, other_timeouts=["PORT"])), Priority.POLL)
    at = line.read_so_far.index(TTO)
    assert line.read_so_far[at : at + 3] == [TTO, STATE, PORT]


async def test_family_that_refuses_by_silence_may_have_an_unknown_timeout() -> None:
    profile = library.load("powerdrive")
    line = Ports(
        {parameter.address: 0 for parameter in profile.parameters}, silent=profile["15.07"].address
    )
    session = DriveSession(line, 1, profile)
    assert await reported(session) == Timeout(known=True)  # of its other port
    line.refused = profile["11.63"].address
    assert await reported(session) == Timeout(known=False)


@pytest.mark.parametrize("family", ["powerdrive", "proxidrive", "varmeca"])
def test_presence_read_has_another_length_than_a_late_reply(family: str) -> None:
    ask = presence_read(library.load(family))
    assert ask is not None
    assert ask.count == 2


async def test_silent_drive_is_reported() -> None:
    with pytest.raises(NoAnswer):
        await reported(session_of(Ports({TTO: 30}, silent=TTO)))


@pytest.mark.parametrize(
    ("needs_write", "held", "reported_by_line", "begun"),
    [
        (False, 0, False, True),
        (True, 0, False, False),
        (True, 7, False, True),  # another master has written a command
        (True, 0, True, True),
    ],
)
async def test_timeout_that_begins_with_a_command_is_known(
    needs_write: bool, held: int, reported_by_line: bool, begun: bool
) -> None:
    session = session_of(Ports({TTO: 30, CMD: held}), needs_write=needs_write)
    session.reported_by_line = reported_by_line
    watch = (await reported(session)).watch
    assert watch is not None
    assert watch.active is begun
    # a reset or a reference of 0 begins it, too, and leaves no trace
    assert watch.begun is (True if begun else None)
    assert has_begun(session) is begun


@pytest.mark.parametrize("family", ["atv21", "atv31", "atv312", "atv71", "powerdrive"])
async def test_few_words_are_read(family: str) -> None:
    """A command that ends asks for the words of the profile's table, no more."""
    profile = library.load(family)
    line = OneDrive({parameter.address: 1 for parameter in profile.parameters})
    await reported(DriveSession(line, 1, profile))
    assert sum(count for _, count in line.requested) <= 3


async def test_timeout_of_a_family_without_one_is_known() -> None:
    line = Ports({TTO: 30})
    assert await reported(session_of(line, timeout="")) == Timeout(known=True)
    plain = DriveSession(line, 1, profile_of(parameter("STATE", STATE)))
    assert await reported(plain) == Timeout(known=True)
    assert line.read_so_far == []


async def test_timeout_is_as_sure_as_its_document_and_read_as_urgently_as_requested(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    priorities: list[Priority] = []

    async def before_read(self: Ports, device: int, registers: range, priority: Priority) -> None:
        priorities.append(priority)

    monkeypatch.setattr(Ports, "before_read", before_read)
    for confidence, sure in (("manual", True), ("analogy", True), ("unverified", False)):
        session = session_of(Ports({TTO: 30}), starts_confidence=confidence, needs_write=True)
        found = await read_timeout(Reader(session), Priority.BACKGROUND, ["STATE"])
        assert found.known
        assert found.watch is not None
        assert (found.watch.sure, found.watch.active) == (sure, False)
    assert set(priorities) == {Priority.BACKGROUND}


async def test_drive_that_is_known_to_be_away_is_not_looked_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    away = NoAnswer(1, 3, TTO, retry_in=2.0)
    looked = AsyncMock()
    monkeypatch.setattr("tui.session.monitor.timeout.look_for_drive", looked)
    read = AsyncMock(side_effect=away)
    reader = cast(Any, SimpleNamespace(session=session_of(Ports({})), read=read))
    with pytest.raises(NoAnswer) as caught:
        await read_timeout(reader, Priority.POLL)
    assert caught.value is away
    assert not looked.called


@pytest.mark.parametrize(
    ("needs_write", "reported_by_line", "codes"),
    [(True, False, ["SLL", "CMD"]), (True, True, ["SLL"]), (False, False, ["SLL"])],
)
def test_command_word_shows_a_timeout_that_begins_with_a_command(
    needs_write: bool, reported_by_line: bool, codes: list[str]
) -> None:
    session = session_of(Ports({}), needs_write=needs_write)
    session.reported_by_line = reported_by_line
    rules = session.profile.data.communication_fault
    assert rules is not None
    assert _related_words(session, rules) == codes


@pytest.mark.parametrize(
    ("raw", "number", "unit", "seconds"),
    [(15, 1.5, "s", 1.5), (1500, 1500.0, "ms", 1.5), (7, 7.0, "s", None), (0, 0.0, "s", None),
     (None, None, "s", None)],
)  # fmt: skip
def test_timeout_is_counted_in_seconds(
    raw: int | None, number: float | None, unit: str, seconds: float | None
) -> None:
    reading = cast(Any, SimpleNamespace(raw=raw, number=number, unit=unit))
    assert timeout_seconds(reading, 7) == seconds
