"""Trends and messages that a program leaves for the next one on the line."""

from __future__ import annotations

import math

import msgspec
import pytest

from tui.bus.line_events import NoteReceived
from tui.bus.notes import LineNote
from tui.bus.program import Program
from tui.bus.share.messages import LENGTH, AnyMessage, packed, unpacked
from tui.bus.shared_state import LinePublisher, SharedState
from tui.drive.profile import library
from tui.session.event_notes import EVENTS_OF_LINE, EventNotes, LeftEvent
from tui.session.events import Event, EventLog
from tui.session.monitor.trend import NOTED_EVERY, TREND_SECONDS, Trend, TrendNotes, TrendPoint

ATV71 = library.load("atv71")


class LineHolder:
    """Gives programs the notes that they ask for, as the holder of their line does."""

    def __init__(self) -> None:
        self.facts = SharedState(Program("keeper", "keeper"))

    def program(self, name: str) -> SharedState:
        """The facts of one more program on the line."""
        facts = SharedState(Program(name, name))

        def send(message: AnyMessage) -> None:
            assert isinstance(message, LineNote)
            if message.data:
                self.facts.notes.keep(message)
            else:
                for note in self.facts.notes.of(message.device, message.kind):
                    facts.events.emit(NoteReceived(note))

        facts.voice = LinePublisher(send)
        return facts


class TrendOf:
    """The trend of drive 2 in one program."""

    def __init__(self, holder: LineHolder, name: str, family: str = "atv71") -> None:
        self.trend = Trend(library.load(family))
        self.facts = holder.program(name)
        self.notes = TrendNotes(self.facts, 2, self.trend)

    def add(self, *times: float) -> None:
        """Points whose frequency is their time."""
        for time in times:
            point = TrendPoint(time, (time, None, 1.0))
            self.trend.join([point])
            self.notes.add(point)

    @property
    def times(self) -> list[float]:
        return [point.time for point in self.trend.points]


def test_next_program_gets_trend_points_with_their_times() -> None:
    holder = LineHolder()
    TrendOf(holder, "panel").add(100.0, 100.5, 101.0, 101.5, 102.0)
    following = TrendOf(holder, "next")
    following.notes.ask()
    following.add(110.0)
    assert following.times == [100.0, 100.5, 101.0, 101.5, 102.0, 110.0]
    assert following.trend.points[0].values == (100.0, None, 1.0)


def test_killed_program_leaves_all_but_the_last_two_seconds() -> None:
    holder = LineHolder()
    TrendOf(holder, "panel").add(*(100.0 + 0.5 * number for number in range(9)))
    following = TrendOf(holder, "next")
    following.notes.ask()
    following.add(110.0)
    assert following.times[-2] >= 104.0 - NOTED_EVERY
    assert NOTED_EVERY <= 2.0


def test_points_older_than_the_trend_are_omitted() -> None:
    holder = LineHolder()
    TrendOf(holder, "panel").add(100.0, 200.0, 300.0, 310.0)
    following = TrendOf(holder, "next")
    following.notes.ask()
    following.add(150.0 + TREND_SECONDS)
    assert following.times == [200.0, 300.0, 310.0, 150.0 + TREND_SECONDS]


def test_trend_of_another_family_at_the_address_is_ignored() -> None:
    holder = LineHolder()
    TrendOf(holder, "panel").add(100.0, 103.0)
    following = TrendOf(holder, "next", "atv31")
    following.notes.ask()
    for note in holder.facts.notes.all:
        following.facts.events.emit(
            NoteReceived(note)
        )  # another part of the same program requested it
    following.add(110.0)
    assert following.times == [110.0]


def test_notes_with_long_names_can_be_sent() -> None:
    holder = LineHolder()
    panel = TrendOf(holder, "panel")
    panel.trend = Trend(library.load("atv71"))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Trend, "kind", "x" * 1000)
        panel.notes = TrendNotes(panel.facts, 2, panel.trend)
    panel.add(100.0, 103.0)
    (note,) = holder.facts.notes.all
    assert unpacked(packed(note)[LENGTH:]) == note


@pytest.mark.parametrize(
    "points",
    [
        [TrendPoint(math.nan, (1.0, 1.0, 1.0))],
        [TrendPoint(100.0, (math.inf, 1.0, 1.0))],
        [TrendPoint(100.0, (1.0,))],
    ],
)
@pytest.mark.internal_errors
def test_points_that_cannot_be_drawn_are_omitted(points: list[TrendPoint]) -> None:
    holder = LineHolder()
    kind = Trend(ATV71).kind
    holder.facts.notes.keep(LineNote(2, kind, b"no points"))
    holder.facts.notes.keep(LineNote(2, kind, msgspec.msgpack.encode(points)))
    following = TrendOf(holder, "next")
    following.notes.ask()
    following.add(110.0)
    assert following.times == [110.0]


def left(holder: LineHolder, name: str, *events: Event) -> None:
    """Events that a program leaves."""
    log = EventLog()
    EventNotes(holder.program(name), log)
    for event in events:
        log.add(event.kind, event.text, event.device, event.wall)


def found(holder: LineHolder, log: EventLog, name: str = "next") -> list[Event]:
    """Events of a program that requests those of others."""
    EventNotes(holder.program(name), log).ask()
    return list(log.events)


def test_next_program_gets_messages_with_time_drive_and_program() -> None:
    holder, log = LineHolder(), EventLog(lambda: 50.0)
    left(holder, "run", Event(40.0, 2, "stop", "Stopped."), Event(60.0, 3, "fault", "OCF."))
    log.add("told", "Own.")
    who = holder.program("run").me.text
    assert found(holder, log) == [
        Event(40.0, 2, "stop", f"Stopped. ({who})"),
        Event(50.0, None, "told", "Own."),
        Event(60.0, 3, "fault", f"OCF. ({who})"),
    ]


def test_message_of_another_program_is_not_the_newest() -> None:
    holder, log = LineHolder(), EventLog(lambda: 50.0)
    left(holder, "run", Event(60.0, 3, "fault", "OCF."))
    assert found(holder, log)
    assert log.newest is None
    log.add("told", "Own.")
    found(holder, log)
    assert log.newest == Event(50.0, None, "told", "Own.")


def test_same_message_of_several_programs_is_kept_once() -> None:
    holder, log = LineHolder(), EventLog()
    for name in ("panel", "watch"):
        left(holder, name, Event(60.0, 3, "told", "Stopped."), Event(90.0, 3, "told", "Again."))
    assert len(found(holder, log)) == 2


def test_own_messages_are_not_repeated() -> None:
    holder, log = LineHolder(), EventLog()
    left(holder, "panel", Event(60.0, 3, "told", "Stopped."))
    assert found(holder, log, "panel") == []


def test_message_with_a_file_name_that_is_not_utf_8_is_sent() -> None:
    holder, log = LineHolder(), EventLog()
    left(holder, "panel", Event(1.0, 2, "done", "Saved: bundle\udcff.zip"))
    assert [event.text for event in found(holder, log)] == [
        f"Saved: bundle?.zip ({holder.program('panel').me.text})"
    ]


@pytest.mark.internal_errors
def test_message_that_cannot_be_sent_is_kept() -> None:
    def fails(_event: Event) -> None:
        raise ValueError("on purpose")

    log = EventLog(lambda: 50.0)
    log.left = fails
    assert log.add("stop", "Stopped.", 2) == Event(50.0, 2, "stop", "Stopped.")
    assert [event.text for event in log.events] == ["Stopped."]


def test_message_does_not_control_terminal() -> None:
    holder, log = LineHolder(), EventLog()
    data = msgspec.msgpack.encode(LeftEvent("run", Event(1.0, 2, "told", "\x1b[2J")))
    holder.facts.notes.keep(LineNote(0, EVENTS_OF_LINE, data))
    assert [event.text for event in found(holder, log)] == ["?[2J (run)"]
