"""The frame on a real line: live on every screen and over every dialog."""

from __future__ import annotations

import itertools
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from types import SimpleNamespace
from typing import Any

import pytest
from textual.pilot import Pilot

from tests.sweeps import kept
from tui.app import DrivePanelApp
from tui.bus.errors import LineError
from tui.screens.dialogs.question import Question
from tui.screens.faults.screen import FaultsScreen
from tui.screens.frame_source import FrameSource
from tui.screens.key_dispatcher import NOBODY_TO_STOP
from tui.screens.monitor.screen import MonitorScreen
from tui.screens.parameters.screen import ParametersScreen
from tui.session.connect.open_line import demo_line
from tui.session.events import EventLog
from tui.session.work import OutcomeKind
from tui.simulator import Simulation
from tui.widgets.lines import Lines
from tui.widgets.strip import FrameView

pytestmark = pytest.mark.long


class Panel:
    """The panel on two simulated drives, the first of them on Monitor."""

    def __init__(self, app: DrivePanelApp, pilot: Pilot[None]) -> None:
        self.app, self.pilot = app, pilot

    @property
    def simulation(self) -> Simulation:
        assert self.app.opened is not None
        assert self.app.opened.simulation is not None
        return self.app.opened.simulation

    def shown(self, place: str) -> str:
        """Text at a place of the top screen."""
        found = self.app.screen.query(f"#{place}").results(Lines)
        return "\n".join(line.plain for lines in found for line in lines.lines)

    async def until(self, holds: Callable[[], object], seconds: float = 30.0) -> None:
        end = time.monotonic() + seconds
        while not holds():
            assert time.monotonic() < end, (
                f"{self.shown('strip')!r} {self.shown('tabs')!r} {self.shown('said')!r}"
            )
            await self.pilot.pause(0.05)

    async def on(self, place: str) -> None:
        """Go to a screen of the first drive."""
        await self.pilot.press(place)
        await self.until(lambda: self.shown("strip").strip())


@asynccontextmanager
async def panel() -> AsyncIterator[Panel]:
    app = DrivePanelApp(
        open_line=lambda *_, **__: demo_line({"atv71": 30.0, "atv312": 0.0}), start="demo", device=1
    )
    bells: list[None] = []
    app.bell = lambda: bells.append(None)  # type: ignore[method-assign]
    async with app.run_test(size=(80, 24)) as pilot:
        made = Panel(app, pilot)
        await made.until(lambda: app.chosen is not None)
        await made.until(lambda: "FORWARD" in made.shown("strip"))
        made.bells = bells  # type: ignore[attr-defined]
        yield made


@pytest.mark.parametrize("key", kept(["1", "2", "3", "4", "5", "6", "7", "m"], "1", "3"))
async def test_status_bar_shows_the_motor_on_every_screen(key: str) -> None:
    async with panel() as made:
        await made.on(key)
        await made.until(lambda: "FORWARD" in made.shown("strip") and "Hz" in made.shown("strip"))
        assert "1 Line" in made.shown("tabs")


@pytest.mark.parametrize(
    "key", kept(["3", "4", "z", "question_mark", "ctrl+p"], "3", "question_mark")
)
async def test_trip_is_shown_in_the_status_bar_and_over_dialogs(key: str) -> None:
    async with panel() as made:
        await made.pilot.press(key)
        made.simulation.drive(1).provoke("ObF")
        await made.until(lambda: "FAULT ObF" in made.shown("strip"))
        await made.until(lambda: "Tripped on ObF" in made.shown("said"))
        assert "1 fault" in made.shown("strip")
        assert made.bells == [None]  # type: ignore[attr-defined]


async def test_reply_to_a_key_stays_on_its_screen_and_a_trip_does_not() -> None:
    async with panel() as made:
        made.app.events.add("done", "Wrote 3 parameters, all verified.", 1)
        await made.until(lambda: "Wrote 3" in made.shown("said"))
        await made.pilot.press("up")
        await made.until(lambda: "Not armed" in made.shown("said"))
        await made.on("3")
        await made.until(lambda: "Wrote 3" in made.shown("said"))
        assert "Not armed" not in made.shown("said")
        await made.on("2")
        await made.until(lambda: "Not armed" in made.shown("said"))
        made.simulation.drive(1).provoke("ObF")
        await made.until(lambda: "Tripped on ObF" in made.shown("said"))
        await made.on("3")
        await made.pilot.pause(0.6)
        assert "Tripped on ObF" in made.shown("said")


def test_reply_to_a_key_stays_with_its_drive() -> None:
    first, second = object(), object()
    events = EventLog()
    app: Any = SimpleNamespace(events=events, place="monitor", chosen=first, fleets=[])
    source = FrameSource(app)
    about = events.add("done", "Wrote 3 parameters, all verified.", 1)
    reply = events.add("told", "Not armed. Press a to arm this drive.")
    assert source._event() is reply
    app.chosen = second
    assert source._event() is about
    app.chosen = first
    assert source._event() is reply


async def test_failed_work_and_a_stop_in_vain_are_shown_on_every_screen() -> None:
    async with panel() as made:
        console = made.app.chosen
        assert console is not None
        work = console.session.work
        work.report(OutcomeKind.REFUSED, "It may have been written.", LineError("no reply"))
        await made.until(lambda: "may have been written" in made.shown("said"))
        await made.on("3")
        await made.pilot.pause(0.6)
        assert "may have been written" in made.shown("said")
        made.app._warn(NOBODY_TO_STOP)
        await made.until(lambda: "Nothing was stopped" in made.shown("said"))
        await made.on("2")
        await made.pilot.pause(0.6)
        assert "Nothing was stopped" in made.shown("said")


async def test_fault_is_new_until_faults_is_opened() -> None:
    async with panel() as made:
        made.simulation.drive(1).provoke("ObF")
        await made.until(lambda: made.app.fleet is not None and made.app.fleet.alarms.unseen)
        await made.on("3")
        assert isinstance(made.app.screen, ParametersScreen)
        assert made.app.fleet is not None
        assert made.app.fleet.alarms.unseen
        await made.on("5")
        assert isinstance(made.app.screen, FaultsScreen)
        await made.until(lambda: made.app.fleet is not None and not made.app.fleet.alarms.unseen)
        await made.until(lambda: "Why" in made.shown("doctor"))
        assert made.app.fleet.journal.recent == ()


async def test_enter_opens_the_parameter_of_a_fault() -> None:
    async with panel() as made:
        made.simulation.drive(1).provoke("ObF")
        await made.on("5")
        await made.until(lambda: "Open DEC" in made.shown("doctor"))
        await made.pilot.press("enter")
        await made.until(lambda: isinstance(made.app.screen, ParametersScreen))
        await made.until(lambda: made.shown("detail").lstrip().startswith("DEC"))


async def test_stop_is_reported_on_the_screen_where_it_was_given() -> None:
    async with panel() as made:
        await made.on("3")
        await made.pilot.press("space")
        await made.until(lambda: "STOPPING" in made.shown("strip"))
        await made.until(lambda: "topped" in made.shown("said"), 60.0)


async def test_status_bar_is_updated_during_a_question() -> None:
    async with panel() as made:
        await made.pilot.press("z")
        await made.until(lambda: isinstance(made.app.screen, Question))
        before = made.shown("strip")
        made.simulation.drive(1).run(10.0)
        await made.until(lambda: made.shown("strip") != before)


@pytest.mark.parametrize("part", ["said", "strip", "state", "top"])
@pytest.mark.sweep
async def test_closing_screen_is_not_drawn(part: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """When the panel ends the parts go one by one, and the next look may come between."""
    async with panel() as made:
        screen = made.app.screen
        assert isinstance(screen, MonitorScreen)
        with monkeypatch.context() as ending:
            ending.setattr(type(made.app), "is_running", property(lambda _: False))
            await screen.query(f"#{part}").remove()
            made.app.look_around()
            screen.look()
            made.app.exit()


async def test_slow_link_draws_values_rarely_and_a_trip_immediately(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with panel() as made:
        drawn: list[FrameView] = []
        within: list[int] = []
        made.app.low_bandwidth = True
        monkeypatch.setattr(made.app.screen, "draw_frame", drawn.append)
        values = itertools.count()
        view = made.app.frame_now()

        def trembling() -> FrameView:
            assert view.strip.drive is not None
            drive = view.strip.drive._replace(frequency=f"{next(values)}")
            return view._replace(strip=view.strip._replace(drive=drive))

        monkeypatch.setattr(made.app._frame, "view", trembling)
        monkeypatch.setattr(made.app.screen, "look", lambda: within.append(len(drawn)))
        for _ in range(50):
            made.app.draw_frame()
        assert len(drawn) <= 1
        assert within == list(range(1, len(drawn) + 1)), "the screen is drawn with its frame"
        view = view._replace(strip=view.strip._replace(faults=1, unseen=True))
        made.app.draw_frame()
        assert drawn[-1].strip.faults == 1
        assert view.strip.drive is not None
        drive = view.strip.drive._replace(words="FAULT", kind="fault")
        view = view._replace(strip=view.strip._replace(drive=drive))
        made.app.draw_frame()
        assert drawn[-1].strip.drive is not None
        assert drawn[-1].strip.drive.kind == "fault"
