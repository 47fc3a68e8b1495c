"""A stop while the loop of the line hangs in its program: the keeper carries it out."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from tests.limits import HANGS_AFTER
from tui.bus.api import LineWorker
from tui.bus.fake import FakeLine
from tui.drive.profile import library
from tui.session.command import under_way
from tui.session.command.stop import Stopper
from tui.session.drive import DriveSession
from tui.session.journal import Journal

from .test_handover import Heard

DRIVES = (1, 2, 3)


class NeverBegins:
    """Work that waits for a loop which hangs."""

    def cancel(self) -> None:
        """It never ends."""

    def done(self) -> bool:
        return False


class HungLine(FakeLine):
    """A line whose loop accepts no new work."""

    def spawn(self, work: Callable[[], Coroutine[Any, Any, object]], name: str) -> LineWorker:
        return NeverBegins()


def stopped(line: FakeLine) -> Heard:
    """Notices of other programs about a stop of all drives."""
    voice = line.facts.voice = Heard()
    stopper = Stopper(line, Journal())
    stopper.stop([DriveSession(line, drive, library.load("atv71")) for drive in DRIVES])
    return voice


async def direct_stop(voice: Heard) -> tuple[object, ...] | None:
    """The first direct stop, if one is sent within some seconds."""
    for _ in range(500):
        if found := [pair for pair in voice.output if pair[0] == "directly"]:
            return found[0]
        await asyncio.sleep(0.01)
    return None


async def test_keeper_stops_drives_whose_stop_does_not_begin() -> None:
    voice = stopped(HungLine({drive: {} for drive in DRIVES}))
    assert await direct_stop(voice) == ("directly", DRIVES)


async def test_direct_stop_is_repeated_until_the_keeper_answers(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(under_way, "STOP_REPEATED_EVERY", 0.05)
    tries: list[tuple[int, ...]] = []

    class Silent(Heard):
        def stop_directly(self, devices: tuple[int, ...]) -> None:
            tries.append(devices)
            if len(tries) < 3:
                raise OSError("it does not answer")

    line = HungLine({drive: {} for drive in DRIVES})
    line.facts.voice = Silent()
    stopper = Stopper(line, Journal())
    stopper.stop([DriveSession(line, drive, library.load("atv71")) for drive in DRIVES])
    for _ in range(500):
        if len(tries) >= 3:
            break
        await asyncio.sleep(0.01)
    await asyncio.sleep(0.5)
    assert tries == [DRIVES] * 3


async def test_working_loop_sends_no_direct_stop(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(under_way, "HANGS_AFTER", 3.0)
    voice = stopped(FakeLine({drive: {} for drive in DRIVES}))
    assert await direct_stop(voice) is None


def test_hung_loop_is_detected_before_a_second_key_press() -> None:
    assert HANGS_AFTER <= 0.3
