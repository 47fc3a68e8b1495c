"""State chart of the Altivar 31, 312 and 71: Drivecom (CiA 402) and the ATV71's I/O profile.

Sources: ATV71 Modbus manual and communication parameters guide; ATV312 communication
variables manual, control and status words.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from tui.drive.profile.schema import Parameter

from ..body import Body, Fallback
from ..plant.fault_history import OwnFault
from ..plant.motor import MotorDemand, Stop
from ..rules import MODBUS_COMMAND, MODBUS_REFERENCE
from .channels import (
    COPIES_COMMAND,
    COPIES_REFERENCE,
    ChannelPlace,
    ChannelsInForce,
    channels_in_force,
    switch_is_on,
)
from .drivecom_machine import DrivecomMachine
from .drivecom_reference import DrivecomReference
from .drivecom_states import DrivecomCommand, DrivecomState, command_of
from .drivecom_status import Appearance, show_drivecom
from .drivecom_stops import commanded_stop, extended_command, external_fault, locked, stop_type
from .io_profile import io_status
from .wiring import LineCommand, TerminalWiring

COMMISSIONED = {"FR1": MODBUS_REFERENCE, "CD1": MODBUS_COMMAND}
"""Channels of a drive whose profile has no words that select them."""
FULL_ACCESS = 2


class DrivecomChannels:
    """Reads settings, inputs and command bits, and shows which channels are in force."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self.line_spoke = False
        """True after a first command of the line; below access level L3 the line then commands."""
        self.now = ChannelsInForce(ChannelPlace.LINE, ChannelPlace.LINE)

    def power_up(self) -> None:
        """Start without a command of the line."""
        self.line_spoke = False
        self.now = self._look()

    def follow(self) -> tuple[ChannelsInForce, ChannelsInForce]:
        """Update the channels; return the previous and the present ones."""
        before, self.now = self.now, self._look()
        return before, self.now

    def is_on(self, raw: int) -> bool:
        """Return True if an assignment to an input or a command bit holds."""
        word = self._body.raw("command_word") & 0xFFFF
        return switch_is_on(raw, self._body.terminals.closed, word)

    def _look(self) -> ChannelsInForce:
        channels = channels_in_force(self._setting, self.is_on)
        if self.low_access and not channels.local:
            place = ChannelPlace.LINE if self.line_spoke else ChannelPlace.TERMINALS
            return ChannelsInForce(place, place)
        return channels

    def _setting(self, code: str, default: int) -> int:
        return self._body.setting(code, COMMISSIONED.get(code, default))

    @property
    def low_access(self) -> bool:
        """True if LAC is below L3: the drive enables itself (ATV31/312)."""
        levels = self._body.traits.access_levels
        return levels and self._body.setting("LAC", FULL_ACCESS) < FULL_ACCESS


FAULT_RESET = 1 << 7
CMI_SECOND_RAMP = 1 << 4
DRIVECOM_REACHED_HZ = 0.1


class DrivecomChart:
    """State chart of one drive: its commander, its state, its demand on the motor."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._machine = DrivecomMachine(body)
        self._command = LineCommand(body)
        self._reference = DrivecomReference(body)
        self._channels = DrivecomChannels(body)
        self._wiring = TerminalWiring(body)
        self._target_hz = 0.0
        self._resets = False
        """True if the assigned fault reset was active at the last call."""

    # Commands from outside

    def power_up(self) -> None:
        """Start the chart: disabled, or enabled automatically below access level L3."""
        self._command.clear()
        self._channels.power_up()
        self._wiring.renew()
        self._machine.start(enabled=self._channels.low_access)
        self.follow()

    def run(self, hz: float) -> None:
        """Run by the inputs if they command, else by an earlier command of another master."""
        if self._channels.now.command is ChannelPlace.TERMINALS:
            self._body.terminals.close("LI2" if hz < 0 else "LI1")
        else:
            self._command.enable(reverse=hz < 0)
            self._machine.enable()
        self._refer(hz)
        self.follow()

    def refer(self, hz: float) -> None:
        """Change the reference from outside, unless the line has given one since."""
        if self._channels.now.reference is ChannelPlace.TERMINALS or self._reference.is_earlier:
            self._refer(hz)

    @property
    def keys(self) -> Mapping[str, Callable[[], str]]:
        """Keys of the keypad: STOP, if its priority PSt is on."""
        return {"STOP": self._press_stop}

    def _press_stop(self) -> str:
        if not self._body.setting("PST", 1):
            return "STOP ignored: PSt is off"
        self._body.earlier_hz = None
        self._command.let_go()
        self._wiring.spend()
        self._machine.start(enabled=False)
        return "STOP: freewheel"

    def _refer(self, hz: float) -> None:
        if self._channels.now.reference is ChannelPlace.TERMINALS:
            self._reference.wire(self._channels.now, abs(hz))
        else:
            self._reference.leave(abs(hz))

    def halt(self) -> None:
        """Open the run inputs, and end the command of another master."""
        for name in ("LI1", "LI2"):
            self._body.terminals.close(name, closed=False)
        self._body.earlier_hz = None
        self.follow()
        if self._by_line:
            self._command.let_go()
            if not self._command.is_io:
                self._machine.leave()

    def follow(self) -> None:
        """Read the inputs and the switches that they control."""
        self._wiring.follow()
        before, now = self._channels.follow()
        self._body.forced_local = now.local
        if before.reference_2 != now.reference_2:
            self._copy_reference(before, now)
        if before.command is not now.command:
            self._change_channel(before, now)
        reset = self._channels.is_on(self._body.setting("RSF", 0))
        if reset and not self._resets:
            self.reset_fault()
        self._resets = reset
        if self._wired_run():
            self._machine.enable()

    def _copy_reference(self, before: ChannelsInForce, now: ChannelsInForce) -> None:
        copies = self._body.setting("COP", 0) in COPIES_REFERENCE
        if copies and self._copies(to_2=now.reference_2) and now.reference is ChannelPlace.LINE:
            self._reference.leave(abs(self._wanted(before)))

    def _copies(self, *, to_2: bool) -> bool:
        """Return True if channel 1 is copied to channel 2; in the I/O profile also the reverse."""
        return to_2 or self._command.is_io

    def _change_channel(self, before: ChannelsInForce, now: ChannelsInForce) -> None:
        """Change the command channel: its commands, or those copied to it, apply from now on."""
        running = self._ordered(before)
        self._machine.leaving = False
        self._command.let_go()
        if now.command is ChannelPlace.TERMINALS:
            self._wiring.renew()
            self._wiring.follow()
        if now.command is not ChannelPlace.LINE:
            return
        copies = self._body.setting("COP", 0) in COPIES_COMMAND
        if copies and running and self._copies(to_2=now.command_2):
            self._command.enable(reverse=self._body.motor.frequency < 0)
            self._machine.enable()
            return
        self._command.adopt()
        if not self._command.is_io:
            self._obey(command_of(self._command.word))

    def _ordered(self, channels: ChannelsInForce) -> bool:
        """Return True if these channels command a run."""
        if channels.command is ChannelPlace.TERMINALS:
            return self._wiring.order.run
        return self._machine.state is DrivecomState.ENABLED and not self._stopping()

    def written(self, parameter: Parameter) -> None:
        """Process a word that the line wrote."""
        if parameter is self._body.parameter("command_word"):
            self._take(self._body.registers.present(parameter) & 0xFFFF)
        elif parameter.access == "rw-stopped":
            self._machine.reconfigured()
        self.follow()

    def _take(self, word: int) -> None:
        self._channels.line_spoke = True
        self.follow()
        rising = self._command.take(word, in_force=self._by_line)
        if not self._by_line or self._command.is_io:
            return
        if rising & FAULT_RESET and self._machine.faulty:
            self.reset_fault()
        elif not self._machine.faulty:
            command = command_of(word)
            if command is not DrivecomCommand.ENABLE:
                self._body.earlier_hz = None
            self._obey(command)

    def _obey(self, command: DrivecomCommand | None) -> None:
        self._machine.obey(command, low_access=self._channels.low_access)

    @property
    def _by_line(self) -> bool:
        """True if the command channel is the line."""
        return self._channels.now.command is ChannelPlace.LINE

    def raises(self) -> OwnFault | None:
        """Return the external fault, for as long as CMI bit 3 or the input of ETF reports it."""
        return external_fault(self._body, self._channels.is_on)

    def trip(self, stop: Stop) -> None:
        """Go to Fault; the inputs stay as they are."""
        self._machine.trip(stop)
        self._command.let_go()

    def reset_fault(self) -> None:
        """Leave Fault if its cause is removed; the line must command again, closed inputs run
        on."""
        fault = self._body.fault
        if self._machine.state is DrivecomState.FAULT and fault and not fault.persists:
            self._body.fault = None
            self._body.earlier_hz = None
            self._wiring.renew()
            self._channels.line_spoke = False
            self._machine.start(enabled=self._channels.low_access)

    @property
    def running(self) -> bool:
        """True if stopped-only words are locked."""
        return self._body.turning

    # Demand on the motor

    def order(self) -> MotorDemand:
        """Return the present demand on the motor."""
        body = self._body
        self.follow()
        if self._stands:
            self._machine.stands(holds=self._holds())
        stop = self._stopping()
        up, down = body.rates(stop or Stop.RAMP, second=self._second_ramp())
        base = MotorDemand(acceleration=up, deceleration=down)
        if locked(body, stands=self._stands) or not self._powered() or stop is Stop.FREEWHEEL:
            return base
        if stop is Stop.INJECTION:
            return replace(base, injection=True)
        self._target_hz = 0.0 if stop else self._reference.target(self._wanted())
        return replace(base, energised=True, target=self._target_hz)

    def _holds(self) -> bool:
        """Return True if the drive stays enabled at standstill."""
        return self._by_line or self._channels.low_access or self._wired_run()

    def _wired_run(self) -> bool:
        terminals = self._channels.now.command is ChannelPlace.TERMINALS
        return terminals and self._wiring.order.run

    @property
    def _stands(self) -> bool:
        return not self._body.motor.frequency and not self._body.motor.rotor

    def _powered(self) -> bool:
        state = self._machine.state
        if state in (DrivecomState.QUICK_STOP, DrivecomState.REACTION):
            return not self._stands
        turning = self._body.motor.frequency != 0
        if self._by_line and self._command.is_io:
            return self._body.fault is None and (self._command.io.run or turning)
        if state is not DrivecomState.ENABLED:
            return False
        return self._by_line or self._wired_run() or turning

    def _stopping(self) -> Stop | None:
        """Return the present stop of the motor; None while it follows its reference."""
        if by_state := self._machine.stopping():
            return by_state
        if self._body.fallback is Fallback.STOP:
            return stop_type(self._body)
        if wired := self._wiring.stop():
            return wired
        if not self._by_line:
            return None if self._wired_run() else stop_type(self._body)
        if self._command.is_io:
            return None if self._command.io.run else stop_type(self._body)
        low = self._channels.low_access
        return commanded_stop(self._body, self._command.word, low_access=low)

    def _second_ramp(self) -> bool:
        second = bool(extended_command(self._body) & CMI_SECOND_RAMP)
        return second and self._body.traits.access_levels

    def _wanted(self, channels: ChannelsInForce | None = None) -> float:
        """Return the signed reference in Hz before LSP and HSP, for the channels in force or
        others."""
        channels = channels or self._channels.now
        hz = self._reference.size(channels)
        if channels.command is ChannelPlace.LINE:
            reverse = self._command.reverse != self._reference.turned_over(self._command.is_io)
        else:
            reverse = self._wiring.order.reverse
        return self._body.directed(-hz if reverse else hz)

    # Words for the line

    def show(self) -> None:
        """Put the words of the present state into their registers."""
        body = self._body
        seen = self._appearance()
        shown = self._target_hz if body.motor.energised else seen.wanted
        if frequency := body.parameter("output_frequency"):
            count = self._reference.hz_per_count(frequency)
            body.registers.put(frequency, round(body.motor.frequency / count))
        body.show("frequency_reference", shown)
        body.show("speed_reference", shown * 120 / self._reference.poles)
        show_drivecom(body, seen)

    def _appearance(self) -> Appearance:
        body = self._body
        motor = body.motor
        going = motor.energised and self._powered()
        wanted = self._wanted()
        bits = self._machine.state.value
        if self._command.is_io:
            bits = io_status(fault=body.fault is not None, running=body.turning)
        return Appearance(
            state_bits=bits,
            channels=self._channels.now,
            going=going,
            reached=going and abs(motor.frequency - self._target_hz) < DRIVECOM_REACHED_HZ,
            wanted=wanted,
            outside=self._reference.outside(wanted),
            stop=self._stopping(),
            disabled=self._machine.state is DrivecomState.DISABLED and not self._command.is_io,
            second_ramp=self._second_ramp(),
        )
