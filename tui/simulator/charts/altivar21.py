"""Commands and status words of the Altivar 21, from the line and its terminals.

Source: ATV21 Modbus manual 8.4 to 8.8. Stop, coast and reset follow the command word only while
the line has the command; the emergency stop always does.

Inputs F, R and RES, VIA and VIB: ATV21 Modbus manual 6.2 (functions 38 and 48 of an input) and 8.8.
Without another function F runs forward, R runs the other way, RES resets a fault; that is the
wiring most drives have.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from tui.drive.profile.schema import Parameter, Quantity

from ..body import Body, Fallback
from ..plant.fault_history import OwnFault
from ..plant.motor import MotorDemand, Stop
from .altivar21_words import (
    ANALOG_HZ,
    KEYPAD_COMMAND,
    KEYPAD_REFERENCE,
    LOCAL_STATUS,
    Altivar21Keypad,
    outputs,
    show_altivar21_words,
    take_effect,
)

INPUT_FUNCTIONS = {"F": "F111", "R": "F112", "RES": "F113"}
FORCED_LOCAL, SECOND_REFERENCE, PRESET_INPUT = 48, 38, 6
"""Functions of an input: terminals instead of the line, F207 instead of FMOD, preset speed 1."""
VIB_REFERENCE = 2


class Altivar21Inputs:
    """The inputs of one drive, with the functions that its settings give them."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._reset_before = False

    def run(self, hz: float) -> None:
        """Close F, or R for the other direction, at a reference in Hz at VIA."""
        self._body.terminals.close("R" if hz < 0 else "F")
        self.refer(hz)

    def refer(self, hz: float) -> None:
        """Change the reference at VIA, in Hz."""
        self._body.terminals.apply("VIA", abs(hz) / ANALOG_HZ)

    def halt(self) -> None:
        """Open F and R."""
        for name in ("F", "R"):
            self._body.terminals.close(name, closed=False)

    def resets(self) -> bool:
        """Return True if RES has closed since the last call."""
        closed = self._closed("RES")
        pressed = closed and not self._reset_before
        self._reset_before = closed
        return pressed

    def _closed(self, name: str) -> bool:
        """Return True if an input is closed and has only its own function."""
        return self._body.terminals.closed(name) and not self._function(name)

    def _function(self, name: str) -> int:
        raw = self._body.setting(INPUT_FUNCTIONS[name], 0)
        return raw if raw in (FORCED_LOCAL, SECOND_REFERENCE, PRESET_INPUT) else 0

    def switched(self, function: int) -> bool:
        """Return True if an input with this function is closed."""
        closed = self._body.terminals.closed
        return any(closed(n) and self._function(n) == function for n in INPUT_FUNCTIONS)

    @property
    def run_ordered(self) -> bool:
        """True if F or R commands a run."""
        return self._closed("F") or self._closed("R")

    @property
    def reverse(self) -> bool:
        """True if the inputs command reverse."""
        return self._closed("R") and not self._closed("F")

    @property
    def hz(self) -> float:
        """The analog reference in Hz."""
        name = "VIB" if self._body.setting("FMOD", 1) == VIB_REFERENCE else "VIA"
        return ANALOG_HZ * self._body.terminals.level(name)


(PRESETS, RAMP_2, INJECTION, REVERSE, RUN, COAST, EMERGENCY, RESET, OWN_REFERENCE, OWN_COMMAND) = (
    0x0007,
    1 << 6,
    1 << 7,
    1 << 9,
    1 << 10,
    1 << 11,
    1 << 12,
    1 << 13,
    1 << 14,
    1 << 15,
)
ENERGY_RESET, STALL_2 = 1 << 1, 1 << 12
SERIAL_COMMAND, SERIAL_REFERENCE, PRESET_REFERENCE, ANALOG_REFERENCE = 2, 4, 255, 1
EMERGENCY_FAULT = 17
ATV21_REACHED_HZ = 0.05
PRESET_QUANTITIES: tuple[Quantity, ...] = (
    "preset_speed_1",
    "preset_speed_2",
    "preset_speed_3",
    "preset_speed_4",
    "preset_speed_5",
    "preset_speed_6",
    "preset_speed_7",
)
BEFORE_FAULT = {"FE00": "FD00", "FE01": "FD01", "FE42": "FD42", "FE49": "FD49"} | {
    "FE06": "FD06",
    "FE07": "FD07",
}
"""Words that keep the value of their twin at the trip while a fault is present."""


@dataclass(frozen=True, slots=True)
class Sources:
    """Present sources of command and reference."""

    command: bool
    reference: bool
    preset: int


class Altivar21Chart:
    """State chart of one Altivar 21: its commands and status."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._stop = Stop.RAMP
        self._last = 0
        self._latched = False
        """True if the emergency stop is in force; a fault reset ends it."""
        self._target_hz = 0.0
        self._inputs = Altivar21Inputs(body)
        self._keypad = Altivar21Keypad()

    def power_up(self) -> None:
        """Start without commands of the line and without a latched stop."""
        self._last = 0
        self._latched = False
        self._stop = Stop.RAMP
        self._keypad.give()

    @property
    def keys(self) -> Mapping[str, Callable[[], str]]:
        """Keys of the keypad."""
        return {
            "LOC": lambda: self._keypad.take(runs=self._run_ordered(), hz=self._wanted()),
            "REM": self._keypad.give,
            "RUN": self._keypad.run,
            "STOP": self._press_stop,
        }

    def _press_stop(self) -> str:
        """Stop in local; in remote, pressed twice, it is an emergency stop."""
        if self._keypad.local:
            return self._keypad.stop()
        self._latched = True
        return "STOP twice: emergency stop"

    def run(self, hz: float) -> None:
        """Run by F, or R for the other direction, at a reference in Hz at VIA."""
        self._inputs.run(hz)

    def refer(self, hz: float) -> None:
        """Change the reference at VIA, in Hz."""
        self._inputs.refer(hz)

    def halt(self) -> None:
        """Open F and R."""
        self._inputs.halt()

    def follow(self) -> None:
        """Read the inputs: RES resets a fault."""
        if self._inputs.resets():
            self.reset_fault()

    def written(self, parameter: Parameter) -> None:
        """Process a word that the line wrote."""
        if parameter is not self._body.parameter("command_word"):
            return
        word = self._word
        rising = word & ~self._last
        self._last = word
        if rising & EMERGENCY:
            self._latched = True
        if rising & RESET and self._sources().command:
            self.reset_fault()

    def raises(self) -> OwnFault | None:
        """Return the fault of an emergency stop, whose reaction F603 sets as for communication
        loss."""
        return OwnFault(EMERGENCY_FAULT, None) if self._latched else None

    @property
    def _word(self) -> int:
        return self._body.raw("command_word") & 0xFFFF

    def _sources(self) -> Sources:
        word = self._word
        if self._keypad.local or self._inputs.switched(FORCED_LOCAL):
            return Sources(command=False, reference=False, preset=0)
        command = bool(word & OWN_COMMAND) or self._body.setting("CMOD", 0) == SERIAL_COMMAND
        chosen = self._body.setting("FMOD", 1)
        if self._inputs.switched(SECOND_REFERENCE):
            chosen = self._body.setting("F207", ANALOG_REFERENCE)
        reference = bool(word & OWN_REFERENCE) or chosen == SERIAL_REFERENCE
        wired = 1 if self._inputs.switched(PRESET_INPUT) else 0
        return Sources(command, reference, word & PRESETS if command else wired)

    def trip(self, stop: Stop) -> None:
        """Stop the motor as the fault demands, and show the fault."""
        self._stop = stop
        self._keypad.runs = False

    def reset_fault(self) -> None:
        """Clear the fault if its cause is removed; words in RAM return to their first values.

        The priority bits are cleared with them: closed terminals command until the line takes
        control again. Settings that wait for a reset take effect; without a fault, only at
        standstill.
        """
        fault = self._body.fault
        if fault is None and not self._body.turning:
            take_effect(self._body)
        if fault is not None and not fault.persists:
            take_effect(self._body)
            self._body.fault = None
            self._body.registers.restore(volatile_only=True)
            self._body.line_orders.forget()
            self._last = 0
            self._latched = False
            self._stop = Stop.RAMP

    @property
    def running(self) -> bool:
        """True if words that cannot be changed while running are locked."""
        return self._body.turning

    # Demand on the motor

    def _run_ordered(self) -> bool:
        body = self._body
        if body.fault is not None or body.fallback is Fallback.STOP:
            return False
        if self._keypad.local:
            return self._keypad.runs
        if self._sources().command:
            return bool(self._word & RUN) and not self._word & COAST
        return self._inputs.run_ordered

    def _wanted(self) -> float:
        """Return the reference in Hz, signed by direction."""
        body = self._body
        if self._keypad.local:
            return self._keypad.hz
        sources = self._sources()
        hz = self._inputs.hz
        if sources.preset:
            hz = body.value(PRESET_QUANTITIES[sources.preset - 1], 5.0 * sources.preset)
        elif sources.reference:
            hz = self._line_reference()
        reverse = bool(self._word & REVERSE) if sources.command else self._inputs.reverse
        return body.directed(-hz if reverse else hz)

    def _line_reference(self) -> float:
        body = self._body
        frequency, speed = body.parameter("command_frequency"), body.parameter("command_speed")
        if speed is not None and body.line_orders.given_at(speed) > body.line_orders.given_at(
            frequency
        ):
            return body.engineering(speed) * self.poles / 120
        return body.engineering(frequency) if frequency is not None else 0.0

    @property
    def poles(self) -> int:
        """Return the number of poles of the motor."""
        raw = round(self._body.value("motor_poles", self._body.rating.poles))
        return raw if raw >= 2 else self._body.rating.poles

    def _cut(self, hz: float) -> float:
        body = self._body
        high = min(body.value("high_speed", 1e9) or 1e9, body.value("max_frequency", 1e9) or 1e9)
        size = min(max(abs(hz), body.value("low_speed", 0.0)), high)
        return -size if hz < 0 else size

    def order(self) -> MotorDemand:
        """Return the present demand on the motor."""
        body = self._body
        remote = self._sources().command
        second = remote and bool(self._word & RAMP_2)
        up, down = body.rates(self._stop if body.fault else Stop.RAMP, second)
        base = MotorDemand(acceleration=up, deceleration=down)
        moving = body.motor.frequency != 0
        if body.fault is not None:
            return self._stopping_order(base, moving)
        if remote and self._word & INJECTION:
            return replace(base, injection=True)
        if self._run_ordered():
            self._target_hz = self._cut(self._wanted())
            return replace(base, energised=True, target=self._target_hz)
        self._target_hz = 0.0
        coast = remote and self._word & COAST
        return replace(base, energised=moving and not coast, target=0.0)

    def _stopping_order(self, base: MotorDemand, moving: bool) -> MotorDemand:
        if self._stop is Stop.INJECTION:
            return replace(base, injection=bool(self._body.motor.rotor))
        slow = self._stop in (Stop.RAMP, Stop.FAST)
        return replace(base, energised=moving and slow, target=0.0)

    # Words for the line

    def show(self) -> None:
        """Put the status words of the present state into their registers."""
        body = self._body
        sources = self._sources()
        motor = body.motor
        if body.fault is None:
            show_altivar21_words(body)
            for before, now in BEFORE_FAULT.items():
                if twin := body.registers.named(now):
                    body.show_code(before, body.registers.present(twin))
        alarms = body.alarms | (1 << 2 if motor.motor_thermal >= 100 else 0)
        body.show_raw("alarm_word", alarms)
        body.show_raw("status_word", self._status(alarms))
        body.show_raw("status_word_2", self._status_2(sources))
        reached = motor.energised and abs(motor.frequency - self._target_hz) < ATV21_REACHED_HZ
        body.show_raw("status_word_3", (1 << 12 | 1 << 13) if reached else 0)
        command = KEYPAD_COMMAND if self._keypad.local else 0
        body.show_code("FE45", SERIAL_COMMAND if sources.command else command)
        body.show_code("FE46", self._reference_source(sources))
        body.show_code("FD06", body.terminals.bits())
        body.show_code("FD07", outputs(body))
        body.show("frequency_reference", abs(self._wanted()))
        body.show("ramp_output", abs(motor.frequency))
        body.show("output_frequency", abs(motor.frequency))

    def _reference_source(self, sources: Sources) -> int:
        if self._keypad.local:
            return KEYPAD_REFERENCE
        if sources.preset:
            return PRESET_REFERENCE
        return SERIAL_REFERENCE if sources.reference else ANALOG_REFERENCE

    def _status(self, alarms: int) -> int:
        body = self._body
        motor = body.motor
        remote = self._sources().command
        fault = body.fault is not None
        coast = remote and bool(self._word & COAST)
        ready = not fault and motor.mains > 0
        run = self._run_ordered() or motor.frequency != 0
        requested = bool(self._word & REVERSE) if remote else self._inputs.reverse
        reverse = motor.frequency < 0 or requested
        marks = (
            (fault, 0),
            (fault, 1),
            (alarms != 0, 2),
            (motor.mains <= 0, 3),
            (remote and bool(self._word & 1 << 4), 4),
            (remote and bool(self._word & 1 << 5), 5),
            (remote and bool(self._word & RAMP_2), 6),
            (motor.braking, 7),
            (reverse, 9),
            (run, 10),
            (coast, 11),
            (self._latched, 12),
            (ready and run and not coast, 13),
            (ready, 14),
            (self._keypad.local, LOCAL_STATUS),
        )
        return sum(1 << bit for given, bit in marks if given)

    def _status_2(self, sources: Sources) -> int:
        word = self._body.raw("command_word_2") & 0xFFFF
        stall = word & STALL_2 if self._word & OWN_COMMAND else 0
        ramp = 1 << 8 if sources.command and self._word & RAMP_2 else 0
        return (word & ENERGY_RESET) | stall | ramp

    @property
    def energy_reset(self) -> bool:
        """True if the line holds the energy counters at 0."""
        return bool(self._body.raw("command_word_2") & ENERGY_RESET)
