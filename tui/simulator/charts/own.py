"""State chart of a drive of any make, played from its profile alone.

Its own words show its states; commands and transitions are those of the profile. Everything absent
from a profile has a simple form: two-wire terminals RUN and REV, a reference AI1, a ramp.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from itertools import combinations

from tui.drive.chart import state_of
from tui.drive.orders import locked_by, order_target
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import (
    Chart,
    Order,
    OrderId,
    Parameter,
    State,
    StateKind,
    StatusBit,
    Transition,
)
from tui.drive.words import unsigned

from ..body import Body, Fallback
from ..plant.fault_history import OwnFault
from ..plant.motor import MotorDemand, Stop
from .own_reference import OwnReference

Raws = Callable[[], Mapping[str, int]]


class OwnOrders:
    """Follower of the words that the line writes; reports the commands that they complete.

    Bits of options are ignored in every comparison. A command of several words is complete with the
    last of them, if it began in a state that allows it.
    """

    def __init__(self, profile: Profile, raws: Raws) -> None:
        self._profile = profile
        self._raws = raws
        self._places: dict[int, int] = {}
        """Number of received words of a command, by its place in the chart."""
        self._last: dict[str, int] = {}

    def forget(self) -> None:
        """Forget all written words."""
        self._places.clear()
        self._last.clear()

    def transition(self, chart: Chart, state: State, where: Parameter, raw: int) -> str:
        """Return the next state by a written command word; empty if it leads to none."""
        if not chart.command or self._profile[chart.command] is not where:
            return ""
        steps = [s for s in chart.transitions if s.source == state.id and s.command is not None]
        fitting = (s for s in steps if self._makes(chart, where, raw, s))
        step = next(fitting, None)
        return step.target if step else ""

    def _makes(self, chart: Chart, where: Parameter, raw: int, step: Transition) -> bool:
        if step.edge_bit is not None:
            rising = raw & ~self._last.get(where.code, 0)
            return bool(rising >> step.edge_bit & 1)
        return self._same(chart, where, raw, step.command or 0)

    def complete(self, chart: Chart, state: State, where: Parameter, raw: int) -> Order | None:
        """Return the command that a written word completes in this state.

        Of several, the longest: the 0 at the end of a reset is not the stop.
        """
        raws = self._raws()
        done = None
        for place, order in enumerate(chart.orders):
            if order_target(self._profile, chart, order) is not where or not order.words:
                continue
            come = self._places.get(place, 0)
            if come == 0 and order.states and state.id not in order.states:
                continue
            if not all(raws.get(when.parameter) in when.values for when in order.when):
                continue
            come = self._next(chart, where, raw, order, come)
            self._places[place] = come % len(order.words)
            if come == len(order.words) and (done is None or come > len(done.words)):
                done = order
        if done is not None and locked_by(chart, done.id, raws) is not None:
            return None
        return done

    def _next(self, chart: Chart, where: Parameter, raw: int, order: Order, come: int) -> int:
        if self._same(chart, where, raw, order.words[come]):
            return come + 1
        return int(self._same(chart, where, raw, order.words[0]))

    def note(self, where: Parameter, raw: int) -> None:
        """Record a written word, to detect the edges of the next."""
        self._last[where.code] = raw

    @staticmethod
    def _same(chart: Chart, where: Parameter, raw: int, word: int) -> bool:
        kept = 0
        for option in chart.options:
            if option.parameter == where.code:
                kept |= option.mask
        return unsigned(raw) & ~kept == unsigned(word) & ~kept


MOST_CLEARED = 3
"""Most bits, in addition to a state's own, that are tried in combination until no earlier state
fits."""
REST_KINDS: tuple[StateKind, ...] = ("ready", "stopped", "blocked", "starting")


def word_of(chart: Chart, state: State) -> int:
    """Return a status word that means this state; its value if no earlier state matches that."""
    if state_of(chart, state.value) is state:
        return state.value
    others = 0
    for before in chart.states:
        others |= before.mask
    bits = [1 << bit for bit in range(32) if others & ~state.mask & 1 << bit]
    for count in range(1, MOST_CLEARED + 1):
        for chosen in combinations(bits, count):
            word = state.value | sum(chosen)
            if state_of(chart, word) is state:
                return word
    return state.value


def state_of_kind(chart: Chart, *kinds: StateKind) -> State | None:
    """Return the first state of the first of these kinds that the chart has."""
    for kind in kinds:
        for state in chart.states:
            if state.kind == kind:
                return state
    return None


def with_bit(chart: Chart, word: int, bit: int, *, on: bool) -> int:
    """Return a status word with a bit of separate meaning, unless that would show another state."""
    marked = word | 1 << bit if on else word & ~(1 << bit)
    return marked if state_of(chart, marked) is state_of(chart, word) else word


def _agrees(order: Order, led: State) -> bool:
    """Return True if a transition leads a command to where its name says.

    If not, the drive follows the transition: a stop whose word leads to a running state stops
    nothing.
    """
    if order.id in ("forward", "reverse"):
        return led.kind == "running"
    return order.id not in (*STOPS_BY_ORDER, "reset") or led.kind != "running"


OWN_REACHED_HZ = 0.1
STOPS_BY_ORDER: dict[OrderId, Stop] = {
    "stop": Stop.RAMP,
    "quick-stop": Stop.FAST,
    "freewheel": Stop.FREEWHEEL,
    "emergency-stop": Stop.FAST,
    "dc-braking": Stop.INJECTION,
}


class OwnChart:
    """State chart of one drive by its profile: its commands and status."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self._orders = OwnOrders(body.profile, self._raws)
        self._reference = OwnReference(body)
        self._stop = Stop.RAMP
        self._runs = False
        """True if the line has commanded a run."""
        self._reverse = False
        self._idle: State | None = None
        """State at standstill to which the line has led; None: the initial state."""
        self._pressed = False
        self._target_hz = 0.0

    def power_up(self) -> None:
        """Start without commands of the line."""
        self._runs = self._reverse = False
        self._stop = Stop.RAMP
        self._idle = None
        self._orders.forget()

    # Commands from outside

    def run(self, hz: float) -> None:
        """Run as if by an earlier command of another master if the line can command a run, else by
        the inputs."""
        chart = self._chart
        if chart is not None and any(order.id == "forward" for order in chart.orders):
            self._runs, self._reverse = True, hz < 0
            self._reference.leave(abs(hz))
        else:
            self._body.terminals.close("REV" if hz < 0 else "RUN")
            self._reference.wire(abs(hz))

    def refer(self, hz: float) -> None:
        """Change the reference from outside, unless the line has given one since."""
        if self._reference.is_earlier:
            self._reference.leave(abs(hz))
        elif self._wired:
            self._reference.wire(abs(hz))

    def halt(self) -> None:
        """Open the run inputs, and end the command of another master."""
        for name in ("RUN", "REV"):
            self._body.terminals.close(name, closed=False)
        self._end(Stop.RAMP)

    def follow(self) -> None:
        """Read the inputs: RESET resets a fault."""
        pressed = self._body.terminals.closed("RESET")
        if pressed and not self._pressed:
            self.reset_fault()
        self._pressed = pressed

    def written(self, parameter: Parameter) -> None:
        """Process a word that the line wrote."""
        chart = self._chart
        if chart is None:
            return
        raw = self._body.registers.present(parameter)
        state = self._state(chart)
        target = self._orders.transition(chart, state, parameter, raw)
        order = self._orders.complete(chart, state, parameter, raw)
        self._orders.note(parameter, raw)
        led = next((item for item in chart.states if item.id == target), None)
        if order is not None and (led is None or _agrees(order, led)):
            self._obey(order)
        elif led is not None:
            self._go(led)
        if target and not self._runs:
            self._rest_in(chart, target)

    def _obey(self, order: Order) -> None:
        if order.id in ("forward", "reverse"):
            if self._body.fault is None:
                self._runs, self._reverse = True, order.id == "reverse"
                self._stop = Stop.RAMP
        elif order.id == "reset":
            self.reset_fault()
        elif way := STOPS_BY_ORDER.get(order.id):
            self._end(way)

    def _go(self, state: State) -> None:
        """Go to a state by a transition that no command names."""
        if state.kind == "running":
            self._runs = self._body.fault is None
        elif state.kind == "fault":
            return
        elif self._body.fault is not None:
            self.reset_fault()
        else:
            self._end(Stop.RAMP)

    def _rest_in(self, chart: Chart, id: str) -> None:
        state = next(item for item in chart.states if item.id == id)
        self._idle = state if state.kind in REST_KINDS else self._idle

    def _end(self, way: Stop) -> None:
        self._runs = False
        self._stop = way
        self._body.earlier_hz = None

    @property
    def keys(self) -> Mapping[str, Callable[[], str]]:
        """Return no keys: those of the keypad are not simulated."""
        return {}

    def trip(self, stop: Stop) -> None:
        """Stop the motor as the fault demands, and discard the commands of the line."""
        self._end(stop)
        self._idle = None

    def reset_fault(self) -> None:
        """Clear the fault if its cause is removed; a closed run input starts the motor again."""
        fault = self._body.fault
        if fault is not None and not fault.persists:
            self._body.fault = None
            self._stop = Stop.RAMP

    def raises(self) -> OwnFault | None:
        """Return None: no word and no input is known to cause a fault."""
        return None

    @property
    def running(self) -> bool:
        """True if stopped-only words are locked."""
        return self._body.turning

    # Demand on the motor

    @property
    def _wired(self) -> bool:
        closed = self._body.terminals.closed
        return closed("RUN") or closed("REV")

    @property
    def _ordered(self) -> bool:
        if self._body.fault is not None or self._body.fallback is Fallback.STOP:
            return False
        return self._runs or self._wired

    def order(self) -> MotorDemand:
        """Return the present demand on the motor."""
        body = self._body
        way = Stop.RAMP if self._ordered else self._stop
        up, down = body.rates(way)
        base = MotorDemand(acceleration=up, deceleration=down)
        if self._ordered:
            self._target_hz = self._wanted()
            return replace(base, energised=True, target=self._target_hz)
        self._target_hz = 0.0
        if way is Stop.INJECTION:
            return replace(base, injection=bool(body.motor.rotor))
        slow = way is not Stop.FREEWHEEL and body.motor.frequency != 0
        return replace(base, energised=slow, target=0.0)

    def _wanted(self) -> float:
        hz = self._reference.hz(by_line=self._runs)
        closed = self._body.terminals.closed
        backward = closed("REV") and not closed("RUN")
        reverse = self._reverse if self._runs else backward
        return self._body.directed(-hz if reverse else hz)

    # Words for the line

    def _raws(self) -> dict[str, int]:
        registers = self._body.registers
        return {p.code: registers.in_force(p) for p in self._body.profile.parameters}

    @property
    def _chart(self) -> Chart | None:
        registers, profile = self._body.registers, self._body.profile
        deciding = [profile[chart.when.parameter] for chart in profile.data.charts if chart.when]
        return profile.chart({word.code: registers.in_force(word) for word in deciding})

    def _state(self, chart: Chart) -> State:
        found = None
        if self._body.fault is not None:
            found = state_of_kind(chart, "fault")
        elif self._body.motor.energised or self._body.motor.braking:
            kinds = ("running",) if self._ordered else ("stopping", "running")
            found = state_of_kind(chart, *kinds)
        return found or self._idle or state_of_kind(chart, *REST_KINDS) or chart.states[0]

    def show(self) -> None:
        """Put the status words of the present state into their registers."""
        body = self._body
        motor = body.motor
        chart = self._chart
        if chart is not None and chart.states:
            state = self._state(chart)
            body.show_code(chart.status, word_of(chart, state))
            reached = motor.energised and abs(motor.frequency - self._target_hz) < OWN_REACHED_HZ
            self._mark(chart, chart.reached, reached)
            self._mark(chart, chart.alarm, body.alarms != 0)
            if chart.direction is not None:
                way = StatusBit(
                    parameter=chart.direction.parameter,
                    bit=chart.direction.bit,
                    value=chart.direction.reverse,
                )
                self._mark(chart, way, motor.frequency < 0 or self._target_hz < 0)
        body.show_raw("alarm_word", body.alarms)
        body.show("frequency_reference", abs(self._target_hz))
        body.show("ramp_output", motor.frequency)
        body.show("output_frequency", motor.frequency)

    def _mark(self, chart: Chart, mark: StatusBit | None, holds: bool) -> None:
        if mark is None or (parameter := self._body.registers.named(mark.parameter)) is None:
            return
        word = self._body.registers.present(parameter)
        on = holds == bool(mark.value)
        if mark.parameter == chart.status:
            word = with_bit(chart, word, mark.bit, on=on)
        else:
            word = word | 1 << mark.bit if on else word & ~(1 << mark.bit)
        self._body.registers.put(parameter, word)
