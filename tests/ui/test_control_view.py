"""The lines of the Control screen, without a screen."""

from __future__ import annotations

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any, cast

import pytest
from rich.text import Text

from tests.drive.test_channels import IDLE
from tests.drive.test_signal_path import ATV71, LI5, LIVE
from tui.drive.values import NOT_AVAILABLE
from tui.safety import LOOK_IS_OLD
from tui.screens.control import view as control_view
from tui.screens.control.switch_view import LEAST_WIDTH, drawing, hints, written_paths
from tui.screens.control.view import LEFT_ROWS, headed_lines, left_lines
from tui.session.control_paths import ControlPaths
from tui.terminal.few_colors import in_encoding
from tui.widgets.palette import PLAIN, STRONG

from . import fakes

LEFT = (
    "Running since 17:34. Started by run, process 4711, which has exited. No program commands it."
)


def test_motor_without_a_commander_is_shown_with_the_keys() -> None:
    lines = [line.plain for line in left_lines(LEFT, 80)]
    text = " ".join(line.strip() for line in lines)
    assert text.startswith(LEFT)
    assert "Press Space to stop it" in text
    assert "T on Monitor to take it over" in text
    assert 1 < len(lines) <= LEFT_ROWS
    assert all(line.startswith("  ") and len(line) <= 80 for line in lines)


def test_motor_with_a_commander_has_no_extra_line() -> None:
    assert left_lines("", 80) == []


class MovedClock(fakes.StillClock):
    """A clock that is some seconds later."""

    later = 0.0

    def monotonic(self) -> float:
        """The moment of the fakes, and that much later."""
        return fakes.NOW + self.later


SIZES = [(60, 16), (70, 24), (80, 24), (120, 40), (200, 60)]
FULL: dict[str, tuple[str, Mapping[str, int]]] = {
    case: (family, raws) for case, (family, raws, *_) in LIVE.items()
} | {"atv31": ("atv31", IDLE), "atv312 L1": ("atv312", {**IDLE, "LAC": 0})}


def paths_of(family: str, raws: Mapping[str, int], clock: MovedClock) -> ControlPaths:
    console = fakes.console_of(None, family=family, clock=clock)
    for code, raw in raws.items():
        console.session.image.confirm(code, raw, fakes.NOW)
    return ControlPaths(console.session)


def bright(line: Text) -> str:
    """The bright part of a line."""
    return "".join(line.plain[s.start : s.end] for s in line.spans if s.style == STRONG)


def drawn(paths: ControlPaths, width: int = 80) -> list[Text]:
    return drawing(paths, "40.0", PLAIN, width)


def test_live_path_is_bright_from_its_source_to_the_motor() -> None:
    raws = {**ATV71, "CHCF": 2, "CCC": 1, "CCS": LI5, "LRS7": 0b0101, "IL1R": 1}
    lines = drawn(paths_of("atv71", raws, MovedClock()))
    assert lines[1].plain.startswith("  FR1 Modbus       40.0 Hz ━━● RFC FR1")
    assert lines[5].plain.startswith("  CD1 Terminals        LI1 ━━● CCS LI5")
    assert bright(lines[1]).startswith("FR1 Modbus")
    assert "FR2" not in bright(lines[3])
    assert bright(lines[5]).startswith("CD1 Terminals")
    assert "CD2" not in bright(lines[7])
    for row in (2, 6):
        assert lines[row].plain.count("━") > 30
        assert "─" not in lines[row].plain
    assert "┣━" in lines[4].plain


def test_second_contact_is_bright_alone() -> None:
    lines = drawn(paths_of("atv71", {**ATV71, "CCC": 1, "CRC": 1, "RFC": 97}, MovedClock()))
    assert bright(lines[3]).startswith("FR2 AI1")
    assert "FR1" not in bright(lines[1])
    assert bright(lines[7]).startswith("FR2 Terminals")
    assert "RFC FR2" in lines[1].plain
    assert "╱●━" in lines[2].plain


def test_source_beside_a_later_switch_is_bright_alone() -> None:
    raws = {**ATV71, "CCC": 1, "CRC": 1, "FLO": 129, "IL1R": 1}
    lines = drawn(paths_of("atv71", raws, MovedClock()))
    assert "FLO LI1 on" in lines[1].plain
    assert "┗ FLOC AI1" in bright(lines[3])
    assert "┏━" in lines[2].plain
    assert "FR1" not in bright(lines[1])
    assert "╲○─" in lines[2].plain


@pytest.mark.parametrize("case", FULL)
def test_old_values_light_nothing(case: str) -> None:
    clock = MovedClock()
    family, raws = FULL[case]
    paths = paths_of(family, raws, clock)
    clock.later = LOOK_IS_OLD + 0.1
    for line in (*drawn(paths), *written_paths(paths, 60)):
        assert not bright(line)
        assert not set(line.plain) & set("━┏┓┗┛┣┃")
    assert all("not read" in line.plain for line in hints(paths, 200))


def test_unread_value_is_named_and_lights_nothing() -> None:
    raws = {code: raw for code, raw in ATV71.items() if code != "RFC"}
    paths = paths_of("atv71", raws, MovedClock())
    lines = drawn(paths)
    assert "RFC -----" in lines[1].plain
    assert "?○─" in lines[2].plain
    assert not "".join(bright(line) for line in lines)
    [hint] = hints(paths, 80)
    assert hint.plain.strip() == (
        "The source of the reference and the command is not known: RFC was not read."
    )


def test_hint_names_the_steps_that_make_this_line_the_source() -> None:
    raws = {**ATV71, "CHCF": 2, "CCC": 1}
    [hint] = hints(paths_of("atv71", raws, MovedClock()), 100)
    assert hint.plain.strip() == (
        "Command by Modbus: set CD1 to Modbus or set CCS to Command channel 2."
    )
    assert [line.plain.strip() for line in hints(paths_of("atv71", ATV71, MovedClock()), 80)] == [
        "CHCF combined: the reference channel commands too."
    ]


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("case", FULL)
def test_no_text_of_a_path_is_cut_at_any_size(case: str, size: tuple[int, int]) -> None:
    family, raws = FULL[case]
    paths = paths_of(family, raws, MovedClock())
    width = size[0]
    lines = drawn(paths, width) if width >= LEAST_WIDTH else written_paths(paths, width)
    for line in (*lines, *hints(paths, width)):
        assert line.cell_len <= width
        assert "…" not in line.plain or "ETI" in line.plain, line.plain
        assert in_encoding(line.plain, "ascii").isascii()
        assert "?" not in in_encoding(line.plain.replace("?", ""), "ascii"), line.plain


@pytest.mark.parametrize("width", [60, 80])
def test_head_lines_are_never_cut(width: int) -> None:
    long = "E " * 40 + "end of a long trouble"
    text = headed_lines("Timeout", [("TTO 10 s", STRONG), (long, PLAIN), ("last", PLAIN)], width)
    assert all(line.cell_len <= width for line in text)
    joined = " ".join(line.plain.strip() for line in text)
    assert "end of a long trouble" in joined
    assert joined.endswith("last")


@pytest.mark.parametrize(
    ("has_word", "error", "read", "shown"),
    [
        (True, "", True, "now Modbus"), (False, "", True, NOT_AVAILABLE),
        (True, "no answer", True, NOT_AVAILABLE), (True, "", False, NOT_AVAILABLE),
    ],
)  # fmt: skip
def test_commander_is_that_of_the_channel_word_if_it_was_read(
    has_word: bool, error: str, read: bool, shown: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    word = SimpleNamespace(code="C")
    monkeypatch.setattr(control_view, "channel_text", lambda parameter, value: f"{value}")
    words = {"command_channel": word} if has_word else {}
    profile = SimpleNamespace(quantity=words.get)

    def drawn(now: float, **ways: Any) -> str:
        assert (now, ways["missing"]) == (5.0, NOT_AVAILABLE)
        assert ways["old"]("Modbus", 3.0) == "was Modbus"
        assert ways["current"]("") == NOT_AVAILABLE
        return f"now {ways['current']('Modbus')}"

    readings = {"C": SimpleNamespace(drawn=drawn)} if read else {}
    latest = SimpleNamespace(error=error, readings=readings, time=5.0)
    assert control_view._channel(cast(Any, profile), cast(Any, latest)) == shown
    assert control_view._channel(cast(Any, profile), None) == NOT_AVAILABLE
