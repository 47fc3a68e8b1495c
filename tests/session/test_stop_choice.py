"""The word of a stop without a wire: which families, which profile, which words are read first."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, cast

import pytest

from tui.bus.api import Priority, Reply
from tui.bus.errors import DeviceException, LineLost, NoAnswer, WrongReply
from tui.bus.fake import FakeLine
from tui.bus.requests import Read, WriteOne
from tui.drive.profile import library
from tui.drive.profile.stop_profile import stop_profile
from tui.session.command import first_stop as first_stops
from tui.session.command.first_stop import (
    FIRST_WHY,
    ONE_WORD,
    FirstStop,
    stop_first,
    unlike_families,
)
from tui.session.command.stop import Stopper
from tui.session.connect.identify import DriveIdentity
from tui.session.drive import DriveSession
from tui.session.journal import Journal

LEROY_SOMER = ("powerdrive", "proxidrive", "varmeca")
CMD, LEROY, OWN = 8501, 641, 0xFA00
"""Command registers, in the order in which they are tried without a name: LEROY is first."""
FAMILIES = stop_profile()


@pytest.fixture
def journal() -> Iterator[Journal]:
    """A journal in the test's own folder."""
    made = Journal()
    yield made
    made.close()


def session_of(
    profile: str, *candidates: str, own: str | None = None, reference: str = ""
) -> DriveSession:
    identity = DriveIdentity(1, "", reference, "", "", own, candidates)
    return DriveSession(FakeLine({1: {}}), 1, library.load(profile), identity)


# -- families --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("guessed", "candidates", "unlike"),
    [
        (True, ("powerdrive", "atv71"), ("powerdrive", "atv71")),
        (False, ("powerdrive", "atv71"), ()),
        (True, LEROY_SOMER, ()),
        (True, (), ()),
    ],
)
def test_guessed_drive_has_unlike_families_if_no_word_stops_them_all(
    guessed: bool, candidates: tuple[str, ...], unlike: tuple[str, ...]
) -> None:
    session = session_of("powerdrive", *candidates)
    session.guessed = guessed
    found = unlike_families(session)
    assert tuple(family.id for family in found) == unlike
    # it did not identify itself, so none of them counts as a family that does
    assert not any(family.names_itself for family in found)


def test_drive_of_another_family_than_its_profile_is_stopped_by_its_own(journal: Journal) -> None:
    session = session_of("powerdrive", "atv71", own="atv71", reference="ATV71HU15M3")
    assert session.contradiction
    stopper = Stopper(session.line, journal)
    own = stopper._by_its_own(session)
    assert own.profile.id == "atv71"
    assert (own.line, own.device, own.identity, own.clock) == (
        session.line, 1, session.identity, session.clock,
    )  # fmt: skip
    assert stopper._by_its_own(session) is own, "what it has read is kept for the next stop"
    again = session_of("powerdrive", "atv71", own="atv71", reference="ATV71HU15M3")
    assert stopper._by_its_own(again) is not own
    assert stopper._by_its_own(again) is stopper._by_its_own(again)


@pytest.mark.parametrize(
    ("profile", "own", "reference"),
    [("atv71", "atv71", "ATV71HU15M3"), ("atv71", None, ""), ("atv71", None, "VFD055CP43B")],
)
def test_drive_is_stopped_by_its_profile_if_its_own_family_is_the_same_or_unknown(
    profile: str, own: str | None, reference: str, journal: Journal
) -> None:
    session = session_of(profile, own=own, reference=reference)
    assert Stopper(session.line, journal)._by_its_own(session) is session


# -- the first word --------------------------------------------------------------------------------


class Scripted(FakeLine):
    """A drive that gives each register its answer, or raises; a list gives one a request."""

    def __init__(self, **answers: object) -> None:
        super().__init__({1: {}})
        self.answers = answers
        self.tried: list[tuple[str, int]] = []

    def _answer(self, kind: str, address: int) -> Any:
        self.tried.append((kind, address))
        answer = self.answers.get(f"{kind}{address}", self.answers.get(kind))
        if isinstance(answer, list):
            answer = answer.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    async def read(self, device: int, address: int, count: int = 1, **how: Any) -> Reply:
        assert (device, count, how) == (1, 1, {"priority": Priority.STOP, "function": 3})
        word = self._answer("r", address)
        return cast(Reply, type("Words", (), {"words": (word, 0xDEAD)}))

    async def write(self, device: int, address: int, values: Any, **how: Any) -> float:
        assert (device, how) == (1, {"priority": Priority.STOP})
        self._answer("w", address)
        self.requests.append(WriteOne(1, address, *values))
        return 0.0


REFUSED, NONE, WRONG = DeviceException(1, 3, 3201, 2), NoAnswer(1, 3, 1), WrongReply(1, 3, 1)
NOWHERE = {"r": REFUSED}
"""No status word of any family."""
ATV71, LEROY_STATUS = 3201, 1039
MODE, PROFILE_WORD = 8401, 8652


async def first(line: Scripted, journal: Journal, *named: str) -> FirstStop:
    return await stop_first(line, 1, journal, FAMILIES, named, "stop")


async def test_drive_without_any_status_word_is_sent_nothing(journal: Journal) -> None:
    line = Scripted(**NOWHERE)
    found = await first(line, journal)
    assert (found.sent, found.followers, found.answered) == ((), (), True)
    assert found.ruled_out == {family.id for family in FAMILIES}
    assert {kind for kind, _ in line.tried} == {"r"}
    assert not any(found.may_be(family.id) for family in FAMILIES)
    assert found.taken is None
    assert line.requests == []
    assert not journal.recent


async def test_first_word_follows_the_reads_that_select_it(journal: Journal) -> None:
    answers = {f"r{ATV71}": 0x0027, f"r{MODE}": 1, f"r{PROFILE_WORD}": 0}
    line = Scripted(r=REFUSED, **answers)
    found = await first(line, journal)
    (sent,) = found.sent
    assert found.taken is sent.what
    assert (sent.taken, sent.answer, sent.what.address, found.answered) == (True, "ok", CMD, True)
    assert line.requests == [WriteOne(1, CMD, sent.what.word)]
    order = [what for what in line.tried if what[0] == "w" or what[1] in (ATV71, MODE)]
    assert order == [("r", ATV71), ("r", MODE), ("w", CMD)]
    assert found.ruled_out == set(LEROY_SOMER)
    assert found.followers == ("atv71",), "the others have another word in that mode"
    assert [found.may_be(name) for name in ("atv71", "atv312", "varmeca")] == [True, False, False]
    assert line.requests[-1] == WriteOne(1, CMD, sent.what.word)
    assert sent.text == f"16#{sent.what.word:04X} to CMD, the stop of Altivar 71"
    (entry,) = journal.recent
    assert (entry.code, entry.address, entry.new_raw, entry.new) == (
        "CMD", CMD, sent.what.word, f"16#{sent.what.word:04X}",
    )  # fmt: skip
    assert (entry.answer, entry.why, entry.old_raw, entry.old) == ("ok", FIRST_WHY, None, "")
    assert (entry.profile, entry.device) == ("atv71", 1)


async def test_drive_without_the_selecting_words_is_sent_the_word_of_all_families(
    journal: Journal,
) -> None:
    found = await first(Scripted(r=REFUSED, **{f"r{ATV71}": 0x0027}), journal)
    (sent,) = found.sent
    names = "Altivar 31, Altivar 312 or Altivar 71"
    assert sent.text == f"16#{sent.what.word:04X} to CMD, the stop of {names}"
    assert journal.recent[-1].profile == "atv31,atv312,atv71"
    assert found.taken is sent.what


async def test_silent_drive_is_sent_the_word_of_its_name_only(journal: Journal) -> None:
    line = Scripted(r=NONE, w=None)
    found = await first(line, journal)
    assert (found.sent, found.answered, found.ruled_out) == ((), False, frozenset())
    named = Scripted(r=NONE, w=NONE)
    found = await first(named, journal, "atv312")
    (sent,) = found.sent
    assert (sent.answer, sent.taken, found.taken) == ("no answer", False, None)
    assert (found.answered, sent.what.address) == (False, CMD)
    assert sent.text.endswith(" (no answer)")
    assert ("w", CMD) in named.tried
    assert ("r", MODE) not in named.tried, "nothing is read further of a drive that does not answer"
    # the named family's status word is read once more, others once
    count = [named.tried.count(("r", ATV71)), named.tried.count(("r", LEROY_STATUS))]
    assert count == [2, 1]
    assert line.tried.count(("r", ATV71)) == 1


async def test_silent_drive_that_takes_the_word_of_its_name_has_answered(journal: Journal) -> None:
    line = Scripted(r=NONE, w=None)
    found = await first(line, journal, "atv312")
    assert found.answered
    assert found.taken is not None
    assert line.requests == [WriteOne(1, CMD, 0)]
    assert ("r", LEROY_STATUS) not in line.tried, "the word was taken: no other is sent"


async def test_lost_read_of_a_selecting_word_is_repeated_then_left_out(journal: Journal) -> None:
    held = {f"r{ATV71}": 0x0027, f"r{PROFILE_WORD}": 0}
    for answers, tries in (([NONE, 1], 2), ([WRONG, NONE], 2), ([REFUSED], 1)):
        line = Scripted(r=REFUSED, **held, **{f"r{MODE}": answers.copy()})
        found = await first(line, journal)
        assert line.tried.count(("r", MODE)) == tries
        assert found.taken is not None
        assert ("r", PROFILE_WORD) in line.tried


@pytest.mark.parametrize(
    ("error", "reported"),
    [
        (DeviceException(1, 6, CMD, 4), "refused"),
        (NoAnswer(1, 6, CMD), "no answer"),
        (WrongReply(1, 3, 1), "no valid answer"),
    ],
)
async def test_word_that_is_not_acknowledged_has_its_result_in_the_journal(
    error: Exception, reported: str, journal: Journal
) -> None:
    line = Scripted(r=REFUSED, **{f"r{ATV71}": 0x0027}, w=error)
    found = await first(line, journal)
    (sent,) = found.sent
    assert (sent.answer, sent.taken, found.taken) == (reported, False, None)
    assert found.answered, "its status word was read"
    (entry,) = journal.recent
    assert entry.answer == str(error)
    assert ("r", OWN) not in line.tried, "the drive has this register: no other family is tried"


async def test_line_that_is_lost_ends_the_first_stop_with_an_entry(journal: Journal) -> None:
    line = Scripted(r=REFUSED, **{f"r{ATV71}": 0x0027}, w=LineLost("unplugged"))
    with pytest.raises(LineLost):
        await first(line, journal)
    assert [entry.answer for entry in journal.recent] == ["unplugged"]


async def test_unidentified_drive_is_described_as_one_of_single_words(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    line = Scripted(**NOWHERE)
    described: list[object] = []
    monkeypatch.setattr(line, "describe", lambda *what: described.append(what))
    await first(line, journal)
    assert described == [(1, ONE_WORD)]
    assert first_stops.ONE_WORD.functions == {1, 2, 3, 5, 6, 17, 43}
    assert (ONE_WORD.max_read, ONE_WORD.max_write) == (1, 1)
    assert (ONE_WORD.max_read_23, ONE_WORD.max_write_23) == (0, 0)
    assert Read.function in ONE_WORD.functions
