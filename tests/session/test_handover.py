"""Command of a drive that two programs request: a question, its answer, and the effect."""

from __future__ import annotations

import asyncio
import json
import os
from collections.abc import AsyncIterator
from pathlib import Path

import pytest

from tests.bus.peer import eventually
from tests.limits import ARMED_FOR, REQUEST_ANSWERED_WITHIN
from tui.bus.fake import FakeLine
from tui.bus.line_events import ControlDenied, ControlRequested, DevicesStopped, NoticeReceived
from tui.bus.program import Program
from tui.bus.share.messages import AnyMessage, Armed, Claim, DriveRequested, RequestGranted
from tui.bus.shared_state import LinePublisher
from tui.drive.profile import library
from tui.session.arming import CommandedElsewhere
from tui.session.drive import DriveSession
from tui.session.events import EventLog
from tui.session.fleet import Fleet
from tui.session.journal import Journal
from tui.session.sharing.handover import TAKEN_LOOK, TAKEN_WITHIN, Handover
from tui.session.starts.keeper import StartKeeper
from tui.session.starts.starts import Starts

from .fake_clock import FakeClock

REMOTE = Program("remote", "panel", 77, "", "pts/9")


class Heard(LinePublisher):
    """Messages of this program, as another one receives them."""

    def __init__(self) -> None:
        super().__init__(self.hear)
        self.output: list[tuple[object, ...]] = []

    def hear(self, message: AnyMessage) -> None:
        match message:
            case Claim(device=device, take=take):
                self.output.append(("claim", device, take))
            case DriveRequested(device=device):
                self.output.append(("ask", device))
            case RequestGranted(device=device, program=program, yes=yes):
                self.output.append(("reply", device, program, yes))
            case Armed(device=device, until=until):
                self.output.append(("armed", device, until != 0))

    def stop_directly(self, devices: tuple[int, ...]) -> None:
        self.output.append(("directly", devices))


class Bench:
    """One drive on a line that is shared with another program."""

    def __init__(self) -> None:
        self.line = FakeLine({1: {}})
        self.clock = FakeClock()
        self.voice = Heard()
        self.facts = self.line.facts
        self.facts.set_programs((self.facts.me, REMOTE))
        self.facts.voice = self.voice
        self.events = EventLog(self.clock.wall)
        self.starts = StartKeeper("panel", Starts(clock=self.clock), self.clock)
        self.session = DriveSession(self.line, 1, library.load("atv71"), clock=self.clock)
        self.session.starts = self.starts
        self.handover = Handover(
            self.line, self.events, lambda number: self.session if number == 1 else None, self.clock
        )
        self.handover.person = True

    def shows(self, status: int) -> None:
        """The drive's status word was read now."""
        self.session.image.confirm("ETA", status, self.clock.monotonic())

    @property
    def reported(self) -> list[str]:
        return [event.text for event in self.events.events]

    def starts_files(self) -> list[Path]:
        """The starts on record."""
        return list(Path(os.environ["DRIVEPANEL_STATE"], "starts").glob("*.json"))

    @property
    def answers(self) -> list[tuple[object, ...]]:
        return [pair for pair in self.voice.output if pair[0] == "reply"]

    def close(self) -> None:
        self.handover.close()
        self.starts.close()


@pytest.fixture
async def bench() -> AsyncIterator[Bench]:
    """A drive that this program and another one share."""
    made = Bench()
    yield made
    made.close()


def commanded_by_another(bench: Bench) -> None:
    bench.facts.note_commander(1, REMOTE.id)


async def expires(bench: Bench) -> None:
    """Advance the time beyond the deadline of an answer."""
    await asyncio.sleep(0.05)
    bench.clock.advance(REQUEST_ANSWERED_WITHIN + 1)
    await asyncio.to_thread(eventually, lambda: len(bench.answers) > 0)


# Arming is a claim


async def test_arming_claims_the_drive_and_disarming_releases_it(bench: Bench) -> None:
    bench.session.arming.arm()
    assert bench.facts.commanders == {1: bench.facts.me.id}
    bench.session.arming.disarm()
    assert bench.facts.commanders == {}
    assert bench.voice.output == [
        ("claim", 1, True),
        ("armed", 1, True),
        ("claim", 1, False),
        ("armed", 1, False),
    ]


async def test_drive_of_another_commander_is_not_armed_and_names_it(
    bench: Bench,
) -> None:
    commanded_by_another(bench)
    with pytest.raises(CommandedElsewhere, match=r"commanded by panel on pts/9 \(pid 77\)"):
        bench.session.arming.arm()
    assert not bench.session.arming.armed
    assert bench.voice.output == []


async def test_expired_arming_releases_the_drive(bench: Bench) -> None:
    bench.session.arming.arm()
    bench.clock.advance(ARMED_FOR + 1)
    assert not bench.session.arming.armed
    assert bench.voice.output[-2:] == [("claim", 1, False), ("armed", 1, False)]


async def test_denied_claim_disarms_with_its_reason(bench: Bench) -> None:
    bench.session.arming.arm()
    commanded_by_another(bench)
    bench.facts.events.emit(ControlDenied(1, "Drive 1 is commanded by panel on pts/9 (pid 77)."))
    assert not bench.session.arming.armed
    assert "pts/9" in bench.session.arming.refusal()
    # another drive's is not this one's business
    bench.facts.note_commander(1, None)
    bench.session.arming.arm()
    bench.facts.events.emit(ControlDenied(2, "no"))
    assert bench.session.arming.armed


async def test_stop_by_another_program_ends_arming_and_work_and_is_reported(bench: Bench) -> None:
    bench.session.arming.arm()
    before = bench.session.work.stops
    bench.facts.events.emit(DevicesStopped((1,), "the stop key", REMOTE))
    assert not bench.session.arming.armed
    assert bench.session.work.stops == before + 1
    assert "Stop from panel on pts/9 (pid 77) (the stop key)." in bench.reported
    bench.session.arming.arm()
    bench.facts.events.emit(DevicesStopped((2,), "the stop key", REMOTE))
    assert bench.session.arming.armed


# Requests to this program


async def test_request_is_shown_and_answered_by_a_person(bench: Bench) -> None:
    bench.session.arming.arm()
    bench.facts.events.emit(ControlRequested(1, REMOTE))
    request = bench.handover.requests[1]
    assert request.program == REMOTE
    assert any("This drive is requested by" in text for text in bench.reported)
    bench.handover.answer(bench.handover.requests[1], yes=True)
    assert bench.handover.requests == {}
    assert bench.answers == [("reply", 1, REMOTE.id, True)]
    assert not bench.session.arming.armed
    assert "Given to panel" in bench.session.arming.refusal()
    # a second answer answers nothing
    bench.handover.answer(request, yes=False)
    assert len(bench.answers) == 1
    bench.handover.answer(request, yes=True)
    assert len(bench.answers) == 1
    assert bench.reported[-1] == "Not given: panel on pts/9 (pid 77) requests it no longer."


async def test_request_may_be_refused_by_a_person(bench: Bench) -> None:
    bench.session.arming.arm()
    bench.facts.events.emit(ControlRequested(1, REMOTE))
    bench.handover.answer(bench.handover.requests[1], yes=False)
    assert bench.answers == [("reply", 1, REMOTE.id, False)]
    assert bench.session.arming.armed


@pytest.mark.parametrize(
    ("status", "yes"), [(0x0233, True), (0x0637, False), (None, False)], ids=str
)
async def test_unanswered_request_is_refused_unless_the_motor_is_at_standstill(
    bench: Bench, status: int | None, yes: bool
) -> None:
    bench.session.arming.arm()
    bench.facts.events.emit(ControlRequested(1, REMOTE))
    await asyncio.sleep(0.05)
    bench.clock.advance(REQUEST_ANSWERED_WITHIN + 1)
    if status is not None:
        bench.shows(status)
    await asyncio.to_thread(eventually, lambda: len(bench.answers) > 0)
    assert bench.answers == [("reply", 1, REMOTE.id, yes)]
    assert bench.session.arming.armed is False or not yes


async def test_answered_request_does_not_expire(bench: Bench) -> None:
    bench.session.arming.arm()
    bench.facts.events.emit(ControlRequested(1, REMOTE))
    bench.handover.answer(bench.handover.requests[1], yes=False)
    bench.facts.events.emit(ControlRequested(1, REMOTE))
    await expires(bench)
    await asyncio.sleep(0.05)
    assert [answer[3] for answer in bench.answers] == [False, False]


@pytest.mark.parametrize(("status", "yes"), [(0x0233, True), (0x0637, False), (None, False)])
async def test_program_without_a_person_answers_immediately(
    bench: Bench, status: int | None, yes: bool
) -> None:
    bench.handover.person = False
    if status is not None:
        bench.shows(status)
    bench.facts.events.emit(ControlRequested(1, REMOTE))
    assert bench.answers == [("reply", 1, REMOTE.id, yes)]


async def test_request_for_an_unknown_drive_is_refused(bench: Bench) -> None:
    bench.handover.person = False
    bench.facts.events.emit(ControlRequested(4, REMOTE))
    assert bench.answers == [("reply", 4, REMOTE.id, False)]


async def test_request_of_an_exited_program_ends(bench: Bench) -> None:
    bench.session.arming.arm()
    bench.facts.events.emit(ControlRequested(1, REMOTE))
    request = bench.handover.requests[1]
    bench.facts.set_programs((bench.facts.me,))
    assert bench.handover.requests == {}
    bench.handover.answer(request, yes=True)
    assert bench.answers == []
    assert bench.session.arming.armed
    assert bench.reported[-1].startswith("Not given: ")
    # the answer to it is none to the next question
    bench.facts.set_programs((bench.facts.me, REMOTE))
    bench.facts.events.emit(ControlRequested(1, REMOTE))
    bench.handover.answer(request, yes=True)
    assert bench.answers == []


async def given_while_it_runs(bench: Bench) -> None:
    await asyncio.to_thread(bench.starts.begin, bench.session, "forward")
    bench.starts.sent(bench.session)
    bench.session.arming.arm()
    bench.session.note_command()
    bench.facts.events.emit(ControlRequested(1, REMOTE))
    bench.handover.answer(bench.handover.requests[1], yes=True)
    assert not bench.session.arming.armed


async def test_motor_given_away_is_not_stopped_at_the_exit(
    bench: Bench,
) -> None:
    await given_while_it_runs(bench)
    (mine,) = bench.starts_files()
    assert bench.session.commanded
    record = json.loads(mine.read_text())
    mine.with_name("other.json").write_text(json.dumps({**record, "pid": REMOTE.pid}))
    await asyncio.sleep(0.05)
    bench.clock.advance(TAKEN_LOOK)
    await asyncio.to_thread(eventually, lambda: not mine.exists())
    assert not bench.session.commanded


async def test_motor_not_taken_over_is_stopped_at_the_exit(bench: Bench) -> None:
    await given_while_it_runs(bench)
    await asyncio.sleep(0.05)
    bench.clock.advance(TAKEN_WITHIN + TAKEN_LOOK)
    await asyncio.to_thread(
        eventually, lambda: "has not taken the motor over" in bench.reported[-1]
    )
    assert len(bench.starts_files()) == 1
    assert bench.session.commanded
    assert bench.starts.stopped_by_others(1)


# Requests to another program


async def test_drive_of_another_commander_does_not_run(
    bench: Bench,
) -> None:
    bench.session.note_command()
    bench.starts.begin(bench.session, "forward")
    commanded_by_another(bench)
    assert bench.session.commanded  # its motor was started here, and its standstill is not known
    bench.facts.note_commander(1, None)
    bench.starts.give_away(bench.session)
    commanded_by_another(bench)
    assert not bench.session.commanded
    bench.session.note_command()
    bench.facts.events.emit(ControlRequested(1, REMOTE))
    bench.handover.answer(bench.handover.requests[1], yes=True)
    assert not bench.session.commanded


async def test_request_is_sent_and_its_answer_reported(bench: Bench) -> None:
    commanded_by_another(bench)
    bench.handover.ask_for(1)
    assert bench.voice.output == [("ask", 1)]
    bench.facts.hear_reply(1, "Drive 1 is commanded by panel.", yes=False)
    assert bench.reported[-1] == "Drive 1 is commanded by panel."
    assert bench.facts.commander(1) == REMOTE
    bench.facts.hear_reply(1, "", yes=True)
    assert bench.reported[-1] == "This drive is free. Press a to arm it."
    bench.session.arming.arm()


async def test_request_for_a_free_drive_is_refused_with_a_reason(bench: Bench) -> None:
    bench.handover.ask_for(1)
    assert bench.voice.output == []
    assert "No other program commands this drive" in bench.reported[-1]


@pytest.mark.parametrize(("status", "adopted"), [(0x0637, 1), (0x0233, 0)])
async def test_granted_running_motor_belongs_to_this_program(
    bench: Bench, status: int, adopted: int
) -> None:
    """From then on its end stops it, and a kill of it is found."""
    commanded_by_another(bench)
    bench.shows(status)
    bench.facts.hear_reply(1, "", yes=True)
    await asyncio.sleep(0.1)
    await asyncio.to_thread(eventually, lambda: len(bench.starts_files()) == adopted)


async def test_arrivals_and_commanders_are_reported_once(bench: Bench) -> None:
    other = Program("other", "watch", 78)
    bench.facts.set_programs((bench.facts.me, REMOTE, other))
    bench.facts.note_commander(1, REMOTE.id)
    bench.facts.set_programs((bench.facts.me, REMOTE))
    assert bench.reported == [
        "The line is shared with panel on pts/9 (pid 77).",
        "The line is shared with watch (pid 78).",
        "The commander of this drive is now panel on pts/9 (pid 77).",
        "The line is no longer shared with watch (pid 78).",
    ]


async def test_earlier_program_that_disappears_is_reported(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The motor that it leaves is followed, whichever program opened the line first."""
    line = FakeLine({1: {}})
    line.facts.set_programs((line.facts.me, REMOTE))
    starts, looked = StartKeeper("panel"), asyncio.Event()
    loop = asyncio.get_running_loop()
    monkeypatch.setattr(starts, "look", lambda _: loop.call_soon_threadsafe(looked.set))
    fleet = Fleet(line, Journal(), starts)
    fleet.take(DriveSession(line, 1, library.load("atv71")))
    await asyncio.wait_for(looked.wait(), 20)
    looked.clear()
    line.facts.set_programs((line.facts.me,))
    await asyncio.wait_for(looked.wait(), 20)
    fleet.forget()


async def test_new_fleet_knows_the_current_commander() -> None:
    line = FakeLine({1: {}})
    line.facts.set_programs((line.facts.me, REMOTE))
    line.facts.note_commander(1, REMOTE.id)
    fleet = Fleet(line, Journal())
    assert any("The commander of this drive is now" in event.text for event in fleet.events.events)
    fleet.handover.close()


@pytest.mark.parametrize(("after", "yes"), [(1.5, True), (2.5, False)])
async def test_observed_standstill_is_valid_for_two_seconds(
    bench: Bench, after: float, yes: bool
) -> None:
    bench.handover.person = False
    bench.shows(0x0231)
    bench.clock.advance(after)
    bench.handover._requested(1, REMOTE)
    assert bench.answers == [("reply", 1, REMOTE.id, yes)]


async def test_request_stays_open_for_fifteen_seconds(bench: Bench) -> None:
    bench.shows(0x0231)
    bench.handover._requested(1, REMOTE)
    await asyncio.sleep(0.05)
    bench.clock.advance(13)
    await asyncio.sleep(0.1)
    assert bench.answers == []
    bench.clock.advance(3)
    await asyncio.to_thread(eventually, lambda: len(bench.answers) > 0)


async def test_notice_of_another_program_is_an_event_of_a_stop_with_its_drive(
    bench: Bench,
) -> None:
    for device in (1, 0):
        bench.facts.events.emit(NoticeReceived(device, f"A notice about {device}."))
    assert [(event.kind, event.text, event.device) for event in bench.events.events[-2:]] == [
        ("stop", "A notice about 1.", 1), ("stop", "A notice about 0.", None),
    ]  # fmt: skip
