"""The end of the panel after an internal error: stop motors first, then one sentence, no traceback.

The last work is ordered in the thread that met the error, before anything is drawn, closed or
logged. Neither a hanging loop nor a blocked terminal delays it.
"""

from __future__ import annotations

import asyncio
import inspect
import logging
import os
import sys
import threading
import time
from abc import abstractmethod
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Protocol, runtime_checkable

from rich.text import Text
from textual.app import App
from textual.dom import DOMNode
from textual.worker import Worker, WorkerFailed, WorkType
from textual.worker_manager import WorkerManager

from .loop import soon_in_loop

log = logging.getLogger(__name__)

ENDED_WITHIN = 3.0
"""Seconds for the app to end after its last work; then the process exits."""
TAKEN_BY_TERMINAL_WITHIN = 1.0
"""Seconds that the end waits for the terminal to accept the last words."""
FAILED = 70
"""The exit status after an internal error, as of any command."""
TRIES, TRIED_AGAIN = 5, 0.2
"""Number of attempts at the last work after errors, and the seconds between them."""
NOT_ORDERED = "NOT STOPPED: motors started here may still run. Stop them at the machine."
END_NOT_SEEN = "It is not known whether the motors stopped. Check them at the machine."


class LastWork(Protocol):
    """Work ordered because the panel ends: stops of motors."""

    @property
    def begun(self) -> str:
        """The work in progress, for a person."""

    def follow(self) -> str:
        """Wait for its end, and return the result for a person."""


@runtime_checkable
class OwnScreen(Protocol):
    """A driver that can restore the terminal immediately, from any thread."""

    def stop_application_mode(self) -> None:
        """Leave the screen; later pictures are dropped."""

    def say_below(self, text: str) -> None:
        """Write a line on the restored terminal."""

    def hold_input(self) -> None:
        """Keep typed keys without echo and signals, also after the screen was left."""

    def release_input(self) -> None:
        """Discard typed keys, then restore the terminal's attributes."""


class LastWords(App[None]):
    """An app that, if an error ends it, first orders its last work."""

    def __init__(self) -> None:
        super().__init__()
        self._workers = _Workers(self, self._begin_end)
        self._failing = threading.Lock()
        """Acquired by the first error, and never released."""
        self._work: LastWork | None = None
        self._following: threading.Thread | None = None
        """Follows the last work after an error; the process does not end before it."""
        self._saying: threading.Thread | None = None
        """Writes the last words; while it runs, no other thread writes them."""
        self._followed = threading.Event()
        self._unsaid: list[str] = []

    @abstractmethod
    def order_last_work(self) -> LastWork:
        """Order what must be done before the process ends; returns at once, in any thread."""

    @abstractmethod
    def last_words(self, error: BaseException) -> str:
        """One sentence for a person on the error that ends the panel."""

    def end_by(self, error: BaseException) -> None:
        """End the app because of an error outside its loop; may be called in any thread."""
        self._begin_end(error)
        soon_in_loop(self, self.exit, None, FAILED)

    def run(self, **settings: Any) -> Any:
        """Run the app; an internal error ends it with `FAILED`, and is not raised."""
        result = None
        try:
            result = super().run(**settings)
        except BaseException as error:
            if not self.failed:
                raise
            log.error("another error while the panel ends", exc_info=error)
        if self.failed:
            self._finish()
            self._return_code = FAILED
        return result

    @property
    def failed(self) -> bool:
        """True if an error ends the app."""
        return self._failing.locked()

    def release_input(self) -> None:
        """Release the input if it is still held after an error; in any thread."""
        if self.failed and isinstance(self._driver, OwnScreen):
            self._driver.release_input()

    def _finish(self) -> None:
        """Complete the end, even if a second error interrupted it."""
        if self._following is None:
            self._follow()
        else:
            self._following.join()
        self._print_error_renderables()
        self.release_input()
        if self._driver is not None:
            self._driver.close()  # writes what is still queued

    def follow_last_work(self) -> None:
        """Wait for the end of the last work; order it first if that was not done."""
        if self._following is not None:
            self._following.join()
        elif (work := self._work or self._ordered()) is not None:
            work.follow()

    def _handle_exception(self, error: Exception) -> None:
        self._begin_end(error)
        super()._handle_exception(error)

    def _fatal_error(self) -> None:
        """Leave the loop; Textual would render the traceback first."""
        self._close_messages_no_wait()

    def panic(self, *renderables: object) -> None:
        """Leave the loop, as after any other error."""
        self._close_messages_no_wait()

    async def _process_messages_loop(self) -> None:
        if not self.is_headless:
            _log_strays()
            asyncio.get_running_loop().set_exception_handler(self._loop_met)
        try:
            await super()._process_messages_loop()
        except BaseException as error:
            # SystemExit and KeyboardInterrupt, in whichever task, come by no other way
            self._begin_end(error)
            raise
        if not self.failed:
            self._work = self._ordered()

    def _loop_met(self, _loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """End the panel after an error in a loop callback; only log an error of a lost task."""
        error = context.get("exception")
        if isinstance(error, Exception) and "handle" in context and self.is_running:
            self._handle_exception(error)
        else:
            log.error("%s", context.get("message"), exc_info=error)

    def _begin_end(self, error: BaseException) -> None:
        """Order the last work without any delay; for the first error only."""
        if not self._failing.acquire(blocking=False):
            log.error("another error while the panel ends", exc_info=error)
            return
        self._work = self._ordered()
        cause = error.error if isinstance(error, WorkerFailed) else error
        self._unsaid = self._first_words(cause)
        if isinstance(screen := self._driver, OwnScreen):
            screen.hold_input()
            self._saying = _started(lambda: self._say_all(screen), "last words", daemon=True)
        self._following = _started(self._follow, "last work")
        log.error("the panel had to stop", exc_info=cause)

    def _first_words(self, error: BaseException) -> list[str]:
        try:
            words = self.last_words(error)
        except Exception:
            words = f"The panel had to stop after an internal error ({type(error).__name__})."
        begun = ""
        with suppress(Exception):
            begun = self._work.begun if self._work is not None else ""
        return [words, begun] if begun else [words]

    def _ordered(self) -> LastWork | None:
        try:
            return self.order_last_work()
        except Exception as error:
            log.error("the last work was not ordered", exc_info=error)
            return None

    def _follow(self) -> None:
        """Wait for the end of the last work; then the app must end within `ENDED_WITHIN`."""
        for _ in range(TRIES):
            if self._work is not None:
                break
            time.sleep(TRIED_AGAIN)
            self._work = self._ordered()
        try:
            result = self._work.follow() if self._work is not None else NOT_ORDERED
        except BaseException as error:
            log.error("the last work was not followed", exc_info=error)
            result = END_NOT_SEEN
        if result:
            self._unsaid.append(result)
        self._followed.set()
        if not self.is_headless:
            last_resort = threading.Timer(ENDED_WITHIN, os._exit, (FAILED,))
            last_resort.daemon = True
            last_resort.start()
        if self._saying is not None:
            self._saying.join(TAKEN_BY_TERMINAL_WITHIN)
        self.release_input()

    def _say_all(self, screen: OwnScreen) -> None:
        """Restore the terminal and write everything there; in a thread, as it may block."""
        screen.stop_application_mode()
        self._say(screen)
        self._followed.wait()
        self._say(screen)

    def _say(self, screen: OwnScreen) -> None:
        while self._unsaid:
            screen.say_below(self._unsaid[0])
            del self._unsaid[0]

    def _print_error_renderables(self) -> None:
        """Print what could not be written before."""
        if self._saying is None or not self._saying.is_alive():
            for text in self._unsaid:
                self.error_console.print(Text(text))
            self._unsaid.clear()
        super()._print_error_renderables()


class _Workers(WorkerManager):
    """Workers whose errors are reported immediately: Textual would first format a traceback."""

    def __init__(self, app: App[None], failed: Callable[[BaseException], None]) -> None:
        super().__init__(app)
        self._failed = failed

    def _new_worker(
        self, work: WorkType[Any], node: DOMNode, *, exit_on_error: bool = True, **settings: Any
    ) -> Worker[Any]:
        async def watched() -> Any:
            try:
                found = work() if callable(work) else work
                return await found if inspect.isawaitable(found) else found
            except Exception as error:
                self._failed(error)
                raise

        wrapped = watched if exit_on_error and not settings.get("thread") else work
        settings["name"] = settings.get("name") or getattr(work, "__name__", "")
        return super()._new_worker(wrapped, node, exit_on_error=exit_on_error, **settings)


def _started(
    work: Callable[[], None], name: str, *, daemon: bool = False
) -> threading.Thread | None:
    """Start a thread; None if there is no memory for it."""
    thread = threading.Thread(target=work, name=name, daemon=daemon)
    try:
        thread.start()
    except RuntimeError:
        return None
    return thread


def _log_strays() -> None:
    """Log errors that no code awaits, instead of printing them on the terminal."""

    def in_thread(met: threading.ExceptHookArgs) -> None:
        log.error("error in the thread %s", met.thread and met.thread.name, exc_info=met.exc_value)

    def unraisable(met: sys.UnraisableHookArgs) -> None:
        log.error("error in %r", met.object, exc_info=met.exc_value)

    threading.excepthook, sys.unraisablehook = in_thread, unraisable
