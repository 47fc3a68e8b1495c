"""A simulated drive: its words, state chart, motor, faults and watch, put together.

A drive may be asked and stepped from several threads; each public method holds its lock.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import replace
from random import Random
from typing import Protocol

from tui.drive.profile import Profile
from tui.drive.schema import Function, LinkSetting, Parameter
from tui.drive.values import type_range

from .access import DriveWords
from .body import ActiveFault, Body
from .cards import CardWords, card_word, card_words
from .chart_altivar21 import EMERGENCY_FAULT, Altivar21Chart
from .chart_drivecom import DrivecomChart
from .chart_leroy import LeroySomerChart
from .errors import SimulatorError
from .first_values import first_values
from .functions import Server, identity_of
from .load import Load, Wanderer
from .memory import Memory
from .monitoring import show_motor
from .motor import MotorState, Order, Stop, rating_of, step
from .registers import Registers
from .rules import Kind, traits_of
from .spec import DriveSpec, LineTiming
from .watch import Consequence, Watch

DELAY_UNIT = 0.001
REFERENCES = frozenset({"command_word", "command_frequency", "command_speed"})
"""Orders that start the watch where it needs one."""


class Chart(Protocol):
    """What a family's state chart does for its drive."""

    def power_up(self) -> None: ...
    def terminal_order(self) -> None: ...
    def written(self, parameter: Parameter, /) -> None: ...
    def trip(self, stop: Stop, /) -> None: ...
    def reset_fault(self) -> None: ...
    def order(self) -> Order: ...
    def show(self) -> None: ...
    @property
    def running(self) -> bool: ...


CHARTS: Mapping[Kind, Callable[[Body], Chart]] = {
    "drivecom": DrivecomChart,
    "altivar21": Altivar21Chart,
    "leroy-somer": LeroySomerChart,
}


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
        """While true, the drive refuses writes as it does when another task has hold of it."""
        self._powered = True
        traits = traits_of(profile)
        identification = profile.data.identification
        identity = identity_of(identification, spec.name, spec.identity)
        rating = rating_of(identity.get(1, b"").decode("ascii", "replace"))
        initial = first_values(profile, rating, traits.first_values)
        self.registers = Registers(profile, initial)
        random = Random(f"{seed}/{spec.address}")
        hours = 900.0 + random.randrange(2000)
        self._body = Body(
            profile,
            traits,
            self.registers,
            rating,
            motor=MotorState(run_hours=hours, on_hours=1.6 * hours, energy=hours * rating.power),
        )
        self._chart = CHARTS[traits.kind](self._body)
        self._watch = Watch(self._body)
        self._memory = Memory(self._body)
        self._load = Load(random)
        self._wanderer = Wanderer(random)
        functions = {f.code: f for f in profile.data.functions}
        words = DriveWords(
            profile, traits, self.registers, blocked=self._blocked, written=self._written
        )
        self.server = Server(words, functions, traits.refusals, identification, identity)
        self._cards: dict[str, tuple[CardWords, Server]] = {}
        self._add_cards(functions)
        self._set_up(timing or LineTiming())
        self.power_on()

    # Setting up

    def _add_cards(self, functions: Mapping[int, Function]) -> None:
        known = {code: f for code, f in functions.items() if code in (3, 6, 16, 23)}
        for server in self.profile.data.addresses.servers:
            words = card_words(server.parameter, self._body.traits.refusals)
            if words is not None:
                own = Server(words, known, self._body.traits.refusals)
                self._cards[server.parameter.casefold()] = (words, own)

    def _set_up(self, timing: LineTiming) -> None:
        self._line_settings: list[tuple[LinkSetting, Parameter]] = []
        for setting in self.profile.data.link.settings:
            parameter = self.profile[setting.parameter]
            fitting = [c.raw for c in setting.choices if _fits(c, timing)]
            first = all(setting.role != known.role for known, _ in self._line_settings)
            if first and setting.role in ("baud", "format", "parity") and fitting:
                self.registers.settle(parameter, fitting[0])
                self._line_settings.append((setting, parameter))
        for code, raw in self.spec.sets.items():
            self.set(code, raw)
        if address := self._address_parameter():
            self.registers.settle(address, self.spec.address)
        self.registers.protect(self.profile.find(code) for code in self.spec.protects)

    def _address_parameter(self) -> Parameter | None:
        for setting in self.profile.data.link.settings:
            if setting.role == "address":
                return self.profile[setting.parameter]
        return self.profile.quantity("line_address")

    def set(self, code: str, raw: int) -> None:
        """Put a raw value in force, as if it had always been there; a monitored one stays.

        `code` is a parameter's code, number or address, `%MW..` or `IPC1`..`IPC4`. Raises
        UnknownParameter, or SimulatorError where the value does not fit.
        """
        with self._lock:
            card = card_word(code)
            if card is not None and card[0] in self._cards and not self.registers.named(code):
                self._cards[card[0]][0].words[card[1]] = raw & 0xFFFF
                return
            parameter = self.profile.find(code)
            self.registers.settle(parameter, _typed(parameter, raw))
            if parameter.access == "r":
                self.registers.hold(parameter)

    def raw(self, code: str) -> int:
        """The present raw value of a parameter; raises UnknownParameter."""
        with self._lock:
            return self.registers.present(self.profile.find(code))

    # Supply

    def power_on(self) -> None:
        """Switch the supply on: saved settings come into force, orders are forgotten."""
        with self._lock:
            self._powered = True
            body = self._body
            self.registers.restore()
            body.forget_orders()
            body.saving = 0.0
            body.fallback = None
            if body.fault is not None and not body.fault.persists:
                body.fault = None
            self.server.counters.reset()
            self._memory.power_up()
            self._watch.power_up()
            self._chart.power_up()
            if body.fault is not None:
                self._chart.trip(Stop.FREEWHEEL)
            body.terminal_hz = None
            body.motor = replace(body.motor, mains=self._mains())
            if self.spec.run_hz and body.fault is None:
                self.run(self.spec.run_hz, wander=self.spec.wander)
            self._refresh()

    def power_off(self) -> None:
        """Switch the supply off: the drive is silent and the motor coasts."""
        with self._lock:
            self._powered = False

    def power_cycle(self) -> None:
        """Switch the drive's supply off and on."""
        self.power_off()
        self.power_on()

    # What happens to the drive

    @property
    def motor(self) -> MotorState:
        """What the motor does now, in physical units."""
        return self._body.motor

    @property
    def fault(self) -> ActiveFault | None:
        """The fault the drive has, if any."""
        return self._body.fault

    def run(self, hz: float, *, wander: bool = False) -> None:
        """Run the motor as if an order came from the terminals, at a reference in Hz.

        With `wander` the reference changes now and then. The line takes over with its next
        command where the drive's channels let it.
        """
        with self._lock:
            if self._body.fault is None:
                self._body.terminal_hz = hz
                self._wanderer.begin(hz if wander else None)
                self._chart.terminal_order()
                self._refresh()

    def halt(self) -> None:
        """End the run order at the terminals."""
        with self._lock:
            self._body.terminal_hz = None
            self._wanderer.begin(None)
            self._refresh()

    def provoke(self, fault: str | int, *, persists: bool = False) -> None:
        """Trip the drive with a fault given by code or raw value.

        With `persists` its cause stays, and no reset helps, until `clear_cause`. Raises
        SimulatorError for a code that the profile does not know.
        """
        with self._lock:
            self._trip(self._fault_raw(fault), Stop.FREEWHEEL, persists)
            self._refresh()

    def _fault_raw(self, fault: str | int) -> int:
        if isinstance(fault, int):
            return fault
        wanted = fault.strip()
        for known in self.profile.data.faults.codes:
            if known.code.casefold() == wanted.casefold():
                return known.raw
        if wanted.isdecimal():
            return int(wanted)
        codes = ", ".join(f.code for f in self.profile.data.faults.codes[:8]) or "none"
        raise SimulatorError(f"{self.profile.name} has no fault {fault!r}. Known: {codes} ...")

    def clear_cause(self) -> None:
        """Take a fault's cause away, so that a reset helps."""
        with self._lock:
            if self._body.fault is not None:
                self._body.fault = replace(self._body.fault, persists=False)
                self._refresh()

    def alarm(self, word: int) -> None:
        """Show alarms: the bits of the family's alarm word, 0 for none."""
        with self._lock:
            self._body.alarms = word
            self._refresh()

    def _trip(self, raw: int, stop: Stop, persists: bool = False) -> None:
        body = self._body
        if body.fault is not None:
            return
        known = self.profile.fault(raw)
        self._remember_fault(raw)
        body.fault = ActiveFault(raw, known.code if known else str(raw), persists)
        body.terminal_hz = None
        self._wanderer.begin(None)
        self._chart.trip(stop)

    def _remember_fault(self, raw: int) -> None:
        """Show the fault, and move the history on by it, or by the one before it."""
        faults = self.profile.data.faults
        present = self.registers.named(faults.parameter) if faults.parameter else None
        older = raw
        if self._body.traits.history_before and present is not None:
            older = self.registers.present(present)
        if present is not None:
            self.registers.put(present, raw)
        if older == faults.none:
            return
        places = [self.profile[code] for code in faults.history]
        kept = [older, *(self.registers.present(p) for p in places)]
        for place, value in zip(places, kept, strict=False):
            self.registers.put(place, value)

    # Time

    def step(self, dt: float) -> None:
        """Let `dt` seconds pass."""
        with self._lock:
            body = self._body
            if not self._powered:
                body.motor = step(body.motor, body.rating, Order(), 0.0, 0.0, dt)
                return
            body.saving = max(0.0, body.saving - dt)
            if consequence := self._watch.step(dt):
                self._suffer(consequence)
            if (hz := self._wanderer.step(dt)) is not None and body.terminal_hz is not None:
                body.terminal_hz = hz
            self._load.step(dt)
            if isinstance(self._chart, Altivar21Chart) and self._chart.emergency:
                self._trip(EMERGENCY_FAULT, self._watch.consequence().trip or Stop.FREEWHEEL)
            order = self._chart.order()
            load = self._load.torque
            body.motor = step(body.motor, body.rating, order, load, self._mains(), dt)
            if isinstance(self._chart, Altivar21Chart) and self._chart.energy_reset:
                body.motor = replace(body.motor, energy=0.0)
            self._show()

    def _mains(self) -> float:
        return self._body.rating.voltage * self._load.mains

    def _suffer(self, consequence: Consequence) -> None:
        if consequence.trip is not None:
            self._trip(self._watch.fault or 0, consequence.trip)
        else:
            self._body.fallback = consequence.fallback

    def _refresh(self) -> None:
        """Bring the shown words up to date without letting time pass."""
        self._chart.order()
        self._show()

    def _show(self) -> None:
        faults = self.profile.data.faults
        if faults.parameter and not faults.shows_last:
            fault = self._body.fault
            self._body.show_code(faults.parameter, fault.raw if fault else faults.none)
        self._chart.show()
        frozen = self._body.traits.kind == "altivar21" and self._body.fault is not None
        if not frozen:
            show_motor(self._body)

    # The line

    @property
    def address(self) -> int:
        """The address the drive answers at now."""
        parameter = self._address_parameter()
        return self.registers.in_force(parameter) if parameter else self.spec.address

    @property
    def turnaround(self) -> float:
        """Time from the end of a request to the start of the reply, in s."""
        for setting in self.profile.data.link.settings:
            if setting.role == "delay":
                delay = self.registers.in_force(self.profile[setting.parameter])
                return max(delay * DELAY_UNIT, 0.0015)
        return float(self.profile.data.link.turnaround_ms) / 1000

    def hears(self, timing: LineTiming) -> bool:
        """Whether the drive's baud and format in force are those of the line."""
        for setting, parameter in self._line_settings:
            raw = self.registers.in_force(parameter)
            choice = next((c for c in setting.choices if c.raw == raw), None)
            if choice is not None and not _fits(choice, timing):
                return False
        return True

    def answers_at(self, address: int) -> bool:
        """Whether one of the drive's servers has this address and replies there."""
        return self._powered and self._server_at(address) is not None

    def _server_at(self, address: int) -> Server | None:
        if address == 0:
            return None
        addresses = self.profile.data.addresses
        if address == self.address and not (addresses.zero_digit_is_group and "0" in str(address)):
            return self.server
        for code, (_, server) in self._cards.items():
            if self._body.setting(code, 0) == address:
                return server
        return None

    def is_called(self, address: int) -> bool:
        """Whether a broadcast or group address means this drive too."""
        addresses = self.profile.data.addresses
        if not self._powered or not self.address:
            return False
        if address == addresses.broadcast:
            return True
        return addresses.zero_digit_is_group and in_group(self.address, address)

    def answer(self, address: int, pdu: bytes) -> bytes | None:
        """The reply of the server at an address; None where it stays silent."""
        with self._lock:
            server = self._server_at(address) if self._powered else None
            if server is None:
                return None
            if server is self.server:
                server.counters.count_frame()
                self._watch.heard()
                self._show_counters()
            reply = server.answer(pdu)
            self._show_counters()
            return reply

    def obey(self, pdu: bytes) -> None:
        """Do what a broadcast or a call to a group says, without a word."""
        with self._lock:
            function = self.profile.function(pdu[0]) if pdu else None
            if self._powered and function is not None and function.broadcast:
                self.server.answer(pdu)

    def count_checksum_error(self) -> None:
        """A frame to this drive came with a wrong checksum."""
        with self._lock:
            self.server.counters.count_checksum_error()
            self._show_counters()

    def _show_counters(self) -> None:
        self._body.show_code("M1CT", self.server.counters.frames)
        self._body.show_code("M1EC", self.server.counters.checksum_errors)

    def _blocked(self, parameter: Parameter) -> bool:
        if self.busy or self._body.saving > 0:
            return True
        return parameter.access == "rw-stopped" and self._chart.running

    def _written(self, parameter: Parameter) -> None:
        if parameter.quantity in REFERENCES:
            self._body.note_order(parameter)
        self._memory.written(parameter)
        self._chart.written(parameter)
        self._refresh()


def in_group(own: int, called: int) -> bool:
    """Whether a group address calls an address: each zero digit stands for any digit but 0."""
    mine, theirs = str(own), str(called)
    if called == 0 or "0" not in theirs or "0" in mine or len(mine) != len(theirs):
        return False
    return all(t in ("0", m) for m, t in zip(mine, theirs, strict=True))


def _fits(choice: object, timing: LineTiming) -> bool:
    """Whether a choice of a link setting agrees with the line, as far as it says anything."""
    wanted = {"baud": timing.baud, "format": timing.format, "parity": timing.format[1]}
    return all(getattr(choice, k, None) in (None, v) for k, v in wanted.items())


def _typed(parameter: Parameter, raw: int) -> int:
    """A raw value as the parameter's type has it, whether given signed or as a word."""
    low, high = type_range(parameter)
    span = high - low + 1
    if not -span // 2 <= raw < span:
        raise SimulatorError(f"{parameter.code}: {raw} does not fit {parameter.type}.")
    if raw > high:
        return raw - span
    return raw + span if raw < low else raw
