"""Status words for the states of a profile's chart; pure functions."""

from __future__ import annotations

from itertools import combinations

from tui.drive.chart import state_of
from tui.drive.profile.schema import Chart, State, StateKind

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
    bits = [1 << bit for bit in range(16) if others & ~state.mask & 1 << bit]
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
