"""Ends of frames, and times of replies on the wire; with the clock of the test."""

from __future__ import annotations

import pytest

from tui.simulator import DriveSpec, FaultRates, LineTiming, SimulatedDrive
from tui.simulator.server.conversation import (
    SILENCE_ENDS_FRAME,
    RtuConversation,
    SimulatedLine,
    TcpConversation,
)
from tui.simulator.server.faults import FaultPlan
from tui.simulator.server.frames import seal

from .small import PROFILES

REQUEST = seal(bytes.fromhex("020323290001"))
REPLY = seal(bytes.fromhex("020302001E"))
REAL = LineTiming(19200, "8E1", real_time=True)
CHARACTER = 11 / 19200


def conversation(
    timing: LineTiming | None = None, rates: FaultRates | None = None, paced: bool = False
) -> RtuConversation:
    timing = timing or LineTiming()
    drive = SimulatedDrive(PROFILES["atv71"], DriveSpec("atv71", 2), timing=timing)
    return RtuConversation(
        SimulatedLine([drive], timing), FaultPlan(rates or FaultRates(), 1), paced=paced
    )


def everything(talk: RtuConversation, until: float) -> list[tuple[float, bytes]]:
    """Written bytes and their times, if the endpoint is called exactly when due."""
    written = []
    while (due := talk.due) is not None and due <= until:
        if out := talk.poll(due):
            written.append((due, out))
    return written


# Without real time


def test_request_is_answered_as_soon_as_it_is_complete() -> None:
    talk = conversation()
    talk.feed(REQUEST[:5], 1.0)
    assert talk.poll(1.0) == b""
    talk.feed(REQUEST[5:], 1.01)
    assert talk.poll(1.01) == REPLY
    assert talk.due is None


def test_joined_requests_are_ignored_but_the_next_is_answered() -> None:
    talk = conversation()
    talk.feed(REQUEST + REQUEST, 1.0)
    assert everything(talk, 2.0) == []
    talk.feed(REQUEST, 2.0)
    assert talk.poll(2.0) == REPLY


def test_garbage_ends_at_the_next_gap() -> None:
    talk = conversation()
    talk.feed(b"\x99\x88", 1.0)
    assert talk.due == pytest.approx(1.0 + SILENCE_ENDS_FRAME)
    talk.feed(REQUEST, 1.0 + 2 * SILENCE_ENDS_FRAME)
    assert talk.poll(1.0 + 2 * SILENCE_ENDS_FRAME) == REPLY


def test_request_with_a_wrong_byte_count_ends_at_the_gap() -> None:
    timing = LineTiming()
    drive = SimulatedDrive(PROFILES["atv21"], DriveSpec("atv21", 1), timing=timing)
    talk = RtuConversation(SimulatedLine([drive], timing), FaultPlan(FaultRates(), 1))
    talk.feed(bytes.fromhex("01101870000203C4001770D86F"), 1.0)
    assert [out.hex().upper() for _, out in everything(talk, 2.0)] == ["0190030C01"]


# In real time


def test_reply_follows_the_turnaround_at_the_line_speed() -> None:
    talk = conversation(REAL)
    talk.feed(REQUEST, 1.0)
    written = everything(talk, 2.0)
    assert b"".join(out for _, out in written) == REPLY
    end_of_request = 1.0 + len(REQUEST) * CHARACTER
    first, last = written[0][0], written[-1][0]
    assert first == pytest.approx(end_of_request + 0.005 + CHARACTER, abs=1e-6)
    assert last - first == pytest.approx((len(REPLY) - 1) * CHARACTER, abs=1e-6)


def test_late_poll_gets_all_due_bytes() -> None:
    talk = conversation(REAL)
    talk.feed(REQUEST, 1.0)
    talk.poll(1.008)
    assert talk.poll(2.0) == REPLY


def test_pause_shorter_than_the_gap_is_part_of_the_frame() -> None:
    talk = conversation(REAL)
    talk.feed(REQUEST[:3], 1.0)
    talk.feed(REQUEST[3:], 1.0 + 3 * CHARACTER + 0.9 * REAL.silence)
    assert b"".join(out for _, out in everything(talk, 2.0)) == REPLY


def test_pause_longer_than_the_gap_ends_the_frame() -> None:
    talk = conversation(REAL)
    talk.feed(REQUEST[:3], 1.0)
    talk.feed(REQUEST[3:], 1.0 + 3 * CHARACTER + 1.1 * REAL.silence)
    assert everything(talk, 2.0) == []


def test_two_requests_without_a_gap_are_one_frame() -> None:
    talk = conversation(REAL)
    talk.feed(REQUEST, 1.0)
    talk.feed(REQUEST, 1.0 + len(REQUEST) * CHARACTER + 0.5 * REAL.silence)
    assert everything(talk, 2.0) == []


def test_two_requests_with_a_gap_are_both_answered() -> None:
    talk = conversation(REAL)
    talk.feed(REQUEST, 1.0)
    talk.feed(REQUEST, 1.0 + len(REQUEST) * CHARACTER + 1.1 * REAL.silence)
    assert sum(len(out) for _, out in everything(talk, 2.0)) == 2 * len(REPLY)


def test_medium_with_its_own_timing_is_not_delayed_again() -> None:
    talk = conversation(REAL, paced=True)
    talk.feed(REQUEST, 1.0)
    [(moment, reply)] = everything(talk, 2.0)
    assert moment == pytest.approx(1.005)
    assert reply == REPLY


# Line faults


def test_late_reply_is_late_and_complete() -> None:
    talk = conversation(rates=FaultRates(late=1.0, late_by=(0.4, 0.4)))
    talk.feed(REQUEST, 1.0)
    [(moment, reply)] = everything(talk, 2.0)
    assert moment == pytest.approx(1.4)
    assert reply == REPLY


def test_late_reply_does_not_delay_the_next() -> None:
    talk = conversation(rates=FaultRates(late=1.0, late_by=(0.4, 0.4)))
    talk.feed(REQUEST, 1.0)
    talk.feed(REQUEST, 1.1)
    assert [time for time, _ in everything(talk, 2.0)] == [
        pytest.approx(1.4),
        pytest.approx(1.5),
    ]


# Modbus TCP


def tcp(rates: FaultRates | None = None) -> TcpConversation:
    drive = SimulatedDrive(PROFILES["atv71"], DriveSpec("atv71", 2))
    return TcpConversation(
        SimulatedLine([drive], LineTiming()), FaultPlan(rates or FaultRates(), 1)
    )


def test_tcp_messages_are_answered_with_their_transaction() -> None:
    talk = tcp()
    talk.feed(bytes.fromhex("1234000000060203232900"), 1.0)
    assert talk.poll(1.0) == b""
    talk.feed(bytes.fromhex("01") + bytes.fromhex("0002000000060203232A0001"), 1.0)
    assert talk.poll(1.0).hex() == "123400000005020302001e" + "000200000005020302001e"


@pytest.mark.parametrize("unit", [3, 0])
def test_absent_unit_and_broadcast_get_no_reply(unit: int) -> None:
    talk = tcp()
    talk.feed(bytes.fromhex("123400000006") + bytes([unit]) + bytes.fromhex("0323290001"), 1.0)
    assert talk.poll(9.0) == b""


def test_unit_255_addresses_the_only_drive() -> None:
    talk = tcp()
    talk.feed(bytes.fromhex("123400000006FF0323290001"), 1.0)
    assert talk.poll(1.0).hex() == "123400000005ff0302001e"


@pytest.mark.parametrize("head", ["12340001000602", "12340000000002", "123400000fff02"])
def test_non_modbus_tcp_bytes_end_the_connection(head: str) -> None:
    talk = tcp()
    talk.feed(bytes.fromhex(head), 1.0)
    assert talk.broken


def test_tcp_replies_can_be_lost_or_come_from_another_unit() -> None:
    request = bytes.fromhex("123400000006020323290001")
    lost = tcp(FaultRates(lost=1.0))
    lost.feed(request, 1.0)
    assert lost.poll(9.0) == b""
    foreign = tcp(FaultRates(foreign=1.0))
    foreign.feed(request, 1.0)
    reply = foreign.poll(1.0)
    assert reply[6] != 2
    assert reply[7:].hex() == "0302001e"
