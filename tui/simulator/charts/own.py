"""State chart of a drive of any make, played from its profile alone.

Its own words show its states; commands and transitions are those of the profile. Everything absent
from a profile has a simple form: two-wire terminals RUN and REV, a reference AI1, a ramp.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

from tui.drive.chart import state_of
from tui.drive.profile.schema import (
    Chart,
    Interlock,
    Order,
    OrderId,
    Parameter,
    State,
    StatusBit,
)

from ..body import Body, Fallback
from ..plant.fault_history import OwnFault
from ..plant.motor import MotorDemand, Stop
from .own_orders import OwnOrders
from .own_reference import OwnReference
from .own_words import REST_KINDS, state_masks, state_of_kind, with_bit, words_showing


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
        self._orders = OwnOrders(body.profile, self._raws, lambda: body.seconds)
        self._reference = OwnReference(body)
        self._stop = Stop.RAMP
        self._runs = False
        """True if the line has commanded a run."""
        self._reverse = False
        self._idle: State | None = None
        """State at standstill to which the line has led; None: the initial state."""
        self._slowing: State | None = None
        """State of the kind stopping to which the line has led, until standstill."""
        self._pressed = False
        self._local = False
        """True if the drive is in local control, and ignores run commands of the line."""
        self._target_hz = 0.0

    def power_up(self) -> None:
        """Start without commands of the line."""
        self._runs = self._reverse = False
        self._stop = Stop.RAMP
        self._idle = self._slowing = None
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
            self._rest_in(chart, target, state)

    def _obey(self, order: Order) -> None:
        if order.id in ("forward", "reverse"):
            if self._body.fault is None and not self._local:
                self._runs, self._reverse = True, order.id == "reverse"
                self._stop = Stop.RAMP
        elif order.id == "reset":
            self.reset_fault()
        elif way := STOPS_BY_ORDER.get(order.id):
            self._end(way)

    def _go(self, state: State) -> None:
        """Go to a state by a transition that no command names."""
        if state.kind == "running":
            self._runs = self._body.fault is None and not self._local
        elif state.kind == "fault":
            return
        elif self._body.fault is not None:
            self.reset_fault()
        else:
            self._end(Stop.RAMP)

    def _rest_in(self, chart: Chart, id: str, before: State) -> None:
        """Note the states until and at standstill, after a transition from the state `before`."""
        state = next(item for item in chart.states if item.id == id)
        # straight to standstill: the drive is not there before its motor is
        turned = before.kind in ("running", "stopping") and self._stop is not Stop.FREEWHEEL
        straight = before if turned and state.kind in REST_KINDS else None
        self._slowing = state if state.kind == "stopping" else straight
        if state.kind == "stopping":
            # the state that the drive reaches by itself from there
            ids = {s.target for s in chart.transitions if s.source == id and s.command is None}
            state = next((item for item in chart.states if item.id in ids), state)
        self._idle = state if state.kind in REST_KINDS else self._idle

    def _end(self, way: Stop) -> None:
        self._runs = False
        self._stop = way
        self._body.earlier_hz = None

    @property
    def keys(self) -> Mapping[str, Callable[[], str]]:
        """Return the switch between local and remote, if a status bit shows it."""
        if any(chart.local is not None for chart in self._body.profile.data.charts):
            return {"LOC": partial(self._switch, True), "REM": partial(self._switch, False)}
        return {}

    def _switch(self, local: bool) -> str:
        self._local = local
        self._end(Stop.RAMP)
        return "local control" if local else "control by the line"

    def trip(self, stop: Stop) -> None:
        """Stop the motor as the fault demands, and discard the commands of the line."""
        self._end(stop)
        self._idle = self._slowing = None

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

    @property
    def _moving(self) -> bool:
        """True if the motor is supplied or coasts."""
        return self._body.turning or abs(self._body.motor.rotor) > OWN_REACHED_HZ

    def order(self) -> MotorDemand:
        """Return the present demand on the motor."""
        body = self._body
        way = Stop.RAMP if self._ordered else self._stop
        up, down = body.rates(way)
        base = MotorDemand(acceleration=up, deceleration=down)
        if self._ordered:
            self._slowing = None
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
        elif self._slowing is not None and self._moving and not self._ordered:
            found = self._slowing
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
            deciding = state_masks(chart, chart.states)
            for code, word in words_showing(chart, state).items():
                kept = 0 if code == chart.status else self._word(code) & ~deciding[code]
                body.show_code(code, word | kept)
            reached = motor.energised and abs(motor.frequency - self._target_hz) < OWN_REACHED_HZ
            self._mark(chart, chart.reached, reached)
            self._mark(chart, chart.alarm, body.alarms != 0)
            self._mark(chart, chart.local, self._local)
            for lock in chart.interlocks:
                self._permit(chart, lock)
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

    def _word(self, code: str) -> int:
        return self._body.registers.present(self._body.profile[code])

    def _permit(self, chart: Chart, lock: Interlock) -> None:
        """Show that the condition of an interlock is met, in a word that the drive shows."""
        word = self._body.registers.named(lock.parameter)
        if word is None or word.access != "r" or lock.when:
            return
        raw = self._body.registers.present(word)
        if raw & lock.mask in lock.values:
            return
        met = raw & ~lock.mask | lock.values[0] & lock.mask
        words = {code: self._word(code) for code in chart.status_codes}
        if state_of(chart, {**words, word.code: met}) is state_of(chart, words):
            self._body.registers.put(word, met)

    def _mark(self, chart: Chart, mark: StatusBit | None, holds: bool) -> None:
        if mark is None or (parameter := self._body.registers.named(mark.parameter)) is None:
            return
        word = self._body.registers.present(parameter)
        on = holds == bool(mark.value)
        if mark.parameter in chart.status_codes:
            words = {code: self._word(code) for code in chart.status_codes}
            word = with_bit(chart, words, mark.parameter, mark.bit, on=on)
        else:
            word = word | 1 << mark.bit if on else word & ~(1 << mark.bit)
        self._body.registers.put(parameter, word)
