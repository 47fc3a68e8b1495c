"""A stop is the last word: keys of a person, of a paste and of a link that hung, on the wire."""

from __future__ import annotations

import random

import pytest

from benchmarks.hands import MIXED, Counted, bursts, is_stop, unarmed
from tests.programs import wait_until

from .pty_panel import LINE_SETTLED, PtyPanel, Write
from .test_hands import RANDOM_KEYS

F12, F9 = "\x1b[24~", "\x1b[20~"
PAUSES = (0.02, 0.06, 0.2, 0.5)
"""Seconds between two parts of a paste: one piece, two pieces, longer than a question settles."""


def at_rest(panel: PtyPanel) -> None:
    """Check that the motor is at standstill, as it must be after a stop."""
    wait_until(lambda: panel.simulation.drive(1).motor.frequency == 0, "the motor stands")


@pytest.mark.parametrize("typed", ["\r ", " \r", f"30\r{F12}", "5 ", "\x1b[A ", f"\r{F9}\r", "r "])
@pytest.mark.parametrize("key", ["r", "v", "f"])
def test_stop_in_a_burst_closes_the_open_run_line(panel: PtyPanel, key: str, typed: str) -> None:
    panel.open_line(key)
    before = len(panel.log.writes)
    panel.type(typed)
    panel.stopped(before)
    assert " at  " not in panel.text().splitlines()[-4]


@pytest.mark.parametrize("stop", [" ", F12, F9])
def test_enter_after_a_stop_runs_nothing(panel: PtyPanel, stop: str) -> None:
    panel.open_line()
    before = len(panel.log.writes)
    panel.type(stop)
    panel.settle(0.1)
    panel.type("\r")
    panel.stopped(before)


@pytest.mark.parametrize("key", ["k", "e"])
def test_other_stop_keys_work_with_an_open_run_line(panel: PtyPanel, key: str) -> None:
    panel.run()
    panel.open_line("f")
    before = len(panel.log.writes)
    panel.type(key)
    at_rest(panel)
    assert panel.log.writes[before:]
    assert all(map(is_stop, panel.log.writes[before:]))
    panel.type(" ")  # out of the state Quick stop active
    panel.settle()


@pytest.mark.parametrize("typed", ["\r", "30\r", "r30\r", "ar30\r"])
def test_burst_does_not_run_the_motor(panel: PtyPanel, typed: str) -> None:
    panel.open_line()
    before = len(panel.log.writes)
    panel.type(f"5{typed}")
    panel.settle(LINE_SETTLED)
    assert panel.log.writes[before:] == []
    panel.type(" ")
    panel.stopped(before)


@pytest.mark.parametrize(
    "typed", ["r ", "r\r ", "\x1b[A\x1b[Ar ", "ar ", f"30\r{F12}", f"f40\r{F9}"]
)
def test_keys_delayed_by_a_hung_link_only_stop(panel: PtyPanel, typed: str) -> None:
    panel.run()
    before = len(panel.log.writes)
    panel.type(typed)
    panel.stopped(before)
    at_rest(panel)


def test_keys_read_before_a_stop_do_nothing_after_it(panel: PtyPanel) -> None:
    for key in ("r", "\x1b[A", "x", "o", "T", "v"):
        panel.arm()
        before = len(panel.log.writes)
        panel.type(key, " ", apart=0.01)
        panel.stopped(before)


PASTES = ["bar", "cd /var/run && ./fork.sh --verbose 30 a r\r", "r30\r", "arf30\ryy\r"]


@pytest.mark.parametrize("armed", [True, False], ids=["armed", "unarmed"])
@pytest.mark.parametrize("text", PASTES)
def test_unbracketed_paste_cut_anywhere_only_stops(panel: PtyPanel, text: str, armed: bool) -> None:
    chance = random.Random(text)
    cuts = sorted(chance.sample(range(1, len(text)), min(6, len(text) - 1)))
    for cut in cuts:
        panel.type(F12)  # whatever the paste before has opened or armed
        panel.settle(0.2)
        if armed:
            panel.arm()
        before = len(panel.log.writes)
        panel.type(text[:cut], text[cut:], apart=chance.choice(PAUSES))
        panel.settle(LINE_SETTLED)
        panel.stops(before)
        leave_questions(panel)


@pytest.mark.parametrize("armed", [True, False], ids=["armed", "unarmed"])
def test_random_burst_cut_anywhere_only_stops(panel: PtyPanel, armed: bool) -> None:
    chance = random.Random(armed)
    for _ in range(4):
        if armed:
            panel.arm()
        keys = b"".join(chance.choices([*RANDOM_KEYS, b" "], k=300))
        cut = chance.randrange(len(keys))
        before = len(panel.log.writes)
        panel.type(keys[:cut], keys[cut:], apart=chance.choice(PAUSES))
        panel.settle(LINE_SETTLED)
        panel.type(F12)
        panel.stopped(before, seconds=1.0)
        leave_questions(panel)


def leave_questions(panel: PtyPanel) -> None:
    """Back to Monitor, out of whatever keys have opened."""
    for key in ("\x1b", "\x1b", "2"):
        panel.type(key)
        panel.settle(0.3)
    panel.shows("Output", "Current")


def test_spaced_keys_on_a_hung_link_are_ignored_and_reported(panel: PtyPanel) -> None:
    before = len(panel.log.writes)
    panel.type("arrv")  # typed 2 s apart, delivered together
    panel.shows("Ignored 4 keys that arrived")
    panel.settle()
    assert panel.log.writes[before:] == []
    assert not panel.armed


def stage_a_ramp(panel: PtyPanel) -> None:
    """Stage another ACC on Parameters."""
    panel.type("3")
    panel.shows("/ search")
    panel.open_search()
    panel.type("ACC")
    panel.shows("/ ACC")
    panel.type("\r")
    panel.shows("Enter Stage")
    panel.settle(LINE_SETTLED)
    panel.type("\x1b[A")
    panel.shows("3.1")
    panel.type("\r")
    panel.shows("1 staged")


@pytest.mark.parametrize("key", ["q", "n", "\x1b", "\r", " ", "wy"])
def test_only_y_writes_a_parameter(fresh_panel: PtyPanel, key: str) -> None:
    panel = fresh_panel
    stage_a_ramp(panel)
    panel.arm()
    panel.settle(0.2)
    panel.type("w")
    panel.shows("Write 1 parameter")
    panel.settle(LINE_SETTLED)
    before = len(panel.log.writes)
    panel.type(key)
    if key == " ":
        panel.stopped(before)
    panel.settle()
    panel.stops(before)


def test_single_y_writes_a_parameter(fresh_panel: PtyPanel) -> None:
    panel = fresh_panel
    stage_a_ramp(panel)
    panel.arm()
    panel.settle(0.2)
    panel.type("w")
    panel.shows("Write 1 parameter")
    panel.settle(LINE_SETTLED)
    panel.type("y")
    wait_until(lambda: panel.look() and Write(1, 9001, (31,)) in panel.log.writes, "the write")


@pytest.mark.parametrize("key", ["q", "n", "\x1b", "\r", " "])
def test_only_y_restores_factory_settings(fresh_panel: PtyPanel, key: str) -> None:
    panel = fresh_panel
    panel.type("3")
    panel.shows("/ search")
    panel.type("a")
    wait_until(lambda: panel.armed, "armed")
    panel.type("F")
    panel.shows("factory settings?")
    panel.settle(LINE_SETTLED)
    before = len(panel.log.writes)
    panel.type(key)
    if key == " ":
        panel.stopped(before)
    panel.settle()
    panel.stops(before)


def test_space_stops_while_a_number_is_typed(fresh_panel: PtyPanel) -> None:
    panel = fresh_panel
    panel.run()
    panel.type("3")
    panel.shows("/ search")
    panel.open_search()
    panel.type("ACC")
    panel.settle(0.3)
    panel.type("\r")
    panel.shows("Enter Stage")
    panel.settle(0.4)
    panel.type("4x")
    panel.shows("4x")
    before = len(panel.log.writes)
    panel.type(" ")
    wait_until(lambda: panel.look() and panel.stops(before) > 0, "the stop")
    at_rest(panel)
    panel.stops(before)


@pytest.mark.parametrize(
    ("pieces", "apart"),
    [(("\x1b ",), 0.0), (("\x1b", " "), 0.02), (("AC\r ",), 0.0), (("AC\t", " "), 0.02)],
)
def test_space_after_a_key_that_leaves_a_field_stops(
    fresh_panel: PtyPanel, pieces: tuple[str, ...], apart: float
) -> None:
    panel = fresh_panel
    panel.run()
    name_of_file(panel)
    before = len(panel.log.writes)
    panel.type(*pieces, apart=apart)
    wait_until(lambda: panel.look() and panel.stops(before) > 0, "the stop")
    at_rest(panel)


def name_of_file(panel: PtyPanel) -> None:
    """Open the question for the name of a file, in which a space is text."""
    panel.type("7")
    panel.shows("frames, j to find")
    panel.type("\x13")
    panel.shows("Save the frames")
    panel.settle(0.5)


def test_space_stops_in_a_search(fresh_panel: PtyPanel) -> None:
    panel = fresh_panel
    panel.run()
    panel.type("3")
    panel.shows("/ search")
    panel.open_search()
    panel.type("of-a")
    panel.shows("of-a", "Space STOP 1")
    before = len(panel.log.writes)
    panel.type(" ")
    wait_until(lambda: panel.look() and panel.stops(before) > 0, "the stop")
    at_rest(panel)


def test_space_is_text_in_a_field(fresh_panel: PtyPanel) -> None:
    panel = fresh_panel
    name_of_file(panel)
    panel.type("of a")
    panel.shows("of a", "F12 STOP 1")
    assert "Space STOP" not in panel.text()
    panel.type(" ")
    panel.settle(0.2)
    panel.type("b")
    panel.shows("of a b")
    assert panel.log.writes == []


@pytest.mark.parametrize("seed", [7, 9])
def test_bursts_with_a_stop_run_nothing_after_it(fresh_panel: PtyPanel, seed: int) -> None:
    counted = Counted()
    bursts(fresh_panel, random.Random(seed), 30, counted)
    assert (counted.pieces, counted.stopless) == (30, 0)
    assert counted.still_armed == 0
    moved = counted.runs_after_stop, counted.references_after_stop, counted.other_writes
    assert moved == (0, 0, 0)


def test_random_keys_write_nothing_while_disarmed(fresh_panel: PtyPanel) -> None:
    counted = Counted()
    unarmed(fresh_panel, random.Random(8), 1000, counted, MIXED)
    assert counted.keys == 1000
    moved = counted.runs_after_stop, counted.references_after_stop, counted.other_writes
    assert moved == (0, 0, 0)
    assert fresh_panel.look(), "the panel has ended"
