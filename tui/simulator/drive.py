"""Simulated drive: its words, state chart, motor, faults and line timeout, put together.

Several threads may request and step a drive; each public method holds its lock.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import lru_cache, partial
from random import Random

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter

from .body import ActiveFault, Body
from .charts.altivar21 import Altivar21Chart
from .charts.families import CHARTS
from .plant.fault_history import fault_raw
from .plant.first_values import first_values, model_words
from .plant.memory import SettingsMemory
from .plant.monitoring import show_motor
from .plant.motor import (
    Load,
    MotorDemand,
    MotorState,
    RatingPlate,
    Shaft,
    Stop,
    Wanderer,
    rating_of,
    step,
)
from .plant.terminals import BY_KIND, COMPACT, Terminals
from .plant.watch import SilenceWatch
from .registers import Registers, register_map, typed_raw
from .rules import traits_of
from .server.access import DriveWords
from .server.answering import Answering, Station
from .server.functions import Server, identity_of
from .spec import DriveSpec, LineTiming
from .tripping import Tripping

WATCH_STARTERS = frozenset({"command_word", "command_frequency", "command_speed"})
"""Quantities whose write starts the timeout of a drive that waits for a first command."""


@lru_cache(maxsize=32)  # thirty drives of one kind on a line begin alike
def first_words(
    profile: Profile, rating: RatingPlate
) -> tuple[Mapping[int, int], Mapping[int, int]]:
    """Return the words of a drive set up for its line, and of one at its factory settings."""
    words = register_map(profile).words
    set_up = first_values(profile, rating, traits_of(profile).first_values)
    return words(set_up), words(first_values(profile, rating, {}))


class SimulatedDrive:
    """A drive of one profile: its registers, its state chart, its motor and its faults."""

    def __init__(
        self,
        profile: Profile,
        spec: DriveSpec,
        *,
        timing: LineTiming | None = None,
        seed: int = 0,
    ) -> None:
        self._lock = threading.RLock()
        self.profile = profile
        self.spec = spec
        self.busy = False
        """While true, the drive refuses writes, as during another task of its own."""
        traits = traits_of(profile)
        identification = profile.data.identification
        identity = identity_of(identification, spec.name, spec.identity)
        rating = rating_of(identity.get(1, b"").decode("ascii", "replace"))
        self.registers = Registers(profile, *first_words(profile, rating))
        self.station = Station(profile, self.registers, spec.address)
        random = Random(f"{seed}/{spec.address}")
        hours = 900.0 + random.randrange(2000)
        self._body = Body(
            profile,
            traits,
            self.registers,
            rating,
            terminals=Terminals(COMPACT if traits.access_levels else BY_KIND[traits.kind]),
            motor=MotorState(run_hours=hours, on_hours=1.6 * hours, energy=hours * rating.power),
        )
        self.terminals = self._body.terminals
        self.conditions = self._body.conditions
        """Its supply, load, wire and planted defects; a change acts at the next step."""
        self._chart = CHARTS[traits.kind](self._body)
        self.keypad = {
            name: partial(self._press, press) for name, press in self._chart.keys.items()
        }
        """Keys of its keypad by name; each returns the result as text, or raises SimulatorError."""
        self._watch = SilenceWatch(self._body)
        self._tripping = Tripping(self._body, self._chart, self._watch)
        self._memory = SettingsMemory(self._body)
        self._load = Load(random)
        self._wanderer = Wanderer(random)
        self._starters = {way.parameter for way in profile.data.references} | {
            chart.command for chart in profile.data.charts
        }
        functions = {f.code: f for f in profile.data.functions}
        words = DriveWords(
            profile,
            traits,
            self.registers,
            blocked=self._blocked,
            written=self._written,
            unlimited=lambda: self._body.unlimited,
        )
        self.server = Server(words, functions, traits.refusals, identification, identity)
        self.line_side = Answering(
            self._body, self.station, self.server, heard=self._watch.heard, lock=self._lock
        )
        self._set_up(timing or LineTiming())
        self.power_on()

    # Setting up

    def _set_up(self, timing: LineTiming) -> None:
        self.station.settle(timing)
        for code, raw in self.spec.sets.items():
            self.set(code, raw)
        self.station.settle_address()
        for code, raw in model_words(self.profile, self.server.identity).items():
            self.registers.put(self.profile[code], raw)
        self.registers.protect(self.profile.find(code) for code in self.spec.protects)

    def set(self, code: str, raw: int) -> None:
        """Put a raw value in force as if it had always been set; a monitored value then stays
        constant.

        `code` is a parameter's code, number or address, `%MW..` or `IPC1`..`IPC4`. Raises
        UnknownParameter, or SimulatorError if the value does not fit.
        """
        with self._lock:
            if not self.registers.named(code) and self.line_side.put_card_word(code, raw):
                return
            parameter = self.profile.find(code)
            self.registers.settle(parameter, typed_raw(parameter, raw))
            if parameter.access == "r":
                self.registers.hold(parameter)

    def raw(self, code: str) -> int:
        """Return the present raw value of a parameter; raises UnknownParameter."""
        with self._lock:
            return self.registers.present(self.profile.find(code))

    # Supply

    def power_on(self) -> None:
        """Switch the supply on: saved settings take effect, commands are discarded."""
        with self._lock:
            body = self._body
            body.conditions.powered = True
            self.registers.restore()
            body.line_orders.forget()
            body.saving = 0.0
            body.fallback = None
            body.earlier_hz = None
            if body.fault is not None and not body.fault.persists:
                body.fault = None
            self.server.counters.reset()
            self._memory.power_up()
            self._watch.power_up()
            self._chart.power_up()
            if body.fault is not None:
                self._chart.trip(Stop.FREEWHEEL)
            body.motor = replace(body.motor, mains=self._mains())
            if self.spec.run_hz and body.fault is None:
                self.run(self.spec.run_hz, wander=self.spec.wander)
            self._refresh()

    def power_off(self) -> None:
        """Switch the supply off: the drive is silent and the motor coasts."""
        with self._lock:
            self.conditions.powered = False

    def power_cycle(self) -> None:
        """Switch the drive's supply off and on."""
        self.power_off()
        self.power_on()

    # Events

    @property
    def motor(self) -> MotorState:
        """State of the motor, in physical units."""
        return self._body.motor

    @property
    def fault(self) -> ActiveFault | None:
        """The present fault, if any."""
        return self._body.fault

    def run(self, hz: float, *, wander: bool = False) -> None:
        """Run the motor at a reference in Hz without a command on the line.

        If the terminals command, its run input is closed. If the line commands, it runs as if by an
        earlier command of another master. With `wander`, the reference changes at intervals, until
        the line gives one.
        """
        with self._lock:
            if self._body.fault is None:
                self._wanderer.begin(hz if wander else None)
                self._chart.run(hz)
                self._refresh()

    def halt(self) -> None:
        """Open the run inputs, and end the command of another master."""
        with self._lock:
            self._chart.halt()
            self._wanderer.begin(None)
            self._refresh()

    def set_input(self, name: str, text: str) -> str:
        """Set an input by name to a typed value: `1`, `0`, `5V`, `12mA`, `50%`.

        Returns the resulting text. The value stays through trips, resets and power-downs. Raises
        SimulatorError for an input that the drive lacks, or a value out of range.
        """
        with self._lock:
            reported = self._body.terminals.set(name, text)
            self._wanderer.begin(None)
            if self._body.powered:
                self._chart.follow()
                self._refresh()
            return reported

    def _press(self, press: Callable[[], str]) -> str:
        with self._lock:
            reported = press()
            self._refresh()
            return reported

    def provoke(self, fault: str | int, *, persists: bool = False) -> None:
        """Trip the drive with a fault given by code or raw value.

        With `persists`, its cause stays, and resets fail until `clear_cause`. Raises SimulatorError
        for a code that the profile does not have.
        """
        with self._lock:
            raw = fault_raw(self.profile, fault)
            self._tripping.trip(raw, Stop.FREEWHEEL, persists=persists)
            self._refresh()

    def clear_cause(self) -> None:
        """Remove the cause of a fault, so that a reset clears it."""
        with self._lock:
            if self._body.fault is not None:
                self._body.fault = replace(self._body.fault, persists=False)
                self._refresh()

    def alarm(self, word: int) -> None:
        """Set the bits of the family's alarm word, 0 for none."""
        with self._lock:
            self._body.alarms = word
            self._refresh()

    # Time

    def step(self, dt: float) -> None:
        """Let `dt` seconds pass."""
        with self._lock:
            body = self._body
            body.seconds += dt
            if not body.powered:
                body.motor = step(body.motor, body.rating, MotorDemand(), self._shaft(), 0.0, dt)
                return
            body.saving = max(0.0, body.saving - dt)
            if (hz := self._wanderer.step(dt)) is not None:
                self._chart.refer(hz)
            self._chart.follow()
            self._load.step(dt)
            self._tripping.step(dt)
            order = self._chart.order()
            body.motor = step(body.motor, body.rating, order, self._shaft(), self._mains(), dt)
            if isinstance(self._chart, Altivar21Chart) and self._chart.energy_reset:
                body.motor = replace(body.motor, energy=0.0)
            self._show()

    def _mains(self) -> float:
        volts = self.conditions.volts
        return self._body.rating.voltage * self._load.mains if volts is None else volts

    def _shaft(self) -> Shaft:
        given = self.conditions
        load = self._load.torque if given.load is None else given.load
        return Shaft(load, given.inertia, given.jammed)

    def _refresh(self) -> None:
        """Update the motor and the shown words without advancing the time."""
        body = self._body
        if body.powered:
            self._tripping.look()
        order = self._chart.order()
        mains = self._mains() if body.powered else 0.0
        body.motor = step(body.motor, body.rating, order, self._shaft(), mains, 0.0)
        self._show()

    def _show(self) -> None:
        self._tripping.show()
        self._chart.show()
        frozen = self._body.traits.kind == "altivar21" and self._body.fault is not None
        if not frozen:
            show_motor(self._body)

    # The line

    @property
    def address(self) -> int:
        """The present address of the drive."""
        return self.station.address

    def _blocked(self, parameter: Parameter) -> bool:
        if self.busy or self._body.saving > 0:
            return True
        return parameter.access == "rw-stopped" and self._chart.running

    def _written(self, parameter: Parameter) -> None:
        if parameter.quantity in WATCH_STARTERS or parameter.code in self._starters:
            self._body.line_orders.note(parameter)
        self._memory.written(parameter)
        self._chart.written(parameter)
        self._refresh()
