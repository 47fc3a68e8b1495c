"""A drive with a separate fault word, and a status word without a fault."""

from __future__ import annotations

import math

import pytest

from tests.limits import STATE_FRESH
from tui.bus.api import Priority
from tui.drive.chart import watched_codes
from tui.drive.command_blocked import IN_FAULT, state_refusal
from tui.drive.orders import OrderRefused
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.session.command.access import CommandAccess, CommandHistory
from tui.session.command.commander import give_order
from tui.session.drive import DriveSession
from tui.session.drive_state import drive_state
from tui.session.journal import Journal
from tui.session.monitor.rates import rates_of
from tui.session.read.reader import Reader

from .fake_clock import FakeClock
from .fakes import OneDrive, parameter, profile_of

STATUS, TRIP, COMMAND = 100, 101, 200
READY, RUNNING, RUN, STOP, RESET = 1, 2, 1, 0, 4
CHART = {
    "id": "own",
    "name": "Own chart",
    "kind": "io",
    "status": "STAT",
    "command": "CTL",
    "states": [
        {"id": "running", "name": "Running", "kind": "running", "mask": 2, "value": RUNNING},
        {"id": "ready", "name": "Ready", "kind": "ready", "mask": 3, "value": READY},
    ],
    "orders": [
        {"id": "forward", "name": "Run", "words": [RUN]},
        {"id": "stop", "name": "Stop", "words": [STOP]},
        {"id": "reset", "name": "Fault reset", "words": [RESET, STOP]},
    ],
}


def own(**faults: object) -> Profile:
    codes = [{"raw": 5, "code": "oL", "name": "Overload"}]
    return profile_of(
        parameter("STAT", STATUS),
        parameter("TRIP", TRIP, access="r"),
        parameter("CTL", COMMAND, quantity="command_word"),
        charts=[CHART],
        faults={"parameter": "TRIP", "codes": codes, **faults},
        monitoring={"values": [{"parameter": "STAT"}, {"parameter": "TRIP", "rate": "slow"}]},
        functions=[{"code": 3, "name": "Read", "max_read": 29}, {"code": 6, "name": "Write"}],
    )


class OwnDrive(OneDrive):
    """It takes its fault back on the reset bit, and runs on the run bit; its status hides both."""

    async def write(self, device: int, address: int, values: object, **how: object) -> float:
        assert isinstance(values, tuple | list)
        if address == COMMAND and values[0] & RESET:
            self.registers[TRIP] = 0
        if address == COMMAND and not self.registers[TRIP]:
            self.registers[STATUS] = RUNNING if values[0] & RUN else READY
        return await super().write(device, address, values, **how)  # type: ignore[arg-type]


def held(status: int, trip: int) -> dict[int, int]:
    return {STATUS: status, TRIP: trip, COMMAND: 0}


def access(line: OwnDrive, profile: Profile | None = None) -> CommandAccess:
    session = DriveSession(line, 1, profile or own())
    session.arming.arm(seconds=math.inf)
    return CommandAccess(session, Journal(), session.work.permit(), CommandHistory(session))


@pytest.mark.parametrize("status", [READY, RUNNING, 0])
async def test_fault_word_means_a_fault_whatever_the_status_word(status: int) -> None:
    made = access(OwnDrive(held(status, 5)))
    profile = made.session.profile
    state = drive_state(profile, await Reader(made.session).read(watched_codes(profile)))
    assert (state.kind, state.headline) == ("fault", "fault oL")
    assert state.fault is not None
    assert state.fault.name == "Overload"
    assert made.session.state(STATE_FRESH).kind == "fault"


@pytest.mark.parametrize(("faults", "trip"), [({"shows_last": True}, 5), ({"none": 9}, 9), ({}, 0)])
async def test_last_fault_and_no_fault_are_not_faults(faults: dict[str, object], trip: int) -> None:
    made = access(OwnDrive(held(READY, trip)), own(**faults))
    readings = await Reader(made.session).read(["STAT", "TRIP"])
    state = drive_state(made.session.profile, readings)
    assert (state.kind, state.fault) == ("ready", None)


async def test_tripped_drive_cannot_run_but_can_be_reset() -> None:
    line = OwnDrive(held(READY, 5))
    made = access(line)
    with pytest.raises(OrderRefused, match="in fault: reset it first"):
        await give_order(made, "forward")
    assert line.registers[COMMAND] == 0
    assert await give_order(made, "reset") == "Fault reset: Ready"
    assert await give_order(made, "forward") == "Run: Running"


def test_status_and_run_report_the_same_refusal() -> None:
    profile = own()
    chart = profile.data.charts[0]
    assert state_refusal(profile, chart, "forward", {"STAT": READY, "TRIP": 5}) == IN_FAULT
    assert state_refusal(profile, chart, "forward", {"STAT": READY, "TRIP": 0}) == ""
    atv21 = library.load("atv21")
    chart = atv21.data.charts[0]
    coasting = {"FD01": 0x0800, "FC90": 0}
    assert "possible only in these states" in state_refusal(atv21, chart, "forward", coasting)
    assert state_refusal(atv21, chart, "forward", {"FD01": 0x4000, "FC90": 0}) == ""
    assert state_refusal(atv21, chart, "forward", {"FD01": 0x4000, "FC90": 24}) == IN_FAULT


async def test_fault_word_does_not_mean_a_stopped_motor() -> None:
    """Settings that need standstill follow the status word if it says that the motor is enabled."""
    made = access(OwnDrive(held(RUNNING, 5)))
    session = made.session
    readings = await Reader(session).read(["STAT", "TRIP"])
    assert drive_state(session.profile, readings).motion == "running"
    assert session.rest_seen == -math.inf, "no rest was seen"


async def test_fault_read_long_ago_is_not_current() -> None:
    line, clock = OwnDrive(held(READY, 5)), FakeClock()
    session = DriveSession(line, 1, own(), clock=clock)
    await Reader(session).read(["STAT", "TRIP"], priority=Priority.POLL)
    line.registers[TRIP] = 0
    clock.advance(2 * STATE_FRESH)
    await Reader(session).read(["STAT"], priority=Priority.POLL)
    assert session.state(STATE_FRESH).kind == "ready"


def test_fault_word_is_read_as_often_as_the_state() -> None:
    rates = rates_of(own())
    assert "TRIP" in rates.fast
    assert "TRIP" not in rates_of(own(shows_last=True)).fast
