"""Stop of all: also drives of other programs on the line, by the process that holds it."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from tests.waiting import until
from tui.bus.fake import FakeLine
from tui.bus.line_events import LineEvent, StopDue
from tui.bus.program import Program
from tui.bus.shared_state import LinePublisher
from tui.session.sharing import stop_others as module
from tui.session.sharing.stop_others import TRIES, request_stops_of_others

REMOTE = Program("remote", "panel", 77, "", "pts/9")


class Holder(LinePublisher):
    """The connection to a holder that refuses the first requests."""

    def __init__(self, holder: str = "/run/holder", refusals: int = 0) -> None:
        super().__init__(lambda _: None, holder)
        self.refusals = refusals
        self.requested: list[tuple[int, ...]] = []

    def stop_directly(self, devices: tuple[int, ...]) -> None:
        self.requested.append(devices)
        if len(self.requested) <= self.refusals:
            raise ConnectionRefusedError("it has ended")


class Bench:
    """A line on which this program commands drive 1, another one drives 2 and 3."""

    def __init__(self, voice: LinePublisher, *, read_only: bool = False) -> None:
        self.line = FakeLine({1: {}}, read_only=read_only)
        facts = self.line.facts
        facts.set_programs((facts.me, REMOTE))
        facts.voice = voice
        for device, id in ((1, facts.me.id), (2, REMOTE.id), (3, REMOTE.id)):
            facts.note_commander(device, id)
        self.output: list[tuple[str, str, int]] = []
        self.events: list[LineEvent] = []
        facts.events.subscribe(self.events.append)

    def stop(self) -> tuple[int, ...]:
        return request_stops_of_others(
            self.line, {1}, "F9", lambda *event: self.output.append(event)
        )


async def test_holder_is_requested_to_stop_the_drives_of_others() -> None:
    voice = Holder()
    bench = Bench(voice)
    before = bench.line.facts.stops.stamp(2)
    assert bench.stop() == (2, 3)
    assert bench.line.facts.stops.stamp(2) != before, "their earlier commands are canceled"
    await until(lambda: voice.requested == [(2, 3)])
    assert bench.output[0] == ("stop", "Stop requested: panel on pts/9 (pid 77) commands it.", 2)


async def test_program_that_holds_the_line_stops_them_itself() -> None:
    bench = Bench(Holder(holder=""))
    bench.stop()
    await until(lambda: StopDue((2, 3), "F9") in bench.events)


async def test_holder_that_is_just_replaced_is_tried_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "TRY_AGAIN", 0.01)
    voice = Holder(refusals=2)
    bench = Bench(voice)
    bench.stop()
    await until(lambda: len(voice.requested) == 3)
    assert not [text for kind, text, _ in bench.output if kind == "failed"]


async def test_holder_that_does_not_answer_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "TRY_AGAIN", 0.01)
    bench = Bench(Holder(refusals=TRIES))
    bench.stop()
    await until(lambda: [device for kind, _, device in bench.output if kind == "failed"] == [2, 3])
    assert bench.output[-1][1].startswith("NOT STOPPED: ")


def test_read_only_line_stops_nothing() -> None:
    bench = Bench(Holder(), read_only=True)
    assert bench.stop() == ()
    assert not bench.events


def test_own_drives_are_no_business_of_the_holder() -> None:
    bench = Bench(Holder())
    assert request_stops_of_others(bench.line, {1, 2, 3}, "F9", lambda *_: None) == ()


async def test_motor_of_a_program_that_has_left_is_stopped(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # the records are files, which tests of starts and of panels check
    left = [SimpleNamespace(device=device) for device in (1, 2, 4)]
    monkeypatch.setattr(module, "started_by_absent", lambda *_: left)
    voice = Holder()
    bench = Bench(voice)
    bench.stop()
    await until(lambda: len(voice.requested) == 1)
    assert voice.requested == [(2, 3)]
    bench.line.facts.set_programs((bench.line.facts.me,))
    before = bench.line.facts.stops.stamp(4)
    bench.stop()
    await until(lambda: (4,) in voice.requested or (2, 4) in voice.requested)
    assert bench.line.facts.stops.stamp(4) != before
    assert not [devices for devices in voice.requested if 1 in devices], "it is its own"
