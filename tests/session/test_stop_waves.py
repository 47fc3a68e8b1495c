"""Several drives stopped together: a word to all of them first, then the necessary reads."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from contextlib import suppress

import pytest

from tests.limits import SEEN_RUNNING
from tui.bus.api import Priority
from tui.bus.errors import LineError
from tui.bus.fake import FakeLine
from tui.drive.orders import order_target
from tui.drive.profile import library
from tui.drive.profile.schema import OrderId
from tui.session.command.last_known import last_known_stop, run_by_others
from tui.session.command.stop import Stopper
from tui.session.command.stop_report import NOT_STOPPED, Phase, StopReport
from tui.session.drive import DriveSession
from tui.session.journal import Journal
from tui.session.read.reader import Reader
from tui.simulator import DriveSpec

from .fake_clock import FakeClock
from .test_stop import Start, ended, start, wait_for

__all__ = ["start"]
ENABLED, READY = 0x0637, 0x0631
SEEN = {"atv71": {"CHCF": 1, "DOTD": 1, "ETA": ENABLED}}


def seen(family: str, raws: Mapping[str, int], ago: float = 0.0) -> DriveSession:
    """A drive whose words were read this many seconds ago."""
    clock = FakeClock()
    session = DriveSession(FakeLine(), 1, library.load(family), clock=clock)
    for code, raw in raws.items():
        session.image.confirm(code, raw, clock.monotonic())
    clock.advance(ago)
    return session


@pytest.mark.parametrize(
    ("family", "raws", "ago", "order", "word"),
    [
        ("atv71", {"CHCF": 1, "DOTD": 1, "ETA": ENABLED}, 3.0, "stop", 0x0007),
        ("atv71", {"CHCF": 1, "DOTD": 0, "ETA": ENABLED}, 3.0, "stop", 0x010F),
        ("atv71", {"CHCF": 3, "DOTD": 1, "ETA": ENABLED}, 3.0, "stop", 0x0000),
        # 16#0007 starts a motor at rest, should its chart be the I/O profile by now
        ("atv71", {"CHCF": 1, "DOTD": 1, "ETA": READY}, 0.0, "stop", 0x0000),
        ("atv71", {"CHCF": 1, "ETA": ENABLED}, SEEN_RUNNING + 1, "stop", 0x0000),
        ("atv71", {"ETA": ENABLED}, 0.0, "stop", 0x0000),
        ("atv71", {}, 0.0, "stop", 0x0000),
        ("atv31", {}, 0.0, "stop", 0x0007),
        ("atv31", {}, 0.0, "quick-stop", 0x0002),
        ("atv21", {}, 0.0, "stop", 0xC000),
        ("powerdrive", {}, 0.0, "stop", 0x0000),
    ],
)
def test_first_stop_word_starts_no_motor_in_any_chart(
    family: str, raws: Mapping[str, int], ago: float, order: OrderId, word: int
) -> None:
    session = seen(family, raws, ago)
    chart, chosen = last_known_stop(session, order)
    assert [number & 0xFFFF for number in chosen.words] == [word]
    assert order_target(session.profile, chart, chosen).code == chart.command


async def test_every_drive_gets_its_stop_word_before_any_read(
    start: Start, journal: Journal, monkeypatch: pytest.MonkeyPatch
) -> None:
    families = ["atv71", "atv31", "powerdrive", "atv71", "atv21"]
    specs = [
        DriveSpec(
            item, n, run_hz=20.0, sets={} if item.startswith("atv") else {"6.43": 1, "6.42": 3}
        )
        for n, item in enumerate(families, start=1)
    ]
    simulation, line = start(*specs)
    for n in range(1, 6):
        drive = simulation.drive(n)
        await wait_for(lambda drive=drive: drive.motor.frequency > 5)  # type: ignore[misc]
    dead = DriveSession(line, 9, library.load("atv31"))
    with suppress(LineError):
        await line.read(9, 3201, priority=Priority.OPERATOR_READ)
    live = [DriveSession(line, n, library.load(item)) for n, item in enumerate(families, start=1)]
    for session in live:
        status = session.profile.data.charts[0].status
        await Reader(session).read([status, *(["CHCF"] if session.profile.get("CHCF") else [])])
    seen_phases: list[tuple[int, Phase, bool]] = []
    report = Stopper._report

    def sent() -> list[tuple[int, int]]:
        frames = [f.data for f in list(line.trace)[before:] if f.direction == "out"]
        return [(data[0], data[1]) for data in frames]

    def note(
        entry: Stopper, session: DriveSession, phase: Phase, text: str, ordered: float
    ) -> None:
        seen_phases.append((session.device, phase, (session.device, 6) in sent()))
        report(entry, session, phase, text, ordered)

    monkeypatch.setattr(Stopper, "_report", note)
    before = len(line.trace)
    stopper = Stopper(line, journal)
    stopper.stop([dead, *live])
    for session in live:
        result = await ended(stopper, session.device)
        assert result.phase is Phase.STOPPED, result.text
    first = [pair for pair in sent() if pair[0]][:6]
    assert sorted(first) == [(1, 6), (2, 6), (3, 6), (4, 6), (5, 6), (9, 6)]
    assert first[-1] == (9, 6), "one that answers nothing is waited for last"
    assert {frame for _, phase, frame in seen_phases if phase is Phase.SENDING} == {False}
    assert {frame for _, phase, frame in seen_phases if phase is Phase.STOPPING} == {True}


async def ending(stopper: Stopper, device: int, phase: Phase) -> StopReport:
    def there() -> bool:
        return device in stopper.reports and stopper.reports[device].phase is phase

    await wait_for(there, 10.0)
    return stopper.reports[device]


async def test_motor_run_by_terminals_is_not_reported_as_stopped(
    start: Start, journal: Journal
) -> None:
    simulation, line = start(DriveSpec("atv31", 1, sets={"CHCF": 1, "Fr1": 1}))
    drive = simulation.drive(1)
    drive.set_input("LI1", "1")
    drive.set_input("AI1", "5")
    await wait_for(lambda: drive.motor.frequency > 5)
    session = DriveSession(line, 1, library.load("atv31"))
    await Reader(session).read(["ETA", "ETI", "LAC", "CHCF", "rFC", "Fr1"])
    assert run_by_others(session).startswith("its command source is Terminals (Fr1)")
    stopper = Stopper(line, journal)
    stopper.stop([session])
    report = await ending(stopper, 1, Phase.UNHEEDED)
    assert report.since - report.time < 1.0, "long before it is seen that it runs on"
    assert report.text == (
        f"{NOT_STOPPED}its command source is Terminals (Fr1), not Modbus. Stop it there or at the"
        " machine."
    )
    assert not stopper.wait([session], 0.0).ended, "it is followed on"
    drive.set_input("LI1", "0")
    assert (await ended(stopper, 1)).phase is Phase.STOPPED, "seen to stop after all"


async def test_stop_is_sent_although_another_source_runs_the_motor(
    start: Start, journal: Journal
) -> None:
    simulation, line = start(DriveSpec("atv31", 1, sets={"CHCF": 1, "Fr1": 1}))
    simulation.drive(1).set_input("LI1", "1")
    session = DriveSession(line, 1, library.load("atv31"))
    await Reader(session).read(["ETA", "ETI", "LAC", "CHCF", "rFC", "Fr1"])
    Stopper(line, journal).stop([session])
    await wait_for(lambda: any(f.data[1] == 6 for f in line.trace if f.direction == "out"))
    await asyncio.sleep(0)
