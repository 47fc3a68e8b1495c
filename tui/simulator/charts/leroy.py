"""Control word 6.42, status word 10.40 and their bit parameters on Leroy-Somer drives.

Source: PX-MODBUS manual 5.5. With 6.43 = 1 the control word commands and the terminals do not;
the manual names no reference register, so the reference stays that of the terminals, until bit 8
(1.42) chooses the first preset. That this is 1.21, in rpm of a motor with 4 poles and at most
1.06, is general knowledge of the menus.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from tui.drive.profile.schema import Parameter

from ..body import Body, Fallback
from ..plant.fault_history import OwnFault
from ..plant.motor import MotorDemand, Stop

CONTROL_WORD, CONTROL_ON, STATUS_WORD = "6.42", "6.43", "10.40"
BIT_PARAMETERS: Mapping[int, str] = {
    0: "6.15",
    1: "6.30",
    2: "6.31",
    3: "6.32",
    4: "6.33",
    5: "6.34",
    8: "1.42",
    13: "10.33",
}
UNLOCKED, FORWARD, JOG, BACKWARD, CHANGE_WAY, RUN, RESET = (1 << b for b in (0, 1, 2, 3, 4, 5, 13))
RUNNING_ORDERS = FORWARD | JOG | BACKWARD | RUN
DEFAULT_HZ = 30.0
"""Analog reference of a drive whose inputs were not set, in Hz."""
LEROY_FULL_HZ = 50.0
"""Full scale of the analog reference, in Hz; the manual gives none."""
JOG_HZ = 5.0
LEROY_REACHED_HZ = 0.1
MAINS_LOSS_BIT = 14
PRESET_CHOSEN = 1 << 8
PRESET, MOST = "1.21", "1.06"
RPM_PER_HZ = 30


class LeroySomerChart:
    """State chart of one Leroy-Somer drive: its commands and status."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._stop = Stop.RAMP
        self._last = 0
        self._target_hz = 0.0
        self._pressed = False
        """True if RESET was closed at the last call."""
        body.terminals.apply("AI1", DEFAULT_HZ / LEROY_FULL_HZ)

    def power_up(self) -> None:
        """Start without commands of the line."""
        self._last = 0

    def run(self, hz: float) -> None:
        """Close the run input, at a reference in Hz; it acts while the control word is off."""
        self._body.terminals.close("REV" if hz < 0 else "RUN")
        self.refer(hz)

    def refer(self, hz: float) -> None:
        """Change the analog reference at the terminals, in Hz."""
        self._body.terminals.apply("AI1", abs(hz) / LEROY_FULL_HZ)

    def halt(self) -> None:
        """Open the run inputs."""
        for name in ("RUN", "REV"):
            self._body.terminals.close(name, closed=False)

    def follow(self) -> None:
        """Read the inputs: RESET resets a fault."""
        pressed = self._body.terminals.closed("RESET")
        if pressed and not self._pressed:
            self.reset_fault()
        self._pressed = pressed

    def written(self, parameter: Parameter) -> None:
        """Process a word that the line wrote: the control word changes its bit parameters."""
        if self._by_word and parameter.code in (CONTROL_WORD, CONTROL_ON):
            word = self._body.setting(CONTROL_WORD, 0)
            for bit, code in BIT_PARAMETERS.items():
                self._body.show_code(code, word >> bit & 1)
        bits = self._bits()
        rising = bits & ~self._last
        self._last = bits
        if rising & RESET:
            self.reset_fault()

    @property
    def _by_word(self) -> bool:
        return self._body.setting(CONTROL_ON, 0) == 1

    def _bits(self) -> int:
        """Return the commands in force, as bits of the control word."""
        if self._by_word:
            return self._body.setting(CONTROL_WORD, 0) & 0xFFFF
        given = self._body.setting
        bits = sum(1 << bit for bit, code in BIT_PARAMETERS.items() if given(code, 0))
        closed = self._body.terminals.closed
        if closed("RUN") or closed("REV"):
            bits |= UNLOCKED | (FORWARD if closed("RUN") else BACKWARD)
        return bits

    @property
    def running(self) -> bool:
        """True if the drive is unlocked or turning: 6.43 cannot be changed then."""
        return self._body.turning or bool(self._bits() & UNLOCKED)

    @property
    def keys(self) -> Mapping[str, Callable[[], str]]:
        """Return no keys: those of the keypad are not simulated."""
        return {}

    def trip(self, stop: Stop) -> None:
        """Stop the motor as the fault demands."""
        self._stop = stop

    def reset_fault(self) -> None:
        """Clear the fault if its cause is removed; a closed run input starts the motor again."""
        fault = self._body.fault
        if fault is not None and not fault.persists:
            self._body.fault = None

    def raises(self) -> OwnFault | None:
        """Return None: no word and no input of this family causes a fault."""
        return None

    def order(self) -> MotorDemand:
        """Return the present demand on the motor."""
        body = self._body
        up, down = body.rates(Stop.RAMP)
        base = MotorDemand(acceleration=up, deceleration=down)
        bits = self._bits()
        if body.fault is not None or not bits & UNLOCKED:
            self._target_hz = 0.0
            return base
        ordered = bool(bits & RUNNING_ORDERS) and body.fallback is not Fallback.STOP
        self._target_hz = self._wanted(bits) if ordered else 0.0
        energised = ordered or body.motor.frequency != 0
        return replace(base, energised=energised, target=self._target_hz)

    def _wanted(self, bits: int) -> float:
        hz = LEROY_FULL_HZ * self._body.terminals.level("AI1")
        if bits & PRESET_CHOSEN and self._body.registers.named(PRESET) is not None:
            most = 0x7FFF if self._body.unlimited else _signed(self._body.setting(MOST, 0))
            most = most or 0x7FFF
            hz = min(abs(_signed(self._body.setting(PRESET, 0))), most) / RPM_PER_HZ
        hz = min(hz, self._body.value("max_frequency", 1e9) or 1e9)
        if bits & JOG and not bits & (FORWARD | BACKWARD | RUN):
            return self._body.directed(JOG_HZ)
        backward = bool(bits & BACKWARD) or (bool(bits & RUN) and bool(bits & CHANGE_WAY))
        return self._body.directed(-hz if backward else hz)

    def show(self) -> None:
        """Put the status word and its bit parameters into their registers."""
        body = self._body
        word = self._status()
        body.show_code(STATUS_WORD, word)
        for bit in range(15):
            body.show_code(f"10.{bit + 1:02}", word >> bit & 1)
        body.show("output_frequency", body.motor.frequency)
        body.show("frequency_reference", self._target_hz)

    def _status(self) -> int:
        body = self._body
        motor = body.motor
        size, target = abs(motor.frequency), abs(self._target_hz)
        active = motor.energised
        reached = abs(size - target) < LEROY_REACHED_HZ
        marks = (
            (body.fault is None and motor.mains > 0, 0),
            (active, 1),
            (size < LEROY_REACHED_HZ, 2),
            (active and size < body.value("low_speed", 0.0) + LEROY_REACHED_HZ, 3),
            (active and not reached and size < target, 4),
            (active and reached, 5),
            (active and not reached and size > target, 6),
            (active and abs(motor.torque) >= 100, 7),
            (active and abs(motor.torque) >= 150, 8),
            (active and motor.power < 0, 9),
            (self._target_hz < 0, 12),
            (motor.frequency < 0, 13),
            (self._knows_mains_loss and motor.mains <= 0, MAINS_LOSS_BIT),
        )
        return sum(1 << bit for given, bit in marks if given)

    @property
    def _knows_mains_loss(self) -> bool:
        return self._body.registers.named("10.15") is not None


def _signed(word: int) -> int:
    """Return a word as a signed number."""
    return word - 0x10000 if word >= 0x8000 else word
