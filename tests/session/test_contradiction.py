"""A drive that says it is another than the profile it is taken by."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.sent import words_written
from tui.bus.api import IdentificationObjects, Priority
from tui.bus.errors import ChecksumFault, DeviceException, LineLost, NoAnswer, WrongReply
from tui.drive.orders import OrderRefused
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.session.command.commander import Commander
from tui.session.command.stop import Stopper
from tui.session.command.stop_report import Phase
from tui.session.connect.contradiction import contradiction, own_words
from tui.session.connect.identify import DriveIdentity, identify_drive
from tui.session.connect.limits import limits_of
from tui.session.drive import DriveSession
from tui.session.journal import Journal
from tui.simulator import DriveSpec

from .fakes import OneDrive, parameter, profile_of
from .test_stop import Start, ended, start, wait_for

__all__ = ["start"]


def output(reference: str) -> DriveIdentity:
    fits = tuple(library.matching_profiles(reference)) if reference else ()
    return DriveIdentity(1, "", reference, "", "", fits[0] if fits else None, fits)


def profile_of_kinds(*prefixes: str) -> Profile:
    known = {"reference_prefixes": list(prefixes)}
    return profile_of(parameter("A", 1), identification=known)


@pytest.mark.parametrize(
    ("reference", "profile"),
    [
        ("ATV71HU15M3", "atv312"),
        ("ATV312HU09M3", "atv31"),
        ("ATV31HU09M3S232", "atv312"),
        ("ATV21H075M3X", "atv71"),
        ("ATV71HU15M3", "powerdrive"),
        ("VFD055CP43B", "atv71"),
        ("ATV12H018M2", "atv312"),
    ],
)
def test_contradicting_family_is_reported_with_both_names(reference: str, profile: str) -> None:
    reported = contradiction(output(reference), library.load(profile))
    assert reported.startswith(f"Device 1 says it is {reference}")
    assert library.load(profile).name in reported


@pytest.mark.parametrize(
    ("reference", "profile"),
    [
        ("ATV71HU15M3", "atv71"),
        ("ATV31HU09M3", "atv31"),
        ("ATV31A075M3", "atv31"),  # a kind that no profile claims, of the same name
        ("ATV31", "atv31"),
        ("ATV31", "atv312"),  # cut short: it may be either
        ("", "atv71"),
        ("", "varmeca"),
        ("VFD055CP43B", "powerdrive"),  # names no kinds: nothing to compare
    ],
)
def test_possible_identity_is_not_a_contradiction(reference: str, profile: str) -> None:
    assert contradiction(output(reference), library.load(profile)) == ""
    assert contradiction(None, library.load(profile)) == ""


def test_own_profile_is_compared_by_its_references() -> None:
    assert contradiction(output("PUMP 7"), profile_of_kinds("PUMP")) == ""
    assert contradiction(output("FAN 7"), profile_of_kinds("PUMP"))
    assert contradiction(output("FAN 7"), profile_of_kinds()) == ""
    assert contradiction(output("ATV71HU15M3"), profile_of_kinds()), "another profile claims it"


class Answering(OneDrive):
    """A line whose drive answers function 43 this way; `priorities` lists the priorities."""

    def __init__(self, answer: IdentificationObjects | Exception) -> None:
        super().__init__({})
        self.answer = answer
        self.priorities: list[Priority] = []

    async def identify(
        self,
        device: int,
        *,
        priority: Priority = Priority.OPERATOR_READ,
        within: float | None = None,
        function: int = 43,
    ) -> IdentificationObjects:
        self.priorities.append(priority)
        if isinstance(self.answer, Exception):
            raise self.answer
        return self.answer


@pytest.mark.parametrize("error", [NoAnswer(1, 43, 0), DeviceException(1, 43, 0, code=1)])
async def test_unanswered_identification_is_requested_once(error: Exception) -> None:
    line = Answering(error)
    assert await own_words(line, 1, library.load("powerdrive")) is None
    assert line.priorities == [Priority.BACKGROUND], "a silent family is not waited for long"


@pytest.mark.parametrize("family", ["atv71", "powerdrive"])
@pytest.mark.parametrize("error", [ChecksumFault(1, 43, 0), WrongReply(1, 43, 0)])
async def test_damaged_identification_is_requested_again_and_decides_nothing(
    family: str, error: Exception
) -> None:
    line = Answering(error)
    with pytest.raises(type(error)):
        await own_words(line, 1, library.load(family))
    assert len(line.priorities) == 3


async def test_drive_without_identification_does_not_contradict() -> None:
    line = Answering(NoAnswer(1, 43, 0))
    profile = library.load("atv71")
    assert await own_words(line, 1, profile) is None
    assert len(line.priorities) == 2


async def test_lost_line_is_reported() -> None:
    with pytest.raises(LineLost):
        await own_words(Answering(LineLost("unplugged")), 1, library.load("atv71"))


@pytest.mark.parametrize("family", ["atv71", "powerdrive"])
def test_contradicting_drive_is_never_armed(family: str) -> None:
    identity = output("ATV312HU09M3")
    session = DriveSession(OneDrive({}), 1, library.load(family), identity)
    with pytest.raises(OrderRefused, match="says it is ATV312HU09M3, Altivar 312"):
        session.arming.arm()
    # nor if its state is read first
    with pytest.raises(OrderRefused, match="the profile of another drive"):
        Commander(session, Journal()).arm()
    assert not session.arming.armed


def test_matching_drive_is_armed() -> None:
    identity = replace(output("ATV312HU09M3"), device=1)
    session = DriveSession(OneDrive({}), 1, library.load("atv312"), identity)
    assert session.contradiction == ""
    session.arming.arm()


async def test_contradicting_drive_is_stopped_by_its_own_family(
    start: Start, journal: Journal
) -> None:
    """16#0007, the ramp stop of an Altivar 312, runs an Altivar 71 in the I/O profile."""
    simulation, line = start(DriveSpec("atv71", 1, sets={"CHCF": 3, "TCC": 0}))
    drive = simulation.drive(1)
    identity = await identify_drive(line, 1)
    line.describe(1, limits_of(library.load("atv71")))
    for address, word in ((8502, 200), (8501, 1)):
        await line.write(1, address, [word])
    await wait_for(lambda: drive.motor.frequency > 15)
    session = DriveSession(line, 1, library.load("atv312"), identity)
    sent = len(words_written(line))
    stopper = Stopper(line, journal)
    for _ in range(2):
        stopper.stop([session])
        assert (await ended(stopper, 1)).phase is Phase.STOPPED
    assert {word for address, word in words_written(line)[sent:] if address == 8501} == {0x0000}
    assert drive.motor.frequency == 0
