"""A drive, a line and a clock that stand still, for pictures that never change."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar, cast

from tui.app import DrivePanelApp
from tui.bus.line import Counters, DeviceState, Frame, Line, LineState, LineStatus
from tui.bus.link import SerialLink
from tui.drive import library
from tui.drive.profile import Profile
from tui.drive.values import decode
from tui.session.drive_session import DriveSession
from tui.session.drive_state import drive_state
from tui.session.identify import DriveIdentity
from tui.session.keeper import Keeper, Watch
from tui.session.known import Known
from tui.session.lines import OpenLine
from tui.session.monitor import Snapshot, TrendPoint
from tui.session.order_queue import OrderQueue
from tui.session.readings import Quality, Reading
from tui.widgets.clock import Clock

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
READY = {**RUNNING, "ETA": 0x0231, "RFR": 0, "RFRD": 0, "LCR": 0, "OTR": 0, "OPR": 0, "UOP": 0}
FAULT = {**READY, "ETA": 0x0218, "LFT": 18}
ALARM = {**RUNNING, "ETA": 0x06B7, "LRS6": 1 << 11}

CHANNELS = {"CHCF": 1, "FR1": 164, "FR2": 0, "RFC": 0, "CD1": 1, "CD2": 10, "CCS": 98, "FR1B": 0}
STORED = {
    "RFP0": 488, "LCP0": 84, "ULP0": 3980, "THP0": 50, "RTP0": 2483,
    "EP0": 0x0637, "IP0": 0x0812, "CMP0": 0x000F, "CRP0": 0x0015,
}  # fmt: skip
FOLDER = Path("/var/lib/drivepanel")


class StillClock(Clock):
    """Always the same moment."""

    def monotonic(self) -> float:
        """The moment of every fake."""
        return NOW

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
            from dataclasses import replace

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
    """A snapshot whose values are so many seconds old."""
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


@dataclass
class FakeMonitor:
    """A monitor whose latest snapshot is given."""

    latest: Snapshot | None
    trend: tuple[TrendPoint, ...] = ()
    period: float = 0.5
    running: bool = False
    known: Known = field(default_factory=Known)

    def __post_init__(self) -> None:
        if self.latest is not None:
            self.known.note(self.latest.readings)

    def start(self, *_: Any, **__: Any) -> None:
        """Nothing to start."""

    def stop(self) -> None:
        """Nothing to stop."""

    def listen(self, _: Any) -> None:
        """Nothing will come."""


@dataclass
class FakeLine:
    """A line in a given state."""

    state: LineState = CONNECTED
    link: SerialLink = field(default_factory=lambda: SerialLink("/dev/ttyUSB0"))
    counters: Counters = field(
        default_factory=lambda: Counters(
            requests=1204,
            replies=1203,
            timeouts=1,
            bytes_out=9632,
            bytes_in=30120,
            busy_seconds=31.0,
        )
    )
    heard: float = NOW - 0.2
    read_only: bool = False
    trace: tuple[Frame, ...] = (
        Frame(NOW - 0.6, "out", bytes.fromhex("02030c1e0004276c")),
        Frame(NOW - 0.59, "in", bytes.fromhex("02030800280258 01f4000052b0".replace(" ", ""))),
        Frame(NOW - 0.1, "out", bytes.fromhex("0c0320d000030eef")),
        Frame(NOW - 0.09, "in", bytes.fromhex("0c83025132"), "exception 2"),
    )

    def spawn(self, *_: Any, **__: Any) -> Any:
        """No loop, no worker."""
        return type("Worker", (), {"cancel": lambda self: None, "done": lambda self: False})()

    def device_state(self, _device: int) -> DeviceState:
        """Heard a moment ago."""
        return DeviceState(True, 0, None, None, 0.005, 0.005, self.heard)

    def describe(self, *_: Any) -> None:
        """Limits are not looked at."""

    def close(self) -> None:
        """Nothing to close."""


class FakeKeeper:
    """A keeper that has looked at no drive."""

    looks: ClassVar[dict[int, Any]] = {}

    def __init__(self, watch: Watch | None = None) -> None:
        self._watch = watch

    def watch(self, _device: int) -> Watch | None:
        """The watch that the test gives."""
        return self._watch

    def hungry(self) -> list[Any]:
        """No drive is about to trip."""
        return []

    def under_command(self) -> list[Any]:
        """No motor runs by an order from here."""
        return []

    def left_alone(self) -> dict[int, float]:
        """No drive trips."""
        return {}

    def stop(self) -> None:
        """Nothing to stop."""


def keeper_of(timeouts: dict[int, float]) -> Keeper:
    """A keeper of running drives that watch the line."""
    keeper = FakeKeeper()
    keeper.left_alone = lambda: timeouts  # type: ignore[method-assign]
    return cast("Keeper", keeper)


ATV71 = DriveIdentity(2, "Telemecanique", "ATV71HU15M3", "0201", "MACHINE 4", "atv71", ("atv71",))


def opened(state: LineState = CONNECTED) -> OpenLine:
    """An open line without a port."""
    return OpenLine("serial:/dev/ttyUSB0,19200,8E1", cast("Line", FakeLine(state)))


def session_of(snapshot: Snapshot | None, line: LineState = CONNECTED) -> DriveSession:
    """A drive whose monitor has brought this snapshot, with a trend of a start and a run."""
    profile = library.load("atv71")
    session = DriveSession.__new__(DriveSession)
    session.line = cast("Line", FakeLine(line))
    session.device, session.profile, session.identity = 2, profile, ATV71
    session.orders, session.commanded_at = OrderQueue(session.line, 2), None
    trend = tuple(
        TrendPoint(NOW - 60 + i / 2, (min(50.0, max(0.0, i - 20) * 0.8), 2.0 + (i % 30) * 0.1))
        for i in range(120)
    )
    session.monitor = cast("Any", FakeMonitor(snapshot, trend if snapshot else ()))
    return session


def app_of(open_line: Callable[..., OpenLine] | None = None) -> DrivePanelApp:
    """The panel with a clock that stands still."""

    def closed(*_: Any, **__: Any) -> OpenLine:
        raise AssertionError("no line is opened in this picture")

    return DrivePanelApp(open_line=open_line or closed, clock=StillClock())
