"""Pictures of Frames: words, the result of a filter, and the counters."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import pytest
from textual.pilot import Pilot

from tests.sweeps import kept
from tui.app import DrivePanelApp
from tui.bus.api import DeviceCounters, Frame, LineCounters
from tui.drive.profile import library
from tui.screens.frames.screen import FramesScreen
from tui.session.console import DriveConsole
from tui.session.counters.compare import Bounds, Comparison, DriveCount
from tui.session.fleet import FoundDrive
from tui.wire.frames import sealed

from . import fakes
from .test_pictures import BOTH_SIZES
from .test_pictures import no_ports as no_ports  # the fixture is for these pictures too

Compare = Callable[..., bool]
QUERIES = ("02 03 0C81 0001", "02 06 2329 0032", "02 03 2135 0002", "05 03 0C81 0001")
ANSWERED = ("02 03 02 0637", "02 86 04", "02 03 04 000F 0190", "")
OURS = DeviceCounters(
    1204, 1197, 4, 2, 1, 3, {2: 3, 6: 1}, 9632, 21_450, 31.2, (0, 212, 840, 120, 19, 4, 2, 0, 0, 0)
)


SATURATED = DriveCount(0, 65_535, Bounds(621, 621), Bounds(599, 599))


def log() -> tuple[Frame, ...]:
    """Some seconds of a line: reads, a refusal, a damaged reply, silence."""
    frames = []
    for number in range(24):
        at = fakes.NOW - 30.0 + 0.4 * number
        requested, answered = QUERIES[number % 4], ANSWERED[number % 4]
        frames.append(Frame(at, "out", sealed(bytes.fromhex(requested))))
        if answered:
            note = "damaged" if number == 6 else ""
            frames.append(Frame(at + 0.0123, "in", sealed(bytes.fromhex(answered)), note))
    return tuple(frames)


def comparison(frames: int, sent: int, damaged: int = 0, answered: int = 0) -> Comparison:
    nothing = Bounds(0, 0)
    first = DriveCount(65_400, 12, nothing, nothing)
    counted = (65_400 + frames) % 65_536
    last = DriveCount(counted, 12 + damaged, Bounds(sent, sent), Bounds(answered, answered))
    return Comparison(first, last, frames, damaged)


def lossy(console: DriveConsole) -> None:
    """Frames were lost on both ways."""
    watch = console.counters
    watch._drive = {
        "function 8": comparison(612, 620, 5, 598),
        "Modbus network": comparison(613, 621, 5, 599),
        "Keypad port": replace(comparison(0, 621, 0, 599), last=SATURATED),
    }
    watch._begun = fakes.NOW - 95.0


def agreeing(console: DriveConsole) -> None:
    console.counters._drive = {"function 8": comparison(612, 612, 0, 612)}
    console.counters._begun = fakes.NOW - 600.0


def none(console: DriveConsole) -> None:
    console.counters._begun = fakes.NOW - 8000.0


PAGES: dict[str, tuple[Sequence[str], Callable[[DriveConsole], None]]] = {
    "words": ((), none),
    "filter": (("O", *"2-error"), none),
    "found": (("j", *"acc", "enter", "enter"), none),
    "bytes": (("tab",), none),
    "lossy": (("tab", "tab"), lossy),
    "agreeing": (("tab", "tab"), agreeing),
    "no-counters": (("tab", "tab"), none),
}


def panel(page: str, monkeypatch: pytest.MonkeyPatch) -> tuple[DrivePanelApp, DriveConsole]:
    """The panel on a drive after some exchanges."""
    monkeypatch.setattr("tui.screens.frames.screen.CounterKeys._begin_sum", lambda _: None)
    snapshot = fakes.snapshot_of(library.load("atv71"), fakes.RUNNING)
    app = fakes.app_of(kind=fakes.Easel)
    app.opened = fakes.opened()
    console = fakes.console_of(snapshot)
    console.session.clock = app.clock
    line = console.session.line
    line.trace = log()  # type: ignore[misc]
    line.counters = LineCounters(devices={console.device: OURS}, busy_seconds=40.0)  # type: ignore[misc]
    app.fleet = fakes.StillFleet(FoundDrive(fakes.ATV71, console))
    fakes.choose(app, console)
    watch = console.counters
    watch._line = LineCounters(
        devices={console.device: replace(OURS, requests=584, replies=598, timeouts=1)}
    )
    PAGES[page][1](console)
    return app, console


@BOTH_SIZES
@pytest.mark.parametrize("page", kept(PAGES, "filter", "lossy"))
def test_frames(
    snap_compare: Compare, page: str, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch
) -> None:
    app, console = panel(page, monkeypatch)
    keys = PAGES[page][0]

    async def show(pilot: Pilot[None]) -> None:
        await app.push_screen(FramesScreen(console))
        await pilot.pause()
        await pilot.press(*keys)
        await pilot.pause()
        app.screen.look()  # type: ignore[attr-defined]
        await pilot.pause()

    assert snap_compare(app, terminal_size=size, run_before=show)
