"""Values that another program sends: each has its bounds, and none of them costs a stop."""

from __future__ import annotations

import asyncio
import itertools
import random
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import partial
from typing import Any, get_args

import msgspec
import pytest
from msgspec import inspect

from tests.line_events import on_event
from tui.bus.api import Priority
from tui.bus.bounds import MOST_STOPPERS, STOPS_WRAP
from tui.bus.limits import CAUTIOUS, Limits, Window
from tui.bus.line import Line
from tui.bus.line_events import DevicesStopped, DeviceWritten, NoticeReceived
from tui.bus.model import DeviceCounters, DeviceState, LineCounters, LineState, LineStatus
from tui.bus.poll_plan import PlannedRead, PollPlan
from tui.bus.program import Program
from tui.bus.share.carried import ErrorForm, Polled, PolledReply, Subscribe, Unsubscribe
from tui.bus.share.messages import (
    VERSION,
    Alive,
    Answer,
    AnyMessage,
    Asking,
    Claim,
    Describe,
    DriveRequested,
    Facts,
    Failed,
    Hello,
    News,
    NoMessage,
    Notified,
    PollPause,
    PollWish,
    RequestDenied,
    RequestGranted,
    StopGiven,
    TurnedAway,
    Welcome,
    Withdraw,
    packed,
    unpacked,
)
from tui.bus.share.place import Owner
from tui.bus.shared_state import SharedState
from tui.bus.stop_counts import StopCounts, is_newer
from tui.bus.trace import Frame

from .conftest import Share
from .peer import PtyPeer, eventually, honest
from .sharing import SharedLines, in_loop
from .test_share_ends import raw

STOP, RUN = 0, 15
STRANGER = Program("stranger", "stranger", 1)
HIGHEST = STOPS_WRAP - 1
MUTANTS = 4000


# Every field has bounds

SIZED = (inspect.StrType, inspect.BytesType, inspect.DictType, inspect.CollectionType)


def unbounded(form: inspect.Type, where: str) -> Iterator[str]:
    """Parts of a type that may hold more, or greater, values than a program may send."""
    match form:
        case inspect.IntType() | inspect.FloatType():
            if form.ge is None or (form.le is None and form.lt is None):
                yield where
        case inspect.DictType(key_type=key, value_type=value):
            yield from unbounded(key, f"{where} key")
            yield from unbounded(value, f"{where} value")
        case inspect.CollectionType(item_type=item):
            yield from unbounded(item, f"{where} item")
        case inspect.TupleType(item_types=types) | inspect.UnionType(types=types):
            for type_ in types:
                yield from unbounded(type_, where)
        case inspect.StructType() | inspect.DataclassType():
            for field in form.fields:
                yield from unbounded(field.type, f"{form.cls.__name__}.{field.name}")
        case inspect.AnyType():
            yield where
    if isinstance(form, SIZED) and form.max_length is None:
        yield where


@pytest.mark.parametrize("kind", [*get_args(AnyMessage), Owner])
def test_message_fields_all_have_bounds(kind: type) -> None:
    # the fields of a request are checked as it is made of them
    assert set(unbounded(inspect.type_info(kind), "")) <= {"Asking.fields value"}


# Counts of stops


def test_stop_count_wraps_and_each_stop_changes_the_total() -> None:
    counts = StopCounts()
    for count in (HIGHEST // 3, 2 * HIGHEST // 3, HIGHEST - 1):
        counts.learn({1: {"": count, "other": count}})
    for _ in range(5):
        before = counts.stamp(1)
        counts.give("me", (1,), "the stop key")
        assert counts.stamp(1) == (before + 1) % STOPS_WRAP
    counts.fold({"other"})
    assert counts.stamp(1) == before + 1
    assert all(0 <= n < STOPS_WRAP for n in counts.given[1].values())
    assert 0 <= counts.stamp(0) < STOPS_WRAP


def test_wrapped_stop_count_is_still_new_to_others() -> None:
    stop_counts, other = StopCounts(), StopCounts()
    for counts in (stop_counts, other):
        for count in (HIGHEST // 3, 2 * HIGHEST // 3, HIGHEST):
            counts.learn({1: {"me": count}})
    stop_counts.give("me", (1,), "the stop key")
    assert stop_counts.of("me", (1,)) == (0,)
    assert other.learn(stop_counts.given) == (1,)
    assert other.stamp(1) == stop_counts.stamp(1)


def test_stop_count_raised_by_others_is_corrected_by_its_program() -> None:
    """Otherwise its next stop would not be new, and waiting writes would be sent after it."""
    owner = StopCounts()
    owner.learn_greeting("liar", {1: {"run": 1000}}, ["panel", "liar"])
    before = owner.stamp(1)
    assert owner.learn_greeting("run", {1: {"run": 3}}, ["panel", "liar", "run"]) == (1,)
    assert owner.stamp(1) == before
    # while it is attached, no other program counts for it
    assert owner.learn_greeting("liar", {1: {"run": 2000, "panel": 9}}, ["panel", "run"]) == ()
    assert owner.note("run", (1,), (4,), "the stop key") == (1,)
    assert owner.stamp(1) == before + 1


def test_stop_counts_by_name_stay_few() -> None:
    owner = StopCounts()
    for start in range(0, 2000, 100):
        named = {f"program {n}": 1 for n in range(start, start + 100)}
        owner.learn_greeting("liar", {1: named, 2: {"program 1": 1}}, ["panel", "run"])
        owner.note("run", (1,), (start + 1,), "the stop key")
        assert len(owner.given[1]) < MOST_STOPPERS
    assert owner.stamp(1) == 2000 + 1901
    assert owner.of("run", (1,)) == (1901,)


class _Seconds:
    """The time of stop counts, as a test sets it."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.now = 1000.0
        monkeypatch.setattr("tui.bus.stop_counts.time", self)

    def monotonic(self) -> float:
        return self.now


def test_stop_is_noted_with_its_program_and_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    time, counts = _Seconds(monkeypatch), StopCounts()
    counts.give("me", (1, 2), "the stop key")
    assert (dict(counts.totals), dict(counts.by)) == (
        {1: 1, 2: 1},
        dict.fromkeys((1, 2), "the stop key"),
    )
    assert dict(counts.times) == {1: 1000.0, 2: 1000.0}
    time.now += 5.0
    assert counts.note("run", (2, 3), (0, 4), "run", 1002.0) == (3,), "no news of device 2"
    assert dict(counts.times) == {1: 1000.0, 2: 1000.0, 3: 1002.0}
    assert dict(counts.by) == {1: "the stop key", 2: "run", 3: "run"}
    assert (counts.stamp(0), counts.stamp(3), counts.stamp(9)) == (6, 4, 0)
    assert counts.of("run", (1, 2, 3)) == (0, 0, 4)
    assert counts.plain == {1: {"me": 1}, 2: {"me": 1}, 3: {"run": 4}}


def test_times_of_stops_only_advance_and_are_kept_for_ten_minutes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    time, counts = _Seconds(monkeypatch), StopCounts()
    counts.learn_times({1: 990.0, 2: 1000.0, 3: 1000.1})
    assert dict(counts.times) == {1: 990.0, 2: 1000.0}, "a future time is of another start"
    counts.learn_times({1: 980.0, 2: 995.0})
    assert dict(counts.times) == {1: 990.0, 2: 1000.0}
    for time.now, late in ((1589.9, {1, 2}), (1590.0, {2}), (1600.0, set())):
        assert counts.late_times.keys() == late


def test_counts_of_the_owner_replace_all_but_those_of_this_program() -> None:
    counts = StopCounts()
    counts.learn({1: {"me": 3, "run": 5}, 2: {"run": 1}})
    assert counts.replace({1: {"me": 1, "run": 6}, 2: {"run": 1}}, "me") == (1,)
    assert counts.plain == {1: {"me": 3, "run": 6}, 2: {"run": 1}}
    assert counts.replace({1: {"run": 6}, 4: {"run": 2}}, "me") == (4,)
    assert counts.plain == {1: {"me": 3, "run": 6}, 4: {"run": 2}}


@pytest.mark.parametrize(
    ("count", "than", "newer"),
    [
        (1, 0, True),
        (0, 0, False),
        (0, 1, False),
        (0, HIGHEST, True),
        (HIGHEST, 0, False),
        (STOPS_WRAP // 2 - 1, 0, True),
        (STOPS_WRAP // 2, 0, False),
    ],
)
def test_count_is_newer_by_less_than_half_of_all_counts(count: int, than: int, newer: bool) -> None:
    assert is_newer(count, than) == newer


def test_greeting_corrects_only_counts_that_are_too_high() -> None:
    owner = StopCounts()
    owner.learn({1: {"run": 5}, 2: {"run": 2}, 3: {"other": 4}})
    greeting = {1: {"run": 3}, 2: {"run": 2, "gone": 7, "other": 9}}
    assert set(owner.learn_greeting("run", greeting, ["run", "other"])) == {1, 2}
    assert owner.plain == {1: {"run": 3, "": 2}, 2: {"run": 2, "gone": 7}, 3: {"other": 4}}


def test_counts_of_programs_that_left_go_on_without_their_names() -> None:
    owner = StopCounts()
    owner.learn({1: {"a": 5, "b": 2, "": 1}, 2: {"c": 4}})
    owner.fold({"a", "c"})
    assert owner.plain == {1: {"b": 2, "": 6}, 2: {"": 4}}
    assert dict(owner.totals) == {1: 8, 2: 4}


# On a line


async def voided_and_stopped(lines: SharedLines, peer: PtyPeer, stopper: Line, other: Line) -> None:
    """A stop by one program cancels an earlier write of the other, and its frame is sent."""
    device = 3
    eventually(lambda: stopper.facts.stops.stamp(device) == other.facts.stops.stamp(device))
    heard: list[tuple[int, ...]] = []
    seen = len(peer.requests)
    leave = on_event(other.facts, DevicesStopped, lambda event: heard.append(event.devices))
    stamp = other.facts.stops.stamp(device)
    stopper.facts.give_stop([device], "the stop key")
    await asyncio.wait_for(stopper.write(device, 1, [STOP], priority=Priority.STOP), timeout=20)
    eventually(lambda: any(device in pair for pair in heard))
    leave()
    assert (device, STOP) in [(request[0], request[5]) for request in peer.requests[seen:]]
    assert other.facts.refusal(other.facts.me.id, device, stamp)
    await asyncio.wait_for(other.write(device, 1, [RUN]), timeout=20)


GREETINGS: Mapping[str, Callable[[], Mapping[int, Mapping[str, int]]]] = {
    "near 2**63": lambda: {n: {"stranger": 2**63 - 1, "": 2**63 - 1} for n in range(1, 9)},
    "beyond 64 bits": lambda: {3: {"stranger": 2**64 - 1, "x": 2**64 - 1}},
    "below zero": lambda: {3: {"stranger": -1}},
    "the highest": lambda: {n: {"stranger": HIGHEST, "": HIGHEST} for n in range(256)},
    "half way": lambda: {n: {"stranger": HIGHEST // 2, "": HIGHEST // 2} for n in range(256)},
    "in the name of all": lambda: {
        n: dict.fromkeys(("panel", "watch", "run", "late"), HIGHEST // 2) for n in range(256)
    },
    "many names": lambda: {n: {f"{i:x}": 1 for i in range(250)} for n in range(256)},
}


@pytest.mark.parametrize("name", GREETINGS)
async def test_stop_counts_of_a_greeting_block_no_later_stop(share: Share, name: str) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("watch")
        await owner.read(1, 1)
        hello = packed(Hello(VERSION, STRANGER, "serial:line", GREETINGS[name]()))  # type: ignore[arg-type]
        for _ in range(3):
            with raw(lines) as connection, suppress(OSError):
                connection.sendall(hello)
                connection.recv(100)
            await voided_and_stopped(lines, peer, other, owner)
            await voided_and_stopped(lines, peer, owner, other)
        late = lines.open("late")
        await voided_and_stopped(lines, peer, late, owner)
        await voided_and_stopped(lines, peer, late, other)


async def test_stop_in_the_name_of_another_program_ends_the_connection_only(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("watch")
        await owner.read(1, 1)
        for victim in (owner, other):
            before = [line.facts.stops.stamp(3) for line in (owner, other)]
            forged = StopGiven((3,), (HIGHEST // 2,), "a key", victim.facts.me)
            with raw(lines) as connection, suppress(OSError):
                connection.sendall(packed(Hello(VERSION, STRANGER, "", {})) + packed(forged))
                while connection.recv(4096):
                    pass
            assert [line.facts.stops.stamp(3) for line in (owner, other)] == before
            await voided_and_stopped(lines, peer, victim, owner if victim is other else other)
        with raw(lines) as connection, suppress(OSError):
            connection.sendall(packed(Hello(VERSION, owner.facts.me, "", {})))
            assert connection.recv(10) == b""
        assert owner.facts.me in owner.facts.programs
        await voided_and_stopped(lines, peer, other, owner)


# Mutated messages

LIMITS = Limits(frozenset({3, 6, 16}), 29, 27, 0, 0, read_windows=(Window(100, 1, 9, False),))
STATE = DeviceState(True, 0, 1.0, 2.0, 0.01, 0.01, 3.0)
SAMPLES: tuple[AnyMessage, ...] = (
    Hello(VERSION, STRANGER, "serial:line", {1: {"stranger": 1, "": 2}}, {1: 5.0}),
    Welcome(STRANGER, "serial:line"),
    TurnedAway("no"),
    Describe(1, LIMITS),
    Asking(1, "Read", {"device": 1, "address": 1, "count": 1}, Priority.POLL, False, 0.0, 0, 1e9),
    Asking(
        2, "ReadWrite", {"device": 1, "address": 1, "count": 1, "write_address": 5, "values": [1]},
        Priority.OPERATOR_WRITE, True, 0.5, 0, 1e9, CAUTIOUS, 0.2,
    ),
    Withdraw(1),
    Answer(1, b"\x03\x02\0\1", 5.0),
    Failed(1, ErrorForm("NoAnswer", "text", 1, 3, 5, "nothing", b"x", retry_in=1.0)),
    Failed(2, ErrorForm("LineLost", "text")),
    StopGiven((5, 6), (1, 2), "a key", STRANGER, 5.0),
    Alive(),
    Claim(5, True),
    RequestDenied(5, STRANGER),
    DriveRequested(5, STRANGER),
    RequestGranted(5, "stranger", True, "why"),
    PollPause(5, "a test of its timeout"),
    Notified(5, "text"),
    DeviceWritten(5, 3201, (1, 65535), STRANGER, 5.0),
    PollWish({1: 0.2}, True),
    Facts((STRANGER,), {5: "stranger"}, {5: {"stranger": 1}}, {6: ("stranger", "why")}, {5: 1.0}),
    News(
        LineState(LineStatus.CONNECTED, "", 1.0, 2.0), LineCounters(3, busy_seconds=1.0),
        {1: STATE}, {1: 0.5}, ErrorForm("PortMissing", "gone", path="/dev/x", ports=("/dev/y",)),
        (Frame(1.0, "out", b"\1\3"),),
        {1: DeviceCounters(1, exceptions={2: 1})}, 1.5,
    ),
    Subscribe(1, PollPlan(1, ((PlannedRead(1, 2),), (PlannedRead(5, 1, 4),)), 0.5, 5.0)),
    Unsubscribe(1),
    Polled(
        1, 0, 5.0,
        (PolledReply(b"\x03\x02\0\1", 5.0), PolledReply(b"", 0.0, ErrorForm("NoAnswer"))),
    ),
)  # fmt: skip
"""One message of each kind; Goodbye aside, which ends an attachment in good order."""

DEEP: list[Any] = []
for _ in range(900):
    DEEP = [DEEP]
NASTY: tuple[Any, ...] = (
    None, True, "", "x", "x" * 500, "x" * 70_000, "\x1b[2J", "\U0001f600" * 3000, b"", b"\0" * 9000,
    -1, 0, 1, 247, 255, 256, 65535, 65536, 2**31 - 1, 2**32 - 1, 2**32, 2**63 - 1, 2**63, 2**64 - 1,
    -(2**63), 0.0, -0.0, -1e-9, 1e-320, 1e9, 1e10, 1e11, 1e308, -1e308, float("nan"), float("inf"),
    -float("inf"), [], {}, [1] * 5000, {1: 1}, {"x": {"y": {}}}, {n: n for n in range(300)}, DEEP,
)  # fmt: skip


def plain(message: AnyMessage) -> dict[str, Any]:
    """A message as maps and lists, which may then be changed at will."""
    return dict(msgspec.msgpack.decode(packed(message)[4:], strict=False))


def places(value: object, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The paths to all parts of a message."""
    items: Iterator[tuple[Any, Any]] = iter(())
    if isinstance(value, dict):
        items = iter(value.items())
    elif isinstance(value, list):
        items = iter(enumerate(value))
    for key, inner in items:
        yield (*path, key)
        yield from places(inner, (*path, key))


def changed(value: Any, path: tuple[Any, ...], new: Any, *, as_key: bool) -> Any:
    """A copy with another value, or with another key, at one place."""
    if not path:
        return new
    copy = value.copy()
    if len(path) == 1 and as_key and isinstance(copy, dict):
        with suppress(TypeError):
            copy[new] = copy.pop(path[0])
        return copy
    copy[path[0]] = changed(value[path[0]], path[1:], new, as_key=as_key)
    return copy


def mutants() -> list[bytes]:
    """Messages with one part changed, and some with random bytes changed; the same each time."""
    found: list[bytes] = []
    for message in SAMPLES:
        whole = plain(message)
        for path, new, as_key in itertools.product(places(whole), NASTY, (False, True)):
            with suppress(OverflowError, UnicodeEncodeError, TypeError, RecursionError):
                found.append(
                    framed(msgspec.msgpack.encode(changed(whole, path, new, as_key=as_key)))
                )
    chance = random.Random(28)
    for _ in range(1000):
        data = bytearray(packed(chance.choice(SAMPLES))[4:])
        for _ in range(chance.randint(1, 4)):
            data[chance.randrange(len(data))] = chance.randrange(256)
        found.append(framed(bytes(data)))
    return found


def framed(data: bytes) -> bytes:
    return len(data).to_bytes(4, "big") + data


def test_mutated_message_is_refused_or_can_be_sent_on() -> None:
    found = mutants()
    assert len(found) > MUTANTS
    taken = 0
    for data in found:
        try:
            message = unpacked(data[4:])
        except NoMessage:
            continue
        taken += 1
        assert type(unpacked(packed(message)[4:])) is type(message)
    assert 100 < taken < len(found) / 2


async def test_owner_with_mutated_messages_serves_and_stops(
    share: Share, caplog: pytest.LogCaptureFixture
) -> None:
    """In turns: a handful of connections that say something malformed, then a stop."""
    chance = random.Random(28)
    greeting = packed(SAMPLES[0])
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("watch")
        await owner.read(1, 1)
        for data in batches(chance.sample(mutants(), 800)):
            for item in data:
                with raw(lines) as connection, suppress(OSError):
                    connection.sendall(greeting + item + NO_MESSAGE)
                    while connection.recv(1 << 16):
                        pass
            eventually(lambda: [program.name for program in owner.facts.others] == ["watch"], 30)
            await voided_and_stopped(lines, peer, other, owner)
            await voided_and_stopped(lines, peer, owner, other)
    assert "serving a program on the line failed" not in caplog.text


NO_MESSAGE = framed(b"\xc1")


def batches(found: list[bytes], size: int = 50) -> Iterator[list[bytes]]:
    for start in range(0, len(found), size):
        yield found[start : start + size]


async def test_client_with_mutated_messages_of_its_owner_continues_and_stops(
    share: Share, caplog: pytest.LogCaptureFixture
) -> None:
    chance = random.Random(29)
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, other = lines.open("panel"), lines.open("watch")
        await owner.read(1, 1)
        server = owner._engine._shared._server  # type: ignore[union-attr]

        def say(data: bytes) -> None:
            for item in server._all():
                item.writer.write(data)

        # a false report of the end of a request is believed
        lies = (b"Answer", b"Failed")
        found = [mutant for mutant in mutants() if not any(kind in mutant[:20] for kind in lies)]
        for some in batches(chance.sample(found, 500), 10):
            for data in some:
                in_loop(owner, partial(say, data))
            eventually(lambda: [program.name for program in owner.facts.others] == ["watch"], 30)
            await voided_and_stopped(lines, peer, other, owner)
    assert other.state.status is LineStatus.CONNECTED


def test_texts_of_other_programs_are_shown_plain_and_bounded() -> None:
    facts, heard = SharedState(), list[str]()
    on_event(facts, NoticeReceived, lambda event: heard.append(event.text))
    on_event(facts, DevicesStopped, lambda event: heard.extend((event.by, event.program.text)))
    program = Program("x", "\x1b[31m" + "n" * 100, 7, "", "pts/\x07" + "3" * 100)
    facts.events.emit(NoticeReceived(1, "stopped\x1b]0;title\x07\n" + "t" * 4000))
    facts.events.emit(DevicesStopped((1,), "\u202ekey\r" + "k" * 4000, program))
    assert [len(item) for item in heard] == [500, 500, 40 + len(" on ") + 40 + len(" (pid 7)")]
    assert all(item.isprintable() for item in heard)
    assert heard[0].startswith("stopped?]0;title??ttt")
    assert heard[2] == f"?[31m{'n' * 34}… on pts/?{'3' * 34}… (pid 7)"
    assert Program("x", "panel", 7, "", "pts/3").text == "panel on pts/3 (pid 7)"
