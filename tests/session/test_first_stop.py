"""First word of a stop, on the wire: before the drive is identified."""

from __future__ import annotations

import pytest

from tests.sent import words_written
from tui.bus.line import Line
from tui.drive.profile import library
from tui.drive.profile.stop_profile import stop_profile
from tui.session.command.first_stop import FIRST_WHY, FirstStop, stop_first
from tui.session.connect.limits import limits_of
from tui.session.journal import Journal
from tui.simulator import DriveSpec, Simulation
from tui.simulator.troubles import FaultRates

from .test_stop import FAMILIES, WORDS, Start, start, wait_for

__all__ = ["start"]
FACTS = stop_profile()
PLACES = {0xFA00, 8501, 641}


async def first(line: Line, journal: Journal, *named: str) -> FirstStop:
    return await stop_first(line, 1, journal, FACTS, named, "stop")


def running(family: str) -> DriveSpec:
    sets = {} if family.startswith("atv") else {"6.43": 1, "6.42": 3}
    return DriveSpec(family, 1, run_hz=20.0, sets=sets)


def frames(line: Line) -> list[bytes]:
    return [frame.data for frame in line.trace if frame.direction == "out"]


WRONGLY_NAMED = ("atv71", "powerdrive")
"""Families outside the sweeps whose drives are named as another one."""


@pytest.mark.parametrize(
    ("family", "named"),
    [
        *((item, "") for item in FAMILIES),
        *(
            pytest.param(item, "atv312", marks=() if item in WRONGLY_NAMED else pytest.mark.sweep)
            for item in FAMILIES
        ),
        ("atv21", "atv71"),
    ],
)
async def test_first_stop_stops_each_family_before_identification(
    start: Start, journal: Journal, family: str, named: str
) -> None:
    simulation, line = start(running(family))
    await wait_for(lambda: simulation.drive(1).motor.frequency > 5)
    sent = await first(line, journal, *([named] if named else []))
    assert sent.taken is not None
    assert (sent.taken.address, sent.taken.word) == WORDS[family]
    assert family in {profile.id for profile in sent.taken.families}
    assert 43 not in {frame[1] for frame in frames(line)}
    await wait_for(lambda: simulation.drive(1).motor.frequency == 0)
    # a wrongly named family is excluded by its status word, or gets no word
    assert words_written(line)[-1] == WORDS[family]
    others = {address for address, _ in words_written(line)} - {WORDS[family][0]}
    assert others <= ({8501} if named == "atv312" else set())


async def test_ramp_stop_of_the_family_named_does_not_start_another(
    start: Start, journal: Journal
) -> None:
    """In the I/O profile 16#0007, the stop of an Altivar 312, runs an Altivar 71."""
    simulation, line = start(DriveSpec("atv71", 1, sets={"CHCF": 3, "TCC": 0}))
    drive = simulation.drive(1)
    line.describe(1, limits_of(library.load("atv71")))
    for address, word in ((8502, 200), (8501, 1)):
        await line.write(1, address, [word])
    await wait_for(lambda: drive.motor.frequency > 15)
    sent = await first(line, journal, "atv312")
    assert sent.taken is not None
    assert sent.taken.word == 0
    assert sent.followers == ("atv71",)
    assert not sent.may_be("atv312")
    await wait_for(lambda: drive.motor.frequency == 0)


async def test_first_stop_is_in_the_journal(start: Start, journal: Journal) -> None:
    _, line = start(running("atv31"))
    await first(line, journal)
    (entry,) = journal.recent
    assert (entry.code, entry.address, entry.new_raw, entry.answer) == ("CMD", 8501, 7, "ok")
    assert (entry.why, entry.profile) == (FIRST_WHY, "atv31,atv312,atv71")


def silence(simulation: Simulation) -> None:
    simulation.faults.rates = FaultRates(lost=1.0)


async def test_no_blind_word_is_sent_without_a_named_family(start: Start, journal: Journal) -> None:
    simulation, line = start(running("atv71"))
    silence(simulation)
    sent = await first(line, journal)
    assert (sent.sent, sent.answered) == ((), False)
    assert words_written(line) == []


async def test_named_drive_is_stopped_by_a_word_that_starts_no_other(
    start: Start, journal: Journal
) -> None:
    simulation, line = start(running("atv312"))
    await wait_for(lambda: simulation.drive(1).motor.frequency > 5)
    silence(simulation)
    sent = await first(line, journal, "atv312")
    assert (sent.taken, sent.answered) == (None, False)
    assert words_written(line) == [(8501, 0x0000)]
    assert journal.recent[-1].answer != "ok"
    # the replies were lost, not the word
    await wait_for(lambda: simulation.drive(1).motor.frequency == 0)


async def test_first_stop_uses_no_register_the_drive_does_not_have(
    start: Start, journal: Journal
) -> None:
    _, line = start(running("atv21"))
    sent = await first(line, journal, "atv71")
    assert words_written(line) == [WORDS["atv21"]]
    assert {"atv71", "powerdrive"} <= sent.ruled_out
