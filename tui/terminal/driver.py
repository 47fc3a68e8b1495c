"""The driver of this platform, with the panel's own reading of keys.

Textual handles keys in its event loop, which blocks while the terminal accepts no output. The
thread that reads the keys does not block: it recognizes stop keys, and attaches a stroke to every
key.
"""

from __future__ import annotations

import asyncio
import logging
import os
import selectors
import signal
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from functools import lru_cache
from selectors import BaseSelector
from typing import IO, Any, Protocol, cast

from textual import constants, events
from textual._xterm_parser import XTermParser
from textual.driver import Driver
from textual.message import Message

from .loop import soon_in_loop
from .reader import KeyReader, Stops, TerminalInput
from .stroke import Pressed, attach
from .tokens import Report

log = logging.getLogger(__name__)


class Outlet:
    """The file of a terminal that discards all output after the terminal has disappeared.

    Textual writes to it in a thread. An error there would end the thread, and the panel would then
    wait for it forever: no motor would be stopped.
    """

    def __init__(self, file: IO[str]) -> None:
        self._file = file
        self._lost = False

    def write(self, text: str) -> None:
        """Write text; send the panel SIGHUP if the terminal has disappeared."""
        if not self._lost:
            try:
                self._file.write(text)
            except OSError as error:
                self._lose(error)

    def flush(self) -> None:
        """Flush what was written."""
        if not self._lost:
            try:
                self._file.flush()
            except OSError as error:
                self._lose(error)

    def fileno(self) -> int:
        """The file's descriptor."""
        return self._file.fileno()

    def isatty(self) -> bool:
        """True if it is a terminal."""
        return self._file.isatty()

    def _lose(self, error: OSError) -> None:
        log.error("the terminal no longer accepts output: %s", error)
        self._lost = True
        os.kill(os.getpid(), signal.SIGHUP)


def with_held_input(driver: type[Driver]) -> type[Driver]:
    """Let a driver leave the screen without restoring the terminal's attributes."""

    class HoldingDriver(driver):  # type: ignore[valid-type, misc]
        """Restores the terminal's attributes when it leaves the screen, or later if held."""

        def __init__(self, app: Any, **settings: Any) -> None:
            self._held = False
            self._attributes: list[Any] | None = None
            super().__init__(app, **settings)

        def start_application_mode(self) -> None:
            """Take the terminal."""
            super().start_application_mode()
            # Textual would restore them together with the screen
            self._attributes, self.attrs_before = getattr(self, "attrs_before", None), None

        def stop_application_mode(self) -> None:
            """Leave the screen; unless it is held, release the input too."""
            try:
                super().stop_application_mode()
            finally:
                if not self._held:
                    self.release_input()

        def hold_input(self) -> None:
            """Keep echo and key signals off until `release_input`; in any thread."""
            self._held = True

        def release_input(self) -> None:
            """Discard typed keys, then restore the terminal's attributes; in any thread."""
            self._held = False
            before, self._attributes = self._attributes, None
            if before is None:
                return
            import termios

            with suppress(termios.error):
                termios.tcflush(self.fileno, termios.TCIFLUSH)
                termios.tcsetattr(self.fileno, termios.TCSANOW, before)

        def close(self) -> None:
            """End all writing; not while the input is held, as more is still to be written."""
            if not self._held:
                super().close()

    return HoldingDriver


END_POLL_INTERVAL = 0.1
"""Seconds between two checks if the panel must end."""

READ_SIZE = 4096
"""Bytes of one read at most."""

POSIX = "LinuxDriver"
"""Name of Textual's driver for every system with pseudo-terminals."""

ASK_FOR_FOCUS = "\x1b[?1004h"
NO_REPORTS = "\x1b[?1000l\x1b[?1002l\x1b[?1003l\x1b[?1006l\x1b[?1004l"
"""Ends mouse reports that a crashed program left on: a click would type keys, even a Space."""

NO_COLOR = "\x1b[0m"
"""Resets the color, which persists between two pictures."""

DROPPED_SEQUENCES = ("\x1b[>", "\x1b[<u", "\x1b]22;")
"""Sequences of Textual that are dropped: for the kitty keyboard protocol and the mouse pointer."""


FULL_SCREEN = "\x1b[?1049h\x1b[?25l\x1b[?7l"
"""The alternate page of the terminal, without a cursor and without wrapping."""


class WithMouse(Protocol):
    """Needs of the driver at the app's start."""

    mouse: bool
    """True if the terminal is to report its mouse and to speak the kitty protocol."""


class Fails(Protocol):
    """An app that the key-reading thread can end after an error."""

    def end_by(self, error: BaseException) -> None:
        """End the app because of an error."""


class Drawing(Protocol):
    """Messages of the driver to the app, in the app's loop."""

    def picture_taken(self, at: float) -> None:
        """Note that the terminal reported at this time that it drew a frame."""

    def action_redraw(self) -> None:
        """Draw the whole screen again."""


@lru_cache(maxsize=1)
def with_own_keys(driver: type[Driver]) -> type[Driver]:
    """The driver of this platform, with fewer requests to the terminal and the panel's keys."""
    quiet = _quiet(_giving_back(with_held_input(driver)))
    return _reading(quiet) if driver.__name__ == POSIX else _stopping(quiet)


def _giving_back(driver: type[Driver]) -> type[Driver]:
    class GivingBackDriver(driver):  # type: ignore[valid-type, misc]
        """Leaves the screen once, from any thread; later output is dropped."""

        def __init__(self, app: Any, **settings: Any) -> None:
            self._gate = threading.RLock()
            self._left = False
            super().__init__(app, **settings)

        def write(self, data: str) -> None:
            with self._gate:
                if not self._left:
                    super().write(data)

        def start_application_mode(self) -> None:
            """Take the terminal, for the first time or again."""
            self._left = False
            super().start_application_mode()

        def stop_application_mode(self) -> None:
            """Leave the screen."""
            self.disable_input()  # before the gate: its thread may be about to write
            with self._gate:
                if self._left:
                    return
                super().write(NO_COLOR)
                super().stop_application_mode()
                super().write(NO_REPORTS)  # only the main thread disables its input
                self._left = True

        def say_below(self, text: str) -> None:
            """Write a line on the terminal after the screen was left; in any thread."""
            with self._gate:
                super().write(f"{text}\n")

    return GivingBackDriver


def _quiet(driver: type[Driver]) -> type[Driver]:
    class QuietDriver(driver):  # type: ignore[valid-type, misc]
        """Requests mouse reports and the kitty protocol only if the app wants the mouse."""

        def __init__(self, app: Any, *, mouse: bool = True, **settings: Any) -> None:
            self.wanted = mouse and cast("WithMouse", app).mouse
            super().__init__(app, mouse=self.wanted, **settings)

        def write(self, data: str) -> None:
            if not self.wanted and data.startswith(DROPPED_SEQUENCES):
                return
            super().write(NO_REPORTS if data == ASK_FOR_FOCUS and not self.wanted else data)

        def process_message(self, message: Message) -> None:
            """Handle a cursor report, which shows that the terminal drew a frame."""
            if isinstance(message, events.CursorPosition):
                drawing = cast("Drawing", self._app)
                soon_in_loop(self._app, drawing.picture_taken, time.monotonic())
                return
            super().process_message(message)

    return QuietDriver


def _reading(driver: type[Driver]) -> type[Driver]:
    class ReadingDriver(driver):  # type: ignore[valid-type, misc]
        """Reads keys from a POSIX terminal."""

        def __init__(self, app: Any, **settings: Any) -> None:
            super().__init__(app, **settings)
            self._file: Any = Outlet(self._file)

        def run_input_thread(self) -> None:
            """Read until the panel ends; in a thread of its own."""
            read_keys(self)

        def _sigcont_application(self, *_: object) -> None:
            """After SIGSTOP, take the terminal back from the shell; Textual would open it twice."""
            soon_in_loop(self._app, self._take_back)

        def _take_back(self) -> None:
            import termios
            import tty

            if _in_background(self.fileno):
                asyncio.get_running_loop().call_later(END_POLL_INTERVAL, self._take_back)
                return
            with suppress(termios.error):
                mode = termios.tcgetattr(self.fileno)
                mode[tty.LFLAG] = self._patch_lflag(mode[tty.LFLAG])
                mode[tty.IFLAG] = self._patch_iflag(mode[tty.IFLAG])
                termios.tcsetattr(self.fileno, termios.TCSANOW, mode)
            self.write(FULL_SCREEN)
            self._enable_bracketed_paste()
            cast("Drawing", self._app).action_redraw()

    return ReadingDriver


class TerminalGone(Exception):
    """The terminal that keys are read from no longer exists."""


def read_keys(driver: Any) -> None:
    """Read the keys of a driver's terminal until its panel ends.

    If the terminal disappears, the panel gets SIGHUP from here: the system sends it only to the
    leader of the terminal's session, which may be another program that continues. An error here
    ends the panel, because no key could stop a motor any more.
    """
    try:
        _read_keys(driver)
    except TerminalGone:
        os.kill(os.getpid(), signal.SIGHUP)
        driver.exit_event.wait()
    except BaseException as error:
        cast("Fails", driver._app).end_by(error)


def _read_keys(driver: Any) -> None:
    stops = cast("Stops", driver._app)
    keys = KeyReader(stops, mouse=driver.wanted, escape_delay=constants.ESCAPE_DELAY)
    reports = XTermParser()
    with selectors.SelectSelector() as selector:
        selector.register(driver.fileno, selectors.EVENT_READ)
        while not driver.exit_event.is_set():
            for paste in _look(driver, selector, keys):
                try:
                    for message in _messages(paste, reports):
                        driver.process_message(message)
                except Exception:
                    # the next key may be a stop
                    log.exception("a key was lost")
        if selector.select(0):  # discard what is typed while the panel ends
            os.read(driver.fileno, READ_SIZE)


def _look(driver: Any, selector: BaseSelector, keys: KeyReader) -> list[TerminalInput]:
    """Wait for bytes or a deadline, and return the input known then."""
    requested, deadline = time.monotonic(), keys.deadline
    wait = (
        END_POLL_INTERVAL
        if deadline is None
        else min(END_POLL_INTERVAL, max(0.0, deadline - requested))
    )
    if not selector.select(wait):
        return keys.tick(time.monotonic())
    # If this thread was delayed, the bytes arrived before now. The stamp is taken before the bytes
    # are read: a stop by another source in between discards them.
    now, stamp = min(time.monotonic(), requested + wait), cast("Stops", driver._app).stop_stamp()
    return keys.read(_typed(driver), now, stamp)


def _typed(driver: Any) -> bytes:
    """Return the typed bytes. Raises TerminalGone."""
    try:
        data = os.read(driver.fileno, READ_SIZE)
    except OSError as error:
        if not _in_background(driver.fileno):
            raise TerminalGone from error
        data = b""
    if data:
        return data
    if not os.isatty(driver.fileno):
        raise TerminalGone
    driver.exit_event.wait(END_POLL_INTERVAL)
    return data


def _in_background(terminal: int) -> bool:
    """Return True if the terminal belongs to another program for now, a shell for example."""
    with suppress(OSError):
        return os.tcgetpgrp(terminal) != os.getpgrp()
    return False


def _messages(read: TerminalInput, reports: XTermParser) -> Iterator[Message]:
    """Yield the messages of Textual for them."""
    if isinstance(read, Pressed):
        event = events.Key(read.name, read.character)
        attach(event, read.stroke)
        yield event
    elif isinstance(read, Report):
        yield from (
            message for message in reports.feed(read.text) if not isinstance(message, events.Key)
        )
    else:
        yield events.Paste(read.text)


def _stopping(driver: type[Driver]) -> type[Driver]:
    class StoppingDriver(driver):  # type: ignore[valid-type, misc]
        """Driver for systems where Textual reads the keys, such as Windows.

        Only stop keys are handled early."""

        def process_message(self, message: Message) -> None:
            if isinstance(message, events.Key):
                app = cast("Stops", self._app)
                if app.take_stop_key(message.key):
                    return
            super().process_message(message)

    return StoppingDriver
