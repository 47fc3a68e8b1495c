"""The state that the programs on a line share: each action, its message, and its event."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus import shared_state
from tui.bus.errors import stopped_first_text
from tui.bus.expectation import Expectation
from tui.bus.limits import CAUTIOUS, out_of_range, send_refusal
from tui.bus.line_events import (
    ControlAnswered,
    DevicesStopped,
    NoticeReceived,
    ProgramLost,
    ProgramsChanged,
)
from tui.bus.program import KEEPER, Program
from tui.bus.requests import Identify, Read, ReadInput, ReadWrite, ReportId, WriteMany, WriteOne
from tui.bus.share.messages import (
    Claim,
    DriveRequested,
    Facts,
    Notified,
    PollPause,
    RequestGranted,
    StopGiven,
)
from tui.bus.shared_state import SharedState, commanded_by
from tui.bus.stop_counts import StopCounts

ME, OTHER, THIRD = Program("me", "panel", 1), Program("other", "run", 2), Program("third", "x", 3)
HOLDER = Program("keeper", KEEPER, 9)


class Bench:
    """The state of `me` beside two programs and a keeper, with its messages and events."""

    def __init__(self) -> None:
        self.state = SharedState(ME)
        self.state.programs = (HOLDER, ME, OTHER, THIRD)
        self.sent: list[Any] = []
        self.events: list[Any] = []
        self.state.voice = cast(Any, SimpleNamespace(send=self.sent.append))
        self.state.events.subscribe(self.events.append)

    def facts(self, *programs: Program, **more: Any) -> Facts:
        plain: dict[str, Any] = {"commanders": {}, "stops": {}, "paused": {}}
        return Facts(programs or self.state.programs, **{**plain, **more})

    def pauses(self) -> dict[int, tuple[str, str]]:
        return dict(self.state.paused)


def test_others_are_the_programs_of_people() -> None:
    bench = Bench()
    assert bench.state.others == (OTHER, THIRD)
    assert bench.state.program("other") is OTHER
    assert bench.state.program("none") is None


def test_claims_and_pauses_of_this_program_are_its_own_whatever_the_owner_reports() -> None:
    bench = Bench()
    bench.state.note_commander(1, "me")
    bench.state.note_pause(4, "me", "mine")
    bench.state.note_pause(5, "other", "ended since")
    bench.state.learn(bench.facts(
        commanders={1: "other", 2: "me", 3: "third"},
        paused={4: ("other", "x"), 6: ("third", "theirs"), 7: ("me", "ended")},
    ))  # fmt: skip
    assert dict(bench.state.commanders) == {1: "me", 3: "third"}
    assert bench.pauses() == {4: ("me", "mine"), 6: ("third", "theirs")}


def test_stops_and_departed_programs_are_learned_from_the_owner(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("tui.bus.stop_counts.time.monotonic", lambda: 50.0)
    bench = Bench()
    bench.state.programs, bench.state.departed = (HOLDER, ME, OTHER), (THIRD,)
    gone = Program("gone", "x", 4)
    ended: list[object] = []
    cast(Any, bench.state.leases).forget_ended = ended.append
    news = bench.state.learn(bench.facts(
        ME, OTHER, stops={1: {"other": 2}, 2: {}}, stopped={1: 40.0, 2: 60.0},
        commanders={1: "other"}, departed=(gone, THIRD, OTHER, ME),
    ))  # fmt: skip
    assert news == (1,)
    assert dict(bench.state.stops.times) == {1: 40.0}
    assert [program.id for program in bench.state.departed] == ["gone", "third", "keeper"]
    assert list(bench.state.programs) == [ME, OTHER]
    assert ended == [{1: "other"}]
    assert bench.events == [ProgramsChanged()]


def test_programs_that_leave_are_remembered_within_bounds(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(shared_state, "DEPARTED_KEPT", 2)
    bench = Bench()
    bench.state.departed = (Program("old", "x", 5), OTHER)
    bench.state.set_programs((OTHER,))
    assert bench.state.departed == (HOLDER, THIRD), "the last ones, and no present one"
    assert bench.events == [ProgramsChanged()]


def test_each_action_is_sent_to_the_others_if_there_are_any() -> None:
    bench = Bench()
    state = bench.state
    state.tell_all(3, "a text")
    state.pause_polling(4, "by hand")
    assert bench.pauses() == {4: ("me", "by hand")}
    state.resume_polling(4)
    assert bench.pauses() == {}
    state.ask_for(5)
    state.answer(6, "other", yes=False, why="it runs")
    assert bench.sent == [
        Notified(3, "a text"), PollPause(4, "by hand"), PollPause(4, ""), DriveRequested(5, ME),
        RequestGranted(6, "other", False, "it runs"),
    ]  # fmt: skip
    assert bench.events == [NoticeReceived(3, "a text")]
    state.voice = None
    state.ask_for(5)
    assert len(bench.sent) == 5


def test_stop_ends_pauses_and_is_sent_with_its_counts_and_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("tui.bus.stop_counts.time.monotonic", lambda: 50.0)
    bench = Bench()
    for device in (1, 2, 3):
        bench.state.note_pause(device, "other", "by hand")
    bench.state.stops.note("me", (1,), (4,), "before", 40.0)
    bench.state.give_stop(iter((1, 2)), "the stop key")
    assert bench.sent == [StopGiven((1, 2), (5, 1), "the stop key", ME, 50.0)]
    assert bench.pauses() == {3: ("other", "by hand")}
    assert dict(bench.state.stops.by) == {1: "the stop key", 2: "the stop key"}
    bench.state.give_stop((), "none")
    assert bench.sent[1:] == [StopGiven((), (), "none", ME, None)]
    bench.state.events.emit(DevicesStopped((3,), "a key", OTHER))
    assert bench.pauses() == {}


def test_drive_has_one_commander() -> None:
    bench = Bench()
    state = bench.state
    assert state.claim(1) == ""
    assert (state.commander(1), dict(state.commanders)) == (None, {1: "me"})
    state.note_commander(2, "other")
    assert state.commander(2) is OTHER
    assert state.claim(2) == commanded_by(2, OTHER) == f"Drive 2 is commanded by {OTHER.text}."
    state.release(2)
    state.note_commander(3, "none")
    assert state.commander(3) is None
    assert dict(state.commanders) == {1: "me", 2: "other", 3: "none"}
    state.release(1)
    assert dict(state.commanders) == {2: "other", 3: "none"}
    assert bench.sent == [Claim(1, True), Claim(1, False)]
    before = len(bench.events)
    state.note_commander(2, "other")
    assert len(bench.events) == before, "nothing has changed"
    state.note_commander(2, None)
    assert bench.events[before:] == [ProgramsChanged()]


def test_granted_drive_is_released_and_its_reply_ends_the_command_of_the_other() -> None:
    bench = Bench()
    bench.state.claim(1)
    bench.state.answer(1, "other", yes=True)
    assert bench.sent[1:] == [Claim(1, False), RequestGranted(1, "other", True, "")]
    for yes in (False, True):
        bench.state.note_commander(2, "other")
        bench.state.hear_reply(2, "why", yes=yes)
        assert (2 in bench.state.commanders) is not yes
        assert bench.events[-1] == ControlAnswered(2, yes, "why")


def test_program_that_has_left_commands_and_pauses_nothing() -> None:
    bench = Bench()
    ended: list[str] = []
    for part in (bench.state.leases, bench.state.keep_alives):
        cast(Any, part).end = ended.append
    for device, program in ((1, "other"), (2, "third")):
        bench.state.note_commander(device, program)
        bench.state.note_pause(device, program, "by hand")
    bench.state.hear_gone(OTHER)
    assert dict(bench.state.commanders) == {2: "third"}
    assert bench.pauses() == {2: ("third", "by hand")}
    assert bench.state.programs == (HOLDER, ME, THIRD)
    assert bench.state.departed == (OTHER,)
    assert ended == ["other", "other"]
    assert bench.events[-1] == ProgramLost(OTHER)


@pytest.mark.parametrize(
    ("commanders", "device", "stamp", "gated", "writes", "refused"),
    [
        ({}, 1, 2, False, True, ""),
        ({}, 1, 1, False, True, "stopped"),
        ({1: "me"}, 1, 2, False, True, ""),
        ({1: "other"}, 1, 2, False, True, "commanded"),
        ({1: "none"}, 1, 2, False, True, ""),
        ({2: "other"}, 1, 2, False, True, ""),
        ({2: "other"}, 0, 2, False, True, "commanded"),
        ({}, 1, 2, True, True, "lease"),
        ({}, 1, 2, True, False, ""),
    ],
)
def test_write_is_refused_after_a_stop_or_for_another_commander(
    commanders: dict[int, str], device: int, stamp: int, gated: bool, writes: bool, refused: str
) -> None:
    bench = Bench()
    bench.state.stops.note("other", (1,), (2,), "a key")
    for number, program in commanders.items():
        bench.state.note_commander(number, program)
    bench.state.gated = gated
    cast(Any, bench.state.leases).refusal = lambda *of: f"lease {of}"
    text = bench.state.refusal("me", device, stamp, writes=writes)
    assert (
        text
        == {
            "": "",
            "stopped": stopped_first_text("a key"),
            "commanded": commanded_by(next(iter(commanders), 0), OTHER),
            "lease": "lease ('me', 1)",
        }[refused]
    )


# -- requests and replies --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("request_", "register", "written", "changes"),
    [
        (Read(1, 5, 2), 5, (0, ()), False),
        (ReadInput(1, 5, 2), 5, (0, ()), False),
        (Identify(1), 0, (0, ()), False),
        (WriteOne(1, 5, 7), 5, (5, (7,)), True),
        (WriteMany(1, 5, (7, 8)), 5, (5, (7, 8)), True),
        (ReadWrite(1, 9, 2, 5, (7,)), 9, (5, (7,)), True),
    ],
)
def test_request_names_its_register_and_what_it_writes(
    request_: Any, register: int, written: object, changes: bool
) -> None:
    assert (request_.register, request_.written, request_.changes) == (register, written, changes)
    words = (258, 3) if isinstance(request_, Read | ReadWrite) else ()
    assert request_.words(bytes([3, 4, 1, 2, 0, 3])) == words


@pytest.mark.parametrize(
    ("expectation", "data", "extent"),
    [
        (Expectation(3, bytes([3, 4]), 6), bytes([3, 4]), 6),
        (Expectation(3, bytes([3, 4]), 6), bytes([3]), None),
        (Expectation(3, bytes([3, 4]), 6), bytes([3, 5, 0]), 0),
        (Expectation(3, bytes([3, 4]), 6), b"", None),
        (Expectation(17, bytes([17]), None), bytes([17, 5]), 7),
        (Expectation(17, bytes([17]), None), bytes([17]), None),
    ],
)
def test_reply_has_its_extent_from_its_first_bytes(
    expectation: Expectation, data: bytes, extent: int | None
) -> None:
    assert expectation.extent(data) == extent
    assert expectation.extent(b"\x09\x09" + data, 2) == extent
    assert ReportId(1).expectation().extent(bytes([17, 2])) == 4


@pytest.mark.parametrize(
    ("request_", "fits"),
    [
        (WriteOne(1, 0xFFFF, 0xFFFF), True), (WriteOne(1, 0x10000, 0), False),
        (WriteOne(1, 0, 0x10000), False), (WriteOne(1, -1, 0), False),
        (Read(1, 0xFFFF, 1), True), (Read(1, 0xFFFF, 2), False), (Read(1, 0, 0), False),
        (Read(1, 0, 125), True), (Read(1, 0, 126), False),
    ],
)  # fmt: skip
def test_request_that_no_device_can_have_is_refused(request_: Any, fits: bool) -> None:
    assert (out_of_range(request_) == "") == fits
    refused = send_refusal(request_, CAUTIOUS)
    assert bool(refused) or fits


def test_counts_of_stops_are_read_and_changed_under_their_lock(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A stop that another thread counts in between would be lost."""
    stops, held = StopCounts(), list[int]()

    class Lock:
        depth = 0

        def __enter__(self) -> None:
            self.depth += 1

        def __exit__(self, *_: object) -> None:
            self.depth -= 1

    class Given(dict[int, Any]):
        def get(self, *of: Any) -> Any:
            held.append(lock.depth)
            return super().get(*of)

    def change(self: object, name: str, value: object) -> None:
        held.append(lock.depth)
        object.__setattr__(self, name, value)

    lock = Lock()
    cast(Any, stops)._lock = lock
    for changed in (
        lambda: stops.learn({1: {"a": 1}}), lambda: stops.give("a", (1,), "a key"),
        lambda: stops.note("a", (1,), (3,), "a key"), lambda: stops.learn_times({1: 1.0}),
        lambda: stops.learn_greeting("a", {1: {"a": 4}}, ()),
        lambda: stops.replace({1: {"b": 2}}, "a"),
    ):  # fmt: skip
        cast(Any, stops).given = Given(stops.given)
        held.clear()
        with monkeypatch.context() as patch:
            patch.setattr(StopCounts, "__setattr__", change)
            changed()
        assert held
        assert 0 not in held
