"""The end of the panel by an error of its own: motors first, then one sentence, no traceback.

The last work is ordered in the thread that met the error, before anything is drawn, closed or
logged. Neither a loop that hangs nor a terminal that takes nothing holds it up.
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
"""Seconds that the app has to end after its last work; then the process is ended."""
TAKEN_BY_TERMINAL_WITHIN = 1.0
"""Seconds for which the end waits until the terminal has taken the last words."""
FAILED = 70
"""The exit status after an internal error, as of any command."""
TRIES, TRIED_AGAIN = 5, 0.2
"""Number of attempts at the last work after errors, and the delay between them."""
NOT_ORDERED = "NOT STOPPED: motors that were started here may run on. Stop them at the machine."
END_NOT_SEEN = "It is not known whether the motors stopped. Check them at the machine."


class LastWork(Protocol):
    """Work that was ordered because the panel ends."""

    @property
    def begun(self) -> str:
        """The work in progress, for a person."""

    def follow(self) -> str:
        """Wait for its end; the result, for a person."""


@runtime_checkable
class OwnScreen(Protocol):
    """A driver that gives the terminal back at once, in any thread."""

    def stop_application_mode(self) -> None:
        """Leave the screen; later pictures are dropped."""

    def say_below(self, text: str) -> None:
        """Write a line on the terminal that was given back."""

    def hold_input(self) -> None:
        """Keep typed keys without echo and signals, also after the screen was left."""

    def release_input(self) -> None:
        """Discard typed keys, then restore the terminal's attributes."""


class LastWords(App[None]):
    """An app that orders its last work before all else when an error ends it."""

    def __init__(self) -> None:
        super().__init__()
        self._workers = _Workers(self, self._begin_end)
        self._failing = threading.Lock()
        """Taken by the first error, for good."""
        self._work: LastWork | None = None
        self._following: threading.Thread | None = None
        """Follows the last work after an error; the process does not end before it."""
        self._saying: threading.Thread | None = None
        """Says the last words; alone, as long as it lives."""
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
        """Run the app; an error of its own ends it with `FAILED`, and is not raised."""
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
        """Release the input that an error has left held; in any thread."""
        if self.failed and isinstance(self._driver, OwnScreen):
            self._driver.release_input()

    def _finish(self) -> None:
        """See the end through, also if a second error interrupted it."""
        if self._following is None:
            self._follow()
        else:
            self._following.join()
        self._print_error_renderables()
        self.release_input()
        if self._driver is not None:
            self._driver.close()  # writes what is still queued

    def follow_last_work(self) -> None:
        """Wait for the end of the last work; orders it where that was not done yet."""
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
        """An error in a callback of the loop ends the panel; one of a lost task is on record."""
        error = context.get("exception")
        if isinstance(error, Exception) and "handle" in context and self.is_running:
            self._handle_exception(error)
        else:
            log.error("%s", context.get("message"), exc_info=error)

    def _begin_end(self, error: BaseException) -> None:
        """Order the last work, and let nothing hold it up; for the first error only."""
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
        """See the last work to its end; then the app may end, and has to soon."""
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
        """Give the terminal back, and say all there; in a thread, as it may take nothing."""
        screen.stop_application_mode()
        self._say(screen)
        self._followed.wait()
        self._say(screen)

    def _say(self, screen: OwnScreen) -> None:
        while self._unsaid:
            screen.say_below(self._unsaid[0])
            del self._unsaid[0]

    def _print_error_renderables(self) -> None:
        """Say what could not be said before."""
        if self._saying is None or not self._saying.is_alive():
            for text in self._unsaid:
                self.error_console.print(Text(text))
            self._unsaid.clear()
        super()._print_error_renderables()


class _Workers(WorkerManager):
    """Workers whose errors are reported at once: Textual first takes a traceback for its log."""

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
    """A thread at work; None where there is no memory for one."""
    thread = threading.Thread(target=work, name=name, daemon=daemon)
    try:
        thread.start()
    except RuntimeError:
        return None
    return thread


def _log_strays() -> None:
    """Keep errors that nobody awaits off the terminal, and on record, until the process ends."""

    def in_thread(met: threading.ExceptHookArgs) -> None:
        log.error("error in the thread %s", met.thread and met.thread.name, exc_info=met.exc_value)

    def unraisable(met: sys.UnraisableHookArgs) -> None:
        log.error("error in %r", met.object, exc_info=met.exc_value)

    threading.excepthook, sys.unraisablehook = in_thread, unraisable
