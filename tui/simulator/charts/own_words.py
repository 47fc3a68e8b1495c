"""Status words of a drive of any make that mean a state of its profile."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations

from tui.drive.chart import state_of
from tui.drive.profile.schema import Chart, State, StateKind

MOST_CLEARED = 3
"""Most bits, in addition to a state's own, that are tried in combination until no earlier state
fits."""
REST_KINDS: tuple[StateKind, ...] = ("ready", "stopped", "blocked", "starting")


def words_showing(chart: Chart, state: State) -> dict[str, int]:
    """Return status words by code that mean this state.

    They are its own values if no earlier state matches these.
    """
    own, fixed = dict.fromkeys(chart.status_codes, 0), state_masks(chart, [state])
    own[chart.status] = state.value
    for when in state.also:
        own[when.parameter] |= when.values[0]
    if state_of(chart, own) is state:
        return own
    bits = [
        (code, 1 << bit)
        for code, mask in state_masks(chart, chart.states).items()
        for bit in range(32)
        if mask & ~fixed[code] & 1 << bit
    ]
    for count in range(1, MOST_CLEARED + 1):
        for chosen in combinations(bits, count):
            words = dict(own)
            for code, bit in chosen:
                words[code] |= bit
            if state_of(chart, words) is state:
                return words
    return own


def state_masks(chart: Chart, states: Sequence[State]) -> dict[str, int]:
    """Return by code the bits that decide about states."""
    masks = dict.fromkeys(chart.status_codes, 0)
    for state in states:
        masks[chart.status] |= state.mask
        for when in state.also:
            masks[when.parameter] |= 0xFFFFFFFF if when.mask is None else when.mask
    return masks


def state_of_kind(chart: Chart, *kinds: StateKind) -> State | None:
    """Return the first state of the first of these kinds that the chart has."""
    for kind in kinds:
        for state in chart.states:
            if state.kind == kind:
                return state
    return None


def with_bit(chart: Chart, words: Mapping[str, int], code: str, bit: int, *, on: bool) -> int:
    """Return a status word with a bit of separate meaning, unless that would show another state."""
    word = words[code]
    marked = word | 1 << bit if on else word & ~(1 << bit)
    same = state_of(chart, {**words, code: marked}) is state_of(chart, words)
    return marked if same else word
