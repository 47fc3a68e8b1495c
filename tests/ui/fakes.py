"""A drive, a line and a clock that never change, for constant pictures."""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, cast

from textual.events import Mount
from textual.pilot import Pilot

from tui.app import DrivePanelApp
from tui.bus.api import (
    DeviceCounters,
    DeviceState,
    Frame,
    LastMinute,
    LineCounters,
    LineState,
    LineStatus,
    LineWorker,
    ModbusLine,
)
from tui.bus.fake import FakeLine
from tui.bus.link import SerialLink
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.values import decode
from tui.screens.frame import FRAME_LOOK
from tui.session.arming import Arming
from tui.session.clock import Clock
from tui.session.connect.identify import DriveIdentity
from tui.session.connect.open_line import OpenLine
from tui.session.console import DriveConsole
from tui.session.drive import DriveSession
from tui.session.drive_state import DriveState, drive_state
from tui.session.fleet import Fleet, FoundDrive
from tui.session.journal import Journal
from tui.session.monitor.alarms import FaultOnsets
from tui.session.monitor.line_watch import LineWatch
from tui.session.monitor.look import Look
from tui.session.monitor.monitor import Monitor
from tui.session.monitor.snapshot import Snapshot
from tui.session.monitor.trend import Trend, TrendPoint
from tui.session.reading import Reading
from tui.session.shown import Quality
from tui.session.timeout_report import TimeoutWatch
from tui.terminal.abilities import EVERYTHING, Abilities

NOW = 1000.0
CONNECTED = LineState(LineStatus.CONNECTED, "", NOW - 60)
CONNECTING = LineState(LineStatus.CONNECTING, "", NOW - 2)
LOST = LineState(
    LineStatus.LOST, "/dev/ttyUSB0 is gone. Plug the adapter in again.", NOW - 12, NOW + 3
)
RUNNING = {
    "ETA": 0x0637, "ETI": 0x0812, "LRS6": 0, "LFT": 0, "CHCF": 1, "CCC": 8, "CRC": 8,
    "RFR": 500, "FRH": 500, "RFRD": 1480, "LCR": 84, "OTR": 725, "OPR": 68, "UOP": 398,
    "ULN": 3980, "THD": 65, "THR": 50, "APH": 3725, "RTH": 2483, "UNT": 0x0029,
    "TFR": 600, "INV": 120, "UNS": 400, "DP0": 5, "DP1": 0, "DP2": 18, "DP3": 0, "DP4": 0,
    "DP5": 0, "DP6": 0, "DP7": 0, "DP8": 0, "IL1R": 0x0003, "OL1R": 1, "LRS7": 0,
}  # fmt: skip
REVERSE = {**RUNNING, "ETA": 0x8637, "RFR": -350, "FRH": -500, "RFRD": -1030}
READY = {**RUNNING, "ETA": 0x0231, "RFR": 0, "RFRD": 0, "LCR": 0, "OTR": 0, "OPR": 0, "UOP": 0}
FAULT = {**READY, "ETA": 0x0218, "LFT": 18}
ALARM = {**RUNNING, "ETA": 0x06B7, "LRS6": 1 << 11}

CHANNELS = {"CHCF": 1, "FR1": 164, "FR2": 0, "RFC": 96, "CD1": 1, "CD2": 10, "CCS": 98, "FR1B": 0,
            "RCB": 96, "FLO": 0, "FLOC": 1, "AI1C": 3100, "LFR": 500, "CMD": 15}  # fmt: skip
STORED = {
    "RFP0": 488, "LCP0": 84, "ULP0": 3980, "THP0": 50, "RTP0": 2483,
    "EP0": 0x0637, "IP0": 0x0812, "CMP0": 0x000F, "CRP0": 0x0015,
}  # fmt: skip
FOLDER = Path("/var/lib/drivepanel")
MARKS = {21: "start", 90: "write"}
"""Events of the trend, by the number of the point."""


class StillClock(Clock):
    """Always the same moment."""

    def monotonic(self) -> float:
        """The moment of every fake."""
        return NOW

    def wall(self) -> float:
        """The same day, too."""
        return 1_795_259_250.4

    def time_of_day(self) -> str:
        """The same on every machine."""
        return "14:02:11"


def readings_of(profile: Profile, raws: Mapping[str, int], time: float) -> dict[str, Reading]:
    """Readings with these raw values, as the drive's reader makes them."""
    found: dict[str, Reading] = {}
    for code, raw in raws.items():
        parameter = profile[code]
        value = decode(parameter, raw, profile.names(parameter), profile.scale(parameter, raws))
        if value.number is not None and parameter.unit_by:
            value = replace(value, unit=profile.unit(parameter, raws))
        found[code] = Reading(parameter, raw, value, Quality.GOOD, time)
    return found


def snapshot_of(
    profile: Profile,
    raws: Mapping[str, int],
    line: LineState = CONNECTED,
    *,
    age: float = 0.1,
    error: str = "",
    rate: float = 2.0,
    block: str = "",
) -> Snapshot:
    """A snapshot whose values have this age in seconds."""
    readings = readings_of(profile, raws, NOW - age)
    return Snapshot(
        cycle=120,
        time=NOW - age,
        wall=0.0,
        readings=readings,
        state=drive_state(profile, readings),
        rate=0.0 if error else rate,
        error=error,
        line=line,
        block=block,
    )


class StillMonitor(Monitor):
    """A monitor with one snapshot or none, and no later one."""

    def __init__(
        self, session: DriveSession, latest: Snapshot | None, trend: Iterable[TrendPoint] = ()
    ) -> None:
        super().__init__(session)
        self._latest = latest
        self._trend = Trend(session.profile, trend)

    def start(
        self,
        codes: Sequence[str] | None = None,
        period: float = 0.5,
        *,
        extra: Sequence[str] = (),
    ) -> None:
        """Nothing to start."""


class StillArming(Arming):
    """A drive that is armed for these seconds, or not at all."""

    def __init__(self, line: ModbusLine, seconds: float | None) -> None:
        super().__init__(line)
        self._seconds = seconds

    @property
    def armed_for(self) -> float | None:
        """The countdown of a picture is stopped."""
        return self._seconds


COUNTED = LineCounters(
    requests=1204, replies=1203, timeouts=1, bytes_out=9632, bytes_in=30120, busy_seconds=31.0,
    minute=LastMinute(good=419, lost=1),
    devices={2: DeviceCounters(minute=LastMinute(good=119, lost=1))},
)  # fmt: skip
FRAMES = (
    Frame(NOW - 0.6, "out", bytes.fromhex("02030c1e0004276c")),
    Frame(NOW - 0.59, "in", bytes.fromhex("02030800280258 01f4000052b0".replace(" ", ""))),
    Frame(NOW - 0.1, "out", bytes.fromhex("0c0320d000030eef")),
    Frame(NOW - 0.09, "in", bytes.fromhex("0c83025132"), "exception 2"),
)


class StillLine(FakeLine):
    """A line in a given state without traffic; every device has just answered."""

    def __init__(self, state: LineState = CONNECTED, *, heard: float = NOW - 0.2) -> None:
        super().__init__(link=SerialLink("/dev/ttyUSB0"))
        self.state = state
        self.counters = COUNTED
        self.trace = FRAMES
        self._heard = heard

    def spawn(self, work: Callable[[], Coroutine[Any, Any, object]], name: str) -> LineWorker:
        """No worker starts or ends."""
        return StillWorker()

    def device_state(self, device: int) -> DeviceState:
        """Each device answers, last at the time of the picture."""
        return DeviceState(True, 0, None, None, 0.005, 0.005, self._heard)


class StillWorker:
    """A worker that is always at work."""

    def cancel(self) -> None:
        """It does not end."""

    def done(self) -> bool:
        """It has not ended."""
        return False


@dataclass
class FakeLineWatch:
    """A line watch with the states of the test only."""

    given: TimeoutWatch | None = None
    alone: dict[int, TimeoutWatch] = field(default_factory=dict)
    commanded: list[DriveSession] = field(default_factory=list)
    looks: dict[int, Look] = field(default_factory=dict)
    seen: dict[int, DriveState] = field(default_factory=dict)
    glance_period: float = 3.0
    tripped_at: float = 1_795_259_250.4

    @property
    def onsets(self) -> FaultOnsets:
        """Each fault began a long time ago."""
        found = FaultOnsets()
        for device, state in self.states.items():
            found.note(device, replace(state, kind="ready"), self.tripped_at)
            found.note(device, state, self.tripped_at)
        return found

    @property
    def states(self) -> dict[int, DriveState]:
        """The states of the status reads, and of other drives."""
        looks = {device: look.state for device, look in self.looks.items() if look.state}
        return {**looks, **self.seen}

    def watch(self, _device: int) -> TimeoutWatch | None:
        """The watch that the test gives."""
        return self.given

    def warnings(self) -> list[Any]:
        """No drive is about to trip."""
        return []

    def under_command(self) -> list[DriveSession]:
        """The motors that run by a command of this panel."""
        return self.commanded

    def unread(self) -> list[DriveSession]:
        """Every timeout is known."""
        return []

    def pending_timeouts(self) -> dict[int, TimeoutWatch]:
        """The drives that trip."""
        return self.alone

    def stop(self) -> None:
        """Nothing to stop."""


ATV71 = DriveIdentity(2, "Telemecanique", "ATV71HU15M3", "0201", "MACHINE 4", "atv71", ("atv71",))


def opened(state: LineState = CONNECTED) -> OpenLine:
    """An open line without a port."""
    return OpenLine("serial:/dev/ttyUSB0,19200,8E1", StillLine(state))


def console_of(
    snapshot: Snapshot | None,
    line: LineState = CONNECTED,
    *,
    device: int = 2,
    family: str = "atv71",
    armed: float | None = None,
    clock: Clock | None = None,
) -> DriveConsole:
    """A drive whose monitor has this snapshot, with a trend of a start and a run."""
    identity = ATV71 if family == "atv71" else None
    session = DriveSession(
        StillLine(line), device, library.load(family), identity, clock=clock or StillClock()
    )
    session.arming = session.work.arming = StillArming(session.line, armed)
    way = -1.0 if snapshot and snapshot.state.direction == "reverse" else 1.0
    raw = session.profile.quantity("output_frequency") is None
    trend = tuple(
        TrendPoint(
            NOW - 60 + i / 2,
            (
                way * min(50.0, max(0.0, i - 20) * 0.8) * (90 if raw else 1),
                (2.0 + (i % 30) * 0.1) * (24 if raw else 1),
                None if raw else way * (50.0 if i > 18 else 0.0),
            ),
            MARKS.get(i, ""),
        )
        for i in range(120)
    )
    console = DriveConsole(session, Journal())
    console.monitor = StillMonitor(session, snapshot, trend if snapshot else ())
    for code, reading in snapshot.readings.items() if snapshot else ():
        if reading.raw is not None:
            session.image.confirm(code, reading.raw, reading.time)
    return console


def look_of(raws: Mapping[str, int], *, age: float = 0.0) -> Look:
    """A status read of an Altivar 71 with these values, from some seconds ago."""
    profile = library.load("atv71")
    readings = readings_of(profile, raws, NOW - age)
    reported = {code: readings[code] for code in ("RFR", "FRH", "LCR")}
    return Look(drive_state(profile, readings), "", NOW - age, None, reported)


class StillFleet(Fleet):
    """Found drives with a line watch that has the states of the test."""

    def __init__(
        self,
        *drives: FoundDrive,
        line_watch: FakeLineWatch | None = None,
        line: LineState = CONNECTED,
    ) -> None:
        super().__init__(StillLine(line), Journal())
        self.line_watch = cast("LineWatch", line_watch or FakeLineWatch())
        for drive in drives:
            self.hold(drive)

    def hold(self, drive: FoundDrive) -> None:
        """One more drive, or a replacement."""
        self._put(drive)


def choose(app: DrivePanelApp, console: DriveConsole) -> None:
    """Open this drive, as after Enter on it; it is the only one of a new fleet."""
    app.fleet = app.fleet or StillFleet(FoundDrive(ATV71, console))
    app.chosen = console


async def press(pilot: Pilot[None], *keys: str) -> None:
    """Press keys; `(name)` is an action without a key, run as the list of actions does."""
    for key in keys:
        if len(key) > 2 and key.startswith("("):
            await pilot.app.run_action(key[1:-1], pilot.app.screen)
            await pilot.pause()
        else:
            await pilot.press(key)


class Easel(DrivePanelApp):
    """The panel for one picture, without Line below it, which would be drawn and hidden."""

    def on_mount(self, event: Mount) -> None:  # type: ignore[override]
        """Search for lines as usual, and skip the rest of the panel's start."""
        event.prevent_default()
        self.set_interval(FRAME_LOOK, self.look_around)


def app_of(
    open_line: Callable[..., OpenLine] | None = None,
    abilities: Abilities = EVERYTHING,
    kind: type[DrivePanelApp] = DrivePanelApp,
) -> DrivePanelApp:
    """The panel with a stopped clock."""

    def closed(*_: Any, **__: Any) -> OpenLine:
        raise AssertionError("no line is opened in this picture")

    return kind(open_line=open_line or closed, clock=StillClock(), abilities=abilities)
