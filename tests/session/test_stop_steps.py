"""Steps of a stop without a wire: its words, what it reads for them, and who runs the motor."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.api import Priority
from tui.bus.errors import NoAnswer
from tui.drive.channel import Channel
from tui.drive.orders import choose
from tui.session.command import last_known, motor_stop
from tui.session.command.last_known import run_by_others
from tui.session.command.motor_stop import FirstWave
from tui.session.command.stop_report import Phase, not_stopped
from tui.session.journal import Journal

from .test_stop_followed import (
    COMMAND,
    PROFILE,
    RUNNING,
    OneStop,
    OwnTime,
    Ramp,
    journal,
    turns,
)

__all__ = ["journal"]
CHART = PROFILE.data.charts[0]
RAMP_STOP = choose(CHART, "stop", {})


class Watched(Ramp):
    """A drive that notes the priority of each read, and the options of each write."""

    def __init__(self) -> None:
        super().__init__(OwnTime(), 0.0)
        self.priorities: list[Priority] = []
        self.how: list[dict[str, Any]] = []

    async def before_read(self, device: int, registers: range, priority: Priority) -> None:
        self.priorities.append(priority)
        await super().before_read(device, registers, priority)

    async def write(self, device: int, address: int, values: Sequence[int], **how: Any) -> float:
        self.how.append(how)
        return await super().write(device, address, values, **how)


async def test_word_of_a_stop_has_the_priority_of_stops_and_is_in_the_journal(
    journal: Journal,
) -> None:
    drive = Watched()
    here = OneStop(drive, journal)
    await here.stop._send(CHART, RAMP_STOP, within=0.1)
    assert [(how["priority"], how["within"]) for how in drive.how] == [(Priority.STOP, 0.1)]
    assert [entry.why for entry in journal.recent] == ["stopped: Ramp stop"]


async def test_what_selects_a_stop_is_read_with_the_priority_of_stops(journal: Journal) -> None:
    drive = Watched()
    here = OneStop(drive, journal)
    await here.stop._read_anew(["CHCF", "ETA", "CHCF"])
    assert set(drive.priorities) == {Priority.STOP}
    before = len(drive.priorities)
    await here.stop._read_anew(["CHCF"])
    assert len(drive.priorities) == before, "just read"


@pytest.mark.parametrize("known", [True, False])
async def test_stop_of_a_drive_that_cannot_be_read_is_by_what_is_certain(
    known: bool, journal: Journal, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    any_chart = object()

    async def read_anew(*_: object) -> None:
        raise NoAnswer(1, 3, 3201)

    def in_force(profile: object, raws: object) -> Any:
        assert (profile, raws) == (PROFILE, {})
        return CHART if known else None

    monkeypatch.setattr(motor_stop, "chart_in_force", in_force)
    monkeypatch.setattr(motor_stop.MotorStop, "_read_anew", read_anew)
    monkeypatch.setattr(motor_stop, "stop_in_any", lambda *of: (any_chart, *of))
    found = cast(Any, await here.stop._chosen())
    if known:
        assert found == (CHART, RAMP_STOP)
        assert "stop of device 1 without a read: " in caplog.text
    else:
        assert found == (any_chart, PROFILE, {})


async def test_drive_leaves_a_wave_as_soon_as_its_word_is_sent(journal: Journal) -> None:
    waiting: list[str] = []

    class Wave(FirstWave):
        def passed(self, device: int) -> None:
            waiting.append(f"passed {device}")

        async def over(self) -> None:
            waiting.append("over")

    here = OneStop(Ramp(OwnTime(), 0.0), journal, wave=Wave([1, 2]))
    assert await here.stop.carry_out() is None
    assert waiting == ["passed 1", "over"]


def test_value_that_is_in_doubt_is_not_certain(journal: Journal) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    here.session.image.confirm("CHCF", 1, 999.0)
    here.session.image.distrust()
    here.session.image.confirm("ETA", RUNNING, 1000.0)
    assert here.stop._sure(["CHCF"]) == {}


def run_by(here: OneStop, channel: Channel | None, local: bool, monkeypatch: Any) -> str:
    monkeypatch.setattr(last_known, "command_channel", lambda *_: channel)
    state = SimpleNamespace(motion="running", local=local)
    return run_by_others(cast(Any, SimpleNamespace(
        state=lambda _: state, profile=PROFILE, image=here.session.image
    )))  # fmt: skip


STOP_THERE = "not Modbus. Stop it there or at the machine."


@pytest.mark.parametrize(
    ("channel", "local", "text"),
    [
        (None, False, ""),
        (None, True, f"its terminals or keypad run the motor, {STOP_THERE}"),
        (Channel("the keypad", False), False, f"its command source is the keypad, {STOP_THERE}"),
        (Channel("the keypad", False, PROFILE["CHCF"]), True,
         f"its command source is the keypad (CHCF), {STOP_THERE}"),
        (Channel("Modbus", True), False, ""),
        (Channel("", False), False, ""),
    ],
)  # fmt: skip
def test_source_that_runs_a_motor_is_named_with_its_word(
    channel: Channel | None, local: bool, text: str, journal: Journal,
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    assert run_by(here, channel, local, monkeypatch) == text


async def test_stop_of_a_motor_that_another_source_runs_is_reported_as_unheeded(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    monkeypatch.setattr(motor_stop, "run_by_others", lambda _: "the keypad runs it.")
    await here.stop._send(CHART, RAMP_STOP)
    assert here.reports == [(Phase.UNHEEDED, not_stopped("the keypad runs it."), 1000.0)]
    assert here.written == [7], "it may obey anyway"
    await turns()


async def test_word_keeps_option_bits_only_of_a_known_word(
    journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    here = OneStop(Ramp(OwnTime(), 0.0), journal)
    monkeypatch.setattr(motor_stop, "with_options", lambda chart, order, kept: [kept.get("CMD", 5)])
    await here.stop._send(CHART, RAMP_STOP)
    here.session.image.confirm("CMD", 0x0800, 1001.0)
    await here.stop._send(CHART, RAMP_STOP)
    await here.stop._send(CHART, RAMP_STOP)
    assert here.written == [5, 0x0800, 0x0800], "the word before the stop"
    assert COMMAND == PROFILE["CMD"].address
