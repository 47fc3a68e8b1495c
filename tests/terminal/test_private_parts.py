"""Private parts of Textual that tui/terminal uses; the checks show what changed.

Reviewed with Textual 8.2.8. If a check fails after an update, read the named module and the new
code of Textual, before the versions in pyproject.toml are changed. No other package of the project
uses such parts.
"""

from __future__ import annotations

import asyncio
import inspect
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from packaging.requirements import Requirement

import tui.terminal

from .private_uses import ROOM, Use, in_project, uses

FOLDER = Path(tui.terminal.__file__).parent
PROJECT = FOLDER.parents[1] / "pyproject.toml"

VERSIONS = {"textual": "<8.3,>=8.2", "pymodbus": "<3.17,>=3.16"}
"""The reviewed minor versions; a private part may change in the next."""


class Part(NamedTuple):
    """A private part of Textual, and the check that it is unchanged."""

    name: str
    used_in: str
    """The module of tui/terminal that rests on it."""
    look_at: str
    """Places to read in tui and in Textual if it has changed."""
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


def _driver_continues_by_opening_again() -> bool:
    from textual.drivers.linux_driver import LinuxDriver

    flags = [inspect.signature(getattr(LinuxDriver, f"_patch_{text}flag")) for text in "li"]
    return (
        "signal.signal(signal.SIGCONT, self._sigcont_application)" in _source("__init__")
        and all(list(flag.parameters) == ["attrs"] for flag in flags)
        and "2004h" in _source("_enable_bracketed_paste")
    )


def _driver_writes_to_a_file_in_a_thread() -> bool:
    return "self._file = sys.__stderr__" in _source(
        "__init__"
    ) and "WriterThread(self._file)" in _source("start_application_mode")


def _driver_heeds_mouse() -> bool:
    from textual.drivers.linux_driver import LinuxDriver

    taken = inspect.signature(LinuxDriver.__init__).parameters
    return "mouse" in taken and "if not self._mouse" in _source("_enable_mouse_support")


def _attributes_are_restored_if_known() -> bool:
    ends = _source("stop_application_mode")
    return "self.attrs_before = termios.tcgetattr" in _source("start_application_mode") and (
        "if self.attrs_before is not None:" in ends and ends.count("tcsetattr") == 1
    )


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


def _updates_of_the_compositor() -> bool:
    from rich.console import Console
    from textual._compositor import ChopsUpdate, CompositorUpdate, LayoutUpdate
    from textual.geometry import Region
    from textual.strip import Strip

    strip = Strip([])
    part = LayoutUpdate([[strip]], Region(2, 3, 4, 1))
    chops = ChopsUpdate([{0: strip}], [(0, 0, 4)], [[4]])
    return (
        isinstance(part, CompositorUpdate)
        and isinstance(chops, CompositorUpdate)
        and (part.strips, part.region) == ([[strip]], Region(2, 3, 4, 1))
        and (chops.chops, chops.spans, chops.chop_ends) == ([{0: strip}], [(0, 0, 4)], [[4]])
        and CompositorUpdate().render_segments(Console()) == ""
    )


def _screens_have_strips() -> bool:
    from textual._compositor import Compositor
    from textual.screen import Screen

    returns = inspect.signature(Compositor.render_strips).return_annotation
    return returns == "list[Strip]" and "self._compositor = Compositor()" in inspect.getsource(
        Screen.__init__
    )


def _updates_go_through_display() -> bool:
    from textual.app import App
    from textual.screen import Screen

    sends = inspect.getsource(App._display)
    requested = inspect.signature(App._display).parameters
    return (
        list(requested) == ["self", "screen", "renderable"]
        and "isinstance(renderable, CompositorUpdate)" in sends
        and "app._display(self, " in inspect.getsource(Screen)
    )


def _drawing_asks_whether_there_is_a_terminal() -> bool:
    from textual.app import App

    sends = inspect.getsource(App._display)
    app: Any = App[None]()
    conditions = ("self._batch_count", "self._running", "not self._closed", "self._driver is not")
    return all(condition in sends for condition in conditions) and (
        app._batch_count,
        app._running,
        app._closed,
        app._driver,
    ) == (0, False, False, None)


def _updates_have_a_beginning_and_an_end() -> bool:
    from textual.app import App

    sends = inspect.getsource(App._display)
    both = inspect.getsource(App._begin_update) + inspect.getsource(App._end_update)
    requested = both.count("if self._sync_available and self._driver is not None:") == 2
    return requested and "self._begin_update()" in sends and "self._end_update()" in sends


def _loop_is_there_while_the_app_runs() -> bool:
    from textual.app import App

    async def while_it_runs() -> bool:
        app = App[None]()
        idle: Any = app._loop
        async with app.run_test():
            return idle is None and app._loop is asyncio.get_running_loop()

    run = inspect.getsource(App.run) + inspect.getsource(App.run_async)
    return asyncio.run(while_it_runs()) and "app._loop = asyncio.get_running_loop()" in run


def _errors_are_handled_in_one_place() -> bool:
    from textual.app import App
    from textual.message_pump import MessagePump

    taken = list(inspect.signature(App._handle_exception).parameters)
    return taken == ["self", "error"] and (
        "self.app._handle_exception(error)" in inspect.getsource(MessagePump)
    )


def _tracebacks_are_made_in_one_place() -> bool:
    from textual.app import App

    made = "Traceback("
    others = inspect.getsource(App).replace(inspect.getsource(App._fatal_error), "")
    handles = inspect.getsource(App._handle_exception)
    return (
        made in inspect.getsource(App._fatal_error)
        and made not in others
        and "self.panic(error)" in handles
        and "self._fatal_error()" in handles
    )


def _an_error_closes_the_loop() -> bool:
    from textual.app import App

    close = "self._close_messages_no_wait()"
    return all(close in inspect.getsource(function) for function in (App._fatal_error, App.panic))


def _workers_are_made_in_one_place() -> bool:
    from textual.app import App
    from textual.worker_manager import WorkerManager

    made = inspect.getsource(WorkerManager._new_worker)
    return "self._workers = WorkerManager(self)" in inspect.getsource(App.__init__) and (
        "exit_on_error=exit_on_error" in made and "work,\n" in made
    )


def _one_loop_runs_the_app() -> bool:
    from textual.app import App
    from textual.message_pump import MessagePump

    runs = inspect.getsource(App._process_messages)
    loop = inspect.getsource(MessagePump._process_messages_loop)
    ended = runs.index("driver.stop_application_mode()")
    return runs.index("await self._process_messages_loop()") < ended and (
        "except CancelledError:\n                raise" in loop
    )


def _last_words_are_printed_at_the_end() -> bool:
    from textual.app import App

    ends = inspect.getsource(App._shutdown)
    return ends.index("events.Unmount()") < ends.index("self._print_error_renderables()")


def _options_are_laid_out_in_one_place() -> bool:
    from textual.widget import Widget
    from textual.widgets import OptionList

    lays_out = inspect.getsource(OptionList._update_lines)
    cache = OptionList()._line_cache
    return (
        (cache.lines, cache.heights, cache.index_to_line) == ([], {}, {})
        and "self.virtual_size = virtual_size" in lays_out
        and "self._scroll_update(virtual_size)" in lays_out
        and list(inspect.signature(Widget._scroll_update).parameters) == ["self", "virtual_size"]
        and all(
            "self._update_lines()" in inspect.getsource(function)
            for function in (OptionList.add_options, OptionList.clear_options)
        )
    )


def _drawn_options_are_dropped_in_one_place() -> bool:
    from textual.widgets import OptionList

    drops = inspect.getsource(OptionList._clear_caches)
    return "self._option_render_cache.clear()" in drops and "self._line_cache.clear()" in drops


def _prompt_is_set_without_drawing() -> bool:
    from textual.widgets.option_list import Option

    option = Option("before")
    option._set_prompt("after")
    return option.prompt == "after" and "refresh" not in inspect.getsource(Option._set_prompt)


PARTS = [
    Part(
        "textual._ansi_sequences.ANSI_SEQUENCES_KEYS",
        "names.py",
        "which sequences stand in Textual's table, and what stands for a key there",
        _key_table,
    ),
    Part(
        "textual._keyboard_protocol.FUNCTIONAL_KEYS",
        "names.py",
        "_modified and _typed: what the numbers of the kitty protocol are called",
        _kitty_table,
    ),
    Part(
        "textual.keys._character_to_key",
        "names.py",
        "of_character: how Textual names a key that types a character",
        _character_names,
    ),
    Part(
        "textual._xterm_parser.XTermParser",
        "driver.py",
        "_messages: what Textual makes of a terminal's reports",
        _parser_of_reports,
    ),
    Part(
        "textual.drivers.linux_driver.LinuxDriver",
        "driver.py",
        "with_own_keys: which driver App.get_driver_class gives; stop keys are read there",
        _driver_is_chosen_by_name,
    ),
    Part(
        "LinuxDriver.run_input_thread",
        "driver.py",
        "read_keys: which thread of Textual reads the keys, and how it ends",
        _driver_reads_in_a_thread,
    ),
    Part(
        "LinuxDriver._file",
        "driver.py",
        "ReadingDriver: where a thread of Textual writes, which must not end",
        _driver_writes_to_a_file_in_a_thread,
    ),
    Part(
        "LinuxDriver.write",
        "driver.py",
        "QuietDriver.write: how Textual asks a terminal for reports at its start and end",
        _driver_asks_in_writes_of_their_own,
    ),
    Part(
        "LinuxDriver._sigcont_application._patch_lflag._patch_iflag._enable_bracketed_paste",
        "driver.py",
        "ReadingDriver._take_back: what Textual does with the terminal after a suspension",
        _driver_continues_by_opening_again,
    ),
    Part(
        "LinuxDriver(mouse=)",
        "driver.py",
        "QuietDriver: what Textual asks of a terminal where no mouse is wanted",
        _driver_heeds_mouse,
    ),
    Part(
        "LinuxDriver.attrs_before",
        "held_input.py",
        "with_held_input: when Textual restores the attributes of a terminal",
        _attributes_are_restored_if_known,
    ),
    Part(
        "App._set_pointer_shape",
        "driver.py",
        "DROPPED_SEQUENCES: what Textual sends to give the mouse another shape",
        _pointer_shape,
    ),
    Part(
        "Driver._app",
        "driver.py",
        "read_keys and StoppingDriver: how a driver comes to the app that stops",
        _driver_knows_its_app,
    ),
    Part(
        "textual.events.Key.__dict__",
        "stroke.py",
        "attach: whether an event can carry what is known of its key",
        _events_carry_more,
    ),
    Part(
        "App.on_event",
        "type_ahead.py",
        "how App hands a key to the screen, and how it comes back from there",
        _keys_go_through_the_app_first,
    ),
    Part(
        "textual._compositor.ChopsUpdate, LayoutUpdate, CompositorUpdate",
        "lean.py",
        "strips_of: what the compositor hands over",
        _updates_of_the_compositor,
    ),
    Part(
        "Screen._compositor.render_strips",
        "lean.py",
        "screen_text: a screen as it was drawn last",
        _screens_have_strips,
    ),
    Part(
        "App._display",
        "lean_app.py",
        "LeanApp: the one place through which every picture goes to the terminal",
        _updates_go_through_display,
    ),
    Part(
        "App._batch_count._running._closed._driver",
        "lean_app.py",
        "LeanApp: when Textual itself sends an update, and when it lets it fall",
        _drawing_asks_whether_there_is_a_terminal,
    ),
    Part(
        "App._begin_update._end_update",
        "lean_app.py",
        "LeanApp: how Textual brackets what a terminal is to show at one time",
        _updates_have_a_beginning_and_an_end,
    ),
    Part(
        "App._loop",
        "loop.py",
        "soon_in_loop: where App keeps the loop that it runs in; a stop tells the screen by it",
        _loop_is_there_while_the_app_runs,
    ),
    Part(
        "App._handle_exception",
        "last_words.py",
        "LastWords: what an app does about an error of its own",
        _errors_are_handled_in_one_place,
    ),
    Part(
        "App._fatal_error",
        "last_words.py",
        "LastWords: where Textual renders the traceback of an error",
        _tracebacks_are_made_in_one_place,
    ),
    Part(
        "App._close_messages_no_wait",
        "last_words.py",
        "LastWords: how an error ends the loop of App",
        _an_error_closes_the_loop,
    ),
    Part(
        "App._workers",
        "last_words.py",
        "LastWords: which manager makes the workers of App",
        _workers_are_made_in_one_place,
    ),
    Part(
        "WorkerManager._new_worker",
        "last_words.py",
        "_Workers: the one place that makes a worker",
        _workers_are_made_in_one_place,
    ),
    Part(
        "App._return_code",
        "last_words.py",
        "LastWords: where App keeps its exit status",
        _errors_are_handled_in_one_place,
    ),
    Part(
        "App._process_messages_loop",
        "last_words.py",
        "LastWords: what App does between the end of its loop and the terminal",
        _one_loop_runs_the_app,
    ),
    Part(
        "App._driver",
        "last_words.py",
        "LastWords: where App keeps the driver, which gives the terminal back",
        _drawing_asks_whether_there_is_a_terminal,
    ),
    Part(
        "App._print_error_renderables",
        "last_words.py",
        "LastWords: what App prints once the screen is left",
        _last_words_are_printed_at_the_end,
    ),
    Part(
        "OptionList._update_lines._line_cache._scroll_update",
        "rows.py",
        "EvenList: how Textual gives each option its rows, and when",
        _options_are_laid_out_in_one_place,
    ),
    Part(
        "OptionList._clear_caches",
        "rows.py",
        "EvenList: when Textual drops the options that it drew",
        _drawn_options_are_dropped_in_one_place,
    ),
    Part(
        "Option._set_prompt",
        "rows.py",
        "EvenList.set_prompt: how an option gets another prompt",
        _prompt_is_set_without_drawing,
    ),
]


@pytest.mark.parametrize("package", VERSIONS)
def test_textual_versions_are_those_reviewed(package: str) -> None:
    import tomli

    needed = tomli.loads(PROJECT.read_text(encoding="utf-8"))["project"]["dependencies"]
    requested = next(
        requirement for requirement in map(Requirement, needed) if requirement.name == package
    )
    assert str(requested.specifier) == VERSIONS[package], (
        "look at what follows, then change VERSIONS"
    )
    assert requested.specifier.contains(version(package))


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.name)
def test_private_part_of_textual_is_unchanged(part: Part) -> None:
    reported = (
        f"Textual {version('textual')}: {part.name} is not what tui/terminal/{part.used_in}"
        f" needs. Look at {part.look_at}."
    )
    try:
        still = part.still()
    except (ImportError, AttributeError, KeyError, TypeError, ValueError) as gone:
        pytest.fail(f"{reported} {gone!r}")
    assert still, reported


@pytest.mark.sweep
def test_every_used_private_part_has_a_check_in_its_module() -> None:
    used = {
        (path.removeprefix(f"{ROOM}/"), use.name)
        for path, use in in_project()
        if path.startswith(f"{ROOM}/")
    }
    checked = {
        (part.used_in, name)
        for part in PARTS
        for name in part.name.split(".")
        if name.startswith("_") and not name.endswith("__")
    }
    # Textual calls it itself; what it sends is what matters here
    assert used == checked - {("driver.py", "_set_pointer_shape")}


@pytest.mark.sweep  # it reads the whole source
def test_private_parts_of_textual_are_used_in_one_package_only() -> None:
    outside = [
        f"tui/{path}:{use.line}: {use.name}"
        for path, use in in_project()
        if not path.startswith(f"{ROOM}/")
    ]
    assert outside == [], "put it behind a function or a class in tui/terminal"


PLANTED = {
    "self.app._driver.write('x')": "_driver",
    "event._no_default_action = True": "_no_default_action",
    "getattr(app, '_loop')": "_loop",
    "screen._compositor.cull_widgets": "_compositor",
    "from textual._compositor import Compositor": "_compositor",
    "import textual._xterm_parser": "_xterm_parser",
    "from textual import _compositor": "_compositor",
    "from textual.keys import _get_key_aliases": "_get_key_aliases",
    "from textual.app import App\nApp.bell = print": "bell",
    "from textual.app import App\nsetattr(App, 'bell', print)": "bell",
    "class Panel(App):\n    def work(self): self._exit_renderables.clear()": "_exit_renderables",
    "class Panel(App):\n    def _display(self): pass": "_display",
    "class Panel(App):\n    def work(self): super()._handle_exception(0)": "_handle_exception",
    "class Panel(App):\n    _driver = None": "_driver",
    "class Panel(App):\n    _driver: object": "_driver",
}


@pytest.mark.parametrize("source", PLANTED)
def test_use_of_a_private_part_is_found(source: str) -> None:
    from textual.app import App

    from .private_uses import textual_bases

    line = source.count("\n") + 1
    assert uses(source, {"Panel": textual_bases(App)}) == [Use(PLANTED[source], line)]


OWN = [
    "os._exit(1)",
    "self._app.bell()",
    "self.app.bell()",
    "other._value_of_ours",
    "class Panel(App):\n    def work(self): self._drives = self._value_of_ours",
    "class Other:\n    def work(self): self._display()",
    "from .lines import _row",
    "from textual.app import App\nApp()",
]


@pytest.mark.parametrize("source", OWN)
def test_own_private_name_is_not_taken_for_a_textual_one(source: str) -> None:
    from textual.app import App

    from .private_uses import textual_bases

    assert uses(f"import os\n{source}", {"Panel": textual_bases(App)}) == []
