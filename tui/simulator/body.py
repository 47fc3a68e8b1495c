"""Common parts of a simulated drive: registers, motor, terminal command, fault, watch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter, Quantity
from tui.drive.values import is_signed_type

from .plant.conditions import Conditions
from .plant.motor import MotorState, RatingPlate, Stop
from .plant.terminals import PLAIN_TERMINALS, Terminals
from .registers import Registers
from .rules import Traits


@dataclass(frozen=True, slots=True)
class ActiveFault:
    """Present fault of the drive; it can be reset once its cause is removed."""

    raw: int
    code: str
    persists: bool = False


SPEED_LIMITS: frozenset[Quantity] = frozenset({"high_speed", "low_speed"})
"""Limits of the reference that a drive with the planted defect `no-limits` ignores."""
CHART_WORDS: Mapping[Quantity, str] = {"status_word": "status", "command_word": "command"}


class Fallback(Enum):
    """Reaction to communication loss without a fault."""

    STOP = "stop"
    SPEED = "fallback speed"
    MAINTAIN = "maintain"


@dataclass
class LineOrders:
    """Commands and references that the line wrote since power-up, in their order."""

    _sequence: int = 0
    _at: dict[str, int] = field(default_factory=dict)

    def note(self, parameter: Parameter) -> None:
        """Record a write of one by the line."""
        self._sequence += 1
        self._at[parameter.code] = self._sequence

    def given_at(self, parameter: Parameter | None) -> int:
        """Return the sequence number of the line's last write of this one; 0: not since
        power-up."""
        return self._at.get(parameter.code, 0) if parameter else 0

    def take_back(self, *parameters: Parameter | None) -> None:
        """Discard these writes of the line: another source has replaced their values."""
        for parameter in parameters:
            if parameter and parameter.code in self._at:
                self._at[parameter.code] = 0

    def forget(self) -> None:
        """Discard all writes, as a power-down does."""
        self._at.clear()

    @property
    def any_given(self) -> bool:
        """True if a command or a reference was written since power-up."""
        return bool(self._at)


@dataclass
class Body:
    """The state of one simulated drive."""

    profile: Profile
    traits: Traits
    registers: Registers
    rating: RatingPlate
    motor: MotorState = field(default_factory=MotorState)
    terminals: Terminals = field(default_factory=lambda: Terminals(PLAIN_TERMINALS))
    """Its inputs; no trip, reset or power-down changes them."""
    conditions: Conditions = field(default_factory=Conditions)
    """Its supply, load and wire, and the defects planted in it."""
    earlier_hz: float | None = None
    """Reference in Hz of another master before the line's first one; None if there is none."""
    fault: ActiveFault | None = None
    fallback: Fallback | None = None
    forced_local: bool = False
    """True if an input forces local control; the timeout is then not monitored."""
    alarms: int = 0
    """Alarm bits set by `alarm`, in addition to those that the motor itself raises."""
    seconds: float = 0.0
    """Time of the drive, since it was made."""
    saving: float = 0.0
    """Remaining time in s of an EEPROM save; nothing can be written until it ends."""
    line_orders: LineOrders = field(default_factory=LineOrders)

    @property
    def powered(self) -> bool:
        """True if the drive's supply is on; without it the drive is silent."""
        return self.conditions.powered

    # Parameters by meaning

    def parameter(self, quantity: Quantity) -> Parameter | None:
        """Return the parameter of a quantity, or None.

        Status and command word are those of the chart if no parameter has these quantities.
        """
        if found := self.profile.quantity(quantity):
            return found
        if quantity in CHART_WORDS and self.profile.data.charts:
            return self.registers.named(getattr(self.profile.data.charts[0], CHART_WORDS[quantity]))
        return None

    def raw(self, quantity: Quantity, default: int = 0) -> int:
        """Return the raw value in force of a quantity; the default if the family has none."""
        found = self.parameter(quantity)
        return default if found is None else self.registers.in_force(found)

    def value(self, quantity: Quantity, default: float) -> float:
        """Return the engineering value in force of a quantity; the default if the family has
        none."""
        found = self.parameter(quantity)
        if found is None or (quantity in SPEED_LIMITS and self.unlimited):
            return default
        return self.engineering(found)

    def engineering(self, parameter: Parameter) -> float:
        """Engineering value in force of a parameter."""
        raw = self.registers.in_force(parameter)
        return raw * self.scale(parameter) + float(parameter.offset)

    def scale(self, parameter: Parameter) -> float:
        """Return the value of one count, from the parameter that defines its scale.

        Independent of the panel's conversion, so that tests show errors in that one.
        """
        if (full := parameter.full_scale) is not None:
            source = self.registers.named(full.parameter)
            value = 0.0 if source is None else self.engineering(source)
            return (value or 1.0) / full.counts
        follows = parameter.scale_by
        if follows is None:
            return float(parameter.scale)
        other = self.registers.named(follows.parameter)
        chosen = "" if other is None else str(self.registers.in_force(other))
        return float(follows.scales.get(chosen, parameter.scale))

    def setting(self, code: str, default: int) -> int:
        """Return the raw value in force of a setting by its code in any case; the default without
        it."""
        found = self.registers.named(code)
        return default if found is None else self.registers.in_force(found)

    def show(self, quantity: Quantity, engineering: float) -> None:
        """Put an engineering value into the word of a quantity, if the family has one.

        An unsigned word shows the magnitude.
        """
        if found := self.parameter(quantity):
            signed = is_signed_type(found) or found.offset != "0"
            value = engineering if signed else abs(engineering)
            self.registers.put(found, round((value - float(found.offset)) / self.scale(found)))

    def show_raw(self, quantity: Quantity, raw: int) -> None:
        """Put a raw value into the word of a quantity, if the family has one."""
        if found := self.parameter(quantity):
            self.registers.put(found, raw)

    def show_code(self, code: str, raw: int) -> None:
        """Put a raw value into a word by its code, if the family has it."""
        if found := self.registers.named(code):
            self.registers.put(found, raw)

    # Planted defects

    @property
    def unlimited(self) -> bool:
        """True if the drive ignores its limits, by a planted defect."""
        return "no-limits" in self.conditions.planted

    def directed(self, hz: float) -> float:
        """Return a signed reference in Hz; a planted defect swaps its direction."""
        return -hz if "swapped-direction" in self.conditions.planted else hz

    # Ramps

    def ramps(self, second: bool = False) -> tuple[float, float]:
        """Return acceleration and deceleration in Hz/s, from the drive's own ramp times."""
        span = self.value(self.traits.ramps_to, self.rating.frequency)
        up = self.value("acceleration_2" if second else "acceleration", 3.0)
        down = self.value("deceleration_2" if second else "deceleration", up)
        slower = self.conditions.slows()
        return span / max(up * slower, 0.01), span / max(down * slower, 0.01)

    def rates(self, stop: Stop, second: bool = False) -> tuple[float, float]:
        """Return the ramps during a `stop`: a fast stop divides the deceleration time by DCF."""
        up, down = self.ramps(second)
        if stop is Stop.FAST:
            down *= self.setting("DCF", 4) or 1000
        return up, down

    @property
    def turning(self) -> bool:
        """True if the drive supplies the motor."""
        return self.motor.energised or self.motor.braking
