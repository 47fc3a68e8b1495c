"""End of an app by an internal error: every line is printed, also after a second error."""

from __future__ import annotations

import sys
import threading
from collections.abc import Callable
from typing import Any

import pytest
from textual.app import App
from textual.driver import Driver

from tui.terminal.driver import with_held_input
from tui.terminal.last_words import END_NOT_SEEN, FAILED, LastWords

BEGUN, RESULT, SENTENCE = "It is being done.", "It is done.", "It had to end."


class SlowDriver(Driver):
    """A driver whose terminal accepts no output until the driver is closed, as over a slow link.

    Nothing is accepted after that.
    """

    taken: list[str]

    def __init__(self, app: Any, **settings: Any) -> None:
        super().__init__(app, **settings)
        self.queued: list[str] = []
        self.taken = []
        self._ended = False

    def write(self, data: str) -> None:
        if not self._ended:
            self.queued.append(data)

    def say_below(self, text: str) -> None:
        """Write a line, as the panel's own driver does."""
        self.write(text)

    def start_application_mode(self) -> None: ...

    def disable_input(self) -> None: ...

    def stop_application_mode(self) -> None: ...

    def close(self) -> None:
        self._ended = True
        self.taken = self.queued


class Work:
    """Work that ends on release, or by an error."""

    begun = BEGUN

    def __init__(self, error: BaseException | None) -> None:
        self.may_end = threading.Event()
        self._error = error

    def follow(self) -> str:
        """Wait for the end."""
        assert self.may_end.wait(30)
        if self._error is not None:
            raise self._error
        return RESULT


class Ending(LastWords):
    """An app that fails immediately."""

    def __init__(self, error: BaseException | None = None) -> None:
        super().__init__()
        self.work = Work(error)
        self.on_end: Callable[[], None] = self.work.may_end.set

    def get_driver_class(self) -> type[Driver]:
        return with_held_input(SlowDriver)

    def order_last_work(self) -> Work:
        return self.work

    def last_words(self, error: BaseException) -> str:
        return SENTENCE

    def on_mount(self) -> None:
        raise RuntimeError("a screw is loose")

    def on_unmount(self) -> None:
        self.on_end()

    @property
    def lines(self) -> list[str]:
        """Lines that the terminal has taken."""
        assert isinstance(self._driver, SlowDriver)
        return [
            text for text in self._driver.taken if text in (BEGUN, RESULT, SENTENCE, END_NOT_SEEN)
        ]


@pytest.fixture(autouse=True)
def own_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """The process of the tests continues after the app."""
    monkeypatch.setattr("tui.terminal.last_words.ENDED_WITHIN", 3600.0)
    monkeypatch.setattr(threading, "excepthook", threading.excepthook)
    monkeypatch.setattr(sys, "unraisablehook", sys.unraisablehook)


def test_result_follows_the_first_words() -> None:
    app = Ending()
    app.run()
    assert app.lines == [SENTENCE, BEGUN, RESULT]
    assert app.return_code == FAILED


def test_second_error_before_the_output_is_written_loses_no_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    app = Ending()

    async def fails(_: App[None]) -> None:
        threading.Timer(0.2, app.work.may_end.set).start()
        raise RuntimeError("another screw")

    monkeypatch.setattr(App, "_shutdown", fails)
    app.run()
    assert app.lines == [SENTENCE, BEGUN, RESULT]
    assert app.return_code == FAILED


def test_exit_without_waiting_for_the_work_loses_no_line() -> None:
    app = Ending()
    app.on_end = lambda: threading.Timer(0.2, app.work.may_end.set).start()
    app.run()
    assert app.lines == [SENTENCE, BEGUN, RESULT]


@pytest.mark.parametrize("error", [RuntimeError("lost"), SystemExit(3), KeyboardInterrupt()])
def test_error_while_following_the_work_is_reported(error: BaseException) -> None:
    app = Ending(error)
    app.run()
    assert app.lines == [SENTENCE, BEGUN, END_NOT_SEEN]
    assert app.return_code == FAILED
