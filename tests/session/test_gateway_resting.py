"""A client stops its motor and leaves: its drive does not trip while serve holds the line."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from tui.bus.gateway.pdu import Unanswerable
from tui.bus.gateway.talk import TcpClient
from tui.session.gateway.resting import RestingDrives
from tui.session.gateway.started import StartedMotors
from tui.session.gateway.writes import GatewayWrite
from tui.session.starts.record import StartNotRecorded
from tui.simulator import DriveSpec

from .test_gateway import CMD, LFR, Bench, Make, bench, start_motor
from .test_stop import start, wait_for

__all__ = ["bench", "start"]

TIMEOUT = 2.0
ALTIVAR_71 = DriveSpec("atv71", 1, sets={"CHCF": 1, "TTO": round(10 * TIMEOUT)})
STOP_21 = 0xC000
FAMILIES = {
    "atv71": (ALTIVAR_71, CMD, 0x0007),
    "atv21": (DriveSpec("atv21", 1, sets={"F803": 2}), 0xFA00, STOP_21),
}
REFUSED_BY = {
    "on record": (StartedMotors, "begin"),
    "on the line": (GatewayWrite, "_exchange"),
}


def fault(made: Bench) -> object:
    return made.simulation.drive(1).fault


async def left_for(made: Bench, seconds: float) -> None:
    """No client asks for so long."""
    made.gateway.gone(made.client)
    made.client = TcpClient(made.client.number + 1, "10.0.0.9:5001")
    await asyncio.sleep(seconds)


@pytest.mark.parametrize("family", FAMILIES)
async def test_drive_stays_alive_after_a_stop_and_a_disconnect(bench: Make, family: str) -> None:
    spec, register, word = FAMILIES[family]
    made = bench(spec, commands=True)
    assert await made.write(register, word) == 0
    await left_for(made, 3 * TIMEOUT)
    assert fault(made) is None


async def test_drive_stays_alive_after_a_run(bench: Make) -> None:
    made = bench(ALTIVAR_71, commands=True)
    await start_motor(made)
    assert await made.write(CMD, 0x0007) == 0
    assert await made.write(LFR, 0) == 0
    await left_for(made, 4 * TIMEOUT)
    assert fault(made) is None


async def test_start_ends_the_keep_alive(bench: Make) -> None:
    made = bench(ALTIVAR_71, commands=True)
    facts = made.line.facts
    assert await made.write(CMD, 0x0007) == 0
    await wait_for(lambda: bool(facts.keep_alives.of(facts.me.id)))
    assert await made.write(CMD, 0x000F) == 0
    assert facts.keep_alives.of(facts.me.id) == []


async def test_running_motor_is_not_kept_alive(bench: Make) -> None:
    """Its controller has disconnected: the drive's own timeout stops it."""
    made = bench(ALTIVAR_71, commands=True)
    assert await made.write(CMD, 0x0007) == 0
    await start_motor(made)
    await left_for(made, 0)
    await wait_for(lambda: fault(made) is not None)


@pytest.mark.parametrize("where", ["on record", "on the line"])
async def test_refused_start_keeps_a_resting_drive_alive(
    bench: Make, monkeypatch: pytest.MonkeyPatch, where: str
) -> None:
    made = bench(ALTIVAR_71, commands=True)
    assert await made.write(CMD, 0x0007) == 0

    async def refused(*_: object, **__: object) -> bool:
        if where == "on record":
            raise StartNotRecorded(1, Path("/state"), "the disk is full")
        raise Unanswerable(6)

    monkeypatch.setattr(*REFUSED_BY[where], refused)
    assert await made.write(CMD, 0x000F) != 0
    await left_for(made, 3 * TIMEOUT)
    assert fault(made) is None


async def test_motor_started_by_another_source_is_not_kept_alive(bench: Make) -> None:
    made = bench(ALTIVAR_71, commands=True)
    assert await made.write(CMD, 0x0007) == 0
    await left_for(made, TIMEOUT)
    made.simulation.drive(1).run(30.0)
    await wait_for(lambda: fault(made) is not None)


async def test_motor_that_ignores_its_stop_is_not_kept_alive(bench: Make) -> None:
    """The stop was answered, and another source runs the motor: the drive's timeout acts."""
    made = bench(ALTIVAR_71, commands=True)
    drive = made.simulation.drive(1)
    assert await made.write(CMD, 0x0007) == 0
    drive.run(30.0)
    await left_for(made, 0)
    await wait_for(lambda: fault(made) is not None)


async def test_drive_without_a_reply_to_its_stop_is_not_kept_alive(
    bench: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = bench(ALTIVAR_71, commands=True)
    assert await made.read(CMD) != ()
    kept: list[int] = []
    monkeypatch.setattr(RestingDrives, "keep", lambda _, session: kept.append(session.device))
    assert await made.write(CMD, 0x0007) == 0
    assert kept == [1]
    made.simulation.unplug()
    assert await made.write(CMD, 0x0007) != 0
    assert kept == [1]
