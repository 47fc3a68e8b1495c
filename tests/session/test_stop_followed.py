"""Stops of a drive without a wire: their order, what follows them, and their reports."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Sequence
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.api import LineStatus, Priority
from tui.bus.errors import (
    OUTCOME_UNKNOWN,
    DeviceException,
    LineError,
    LineFailed,
    LineLost,
    NoAnswer,
    RequestRefused,
)
from tui.bus.requests import Read, WriteOne
from tui.drive.orders import OrderRefused
from tui.drive.profile import library
from tui.drive.profile.schema import OrderId
from tui.safety import STOP_TRIES
from tui.session.clock import Clock
from tui.session.command import stop as stops
from tui.session.command.last_stop import LastStop, end_work
from tui.session.command.motor_stop import FirstWave, MotorStop, with_other_way
from tui.session.command.stop import Stopper
from tui.session.command.stop_report import OVER, Phase, StopReport, not_stopped
from tui.session.drive import DriveSession
from tui.session.events import EventLog
from tui.session.journal import Journal
from tui.session.settings.write import Writer

from .fakes import OneDrive

PROFILE = library.load("atv312")
STATUS, COMMAND, HERTZ = (PROFILE[code].address for code in ("ETA", "CMD", "rFr"))
RUNNING, SWITCHED_ON, STOPPING = 0x0627, 0x0223, 0x0607
LONG_RAMP = 3000


class OwnTime(Clock):
    """Time that advances only during sleeps."""

    def __init__(self) -> None:
        self.now = 1000.0

    def monotonic(self) -> float:
        return self.now

    async def sleep(self, seconds: float) -> None:
        await asyncio.sleep(0)
        self.now += seconds

    def line_time(self, reported: float) -> float:
        return self.now


class Ramp(OneDrive):
    """An Altivar 312 that runs by the line; from its stop on its frequency falls for a time."""

    def __init__(self, clock: OwnTime, seconds: float, falls: int = 1) -> None:
        super().__init__(dict.fromkeys(range(0x10000), 0))
        held = {"LAC": 2, "CHCF": 1, "Fr1": 164}
        self.registers.update({PROFILE[code].address: raw for code, raw in held.items()})
        self.registers[STATUS], self.registers[HERTZ] = RUNNING, LONG_RAMP
        self.clock, self.seconds, self.falls = clock, seconds, falls
        self.stopped_at: float | None = None

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        if self.stopped_at is None:
            return
        if self.clock.now - self.stopped_at >= self.seconds:
            self.registers[STATUS], self.registers[HERTZ] = SWITCHED_ON, 0
        elif HERTZ in registers:
            self.registers[HERTZ] -= self.falls

    async def write(self, device: int, address: int, values: Sequence[int], **how: Any) -> float:
        if address == COMMAND and self.stopped_at is None:
            self.stopped_at = self.clock.now
        return await super().write(device, address, values, **how)


async def followed(drive: Ramp) -> StopReport:
    """The last report of a stop."""
    journal = Journal()
    stopper = Stopper(drive, journal)
    stopper.stop([DriveSession(drive, 1, PROFILE, clock=drive.clock)])
    async with asyncio.timeout(20.0):
        while stopper.reports[1].phase not in OVER:  # noqa: ASYNC110 - as the drive's clock goes
            await asyncio.sleep(0)
    journal.close()
    return stopper.reports[1]


@pytest.mark.parametrize("seconds", [0.0, 5.0, 58.0])
async def test_motor_on_a_ramp_is_followed_to_standstill(seconds: float) -> None:
    clock = OwnTime()
    report = await followed(Ramp(clock, seconds))
    assert (report.phase, report.text) == (Phase.STOPPED, "stopped")
    assert clock.now - 1000.0 < seconds + 2.0


async def test_motor_that_still_turns_after_a_minute_is_not_stopped() -> None:
    clock = OwnTime()
    report = await followed(Ramp(clock, 1000.0))
    assert report.phase is Phase.FAILED
    assert report.text.startswith("NOT STOPPED")
    assert "still turns after a minute" in report.text
    assert 60.0 <= clock.now - 1000.0 < 62.0


async def test_motor_that_does_not_slow_down_is_not_stopped() -> None:
    clock = OwnTime()
    report = await followed(Ramp(clock, 1000.0, falls=0))
    assert report.phase is Phase.FAILED
    assert "it answers and runs on" in report.text
    assert 1.5 <= clock.now - 1000.0 < 10.0


# -- one stop, step by step ------------------------------------------------------------------------


@pytest.fixture
def journal() -> Iterator[Journal]:
    """A journal in the test's own folder."""
    made = Journal()
    yield made
    made.close()


class OneStop:
    """A stop of a drive, and all that it reports."""

    def __init__(
        self, drive: Ramp, journal: Journal, order: OrderId = "stop", wave: FirstWave | None = None
    ) -> None:
        self.drive = drive
        self.reports: list[tuple[Phase, str, float]] = []
        self.session = DriveSession(drive, 1, PROFILE, clock=drive.clock)
        writer = Writer(self.session, journal, None)
        self.stop = MotorStop(
            self.session, writer, order, drive.clock.now,
            lambda _, *report: self.reports.append(report), wave=wave,
        )  # fmt: skip

    @property
    def written(self) -> list[int]:
        """The words that were written, in their order."""
        return [item.value for item in self.drive.requests if isinstance(item, WriteOne)]


async def turns(count: int = 50) -> None:
    """Let other work go on as far as it can."""
    for _ in range(count):
        await asyncio.sleep(0)


async def test_wave_sends_its_word_before_it_reads_and_waits_for_the_others(
    journal: Journal,
) -> None:
    wave = FirstWave([1, 2])
    here = OneStop(Ramp(OwnTime(), 0.0), journal, wave=wave)
    assert (here.stop.begun, here.stop.sent, here.stop.taken, here.stop.over) == (False,) * 4
    work = asyncio.create_task(here.stop.carry_out())
    async with asyncio.timeout(20.0):
        while not here.stop.taken:  # noqa: ASYNC110 - the journal has a thread
            await asyncio.sleep(0)
    await turns()
    assert (here.drive.requests, here.written) == ([WriteOne(1, COMMAND, 7)], [7])
    assert (here.stop.begun, here.stop.sent) == (True, True)
    wave.passed(2)
    assert await work is None
    assert here.written == [7], "an acknowledged word is not sent twice"
    assert {time for *_, time in here.reports} == {1000.0}
    assert [phase for phase, *_ in here.reports] == [Phase.STOPPING, Phase.STOPPED]


async def test_second_attempt_of_a_stop_reads_and_sends_again_without_a_wave(
    journal: Journal,
) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal, wave=FirstWave([1, 2]))
    here.stop.sent = True
    assert await here.stop.carry_out() is None
    assert here.written == [7]
    assert await here.stop.carry_out() is None
    assert here.written == [7, 7], "the first acknowledgment does not count for it"


async def test_unanswered_word_counts_as_sent_and_as_a_command_of_this_program(
    journal: Journal,
) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    here.drive.fail_write(1, COMMAND, NoAnswer(1, 6, COMMAND))
    assert not here.session.reported_by_line
    with pytest.raises(NoAnswer):
        await here.stop.carry_out()
    assert here.stop.sent
    assert not here.stop.taken
    assert here.stop.answered is None
    assert here.session.reported_by_line, "its word is not that of another program"
    assert here.reports == [(Phase.STOPPING, "Ramp stop", 1000.0)]


async def test_stop_reads_its_command_word_again_only_if_it_keeps_bits_of_it(
    journal: Journal,
) -> None:
    for held in (None, 0x000F):
        here = OneStop(Ramp(OwnTime(), 0.0), journal)
        if held is not None:
            here.session.image.confirm("CMD", held, 1000.0)
        await here.stop.carry_out()
        after = here.drive.requests.index(WriteOne(1, COMMAND, 7))
        reads = [cast(Read, request) for request in here.drive.requests[after + 1 :]]
        registers = [request.address + n for request in reads for n in range(request.count)]
        assert (COMMAND in registers) == (held is not None)


async def test_motion_is_the_kind_of_state_and_the_frequency_without_its_sign(
    journal: Journal,
) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    chart = PROFILE.data.charts[0]
    here.drive.registers[HERTZ] = 0x10000 - 125
    assert await here.stop._motion(chart) == ("running", 12.5)
    here.drive.registers[STATUS] = SWITCHED_ON
    assert (await here.stop._motion(chart))[0] == "stopped"


@pytest.mark.parametrize(
    ("hertz", "seconds"),
    [
        ([30.0], 1.65),
        ([30.0, 30.0, 29.0], 1.95),
        ([30.0, 31.0, 31.0], 1.65),
        ([0.0, 0.5, 0.5], 1.65),
        ([0.5, 0.5, 0.0], 1.95),
    ],
)
async def test_motor_runs_on_if_it_has_not_slowed_down_for_the_time_it_has_to_obey(
    hertz: list[float], seconds: float, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    seen = iter(hertz)
    last = hertz[-1]

    async def motion(_: object) -> tuple[str, float]:
        return "running", next(seen, last)

    monkeypatch.setattr(MotorStop, "_motion", lambda _, chart: motion(chart))
    monkeypatch.setattr("tui.session.command.motor_stop.last_word", lambda *_: None)
    why = await here.stop.carry_out()
    assert why is not None
    assert here.drive.clock.now - 1000.0 == pytest.approx(seconds, abs=0.01)
    assert ("still enabled" in why) == (last == 0.0)


@pytest.mark.parametrize(
    ("status", "read_ago", "rest_ago", "certain"),
    [
        (RUNNING, 0.0, None, True),
        (RUNNING, 60.0, None, True),
        (RUNNING, 60.0, 90.0, True),
        (STOPPING, 60.0, None, True),
        (RUNNING, 60.0, 60.0, False),
        (RUNNING, 60.0, 30.0, False),  # it may have been changed at rest since
        (SWITCHED_ON, 60.0, None, False),
        (SWITCHED_ON, 0.0, None, True),
        (None, 60.0, None, False),
    ],
)
def test_setting_that_cannot_change_while_the_motor_runs_is_certain(
    status: int | None, read_ago: float, rest_ago: float | None, certain: bool, journal: Journal
) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    assert PROFILE["CHCF"].access == "rw-stopped"
    here.session.image.confirm("CHCF", 1, 1000.0 - read_ago)
    if status is not None:
        here.session.image.confirm("ETA", status, 1000.0)
    if rest_ago is not None:
        here.session.rest_seen = 1000.0 - rest_ago
    assert here.stop._sure(["CHCF", "FR1"]) == ({"CHCF": 1} if certain else {})


@pytest.mark.internal_errors
async def test_error_of_the_journal_fails_a_write_and_no_stop(
    journal: Journal, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)

    def full(*_: object, **__: object) -> None:
        raise OSError("the disk is full")

    monkeypatch.setattr(journal, "add", full)
    assert await here.stop.carry_out() is None
    assert (here.written, here.stop.taken) == ([7], True)
    assert "a stop of device 1 is not in the journal" in caplog.text
    permit = SimpleNamespace(check=lambda: None, refusal=lambda: "")
    writer = Writer(here.session, journal, cast(Any, permit))
    with pytest.raises(OSError, match="disk is full"):
        await writer.write_parameter(PROFILE["LFr"], 100, why="a test")


# -- several stops ---------------------------------------------------------------------------------


async def until_over(stopper: Stopper, devices: Sequence[int]) -> None:
    async with asyncio.timeout(20.0):
        while any(  # noqa: ASYNC110 - as the drive's clock goes
            stopper.reports[device].phase not in OVER for device in devices
        ):
            await asyncio.sleep(0)


async def test_phases_of_a_stop_are_events_with_the_time_at_which_each_began(
    journal: Journal,
) -> None:
    drive, events = Ramp(OwnTime(), 5.0), EventLog()
    stopper = Stopper(drive, journal, events)
    seen: dict[Phase, float] = {}
    stopper.stop([DriveSession(drive, 1, PROFILE, clock=drive.clock)])
    while (report := stopper.reports[1]).phase not in OVER:
        seen[report.phase] = report.since
        assert report.time == 1000.0
        await asyncio.sleep(0)
    assert seen == {Phase.SENDING: 1000.0, Phase.STOPPING: 1000.0}
    assert report.since == drive.clock.now >= 1005.0
    assert [(event.kind, event.text, event.device) for event in events.events] == [
        ("stop", "The stop waits for the line.", 1),
        ("stop", "Stopping: Ramp stop", 1),
        ("stop", "The motor is stopped.", 1),
    ]


@pytest.mark.parametrize("given", [True, False])
async def test_stop_is_given_to_all_programs_unless_they_know_of_it(
    given: bool, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    drive, heard = Ramp(OwnTime(), 0.0), []
    monkeypatch.setattr(drive.facts, "give_stop", lambda *these: heard.append(these))
    session = DriveSession(drive, 1, PROFILE, clock=drive.clock)
    stopper = Stopper(drive, journal)
    stopper.stop([session], by="a test", given=given)
    assert heard == ([] if given else [([1], "a test")])
    await until_over(stopper, [1])


async def test_wave_does_not_wait_for_a_drive_that_answers_nothing(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    drive = Ramp(OwnTime(), 0.0)
    silent = DriveSession(drive, 2, PROFILE, clock=drive.clock)
    with pytest.raises(NoAnswer):
        await drive.read(2, STATUS)
    waves: list[list[int]] = []

    class Wave(FirstWave):
        def __init__(self, devices: Any) -> None:
            waves.append(list(devices))
            super().__init__(waves[-1])

    monkeypatch.setattr(stops, "FirstWave", Wave)
    stopper = Stopper(drive, journal)
    live = DriveSession(drive, 1, PROFILE, clock=drive.clock)
    stopper.stop([silent, live])
    assert waves == [[1]]
    assert [work.stop.session.device for work in stopper._under_way.values()] == [1, 2]
    await until_over(stopper, [1, 2])
    assert stopper.reports[1].phase is Phase.STOPPED
    assert stopper.reports[2].phase is Phase.FAILED


class Silent(Ramp):
    """A drive that answers nothing, each exchange a second long, until a number of writes."""

    def __init__(self, clock: OwnTime, writes: int) -> None:
        super().__init__(clock, 0.0)
        self.left = writes

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        if self.left:
            await self.clock.sleep(1.0)
            raise NoAnswer(device, 3, registers[0])
        await super().before_read(device, registers, priority)

    async def write(self, device: int, address: int, values: Sequence[int], **how: Any) -> float:
        if self.left:
            await self.clock.sleep(1.0)
            self.left -= 1
            raise NoAnswer(device, 6, address, f"Device {device} did not answer.{OUTCOME_UNKNOWN}")
        return await super().write(device, address, values, **how)


@pytest.mark.parametrize(("writes", "last"), [(2, Phase.STOPPED), (STOP_TRIES, Phase.FAILED)])
async def test_silent_drive_is_not_stopped_long_before_the_last_try(
    writes: int, last: Phase, journal: Journal
) -> None:
    drive, events = Silent(OwnTime(), writes), EventLog()
    stopper = Stopper(drive, journal, events)
    stopper.stop([DriveSession(drive, 1, PROFILE, clock=drive.clock)])
    reports: list[StopReport] = []
    async with asyncio.timeout(20.0):
        while stopper.reports[1].phase not in OVER:
            if stopper.reports[1] not in reports:
                reports.append(stopper.reports[1])
            await asyncio.sleep(0)
    silent = next(report for report in reports if report.phase is Phase.UNHEEDED)
    assert silent.since - silent.time <= 3.0
    assert "does not answer. The stop is repeated. Stop it at the machine." in silent.text
    assert stopper.reports[1].phase is last
    assert "may or may not" not in stopper.reports[1].text
    texts = [event.text for event in events.events if "The stop is repeated" in event.text]
    assert len(texts) == 1  # once, whatever the tries


async def test_stop_of_a_lost_line_is_left_to_the_prepared_frames(journal: Journal) -> None:
    drive = Ramp(OwnTime(), 0.0)
    stopper = Stopper(drive, journal)
    sent: list[tuple[object, ...]] = []

    def send(session: DriveSession, ordered: float, error: Exception, *, taken: bool) -> None:
        sent.append((session.device, ordered, type(error), taken))

    stopper._last = cast(Any, SimpleNamespace(send=send))
    drive.become(LineStatus.LOST, "unplugged")
    stopper.stop([DriveSession(drive, 1, PROFILE, clock=drive.clock)])
    await turns()
    assert sent == [(1, 1000.0, LineLost, False)]


# -- prepared frames, after an internal error ------------------------------------------------------


class Prepared:
    """A last stop of a drive; `ended` is called as the line does once its frames are sent."""

    def __init__(self, journal: Journal, monkeypatch: pytest.MonkeyPatch) -> None:
        self.drive = Ramp(OwnTime(), 0.0)
        self.session = DriveSession(self.drive, 1, PROFILE, clock=self.drive.clock)
        self.reports: list[tuple[int, Phase, str, float]] = []
        self.entries: list[Any] = []
        self.sent: list[object] = []
        self.why = ""
        self.fails: Exception | None = None
        monkeypatch.setattr(journal, "add", lambda entry, **_: self.entries.append(entry))
        monkeypatch.setattr(self.drive, "send_prepared", self._send)
        self.last = LastStop(self.drive, journal, self._say)

    def _say(self, session: DriveSession, phase: Phase, text: str, ordered: float) -> None:
        self.reports.append((session.device, phase, text, ordered))

    def _send(self, writes: Any, ended: Callable[[str], None]) -> None:
        self.sent.append(writes)
        if self.fails is not None:
            raise self.fails
        ended(self.why)

    def send(self, error: Exception, *, taken: bool = False) -> tuple[int, Phase, str, float]:
        self.last.send(self.session, 990.0, error, taken=taken)
        return self.reports[-1]


LOST, BROKEN = LineLost("The line is lost."), ZeroDivisionError("on purpose")
AT = "Stop it at the machine."


@pytest.mark.internal_errors
async def test_prepared_frames_are_recorded_and_the_motor_is_followed(
    journal: Journal, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    here = Prepared(journal, monkeypatch)
    here.session.image.confirm("CMD", 15, 1000.0)
    here.drive.stopped_at = 1000.0
    assert here.session.prepared
    text = "stop sent by its prepared frames after an internal error; see the log"
    assert here.send(BROKEN) == (1, Phase.STOPPING, text, 990.0)
    assert here.sent == [here.session.prepared]
    assert here.session.reported_by_line
    assert "CMD" not in here.session.image.trusted, "it holds another word now"
    written = [
        write.request for write in here.session.prepared if isinstance(write.request, WriteOne)
    ]
    assert [(entry.address, entry.new_raw, entry.new, entry.why) for entry in here.entries] == [
        (request.address, request.value, f"16#{request.value:04X}", text) for request in written
    ]
    assert {entry.code for entry in here.entries} == {"CMD"}
    assert "stop of device 1" in caplog.text
    async with asyncio.timeout(20.0):
        while here.reports[-1][1] is not Phase.STOPPED:  # noqa: ASYNC110 - as its clock goes
            await asyncio.sleep(0)
    assert here.reports[-1] == (1, Phase.STOPPED, "stopped", 990.0)


@pytest.mark.internal_errors
@pytest.mark.parametrize(
    ("error", "why", "fails", "text"),
    [
        (BROKEN, "the port is closed", None, "NOT STOPPED: an internal error (see the log), and its"
         f" prepared frame was not sent: the port is closed. {AT}"),
        (BROKEN, "", OSError("no port"), "NOT STOPPED: an internal error (see the log), and its"
         f" prepared frame was not sent: no port. {AT}"),
        (BROKEN, "", OSError(), "NOT STOPPED: an internal error (see the log), and its"
         f" prepared frame was not sent: OSError. {AT}"),
        (LOST, "the port is closed", None, f"NOT STOPPED: The line is lost. {AT}"),
    ],
)  # fmt: skip
async def test_prepared_frames_that_are_not_sent_leave_the_motor_to_a_person(
    error: Exception, why: str, fails: Exception | None, text: str,
    journal: Journal, monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    here = Prepared(journal, monkeypatch)
    here.why, here.fails = why, fails
    assert here.send(error) == (1, Phase.FAILED, text, 990.0)
    assert here.entries == []


@pytest.mark.internal_errors
async def test_no_other_word_follows_one_that_the_drive_has_acknowledged(
    journal: Journal, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    here = Prepared(journal, monkeypatch)
    internal = "NOT STOPPED: an internal error (see the log)"
    sent = f"{internal}. Its stop was sent, but not seen to work. {AT}"
    assert here.send(BROKEN, taken=True) == (1, Phase.FAILED, sent, 990.0)
    assert here.send(LineFailed("It failed."), taken=True)[2] == sent
    caplog.clear()
    assert here.send(LOST, taken=True)[2] == f"NOT STOPPED: The line is lost. {AT}"
    assert caplog.text == "", "a lost line is no internal error"
    here.session.prepared = ()
    assert here.send(LOST)[2] == f"NOT STOPPED: The line is lost. {AT}"
    none = f"{internal}, and no frame was ready. {AT}"
    assert here.send(BROKEN) == (1, Phase.FAILED, none, 990.0)
    assert here.sent == []


async def test_stop_on_a_lost_line_is_sent_on_a_connection_of_its_own(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Prepared(journal, monkeypatch)
    here.drive.spawn = lambda *_: None  # type: ignore[method-assign,assignment]
    text = "stop sent on a connection of its own, as the line was lost"
    assert here.send(LOST) == (1, Phase.STOPPING, text, 990.0)


@pytest.mark.internal_errors
async def test_motor_that_cannot_be_followed_counts_as_not_stopped(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = Prepared(journal, monkeypatch)

    def closed(*_: object) -> None:
        raise RuntimeError("closed")

    here.drive.spawn = closed  # type: ignore[method-assign,assignment]
    assert "not seen to work" in here.send(BROKEN)[2]
    for error, text in (
        (NoAnswer(1, 3, 100), "NOT STOPPED: "), (BROKEN, "not seen to work")
    ):  # fmt: skip

        async def follow(_: MotorStop, error: Exception = error) -> None:
            raise error

        monkeypatch.setattr(MotorStop, "follow", follow)
        await here.last._follow(here.session, 990.0)
        assert here.reports[-1][1] is Phase.FAILED
        assert text in here.reports[-1][2]


@pytest.mark.internal_errors
@pytest.mark.parametrize("fails", [True, False])
def test_stop_count_of_a_drive_rises_once_whatever_fails(
    fails: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    drive = Ramp(OwnTime(), 0.0)
    session = DriveSession(drive, 1, PROFILE, clock=drive.clock)
    withdrawn: list[object] = []
    session.starts = cast(Any, SimpleNamespace(withdraw=withdrawn.append))
    if fails:
        monkeypatch.setattr(session.work, "stop", lambda by: 1 / 0)
    before = session.work.stops
    end_work(session, "a test")
    assert session.work.stops == before + 1
    assert withdrawn == [session]
    session.starts = None
    end_work(session, "a test")
    assert session.work.stops == before + 2


# -- the stop of all, step by step -----------------------------------------------------------------


@pytest.mark.parametrize(
    ("phase", "kind"),
    [
        (Phase.SENDING, "stop"), (Phase.STOPPING, "stop"), (Phase.STOPPED, "stop"),
        (Phase.UNHEEDED, "failed"), (Phase.FAILED, "failed"),
    ],
)  # fmt: skip
async def test_report_of_a_motor_that_does_not_stop_is_an_event_of_its_own_kind(
    phase: Phase, kind: str, journal: Journal
) -> None:
    drive, events = Ramp(OwnTime(), 0.0), EventLog()
    stopper = Stopper(drive, journal, events)
    session = DriveSession(drive, 1, PROFILE, clock=drive.clock)
    stopper._say(session, phase, "text", 990.0)
    drive.clock.now += 5.0
    stopper._say(session, phase, "another text", 990.0)
    assert [(event.kind, event.device) for event in events.events] == [(kind, 1)]
    assert stopper.reports[1] == StopReport(1, phase, "another text", 990.0, 1000.0)
    stopper._say(session, phase, "third text", 991.0)
    assert len(events.events) == 2, "of another stop"
    assert stopper.reports[1].since == 1005.0


async def test_work_of_each_stop_has_its_name(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    drive, names = Ramp(OwnTime(), 0.0), []
    spawn = drive.spawn

    def spawned(work: Any, name: str) -> Any:
        names.append(name)
        return spawn(work, name)

    monkeypatch.setattr(drive, "spawn", spawned)
    sessions = [DriveSession(drive, device, PROFILE, clock=drive.clock) for device in (1, 2)]
    stopper = Stopper(drive, journal)
    stopper.stop(sessions[:1])
    await until_over(stopper, [1])
    assert names == ["stop 1"]
    stopper.stop(sessions)
    assert names == ["stop 1", "stop 1", "stop 2", "stop all"]
    await until_over(stopper, [1, 2])


class Way:
    """A way to stop with its register and words."""

    type, shift, mask = "uint16", 0, 0xFFFF

    def __init__(self, address: int, *words: int, broadcast: bool = True) -> None:
        self.address, self.words, self.broadcast = address, words, broadcast
        self.place, self.is_bits = address, False


async def test_broadcast_follows_the_wave_with_each_word_once(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    ways: dict[int, Any] = {
        1: Way(100, 7, -1), 2: Way(100, 7), 3: Way(200, 7), 4: OrderRefused("none"),
        5: None, 6: Way(300, 7, broadcast=False), 7: Way(400, 9),
    }  # fmt: skip
    done: list[object] = []
    drive = Ramp(OwnTime(), 0.0)

    def choose(device: int, order: str, raws: object) -> Any:
        assert (order, raws) == ("quick-stop", f"raws {device}")
        if isinstance(ways[device], Exception):
            raise ways[device]
        return ways[device]

    async def broadcast(address: int, words: list[int], **how: Any) -> None:
        done.append((address, *words, how["limits"], how["priority"]))

    monkeypatch.setattr(stops, "chart_in_force", lambda profile, raws: profile)
    monkeypatch.setattr(stops, "choose", choose)
    monkeypatch.setattr(stops, "order_target", lambda profile, chart, found: found)
    monkeypatch.setattr(stops, "limits_of", lambda profile: f"limits {profile}")
    monkeypatch.setattr(drive, "broadcast", broadcast)

    class Wave:
        def passed(self, device: int) -> None:
            done.append(device)

        async def over(self) -> None:
            done.append("over")

    sessions = [
        SimpleNamespace(profile=device, image=SimpleNamespace(trusted=f"raws {device}"))
        for device in ways
    ]
    stopper = Stopper(drive, journal)
    await stopper._behind_wave(cast(Any, Wave()), {9}, cast(Any, sessions), "quick-stop")
    assert done == [
        9, "over", (100, 7, "limits 1", Priority.STOP), (100, 0xFFFF, "limits 1", Priority.STOP),
        (200, 7, "limits 3", Priority.STOP), (400, 9, "limits 7", Priority.STOP),
    ]  # fmt: skip


async def test_motion_of_a_drive_without_a_status_word_is_unknown(journal: Journal) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    here.drive.fail_read(1, STATUS, 2)
    kind, _ = await here.stop._motion(PROFILE.data.charts[0])
    assert kind == "unknown"
    here.drive.fail_read(1, HERTZ, 2)
    assert await here.stop._motion(PROFILE.data.charts[0]) == ("unknown", None)


@pytest.mark.parametrize(
    ("wanted", "order", "text"),
    [
        ("stop", "stop", "on"), ("stop", "quick-stop", "on (it has no ramp stop: quick stop)"),
        ("emergency-stop", "stop", "on (it has no emergency stop: ramp stop)"),
    ],
)  # fmt: skip
def test_progress_names_the_way_that_the_drive_lacks(
    wanted: OrderId, order: OrderId, text: str
) -> None:
    assert with_other_way("on", wanted, order) == text


class Tried:
    """A stop whose attempts end as a test says."""

    def __init__(self, *ends: str | Exception | None) -> None:
        self.session: Any = SimpleNamespace(device=1)
        self.ordered, self.taken, self.over, self.tries = 990.0, True, False, 0
        self.ends = ends

    async def carry_out(self) -> str | None:
        end = self.ends[min(self.tries, len(self.ends) - 1)]
        self.tries += 1
        if isinstance(end, Exception):
            raise end
        return end

    def tell_silent(self) -> None:
        """Report nothing."""


REFUSED, SILENT = DeviceException(1, 6, COMMAND, 4), NoAnswer(1, 6, COMMAND)


@pytest.mark.parametrize(
    ("ends", "tries", "why"),
    [
        ((None,), 1, ""),
        (("it turns.", None), 2, ""),
        ((SILENT, None), 2, ""),
        ((REFUSED, None), 2, ""),
        ((OrderRefused("no way"), None), 2, ""),
        ((SILENT,), STOP_TRIES, str(SILENT)),
        ((REFUSED,), STOP_TRIES, str(REFUSED)),
        (("it turns.",), STOP_TRIES, "it turns."),
        ((RequestRefused("read-only"), None), 1, "read-only"),
        ((LineError("broken"), None), 1, "broken"),
    ],
)
async def test_stop_is_tried_again_unless_no_further_try_can_help(
    ends: tuple[str | Exception | None, ...], tries: int, why: str, journal: Journal
) -> None:
    stopper = Stopper(Ramp(OwnTime(), 0.0), journal)
    reported: list[tuple[object, ...]] = []
    cast(Any, stopper)._say = lambda *those: reported.append(those)
    stop = Tried(*ends)
    await stopper._stop(cast(Any, stop))
    assert (stop.tries, stop.over) == (tries, True)
    assert reported == ([(stop.session, Phase.FAILED, not_stopped(why), 990.0)] if why else [])


@pytest.mark.parametrize("error", [LineLost("unplugged"), ZeroDivisionError("on purpose")])
async def test_stop_that_fails_is_over_and_left_to_the_prepared_frames(
    error: Exception, journal: Journal
) -> None:
    stopper = Stopper(Ramp(OwnTime(), 0.0), journal)
    sent: list[tuple[object, ...]] = []
    stopper._last = cast(
        Any, SimpleNamespace(send=lambda *those, taken: sent.append((*those, taken)))
    )
    stop = Tried(error)
    await stopper._stop(cast(Any, stop))
    assert sent == [(stop.session, 990.0, error, True)]
    assert (stop.tries, stop.over) == (1, True)
