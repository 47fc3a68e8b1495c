"""Drives of a guessed family: a stop word is sent, and they are never reported as stopped."""

from __future__ import annotations

import time
from pathlib import Path

import pytest

from tests.sent import words_written
from tui.bus.fake import FakeLine
from tui.bus.requests import WriteOne
from tui.drive.profile import library
from tui.screens.frame_source import is_not_stopped
from tui.session.command.stop import Stopper
from tui.session.command.stop_report import Phase
from tui.session.connect.identify import DriveIdentity
from tui.session.drive import DriveSession
from tui.session.fleet import Fleet
from tui.session.journal import Journal
from tui.session.starts.keeper import StartKeeper
from tui.session.starts.starts import Starts
from tui.simulator import DriveSpec

from .test_stop import WORDS, Start, ended, start, wait_for

__all__ = ["start"]
LEROY_SOMER = ("powerdrive", "proxidrive", "varmeca")
PUMP = Path(__file__).parent.parent / "drive" / "pump.toml"
STATUS, COMMAND = 1039, 641
"""Status register and command register of drives without identification."""


def nameless(*candidates: str) -> DriveIdentity:
    return DriveIdentity(1, "", "", "", "", None, candidates)


async def test_stop_of_a_guessed_drive_sends_its_word_and_reports_not_stopped(
    start: Start, journal: Journal
) -> None:
    simulation, line = start(DriveSpec("powerdrive", 1, run_hz=20.0, sets={"6.43": 1, "6.42": 3}))
    drive = simulation.drive(1)
    await wait_for(lambda: drive.motor.frequency > 5)
    fleet = Fleet(line, journal)
    session = DriveSession(line, 1, library.load("powerdrive"), nameless(*LEROY_SOMER))
    fleet.take(session, guessed=True)
    fleet.stop([session])
    report = await ended(fleet.stopper, 1)
    assert words_written(line)[0] == WORDS["powerdrive"]
    assert drive.motor.frequency == 0
    assert report.phase is Phase.FAILED
    assert report.text == (
        "NOT STOPPED: it is not known if the motor stopped. The drive does not identify itself."
        " Read as Powerdrive, it is at standstill. Check the machine, or name its profile."
    )
    # nor does what is read by that guess afterwards take it off the screen
    session.rest_seen = time.monotonic()
    assert is_not_stopped(report, session, report.since + 1)
    # the same profile, named: the same drive is reported as stopped
    again = DriveSession(line, 1, library.load("powerdrive"), nameless(*LEROY_SOMER))
    console = fleet.take(again)
    assert console.session is session
    fleet.stop([session])
    assert (await ended(fleet.stopper, 1)).phase is Phase.STOPPED
    fleet.forget()


@pytest.fixture
def other_family() -> str:
    """A profile of the user's own for drives that identify nothing; 1 runs them and 0 stops."""
    text = PUMP.read_text("utf-8").replace('id = "example-pump"', 'id = "quiet-pump"')
    text = text.replace("code = 43\n", "code = 17\n").replace(
        "address = 100\n", f"address = {STATUS}\n"
    )
    folder = library.user_folder()
    folder.mkdir(parents=True)
    path = folder / "quiet-pump.toml"
    path.write_text(text.replace("address = 300\n", f"address = {COMMAND}\n"), "utf-8")
    assert library.faults_of(path) == []
    return "quiet-pump"


async def test_silent_drive_of_several_families_is_sent_the_common_stop_word(
    other_family: str, journal: Journal
) -> None:
    line = FakeLine({1: {}})
    line.silence(1)
    stopper = Stopper(line, journal)
    session = DriveSession(
        line, 1, library.load("powerdrive"), nameless(*LEROY_SOMER, other_family)
    )
    session.guessed = True
    stopper.stop([session])
    report = await ended(stopper, 1)
    assert report.text == "NOT STOPPED: it did not answer. Stop it at the machine."
    sent = {
        (request.address, request.value)
        for request in line.requests
        if isinstance(request, WriteOne)
    }
    assert sent == {(COMMAND, 0x0000)}


@pytest.mark.parametrize("several", [False, True])
async def test_guess_among_families_sends_the_word_that_stops_all(
    other_family: str, several: bool, journal: Journal
) -> None:
    """16#0001, the ramp stop of the family that it is taken for, would run the other."""
    line = FakeLine({device: {STATUS: 0x0002, COMMAND: 1} for device in (1, 2)})
    stopper = Stopper(line, journal)
    sessions = []
    for device in (1, 2) if several else (1,):
        identity = DriveIdentity(device, "", "", "", "", None, (*LEROY_SOMER, other_family))
        sessions.append(DriveSession(line, device, library.load("powerdrive"), identity))
        sessions[-1].guessed = True
    stopper.stop(sessions)
    for session in sessions:
        report = await ended(stopper, session.device)
        assert report.phase is Phase.FAILED
        assert "it is not known if the motor stopped" in report.text
        assert "Read as" not in report.text
    sent = [
        (request.address, request.value)
        for request in line.requests
        if isinstance(request, WriteOne)
    ]
    assert sent == [(COMMAND, 0x0000)] * len(sessions)


def test_start_of_a_guessed_family_is_recorded_as_a_guess(tmp_path: Path) -> None:
    starts = Starts(tmp_path)
    session = DriveSession(FakeLine(), 1, library.load("powerdrive"), nameless(*LEROY_SOMER))
    for guessed in (False, True):
        session.guessed = guessed
        StartKeeper("panel", starts).begin(session, "forward")
        assert starts.newest(session.line_text)[1].guessed is guessed
    assert starts.close(60)
