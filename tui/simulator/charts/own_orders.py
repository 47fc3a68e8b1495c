"""Commands of a drive of any make, recognized in the words that the line writes."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from tui.drive.orders import locked_by, order_target
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Chart, Order, Parameter, State, Transition
from tui.drive.words import unsigned

Raws = Callable[[], Mapping[str, int]]
TIME_STEP = 0.05
"""Seconds by which the drive's time may lag behind that of the line."""


class OwnOrders:
    """Follower of the words that the line writes; reports the commands that they complete.

    Bits of options are ignored in every comparison. A command of several words is complete with the
    last of them, if it began in a state that allows it, and if its waits were kept.
    """

    def __init__(self, profile: Profile, raws: Raws, seconds: Callable[[], float]) -> None:
        """`seconds` returns the drive's time."""
        self._profile = profile
        self._raws = raws
        self._seconds = seconds
        self._came: dict[int, float] = {}
        """Time of the last received word of a command, by its place in the chart."""
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
            if come and not self._waited(order, come, place, state):
                come = 0
            come = self._next(chart, where, raw, order, come)
            self._places[place] = come % len(order.words)
            self._came[place] = self._seconds()
            if come == len(order.words) and (done is None or come > len(done.words)):
                done = order
        if done is not None and locked_by(chart, done.id, raws) is not None:
            return None
        return None if done is not None and self._lacks_edge(chart, done, where, raw) else done

    def _lacks_edge(self, chart: Chart, order: Order, where: Parameter, raw: int) -> bool:
        """Return True for a reset in the command word whose bits were already set before."""
        own = bool(chart.command) and self._profile[chart.command] is where
        if order.id != "reset" or len(order.words) > 1 or not own:
            return False
        return not unsigned(raw) & ~self._last.get(where.code, 0)

    def _waited(self, order: Order, come: int, place: int, state: State) -> bool:
        """Return True if the wait before the next word of a command is over."""
        if come > len(order.waits):
            return True
        wait = order.waits[come - 1]
        if wait.states:
            return state.id in wait.states
        return self._seconds() - self._came[place] >= wait.seconds - TIME_STEP

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
