"""State chart of the Altivar 31, 312 and 71: Drivecom (CiA 402) and the ATV71's I/O profile.

Sources: ATV71 Modbus manual and communication parameters guide; ATV312 communication
variables manual, control and status words.
"""

from __future__ import annotations

from dataclasses import replace

from tui.drive.profile.schema import Parameter

from ..body import Body, Fallback
from ..plant.motor import MotorDemand, Stop
from ..rules import MODBUS_COMMAND, MODBUS_REFERENCE
from .altivar_words import show_altivar_words
from .drivecom_reference import DrivecomReference
from .drivecom_states import TRANSITIONS, DrivecomCommand, DrivecomState, command_of
from .drivecom_status import Appearance, extended_status_word, status_word
from .io_profile import IoCommand, io_status, read_io_command

FAULT_RESET, HALT, STOP_STT, INJECTION, FAST = (1 << bit for bit in (7, 8, 12, 13, 14))
CMI_SECOND_RAMP, CMI_FAST, CMI_INJECTION, CMI_LOCKED = (1 << bit for bit in (4, 10, 11, 15))
STT = {0: Stop.RAMP, 1: Stop.FAST, 2: Stop.FREEWHEEL, 3: Stop.INJECTION}
IO_PROFILE, SEPARATE = 3, 2
DRIVECOM_REACHED_HZ = 0.1
LINE, TERMINALS = 1 << 3, 1 << 0
"""Channels in force, as CCC and CRC show them."""
QSTD_LEAVES = 2
COMMAND_BITS = 160
"""Assignment of an input to bit 0 of the command word (RSF and others); bit 1 is one more."""


class DrivecomChart:
    """The chart of one drive."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self.state = DrivecomState.DISABLED
        self._network = False
        """Whether the command word of the line is in force."""
        self._leaving = False
        """Whether a Disable operation waits for the motor to stop."""
        self._stop = Stop.RAMP
        self._last_command = 0
        self._io = IoCommand()
        self._target_hz = 0.0
        self._reference = DrivecomReference(body)

    # Orders from outside

    def power_up(self) -> None:
        """Start the chart: disabled, or enabled by itself below access level L3."""
        self._network = self._leaving = False
        self._last_command = 0
        self._io = IoCommand()
        self.state = DrivecomState.ENABLED if self._by_terminals() else DrivecomState.DISABLED

    def _by_terminals(self) -> bool:
        return self._body.traits.access_levels and self._body.setting("LAC", 2) < 2

    def _io_profile(self) -> bool:
        return self._body.setting("CHCF", 1) == IO_PROFILE

    def terminal_order(self) -> None:
        """Take a run order at the terminals into account."""
        if self._body.fault is None:
            self._network = self._leaving = False
            self.state = DrivecomState.ENABLED

    def written(self, parameter: Parameter) -> None:
        """Follow a word that the line wrote."""
        if parameter.quantity == "command_word":
            self._command(self._body.registers.present(parameter) & 0xFFFF)
        elif (
            self._body.traits.config_disables
            and parameter.access == "rw-stopped"
            and self.state in (DrivecomState.READY, DrivecomState.SWITCHED_ON)
        ):
            self.state = DrivecomState.DISABLED

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
        elif self.state is DrivecomState.FAULT:
            if rising & FAULT_RESET:
                self.reset_fault()
        elif self.state is not DrivecomState.REACTION:
            command = command_of(word)
            if command is not DrivecomCommand.ENABLE:
                self._body.terminal_hz = None
            self._move(command)

    def _move(self, command: DrivecomCommand | None) -> None:
        self._leaving = False
        if command is None:
            return
        if self.state is DrivecomState.ENABLED and command is DrivecomCommand.SWITCH_ON:
            self._disable_operation()
        elif command is DrivecomCommand.ENABLE and self._enables_from_here():
            self.state = DrivecomState.ENABLED
        elif target := TRANSITIONS.get((self.state, command)):
            self.state = target

    def _disable_operation(self) -> None:
        """Stop as DOTD or the normal stop type says, then go to Switched on."""
        freewheel_set = self._body.setting("DOTD", 1) == 0
        self._stop = Stop.FREEWHEEL if freewheel_set else self._stop_type()
        self._leaving = self._stop is not Stop.FREEWHEEL
        if not self._leaving:
            self.state = DrivecomState.SWITCHED_ON

    def _enables_from_here(self) -> bool:
        if self.state is DrivecomState.READY:
            return self._body.traits.enable_from_ready
        return self.state is DrivecomState.DISABLED and self._by_terminals()

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
        self.state = DrivecomState.REACTION if slow else DrivecomState.FAULT
        self._stop = stop
        self._leaving = False
        self._io = IoCommand()

    def reset_fault(self) -> None:
        """Leave Fault if its cause is gone; nothing runs by itself afterwards."""
        if self.state is DrivecomState.FAULT and self._body.fault and not self._body.fault.persists:
            self._body.fault = None
            self._body.terminal_hz = None
            self.state = DrivecomState.ENABLED if self._by_terminals() else DrivecomState.DISABLED
            self._network = self._network and self.state is DrivecomState.DISABLED

    @property
    def running(self) -> bool:
        """Whether stopped-only words are locked."""
        return self._body.turning

    # What the motor is told

    def order(self) -> MotorDemand:
        """What the motor has to do now."""
        body = self._body
        self._settle()
        stop = self._stopping()
        up, down = body.rates(stop or Stop.RAMP, second=self._second_ramp())
        base = MotorDemand(acceleration=up, deceleration=down)
        if self._cmi & CMI_LOCKED or not self._powered():
            return base
        if stop is Stop.FREEWHEEL:
            return base
        if stop is Stop.INJECTION:
            return replace(base, injection=True)
        self._target_hz = 0.0 if stop else self._reference.target(self._wanted())
        return replace(base, energised=True, target=self._target_hz)

    def _settle(self) -> None:
        """Transitions that the drive makes by itself once the motor stands."""
        body = self._body
        stands = self._stands
        if self.state is DrivecomState.REACTION and stands:
            self.state = DrivecomState.FAULT
        elif self._leaving and stands:
            self._leaving = False
            self.state = DrivecomState.SWITCHED_ON
        elif self.state is DrivecomState.QUICK_STOP and stands:
            if body.setting("QSTD", 6) == QSTD_LEAVES:
                self.state = DrivecomState.DISABLED
        elif self.state is DrivecomState.ENABLED and self._terminals_ended() and stands:
            self.state = DrivecomState.DISABLED

    @property
    def _stands(self) -> bool:
        return not self._body.motor.frequency and not self._body.motor.rotor

    def _terminals_ended(self) -> bool:
        own = self._network or self._by_terminals() or self._io_profile()
        return not own and self._body.terminal_hz is None

    def _powered(self) -> bool:
        if self.state in (DrivecomState.QUICK_STOP, DrivecomState.REACTION):
            return not self._stands
        if self.state is not DrivecomState.ENABLED and not self._io_powered():
            return False
        if self.state is DrivecomState.ENABLED and not self._network:
            turning = self._body.motor.frequency != 0
            return self._body.terminal_hz is not None or turning
        return True

    def _io_powered(self) -> bool:
        going = self._io.run or self._body.motor.frequency != 0
        return self._io_profile() and self._network and self._body.fault is None and going

    def _stopping(self) -> Stop | None:
        """How the motor is being stopped; None while it follows its reference."""
        if self.state is DrivecomState.QUICK_STOP:
            return Stop.FAST
        if self.state is DrivecomState.REACTION or self._leaving:
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
        return bool(self._cmi & CMI_SECOND_RAMP) and self._body.traits.access_levels

    @property
    def _cmi(self) -> int:
        return self._body.raw("extended_command_word") & 0xFFFF

    def _wanted(self) -> float:
        """The signed reference in Hz before LSP and HSP."""
        if not self._network:
            return self._reference.by_terminals()
        io = self._io if self._io_profile() else None
        return self._reference.by_line(self._last_command, io, channel=self.network_reference)

    # What the line is shown

    def show(self) -> None:
        """Put the words of the present state into their registers."""
        body = self._body
        motor = body.motor
        seen = self._appearance()
        body.show_raw("status_word", status_word(body, seen))
        body.show_raw("extended_status_word", extended_status_word(body, seen))
        body.show_code("CCC", LINE if seen.line_commands else TERMINALS)
        by_line = seen.line_commands and self.network_reference
        body.show_code("CRC", LINE if by_line else TERMINALS)
        shown = self._target_hz if motor.energised else seen.wanted
        body.show("frequency_reference", shown)
        body.show("speed_reference", shown * 120 / self._reference.poles)
        if frequency := body.parameter("output_frequency"):
            count = self._reference.hz_per_count(frequency)
            body.registers.put(frequency, round(motor.frequency / count))
        disabled = self.state is DrivecomState.DISABLED and not self._io_profile()
        show_altivar_words(body, seen.stop, disabled=disabled, reached=seen.reached)

    def _appearance(self) -> Appearance:
        body = self._body
        motor = body.motor
        going = motor.energised and self._powered()
        wanted = self._wanted()
        bits = self.state.value
        if self._io_profile():
            bits = io_status(fault=body.fault is not None, running=body.turning)
        return Appearance(
            state_bits=bits,
            network=self._network,
            line_commands=self._network or (self.network_commands and body.terminal_hz is None),
            going=going,
            reached=going and abs(motor.frequency - self._target_hz) < DRIVECOM_REACHED_HZ,
            wanted=wanted,
            outside=self._reference.outside(wanted),
            stop=self._stopping(),
            locked=bool(self._cmi & CMI_LOCKED),
        )
