"""Which keys are alone, which a piece, which held down."""

from __future__ import annotations

from collections.abc import Iterable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.limits import BURST_GAP
from tui.terminal.reader import HELD_LONGEST, STEPPING, Bursts
from tui.terminal.stroke import Pressed
from tui.terminal.tokens import KeyToken, Paste

QUIET = BURST_GAP + 0.01
CLOSE = 0.03
STOPS = {"space", "f12", "f9"}


def pressed(name: str, at: float) -> KeyToken:
    return KeyToken(name, name if len(name) == 1 else None, at, at)


def keys_of(given: Iterable[Pressed | Paste]) -> list[Pressed]:
    return [key for key in given if isinstance(key, Pressed)]


class Bench:
    """Reads at given times, and looks when there is something to know."""

    def __init__(self) -> None:
        self.bursts = Bursts()
        self.now = 0.0
        self.found: list[Pressed] = []

    def read(self, *names: str, after: float = 1.0) -> list[Pressed]:
        """Keys of one read, this long after the last; return the keys delivered by then."""
        self.now += after
        before = len(self.found)
        while (deadline := self.bursts.deadline()) is not None and deadline < self.now - 0.001:
            self.found += keys_of(self.bursts.given(deadline + 0.001))
        for name in names:
            key = pressed(name, self.now)
            if name in STOPS:
                self.bursts.stop(key)
            else:
                self.bursts.key(key)
        self.found += keys_of(self.bursts.given(self.now))
        return self.found[before:]

    def rest(self) -> list[Pressed]:
        return self.read()

    def names(self) -> list[str]:
        return [given.name for given in self.found]


def test_single_key_is_held_until_known_as_single() -> None:
    bench = Bench()
    assert bench.read("r") == []
    assert bench.bursts.deadline() == pytest.approx(bench.now + BURST_GAP)
    assert bench.bursts.given(bench.now + BURST_GAP - 0.001) == []
    (given,) = keys_of(bench.bursts.given(bench.now + BURST_GAP + 0.001))
    stroke = given.stroke
    assert (stroke.alone, stroke.held, stroke.steps, stroke.piece) == (True, False, True, 1)
    assert bench.bursts.deadline() is None


def test_keys_of_one_read_are_a_burst() -> None:
    bench = Bench()
    bench.read("r", "enter")
    found = bench.rest()
    strokes = [given.stroke for given in found]
    assert [(s.alone, s.held, s.steps, s.piece) for s in strokes] == [(False, False, False, 2)] * 2


@pytest.mark.parametrize(
    ("gap", "alone"), [(0.001, False), (CLOSE, False), (QUIET, True), (1.0, True)]
)
def test_keys_within_50_ms_are_a_burst(gap: float, alone: bool) -> None:
    bench = Bench()
    bench.read("r")
    bench.read("enter", after=gap)
    bench.rest()
    assert [given.stroke.alone for given in bench.found] == [alone, alone]


def test_chain_of_close_keys_is_one_burst() -> None:
    bench = Bench()
    for name in "drive":
        bench.read(name, after=CLOSE)
    bench.rest()
    assert bench.names() == list("drive")
    assert not any(given.stroke.alone for given in bench.found)


def test_stop_cancels_waiting_keys_and_is_part_of_the_burst() -> None:
    bench = Bench()
    bench.read("up", "r", "space", "v")
    bench.read("f", after=CLOSE)
    bench.rest()
    assert bench.names() == ["v", "f"]
    assert not any(given.stroke.alone or given.stroke.steps for given in bench.found)
    bench.read("r")
    assert [given.stroke.alone for given in bench.rest()] == [True]


def test_stop_cancels_a_due_key_not_yet_delivered() -> None:
    bursts = Bursts()
    bursts.key(pressed("r", 1.0))
    bursts.stop(pressed("space", 1.2))
    assert bursts.given(1.2) == []
    assert bursts.given(5.0) == []


def test_simultaneous_arrows_step_once() -> None:
    bench = Bench()
    bench.read("up", "up", "up")
    found = bench.rest()
    assert [given.stroke.steps for given in found] == [True, False, False]
    assert not any(given.stroke.alone or given.stroke.held for given in found)
    bench.read("up", "down")
    assert not any(given.stroke.steps for given in bench.rest())


def test_held_arrow_repeats_at_its_pace_until_released() -> None:
    bench = Bench()
    bench.read("up")
    assert [given.stroke.alone for given in bench.rest()] == [True]
    assert bench.read("up", after=0.5) == []
    assert bench.read("up", after=0.033) == []
    assert [given.stroke.held for given in bench.read("up", after=0.033)] == [True] * 3
    for _ in range(50):
        (given,) = bench.read("up", after=0.033)
        assert given.stroke.held
        assert given.stroke.steps
    assert bench.rest() == []
    bench.read("up")
    assert [given.stroke.alone for given in bench.rest()] == [True]


def test_slow_repeats_are_single_keys() -> None:
    bench = Bench()
    for _ in range(5):
        bench.read("down", after=0.09)
    bench.rest()
    assert [given.stroke.alone for given in bench.found] == [True] * 5


def test_held_letter_is_a_burst() -> None:
    bench = Bench()
    for _ in range(40):
        bench.read("r", after=0.033)
    bench.rest()
    strokes = [given.stroke for given in bench.found]
    assert not any(stroke.alone or stroke.held or stroke.steps for stroke in strokes)
    assert len(bench.found) == 40


def test_arrows_at_an_uneven_pace_step_once() -> None:
    bench = Bench()
    for gap in (0.5, 0.006, 0.045, 0.006, 0.045, 0.006, 0.045):
        bench.read("up", after=gap)
    bench.rest()
    assert sum(given.stroke.steps for given in bench.found) == 1


def test_arrows_faster_than_any_keyboard_step_once() -> None:
    bench = Bench()
    for _ in range(300):
        bench.read("up", after=0.001)
    bench.rest()
    assert sum(given.stroke.steps for given in bench.found) == 1
    assert len(bench.found) == 300


def test_quick_link_steps_once_per_read() -> None:
    bench = Bench()
    bench.read(*["up"] * 60)
    for _ in range(3):
        bench.read("up", after=0.033)
    bench.read("up", "up", after=0.033)
    bench.rest()
    assert sum(given.stroke.steps for given in bench.found) == 1 + 3 + 1


def test_other_key_ends_a_held_one() -> None:
    bench = Bench()
    for _ in range(4):
        bench.read("up", after=0.033)
    bench.read("down", after=0.033)
    bench.read("up", after=0.033)
    bench.rest()
    assert [given.stroke.held for given in bench.found] == [True] * 4 + [False] * 2
    assert not any(given.stroke.steps for given in bench.found[4:])


def test_long_burst_is_not_held_until_its_end() -> None:
    bench = Bench()
    found = [given for _ in range(20) for given in bench.read("x", after=CLOSE)]
    assert len(found) >= 20 - HELD_LONGEST / CLOSE - 2


def test_paste_keeps_its_order_and_joins_close_keys() -> None:
    bursts = Bursts()
    bursts.key(pressed("slash", 1.0))
    bursts.paste(Paste("text", 1.01))
    bursts.key(pressed("enter", 1.02))
    found = [*bursts.given(1.02), *bursts.given(2.0)]
    assert [type(given) for given in found] == [Pressed, Paste, Pressed]
    assert not any(given.stroke.alone for given in keys_of(found))


def test_stop_does_not_cancel_a_paste() -> None:
    bursts = Bursts()
    bursts.paste(Paste("text", 1.0))
    bursts.stop(pressed("space", 1.0))
    assert bursts.given(2.0) == [Paste("text", 1.0)]


def test_key_waits_for_a_sequence_begun_with_it() -> None:
    bursts = Bursts()
    bursts.key(pressed("r", 1.0))
    assert bursts.given(1.08, pending=1.03) == []
    assert bursts.deadline(pending=1.03) is None
    bursts.key(KeyToken("escape", "\x1b", 1.03, 1.03))
    assert [given.stroke.alone for given in keys_of(bursts.given(1.13))] == [False, False]
    bursts.key(pressed("r", 2.0))
    assert [given.stroke.alone for given in keys_of(bursts.given(2.1, pending=2.06))] == [True]


def test_harmless_key_does_not_wait_but_counts_as_one_of_its_burst() -> None:
    bursts = Bursts()
    bursts.key(pressed("2", 1.0), at_once=True)
    (shows,) = keys_of(bursts.given(1.0))
    stroke = shows.stroke
    assert (shows.name, stroke.at_once, stroke.acts, stroke.steps) == ("2", True, False, False)
    assert bursts.deadline() is None
    bursts.key(pressed("r", 1.0 + CLOSE))
    assert bursts.holds_back
    (run,) = keys_of(bursts.given(1.0 + CLOSE + QUIET))
    assert (run.name, run.stroke.acts, run.stroke.at_once) == ("r", False, False)
    assert not bursts.holds_back


def test_only_the_first_key_after_a_pause_begins_a_burst() -> None:
    bursts = Bursts()
    assert bursts.begins(pressed("2", 1.0))
    bursts.key(pressed("2", 1.0), at_once=True)
    assert not bursts.begins(pressed("3", 1.0 + BURST_GAP - 0.001))
    assert bursts.begins(pressed("3", 1.0 + BURST_GAP + 0.001))


def test_stop_cancels_a_harmless_key_not_yet_delivered() -> None:
    bursts = Bursts()
    bursts.key(pressed("2", 1.0), at_once=True)
    bursts.stop(pressed("space", 1.0))
    assert bursts.given(1.2) == []


NAMES = st.sampled_from(["r", "enter", "up", "up", "up", "down", "pageup", "space", "f12", "1"])
READS = st.lists(
    st.tuples(
        st.lists(NAMES, min_size=1, max_size=4),
        st.sampled_from([0.0005, 0.01, 0.033, 0.033, 0.033, 0.049, 0.06, 0.4]),
    ),
    max_size=25,
)


def _times(reads: Iterable[tuple[list[str], float]]) -> list[tuple[str, float]]:
    now, found = 0.0, []
    for names, gap in reads:
        now += gap
        found += [(name, now) for name in names]
    return found


@given(READS)
def test_every_key_read_is_delivered_or_cancelled(reads: list[tuple[list[str], float]]) -> None:
    bench = Bench()
    for names, gap in reads:
        bench.read(*names, after=gap)
    bench.rest()
    typed = _times(reads)
    keys = bench.found
    # in order, each once, none that was not typed
    rest = iter(name for name, _ in typed)
    assert all(any(name == key.name for name in rest) for key in keys)
    for key in bench.found:
        near = [name for name, at in typed if abs(at - key.stroke.read_at) <= BURST_GAP - 1e-6]
        if key.stroke.alone:
            assert near == [key.name]
        if key.stroke.held:
            assert key.name in STEPPING
            assert near.count(key.name) > 1
        assert key.stroke.steps <= (key.name in STEPPING or key.stroke.alone)
    # a key without a later stop is delivered, as single if no other is close
    stops = [at for name, at in typed if name in STOPS]
    for name, at in typed:
        near = [other for other, time in typed if abs(time - at) <= BURST_GAP + 1e-6]
        if name not in STOPS and near == [name] and not [s for s in stops if s == at]:
            assert any(given.stroke.read_at == at and given.stroke.alone for given in bench.found)


@given(
    st.lists(st.sampled_from(["r", "v", "enter", "up", "3"]), min_size=2, max_size=30), st.data()
)
def test_unbracketed_paste_is_one_burst_at_every_cut(names: list[str], data: st.DataObject) -> None:
    cut = data.draw(st.integers(0, len(names)))
    bench = Bench()
    bench.read(*names[:cut])
    bench.read(*names[cut:], after=data.draw(st.floats(0, CLOSE)))
    bench.rest()
    assert bench.names() == names
    assert not any(given.stroke.alone or given.stroke.held for given in bench.found)
    assert sum(given.stroke.steps for given in bench.found) <= 1
