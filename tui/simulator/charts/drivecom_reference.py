"""Reference of the Altivar 31, 312 and 71: its source word, its sign and its limits.

Source: ATV71 communication parameters guide (LFR, LFRD, CMI bits 9 and 12); ATV312 communication
variables, high resolution.
"""

from __future__ import annotations

from tui.drive.profile.schema import Parameter

from ..body import Body, Fallback
from .channels import ChannelPlace, ChannelsInForce

CMI_HIGH_RESOLUTION, CMI_REVERSE = 1 << 9, 1 << 12
FULL_COUNT = 32767
UNLIMITED = 1e9


class DrivecomReference:
    """Reads the reference of one drive from its words."""

    def __init__(self, body: Body) -> None:
        self._body = body

    def target(self, wanted: float) -> float:
        """Return the target of the ramp in Hz: the reference within its limits, or a fallback."""
        body = self._body
        if body.fallback is Fallback.SPEED:
            speed = body.registers.named("LFF")
            return self.cut(body.engineering(speed) if speed else 0.0)
        if body.fallback is Fallback.MAINTAIN:
            return body.motor.frequency
        return self.cut(wanted)

    def size(self, channels: ChannelsInForce) -> float:
        """Return the reference in Hz of the channel in force, before its limits.

        From the line it may be negative; it is 0 for a channel that is not simulated.
        """
        if channels.reference is ChannelPlace.LINE:
            hz = self._written()
            return (self._body.earlier_hz or 0.0) if hz is None else hz
        if channels.reference is ChannelPlace.TERMINALS:
            low, high = self.limits()
            return low + self._body.terminals.level(f"AI{channels.input}") * (high - low)
        return 0.0

    def wire(self, channels: ChannelsInForce, hz: float) -> None:
        """Set the analog input of a channel to the value for this reference in Hz."""
        low, high = self.limits()
        part = (hz - low) / (high - low) if high > low else 0.0
        self._body.terminals.apply(f"AI{channels.input}", part)

    @property
    def is_earlier(self) -> bool:
        """True if the line's reference is still that of another master."""
        return self._body.earlier_hz is not None and self._written() is None

    def leave(self, hz: float) -> None:
        """Put a reference in Hz into the line's word, as another master or a copy does."""
        self._body.earlier_hz = hz
        if frequency := self._body.parameter("command_frequency"):
            count = self.hz_per_count(frequency)
            self._body.registers.put(frequency, round(hz / count))
            self._body.line_orders.take_back(frequency, self._body.parameter("command_speed"))

    def turned_over(self, is_io: bool) -> bool:
        """Return True if CMI bit 12 inverts the direction of the command word (ATV71, Drivecom)."""
        if is_io or self._body.traits.access_levels:
            return False
        return bool(self._cmi & CMI_REVERSE)

    def _written(self) -> float | None:
        """Return the later written of frequency and speed reference, in Hz; None if none was."""
        body = self._body
        frequency, speed = body.parameter("command_frequency"), body.parameter("command_speed")
        at, speed_at = body.line_orders.given_at(frequency), body.line_orders.given_at(speed)
        if speed is not None and speed_at > at:
            return body.engineering(speed) * self.poles / 120
        if frequency is None or not at:
            return None
        return body.registers.in_force(frequency) * self.hz_per_count(frequency)

    @property
    def poles(self) -> int:
        """Return the number of poles of the motor."""
        return round(self._body.value("motor_poles", self._body.rating.poles)) or 4

    @property
    def _cmi(self) -> int:
        return self._body.raw("extended_command_word") & 0xFFFF

    def hz_per_count(self, parameter: Parameter) -> float:
        """Return the value of one count of a frequency word, depending on CMI bit 9."""
        if not self._cmi & CMI_HIGH_RESOLUTION:
            return self._body.scale(parameter)
        fixed = self._body.traits.max_hz_high_resolution
        return (fixed or self._body.value("max_frequency", 60.0)) / FULL_COUNT

    def cut(self, hz: float) -> float:
        """Return a reference limited to low and high speed."""
        low, high = self.limits()
        size = min(max(abs(hz), low), high)
        return -size if hz < 0 else size

    def limits(self) -> tuple[float, float]:
        """Return low and high speed in force, in Hz."""
        body = self._body
        high = min(body.value("high_speed", UNLIMITED), body.value("max_frequency", UNLIMITED))
        return min(body.value("low_speed", 0.0), high), high

    def outside(self, wanted: float) -> bool:
        """Return True if a reference is outside its limits."""
        low, high = self.limits()
        return not low - 0.05 <= abs(wanted) <= high + 0.05
