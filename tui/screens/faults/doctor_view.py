"""Subject of the Faults screen: a fault, else an alarm, and its causes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from tui.drive.fault_reset import reset_follows
from tui.drive.hints import FaultAdvice, advice_now, reset_ready
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import FaultCode, FaultHelp, Hint, LookAt
from tui.session.monitor.alarms import PresentFault
from tui.session.monitor.fault_record import FaultRecord
from tui.session.shown import Shown


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
    at: int = 0
    """Row of the cursor: first the parameters to check, then the history."""
    unread: bool = False
    """True until the history has been read."""
    raws: Mapping[str, int] = field(default_factory=dict)
    """Last known raw values of the drive, by code."""
    alarms: Sequence[tuple[str, int, str]] = ()
    """Active alarms as word, bit and name; shown if there is no fault."""

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
    def hint(self) -> Hint | None:
        """Help on the shown alarm, else on the fault."""
        alarm = self.alarm
        return self.profile.guide.alarm(alarm[0], alarm[1]) if alarm else self.help

    @property
    def advice(self) -> FaultAdvice | None:
        """Causes and checks that the present values do not rule out; None without help."""
        if self.hint is None:
            return None
        latest = self.present or self.record is not None
        return advice_now(
            self.profile, self.hint, self._good(), present=self.present, latest=latest
        )

    @property
    def look_at(self) -> Sequence[LookAt]:
        """Parameters to check, with reasons; empty without help."""
        return self.hint.look_at if self.hint else ()

    @property
    def ready(self) -> bool | None:
        """True if the drive reports that a reset can work now; None if it does not report this."""
        return reset_ready(self.profile, self._good())

    @property
    def follows(self) -> str:
        """The motor's reaction to a reset now, given its present inputs."""
        good = self._good()
        return reset_follows(self.profile, {**self.raws, **good}, good)

    @property
    def history(self) -> list[str]:
        """Codes of the parameters that hold the drive's history, newest first."""
        return self.profile.data.faults.history

    def _good(self) -> dict[str, int]:
        """Return the raw values of good quality, by code."""
        readings = self.readings.items()
        return {c: r.raw for c, r in readings if r.quality == "good" and r.raw is not None}
