"""Bytes to keys with their strokes: stop keys, stamps, company."""

from __future__ import annotations

import random
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tui.terminal.reader import KeyReader, TerminalInput
from tui.terminal.stroke import Pressed
from tui.terminal.tokens import Paste, Report

from .dialect_tables import DIALECTS, REPLIES, REPORTS

LATER = 10.0


class Stops:
    """An app that counts its stops; with a text field in focus, Space is text."""

    def __init__(self, *, typing: bool = False, harmless: str = "", done_to: float = -1.0) -> None:
        self.typing = typing
        self.harmless = harmless
        """Keys that only show something."""
        self.done_to = done_to
        """When the last key was read that had its whole effect."""
        self.taken: list[str] = []

    def take_stop_key(self, key: str, left_at: float | None = None) -> bool:
        if key == "space" and self.typing and left_at is None:
            return False
        self.taken.append(key)
        return True

    def last_stop(self, error: Exception) -> None:
        self.failed = error

    def sequence_swallowed(self, data: bytes) -> None:
        """Unused in these tests."""

    def acts_at_once(self, key: str, character: str | None, *, begins: bool, after: float) -> bool:
        return key in self.harmless and begins and after <= self.done_to

    def stop_stamp(self) -> object:
        return len(self.taken)


def read(
    *reads: tuple[float, bytes], typing: bool = False
) -> tuple[list[str], list[Pressed], list[TerminalInput]]:
    """Result of reads at these times: stops, keys, and everything the app receives."""
    stops = Stops(typing=typing)
    reader, found = KeyReader(stops), list[TerminalInput]()
    for at, data in reads:
        while (deadline := reader.deadline) is not None and deadline < at - 0.001:
            found += reader.tick(deadline + 0.001)
        found += reader.read(data, at, stops.stop_stamp())
    found += reader.tick(LATER * 10)
    found += reader.tick(LATER * 20)
    assert reader.deadline is None
    return stops.taken, [paste for paste in found if isinstance(paste, Pressed)], found


def acting(keys: Sequence[Pressed], stamp: object) -> list[str]:
    """Keys that may act if no stop came since."""
    return [key.name for key in keys if key.stroke.acts and key.stroke.stamp == stamp]


def test_key_that_only_shows_something_does_not_wait() -> None:
    reader = KeyReader(Stops(harmless="2m"))
    (key,) = reader.read(b"2", 1.0, 0)
    assert isinstance(key, Pressed)
    assert (key.name, key.stroke.at_once, key.stroke.acts) == ("2", True, False)
    assert reader.deadline is None
    # the key before has not had its effect: this one waits
    assert reader.read(b"m", 2.0, 0) == []
    assert [key.stroke.acts for key in reader.tick(LATER) if isinstance(key, Pressed)] == [True]


def test_key_that_only_shows_something_overtakes_none() -> None:
    reader = KeyReader(Stops(harmless="2", done_to=LATER))
    assert reader.read(b"x2", 1.0, 0) == []
    keys = [key for key in reader.tick(LATER) if isinstance(key, Pressed)]
    assert [(key.name, key.stroke.acts) for key in keys] == [("x", False), ("2", False)]


def test_keys_after_an_immediate_key_are_a_burst() -> None:
    reader = KeyReader(Stops(harmless="2"))
    (first,) = reader.read(b"2", 1.0, 0)
    assert isinstance(first, Pressed)
    assert first.name == "2"
    assert reader.read(b"r\r", 1.04, 0) == []
    rest = [key for key in reader.tick(LATER) if isinstance(key, Pressed)]
    assert [(key.name, key.stroke.acts) for key in rest] == [("r", False), ("enter", False)]


@pytest.mark.parametrize("data", [b"2\t", b"2m", b"2\x1b", b"2\x1b["])
def test_key_with_more_in_its_read_waits(data: bytes) -> None:
    """Those keys have one time: a Space after Tab would be text once the 2 had its effect."""
    reader = KeyReader(Stops(harmless="2m", done_to=LATER))
    assert reader.read(data, 1.0, 0) == []


def test_stop_in_one_write_with_a_run_cancels_the_run() -> None:
    for sent in (b"r ", b"r\r ", b"\x1b[A\x1b[Ar ", b"ar ", b"30\r\x1b[24~", b"r \r", b" r\r"):
        taken, keys, _ = read((0.0, sent))
        assert len(taken) == 1, sent
        assert acting(keys, 1) == [], sent


def test_keys_before_and_after_a_stop_have_different_stamps() -> None:
    taken, keys, _ = read((0.0, b"r"), (1.0, b" "), (2.0, b"v"))
    assert taken == ["space"]
    assert [(key.name, key.stroke.stamp, key.stroke.alone) for key in keys] == [
        ("r", 0, True),
        ("v", 1, True),
    ]


def test_sequence_interrupted_by_a_stop_has_the_older_stamp() -> None:
    stops = Stops()
    reader = KeyReader(stops)
    reader.read(b"\x1b[", 1.0, stops.stop_stamp())
    stops.taken.append("f12")  # another source
    reader.read(b"A", 1.5, stops.stop_stamp())
    (key,) = [paste for paste in reader.tick(LATER) if isinstance(paste, Pressed)]
    assert (key.name, key.stroke.stamp, key.stroke.read_at) == ("up", 0, 1.0)


def test_space_in_a_text_is_text() -> None:
    taken, keys, _ = read((0.0, b"a b"), typing=True)
    assert taken == []
    assert [key.character for key in keys] == ["a", " ", "b"]


def test_keys_of_a_burst_have_its_size() -> None:
    _, keys, _ = read((0.0, b"bar"))
    assert [(key.stroke.piece, key.stroke.acts) for key in keys] == [(3, False)] * 3


@pytest.mark.parametrize("output", [*REPORTS.values(), *REPLIES.values()])
def test_terminal_reports_are_not_part_of_a_burst(output: str) -> None:
    for cut in range(len(output) + 1):
        first, second = output[:cut].encode(), output[cut:].encode()
        taken, keys, found = read((1.0, b"r" + first), (1.02, second))
        assert taken == []
        assert [(key.name, key.stroke.alone) for key in keys] == [("r", True)], (first, second)
        assert [paste for paste in found if not isinstance(paste, Pressed | Report)] == []


def test_key_close_to_an_escape_is_not_single() -> None:
    _, keys, _ = read((1.0, b"r"), (1.03, b"\x1b"))
    assert [(key.name, key.stroke.acts) for key in keys] == [("r", False), ("escape", False)]


@pytest.mark.parametrize("dialect", DIALECTS)
def test_f12_and_f9_act_immediately_in_every_dialect(dialect: str) -> None:
    for number, key in ((12, "f12"), (9, "f9")):
        sent = DIALECTS[dialect][number - 1].encode()
        taken, keys, _ = read((0.0, b"r" + sent + b"v"))
        assert taken == [key]
        assert acting(keys, 1) == []


@pytest.mark.parametrize("code", [b"\x9b", b"\x8f"])
def test_non_text_bytes_may_begin_a_sequence_but_are_never_keys(code: bytes) -> None:
    assert read((0.0, code + b"24~"))[0] == (["f12"] if code == b"\x9b" else [])
    for byte in (b"\xff", b"\xe9", b"\xc3", b"\x80"):
        taken, keys, _ = read((0.0, byte), (1.0, b" "), (2.0, b"\xc3"), (2.01, b"\xa9"))
        assert taken == ["space"]
        assert [key.name for key in keys] == ["é"]


def test_paste_is_text_and_stops_nothing() -> None:
    taken, keys, found = read((0.0, b"\x1b[200~a b\xff\nrun \x1b[201~"))
    assert (taken, keys) == ([], [])
    assert [paste.text for paste in found if isinstance(paste, Paste)] == ["a b?\nrun "]


def test_unbracketed_paste_of_random_keys_only_stops() -> None:
    chance = random.Random(12)
    typed = [bytes([code]) for code in range(32, 127)] + [b"\r", b"\t", b"\x7f"]
    typed += [b"\x1b[A", b"\x1bOP", b"\x1b[24~", b"\x1b"]
    for _ in range(50):
        text = b"".join(chance.choice(typed) for _ in range(300))
        cut = chance.randrange(len(text))
        taken, keys, _ = read((0.0, text[:cut]), (0.02, text[cut:]))
        assert taken
        assert acting(keys, len(taken)) == []


@given(
    st.lists(st.tuples(st.floats(0, 0.3), st.binary(max_size=20)), max_size=10),
    st.booleans(),
)
def test_random_bytes_never_crash(reads: list[tuple[float, bytes]], typing: bool) -> None:
    now, timed = 0.0, []
    for gap, data in reads:
        now += gap
        timed.append((now, data))
    _, keys, _ = read(*timed, typing=typing)
    for key in keys:
        assert key.stroke.alone or key.stroke.held or key.stroke.piece > 1


@pytest.mark.parametrize("keys", [b"\x1b ", b"ab\r ", b"ab\t ", b"\x1bOP ", b"\x1b[5~ "])
@pytest.mark.parametrize("cut", [None, 1, -1])
def test_space_after_a_key_that_may_leave_a_text_is_not_text(keys: bytes, cut: int | None) -> None:
    reads = [(1.0, keys)] if cut is None else [(1.0, keys[:cut]), (1.02, keys[cut:])]
    assert read(*reads, typing=True)[0] == ["space"]


@pytest.mark.parametrize("keys", [b"ab ", b"a\x7f ", b"ab\x1b[D ", b"\xc3\xa9 "])
def test_space_after_an_editing_key_is_text(keys: bytes) -> None:
    stops, pressed, _ = read((1.0, keys), typing=True)
    assert stops == []
    assert pressed[-1].name == "space"


@pytest.mark.parametrize("data", [b" ", b"\x1b[24~", b"\x1b[20~"])
@pytest.mark.parametrize("broken", ["Tokenizer.feed", "Bursts.stop", "KeyReader._sorted"])
def test_unreadable_keys_stop_every_drive_if_one_may_be_a_stop(
    monkeypatch: pytest.MonkeyPatch, data: bytes, broken: str
) -> None:
    def failing(*_: object) -> None:
        raise RuntimeError("planted")

    monkeypatch.setattr(f"tui.terminal.reader.{broken}", failing)
    stops = Stops()
    keys = KeyReader(stops)
    assert keys.read(data, 1.0) == []
    assert isinstance(stops.failed, RuntimeError)
    monkeypatch.undo()
    before = len(stops.taken)
    assert keys.read(b"\x1b[24~", 2.0) == []
    assert len(stops.taken) == before + 1, "the keys behind it are read again"
