"""Opening of the panel by the command line: its arguments, its terminal, its exit status."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any
from unittest.mock import Mock, call

import pytest

from tui.cli import opening
from tui.session.connect import open_line
from tui.session.signals import BY_SIGNAL
from tui.terminal.abilities import abilities_of, fewer_colors, given_environment


class Panel:
    """Records what it is made of, and texts on it."""

    return_code: int | None = None
    came: int = 0

    def __init__(self, **given: Any) -> None:
        self.given = given
        self.texts: list[str] = []
        self.steps: list[str] = []
        made.append(self)

    def tell(self, text: str) -> None:
        self.texts.append(text)

    def run(self) -> None:
        assert os.environ["TEXTUAL_ANIMATIONS"] == "none"
        self.steps.append(f"run on {os.environ['TERM']}, garbage {gc.isenabled()}")


made: list[Panel] = []


@pytest.fixture(autouse=True)
def stage(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A panel that is not drawn, in a terminal with colors."""

    @contextmanager
    def suspended(tell: Callable[[str], None]) -> Iterator[None]:
        tell("Not suspended.")
        yield

    @contextmanager
    def ending(panel: Panel, *, stop: bool) -> Iterator[list[int]]:
        panel.steps.append(f"a signal stops: {stop}")
        yield [panel.came] if panel.came else []

    made.clear()
    monkeypatch.delenv("TEXTUAL_ANIMATIONS", raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setattr("tui.app.DrivePanelApp", Panel)
    monkeypatch.setattr("tui.terminal.loop.soon_in_loop", lambda _, call, *words: call(*words))
    monkeypatch.setattr(opening, "never_suspended", suspended)
    monkeypatch.setattr(opening, "ending_by_signal", ending)
    monkeypatch.setattr(opening, "_come_to_the_front", lambda: made[-1].steps.append("to front"))
    yield
    gc.enable()


def test_panel_is_made_as_requested() -> None:
    assert opening.open_panel("/dev/ttyUSB0", 3) == 0
    assert opening.open_panel(
        "demo", None, read_only=True, low_bandwidth=True, on_hangup="leave-running", mouse=True,
        bell=False, ascii=True,
    ) == 0  # fmt: skip
    plain, other = (panel.given for panel in made)
    environment = given_environment(os.environ)
    usual = abilities_of(environment, written_as=sys.stderr.encoding, ascii=None)
    assert (plain["abilities"], plain["low_bandwidth"]) == (usual, False)
    shown = abilities_of(environment, written_as=sys.stderr.encoding, ascii=True)
    assert other["abilities"] == fewer_colors(shown) != plain["abilities"]
    assert plain["open_line"] is open_line.open_line
    assert other["open_line"] is opening._open_with_demo
    for given in (plain, other):
        assert given["on_shown"] is opening.collect_garbage
        assert given["drive_documents"] is opening._drive_documents
    names = ("start", "device", "read_only", "leave_running", "mouse", "bell", "low_bandwidth")
    assert [plain[name] for name in names] == ["/dev/ttyUSB0", 3, False, False, False, True, False]
    assert [other[name] for name in names] == ["demo", None, True, True, True, False, True]
    assert [panel.texts for panel in made] == [["Not suspended. Press q to quit."]] * 2
    first = "run on xterm-256color, garbage False"
    assert made[0].steps == ["to front", "a signal stops: True", first]
    assert made[1].steps == ["to front", "a signal stops: False", first]


@pytest.mark.parametrize("terminal", ["", "dumb", "unknown"])
def test_terminal_on_which_nothing_would_be_drawn_is_a_vt100(
    terminal: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TERM", terminal)
    opening.open_panel(None, None)
    assert made[0].steps[-1] == "run on vt100, garbage False"


def test_exit_status_is_that_of_the_signal_or_the_panel(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Panel, "return_code", 4)
    assert opening.open_panel(None, None) == 4
    monkeypatch.setattr(Panel, "came", signal.SIGTERM)
    assert opening.open_panel(None, None) == BY_SIGNAL + signal.SIGTERM


def test_demo_is_a_line_of_the_panel_and_others_are_opened_as_written(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    demo, other = Mock(), Mock()
    monkeypatch.setattr(open_line, "demo_line", demo)
    monkeypatch.setattr(open_line, "open_line", other)
    assert opening._open_with_demo("demo", read_only=True) is demo.return_value
    (drives,) = demo.call_args.args
    assert {id: type(hertz) for id, hertz in drives.items()} == dict.fromkeys(drives, float)
    given: dict[str, Any] = {"read_only": True, "wait": 2.0, "program": "panel"}
    assert opening._open_with_demo("tcp:h", **given) is other.return_value
    assert other.call_args_list == [call("tcp:h", **given)]


def test_garbage_is_collected_less_often_once_the_panel_is_shown() -> None:
    before = gc.get_threshold()
    gc.disable()
    try:
        opening.collect_garbage()
        assert gc.isenabled()
        assert gc.get_threshold() == (opening.YOUNGEST, *before[1:])
        assert gc.get_freeze_count() > 0
    finally:
        gc.set_threshold(*before)


class Stream:
    def __init__(self, terminal: bool) -> None:
        self.terminal = terminal

    def isatty(self) -> bool:
        return self.terminal


@pytest.mark.parametrize(
    ("terminals", "trouble"),
    [
        ((True, True, True), ""),
        ((False, True, True), "needs a terminal"),
        ((True, False, True), "needs a terminal"),
        ((True, True, False), "drawn on standard error"),
    ],
)
def test_panel_needs_a_terminal_on_all_streams(
    terminals: tuple[bool, ...], trouble: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    with monkeypatch.context() as patch:
        for name, terminal in zip(("stdin", "stdout", "stderr"), terminals, strict=True):
            patch.setattr(f"sys.{name}", Stream(terminal))
        found = opening.terminal_trouble()
    assert trouble in found if trouble else not found
