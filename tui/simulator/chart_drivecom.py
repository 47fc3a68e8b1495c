"""State chart of the Altivar 31, 312 and 71: Drivecom (CiA 402) and the ATV71's I/O profile.

Sources: ATV71 Modbus manual and communication parameters guide; ATV312 communication
variables manual, control and status words.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from enum import Enum

from tui.drive.schema import Parameter

from .body import Body, Fallback
from .io_profile import IoCommand, io_status, read_io_command
from .motor import Order, Stop
from .rules import MODBUS_COMMAND, MODBUS_REFERENCE


class State(Enum):
    """States of the chart with the bits 0 to 6 of their status word, bit 4 left out."""

    DISABLED = 0x40
    READY = 0x21
    SWITCHED_ON = 0x23
    ENABLED = 0x27
    QUICK_STOP = 0x07
    REACTION = 0x0F
    FAULT = 0x08


class Command(Enum):
    """Commands of the chart: mask and value of the command word."""

    DISABLE_VOLTAGE = (0x0002, 0x0000)
    QUICK_STOP = (0x0006, 0x0002)
    SHUTDOWN = (0x0007, 0x0006)
    SWITCH_ON = (0x000F, 0x0007)
    ENABLE = (0x000F, 0x000F)


TRANSITIONS: Mapping[tuple[State, Command], State] = {
    (State.DISABLED, Command.SHUTDOWN): State.READY,
    (State.READY, Command.SWITCH_ON): State.SWITCHED_ON,
    (State.READY, Command.DISABLE_VOLTAGE): State.DISABLED,
    (State.READY, Command.QUICK_STOP): State.DISABLED,
    (State.SWITCHED_ON, Command.ENABLE): State.ENABLED,
    (State.SWITCHED_ON, Command.SHUTDOWN): State.READY,
    (State.SWITCHED_ON, Command.DISABLE_VOLTAGE): State.DISABLED,
    (State.SWITCHED_ON, Command.QUICK_STOP): State.DISABLED,
    (State.ENABLED, Command.SHUTDOWN): State.READY,
    (State.ENABLED, Command.DISABLE_VOLTAGE): State.DISABLED,
    (State.ENABLED, Command.QUICK_STOP): State.QUICK_STOP,
    (State.QUICK_STOP, Command.DISABLE_VOLTAGE): State.DISABLED,
}
"""Transitions that are made at once; Disable operation (16#0007) may wait for a ramp."""

FAULT_RESET, HALT, REVERSE, STOP_STT, INJECTION, FAST = (1 << b for b in (7, 8, 11, 12, 13, 14))
CMI_FAST, CMI_INJECTION, CMI_REVERSE, CMI_HIGH_RESOLUTION = (1 << b for b in (10, 11, 12, 9))
CMI_LOCKED = 1 << 15
STT = {0: Stop.RAMP, 1: Stop.FAST, 2: Stop.FREEWHEEL, 3: Stop.INJECTION}
IO_PROFILE, SEPARATE = 3, 2
REACHED_HZ = 0.1
FULL_COUNT = 32767
QSTD_LEAVES = 2
COMMAND_BITS = 160
"""Assignment of an input to bit 0 of the command word (RSF and others); bit 1 is one more."""


def command_of(word: int) -> Command | None:
    """The command of a word; None where its bits 0 to 3 are none."""
    return next((c for c in Command if word & c.value[0] == c.value[1]), None)


class DrivecomChart:
    """The chart of one drive."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self.state = State.DISABLED
        self._network = False
        """Whether the command word of the line is in force."""
        self._leaving = False
        """Whether a Disable operation waits for the motor to stop."""
        self._stop = Stop.RAMP
        self._last_command = 0
        self._io = IoCommand()
        self._reference_hz = 0.0

    # Orders from outside

    def power_up(self) -> None:
        """Start the chart: disabled, or enabled by itself below access level L3."""
        self._network = self._leaving = False
        self._last_command = 0
        self._io = IoCommand()
        self.state = State.ENABLED if self._by_terminals() else State.DISABLED

    def _by_terminals(self) -> bool:
        return self._body.traits.access_levels and self._body.setting("LAC", 2) < 2

    def _io_profile(self) -> bool:
        return self._body.setting("CHCF", 1) == IO_PROFILE

    def terminal_order(self) -> None:
        """Take a run order at the terminals into account."""
        if self._body.fault is None:
            self._network = self._leaving = False
            self.state = State.ENABLED

    def written(self, parameter: Parameter) -> None:
        """Follow a word that the line wrote."""
        if parameter.quantity == "command_word":
            self._command(self._body.registers.present(parameter) & 0xFFFF)
        elif (
            self._body.traits.config_disables
            and parameter.access == "rw-stopped"
            and self.state in (State.READY, State.SWITCHED_ON)
        ):
            self.state = State.DISABLED

    def _command(self, word: int) -> None:
        rising = word & ~self._last_command
        self._last_command = word
        if not self.network_commands:
            return
        self._network = True
        if self._io_profile():
            self._io = read_io_command(self._io, word, rising, self._body.setting("TCC", 0))
            reset_bit = self._body.setting("RSF", 0) - COMMAND_BITS
            if 0 <= reset_bit <= 15 and rising >> reset_bit & 1:
                self.reset_fault()
        elif self.state is State.FAULT:
            if rising & FAULT_RESET:
                self.reset_fault()
        elif self.state is not State.REACTION:
            command = command_of(word)
            if command is not Command.ENABLE:
                self._body.terminal_hz = None
            self._move(command)

    def _move(self, command: Command | None) -> None:
        self._leaving = False
        if command is None:
            return
        if self.state is State.ENABLED and command is Command.SWITCH_ON:
            self._disable_operation()
        elif command is Command.ENABLE and self._enables_from_here():
            self.state = State.ENABLED
        elif target := TRANSITIONS.get((self.state, command)):
            self.state = target

    def _disable_operation(self) -> None:
        """Stop as DOTD or the normal stop type says, then go to Switched on."""
        freewheel_set = self._body.setting("DOTD", 1) == 0
        self._stop = Stop.FREEWHEEL if freewheel_set else self._stop_type()
        self._leaving = self._stop is not Stop.FREEWHEEL
        if not self._leaving:
            self.state = State.SWITCHED_ON

    def _enables_from_here(self) -> bool:
        if self.state is State.READY:
            return self._body.traits.enable_from_ready
        return self.state is State.DISABLED and self._by_terminals()

    @property
    def network_commands(self) -> bool:
        """Whether the command channel is the line."""
        if self._by_terminals():
            return True
        body = self._body
        if self._combined:
            return body.setting("FR1", MODBUS_REFERENCE) == MODBUS_REFERENCE
        return body.setting("CD1", MODBUS_COMMAND) == MODBUS_COMMAND

    @property
    def network_reference(self) -> bool:
        """Whether the reference channel is the line."""
        channel = self._body.setting("FR1", MODBUS_REFERENCE)
        return self._by_terminals() or channel == MODBUS_REFERENCE

    @property
    def _combined(self) -> bool:
        return self._body.setting("CHCF", 1) < SEPARATE

    def trip(self, stop: Stop) -> None:
        """Go to Fault, over the fault reaction where the motor is stopped first."""
        slow = stop is not Stop.FREEWHEEL and self._body.turning
        self.state = State.REACTION if slow else State.FAULT
        self._stop = stop
        self._leaving = False
        self._io = IoCommand()

    def reset_fault(self) -> None:
        """Leave Fault if its cause is gone; nothing runs by itself afterwards."""
        if self.state is State.FAULT and self._body.fault and not self._body.fault.persists:
            self._body.fault = None
            self._body.terminal_hz = None
            self.state = State.ENABLED if self._by_terminals() else State.DISABLED
            self._network = self._network and self.state is State.DISABLED

    @property
    def running(self) -> bool:
        """Whether stopped-only words are locked."""
        return self._body.turning

    # What the motor is told

    def order(self) -> Order:
        """What the motor has to do now."""
        body = self._body
        self._settle()
        stop = self._stopping()
        up, down = body.rates(stop or Stop.RAMP, second=self._second_ramp())
        base = Order(acceleration=up, deceleration=down)
        if self._cmi & CMI_LOCKED or not self._powered():
            return base
        if stop is Stop.FREEWHEEL:
            return base
        if stop is Stop.INJECTION:
            return replace(base, injection=True)
        self._reference_hz = 0.0 if stop else self._target()
        return replace(base, energised=True, target=self._reference_hz)

    def _settle(self) -> None:
        """Transitions that the drive makes by itself once the motor stands."""
        body = self._body
        stands = self._stands
        if self.state is State.REACTION and stands:
            self.state = State.FAULT
        elif self._leaving and stands:
            self._leaving = False
            self.state = State.SWITCHED_ON
        elif self.state is State.QUICK_STOP and stands:
            if body.setting("QSTD", 6) == QSTD_LEAVES:
                self.state = State.DISABLED
        elif self.state is State.ENABLED and self._terminals_ended() and stands:
            self.state = State.DISABLED

    @property
    def _stands(self) -> bool:
        return not self._body.motor.frequency and not self._body.motor.rotor

    def _terminals_ended(self) -> bool:
        own = self._network or self._by_terminals() or self._io_profile()
        return not own and self._body.terminal_hz is None

    def _powered(self) -> bool:
        if self.state in (State.QUICK_STOP, State.REACTION):
            return not self._stands
        if self.state is not State.ENABLED and not self._io_powered():
            return False
        if self.state is State.ENABLED and not self._network:
            turning = self._body.motor.frequency != 0
            return self._body.terminal_hz is not None or turning
        return True

    def _io_powered(self) -> bool:
        going = self._io.run or self._body.motor.frequency != 0
        return self._io_profile() and self._network and self._body.fault is None and going

    def _stopping(self) -> Stop | None:
        """How the motor is being stopped; None while it follows its reference."""
        if self.state is State.QUICK_STOP:
            return Stop.FAST
        if self.state is State.REACTION or self._leaving:
            return self._stop
        if self._body.fallback is Fallback.STOP:
            return self._stop_type()
        if not self._network:
            return None if self._body.terminal_hz is not None else Stop.RAMP
        if self._io_profile():
            return None if self._io.run else self._stop_type()
        return self._commanded_stop()

    def _commanded_stop(self) -> Stop | None:
        word, cmi = self._last_command, self._cmi
        low_access = self._by_terminals()
        compact = self._body.traits.access_levels
        orders = (
            (bool(cmi & CMI_FAST) and not compact, Stop.FAST),
            (bool(cmi & CMI_INJECTION) and not compact, Stop.INJECTION),
            (bool(word & FAST) and low_access, Stop.FAST),
            (bool(word & INJECTION) and low_access, Stop.INJECTION),
            (bool(word & HALT) and not compact, self._stop_type()),
            (bool(word & STOP_STT) and compact, self._stop_type()),
        )
        return next((stop for given, stop in orders if given), None)

    def _stop_type(self) -> Stop:
        return STT.get(self._body.setting("STT", 0), Stop.RAMP)

    def _second_ramp(self) -> bool:
        return bool(self._cmi & 1 << 4) and self._body.traits.access_levels

    @property
    def _cmi(self) -> int:
        return self._body.raw("extended_command_word") & 0xFFFF

    # Reference

    def _target(self) -> float:
        body = self._body
        if body.fallback is Fallback.SPEED:
            speed = body.registers.named("LFF")
            return self._cut(body.engineering(speed) if speed else 0.0)
        if body.fallback is Fallback.MAINTAIN:
            return body.motor.frequency
        return self._cut(self._wanted())

    def _wanted(self) -> float:
        """The signed reference in Hz before LSP and HSP."""
        body = self._body
        line = self._line_reference() if self._network and self.network_reference else None
        if line is None:
            line = body.terminal_hz or 0.0
        if not self._network:
            return line
        reverse = bool(self._last_command & REVERSE)
        if self._io_profile():
            reverse = self._io.reverse
        elif not body.traits.access_levels and self._cmi & CMI_REVERSE:
            reverse = not reverse
        return -line if reverse else line

    def _line_reference(self) -> float | None:
        """The later written of frequency and speed reference, in Hz; None if none was."""
        body = self._body
        frequency, speed = body.parameter("command_frequency"), body.parameter("command_speed")
        at, speed_at = body.ordered_at(frequency), body.ordered_at(speed)
        if not at and not speed_at:
            return None
        if speed is not None and speed_at > at:
            return body.engineering(speed) * self.poles / 120
        assert frequency is not None
        return body.registers.in_force(frequency) * self.hz_per_count(frequency)

    @property
    def poles(self) -> int:
        """Poles of the motor."""
        return round(self._body.value("motor_poles", self._body.rating.poles)) or 4

    def hz_per_count(self, parameter: Parameter) -> float:
        """What one count of a frequency word is worth, with CMI bit 9 in mind."""
        if not self._cmi & CMI_HIGH_RESOLUTION:
            return self._body.scale(parameter)
        fixed = self._body.traits.max_hz_high_resolution
        return (fixed or self._body.value("max_frequency", 60.0)) / FULL_COUNT

    def _cut(self, hz: float) -> float:
        low, high = self._limits()
        size = min(max(abs(hz), low), high)
        return -size if hz < 0 else size

    def _limits(self) -> tuple[float, float]:
        body = self._body
        high = min(body.value("high_speed", 1e9), body.value("max_frequency", 1e9))
        return min(body.value("low_speed", 0.0), high), high

    # What the line is shown

    def show(self) -> None:
        """Put the status words of the present state into their registers."""
        body = self._body
        motor = body.motor
        word = self._status()
        body.show_raw("status_word", word)
        body.show_raw("extended_status_word", self._extended_status())
        line = self._line_commands
        body.show_code("CCC", 1 << 3 if line else 1)
        body.show_code("CRC", 1 << 3 if line and self.network_reference else 1)
        wanted = self._reference_hz if motor.energised else self._wanted()
        body.show("frequency_reference", wanted)
        if frequency := body.parameter("output_frequency"):
            body.registers.put(frequency, round(motor.frequency / self.hz_per_count(frequency)))
        body.show("speed_reference", wanted * 120 / self.poles)

    @property
    def _line_commands(self) -> bool:
        """Whether the line has the command now, and not a run order at the terminals."""
        return self._network or (self.network_commands and self._body.terminal_hz is None)

    def _status(self) -> int:
        body = self._body
        motor = body.motor
        going = motor.energised and self._powered()
        reached = going and abs(motor.frequency - self._reference_hz) < REACHED_HZ
        low, high = self._limits()
        asked = abs(self._wanted())
        marks = (
            (body.traits.power_bit and motor.mains > 0, 4),
            (body.alarms != 0 or motor.motor_thermal >= 100, 7),
            (body.traits.remote_always or self._line_commands, 9),
            (reached, 10),
            (going and not low - 0.05 <= asked <= high + 0.05, 11),
            (motor.frequency < 0, 15),
        )
        upper = sum(1 << bit for given, bit in marks if given)
        if self._io_profile():
            return upper | io_status(fault=body.fault is not None, running=body.turning)
        return upper | self.state.value

    def _extended_status(self) -> int:
        body = self._body
        motor = body.motor
        change = abs(motor.frequency) * motor.acceleration * (1 if motor.frequency >= 0 else -1)
        fault = body.fault
        marks = (
            (body.saving > 0, 0),
            (not self._cmi & CMI_LOCKED, 1),
            (fault is not None and not fault.persists, 2),
            (motor.frequency != 0 if body.traits.running_bit else True, 4),
            (motor.braking, 5),
            (motor.acceleration != 0, 6),
            (motor.motor_thermal >= 100, 7),
            (change > 0, 9),
            (change < 0, 10),
            (self._stopping() is Stop.FAST and motor.frequency != 0, 12),
            (self._network, 14),
            (self._wanted() < 0, 15),
        )
        return sum(1 << bit for given, bit in marks if given)
