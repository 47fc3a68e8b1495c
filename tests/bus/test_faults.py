"""Faults of a serial line, with the plain client and with the line."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import pytest
from pymodbus.pdu.pdu import ModbusPDU

from tui.bus.api import Priority
from tui.bus.errors import (
    ChecksumFault,
    DeviceException,
    ExchangeError,
    NoAnswer,
    WrongReply,
)
from tui.bus.line import Line, Timing
from tui.bus.link import SerialLink, silence
from tui.bus.model import Reply
from tui.bus.requests import REFERENCE, Identify, ReportId, Request, own_words_of
from tui.wire.frames import frame

from .conftest import BRISK, PATIENT, OpenLine, sent
from .peer import PtyPeer, Script, Step, eventually, honest, reply, silent
from .plain import outcome, plain_serial

OPERATOR = Priority.OPERATOR_READ
LATE = 0.35
"""Later than the timeouts used here, but not later than the line awaits a late reply."""


def first_late(request: bytes, count: int) -> Sequence[Step]:
    """Answer the first request too late, the others immediately."""
    return [LATE, reply(request)] if count == 0 else [reply(request)]


async def test_late_reply_shifts_the_plain_client() -> None:
    def slow(request: bytes, count: int) -> Sequence[Step]:
        return [LATE if count == 0 else 0.05, reply(request)]

    with PtyPeer(slow) as peer:
        async with plain_serial(peer.path, timeout=0.2) as client:
            got = [
                await outcome(client.read_holding_registers(address, count=1, device_id=1))
                for address in (10, 20, 30, 40)
            ]
    assert got == [None, [10], [20], [30]]


async def test_late_reply_never_reaches_another_request(open_line: OpenLine) -> None:
    with PtyPeer(first_late) as peer:
        line = open_line(peer.path, BRISK)
        with pytest.raises(NoAnswer):
            await line.read(1, 10, priority=OPERATOR)
        got = [(await line.read(1, address, priority=OPERATOR)).words for address in (20, 30, 40)]
        assert got == [(20,), (30,), (40,)]
        assert line.counters.stale == 1


async def test_request_with_another_reply_length_does_not_wait_for_a_late_reply(
    open_line: OpenLine,
) -> None:
    timing = Timing(first_timeout=0.1, min_timeout=0.1, late_reply=60.0, retries=0)

    def overtaken(request: bytes, count: int) -> Sequence[Step]:
        late = reply(b"\x01\x03\x00\x0a\x00\x01\0\0") if count == 1 else b""
        return [] if count == 0 else [late + reply(request)]

    with PtyPeer(overtaken) as peer:
        line = open_line(peer.path, timing)
        with pytest.raises(NoAnswer):
            await line.read(1, 10, priority=OPERATOR)
        # the late reply arrives before the reply to this one; then nothing waits any more
        assert (await line.read(1, 20, 2, priority=OPERATOR)).words == (20, 21)
        assert (await line.read(1, 30, priority=OPERATOR)).words == (30,)


async def test_cancelled_await_shifts_the_plain_client() -> None:
    with PtyPeer(first_late) as peer:
        async with plain_serial(peer.path, timeout=2.0) as client:
            with pytest.raises(TimeoutError):
                async with asyncio.timeout(0.1):
                    await client.read_holding_registers(10, count=1, device_id=1)
            got = await outcome(client.read_holding_registers(20, count=1, device_id=1))
    assert got == [10]


async def test_cancelled_await_does_not_cancel_the_exchange(open_line: OpenLine) -> None:
    with PtyPeer(first_late) as peer:
        line = open_line(peer.path)
        with pytest.raises(TimeoutError):
            async with asyncio.timeout(0.1):
                await line.read(1, 10)
        assert (await line.read(1, 20)).words == (20,)
        assert line.counters.replies == 2


async def test_cancelled_request_in_the_queue_is_not_sent(open_line: OpenLine) -> None:
    with PtyPeer(first_late) as peer:
        line = open_line(peer.path)
        flying = asyncio.create_task(line.read(1, 10))
        await asyncio.to_thread(peer.await_requests, 1)
        waiting = asyncio.create_task(line.read(1, 20))
        await asyncio.sleep(0.05)
        waiting.cancel()
        assert (await flying).words == (10,)
        assert (await line.read(1, 30)).words == (30,)
        assert [request[3] for request in peer.requests] == [10, 30]


def instead(pdu: bytes, device: int = 1) -> Script:
    """Answer every request with this."""
    return lambda _request, _count: [frame(device, pdu)]


WRONG = {
    "another function": (3, bytes([4, 2, 0, 9])),
    "too few words": (3, bytes([3, 0])),
    "too many words": (3, bytes([3, 4, 0, 9, 0, 9])),
    "write of another register": (6, bytes([6, 0, 99, 0, 7])),
    "write of another value": (6, bytes([6, 0, 5, 0, 99])),
    "write at another address": (16, bytes([16, 0, 99, 0, 2])),
    "write of fewer words": (16, bytes([16, 0, 5, 0, 1])),
    "words of another function": (23, bytes([3, 2, 0, 9])),
}


@pytest.mark.parametrize("case", WRONG)
async def test_plain_client_accepts_a_wrong_reply(case: str) -> None:
    function, pdu = WRONG[case]
    with PtyPeer(instead(pdu)) as peer:
        async with plain_serial(peer.path) as client:
            calls: dict[int, Callable[[], Awaitable[ModbusPDU]]] = {
                3: lambda: client.read_holding_registers(5, count=1, device_id=1),
                6: lambda: client.write_register(5, 7, device_id=1),
                16: lambda: client.write_registers(5, [7, 8], device_id=1),
                23: lambda: client.readwrite_registers(
                    read_address=5, read_count=1, write_address=9, values=[7], device_id=1
                ),
            }
            assert await outcome(calls[function]()) is not None


@pytest.mark.parametrize("case", WRONG)
async def test_wrong_reply_is_discarded(case: str, open_line: OpenLine) -> None:
    function, pdu = WRONG[case]
    with PtyPeer(instead(pdu)) as peer:
        line = open_line(peer.path, BRISK)
        calls: dict[int, Callable[[], Awaitable[object]]] = {
            3: lambda: line.read(1, 5, priority=OPERATOR),
            6: lambda: line.write(1, 5, [7]),
            16: lambda: line.write(1, 5, [7, 8]),
            23: lambda: line.read_write(1, 5, 1, 9, [7]),
        }
        with pytest.raises(WrongReply) as caught:
            await calls[function]()
        assert "unexpected reply" in str(caught.value)
        assert line.counters.wrong == 1


async def test_wrong_reply_before_the_right_one_is_skipped(open_line: OpenLine) -> None:
    wrong = frame(1, bytes([3, 4, 0, 9, 0, 9]))
    with PtyPeer(lambda request, _: [wrong, 0.05, reply(request)]) as peer:
        line = open_line(peer.path)
        assert (await line.read(1, 7)).words == (7,)


DIRT: dict[str, Callable[[bytes], bytes]] = {
    "a noise byte": lambda request: b"\x00" + reply(request),
    "three noise bytes": lambda request: b"\xff\x55\x01" + reply(request),
    "another drive's reply": lambda request: frame(7, bytes([3, 2, 0, 9])) + reply(request),
}


@pytest.mark.parametrize("case", DIRT)
async def test_plain_client_loses_a_reply_after_noise(case: str) -> None:
    with PtyPeer(lambda request, _: [DIRT[case](request)]) as peer:
        async with plain_serial(peer.path) as client:
            got = await outcome(client.read_holding_registers(5, count=1, device_id=1))
    assert got != [5]


@pytest.mark.parametrize("case", DIRT)
async def test_reply_is_found_after_noise(case: str, open_line: OpenLine) -> None:
    with PtyPeer(lambda request, _: [DIRT[case](request)]) as peer:
        line = open_line(peer.path)
        assert (await line.read(1, 5)).words == (5,)
        assert line.counters.resyncs == 1
        assert line.counters.checksum == 0


async def test_noise_long_before_the_reply_does_not_end_the_wait(open_line: OpenLine) -> None:
    with PtyPeer(lambda request, _: [b"\x13\x37\x00\x42\x99", 0.2, reply(request)]) as peer:
        line = open_line(peer.path)
        assert (await line.read(1, 5)).words == (5,)


async def test_copy_of_the_previous_reply_does_not_replace_a_lost_one(
    open_line: OpenLine,
) -> None:
    """The first time that the line repeats a reply, and just then the right one is lost."""

    def repeats(request: bytes, count: int) -> Sequence[Step]:
        if count == 8:
            return [0.1, reply(bytes(before))]
        before[:] = request
        return [reply(request)]

    before = bytearray()
    timing = Timing(first_timeout=2.0, min_timeout=0.5, late_reply=3.0)
    with PtyPeer(repeats) as peer:
        line = open_line(peer.path, timing)
        for address in range(8):
            assert (await line.read(1, address, priority=OPERATOR)).words == (address,)
        assert (await line.read(1, 40, priority=OPERATOR)).words == (40,)
        assert [request[3] for request in peer.requests][-2:] == [40, 40]


async def test_duplicated_replies_do_not_shift_later_replies(open_line: OpenLine) -> None:
    with PtyPeer(lambda request, _: [reply(request) * 2]) as peer:
        line = open_line(peer.path)
        got = [(await line.read(1, address)).words[0] for address in range(20)]
    assert got == list(range(20))


async def test_unsolicited_frames_do_not_shift_later_replies(open_line: OpenLine) -> None:
    with PtyPeer(honest) as peer:
        line = open_line(peer.path)
        assert (await line.read(1, 5)).words == (5,)
        peer.send(frame(1, bytes([3, 2, 0, 9])))
        await asyncio.to_thread(eventually, lambda: line.counters.stale == 1)
        assert (await line.read(1, 6)).words == (6,)


def damaged(request: bytes) -> bytes:
    """A reply with one bit turned."""
    whole = bytearray(reply(request))
    whole[4] ^= 0x10
    return bytes(whole)


def other_id(request: bytes) -> bytes:
    """A reply whose first byte was damaged."""
    return b"\x55" + reply(request)[1:]


BROKEN: dict[str, Callable[[bytes], bytes]] = {
    "damaged": damaged,
    "damaged in its first byte": other_id,
    "cut short": lambda request: reply(request)[:4],
    "cut in front": lambda request: reply(request)[1:],
}


@pytest.mark.parametrize("case", BROKEN)
async def test_plain_client_waits_for_its_timeout_on_a_damaged_reply(case: str) -> None:
    with PtyPeer(lambda request, _: [BROKEN[case](request)]) as peer:
        async with plain_serial(peer.path, timeout=0.4) as client:
            begun = time.monotonic()
            got = await outcome(client.read_holding_registers(5, count=1, device_id=1))
            assert time.monotonic() - begun >= 0.39
    assert got is None


@pytest.mark.parametrize("case", BROKEN)
async def test_damaged_reply_is_known_at_the_end_of_the_gap(case: str, open_line: OpenLine) -> None:
    timing = Timing(first_timeout=30.0, min_timeout=30.0, retries=0)
    with PtyPeer(lambda request, _: [BROKEN[case](request)]) as peer:
        line = open_line(peer.path, timing)
        async with asyncio.timeout(15.0):
            with pytest.raises(ChecksumFault):
                await line.read(1, 5, priority=OPERATOR)
        assert line.counters.checksum == 1
        assert line.counters.timeouts == 0


async def test_gap_that_ends_a_reply_counts_from_its_last_bytes(
    open_line: OpenLine,
) -> None:
    def in_pieces(request: bytes, _: int) -> Sequence[Step]:
        whole = reply(request)
        return [whole[:2], 0.3, whole[2:4], 0.3, whole[4:6], 0.3, whole[6:8], 0.3, whole[8:]]

    timing = Timing(first_timeout=30.0, min_timeout=30.0, retries=0, frame_gap=1.0)
    with PtyPeer(in_pieces) as peer:
        line = open_line(peer.path, timing)
        assert (await line.read(1, 5, 3, priority=OPERATOR)).words == (5, 6, 7)
        assert line.counters.requests == 1


async def test_reply_with_a_pause_is_awaited_for_its_time_on_the_wire(
    open_line: OpenLine,
) -> None:
    """A busy computer delivers a reply in parts; the drive was requested again while it replied."""

    def in_halves(request: bytes, _: int) -> Sequence[Step]:
        whole = reply(request)
        return [whole[:20], 0.5, whole[20:]]

    timing = Timing(first_timeout=30.0, min_timeout=30.0, retries=0)
    with PtyPeer(in_halves) as peer:
        line = open_line(SerialLink(peer.path, 300, "8N1"), timing)
        # 125 characters take 4 s, and 3.5 of them 0.12 s
        assert len((await line.read(1, 5, 60, priority=OPERATOR)).words) == 60
        assert (line.counters.requests, line.counters.checksum) == (1, 0)


@pytest.mark.parametrize("priority", [Priority.BACKGROUND, Priority.PATIENT])
async def test_scanned_empty_address_is_not_counted_as_a_failure(
    priority: Priority, open_line: OpenLine
) -> None:
    def only_three(request: bytes, _: int) -> Sequence[Step]:
        return [reply(request)] if request[0] == 3 and request[3] != 6 else []

    timing = Timing(first_timeout=0.1, min_timeout=0.1, late_reply=0.2, retries=0)
    with PtyPeer(only_three) as peer:
        line = open_line(peer.path, timing)
        with pytest.raises(NoAnswer):
            await line.read(2, 5, priority=priority)
        assert (line.counters.searched, line.counters.timeouts) == (1, 0)
        # a known device, or one that an operator requested, failed
        await line.read(3, 5, priority=priority)
        with pytest.raises(NoAnswer):
            await line.read(3, 6, priority=priority)
        with pytest.raises(NoAnswer):
            await line.read(4, 5, priority=OPERATOR)
        assert (line.counters.searched, line.counters.timeouts) == (1, 2)


async def test_read_is_repeated_after_a_damaged_reply(open_line: OpenLine) -> None:
    def once(request: bytes, count: int) -> Sequence[Step]:
        return [damaged(request)] if count == 0 else [reply(request)]

    with PtyPeer(once) as peer:
        line = open_line(peer.path)
        assert (await line.read(1, 5)).words == (5,)
        assert len(peer.requests) == 2


async def test_operator_read_is_repeated_if_unanswered(open_line: OpenLine) -> None:
    def second_lost(request: bytes, count: int) -> Sequence[Step]:
        return [] if count == 1 else [reply(request)]

    timing = Timing(first_timeout=0.2, min_timeout=0.2, late_reply=60.0)
    with PtyPeer(second_lost) as peer:
        line = open_line(peer.path, timing)
        assert (await line.read(1, 5, priority=OPERATOR)).words == (5,)
        # immediately: the lost reply would be valid too, if it still arrived
        got = await line.read(1, 6, priority=OPERATOR)
        assert got.words == (6,)
        assert len(peer.requests) == 3
        assert got.time <= sent(line)[1] + 0.1


async def test_poll_of_a_known_drive_survives_two_lost_replies(open_line: OpenLine) -> None:
    def loses_two(request: bytes, count: int) -> Sequence[Step]:
        return [] if count in (1, 2) else [reply(request)]

    timing = Timing(first_timeout=0.2, min_timeout=0.2, late_reply=60.0, back_off_first=60.0)
    with PtyPeer(loses_two) as peer:
        line = open_line(peer.path, timing)
        assert (await line.read(1, 5)).words == (5,)
        assert (await line.read(1, 6)).words == (6,)
        assert len(peer.requests) == 4
        peer.script = silent
        with pytest.raises(NoAnswer):
            await line.read(1, 10, 2)
        with pytest.raises(NoAnswer, match="Retrying in"):
            await line.read(1, 10, 2)
        assert len(peer.requests) == 7


async def test_repeated_poll_lets_polls_of_other_drives_pass(open_line: OpenLine) -> None:
    def second_dies(request: bytes, count: int) -> Sequence[Step]:
        return [] if request[0] == 2 and count else [reply(request)]

    timing = Timing(first_timeout=0.5, min_timeout=0.5, late_reply=60.0)
    with PtyPeer(second_dies) as peer:
        line = open_line(peer.path, timing)
        await line.read(2, 5)
        dead = asyncio.ensure_future(line.read(2, 5))
        await asyncio.to_thread(eventually, lambda: len(peer.requests) == 2)
        await asyncio.gather(line.read(1, 5), line.read(3, 5))
        with pytest.raises(NoAnswer):
            await dead
        assert [request[0] for request in peer.requests] == [2, 2, 1, 3, 2, 2]


async def test_late_reply_has_the_time_of_its_own_try(open_line: OpenLine) -> None:
    def late(request: bytes, count: int) -> Sequence[Step]:
        return [LATE, reply(request)] if count == 1 else [] if count == 2 else [reply(request)]

    timing = Timing(first_timeout=0.2, min_timeout=0.2, late_reply=60.0)
    with PtyPeer(late) as peer:
        line = open_line(peer.path, timing)
        assert (await line.read(1, 5)).words == (5,)
        got = await line.read(1, 6)
        first = sent(line)[1]
        assert got.words == (6,)
        assert got.time <= first + LATE / 2


async def test_plain_client_sends_a_write_four_times() -> None:
    with PtyPeer(silent) as peer:
        async with plain_serial(peer.path, timeout=0.1, retries=3) as client:
            await outcome(client.write_register(5, 7, device_id=1))
        assert len(peer.requests) == 4


@pytest.mark.parametrize("broken", ["lost", "damaged"])
@pytest.mark.parametrize("values", [[7], [7, 8]])
async def test_write_is_sent_once(broken: str, values: list[int], open_line: OpenLine) -> None:
    script = silent if broken == "lost" else lambda request, _: [damaged(request)]
    with PtyPeer(script) as peer:
        line = open_line(peer.path, Timing(first_timeout=0.2, retries=5, late_reply=0.3))
        with pytest.raises(ExchangeError) as caught:
            await line.write(1, 5, values)
        await asyncio.sleep(0.6)
        assert len(peer.requests) == 1
        if broken == "lost":
            assert "Read the register before retrying" in str(caught.value)


async def test_plain_client_keeps_no_gap_between_frames() -> None:
    with PtyPeer(honest) as peer:
        async with plain_serial(peer.path, baud=2400) as client:
            for _ in range(10):
                await client.read_holding_registers(5, count=1, device_id=1)
        assert min(_pauses(peer)) < 0.016


async def test_gap_between_frames_is_kept(open_line: OpenLine) -> None:
    with PtyPeer(honest) as peer:
        link = SerialLink(peer.path, 2400)
        line = open_line(link)
        await asyncio.gather(*(line.read(1, address) for address in range(20)))
        assert silence(link) == pytest.approx(0.016, rel=0.01)
        assert min(_pauses(peer)) >= silence(link)


def _pauses(peer: PtyPeer) -> list[float]:
    """Seconds between each reply of the peer and the next request."""
    following = peer.arrivals[1:]
    return [came - left for left, came in zip(peer.departures, following, strict=False)]


@pytest.mark.parametrize(("wire_time", "taken"), [(True, 5), (None, 77)])
async def test_reply_that_began_before_the_end_of_its_request_is_rejected(
    open_line: OpenLine, wire_time: bool | None, taken: int
) -> None:
    """Applies if bytes have a wire time; a pseudo-terminal without one may be that fast."""

    def at_last_one_of_another(request: bytes, count: int) -> Sequence[Step]:
        return [frame(1, b"\x03\x02\x00\x4d")] * (count == 9) + [0.1, reply(request)]

    with PtyPeer(at_last_one_of_another) as peer:
        line = open_line(SerialLink(peer.path, 2400), replace(PATIENT, wire_time=wire_time))
        answers = [(await line.read(1, 5)).words for _ in range(10)]
        assert answers == [(5,)] * 9 + [(taken,)]


async def test_plain_client_runs_broadcasts_into_each_other() -> None:
    with PtyPeer(honest) as peer:
        async with plain_serial(peer.path) as client:
            for value in range(10):
                await client.write_register(5, value, device_id=0, no_response_expected=True)
            await asyncio.to_thread(peer.await_requests, 10)
        assert min(b - a for a, b in pairwise(peer.arrivals)) < 0.1


async def test_broadcasts_are_kept_apart(open_line: OpenLine) -> None:
    from .conftest import WIDE

    with PtyPeer(honest) as peer:
        line = open_line(peer.path)
        await asyncio.gather(*(line.broadcast(5, [value], limits=WIDE) for value in (1, 2)))
        assert (await line.read(1, 5)).words == (5,)
        assert [len(burst) for burst in peer.bursts] == [8, 8, 8]
        first, second, third = sent(line)
        assert min(second - first, third - second) >= PATIENT.turnaround_delay
        assert line.counters.timeouts == 0


async def test_exception_is_raised_with_its_meaning(open_line: OpenLine) -> None:
    with PtyPeer(instead(bytes([0x83, 2]))) as peer:
        line = open_line(peer.path)
        with pytest.raises(
            DeviceException, match="refused function 3, register 5 with exception 2"
        ):
            await line.read(1, 5)
        assert line.counters.exceptions == 1
        assert line.device_state(1).answers


async def test_reply_to_every_function_is_accepted(open_line: OpenLine) -> None:
    with PtyPeer(honest) as peer:
        line = open_line(peer.path)
        assert (await line.read(1, 5, 3)).words == (5, 6, 7)
        await line.write(1, 5, [7])
        await line.write(1, 5, [7, 8, 9])
        await line.write(1, 5, [7], multiple=True)
        assert (await line.read_write(1, 5, 2, 9, [1, 2, 3])).words == (5, 6)
        assert await line.diagnose(1, 0, 0x1234) == 0x1234
        found = await line.identify(1)
        assert found.objects == {0: b"none"}
        assert [request[1] for request in peer.requests] == [3, 6, 16, 16, 23, 8, 43]


async def test_diagnostic_echo_is_checked(open_line: OpenLine) -> None:
    with PtyPeer(instead(bytes([8, 0, 0, 0, 1]))) as peer:
        line = open_line(peer.path, BRISK)
        with pytest.raises(WrongReply):
            await line.diagnose(1, 0, 0x1234)


@pytest.mark.parametrize("pdu", [bytes([0xAB, 1]), bytes([0xAB, 14, 1])])
async def test_both_forms_of_refused_identification_raise(pdu: bytes, open_line: OpenLine) -> None:
    with PtyPeer(instead(pdu)) as peer:
        line = open_line(peer.path)
        with pytest.raises(DeviceException) as caught:
            await line.identify(1)
        assert caught.value.code == 1


async def test_identification_continues_at_the_next_object(open_line: OpenLine) -> None:
    parts = [
        bytes([43, 14, 1, 2, 0xFF, 1, 1, 0, 3]) + b"one",
        bytes([43, 14, 1, 2, 0, 0, 2, 1, 3]) + b"two" + bytes([6, 2]) + b"xy",
    ]
    with PtyPeer(lambda _, count: [frame(1, parts[count])]) as peer:
        line = open_line(peer.path)
        found = await line.identify(1)
        assert found.conformity == 2
        assert found.objects == {0: b"one", 1: b"two", 6: b"xy"}
        assert [request[4] for request in peer.requests] == [0, 1]


TWICE_IN_ONE = [bytes([43, 14, 1, 2, 0, 0, 2, 1, 3]) + b"one" + bytes([1, 3]) + b"two"]
TWICE_IN_TWO = [
    bytes([43, 14, 1, 2, 0xFF, 1, 1, 1, 3]) + b"one",
    bytes([43, 14, 1, 2, 0, 0, 2, 1, 3]) + b"two" + bytes([6, 2]) + b"xy",
]


@pytest.mark.parametrize("parts", [TWICE_IN_ONE, TWICE_IN_TWO])
async def test_object_with_two_different_values_is_refused(
    parts: list[bytes], open_line: OpenLine
) -> None:
    with PtyPeer(lambda _, count: [frame(1, parts[count])]) as peer:
        line = open_line(peer.path)
        with pytest.raises(WrongReply, match="object 1 came with two contents, 'one' and 'two'"):
            await line.identify(1)


async def test_object_repeated_with_the_same_value_is_accepted(open_line: OpenLine) -> None:
    with PtyPeer(lambda _, count: [frame(1, TWICE_IN_ONE[0].replace(b"two", b"one"))]) as peer:
        assert (await open_line(peer.path).identify(1)).objects == {1: b"one"}


async def test_identification_without_end_is_refused(open_line: OpenLine) -> None:
    with PtyPeer(instead(bytes([43, 14, 1, 2, 0xFF, 0, 1, 0, 1, 65]))) as peer:
        line = open_line(peer.path)
        with pytest.raises(WrongReply, match="does not end"):
            await line.identify(1)
        assert len(peer.requests) == 1


class Identified(Line):
    """A line whose replies to identifications are given; it sends nothing."""

    def __init__(self, *pdus: bytes) -> None:
        self.sent: list[tuple[object, ...]] = []
        self._pdus = list(pdus)

    async def _ask(self, request: Request, priority: Priority, *_: Any, **more: Any) -> Reply:
        self.sent.append((request, priority, more["within"]))
        return Reply((), 0.0, self._pdus.pop(0))


async def test_identification_is_requested_until_nothing_follows() -> None:
    line = Identified(
        bytes([43, 14, 1, 0x82, 0xFF, 1, 1, 0, 1]) + b"a",
        bytes([43, 14, 1, 0x81, 0, 0, 1, 1, 1]) + b"b",
    )
    found = await line.identify(7, within=0.3)
    assert (found.conformity, found.objects) == (0x81, {0: b"a", 1: b"b"})
    read = Priority.OPERATOR_READ
    assert line.sent == [(Identify(7), read, 0.3), (Identify(7, first_object=1), read, 0.3)]


async def test_identification_that_contradicts_itself_names_its_device_and_function() -> None:
    line = Identified(*TWICE_IN_TWO)
    with pytest.raises(WrongReply) as caught:
        await line.identify(7)
    error = caught.value
    assert (error.device, error.function, error.address, error.received) == (7, 43, 0, b"")
    assert error.detail == "object 1 came with two contents, 'one' and 'two'"
    assert str(error) == f"Device 7 sent an unexpected reply (function 43): {error.detail}."


async def test_identification_by_function_17_is_one_object() -> None:
    line = Identified(bytes([17, 3]) + b"ABC")
    found = await line.identify(7, function=17, priority=Priority.BACKGROUND, within=0.5)
    assert (found.conformity, found.objects) == (
        0,
        {REFERENCE: own_words_of(bytes([17, 3]) + b"ABC")},
    )
    assert line.sent == [(ReportId(7), Priority.BACKGROUND, 0.5)]
