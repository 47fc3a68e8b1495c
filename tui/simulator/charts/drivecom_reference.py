"""The reference of the Altivar 31, 312 and 71: which word counts, its sign and its limits.

Source: ATV71 communication parameters guide (LFR, LFRD, CMD bit 11, CMI bits 9 and 12); ATV312
communication variables, high resolution.
"""

from __future__ import annotations

from tui.drive.profile.schema import Parameter

from ..body import Body, Fallback
from .io_profile import IoCommand

CMD_REVERSE = 1 << 11
CMI_HIGH_RESOLUTION, CMI_REVERSE = 1 << 9, 1 << 12
FULL_COUNT = 32767
UNLIMITED = 1e9


class DrivecomReference:
    """Reads the reference of one drive from its words."""

    def __init__(self, body: Body) -> None:
        self._body = body

    def target(self, wanted: float) -> float:
        """What the ramp goes to, in Hz: the wanted reference in its limits, or a fallback."""
        body = self._body
        if body.fallback is Fallback.SPEED:
            speed = body.registers.named("LFF")
            return self.cut(body.engineering(speed) if speed else 0.0)
        if body.fallback is Fallback.MAINTAIN:
            return body.motor.frequency
        return self.cut(wanted)

    def by_terminals(self) -> float:
        """The reference at the terminals, in Hz."""
        return self._body.terminal_hz or 0.0

    def by_line(self, word: int, io: IoCommand | None, *, channel: bool) -> float:
        """The signed reference in Hz under a command word of the line, before its limits.

        `io` is the order of the I/O profile where that is in force; without the reference
        `channel` the terminals still give the size.
        """
        hz = self._written() if channel else None
        if hz is None:
            hz = self.by_terminals()
        reverse = bool(word & CMD_REVERSE)
        if io is not None:
            reverse = io.reverse
        elif not self._body.traits.access_levels and self._cmi & CMI_REVERSE:
            reverse = not reverse
        return -hz if reverse else hz

    def _written(self) -> float | None:
        """The later written of frequency and speed reference, in Hz; None if none was."""
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
        """Poles of the motor."""
        return round(self._body.value("motor_poles", self._body.rating.poles)) or 4

    @property
    def _cmi(self) -> int:
        return self._body.raw("extended_command_word") & 0xFFFF

    def hz_per_count(self, parameter: Parameter) -> float:
        """What one count of a frequency word is worth, with CMI bit 9 in mind."""
        if not self._cmi & CMI_HIGH_RESOLUTION:
            return self._body.scale(parameter)
        fixed = self._body.traits.max_hz_high_resolution
        return (fixed or self._body.value("max_frequency", 60.0)) / FULL_COUNT

    def cut(self, hz: float) -> float:
        """A reference in the limits of low and high speed."""
        low, high = self.limits()
        size = min(max(abs(hz), low), high)
        return -size if hz < 0 else size

    def limits(self) -> tuple[float, float]:
        """Low and high speed in force, in Hz."""
        body = self._body
        high = min(body.value("high_speed", UNLIMITED), body.value("max_frequency", UNLIMITED))
        return min(body.value("low_speed", 0.0), high), high

    def outside(self, wanted: float) -> bool:
        """Whether a reference is outside its limits."""
        low, high = self.limits()
        return not low - 0.05 <= abs(wanted) <= high + 0.05
