"""Effects of a person, a terminal and a link on a panel, seen from the line."""

from __future__ import annotations

import random
from collections.abc import Iterator

import pytest

from tests.limits import BURST_GAP
from tests.programs import wait_until
from tests.terminal.dialect_tables import DIALECTS
from tui.terminal.dialects import ESCAPE_DELAY

from .pty_panel import REFERENCE, SPLIT, STOP, PtyPanel, Write, panel_on_a_pty

MOUSE = [b"\x1b[?1000h", b"\x1b[?1003h", b"\x1b[?1006h", b"\x1b[?1015h"]
NEVER_UNASKED = [*MOUSE, b"\x1b[?1002h", b"\x1b[?1016h", b"\x1b[?1004h", b"\x1b[>", b"\x1b]22;"]

RANDOM_KEYS = [bytes([code]) for code in range(33, 127)]
RANDOM_KEYS += [
    b"\r",
    b"\t",
    b"\x7f",
    b"\x1b[A",
    b"\x1b[B",
    b"\x1b[5~",
    b"\x1bOP",
    b"\x1b",
    b"\x10",
]


def ways(sequence: str) -> Iterator[tuple[tuple[str, ...], float]]:
    """Whole, and in two writes at every place: near, and after ESC was taken for a key."""
    yield (sequence,), 0.0
    for cut in range(1, len(sequence)):
        yield (sequence[:cut], sequence[cut:]), SPLIT
    for cut in (1, 2):
        yield (sequence[:cut], sequence[cut:]), ESCAPE_DELAY + 0.1


@pytest.mark.parametrize("dialect", DIALECTS)
@pytest.mark.parametrize("number", [9, 12])
def test_stop_keys_of_every_terminal_only_stop(panel: PtyPanel, dialect: str, number: int) -> None:
    for pieces, gap in ways(DIALECTS[dialect][number - 1]):
        before = len(panel.log.writes)
        panel.type(*pieces, apart=gap)
        wait_until(lambda b=before: panel.look() and panel.stops(b) > 0, f"{pieces} stop")  # type: ignore[misc]
        panel.settle(2 * BURST_GAP)
        panel.stops(before)
        assert "only drive" not in panel.text()
        if pieces[0] == "\x1b" and gap > ESCAPE_DELAY:
            # an ESC that nothing followed in time is the key Escape
            panel.shows("Lines  ●")
            panel.type("2")
        panel.shows("Output", "a arm")


@pytest.mark.parametrize("dialect", DIALECTS)
def test_other_function_keys_of_every_terminal_type_nothing(panel: PtyPanel, dialect: str) -> None:
    before = len(panel.log.writes)
    for sequence in (DIALECTS[dialect][n - 1] for n in (2, 3, 4, 5, 6, 7, 8, 10, 11)):
        for cut in range(len(sequence)):
            panel.type(*filter(None, (sequence[:cut], sequence[cut:])))
            panel.settle(BURST_GAP + 0.02)
    panel.shows("Output", "a arm")
    assert len(panel.log.writes) == before
    assert "only drive" not in panel.text()
    assert "at once" not in panel.text()


@pytest.mark.parametrize(
    "typed", ["r ", "r\r ", "\x1b[A\x1b[Ar ", "ar ", "30\r\x1b[24~", "f30\r ", " r", "r \r"]
)
@pytest.mark.parametrize("armed", [True, False], ids=["armed", "unarmed"])
def test_keys_written_together_with_a_stop_only_stop(
    panel: PtyPanel, typed: str, armed: bool
) -> None:
    if armed:
        panel.arm()
    before = len(panel.log.writes)
    panel.type(typed)
    panel.stopped(before)
    panel.shows("Output", "a arm")


@pytest.mark.parametrize("armed", [True, False], ids=["armed", "unarmed"])
@pytest.mark.parametrize("seed", range(3))
def test_unbracketed_paste_only_stops(panel: PtyPanel, armed: bool, seed: int) -> None:
    if armed:
        panel.arm()
    chance = random.Random(seed)
    keys = [chance.choice(RANDOM_KEYS) for _ in range(300)]
    keys[chance.randrange(300)] = b" "
    cut = chance.randrange(300)
    before = len(panel.log.writes)
    panel.type(b"".join(keys[:cut]), b"".join(keys[cut:]))
    panel.stopped(before, seconds=1.5)
    panel.shows("Output", "a arm")


def test_bracketed_paste_does_nothing(panel: PtyPanel) -> None:
    panel.arm()
    before = len(panel.log.writes)
    text = "\x1b[200~r  v\rq\x1b[201~"
    for cut in range(1, len(text)):
        panel.type(text[:cut], text[cut:])
    panel.settle()
    assert panel.log.writes[before:] == []
    panel.shows("Output", "a arm")


def test_ignored_keys_are_reported(fresh_panel: PtyPanel) -> None:
    fresh_panel.type("bar")
    fresh_panel.shows("Ignored 3 keys that arrived")


def test_single_key_runs_the_motor_and_joined_arrows_are_one_step(fresh_panel: PtyPanel) -> None:
    panel = fresh_panel
    panel.run(30)
    before = len(panel.log.writes)
    panel.type("\x1b[A\x1b[A\x1b[A")
    wait_until(lambda: panel.look() and len(panel.log.writes) > before, "a reference")
    panel.settle()
    assert panel.log.writes[before:] == [Write(1, REFERENCE, (310,))]
    panel.type(" ")
    wait_until(lambda: panel.look() and STOP in panel.log.writes[before:], "the stop")


def test_paste_into_a_field_is_text_and_submits_nothing(fresh_panel: PtyPanel) -> None:
    panel = fresh_panel
    panel.type("3")
    panel.shows("/ search")
    panel.open_search()
    panel.type("\x1b[200~acceler r\r\x1b[201~")
    panel.shows("acceler r")
    panel.settle()
    assert panel.log.writes == []
    panel.type("\x7f\x7f")
    panel.shows("acceler ")


def test_key_too_close_to_the_one_that_opens_a_screen_is_reported(fresh_panel: PtyPanel) -> None:
    panel = fresh_panel
    panel.type("3", "/", "A")
    panel.shows("Ignored")
    panel.settle()
    assert "Enter list" not in panel.text()
    panel.open_search()


@pytest.mark.parametrize("options", [(), ("--mouse",)], ids=["without mouse", "with mouse"])
def test_mouse_is_requested_only_with_the_option(options: tuple[str, ...]) -> None:
    with panel_on_a_pty(*options) as panel:
        panel.type("q")
        wait_until(lambda: not panel.look(), "the panel ends")
        if options:
            assert all(code in panel.sent for code in [*MOUSE, b"\x1b[>"])
        else:
            assert [code for code in NEVER_UNASKED if code in panel.sent] == []
            assert b"\x1b[<u" not in panel.sent
            assert b"\x1b[?1000l" in panel.sent  # what another program may have left
