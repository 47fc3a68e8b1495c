"""The driver: its output, the times of received bytes, and systems where it reads no keys."""

from __future__ import annotations

import asyncio
import errno
import os
import signal
from threading import Event
from typing import Any

import pytest
from textual import events
from textual.driver import Driver
from textual.message import Message

from tui.terminal import driver as module
from tui.terminal.driver import NO_COLOR, NO_REPORTS, with_own_keys
from tui.terminal.reader import KeyReader
from tui.terminal.stroke import Pressed


class Stops:
    """An app that takes every stop key."""

    def __init__(self, *, mouse: bool = False) -> None:
        self.mouse = mouse
        self.taken: list[str] = []

    def take_stop_key(self, key: str, left_at: float | None = None) -> bool:
        if key not in ("space", "f12", "f9"):
            return False
        self.taken.append(key)
        return True

    def last_stop(self, error: Exception) -> None:
        self.failed = error

    def sequence_swallowed(self, data: bytes) -> None:
        """Unused in these tests."""

    def acts_at_once(self, key: str, character: str | None, *, begins: bool, after: float) -> bool:
        return False

    def stop_stamp(self) -> object:
        return len(self.taken)


LEAVE = "\x1b[?1049l"


class OtherDriver(Driver):
    """A driver of another system, where Textual reads the keys."""

    def __init__(self, app: Any, **settings: Any) -> None:
        super().__init__(app, **settings)
        self.mouse_enabled = self._mouse
        self.written: list[str] = []
        self.passed: list[Message] = []

    def write(self, data: str) -> None:
        self.written.append(data)

    def send_message(self, message: Message) -> None:
        self.passed.append(message)

    def start_application_mode(self) -> None: ...

    def disable_input(self) -> None: ...

    def stop_application_mode(self) -> None:
        self.write(LEAVE)


def made(app: Stops, **settings: Any) -> Any:
    async def make() -> Any:
        return with_own_keys(OtherDriver)(app, **settings)  # type: ignore[arg-type]

    return asyncio.run(make())


def test_color_is_reset_once_before_the_screen_is_left() -> None:
    driver = made(Stops())
    for _ in range(2):
        driver.stop_application_mode()
    assert driver.written == [NO_COLOR, LEAVE, NO_REPORTS]


QUERIES = ["\x1b[?25l", "\x1b[?1004h", "\x1b[>25u", "\x1b]22;text\x07", "\x1b[1;1Htext", "\x1b[<u"]


def test_fewer_modes_are_requested_without_mouse() -> None:
    driver = made(Stops())
    for data in QUERIES:
        driver.write(data)
    assert driver.written == ["\x1b[?25l", NO_REPORTS, "\x1b[1;1Htext"]
    assert not driver.mouse_enabled


def test_all_modes_are_requested_with_mouse() -> None:
    driver = made(Stops(mouse=True))
    for data in QUERIES:
        driver.write(data)
    assert driver.written == QUERIES
    assert driver.mouse_enabled
    assert not made(Stops(mouse=True), mouse=False).mouse_enabled


def test_stop_keys_are_read_early_with_the_textual_reader() -> None:
    driver = made(stops := Stops())
    for key in ("r", "f12", "space", "f9", "f1"):
        driver.process_message(events.Key(key, None))
    assert stops.taken == ["f12", "space", "f9"]
    assert [message.key for message in driver.passed] == ["r", "f1"]


class Late:
    """A selector in a thread that was kept waiting; time passes in it alone."""

    def __init__(self) -> None:
        self.now = 100.0
        self.sleeps = 0.0

    def select(self, _wait: float) -> list[object]:
        self.now += self.sleeps
        return [object()]

    def monotonic(self) -> float:
        return self.now


@pytest.mark.parametrize(("sleeps", "alone"), [(0.03, False), (0.3, False)])
def test_bytes_read_late_by_a_busy_thread_are_not_late_keys(
    sleeps: float, alone: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    late, ends = Late(), os.pipe()
    monkeypatch.setattr("tui.terminal.driver.time.monotonic", late.monotonic)
    driver: Any = type("Fake", (), {"fileno": ends[0], "exit_event": Event(), "_app": Stops()})()
    keys = KeyReader(driver._app)

    def look() -> list[Any]:
        return module._look(driver, late, keys)  # type: ignore[arg-type]

    try:
        os.write(ends[1], b"r")
        assert look() == []
        late.sleeps = sleeps
        os.write(ends[1], b"\r")
        found = [*look(), *keys.tick(late.now + 1)]
    finally:
        for end in ends:
            os.close(end)
    assert [item.stroke.alone for item in found if isinstance(item, Pressed)] == [alone] * 2


def test_stop_between_read_and_stamp_cancels_the_keys(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stops = Stops()
    driver: Any = type("Fake", (), {"fileno": 0, "exit_event": Event(), "_app": stops})()
    keys = KeyReader(stops)

    def read(_file: int, _count: int) -> bytes:
        stops.taken.append("by somebody else")
        return b"r"

    monkeypatch.setattr("tui.terminal.driver.os.read", read)
    module._look(driver, Late(), keys)  # type: ignore[arg-type]
    (pressed,) = keys.tick(float("inf"))
    assert isinstance(pressed, Pressed)
    assert pressed.stroke.stamp != stops.stop_stamp()


def test_lost_terminal_ends_the_panel_with_a_hangup(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """SIGHUP goes to the session leader only: under another program nothing ended the panel."""
    master, slave = os.openpty()
    driver: Any = type("Fake", (), {"fileno": slave, "exit_event": Event(), "_app": Stops()})()
    driver.wanted = False
    sent: list[tuple[int, int]] = []

    def kill(pid: int, number: int) -> None:
        sent.append((pid, number))
        driver.exit_event.set()

    monkeypatch.setattr("tui.terminal.driver.os.kill", kill)
    try:
        os.close(master)
        module.read_keys(driver)
    finally:
        os.close(slave)
    assert sent == [(os.getpid(), signal.SIGHUP)]


def test_terminal_taken_back_by_a_shell_is_not_lost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """In the background of a shell every read fails; the panel ended."""
    master, slave = os.openpty()
    driver: Any = type("Fake", (), {"fileno": slave, "exit_event": Event()})()

    def read(_file: int, _count: int) -> bytes:
        raise OSError(errno.EIO, "Input/output error")

    monkeypatch.setattr("tui.terminal.driver.os.read", read)
    monkeypatch.setattr("tui.terminal.driver.os.tcgetpgrp", lambda _: os.getpgrp() + 1)
    try:
        assert module._typed(driver) == b""
        monkeypatch.setattr("tui.terminal.driver.os.tcgetpgrp", lambda _: os.getpgrp())
        with pytest.raises(module.TerminalGone):
            module._typed(driver)
    finally:
        os.close(master)
        os.close(slave)
