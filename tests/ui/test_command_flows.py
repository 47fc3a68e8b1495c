"""Commanding by keys: simulated drives of every family over a real line, the whole panel above."""

from __future__ import annotations

import ast
import re
import time
from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import pytest
from textual import _wait
from textual.events import Key
from textual.pilot import Pilot
from textual.widgets import Input, OptionList, Static

from tests.programs import rtu_tcp
from tests.sources import calls_of
from tests.sweeps import kept
from tui.app import DrivePanelApp
from tui.bus.program import Program
from tui.screens.command.command_keys import OptionsScreen
from tui.screens.connection.screen import ConnectionScreen
from tui.screens.control.screen import ControlSourceScreen
from tui.screens.dialogs.ask import Ask
from tui.screens.dialogs.confirm import Confirm
from tui.screens.dialogs.leave import Leave
from tui.screens.dialogs.question import Question
from tui.screens.faults.screen import FaultsScreen
from tui.screens.frames.screen import FramesScreen
from tui.screens.keys.help import HelpScreen
from tui.screens.messages.screen import MessagesScreen
from tui.screens.monitor.screen import MonitorScreen
from tui.screens.parameters.edit_value import PickValue
from tui.screens.startup.screen import StartUpScreen
from tui.screens.wiring.screen import WiringScreen
from tui.session.command.stop_report import Phase, StopReport
from tui.session.connect.open_line import OpenLine, open_line
from tui.simulator import DriveSpec, Simulation
from tui.simulator.drive import SimulatedDrive
from tui.widgets.fields import NumberInput

from .test_flows import picture, shown, until

SOURCES = Path(__file__).parents[2] / "tui" / "screens"
FAMILIES = ["atv21", "atv31", "atv312", "atv71", "powerdrive", "proxidrive", "varmeca"]


class Bench(NamedTuple):
    """The panel on one or more drives, the first of them on Monitor."""

    app: DrivePanelApp
    pilot: Pilot[None]
    simulation: Simulation

    def drive(self, device: int = 1) -> SimulatedDrive:
        return self.simulation.drive(device)

    def speed(self, device: int = 1) -> float:
        return self.drive(device).motor.frequency

    async def message(self, *parts: str) -> None:
        """Wait until Monitor says all of this: its lowest lines and the newest message."""
        await until(self.pilot, lambda: all(p in output(self.app) for p in parts))

    async def armed(self) -> None:
        await self.pilot.press("a")
        await until(self.pilot, lambda: " ARMED" in shown(self.app, "strip"))

    async def refer(self, text: str) -> None:
        await self.pilot.press("f")
        await self.message("REFERENCE", "Enter set")
        await self.pilot.press(*text, "enter")
        await until(self.pilot, lambda: "REFERENCE" not in shown(self.app, "message"))
        await self.message("Reference")

    async def run(self, key: str) -> None:
        """Open the run line by `r` or `v`: until Enter the motor state is unchanged."""
        before, speed = time.monotonic(), self.speed()
        await self.pilot.press(key)
        await self.message("RUN FORWARD" if key == "r" else "RUN REVERSE", "Enter run")
        await self.pilot.pause(0.3)
        assert writes(self.app, before) == []
        assert (self.speed() > 0) is (speed > 0)
        await self.pilot.press("enter")

    async def running(self) -> None:
        """Armed, with a reference, running forward."""
        await self.armed()
        if self.drive().profile.id.startswith("atv"):
            await self.refer("30")
        await self.run("r")
        await until(self.pilot, lambda: self.speed() > 2)

    async def answer(self, key: str, answer: str, kind: type[Question[Any]] = Confirm) -> None:
        """Press a key that asks, and answer the question."""
        await self.pilot.press(key)
        await until(self.pilot, lambda: isinstance(self.app.screen, kind))
        await self.pilot.press(answer)
        await until(self.pilot, lambda: not isinstance(self.app.screen, kind))

    async def commanded(self) -> None:
        """Wait until it is known that the motor runs by an order from here."""
        app = self.app
        await until(self.pilot, lambda: bool(app.fleet and app.fleet.line_watch.under_command()))

    def is_armed(self) -> bool:
        """True if the status bar says that the drive is armed."""
        return " ARMED" in shown(self.app, "strip")

    def last_stop(self, device: int = 1) -> StopReport | None:
        """Last message about a stop of this drive."""
        return self.app.fleet.stopper.reports.get(device) if self.app.fleet else None

    async def stopped(self, device: int = 1, *, behind: StopReport | None = None) -> None:
        """Wait for the end of a later stop; a second stop needs it."""

        def ended() -> bool:
            last = self.last_stop(device)
            return last is not None and last is not behind and last.phase is Phase.STOPPED

        await until(self.pilot, ended)
        await until(self.pilot, lambda: self.speed(device) == 0)


def output(app: DrivePanelApp) -> str:
    """Text of Monitor below its values, and the newest message, on one line."""
    return " ".join(f"{shown(app, 'message')} {shown(app, 'said')}".split())


def runs(app: DrivePanelApp) -> bool:
    """True if the status bar says that the motor runs."""
    return any(word in shown(app, "strip") for word in ("FORWARD", "REVERSE", "RUNNING"))


async def disarmed(made: Bench) -> None:
    """Wait until the strip says no longer that the drive is armed."""
    await until(made.pilot, lambda: "ARMED" not in shown(made.app, "strip"))


def writes(app: DrivePanelApp, since: float = 0.0) -> list[bytes]:
    """The requests that wrote anything, among the last frames of the line; `since` a time in s."""
    assert app.opened is not None
    frames = [frame for frame in app.opened.line.trace if frame.direction == "out"]
    write = (5, 6, 15, 16, 22, 23)
    return [item.data for item in frames if item.data[1] in write and item.time >= since]


def knows_the_state(app: DrivePanelApp) -> bool:
    """True if Monitor shows a state that was read: before, nothing can be armed."""
    screen = app.screen
    latest = screen.console.latest if isinstance(screen, MonitorScreen) else None
    known = latest is not None and not latest.error and latest.state.kind != "unknown"
    return known and bool(shown(app, "state"))


@asynccontextmanager
async def bench(
    *families: str, read_only: bool = False, sets: Mapping[str, int] = MappingProxyType({})
) -> AsyncIterator[Bench]:
    """The panel on simulated drives of these families, at the addresses 1, 2, ...

    Of several all are found first, then the first one is watched. `sets` are raw values by code,
    the same for each drive.
    """
    specs = [
        DriveSpec(
            family, device, sets={**({} if family.startswith("atv") else {"6.43": 1}), **sets}
        )
        for device, family in enumerate(families, start=1)
    ]
    simulation = Simulation(specs)
    simulation.start()
    text = rtu_tcp(simulation)

    def opener(_: str, **how: object) -> OpenLine:
        opened = open_line(text, **how)  # type: ignore[arg-type]
        opened.profiles = dict(enumerate(families, start=1))
        opened.devices = tuple(opened.profiles)
        return opened

    app = DrivePanelApp(open_line=opener, start=text, read_only=read_only)
    really_idle = _wait.SLEEP_IDLE
    # a panel that watches a line is idle, too: the pilot waited up to 1 s behind each key
    _wait.SLEEP_IDLE = _wait.SLEEP_GRANULARITY / 4
    try:
        async with app.run_test(size=(80, 24)) as pilot:
            # a drive is listed once it has its profile; Enter before that opens no drive
            await until(pilot, lambda: app.connection.drives.option_count == len(families))
            drives = app.connection.query_one("#drives", OptionList)
            drives.focus()
            drives.highlighted = 0
            await pilot.press("enter")
            await until(pilot, lambda: isinstance(app.screen, MonitorScreen))
            await until(pilot, lambda: knows_the_state(app))
            yield Bench(app, pilot, simulation)
            if isinstance(app.screen, Leave):
                await pilot.press("escape")
    finally:
        _wait.SLEEP_IDLE = really_idle
        simulation.stop()


async def test_armed_drive_is_never_reported_as_disarmed() -> None:
    async with bench("atv71") as made:
        await made.pilot.press("r")
        await made.message("Not armed. Press a to arm this drive.")
        await made.armed()
        await made.message("Armed for 60 s")
        assert "Not armed" not in shown(made.app, "said")


async def test_motor_at_standstill_after_a_quick_stop_is_not_stopping() -> None:
    """An Altivar 71 keeps the state of its quick stop at rest."""
    async with bench("atv71") as made:
        await made.running()
        await until(made.pilot, lambda: made.speed() > 2)
        await made.pilot.press("k")
        await made.message("Stopped")
        assert "Stopped: stopped" not in shown(made.app, "said")
        await until(made.pilot, lambda: "□ STOPPED" in shown(made.app, "strip"))
        await made.pilot.press("1")
        await until(made.pilot, lambda: "□ STOPPED" in picture(made.app))


@pytest.mark.parametrize("family", kept(FAMILIES, "atv71"))
async def test_drive_is_armed_run_reversed_stopped_tripped_and_reset(family: str) -> None:
    async with bench(family) as made:
        await made.running()
        await until(made.pilot, lambda: runs(made.app))
        await made.run("v")
        await until(made.pilot, lambda: made.speed() < -2)
        await made.pilot.press("space")
        await made.stopped()
        await made.message("Stopped")
        await disarmed(made)
        code = (
            next(f.raw for f in made.drive().profile.data.faults.codes if f.raw)
            if (made.drive().profile.data.faults.codes)
            else 1
        )
        made.drive().provoke(code)
        await until(made.pilot, lambda: "FAULT" in shown(made.app, "state"))
        await made.armed()
        await made.answer("x", "n")
        assert made.drive().fault is not None
        await made.answer("x", "y")
        await until(made.pilot, lambda: made.drive().fault is None)
        await until(made.pilot, lambda: "FAULT" not in shown(made.app, "state"))
        assert made.speed() == 0


async def test_nothing_is_commanded_before_arming() -> None:
    async with bench("atv71") as made:
        for key in ("r", "v", "f", "up", "pagedown", "o", "t", "g"):
            made.app.events.add("told", f"{key} is next")
            await until(made.pilot, lambda: "is next" in output(made.app))
            await made.pilot.press(key)
            await made.message("Press a to arm this drive")
        assert made.drive().raw("CMD") == 0
        assert made.drive().raw("LFR") == 0
        assert writes(made.app) == []


async def test_trip_has_one_time_on_every_screen() -> None:
    async with bench("atv71") as made:
        made.drive().provoke("ObF")
        await until(made.pilot, lambda: "FAULT" in shown(made.app, "state"))
        await until(made.pilot, lambda: "tripped " in shown(made.app, "state"))
        fleet = made.app.fleet
        assert fleet is not None
        (fault,) = fleet.alarms.active
        record = fleet.consoles[0].recorder.latest
        assert record is not None
        assert fault.wall == record.wall
        (event,) = [item for item in made.app.events.events if item.text.startswith("Tripped on")]
        assert event.wall == fault.wall
        await made.pilot.press("5")
        await until(made.pilot, lambda: f"{fault.when}, just now" in shown(made.app, "doctor"))


async def test_reset_without_a_fault_says_so() -> None:
    async with bench("atv71") as made:
        await made.pilot.press("x")
        await made.message("No fault to reset: the drive is in the state ")
        await made.armed()
        await made.pilot.press("x")
        await made.message("No fault to reset: the drive is in the state ")
        assert writes(made.app) == []


@pytest.mark.parametrize(
    ("family", "sets"),
    [
        ("atv31", {"CHCF": 2, "Cd1": 1}),
        pytest.param("powerdrive", {"6.43": 0}, marks=pytest.mark.sweep),
        pytest.param("atv71", {}, marks=pytest.mark.sweep),
    ],
)
async def test_failed_reset_text_is_not_cut_at_80x24(family: str, sets: dict[str, int]) -> None:
    async with bench(family, sets=sets) as made:
        faults = made.drive().profile.data.faults.codes
        made.drive().provoke(next((f.raw for f in faults if f.raw), 1), persists=True)
        await until(made.pilot, lambda: "FAULT" in shown(made.app, "state"))
        await made.armed()
        await made.pilot.press("5")
        await until(made.pilot, lambda: isinstance(made.app.screen, FaultsScreen))
        await made.answer("x", "y")
        await until(made.pilot, lambda: bool(failed_reset(made.app)))
        text = failed_reset(made.app)
        await until(made.pilot, lambda: text in " ".join(shown(made.app, "said").split()))
        await made.pilot.press("m")
        await until(made.pilot, lambda: isinstance(made.app.screen, MessagesScreen))
        await until(made.pilot, lambda: text in " ".join(shown(made.app, "list").split()))


def failed_reset(app: DrivePanelApp) -> str:
    """Messages of a reset after which the drive was still in fault."""
    return next((event.text for event in app.events.events if "still in fault" in event.text), "")


def follows(app: DrivePanelApp) -> str:
    found = app.screen.query("#follows")
    return " ".join(str(found.first().render()).split()) if found else ""


@pytest.mark.parametrize(
    ("family", "closed", "output"),
    [
        ("atv71", "LI3", ("on a new run command", "Closed at the terminals now: LI3.")),
        ("atv21", "F", ("a closed run input", "Closed at the terminals now: F.")),
        ("powerdrive", "RUN", ("6.42 commands this drive", "cannot be read over Modbus")),
    ],
)
async def test_reset_question_names_channel_and_closed_inputs(
    family: str, closed: str, output: tuple[str, str]
) -> None:
    async with bench(family) as made:
        made.drive().terminals.close(closed)
        made.drive().provoke(1)
        await until(made.pilot, lambda: "FAULT" in shown(made.app, "state"))
        await made.armed()
        await made.pilot.press("x")
        await until(made.pilot, lambda: isinstance(made.app.screen, Confirm))
        await until(made.pilot, lambda: all(part in follows(made.app) for part in output))
        assert "Nothing runs" not in follows(made.app)
        await made.pilot.press("escape")


async def test_read_only_line_is_not_armed() -> None:
    async with bench("atv71", read_only=True) as made:
        await made.pilot.press("a")
        await made.message("read-only")


async def test_reference_steps_end_at_the_limit() -> None:
    async with bench("atv71") as made:
        await made.armed()
        await made.refer("20")
        await made.pilot.press("up")
        await until(made.pilot, lambda: made.drive().raw("LFR") == 210)
        await made.pilot.press("pagedown")
        await until(made.pilot, lambda: made.drive().raw("LFR") == 160)
        await made.pilot.press("f", *"80", "enter")
        await made.message("REFERENCE", "80 Hz is above")
        assert made.drive().raw("LFR") == 160


async def test_keys_typed_ahead_edit_the_run_line_but_command_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("tui.screens.monitor.run_line.ENTER_COUNTS_AFTER", 60.0)
    async with bench("atv71") as made:
        for key, character in [("a", "a"), ("f", "f"), ("3", "3"), ("0", "0"), ("enter", "\r")]:
            made.app.post_message(Key(key, character))
        await made.message("REFERENCE at 30 Hz")
        await made.pilot.pause(0.3)
        await made.message("REFERENCE at 30 Hz")
        made.app.post_message(Key("r", "r"))
        await until(made.pilot, lambda: "REFERENCE" not in shown(made.app, "message"))
        assert "RUN FORWARD" not in shown(made.app, "message")
        assert made.drive().raw("LFR") == 0
        assert made.drive().raw("CMD") == 0


SCREENS = {
    "help": ("question_mark", HelpScreen),
    "options": ("o", OptionsScreen),
    "control": ("6", ControlSourceScreen),
    "faults": ("5", FaultsScreen),
    "frames": ("7", FramesScreen),
    "messages": ("m", MessagesScreen),
    "wiring": ("I", WiringScreen),
    "start-up": ("B", StartUpScreen),
    "run line": ("v", MonitorScreen),
    "coast": ("z", Confirm),
    "leave": ("q", Leave),
}


async def test_stop_works_on_every_screen() -> None:
    async with bench("atv71") as made:
        for screen, (key, kind) in SCREENS.items():
            before = made.last_stop()
            await made.running()
            await made.commanded()
            await made.pilot.press(key)
            await until(made.pilot, lambda: isinstance(made.app.screen, kind))  # noqa: B023
            made.app.events.add("told", f"stopped on {screen}")
            await made.pilot.press("f12")
            await made.stopped(behind=before)
            # a stop cancels a question about the drive, and the run line
            assert isinstance(made.app.screen, kind) is not issubclass(kind, Question), screen
            assert "RUN REVERSE" not in shown(made.app, "message"), screen
            if "console" not in vars(made.app.screen):
                # this screen shows nothing of the drive, so the panel does
                await until(made.pilot, lambda: "The motor is stopped" in shown(made.app, "said"))
            while not isinstance(made.app.screen, MonitorScreen):
                await made.pilot.press("escape")


def reported(app: DrivePanelApp) -> str:
    """All messages, the notices for a motor that does not stop included."""
    output = [event.text for event in app.events.events]
    return " ".join([*output, *(notification.message for notification in app._notifications)])


async def test_space_stops_outside_texts_only() -> None:
    async with bench("atv71") as made:
        await made.running()
        made.app.push_screen(Ask("Name", str))
        await until(made.pilot, lambda: isinstance(made.app.focused, Input))
        await made.pilot.press(*"a c")
        field = made.app.screen.query_one(Input)
        assert field.value == "a c"
        assert made.speed() > 2
        assert not (made.app.fleet and made.app.fleet.stopper.reports)
        await made.pilot.press("escape", "space")
        await made.stopped()


@pytest.mark.parametrize("typed", kept(["", "4x"], "4x"))
@pytest.mark.parametrize("way", ["3 slash a c c enter", "1 tab tab tab"])
async def test_space_stops_while_a_number_is_typed(way: str, typed: str) -> None:
    """A value, an address: no space is ever typed there. A reference: `test_run_line`."""
    async with bench("atv71") as made:
        await made.running()
        await made.pilot.press(*way.split(), *typed)
        await until(made.pilot, lambda: isinstance(made.app.focused, NumberInput))
        field = made.app.focused
        assert isinstance(field, NumberInput)
        before = field.value
        await made.pilot.press("space")
        await made.stopped()
        assert field.value == before


def test_number_fields_accept_no_space() -> None:
    """Each field says whether a space is a text there; a new one has to be thought of."""
    fields = {
        path.relative_to(SOURCES).as_posix(): {
            name
            for name in ("Field", "WordField", "NumberInput")
            if re.search(rf"\b{name}\(", text)
        }
        for path in SOURCES.rglob("*.py")
        if (text := path.read_text("utf-8"))
    }
    assert {name: kinds for name, kinds in fields.items() if kinds} == {
        "parameters/edit_value.py": {"NumberInput"},
        "connection/line_form.py": {"NumberInput", "WordField"},
        "choosing.py": {"WordField"},
        "dialogs/address.py": {"NumberInput"},
        "parameters/screen.py": {"WordField"},
        "dialogs/pick_parameter.py": {"WordField"},
        "frames/frame_list.py": {"WordField"},
    }
    numbers = {
        ast.unparse(call.args[0])
        for _, call in calls_of("Ask", SOURCES)
        if any(keyword.arg == "number" for keyword in call.keywords)
    }
    assert numbers == {
        "'Rated current in A'",
        "question",  # the inputs of a simulated drive
        'f"What does the drive\'s display show for {code}, {name}?"',
    }


async def test_stop_works_in_the_palette() -> None:
    async with bench("atv71") as made:
        await made.running()
        await made.pilot.press("ctrl+p", *"stop")
        await made.pilot.press("f12")
        await made.stopped()


async def test_single_key_stops_every_drive() -> None:
    async with bench("atv71", "atv21", "atv312") as made:
        for device in (2, 3):
            made.drive(device).run(30.0)
        await made.running()
        await made.pilot.press("f9")
        assert made.app.fleet is not None
        stopper = made.app.fleet.stopper
        await until(made.pilot, lambda: len(stopper.reports) == 3)
        await made.stopped(1)


async def test_arming_ends_when_another_drive_is_shown() -> None:
    async with bench("atv71", "atv21") as made:
        await made.armed()
        await made.pilot.press("right_square_bracket")
        await until(made.pilot, lambda: shown(made.app, "strip").startswith(" 2 "))
        await disarmed(made)
        await made.pilot.press("left_square_bracket")
        await until(made.pilot, lambda: shown(made.app, "strip").startswith(" 1 "))
        await disarmed(made)


@pytest.mark.parametrize(("key", "turns"), [("s", False), ("l", True)])
async def test_leaving_with_a_running_motor_asks_and_stops(key: str, turns: bool) -> None:
    async with bench("atv71") as made:
        await made.running()
        app = made.app
        await made.commanded()
        assert app.fleet is not None
        line = app.fleet.line
        line.facts.set_programs((line.facts.me, Program("watch", "watch", 78)))
        line.pace.others = {1: 0.1}
        await made.pilot.press("q")
        await until(made.pilot, lambda: isinstance(app.screen, Leave))
        assert "As long as watch (pid 78) polls this drive" in str(
            app.screen.query_one("#follows", Static).render()
        )
        line.facts.set_programs((line.facts.me,))
        await made.pilot.press("escape")
        await until(made.pilot, lambda: isinstance(app.screen, MonitorScreen))
        assert made.speed() > 2
        await made.pilot.press("q")
        await until(made.pilot, lambda: isinstance(app.screen, Leave))
        await made.pilot.press(key)
        await until(made.pilot, lambda: app._exit, 60)
        assert (made.speed() != 0) is turns


async def test_return_to_line_asks_nothing_and_keeps_the_drive_alive() -> None:
    async with bench("atv71") as made:
        await made.running()
        await made.pilot.press("escape")
        await until(made.pilot, lambda: isinstance(made.app.screen, ConnectionScreen))
        made.drive().raw("ETA")
        await made.pilot.pause(1.0)
        assert made.speed() > 2
        await made.pilot.press("space")
        await made.stopped()


@pytest.mark.internal_errors
async def test_internal_error_stops_the_motor() -> None:
    ran = []

    async def breaks() -> None:
        async with bench("atv71") as made:
            await made.running()
            await made.commanded()
            ran.append(made.simulation)
            made.app.call_later(broken)
            await until(made.pilot, lambda: made.app._exception is not None)

    with pytest.raises(RuntimeError, match="upside down"):
        await breaks()
    assert ran[0].drive(1).motor.frequency == 0


def broken() -> None:
    """An error that a screen should never raise."""
    raise RuntimeError("the screen is upside down")


async def test_enter_on_a_step_of_control_proposes_its_value_and_writes_nothing() -> None:
    async with bench("atv71", sets={"CHCF": 2, "FR1": 1, "CD1": 1}) as made:
        await made.pilot.press("6")
        await until(made.pilot, lambda: isinstance(made.app.screen, ControlSourceScreen))
        await until(made.pilot, lambda: "Enter opens" in shown(made.app, "detail"))
        control = made.app.screen
        steps = ["Set FR1 to Modbus", "Set CD1 to Modbus", "Set CCS to Command channel 2"]
        rows = [str(option.prompt) for option in control.query_one(OptionList).options]
        assert [row.removeprefix(" → ") for row in rows[: len(steps)]] == steps
        assert "FR1" in shown(made.app, "detail")
        await made.pilot.press("down", "up", "enter")
        await until(made.pilot, lambda: isinstance(made.app.screen, PickValue))
        choices = made.app.screen.query_one(OptionList)
        assert "Modbus" in str(choices.get_option_at_index(choices.highlighted or 0).prompt)
        console = made.app.chosen
        assert console is not None
        assert not len(console.editor.staging.edits)
        await made.pilot.pause(0.4)
        await made.pilot.press("enter")
        await until(made.pilot, lambda: len(console.editor.staging.edits) == 1)
        assert console.editor.staging.edits.items[0].new == 164
        await made.pilot.press("6")
        await until(made.pilot, lambda: isinstance(made.app.screen, ControlSourceScreen))
        listed = made.app.screen.query_one(OptionList)
        await until(
            made.pilot,
            lambda: (
                listed.option_count > 0 and "staged" in str(listed.get_option_at_index(0).prompt)
            ),
        )
        assert writes(made.app) == []


async def test_question_of_a_reset_names_the_likeliest_cause() -> None:
    async with bench("atv71") as made:
        made.drive().provoke("ObF")
        await until(made.pilot, lambda: "FAULT" in shown(made.app, "state"))
        await made.armed()
        await made.pilot.press("x")
        await until(made.pilot, lambda: "Likely cause: " in follows(made.app))
        assert follows(made.app).startswith("ObF Overbraking. Likely cause: ")
        assert "Remove the cause first." in follows(made.app)
