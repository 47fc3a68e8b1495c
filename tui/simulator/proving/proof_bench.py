"""A simulated drive on a bench: requests of a line to it, and time that only the test advances.

The result of a step is here, too, with the way in which it is carried out.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

from tui.drive.chart import ChartState, read_chart, state_of
from tui.drive.command_blocked import CommandBlocked, blocked_reason
from tui.drive.errors import DriveError
from tui.drive.orders import (
    choose,
    deciding_codes,
    interlock_codes,
    locked_by,
    order_target,
    walk,
    with_options,
)
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Chart, Order, OrderId, OrderWait, Parameter, State
from tui.drive.profile.toml_lines import TomlPath
from tui.drive.sentences import any_of
from tui.drive.settings.writable import is_setting
from tui.drive.shown import depends_on
from tui.drive.values import from_words, is_field, to_words, word_count
from tui.drive.words import raw_of_word

from ..drive import SimulatedDrive
from ..errors import SimulatorError
from ..spec import DriveSpec


@dataclass(frozen=True, slots=True)
class ProofStep:
    """Result of one step, and the place of its claim in the file."""

    path: TomlPath
    title: str
    fault: str = ""
    """Why it failed; empty if it passed."""


def proof_step(path: TomlPath, title: str, test: Callable[[], None]) -> ProofStep:
    """Carry out a step; an error of the drive is its fault."""
    try:
        test()
    except (Unproved, DriveError, SimulatorError) as error:
        return ProofStep(path, title, str(error) or "failed")
    return ProofStep(path, title)


BENCH_ADDRESS = 1
BENCH_STEP = 0.05
POLLED_EVERY = 0.2
"""Seconds between two reads that keep the drive from its timeout."""
RAMP_SECONDS = 0.5
"""Ramps of the drive on the bench: a test does not wait for those of a machine."""


class Unproved(Exception):
    """A step that failed; the text gives the reason."""


class ProofBench:
    """One drive of a profile, commissioned for the line, with its motor at standstill."""

    def __init__(self, profile: Profile, chart: Chart | None, order: Order | None = None) -> None:
        """`chart` is made active, and the conditions of `order` are met."""
        self.profile = profile
        sets = _conditions(chart, order)
        self.drive = SimulatedDrive(profile, DriveSpec(profile.id, BENCH_ADDRESS))
        for code, raw in sets.items():
            self.drive.set(code, raw)
        self._chart = chart
        self._shorten_ramps()
        self.seen: list[str] = []
        """States that the drive has shown, without repetitions."""
        self.wait(BENCH_STEP)

    def _shorten_ramps(self) -> None:
        for quantity in ("acceleration", "deceleration"):
            parameter = self.profile.quantity(quantity)
            if parameter is None or parameter.access == "r" or not parameter.unit:
                continue
            scale = self.profile.scale(parameter, self.raws(depends_on(parameter)))
            if scale:
                raw = max(int(RAMP_SECONDS / float(scale)), parameter.min or 0, 1)
                self.drive.set(parameter.code, raw)

    # Requests

    def ask(self, request: bytes) -> bytes:
        """Return the reply to a request; raises Unproved for an exception and for silence."""
        reply = self.drive.line_side.answer(self.drive.address, request)
        if reply is None:
            raise Unproved("no answer")
        if reply[0] & 0x80:
            raise Unproved(f"exception {reply[1]}")
        return reply

    def words(self, address: int, count: int, function: int = 3) -> list[int]:
        """Read registers; raises Unproved."""
        reply = self.ask(struct.pack(">BHH", function, address, count))
        if function in (1, 2):
            number = int.from_bytes(reply[2:], "little")
            return [number >> place & 1 for place in range(count)]
        return list(struct.unpack(f">{count}H", reply[2:]))

    def read(self, parameter: Parameter) -> int:
        """Read a raw value; raises Unproved."""
        count = word_count(parameter)
        return from_words(parameter, self.words(parameter.address, count, parameter.function))

    def write(self, parameter: Parameter, raw: int) -> None:
        """Write a raw value, and enter it if the family needs that; raises Unproved if refused."""
        self.write_only(parameter, raw)
        enter = self.profile.data.memory.enter
        if enter is not None and is_setting(self.profile, parameter):
            self.write_only(self.profile[enter.parameter], enter.raw)

    def write_only(self, parameter: Parameter, raw: int) -> None:
        """Write a raw value; raises Unproved if the drive refuses it."""
        held = self.words(parameter.address, 1)[0] if is_field(parameter) else None
        words = to_words(parameter, raw if raw <= _most(parameter) else raw - 0x10000, held)
        if parameter.is_bits:
            self._write_coils(parameter.address, words)
            return
        if len(words) == 1 and self.profile.function(6) is not None:
            self.ask(struct.pack(">BHH", 6, parameter.address, words[0]))
            return
        data = struct.pack(f">{len(words)}H", *words)
        head = struct.pack(">BHHB", 16, parameter.address, len(words), len(data))
        self.ask(head + data)

    def _write_coils(self, address: int, bits: Sequence[int]) -> None:
        if len(bits) == 1 and self.profile.function(5) is not None:
            self.ask(struct.pack(">BHH", 5, address, 0xFF00 if bits[0] else 0))
            return
        data = sum(bit << place for place, bit in enumerate(bits)).to_bytes(
            (len(bits) + 7) // 8, "little"
        )
        self.ask(struct.pack(">BHHB", 15, address, len(bits), len(data)) + data)

    def raws(self, codes: Iterable[str]) -> dict[str, int]:
        """Read raw values by code; those that cannot be read are missing."""
        found = {}
        for code in dict.fromkeys(codes):
            try:
                found[code] = self.read(self.profile[code])
            except Unproved:
                continue
        return found

    # State and commands

    @property
    def chart(self) -> Chart:
        """The chart under test."""
        assert self._chart is not None
        return self._chart

    def state(self) -> ChartState:
        """Read the state of the drive."""
        return read_chart(self.profile, self._known())

    def own(self) -> State:
        """Read the state by the status words alone."""
        codes = self.chart.status_codes
        return state_of(self.chart, {code: self.read(self.profile[code]) for code in codes})

    def _known(self) -> Mapping[str, int]:
        chart, faults = self.chart, self.profile.data.faults
        codes = [*chart.status_codes, *deciding_codes(self.profile), *interlock_codes(chart)]
        marks = (chart.direction, chart.reached, chart.local, chart.alarm)
        codes += [mark.parameter for mark in marks if mark is not None]
        codes += [option.parameter for option in chart.options]
        return self.raws([*codes, *([faults.parameter] if faults.parameter else [])])

    def blocked(self, id: OrderId) -> CommandBlocked | None:
        """Return why the panel would not send a command now; None if it would."""
        return blocked_reason(self.profile, self.chart, id, self._known())

    def send(self, id: OrderId, order: Order | None = None) -> Order:
        """Send the command that the drive's state requires, as the panel does; raises Unproved."""
        if id in ("forward", "reverse") and self.chart.runs_in:
            own = self.own()
            for _, word in walk(self.chart, own.id, self.chart.runs_in):
                self.write(self.profile[self.chart.command], word)
                self.wait(BENCH_STEP)
        known = self._known()
        if (lock := locked_by(self.chart, id, known)) is not None:
            raise Unproved(f"an interlock blocks it: {lock.text}")
        chosen = choose(self.chart, id, known, self.own()) if order is None else order
        target = order_target(self.profile, self.chart, chosen)
        for place, word in enumerate(with_options(self.chart, chosen, known)):
            self.write(target, raw_of_word(target, word))
            if place < len(chosen.waits):
                self._wait_between(chosen.waits[place])
        self._look()
        return chosen

    def _wait_between(self, wait: OrderWait) -> None:
        """Wait as before the next word of a command; raises Unproved."""
        reached = self.until(lambda: self.own().id in wait.states, wait.seconds)
        if wait.states and not reached:
            wanted, own = any_of(wait.states), self.own().id
            raise Unproved(f"the drive does not show {wanted} before the next word, but {own}")

    # Time

    def wait(self, seconds: float, *, silent: bool = False) -> None:
        """Advance the time; without `silent`, the drive is polled."""
        self.until(lambda: False, seconds, silent=silent)

    def until(self, reached: Callable[[], bool], seconds: float, *, silent: bool = False) -> bool:
        """Advance the time until a condition holds; return False if it does not in `seconds`."""
        steps = round(seconds / BENCH_STEP)
        for number in range(steps):
            if reached():
                return True
            self.drive.step(BENCH_STEP)
            if not silent and number % round(POLLED_EVERY / BENCH_STEP) == 0:
                self._look()
        return reached()

    def _look(self) -> None:
        if self._chart is None:
            return
        own = self.own().id
        if self.seen[-1:] != [own]:
            self.seen.append(own)

    @property
    def turns(self) -> bool:
        """True if the motor turns or is supplied."""
        motor = self.drive.motor
        return motor.energised or motor.braking or abs(motor.rotor) > 0.5

    @property
    def hz(self) -> float:
        """Output frequency of the simulated motor, signed."""
        return self.drive.motor.frequency


def _conditions(chart: Chart | None, order: Order | None) -> dict[str, int]:
    """Return raw values by code with which a chart is active, and its commands are possible."""
    sets: dict[str, int] = {}
    rows = [] if chart is None or chart.when is None else [chart.when]
    rows += order.when if order is not None else []
    for id in ("forward", "reverse"):
        same = [o for o in chart.orders if o.id == id] if chart is not None else []
        rows += same[0].when if same else []
    for when in rows:
        sets.setdefault(when.parameter, when.values[0])
    return sets


def _most(parameter: Parameter) -> int:
    return 0x7FFF if parameter.type == "int16" else 0xFFFFFFFF
