"""Subject of the Faults screen: a fault, else an alarm, with its causes and values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from tui.drive.causes import KnownValues, is_measured, values_at_trip, values_now
from tui.drive.fault_reset import reset_follows
from tui.drive.hints import FaultAdvice, advice, reset_ready
from tui.drive.profile.profile import Profile, is_verified
from tui.drive.profile.schema import AlarmHelp, FaultCode, FaultHelp, Hint, Quantity
from tui.drive.sentences import capitalized
from tui.session.monitor.alarms import PresentFault
from tui.session.monitor.fault_record import FaultRecord
from tui.session.monitor.watched import Watched
from tui.session.shown import Quality, Shown
from tui.widgets.curve import BRAILLE, CurveSigns

FAULT_QUANTITIES: Sequence[Quantity] = (
    "output_frequency",
    "motor_current",
    "torque",
    "mains_voltage",
    "dc_bus",
    "drive_thermal",
    "motor_thermal",
    "drive_load",
    "motor_load",
)
"""Values to compare with those at the trip, besides the parameters that the help names."""
NAMED_FIRST = 3
"""Parameters that the help names before the first quantities."""


@dataclass(frozen=True, slots=True)
class ValueRow:
    """A parameter whose values at the trip and now are shown."""

    code: str
    """Parameter that Enter opens."""
    live: str
    """The same parameter, or the one that it was stored from at the trip."""
    why: str


@dataclass(frozen=True, slots=True)
class DoctorView:
    """Contents of the Faults screen at one moment."""

    profile: Profile
    fault: FaultCode | None
    present: bool
    """True if the drive is in this fault now."""
    record: FaultRecord | None
    """Record of the trip into this fault; None if the panel did not observe it."""
    readings: Mapping[str, Shown]
    now: float
    """Monotonic time of the moment."""
    since: PresentFault | None = None
    """Entry of the line's alarms, with the time of the trip or of the first read."""
    cursor: int | None = None
    """Row of the cursor: first the values, then the history; None until a person has moved it."""
    unread: bool = False
    """True until the history has been read."""
    raws: Mapping[str, int] = field(default_factory=dict)
    """Last known raw values of the drive, by code."""
    alarms: Sequence[tuple[str, int, str]] = ()
    """Active alarms as word, bit and name; shown if there is no fault."""
    monitored: Mapping[str, Shown] = field(default_factory=dict)
    """Values of the last cycle, by code."""
    place: int | None = None
    """Place in the history of a fault that was selected there."""
    changed: frozenset[str] = frozenset()
    """Settings that Drive Panel wrote after the trip."""
    wall: float = 0.0
    """The moment in seconds since 1970."""
    armed: bool = False
    barred: str = ""
    """Why the drive cannot be armed; empty if it can."""
    watched: Watched | None = None
    """Monitoring of the drive so far, for one without a fault."""
    signs: CurveSigns = BRAILLE
    """Characters for curves that the terminal can show."""

    @property
    def help(self) -> FaultHelp | None:
        """Help on the fault, or on any fault of a family whose faults have no numbers."""
        if self.fault is None and not self.present:
            return None
        return self.profile.guide.fault(self.fault.raw if self.fault else None)

    @property
    def alarm(self) -> tuple[str, int, str] | None:
        """Alarm to show, the first with help if any has help; None if there is a fault."""
        if self.fault is not None or self.present or not self.alarms:
            return None
        known = [pair for pair in self.alarms if self.profile.guide.alarm(pair[0], pair[1])]
        return (known or list(self.alarms))[0]

    @property
    def is_quiet(self) -> bool:
        """True if there is neither a fault nor an alarm to show."""
        return self.fault is None and not self.present and self.alarm is None

    @property
    def hint(self) -> Hint | None:
        """Help on the shown alarm, else on the fault."""
        alarm = self.alarm
        return self.profile.guide.alarm(alarm[0], alarm[1]) if alarm else self.help

    @property
    def advice(self) -> FaultAdvice | None:
        """Causes and checks, weighed by the values; None without help."""
        return advice(self.profile, self.hint, self.known) if self.hint is not None else None

    @property
    def known(self) -> KnownValues:
        """Values that may decide: current ones, and those of the trip."""
        good = {**good_raws(self.monitored), **good_raws(self.readings)}
        now = values_now(self.profile, good)
        if isinstance(self.hint, AlarmHelp):
            return KnownValues(now, now, changed=self.changed)
        before = self.record.raws if self.record is not None else {}
        stored = values_at_trip(self.profile, good, self.stored_place, present=self.present)
        return KnownValues(now, stored, before, self.changed)

    @property
    def stored_place(self) -> int | None:
        """Place in the history of the fault that is shown; None if it is in no place."""
        if self.place is not None:
            return self.place
        return 0 if self.present or self.record is not None else None

    @property
    def rows(self) -> Sequence[ValueRow]:
        """Parameters that the help names, and the quantities that it does not name."""
        if self.is_quiet:
            return ()
        faults = self.profile.data.faults
        lists = faults.stored[:1]
        live = {
            code: source
            for codes in lists
            for code, source in zip(codes, faults.stored_from, strict=False)
            if source
        }
        looks = self.hint.look_at if self.hint is not None else ()
        rows = [
            ValueRow(look.code, live.get(look.code, look.code), capitalized(look.why))
            for look in looks
        ]
        named = {row.live for row in rows}
        found = (self.profile.quantity(quantity) for quantity in FAULT_QUANTITIES)
        others = [
            ValueRow(p.code, p.code, p.name)
            for p in found
            if p is not None and p.code not in named and is_verified(p)
        ]
        # a small screen shows the first ones
        return [*rows[:NAMED_FIRST], *others[:2], *rows[NAMED_FIRST:], *others[2:]]

    @property
    def at(self) -> int:
        """Row of the cursor; at first that of a value which decided about the likeliest cause."""
        if self.cursor is not None:
            return self.cursor
        left = self.advice
        codes = {e.code for cause in left.causes[:1] for e in cause.evidence} if left else set()
        rows = enumerate(self.rows)
        return next((at for at, row in rows if row.live in codes), 0)

    def value_now(self, row: ValueRow) -> Shown | None:
        """Return the newest reading of a row; None if it is not read or keeps its trip value."""
        if self.present and row.live in self.profile.data.faults.held:
            return None
        found = [r for r in (self.readings.get(row.live), self.monitored.get(row.live)) if r]
        return max(found, key=lambda reading: reading.time, default=None)

    def value_stored(self, row: ValueRow) -> Shown | None:
        """Return the value that the drive itself keeps of the trip; None if it keeps none."""
        faults, place = self.profile.data.faults, self.stored_place
        if self.present and row.live in faults.held:
            return self.readings.get(row.live) or self.monitored.get(row.live)
        if place is None or place >= len(faults.stored):
            return None
        pairs = zip(faults.stored_from, faults.stored[place], strict=False)
        code = next((code for live, code in pairs if live == row.live), None)
        return self.readings.get(code) if code is not None else None

    def value_before(self, row: ValueRow) -> Shown | None:
        """Return the last value before the trip that this program read; None for a setting."""
        if self.record is None or not is_measured(self.profile, self.profile[row.live]):
            return None
        return self.record.before.get(row.live)

    @property
    def ready(self) -> bool | None:
        """True if the drive reports that a reset can work now; None if it does not report this."""
        return reset_ready(self.profile, good_raws(self.readings))

    @property
    def follows(self) -> str:
        """The motor's reaction to a reset now, given its present inputs."""
        good = good_raws(self.readings)
        return reset_follows(self.profile, {**self.raws, **good}, good)

    @property
    def history(self) -> list[str]:
        """Codes of the parameters that hold the drive's history, newest first."""
        return self.profile.data.faults.history


def good_raws(readings: Mapping[str, Shown]) -> dict[str, int]:
    """Return the raw values of good quality, by code."""
    return {
        code: reading.raw
        for code, reading in readings.items()
        if reading.quality is Quality.GOOD and reading.raw is not None
    }
