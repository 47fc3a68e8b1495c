"""Internal errors of the panel while a motor turns: the stop is sent first, then one sentence."""

from __future__ import annotations

import fcntl
import os
import signal
import sys
import termios
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.programs import wait_until
from tests.sweeps import kept

from .failing_panel import TEXT, Plant, planted
from .pty_panel import PtyPanel, panel_on_a_pty

DRAW = "tui.screens.monitor.screen:MonitorScreen.draw"
SCREENS = {
    "Monitor": ("", DRAW),
    "Line": ("1", "tui.screens.connection.screen:ConnectionScreen.draw"),
    "Parameters": ("3", "tui.screens.parameters.screen:ParametersScreen.draw"),
    "Scanner": ("4", "tui.screens.blocks.screen:BlocksScreen.draw"),
    "Faults": ("5", "tui.screens.faults.screen:FaultsScreen.draw"),
    "Control": ("6", "tui.screens.control.screen:ControlSourceScreen.draw"),
    "Frames": ("7", "tui.screens.frames.screen:FramesScreen.draw"),
    "Messages": ("m", "tui.screens.messages.screen:MessagesScreen.draw"),
    "Start-up": ("B", "tui.screens.startup.screen:StartUpScreen.draw"),
    "Wiring": ("I", "tui.screens.wiring.screen:WiringScreen.draw_frame"),
}
DIALOGS = {
    "Ask": "dialogs.ask",
    "BundleScreen": "bundle",
    "Confirm": "dialogs.confirm",
    "Leave": "dialogs.leave",
    "Palette": "choosing",
    "AddressField": "dialogs.address",
    "PickFile": "dialogs.pick_file",
    "WhyScreen": "why",
    "HelpScreen": "keys.help",
    "OptionsScreen": "command.command_keys",
    "PickWord": "command.teaching",
    "PickParameter": "dialogs.pick_parameter",
    "EditNumber": "parameters.edit_value",
    "PickValue": "parameters.edit_value",
    "EditBits": "parameters.edit_value",
    "Results": "parameters.write_keys",
    "RestQuestion": "parameters.write_keys",
    "Skipped": "parameters.set_keys",
}
"""By class, the module below `tui.screens`."""
PLACES = {
    "timer": ("", "tui.screens.status_refresher:StatusRefresher.look_around"),
    "action": ("m", "tui.screens.places:Places.action_messages"),
    "key handler": ("z", "tui.screens.base:PanelScreen.on_key"),
    "worker": ("qs", "tui.screens.leaving:Leaving._stop_and_leave"),
    "thread of the keys": ("x", "tui.terminal.reader:KeyReader.read"),
    "callback of the loop": ("", "tui.terminal.lean_app:LeanApp.picture_taken"),
    "event": ("x", "tui.screens.key_dispatcher:KeyDispatcher.on_event"),
    "renderer": ("", "tui.widgets.lines:Lines.render_lines"),
    "picture": ("", "tui.terminal.lean_app:LeanApp._display"),
}
"""Other origins of an error, and the keys that lead there."""
ERRORS = (
    "RecursionError",
    "MemoryError",
    "SystemExit",
    "KeyboardInterrupt",
    "Unspeakable",
    "Lengthy",
)
SECOND = {
    "shutdown": "textual.app:App._shutdown",
    "unmount": "tui.app:DrivePanelApp.on_unmount",
    "sentence": "tui.app:DrivePanelApp.last_words",
    "bookkeeping": "tui.session.monitor.line_watch:LineWatch.under_command",
}
"""Origins of a second error while the panel ends."""
UNSEEN = {
    "wait": ("RuntimeError", "tui.session.command.stop:Stopper.wait", "Device 1: it"),
    "result": ("RuntimeError", "tui.screens.last_stops:LineStops.lines", "It"),
    "end": ("RuntimeError", "tui.screens.last_stops:LastStops.follow", "It"),
    "exit": ("SystemExit", "tui.screens.last_stops:LastStops.follow", "It"),
}
"""Second errors that leave it unknown whether the motor stopped, and the first words on that."""
UNKNOWN = " is not known whether the motor"
HANGS = {
    "shutdown": "textual.app:App._shutdown",
    "loop": "tui.terminal.last_words:LastWords._fatal_error",
    "terminal": "textual.drivers.linux_driver:LinuxDriver.stop_application_mode",
}
"""Parts that may hang while the panel ends."""


SLOW, QUICK = 6000, 5
"""Ramps of the motor, in 0.1 s: longer than any of these tests, and soon over."""
A_WHILE = 1.0
"""Seconds in which a key or a signal would have had its effect."""


@contextmanager
def failing(
    folder: Path, *plants: tuple[str, str], dialog: str = "", options: tuple[str, ...] = ()
) -> Iterator[PtyPanel]:
    """A panel with a running motor; errors occur at their places once `now` is in the folder."""
    wanted = [Plant(place, str(folder / "now"), error) for error, place in plants]
    if dialog:
        look = "tui.screens.status_refresher:StatusRefresher.look_around"
        wanted.append(Plant(look, str(folder / "open"), dialog=dialog))
    # rendering a traceback first would prevent the stop
    wanted.append(Plant("rich.traceback:Traceback.__init__", str(folder / "now"), "hang"))
    program = ("tests.line.failing_panel", planted(*wanted))
    with panel_on_a_pty(*options, program=program) as panel:
        panel.run()
        wait_until(
            lambda: panel.look() and panel.simulation.drive(1).motor.frequency > 2, "it turns"
        )
        yield panel


def end(panel: PtyPanel, folder: Path, keys: str = "") -> bytes:
    """Trigger the errors; only the stop is sent. Return the output of the terminal."""
    writes, sent = len(panel.log.writes), len(panel.sent)
    (folder / "now").touch()
    for key in keys:
        panel.type(key)
        panel.settle(0.5)
    wait_until(lambda: (panel.look() or True) and panel.stops(writes) > 0, "the stop")
    ended(panel)
    assert panel.simulation.drive(1).motor.frequency == 0
    output = panel.sent[sent:]
    assert b"Traceback" not in output
    return output


def ended(panel: PtyPanel, *, status: int = 70) -> None:
    """Wait for the end of the panel's process."""
    wait_until(lambda: (panel.look() or True) and _left(panel) is not None, "the end of the panel")
    while panel.look():
        pass
    assert _left(panel) == status


def _left(panel: PtyPanel) -> int | None:
    """The exit status of the panel; None while it runs."""
    found = os.waitid(os.P_PID, panel.pid, os.WEXITED | os.WNOHANG | os.WNOWAIT)
    return found.si_status if found is not None else None


def below(output: bytes) -> list[str]:
    """The lines on the terminal below the screen that was left."""
    text = output.rpartition(b"\x1b[?1049l")[2].rpartition(b"\x1b[?1004l")[2]
    return text.decode().splitlines()


def logged() -> str:
    """The log of the panel."""
    return Path(os.environ["DRIVEPANEL_STATE"], "drivepanel.log").read_text()


@pytest.mark.parametrize("screen", kept(SCREENS, "Monitor", "Line", "Parameters", "Frames"))
def test_error_on_a_screen_sends_the_stop_first(screen: str, tmp_path: Path) -> None:
    key, place = SCREENS[screen]
    with failing(tmp_path, ("RuntimeError", place)) as panel:
        if key:
            panel.type(key)
            panel.settle(0.4)
        output = below(end(panel, tmp_path))
    assert output[0].startswith(
        f"The panel had to stop after an internal error (RuntimeError: {TEXT});"
    )
    assert output[-1] == "Device 1: stopped."
    assert f"RuntimeError: {TEXT}" in logged()
    assert "Traceback" in logged()


@pytest.mark.parametrize("dialog", kept(DIALOGS, "Ask", "Leave", "HelpScreen", "EditNumber"))
def test_error_in_a_dialog_sends_the_stop_first(dialog: str, tmp_path: Path) -> None:
    place = f"tui.screens.{DIALOGS[dialog]}:{dialog}.draw_frame"
    with failing(tmp_path, ("RuntimeError", place), dialog=dialog) as panel:
        (tmp_path / "open").touch()
        wait_until(lambda: panel.look() and not (tmp_path / "open").exists(), "the dialog")
        panel.settle(0.4)
        output = below(end(panel, tmp_path))
    assert output[0].startswith("The panel had to stop after an internal error (RuntimeError")
    assert output[-1] == "Device 1: stopped."


def test_every_dialog_is_tested() -> None:
    from tests.ui.test_dialog_keys import all_dialogs

    assert all_dialogs() == set(DIALOGS)


@pytest.mark.parametrize("name", PLACES)
def test_error_anywhere_else_sends_the_stop_first(name: str, tmp_path: Path) -> None:
    keys, place = PLACES[name]
    with failing(tmp_path, ("RuntimeError", place)) as panel:
        output = below(end(panel, tmp_path, keys))
    assert output[0].startswith("The panel had to stop after an internal error (RuntimeError")
    assert output[-1] == "Device 1: stopped."


def test_dialog_that_cannot_be_created_sends_the_stop_first(tmp_path: Path) -> None:
    for method in ("compose", "on_mount"):
        (folder := tmp_path / method).mkdir()
        place = f"tui.screens.messages.screen:MessagesScreen.{method}"
        with failing(folder, ("RuntimeError", place)) as panel:
            end(panel, folder, "m")


@pytest.mark.parametrize("error", ERRORS)
def test_every_kind_of_error_sends_the_stop_first(error: str, tmp_path: Path) -> None:
    with failing(tmp_path, (error, DRAW)) as panel:
        output = below(end(panel, tmp_path))
    assert output[0].startswith("The panel had to stop after an internal error (")
    assert [line for line in output if line.startswith(" ")] == []
    assert output[-1] == "Device 1: stopped."


@pytest.mark.parametrize("second", SECOND)
def test_second_error_does_not_block_the_stop(second: str, tmp_path: Path) -> None:
    with failing(tmp_path, ("RuntimeError", DRAW), ("RuntimeError", SECOND[second])) as panel:
        output = below(end(panel, tmp_path))
    assert output[0].startswith("The panel had to stop after an internal error (RuntimeError")
    assert "Device 1: stopped." in output


@pytest.mark.parametrize("second", UNSEEN)
def test_second_error_during_the_wait_reports_an_unknown_result(
    second: str, tmp_path: Path
) -> None:
    error, place, begin = UNSEEN[second]
    with failing(tmp_path, ("RuntimeError", DRAW), (error, place)) as panel:
        writes, sent = len(panel.log.writes), len(panel.sent)
        (tmp_path / "now").touch()
        ended(panel)
        assert panel.stops(writes) > 0
        assert below(panel.sent[sent:])[-1].startswith(begin + UNKNOWN)


def hold_the_ramp(panel: PtyPanel, folder: Path) -> int:
    """Trigger the errors; the motor ramps until `end_the_ramp`. Return the output before it."""
    panel.simulation.drive(1).set("DEC", SLOW)
    sent = len(panel.sent)
    (folder / "now").touch()
    wait_until(lambda: panel.look() and b"Stopping device 1." in panel.sent[sent:], "the sentence")
    return sent


def end_the_ramp(panel: PtyPanel) -> None:
    """Let the motor stop soon."""
    assert panel.simulation.drive(1).motor.frequency > 0
    panel.simulation.drive(1).set("DEC", QUICK)


def is_usual(terminal: int) -> bool:
    """True if a terminal echoes, edits lines, and has keys that send signals."""
    usual = termios.ECHO | termios.ICANON | termios.ISIG
    flags: int = termios.tcgetattr(terminal)[3]
    return flags & usual == usual


def test_input_is_held_until_standstill(tmp_path: Path) -> None:
    """Typed keys were echoed, and Ctrl-C ended the panel with status 130."""
    with failing(tmp_path, ("RuntimeError", DRAW)) as panel:
        sent = hold_the_ramp(panel, tmp_path)
        shell = os.open(f"/proc/{panel.pid}/fd/0", os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            panel.type("\x1b[1;1R", "rm x\r\n", "\x03", "\x1c", "\x1a")
            panel.look(A_WHILE)
            assert not termios.tcgetattr(shell)[3] & (termios.ECHO | termios.ICANON | termios.ISIG)
            end_the_ramp(panel)
            wait_until(lambda: panel.look() and _left(panel) is not None, "the end of the panel")
            assert _left(panel) == 70
            assert is_usual(shell)
            unread = int.from_bytes(fcntl.ioctl(shell, termios.FIONREAD, bytes(4)), sys.byteorder)
            assert unread == 0
        finally:
            os.close(shell)
        assert below(panel.sent[sent:])[1:] == ["Stopping device 1.", "Device 1: stopped."]


ENDS = {
    signal.SIGINT: 70,
    signal.SIGTERM: 128 + signal.SIGTERM,
    signal.SIGQUIT: 128 + signal.SIGQUIT,
}
"""The exit status if a signal arrives while the motor ramps down after an error."""


@pytest.mark.parametrize("number", ENDS)
def test_signals_do_not_end_the_wait_for_the_motor(number: signal.Signals, tmp_path: Path) -> None:
    with failing(tmp_path, ("RuntimeError", DRAW)) as panel:
        sent = hold_the_ramp(panel, tmp_path)
        os.kill(panel.pid, number)
        panel.look(A_WHILE)
        end_the_ramp(panel)
        ended(panel, status=ENDS[number])
        assert below(panel.sent[sent:])[-1] == "Device 1: stopped."
        assert is_usual(panel.terminal)


def test_signal_ends_a_wait_that_hangs_and_restores_the_terminal(tmp_path: Path) -> None:
    hang = ("hang", "tui.screens.last_stops:LastStops.follow")
    with failing(tmp_path, ("RuntimeError", DRAW), hang) as panel:
        (tmp_path / "now").touch()
        wait_until(lambda: panel.look() and b"Stopping device 1." in panel.sent, "the sentence")
        os.kill(panel.pid, signal.SIGQUIT)
        ended(panel, status=128 + signal.SIGQUIT)
        assert is_usual(panel.terminal)


@pytest.mark.parametrize("hang", HANGS)
def test_hung_exit_is_ended(hang: str, tmp_path: Path) -> None:
    with failing(tmp_path, ("RuntimeError", DRAW), ("hang", HANGS[hang])) as panel:
        end(panel, tmp_path)


def test_blocked_terminal_delays_neither_the_stop_nor_the_exit(
    tmp_path: Path,
) -> None:
    # after many frames its buffer is full: it is not read here
    with failing(tmp_path, ("RuntimeError", "tui.terminal.reader:KeyReader.read")) as panel:
        panel.type("\x0c" * 40, apart=0.1)
        for _ in range(40):
            panel.type("\x0c")
            time.sleep(0.1)
        writes = len(panel.log.writes)
        (tmp_path / "now").touch()
        panel.type("x")
        wait_until(lambda: panel.stops(writes) > 0, "the stop")
        wait_until(lambda: _left(panel) is not None, "the end of the panel")
        assert panel.simulation.drive(1).motor.frequency == 0


def test_error_keeps_motors_running_if_chosen(tmp_path: Path) -> None:
    options = ("--on-hangup", "leave-running")
    with failing(tmp_path, ("RuntimeError", DRAW), options=options) as panel:
        writes = len(panel.log.writes)
        (tmp_path / "now").touch()
        ended(panel)
        assert panel.log.writes[writes:] == []
        assert panel.simulation.drive(1).motor.frequency > 2
