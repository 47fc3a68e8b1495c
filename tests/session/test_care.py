"""Drives armed by other programs of a line, as its holder takes care of them."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future

import msgspec
import pytest

from tui.bus.fake import FakeLine
from tui.bus.line_events import StopDue, WriteAbandoned
from tui.bus.model import Reply
from tui.bus.requests import Diagnose, ReadWrite, Request, WriteMany, WriteOne
from tui.drive.errors import ProfileError
from tui.drive.profile import library
from tui.drive.profile.profile import LONGEST_UNPACKED, unpacked_profile
from tui.session.drive import CareData, DriveSession, packed_care
from tui.session.journal import Journal
from tui.session.sharing.care import DrivesInCare
from tui.session.sharing.orphan_motors import OrphanMotorGuard

from .test_guardian import GONE, LIVING, WATCH, Bench, come
from .test_guardian import bench as bench

CARE = packed_care(library.load("atv71"), None, guessed=False)


@pytest.fixture
def kept() -> Iterator[tuple[DrivesInCare, FakeLine, Journal]]:
    """The drives in care on a line, and the journal."""
    line, journal = FakeLine({1: {}}), Journal()
    care = DrivesInCare(line, journal)
    yield care, line, journal
    care.close()
    journal.close()


def guard(bench: Bench) -> OrphanMotorGuard:
    """A holder without drives of its own, like a keeper."""
    return OrphanMotorGuard(bench.line, bench.journal, clock=bench.clock, starts=bench.starts)


def arm(bench: Bench, device: int, family: str) -> None:
    """A program arms a drive."""
    care = packed_care(library.load(family), None, guessed=False)
    assert bench.line.facts.accepts_care(device, care)


@pytest.mark.parametrize("family", [listing.id for listing in library.listings()])
def test_profile_survives_packing(family: str) -> None:
    profile = library.load(family)
    assert unpacked_profile(profile.packed).data == profile.data


def test_damaged_profile_has_its_own_error() -> None:
    packed = library.load("atv71").packed
    for data in (b"", b"no profile", packed[:-9], packed[:200] + bytes(9) + packed[209:]):
        with pytest.raises(ProfileError, match="Another program sent a damaged profile"):
            unpacked_profile(data)
    assert 10 * len(msgspec.json.encode(library.load("atv71").data)) < LONGEST_UNPACKED


def test_stop_instructions_without_a_stop_are_refused(
    kept: tuple[DrivesInCare, FakeLine, Journal],
) -> None:
    care, line, _ = kept
    data = msgspec.msgpack.decode(CARE, type=CareData)
    assert line.facts.accepts_care(1, CARE)
    for wrong in (b"", b"\xc1", CARE[:-20], msgspec.msgpack.encode(replace_profile(data, b"{}"))):
        assert not line.facts.accepts_care(1, wrong)
    session = care.session(1)
    assert session is not None
    assert session.profile.id == "atv71"
    assert care.session(2) is None


def replace_profile(data: CareData, packed: bytes) -> CareData:
    return msgspec.structs.replace(data, profile=packed)


def test_guessed_family_is_kept_as_guessed(kept: tuple[DrivesInCare, FakeLine, Journal]) -> None:
    care, line, _ = kept
    session = DriveSession(line, 1, library.load("varmeca"))
    session.guessed = True
    assert line.facts.accepts_care(1, session.care())
    found = care.session(1)
    assert found is not None
    assert found.guessed


def test_pending_writes_of_a_program_are_journaled_with_their_replies(
    kept: tuple[DrivesInCare, FakeLine, Journal],
) -> None:
    _, line, journal = kept
    line.facts.accepts_care(1, CARE)

    def left(request: Request) -> Future[Reply]:
        answer: Future[Reply] = Future()
        line.facts.events.emit(WriteAbandoned(GONE, request, answer))
        return answer

    left(WriteOne(1, 8501, 15)).set_result(Reply((), 0.0, b""))
    left(WriteMany(1, 12345, (1, 2))).set_exception(TimeoutError("no answer"))
    left(ReadWrite(7, 0, 1, 8501, (3,))).set_result(Reply((), 0.0, b""))
    left(WriteOne(1, 8501, 9)).cancel()
    left(Diagnose(1, 10, 0)).set_result(Reply((), 0.0, b""))
    found = [(e.device, e.profile, e.code, e.address, e.new, e.answer) for e in journal.sent]
    assert found == [
        (1, "atv71", "CMD", 8501, "16#000F", "ok"),
        (1, "atv71", "12345", 12345, "16#0001 16#0002", "no answer"),
        (7, "", "8501", 8501, "16#0003", "ok"),
    ]
    assert {e.why for e in journal.sent} == {f"sent for {GONE.text}, which has ended"}


async def test_due_stop_is_carried_out(bench: Bench) -> None:
    for device in (1, 2):
        bench.simulation.drive(device).run(20.0)
    await come(lambda: bench.turns(1) and bench.turns(2))
    guardian = guard(bench)
    arm(bench, 1, "atv71")
    loop = bench.line._engine._loop
    assert loop is not None
    loop.call_soon_threadsafe(bench.line.facts.events.emit, StopDue((1, 9), "drivepanel stop"))
    await come(lambda: guardian.busy)
    await bench.stopped(1)
    await come(lambda: not guardian.busy)
    # all programs know of it already: it is not given again
    assert bench.line.facts.stops.stamp(1) == 0
    assert bench.turns(2)


async def test_motor_of_an_exited_program_is_stopped_by_its_profile(
    bench: Bench,
) -> None:
    bench.started(1)
    await come(lambda: bench.turns(1))
    for path in bench.files():
        path.write_text(path.read_text().replace('"profile": "atv71"', '"profile": "gone99"'))
    guard(bench)
    arm(bench, 1, "atv71")
    bench.gone()
    await bench.stopped(1)
    assert not bench.says("Stop it at the machine")


async def test_recorded_start_does_not_stop_a_disarmed_drive(
    bench: Bench,
) -> None:
    """Another family may have its address since: the word of the one could start the other."""
    bench.started(1)
    await come(lambda: bench.turns(1))
    guardian = guard(bench)
    loop = bench.line._engine._loop
    assert loop is not None
    loop.call_soon_threadsafe(bench.line.facts.events.emit, StopDue((1,), "drivepanel stop"))
    await come(lambda: guardian._workers != [])
    await come(lambda: not guardian.busy)
    assert bench.turns(1)


async def test_due_stop_does_not_wait_for_a_program_that_has_left(bench: Bench) -> None:
    """The holder of the line has just changed, so no program has armed the drive there."""
    for device in (1, 2):
        bench.started(device, pid=LIVING)
    await come(lambda: bench.turns(1) and bench.turns(2))
    guard(bench)
    bench.line.facts.set_programs((bench.line.facts.me, WATCH))
    bench.line.facts.set_programs((bench.line.facts.me,))
    loop = bench.line._engine._loop
    assert loop is not None
    loop.call_soon_threadsafe(bench.line.facts.events.emit, StopDue((1,), "the stop key"))
    # its record stays while the program lives
    await come(lambda: bench.simulation.drive(1).motor.frequency == 0)
    assert bench.simulation.drive(1).fault is None
    assert bench.turns(2)
