"""What tui/terminal uses of Textual that Textual does not promise; where it went, this tells.

Looked at with Textual 8.2.8. Where a check fails after an update, look at the named module and at
what Textual does now, before the versions in pyproject.toml are changed.
"""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from packaging.requirements import Requirement

import tui.terminal

ROOM = Path(tui.terminal.__file__).parent
PROJECT = ROOM.parents[1] / "pyproject.toml"

VERSIONS = "<9,>=8.2"
"""The versions of Textual that were looked at."""


class Part(NamedTuple):
    """A private part of Textual, and whether it is still what is made of it here."""

    name: str
    used_in: str
    still: Callable[[], bool]


def _source(member: str) -> str:
    from textual.drivers.linux_driver import LinuxDriver

    return inspect.getsource(getattr(LinuxDriver, member))


def _key_table() -> bool:
    from textual._ansi_sequences import ANSI_SEQUENCES_KEYS, IGNORE_SEQUENCE
    from textual.keys import Keys

    table = ANSI_SEQUENCES_KEYS
    listed = table["\x1b[24~"] == (Keys.F12,) and table["\x1bOp"] == "0"
    return listed and table["\x1b[G"] is IGNORE_SEQUENCE


def _kitty_table() -> bool:
    from textual._keyboard_protocol import FUNCTIONAL_KEYS

    wanted = {"24~": "f12", "1A": "up", "13u": "enter", "1P": "f1"}
    return wanted.items() <= FUNCTIONAL_KEYS.items()


def _character_names() -> bool:
    from textual.keys import _character_to_key

    return _character_to_key("?") == "question_mark" and _character_to_key("r") == "r"


def _parser_of_reports() -> bool:
    from textual import events, messages
    from textual._xterm_parser import XTermParser

    parser = XTermParser()
    (place,) = parser.feed("\x1b[3;5R")
    (size,) = parser.feed("\x1b[48;24;80;480;800t")
    (mode,) = parser.feed("\x1b[?2026;2$y")
    return (
        isinstance(place, events.CursorPosition)
        and isinstance(size, events.Resize)
        and isinstance(mode, messages.TerminalSupportsSynchronizedOutput)
    )


def _driver_is_chosen_by_name() -> bool:
    from textual.app import App

    from tui.terminal.driver import POSIX

    return POSIX in {kind.__name__ for kind in App[None]().get_driver_class().__mro__}


def _driver_reads_in_a_thread() -> bool:
    return "self.run_input_thread()" in _source("_run_input_thread") and all(
        name in _source("run_input_thread")
        for name in ("self.fileno", "self.exit_event.is_set()", "self.process_message(event)")
    )


def _driver_asks_in_writes_of_their_own() -> bool:
    start, stop = _source("start_application_mode"), _source("stop_application_mode")
    return (
        r'self.write("\x1b[?1004h")' in start
        and r'self.write(f"\x1b[>{KITTY_PROTOCOL_FLAG}u")' in start
        and r'self.write("\x1b[<u")' in stop
    )


def _driver_heeds_mouse() -> bool:
    from textual.drivers.linux_driver import LinuxDriver

    taken = inspect.signature(LinuxDriver.__init__).parameters
    return "mouse" in taken and "if not self._mouse" in _source("_enable_mouse_support")


def _pointer_shape() -> bool:
    from textual.app import App

    written = inspect.getsource(App._set_pointer_shape)
    return r'f"\x1b]22;{shape}\x07"' in written and "self._driver.write(shape_sequence)" in written


def _driver_knows_its_app() -> bool:
    from textual.driver import Driver

    return "self._app = app" in inspect.getsource(Driver.__init__)


def _events_carry_more() -> bool:
    from textual.events import Key

    from tui.terminal.stroke import Stroke, attach, stroke_of

    event: Any = Key("r", "r")
    attach(event, stroke := Stroke(0.0, None))
    return stroke_of(event) is stroke and stroke_of(Key("r", "r")) is None


def _keys_go_through_the_app_first() -> bool:
    from textual.app import App

    source = inspect.getsource(App.on_event)
    return "not event.is_forwarded" in source and "forward_target._forward_event(event)" in source


PARTS = [
    Part("textual._ansi_sequences.ANSI_SEQUENCES_KEYS", "names.py", _key_table),
    Part("textual._keyboard_protocol.FUNCTIONAL_KEYS", "names.py", _kitty_table),
    Part("textual.keys._character_to_key", "names.py", _character_names),
    Part("textual._xterm_parser.XTermParser", "driver.py", _parser_of_reports),
    Part("textual.drivers.linux_driver.LinuxDriver", "driver.py", _driver_is_chosen_by_name),
    Part("LinuxDriver.run_input_thread", "driver.py", _driver_reads_in_a_thread),
    Part("LinuxDriver.write", "driver.py", _driver_asks_in_writes_of_their_own),
    Part("LinuxDriver(mouse=)", "driver.py", _driver_heeds_mouse),
    Part("App._set_pointer_shape", "driver.py", _pointer_shape),
    Part("Driver._app", "driver.py", _driver_knows_its_app),
    Part("textual.events.Key.__dict__", "stroke.py", _events_carry_more),
    Part("App.on_event", "type_ahead.py", _keys_go_through_the_app_first),
]


def test_the_versions_of_textual_are_those_that_were_looked_at() -> None:
    import tomli

    needed = tomli.loads(PROJECT.read_text(encoding="utf-8"))["project"]["dependencies"]
    asked = next(one for one in map(Requirement, needed) if one.name == "textual")
    assert str(asked.specifier) == VERSIONS, "look at every part below, then change VERSIONS"
    assert asked.specifier.contains(version("textual"))


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.name)
def test_a_private_part_of_textual_is_what_it_was(part: Part) -> None:
    told = (
        f"Textual {version('textual')}: {part.name} is not what tui/terminal/{part.used_in} needs"
    )
    try:
        still = part.still()
    except (ImportError, AttributeError, KeyError, TypeError, ValueError) as gone:
        pytest.fail(f"{told}: {gone!r}")
    assert still, told


def test_every_private_module_of_textual_that_is_used_is_named_here() -> None:
    used = {
        found
        for path in ROOM.glob("*.py")
        for found in re.findall(r"textual\.(_\w+)", path.read_text(encoding="utf-8"))
    }
    named = {found for part in PARTS for found in re.findall(r"textual\.(_\w+)", part.name)}
    assert used == named
