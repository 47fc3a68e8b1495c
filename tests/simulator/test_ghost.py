"""Ghosts: recorded values over time, refusals, turnaround times, and what was never recorded."""

from __future__ import annotations

import pytest

from tui.simulator import DriveSpec, LineTiming, Simulation, SimulatorError
from tui.simulator.ghost import GhostDrive, RecordedExchange
from tui.simulator.server.conversation import RtuConversation, SimulatedLine, TcpConversation
from tui.simulator.server.faults import FaultPlan
from tui.simulator.server.frames import seal
from tui.simulator.troubles import FaultRates

from .small import PROFILES

READ_ONE, READ_TWO = "03 0C81 0001", "03 0C81 0002"
WRITE, IDENTITY = "06 2329 0032", "2B 0E 01 00"


def pdu(text: str) -> bytes:
    return bytes.fromhex(text)


def recorded(at: float, request: str, reply: str | None, took: float = 0.02) -> RecordedExchange:
    return RecordedExchange(at, took, pdu(request), None if reply is None else pdu(reply))


class Played:
    """A ghost whose time the test sets; `reports` are its sentences."""

    def __init__(
        self, *exchanges: RecordedExchange, profile: str | None = "atv71", repeats: bool = True
    ) -> None:
        self.now = 100.0
        self.reports: list[str] = []
        self.ghost = GhostDrive(
            2,
            exchanges,
            PROFILES[profile] if profile else None,
            repeats=repeats,
            clock=lambda: self.now,
            report=self.reports.append,
        )

    def at(self, time: float, request: str) -> str | None:
        """The reply at a time after the first request."""
        self.now = 100.0 + time
        found = self.ghost.answer(pdu(request))
        return None if found is None else found.data.hex().upper()


def test_values_change_at_the_times_of_the_record() -> None:
    played = Played(
        recorded(0, READ_ONE, "03 02 0001"),
        recorded(2, READ_ONE, "03 02 0002"),
        recorded(4, READ_ONE, "03 02 0003"),
    )
    found = [played.at(time, READ_ONE) for time in (0, 1.9, 2.1, 3.9, 4.01)]
    assert found == ["03020001", "03020001", "03020002", "03020002", "03020003"]


def test_read_of_several_words_is_answered_from_other_reads() -> None:
    played = Played(
        recorded(0, READ_TWO, "03 04 0001 0002"),
        recorded(2, "03 0C82 0001", "03 02 0009"),
        recorded(9, READ_TWO, "03 04 0005 0006"),
    )
    assert played.at(0, READ_TWO) == "030400010002"
    assert played.at(3, READ_TWO) == "030400010009"
    assert played.at(3, READ_ONE) == "03020001"
    assert played.reports == []


def test_refusal_and_silence_are_those_of_the_record() -> None:
    played = Played(
        recorded(0, READ_ONE, "83 06"),
        recorded(2, READ_ONE, None),
        recorded(4, READ_ONE, "03 02 0007"),
    )
    assert [played.at(time, READ_ONE) for time in (0, 2.5, 4.01)] == ["8306", None, "03020007"]


def test_silent_drive_is_silent_for_reads_that_others_cover() -> None:
    played = Played(
        recorded(0, READ_TWO, "03 04 0001 0002"),
        recorded(2, READ_TWO, None),
        recorded(9, READ_TWO, "03 04 0001 0002"),
    )
    assert played.at(0, READ_ONE) == "03020001"
    assert played.at(3, READ_ONE) is None


def test_read_never_recorded_is_refused_as_an_unknown_address_and_reported_once() -> None:
    played = Played(recorded(0, READ_ONE, "03 02 0001"))
    assert played.at(0, "03 2329 0001") == "8302"
    assert played.at(0.1, "03 2329 0001") == "8302"
    assert played.reports == [
        "Drive 2: the read of 9001 is not in the record; answered with exception 2."
    ]


def test_family_without_exceptions_does_not_answer_what_was_never_read() -> None:
    played = Played(recorded(0, READ_ONE, "03 02 0001"), profile="powerdrive")
    assert played.at(0, "03 2329 0001") is None
    assert "answered without a reply" in played.reports[0]


def test_recorded_write_is_answered_as_recorded_and_another_is_refused() -> None:
    played = Played(
        recorded(0, WRITE, "06 2329 0032"),
        recorded(3, WRITE, "86 04"),
        recorded(5, READ_ONE, "03 02 0001"),
    )
    assert played.at(0, WRITE) == "062329" + "0032"
    assert played.at(4, WRITE) == "8604"
    assert played.at(4, "06 2329 0033") == "8604"
    assert "the write 06 23 29 00 33 to 9001 is not in the record" in played.reports[0]


def test_other_functions_are_answered_as_recorded() -> None:
    played = Played(recorded(0, IDENTITY, "2B 0E 01 01 00 00 00"))
    assert played.at(0, IDENTITY) == "2B0E0101000000"
    assert played.at(0, "2B 0E 04 00") == "AB01"


def test_echo_returns_its_own_data_if_the_drive_knew_the_function() -> None:
    known = Played(recorded(0, "08 0000 1234", "08 0000 1234"))
    assert known.at(0, "08 0000 5678") == "0800005678"
    unknown = Played(recorded(0, "08 0000 1234", "88 01"))
    assert unknown.at(0, "08 0000 5678") == "8801"


def test_record_begins_again_and_says_so() -> None:
    played = Played(recorded(0, READ_ONE, "03 02 0001"), recorded(3.98, READ_ONE, "03 02 0002"))
    assert played.at(0, READ_ONE) == "03020001"
    assert played.at(4.5, READ_ONE) == "03020001"
    assert played.reports == ["The record of drive 2 begins again."]


def test_record_that_plays_once_ends_in_silence_and_says_so() -> None:
    played = Played(recorded(0, READ_ONE, "03 02 0001"), recorded(3.98, READ_ONE, "03 02 0002"),
                    repeats=False)  # fmt: skip
    assert played.at(0, READ_ONE) == "03020001"
    assert played.at(4.5, READ_ONE) is None
    assert played.at(90, READ_ONE) is None
    assert played.reports == ["The record of drive 2 has ended: it is silent now."]


def test_empty_record_is_refused() -> None:
    with pytest.raises(ValueError, match="no exchange with device 2"):
        GhostDrive(2, ())


@pytest.mark.parametrize("real_time", [False, True])
def test_reply_of_a_ghost_ends_when_that_of_the_drive_did(real_time: bool) -> None:
    ghost = GhostDrive(2, (recorded(0, READ_ONE, "03 02 0001", took=0.4),), PROFILES["atv71"])
    timing = LineTiming(real_time=real_time)
    line = SimulatedLine([], timing, ghosts=[ghost])
    talk = RtuConversation(line, FaultPlan(FaultRates(), 0))
    request = seal(b"\x02" + pdu(READ_ONE))
    talk.feed(request, 10.0)
    sent = 10.0 + (len(request) * timing.character if real_time else 0.0)
    talk.poll(sent + 0.01)  # the pause after the request
    assert len(talk.poll(sent + 0.38)) < 7
    assert talk.poll(sent + 0.41)[-2:] == seal(bytes.fromhex("0203020001"))[-2:]


def test_ghost_answers_over_tcp_after_its_time() -> None:
    ghost = GhostDrive(2, (recorded(0, READ_ONE, "03 02 0001", took=0.4),), PROFILES["atv71"])
    talk = TcpConversation(SimulatedLine([], LineTiming(), ghosts=[ghost]),
                           FaultPlan(FaultRates(), 0))  # fmt: skip
    talk.feed(bytes.fromhex("000100000006 02 03 0C81 0001"), 10.0)
    assert talk.poll(10.39) == b""
    assert talk.poll(10.41).endswith(bytes.fromhex("03020001"))


def test_ghost_and_simulated_drive_need_different_addresses() -> None:
    ghost = GhostDrive(2, (recorded(0, READ_ONE, "03 02 0001"),))
    with pytest.raises(SimulatorError, match="address 2"):
        Simulation([DriveSpec("atv71", 2)], profiles=PROFILES, ghosts=[ghost])
