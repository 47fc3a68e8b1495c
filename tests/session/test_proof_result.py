"""The result of a communication loss test: its words, its figures, its entry in the journal."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tui.bus.fake import FakeLine
from tui.drive.profile import library
from tui.session.drive import DriveSession
from tui.session.proof.result import Bracket, ProofResult, proof_entry, silences

PROFILE = library.load("atv312")
RULES = PROFILE.data.communication_fault
assert RULES is not None
FREEWHEEL = next(reaction for reaction in RULES.reactions if reaction.raw == 1)
SLF = "SLF1, Modbus communication"
AS_SET = ProofResult(
    1, 2.0, FREEWHEEL, Bracket(1.88, 2.12), False, seen="trips", fault=SLF, expected_fault=SLF
)
LATE = replace(AS_SET, bracket=Bracket(4.4, 6.0))
NEVER = replace(AS_SET, bracket=Bracket(6.0), seen="", fault="")


@pytest.mark.parametrize(
    ("result", "short", "parts"),
    [
        (AS_SET, "tested: 2.0 s", ["Trips 2.0 s after", "Set to: Freewheel.", "Fault: SLF1."]),
        (
            LATE,
            "tested: 5.2 s, NOT AS SET",
            ["Trips 5.2 s after", "NOT AS SET: the timeout is set to 2 s."],
        ),
        (
            replace(AS_SET, fault="OHF, overheated"),
            "tested: 2.0 s, NOT AS SET",
            ["Fault: OHF. NOT AS SET:", f"be {SLF}."],
        ),
        (
            replace(AS_SET, reaction=None, fault="", expected_fault=""),
            "tested: 2.0 s",
            ["Trips 2.0 s after the last request."],
        ),
        (
            NEVER,
            "tested: NO REACTION",
            [
                "DID NOT REACT to 6.0 s",
                "is set to 2 s, Freewheel.",
                "does not stop a running motor",
            ],
        ),
    ],
)
def test_result_is_described_in_words(result: ProofResult, short: str, parts: list[str]) -> None:
    assert result.short == short
    assert [part for part in parts if part not in result.text] == []
    assert ("NOT AS SET" in result.text) is ("NOT AS SET" in short)


@pytest.mark.parametrize(
    ("timeout", "agrees"),
    [(1.88, True), (2.12, True), (1.80, True), (1.77, False), (2.22, True), (2.24, False)],
)
def test_timeout_may_differ_by_a_twentieth(timeout: float, agrees: bool) -> None:
    assert AS_SET.bracket.holds(timeout) is agrees


def test_short_timeout_may_differ_by_50_ms() -> None:
    assert Bracket(0.3, 0.3).holds(0.34)
    assert not Bracket(0.3, 0.3).holds(0.36)


@pytest.mark.parametrize(("result", "verdict"), [(AS_SET, "as set"), (LATE, "NOT AS SET")])
def test_result_has_a_journal_entry(result: ProofResult, verdict: str) -> None:
    session = DriveSession(FakeLine(), 7, PROFILE)
    entry = proof_entry(session, result)
    assert (entry.device, entry.profile, entry.code) == (7, "atv312", "ttO")
    assert entry.address == PROFILE["ttO"].address
    assert (entry.new, entry.answer) == (result.text, verdict)
    assert (entry.why, entry.kind) == ("test of the communication timeout", "proof")
    assert (entry.old_raw, entry.new_raw, entry.read_back) == (None, 0, None)


def test_silences_grow_around_the_timeout_and_end_at_three_times_it() -> None:
    shares = (0.25, 0.5, 0.7, 0.82, 0.94, 1.06, 1.18, 1.6, 2.2, 3.0)
    assert list(silences(10.0)) == pytest.approx([10.0 * share for share in shares])
    assert max(silences(40.0)) == 90.0
    assert list(silences(40.0)).count(90.0) == 1, "none is tried twice"
    assert max(silences(100.0)) == pytest.approx(160.0)


@pytest.mark.parametrize(
    ("after", "timeout", "agrees"),
    [
        (2.5, 2.0, True), (2.5, 1.91, True), (2.5, 1.90, False), (2.5, 2.62, True),
        (2.5, 2.64, False), (None, 2.2, False), (0.5, 0.5, False),
    ],
)  # fmt: skip
def test_timeout_agrees_with_what_was_measured_within_a_twentieth(
    after: float | None, timeout: float, agrees: bool
) -> None:
    found = Bracket(2.0, after)
    assert found.holds(timeout) is agrees


def test_bracket_is_narrowed_by_each_silence() -> None:
    bracket = Bracket().alive(1.0).alive(3.0).alive(2.0)
    assert (bracket.not_before, bracket.not_after, bracket.measured) == (3.0, None, None)
    assert bracket.reacted(5.0) == Bracket(3.0, 5.0)
    assert bracket.reacted(5.0).measured == 4.0
    assert bracket.reacted(2.0) == Bracket(3.0, 3.0)
    assert bracket.reacted(5.0).alive(4.0) == Bracket(4.0, 5.0)
