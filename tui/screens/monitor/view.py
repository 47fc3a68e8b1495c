"""Contents of the Monitor screen at one moment."""

from __future__ import annotations

from dataclasses import dataclass

from tui.bus.api import LineCounters, LineState, LineStatus
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import MonitoringValue, Parameter
from tui.drive.values import Value
from tui.screens.command.control import UNARMED, Control
from tui.session.command.stop_report import StopReport
from tui.session.drive_state import with_direction
from tui.session.monitor.snapshot import Snapshot, stale_after
from tui.session.monitor.trend import TrendPoint
from tui.session.shown import Shown
from tui.session.timeout_report import TimeoutWatch
from tui.widgets.curve import (
    PAGE_STEPS,
    CurveSigns,
    PageStep,
    curve_signs,
    page_start,
)
from tui.widgets.palette import age_text

USUAL_STEP = PAGE_STEPS[2]
"""Initial page of the curve: 60 s."""


@dataclass(frozen=True, slots=True)
class View:
    """Contents of the Monitor screen at one moment; times are monotonic, in seconds."""

    profile: Profile
    snapshot: Snapshot | None
    line: LineState
    device: int
    """Address of the drive."""
    counters: LineCounters
    trend: tuple[TrendPoint, ...]
    period: float
    now: float
    read_only: bool = False
    plain: bool = False
    """True if only ASCII signs are drawn."""
    braille: bool = True
    """True if the terminal can show braille."""
    colored: bool = True
    """True if the terminal has colors; without them, a grid looks like part of a curve."""
    watch: TimeoutWatch | None = None
    """The drive's communication timeout; None if none is known."""
    heard: float | None = None
    """When the drive last answered a request of any program on this line."""
    control: Control = UNARMED
    stop: StopReport | None = None
    """Result of a recent stop."""
    was: str = ""
    """Last known state of the drive."""
    step: PageStep = USUAL_STEP
    """Page of time that the curve shows."""
    apart: float = 0.0
    """Seconds since 1970 minus monotonic seconds, for the clock times of the axis."""
    page: float | None = None
    """Start of the page while the cursor holds it; None for the current page."""
    cursor: float | None = None
    """Moment that the cursor reads; None if there is no cursor."""
    stands_by: bool = False
    """True if the motor is at standstill and the next command of this panel runs it."""
    fault_at: str = ""
    """Time of the trip, or of the fault's first read, as text; empty if unknown."""
    word: int | None = None
    """Index of the table shown instead of the curve; None for the curve."""
    lean: bool = False
    """True on a low-bandwidth link: few parts change with each refresh."""
    me: str = ""
    """Name of this program among those on the line."""
    replayed: bool = False
    """True in a replay: its bar shows why nothing can be commanded."""

    def reading(self, code: str) -> Shown | None:
        """Return a reading with its quality at this moment; None if there is none."""
        if self.snapshot is None or (reading := self.snapshot.readings.get(code)) is None:
            return None
        often = self.lost or not (self.slow(code) or self.rare(code))
        return reading.aged(self.now, stale_after(self.cycle, often=often))

    @property
    def cycle(self) -> float:
        """Seconds from one cycle to the next: the poll period, or more if the line is slower."""
        rate = self.snapshot.rate if self.snapshot is not None else 0.0
        return max(self.period, 1 / rate if rate else self.period)

    @property
    def signs(self) -> CurveSigns:
        """Characters for curves that the terminal can show; no grid on a low-bandwidth link."""
        grid = self.colored and not self.lean
        return curve_signs(plain=self.plain, braille=self.braille, grid=grid)

    @property
    def page_start(self) -> float:
        """Monotonic time at which the page of the curve starts."""
        if self.page is not None:
            return self.page
        return page_start(self.now + self.apart, self.step) - self.apart

    def slow(self, code: str) -> bool:
        """Return True if the monitoring set does not read the value in every cycle."""
        return any(v.parameter == code and v.rate != "fast" for v in self.values)

    def rare(self, code: str) -> bool:
        """Return True if the value is not in the monitoring set, and so is read rarely."""
        return code not in {value.parameter for value in self.values}

    @property
    def time_left(self) -> float | None:
        """Seconds until the drive's timeout if polling stops; None without an active timeout."""
        if self.watch is None or not self.watch.active or self.heard is None:
            return None
        return self.watch.timeout - (self.now - self.heard)

    @property
    def values(self) -> list[MonitoringValue]:
        """Values of the profile's monitoring set."""
        return self.profile.data.monitoring.values

    @property
    def lost(self) -> bool:
        """True if nothing on the screen is known to be current."""
        if self.line.status is not LineStatus.CONNECTED:
            return True
        return self.snapshot is not None and bool(self.trouble)

    @property
    def age(self) -> float | None:
        """Seconds since the newest value was read; None while values are current or missing."""
        if self.snapshot is None or not self.lost:
            return None
        return max(0.0, self.now - self.snapshot.read_at)

    @property
    def trouble(self) -> str:
        """Reason why the values are not current; empty while they are."""
        if self.snapshot is None or self.snapshot.error:
            return self.snapshot.error if self.snapshot is not None else ""
        if self.snapshot.is_stale(self.now):
            return f"No values read for {age_text(self.now - self.snapshot.time)}."
        return ""


def directed(view: View, parameter: Parameter | None, number: float | None) -> float | None:
    """Return a value with the sign of its direction, which the drive may report separately."""
    if number is None or parameter is None or view.snapshot is None:
        return None
    return with_direction(parameter, number, view.snapshot.state)


def end_of(view: View, end: str) -> float | None:
    """Return the end of a bar, a number or the value of a parameter; None if unknown."""
    if not end:
        return None
    try:
        return float(end)
    except ValueError:
        reading = view.snapshot.readings.get(end) if view.snapshot else None
        if reading is None:
            return None
        return reading.drawn(
            view.now, current=bar_number, old=lambda value, age: bar_number(value), missing=None
        )


def bar_number(value: Value) -> float | None:
    """Return the engineering value for a bar; None for names and words."""
    return None if value.number is None else float(value.number)
