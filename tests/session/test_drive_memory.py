"""A drive as a program knows it: its registers, messages, presence and read plans."""

from __future__ import annotations

import math
from decimal import Decimal
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import Mock, call

import msgspec
import pytest

from tui.bus.errors import LineClosed
from tui.bus.line_events import NoteReceived, NoticeReceived, ProgramsChanged
from tui.bus.link import RtuTcpLink, TcpLink
from tui.bus.notes import LineNote
from tui.bus.poll_plan import USUAL_TURNAROUND
from tui.drive.profile import library
from tui.drive.values import Value
from tui.session.carry_on import carried_on
from tui.session.event_notes import (
    EVENTS_OF_LINE,
    MOST_CHARACTERS,
    SAME_WITHIN,
    EventNotes,
    LeftEvent,
)
from tui.session.events import Event, EventLog
from tui.session.fleet import PROGRAM_ENDS_WITHIN, Fleet
from tui.session.image import NEVER_READ, RegisterImage
from tui.session.read import kept_plans
from tui.session.read.kept_plans import PLANS_KEPT, TURNAROUND_STEP, KeptPlans
from tui.session.read.presence import PresenceRead, alive_read, presence_read
from tui.session.reading import Origin, Reading, reading_of, with_text

ATV71 = library.load("atv71")


# -- registers -------------------------------------------------------------------------------------


@pytest.fixture
def image() -> tuple[RegisterImage, list[float]]:
    """The image of a drive, and the time."""
    now = [10.0]
    return RegisterImage(ATV71, cast(Any, SimpleNamespace(monotonic=lambda: now[0]))), now


def bad(code: str, time: float, **why: bool) -> dict[str, Reading]:
    return {code: Reading.bad(ATV71[code], time, "no such word", **why)}


def test_value_has_its_age_and_trust(image: tuple[RegisterImage, list[float]]) -> None:
    held, now = image
    assert (held.get("ACC"), held.age("ACC")) == (None, math.inf)
    held.confirm("ACC", 30, 10.0)
    held.confirm("DEC", 40, 8.0)
    now[0] = 12.0
    reading = held.get("ACC")
    assert reading is not None
    assert (reading.raw, reading.time, reading.origin) == (30, 10.0, Origin.READ_BACK)
    assert (held.age("ACC"), held.age("DEC")) == (2.0, 4.0)
    assert held.fresh(2.0) == {"ACC": 30}, "the limit itself is fresh"
    assert held.fresh(4.0) == {"ACC": 30, "DEC": 40}
    held.distrust()
    assert dict(held.raws) == {"ACC": 30, "DEC": 40}
    assert (dict(held.trusted), held.fresh(60.0)) == ({}, {})
    held.confirm("ACC", 31, 12.0)
    assert dict(held.trusted) == {"ACC": 31}, "read at that moment"


def test_newer_of_two_replies_counts(image: tuple[RegisterImage, list[float]]) -> None:
    held, _ = image
    held.confirm("ACC", 30, 10.0)
    held.confirm("ACC", 20, 9.0)
    held.take(bad("ACC", 9.0))
    assert (dict(held.raws), dict(held.refused)) == ({"ACC": 30}, {})
    held.confirm("ACC", 31, 10.0)
    assert held.raws["ACC"] == 31, "of the same time, the last"
    held.take(bad("ACC", 11.0))
    held.confirm("ACC", 30, 10.5)
    assert (dict(held.raws), set(held.refused), held.get("ACC")) == ({}, {"ACC"}, None)
    assert held.lacking == frozenset()
    held.take(bad("ACC", 11.0, absent=True))
    assert held.lacking == {"ACC"}
    held.confirm("DEC", 40, NEVER_READ)
    held.confirm("ACC", 32, 12.0)
    assert (dict(held.raws), dict(held.refused)) == ({"ACC": 32}, {})


def test_written_word_is_unknown_until_it_is_read_after_that(
    image: tuple[RegisterImage, list[float]],
) -> None:
    held, now = image
    heard: list[int] = []
    held.confirm("ACC", 30, 10.0)
    held.confirm("DEC", 40, 10.0)
    now[0] = 11.0
    held.tell_once("ACC", heard.append)
    held.doubt("ACC")
    assert dict(held.raws) == {"DEC": 40}
    held.confirm("ACC", 30, 10.5)
    assert "ACC" not in held.raws, "of before the write"
    held.confirm("ACC", 31, 11.0)
    assert (held.raws["ACC"], heard) == (31, []), "it was written again before"
    held.tell_once("ACC", heard.append)
    held.take(bad("ACC", 11.5))
    held.confirm("DEC", 41, 12.0)
    held.confirm("ACC", 32, 12.0)
    held.confirm("ACC", 33, 13.0)
    assert heard == [32], "the first value, once"


def test_reading_has_its_number_its_age_and_its_origin() -> None:
    plain = Reading.undecoded(ATV71["ACC"], 30, 10.0, Origin.POLL)
    three, named = Value(30, Decimal("3.0"), "s", "3.0"), Value(0, None, "", "off")
    found = plain.decoded(three, named)
    assert (found.number, found.current_number, found.physical) == (3.0, 3.0, named)
    assert (found.origin, found.quality, found.time) == (Origin.POLL, plain.quality, 10.0)
    assert [plain.number, plain.decoded(named, None).number] == [None, None]
    assert [found.age(now) for now in (12.5, 10.0, 9.0)] == [2.5, 0.0, 0.0]
    assert reading_of(found) is found
    assert with_text({"ACC": found}) == {"ACC": found}


# -- presence --------------------------------------------------------------------------------------


def a_profile(codes: tuple[str, ...], *, silence: bool) -> Any:
    """A family by words of the monitoring set, which may be silent to reads of missing words."""
    values = [SimpleNamespace(parameter=code) for code in codes]
    profile = Mock(wraps=ATV71)
    profile.data = SimpleNamespace(
        monitoring=SimpleNamespace(values=values),
        charts=ATV71.data.charts,
        faults=ATV71.data.faults,
    )
    profile.__getitem__ = lambda _, code: ATV71[code]
    profile.function = lambda number: (
        SimpleNamespace(past_limit="silence" if silence else "exception") if number == 3 else None
    )
    return profile


def test_drive_is_kept_alive_by_a_word_that_it_surely_has() -> None:
    status = ATV71["ETA"]
    plain = presence_read(a_profile(("LCR", "RFR"), silence=False))
    assert plain == PresenceRead(status.address, 1, status.function)
    session = cast(Any, SimpleNamespace(profile=ATV71, device=3))
    kept = alive_read(session, 4.0)
    assert kept is not None
    assert (kept.device, kept.timeout, kept.address, kept.count) == (3, 4.0, status.address, 1)


def test_drive_without_a_known_state_is_kept_alive_by_its_fault_or_status_word() -> None:
    """Such a family has neither a state chart nor, perhaps, a fault."""
    profile = a_profile((), silence=False)
    profile.data.charts = ()
    input_word = SimpleNamespace(address=5, function=4)
    profile.quantity = {"status_word": input_word}.get
    profile.data.faults = SimpleNamespace(parameter="LFT")
    fault = ATV71["LFT"]
    assert presence_read(profile) == PresenceRead(fault.address, 1, fault.function)
    profile.data.faults = SimpleNamespace(parameter="")
    session = cast(Any, SimpleNamespace(profile=profile, device=3))
    kept = alive_read(session, 4.0)
    assert kept is not None
    assert (kept.address, kept.count, kept.function) == (5, 1, 4)
    profile.quantity = {}.get
    assert alive_read(session, 4.0) is None


def test_drive_that_is_silent_to_missing_words_is_kept_alive_by_two_neighbors() -> None:
    first, second = ATV71["ETA"], ATV71["RFR"]
    assert second.address == first.address + 1
    for codes in (("LCR", "ETA", "RFR"), ("RFR", "ETA")):
        found = presence_read(a_profile(codes, silence=True))
        assert found == PresenceRead(first.address, 2, first.function)
    alone = presence_read(a_profile(("LCR", "RFR"), silence=True))
    assert alone == PresenceRead(first.address, 1, first.function)


# -- messages --------------------------------------------------------------------------------------


@pytest.mark.internal_errors
def test_message_is_kept_once_and_passed_on(caplog: pytest.LogCaptureFixture) -> None:
    log = EventLog(lambda: 5.0)
    left: list[Event] = []
    log.left = left.append
    first = log.add("stop", "Stopped.", 1)
    assert first == Event(5.0, 1, "stop", "Stopped.")
    assert log.add("stop", "Stopped.", 1) is None
    others = [
        log.add("stop", "Stopped.", 2), log.add("done", "Stopped.", 2),
        log.add("done", "Stopping.", 2, wall=3.0), log.add("done", "Stopping."),
    ]  # fmt: skip
    assert None not in others
    assert list(log.events) == left == [first, *others]
    assert left[3].wall == 3.0
    assert log.newest is left[4]
    log.left = Mock(side_effect=ValueError("on purpose"))
    assert log.add("stop", "Stopped again.", 1) is log.events[-1]
    assert caplog.messages == ["a message was not sent to the other programs"]


def test_messages_are_shared_with_the_other_programs() -> None:
    facts, log = Mock(), EventLog(lambda: 5.0)
    facts.me.text = "panel (pid 1)"
    notes = EventNotes(facts, log)
    log.add("done", "x" * (MOST_CHARACTERS + 1), 1)
    ((note,),) = [sent.args for sent in facts.notes.leave.call_args_list]
    left = msgspec.msgpack.decode(note.data, type=LeftEvent)
    assert (note.device, note.kind, left.program) == (0, EVENTS_OF_LINE, "panel (pid 1)")
    assert (len(left.event.text), left.event[:3]) == (MOST_CHARACTERS, (5.0, 1, "done"))
    (hear,) = facts.events.subscribe.call_args.args

    def heard(event: Event, program: str = "run (pid 2)", device: int = 0) -> int:
        data = msgspec.msgpack.encode(LeftEvent(program, event))
        before = len(log.events)
        hear(NoteReceived(LineNote(device, EVENTS_OF_LINE, data)))
        return len(log.events) - before

    event = Event(8.0, 1, "stop", "Stopped.")
    assert heard(event, "panel (pid 1)") == 0, "its own"
    assert heard(event, device=1) == 0, "not of the line"
    assert heard(event) == 1
    assert log.events[-1] == event._replace(text="Stopped. (run (pid 2))")
    assert heard(event._replace(wall=8.0 + SAME_WITHIN - 0.5), "hold (pid 3)") == 0
    for other in (
        event._replace(wall=8.0 + SAME_WITHIN), event._replace(device=2),
        event._replace(kind="done"), event._replace(text="Stopping."),
    ):  # fmt: skip
        assert heard(other, "hold (pid 3)") == 1
    hear(NoteReceived(LineNote(0, "profile", b"")))
    hear(NoticeReceived(0, "text"))
    notes.ask()
    facts.notes.ask.assert_called_once_with(0, EVENTS_OF_LINE)


@pytest.mark.internal_errors
def test_failed_step_of_a_stop_is_logged_and_the_end_of_the_line_is_not(
    caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    carried_on(Mock(side_effect=ValueError("on purpose")))
    assert caplog.messages == ["an internal error on the way of a stop"]
    with pytest.raises(LineClosed):
        carried_on(Mock(side_effect=LineClosed))
    monkeypatch.setattr("tui.session.carry_on.log.exception", Mock(side_effect=OSError))
    carried_on(Mock(side_effect=ValueError("on purpose")))


# -- drives of a line ------------------------------------------------------------------------------


def a_fleet() -> Any:
    fleet = cast(Any, object.__new__(Fleet))
    fleet.line, fleet.starts, fleet.stopper = Mock(), Mock(), Mock()
    fleet.line.facts.departed, fleet._departed = {1: "a"}, {1: "a"}
    sessions = [SimpleNamespace(device=1), SimpleNamespace(device=3)]
    consoles = [SimpleNamespace(session=session) for session in sessions]
    fleet._found = dict(enumerate(SimpleNamespace(console=item) for item in (*consoles, None)))
    return fleet


def test_stop_of_the_fleet_has_its_drives_and_its_source() -> None:
    fleet = a_fleet()
    assert [session.device for session in fleet.sessions] == [1, 3]
    assert [console.session.device for console in fleet.consoles] == [1, 3]
    fleet.stop(["a"])
    fleet.stop(["a"], "freewheel", "a signal")
    assert fleet.stopper.mock_calls == [
        call.stop(["a"], "stop", "the stop key"), call.stop(["a"], "freewheel", "a signal"),
    ]  # fmt: skip


async def test_motors_of_a_program_that_has_left_are_looked_for() -> None:
    fleet = a_fleet()
    fleet._look_for_left(NoticeReceived(1, "text"))
    fleet._look_for_left(ProgramsChanged())
    assert not fleet.line.spawn.called, "none has left since"
    fleet.line.facts.departed = {1: "a", 2: "b"}
    fleet._look_for_left(NoticeReceived(1, "text"))
    assert not fleet.line.spawn.called
    fleet._look_for_left(ProgramsChanged())
    fleet._look_for_left(ProgramsChanged())
    ((work, name),) = [spawned.args for spawned in fleet.line.spawn.call_args_list]
    assert name == "motors left running"
    slept: list[float] = []

    async def sleep(seconds: float) -> None:
        slept.append(seconds)

    fleet.clock = SimpleNamespace(sleep=sleep)
    await work()
    assert slept == [PROGRAM_ENDS_WITHIN]
    assert fleet.starts.look.call_args_list == [call(session) for session in fleet.sessions]
    fleet.line.spawn.side_effect = LineClosed
    fleet.line.facts.departed = {3: "c"}
    fleet._look_for_left(ProgramsChanged())
    fleet.starts, fleet.line.facts.departed = None, {4: "d"}
    fleet._look_for_left(ProgramsChanged())
    assert fleet.line.spawn.call_count == 2


# -- read plans ------------------------------------------------------------------------------------


@pytest.fixture
def plans(monkeypatch: pytest.MonkeyPatch) -> tuple[Any, Any, list[tuple[Any, ...]]]:
    """Plans of a drive, and what each was made of."""
    made: list[tuple[Any, ...]] = []
    session = Mock(profile=ATV71, device=3)
    session.image.refused = {}
    session.line.link = TcpLink("10.0.0.5")
    session.line.device_state.return_value.usual_turnaround = None

    def plan_reads(*of: Any) -> Any:
        made.append(of)
        return len(made)

    monkeypatch.setattr(kept_plans, "plan_reads", plan_reads)
    return KeptPlans(session), session, made


def test_read_plan_is_kept_while_what_it_was_made_of_is_the_same(
    plans: tuple[Any, Any, list[tuple[Any, ...]]],
) -> None:
    kept, session, made = plans
    codes = frozenset({"b", "a"})
    assert [kept.plan(codes), kept.plan(codes), kept.plan(codes, {})] == [1, 1, 1]
    profile, in_order, timing, slots, refused = made[0]
    assert (profile, in_order, slots, refused) == (ATV71, ["a", "b"], None, frozenset())
    assert (timing.character, timing.silence, timing.turnaround) == (0.0, 0.0, USUAL_TURNAROUND)
    assert [kept.plan(codes, {"s": 1}), kept.plan(codes, {"s": 2}), kept.plan(codes)] == [2, 3, 1]
    session.image.refused = {"a": None}
    assert kept.plan(codes) == 4
    assert made[3][4] == {"a"}
    for number in range(PLANS_KEPT - 4):
        kept.plan(frozenset({str(number)}))
    assert len(kept) == PLANS_KEPT
    kept.plan(frozenset({"one more"}))
    assert len(kept) == PLANS_KEPT
    count = len(made)
    session.image.refused = {}
    kept.plan(codes, {"s": 1})
    assert len(made) == count, "the oldest gave way only"
    kept.plan(codes)
    assert len(made) == count + 1


def test_read_plan_follows_the_turnaround_in_steps(
    plans: tuple[Any, Any, list[tuple[Any, ...]]],
) -> None:
    kept, session, made = plans
    state = session.line.device_state.return_value

    def turnaround(measured: float) -> float:
        state.usual_turnaround = measured
        kept.plan(frozenset({str(len(made))}))
        assert session.line.device_state.call_args == call(3)
        return cast(float, made[-1][2].turnaround)

    assert turnaround(TURNAROUND_STEP) == 0.0, "a step itself is none"
    assert turnaround(0.0124) == pytest.approx(0.012)
    assert turnaround(0.0155) == pytest.approx(0.012)
    assert turnaround(0.0085) == pytest.approx(0.012)
    session.line.link = RtuTcpLink("moxa", 4001)
    assert turnaround(0.0165) == pytest.approx(0.016)
    assert made[-1][2].character == pytest.approx(11 / 19200)
    assert made[-1][2].silence == pytest.approx(3.5 * 11 / 19200)
