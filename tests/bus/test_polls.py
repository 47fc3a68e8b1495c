"""Plans that the owner of a line carries out for its programs: each reply once from the wire."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, ClassVar, cast

import pytest

from tui.bus.api import Priority
from tui.bus.errors import DeviceException, LineError, NoAnswer, RequestRefused
from tui.bus.limits import CAUTIOUS
from tui.bus.line import Line
from tui.bus.model import Reply
from tui.bus.poll_plan import PlannedRead, PolledTurn, PollPlan, Subscription
from tui.bus.program import Program
from tui.bus.schedule.pace import SHARE
from tui.bus.share.attached import MOST_UNREAD
from tui.bus.share.carried import Polled, PolledReply, Subscribe
from tui.bus.share.messages import NoMessage, packed
from tui.bus.share.polls import MOST_PLANNED, MOST_UNTAKEN, PollsSubmitted
from tui.wire.frames import frame

from .conftest import WIDE, Share
from .peer import PtyPeer, Step, eventually, honest, reply
from .sharing import SharedLines, frozen, in_loop
from .test_share_ends import answer_of_kind, hello, raw

ONCE = 60.0
"""A period after which no test looks."""
QUICKLY = 0.05
PATIENCE = 20.0


def slow(request: bytes, _count: int) -> Sequence[Step]:
    return [0.02, reply(request)]


def reads(*addresses: int, count: int = 1) -> tuple[PlannedRead, ...]:
    return tuple(PlannedRead(address, count) for address in addresses)


def plan(
    *turns: tuple[PlannedRead, ...], period: float = QUICKLY, device: int = 1, after: float = 0.0
) -> PollPlan:
    return PollPlan(device, turns, period, time.monotonic() + after)


class Subscriber:
    """Takes the cycles of a plan in its program's line."""

    def __init__(self, line: Line, wanted: PollPlan) -> None:
        self.turns: list[PolledTurn] = []
        self.error: LineError | None = None
        self.subscription: Subscription | None = None
        self._line, self._plan = line, wanted
        self.worker = line.spawn(self._work, "subscriber")

    async def _work(self) -> None:
        carrier = self._line.pace.carrier
        assert carrier is not None
        try:
            self.subscription = carrier.subscribe(self._plan)
        except LineError as error:
            self.error = error
            return
        if self.subscription is None:
            return
        while (turn := await self.subscription.next(PATIENCE)) is not None:
            self.turns.append(turn)

    def await_turns(self, count: int) -> list[PolledTurn]:
        eventually(lambda: len(self.turns) >= count, PATIENCE)
        return self.turns[:count]

    def end(self) -> None:
        """Accept no more cycles."""
        assert self.subscription is not None
        in_loop(self._line, self.subscription.end)


def taken(turn: PolledTurn, *wanted: PlannedRead) -> list[tuple[int, ...]]:
    """The words of the replies of a cycle."""
    found = [turn.take(read, 0.0) for read in wanted]
    return [reply.words for reply in found if reply is not None]


def served(owner: Line) -> Any:
    """Plans that the owner of a line carries out."""
    shared = cast(Any, owner._engine._shared)
    return shared._server._polls


def client_of(owner: Line, name: str) -> Any:
    shared = cast(Any, owner._engine._shared)
    return next(
        client for client in shared._server._clients.values() if client.program.name == name
    )


def polled(peer: PtyPeer) -> list[int]:
    """The registers of all requests so far."""
    return [int.from_bytes(request[2:4], "big") for request in peer.requests]


async def test_subscriber_gets_each_cycle_and_only_its_reads_are_sent(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("keeper")
        first, second = reads(100, 110, count=2), reads(100, 300)
        watch = Subscriber(lines.open("watch"), plan(first, second))
        turns = await asyncio.to_thread(watch.await_turns, 6)
        assert [turn.turn for turn in turns] == [0, 1, 0, 1, 0, 1]
        assert taken(turns[0], *first) == [(100, 101), (110, 111)]
        assert taken(turns[1], *second) == [(100,), (300,)]
        assert polled(peer)[:12] == [100, 110, 100, 300] * 3
        assert [turn.begun for turn in turns] == sorted(
            {polled_turn.begun for polled_turn in turns}
        )
        assert all(turn.begun <= turn.ended for turn in turns)


async def test_two_subscribers_share_one_read(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("keeper")
        wanted = plan(reads(100, count=4), period=ONCE)
        first = Subscriber(lines.open("watch"), wanted)
        (turn,) = await asyncio.to_thread(first.await_turns, 1)
        second = Subscriber(lines.open("panel"), wanted)
        (other,) = await asyncio.to_thread(second.await_turns, 1)
        assert taken(turn, *wanted.turns[0]) == taken(other, *wanted.turns[0])
        assert polled(peer) == [100]


async def test_subscriber_never_gets_a_reply_twice(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("keeper")
        wanted = plan(reads(100), period=QUICKLY)
        watch, panel = (Subscriber(lines.open(name), wanted) for name in ("watch", "panel"))
        for subscriber in (watch, panel):
            turns = await asyncio.to_thread(subscriber.await_turns, 20)
            times = [cast(Reply, turn.take(wanted.turns[0][0], 0.0)).time for turn in turns]
            assert times == sorted(set(times))
        # each got some replies of the other
        assert len(peer.requests) < len(watch.turns) + len(panel.turns)


async def test_errors_keep_their_kind_and_a_refusal_does_not_end_the_cycle(share: Share) -> None:
    def answers(request: bytes, _count: int) -> Sequence[Step]:
        if request[0] == 2:
            return []
        refused = request[2:4] == b"\x00\x07"
        return [frame(1, bytes([0x83, 2]))] if refused else [reply(request)]

    with PtyPeer(answers) as peer:
        lines = share(peer.path)
        lines.open("keeper")
        watch = lines.open("watch")
        wanted = plan(reads(7, 8), period=ONCE)
        (turn,) = await asyncio.to_thread(Subscriber(watch, wanted).await_turns, 1)
        with pytest.raises(DeviceException) as refusal:
            turn.take(PlannedRead(7, 1), 0.0)
        assert (refusal.value.code, refusal.value.address) == (2, 7)
        assert taken(turn, PlannedRead(8, 1)) == [(8,)]
        silent = plan(reads(8, 9), period=ONCE, device=2)
        (turn,) = await asyncio.to_thread(Subscriber(watch, silent).await_turns, 1)
        with pytest.raises(NoAnswer):
            turn.take(PlannedRead(8, 1), 0.0)
        assert 9 not in polled(peer)


async def test_polling_ends_with_its_subscription_or_program(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, watch, panel = (lines.open(name) for name in ("keeper", "watch", "panel"))
        subscriber, other = Subscriber(watch, plan(reads(100))), Subscriber(panel, plan(reads(200)))
        for each in (subscriber, other):
            await asyncio.to_thread(each.await_turns, 2)
        subscriber.end()
        eventually(lambda: len(served(owner)._all()) == 1)
        panel.close()
        eventually(lambda: not served(owner)._all())
        await owner.read(1, 900)
        before = len(peer.requests)
        await asyncio.sleep(4 * QUICKLY)
        assert len(peer.requests) == before


async def test_plan_of_a_killed_or_frozen_program_ends(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, watch = lines.open("keeper"), lines.open("watch")
        with raw(lines) as stranger:
            stranger.sendall(hello())
            stranger.sendall(packed(Subscribe(5, plan(reads(100)))))
            eventually(lambda: 100 in polled(peer))
        eventually(lambda: not served(owner)._served)
        subscriber = Subscriber(watch, plan(reads(200)))
        await asyncio.to_thread(subscriber.await_turns, 2)
        with frozen(watch):
            eventually(lambda: not served(owner)._served)


async def test_polling_pauses_while_the_subscriber_reads_nothing(
    share: Share,
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, watch, panel = (lines.open(name) for name in ("keeper", "watch", "panel"))
        subscriber, other = Subscriber(watch, plan(reads(100))), Subscriber(panel, plan(reads(200)))
        for each in (subscriber, other):
            await asyncio.to_thread(each.await_turns, 2)
        client = client_of(owner, "watch")
        writer, full = client.writer, FullWriter(client.writer, MOST_UNTAKEN + 1)
        in_loop(owner, lambda: setattr(client, "writer", full))
        eventually(lambda: client.writer is full)
        await owner.read(1, 900)
        peer.requests.clear()
        await asyncio.to_thread(other.await_turns, len(other.turns) + 5)
        # one cycle may have been under way
        assert polled(peer).count(100) <= 1
        assert polled(peer).count(200) >= 4
        in_loop(owner, lambda: setattr(client, "writer", writer))
        await asyncio.to_thread(subscriber.await_turns, len(subscriber.turns) + 3)


class FullWriter:
    """A connection whose other end reads nothing."""

    def __init__(self, real: asyncio.StreamWriter, unread: int) -> None:
        assert unread < MOST_UNREAD
        self.get_extra_info = real.get_extra_info
        self.transport = SimpleNamespace(
            get_write_buffer_size=lambda: unread, is_closing=bool, abort=bool
        )

    def write(self, data: bytes) -> None:
        """Discard it."""


async def test_commands_and_stops_are_sent_between_requests_of_a_cycle(share: Share) -> None:
    with PtyPeer(slow) as peer:
        lines = share(peer.path)
        owner, watch = lines.open("keeper"), lines.open("watch")
        many = reads(*range(100, 160, 2))
        subscriber = Subscriber(watch, plan(many, period=ONCE))
        await asyncio.to_thread(peer.await_requests, 3)
        await watch.write(1, 30, [1])
        await owner.write(1, 40, [0], priority=Priority.STOP)
        order = polled(peer)
        # each after one exchange in flight at most, and the one that its writer saw begin
        assert order.index(40) - order.index(30) <= 2
        assert len(order) < len(many)
        (turn,) = await asyncio.to_thread(subscriber.await_turns, 1)
        assert len(taken(turn, *many)) == len(many)


async def test_plan_beyond_the_limits_of_its_device_is_refused(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("keeper")
        watch = lines.open("watch")
        # a device without a description accepts one word
        wanted = plan(reads(100), reads(200, count=2), device=77)
        subscriber = Subscriber(watch, wanted)
        eventually(lambda: subscriber.error is not None)
        assert isinstance(subscriber.error, RequestRefused)
        assert str(subscriber.error) == "2 words cannot be read at once; the device accepts 1."
        assert not peer.requests


class Stub:
    """An attached program that reads its messages."""

    program = Program("stub", "stub")
    limits: ClassVar = {1: CAUTIOUS}
    unread = 0

    def __init__(self, heard: list[Polled]) -> None:
        self.say = heard.append


async def test_owner_checks_the_limits_of_a_plan(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner = lines.open("keeper")
        lines.open("watch")
        heard: list[Polled] = []
        kept: list[int] = []
        stub = Stub(heard)
        many = Subscribe(3, plan(*[reads(*range(250))] * 16, device=1))

        def hear() -> None:
            polls = served(owner)
            polls.start(stub, Subscribe(1, plan(reads(100, count=2))))
            polls.start(stub, Subscribe(2, plan(reads(100), period=ONCE, after=ONCE)))
            for number in range(3, 5 + MOST_PLANNED // 4000):
                polls.start(stub, Subscribe(number, many.plan))
            kept.append(len(polls._served[stub]))
            polls.end_all(stub)
            kept.append(len(polls._served))

        in_loop(owner, hear)
        eventually(lambda: len(kept) == 2)
        assert kept == [1 + MOST_PLANNED // 4000, 0]
        failures = {polled.number: polled.replies[0].failure for polled in heard}
        assert failures[1] is not None
        assert failures[1].kind == "RequestRefused"
        last = failures[4 + MOST_PLANNED // 4000]
        assert last is not None
        assert last.text == f"Not polled: more than {MOST_PLANNED} reads."


async def test_refused_plan_has_its_reason_over_the_socket(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("keeper")
        refused = await asyncio.to_thread(refused_plan, lines)
        assert refused.failure is not None
        assert refused.failure.kind == "RequestRefused"
        assert not peer.requests


def refused_plan(lines: SharedLines) -> PolledReply:
    """Refusal of a program that requests two words of a device without a description."""
    with raw(lines) as stranger:
        stranger.sendall(hello())
        stranger.sendall(packed(Subscribe(5, plan(reads(100, count=2)))))
        return answer_of_kind(stranger, Polled).replies[0]


@pytest.mark.parametrize(
    "message",
    [
        Polled(1, 1, 5.0, ()),
        Polled(1, 0, 5.0, (PolledReply(b"\x03\x04\0\1\0\2", 5.0),)),
        Polled(1, 0, 5.0, (PolledReply(b"\x04\x02\0\1", 5.0),)),
    ],
    ids=["a turn too many", "a reply too long", "another function"],
)
async def test_cycle_that_does_not_match_its_plan_ends_the_connection(message: Polled) -> None:
    device = SimpleNamespace(limits=WIDE, heard=None)
    inside = cast(Any, SimpleNamespace(devices={1: device}))
    plans = PollsSubmitted(inside, lambda _: None, lambda _device, _limits: None, lambda: True)
    subscription = plans.subscribe(plan(reads(100)))
    assert subscription is not None
    with pytest.raises(NoMessage):
        plans.hear(message)
    assert device.heard is None
    plans.hear(Polled(1, 0, 5.0, (PolledReply(b"\x03\x02\0\1", 5.0),)))
    assert device.heard == 5.0
    plans.hear(Polled(2, 0, 5.0, ()))  # a program that has exited


async def test_next_owner_takes_the_plan_over(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, watch, panel = (lines.open(name) for name in ("keeper", "watch", "panel"))
        ones = [Subscriber(line, plan(reads(100))) for line in (watch, panel)]
        for subscriber in ones:
            await asyncio.to_thread(subscriber.await_turns, 2)
        owner.close()
        eventually(lambda: all(subscriber.worker.done() for subscriber in ones))
        # one of the two holds the line now, and reads by itself
        eventually(lambda: sum(line.pace.carrier is not None for line in (watch, panel)) == 1)
        client = watch if watch.pace.carrier is not None else panel
        await asyncio.to_thread(Subscriber(client, plan(reads(200))).await_turns, 2)


async def test_owner_that_does_not_answer_loses_the_plan(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, watch = lines.open("keeper"), lines.open("watch")
        subscriber = Subscriber(watch, plan(reads(100), period=ONCE))
        await asyncio.to_thread(subscriber.await_turns, 1)
        with frozen(owner):
            eventually(subscriber.worker.done, PATIENCE)
            again = Subscriber(watch, plan(reads(100)))
            eventually(lambda: again.worker.done() or again.subscription is not None)
            assert again.subscription is None


# A full line


def costs(owner: Line, count: int) -> float:
    """Seconds of a read of this many words."""
    return float(served(owner)._share(1, {PlannedRead(0, count): 1.0}))


async def test_full_line_lengthens_all_periods_by_one_factor(
    share: Share,
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, watch, panel = (lines.open(name) for name in ("keeper", "watch", "panel"))
        alone = Subscriber(watch, plan(reads(100, count=10)))
        await asyncio.to_thread(alone.await_turns, 2)
        eventually(lambda: watch.pace.stretch == 1.0)
        # the first read is the same, and is sent once
        more = reads(100, *range(200, 240, 2), count=10)
        other = Subscriber(panel, plan(more))
        await asyncio.to_thread(other.await_turns, 2)
        wished = len(more) * costs(owner, 10) / QUICKLY
        assert wished > 2
        eventually(lambda: panel.pace.stretch == pytest.approx(wished / SHARE, rel=0.2))
        eventually(lambda: watch.pace.stretch == panel.pace.stretch == owner.pace.stretch)
        other.end()
        eventually(lambda: watch.pace.stretch == 1.0)


async def test_programs_with_different_reads_of_a_device_are_slowed_down_evenly(
    share: Share,
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, watch, panel = (lines.open(name) for name in ("keeper", "watch", "panel"))
        few = Subscriber(watch, plan(reads(100, count=20)))
        many = Subscriber(panel, plan(reads(*range(200, 480, 20), count=20)))
        both = (few, many)
        for subscriber in both:
            await asyncio.to_thread(subscriber.await_turns, 1)
        eventually(lambda: watch.pace.stretch == panel.pace.stretch > 2)
        before = [len(subscriber.turns) for subscriber in both]
        await asyncio.to_thread(many.await_turns, before[1] + 10)
        few_more, many_more = (
            len(subscriber.turns) - had for subscriber, had in zip(both, before, strict=True)
        )
        # the small plan has its turn as often as the large one
        assert few_more <= many_more * 1.5 + 1
        assert owner.pace.stretch > 2


async def test_program_that_leaves_releases_its_time(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        _, watch, panel = (lines.open(name) for name in ("keeper", "watch", "panel"))
        panel.pace.claim("a monitor", 1, SHARE, 0.25)
        eventually(lambda: watch.pace.stretch == pytest.approx(4.0))
        assert watch.pace.claim("another", 2, 0.001, 1.0) == pytest.approx(4.0, rel=0.01)
        panel.close()
        eventually(lambda: watch.pace.stretch == 1.0)


def test_rates_count_a_read_once_per_turn() -> None:
    fast, slow_one = reads(100), reads(100, 300)
    wanted = plan(fast, fast, fast, slow_one, period=0.5)
    assert wanted.rates == {PlannedRead(100, 1): pytest.approx(2.0), PlannedRead(300, 1): 0.5}


# The cycle that has come


def test_reply_is_accepted_once_and_only_if_newer() -> None:
    first, second, third = reads(100, 200, 300)
    turn = PolledTurn(0, 1.0, {first: Reply((1,), 5.0), second: NoAnswer(1, 3, 200)})
    assert turn.ended == 5.0
    assert turn.differs
    assert turn.take(first, 5.0) is None
    with pytest.raises(NoAnswer):
        turn.take(second, 0.0)
    assert not turn.differs
    assert turn.take(third, 0.0) is None
    assert turn.differs
