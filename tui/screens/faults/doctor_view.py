"""Subject of the Faults screen: a fault, else an alarm, and its causes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from tui.drive.fault_reset import reset_follows
from tui.drive.hints import FaultAdvice, advice, reset_ready
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
    """The trip as the panel saw it, where it did and this is the fault."""
    readings: Mapping[str, Shown]
    now: float
    """Monotonic time of the moment."""
    since: PresentFault | None = None
    """The one record of when it tripped, or was first seen; that of the line."""
    at: int = 0
    """The row of the cursor: parameters to look at first, then the history."""
    unread: bool = False
    """True if the history is being read yet."""
    raws: Mapping[str, int] = field(default_factory=dict)
    """All raw values that the drive was last seen to hold."""
    alarms: Sequence[tuple[str, int, str]] = ()
    """Alarms that are on: word, bit and name; shown if there is no fault."""

    @property
    def help(self) -> FaultHelp | None:
        """Help on the fault; on any fault of a family whose trips have no numbers."""
        if self.fault is None and not self.present:
            return None
        return self.profile.guide.fault(self.fault.raw if self.fault else None)

    @property
    def alarm(self) -> tuple[str, int, str] | None:
        """The alarm that is shown: the first that anything is known of."""
        if self.fault is not None or self.present or not self.alarms:
            return None
        known = [pair for pair in self.alarms if self.profile.guide.alarm(pair[0], pair[1])]
        return (known or list(self.alarms))[0]

    @property
    def hint(self) -> Hint | None:
        """Help on the fault or the alarm."""
        alarm = self.alarm
        return self.profile.guide.alarm(alarm[0], alarm[1]) if alarm else self.help

    @property
    def advice(self) -> FaultAdvice | None:
        """The causes and checks that the present values leave."""
        if self.hint is None:
            return None
        latest = self.present or self.record is not None
        return advice(self.profile, self.hint, self._good(), latest=latest)

    @property
    def look_at(self) -> Sequence[LookAt]:
        """The parameters to look at."""
        return self.hint.look_at if self.hint else ()

    @property
    def ready(self) -> bool | None:
        """True if the drive says that a reset can work now; None if it does not report it."""
        return reset_ready(self.profile, self._good())

    @property
    def follows(self) -> str:
        """The motor's reaction to a reset now, with the inputs that are closed."""
        good = self._good()
        return reset_follows(self.profile, {**self.raws, **good}, good)

    @property
    def history(self) -> list[str]:
        """The codes of the drive's history, the newest first."""
        return self.profile.data.faults.history

    def _good(self) -> dict[str, int]:
        """Present raw values."""
        readings = self.readings.items()
        return {c: r.raw for c, r in readings if r.quality == "good" and r.raw is not None}
