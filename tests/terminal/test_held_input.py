"""Input that is held after the screen was left, on a pseudo-terminal."""

from __future__ import annotations

import asyncio
import os
import select
import termios
import tty
from collections.abc import Iterator
from typing import Any

import pytest
from textual.driver import Driver

from tui.terminal.driver import with_held_input


class RawDriver(Driver):
    """A driver that treats its terminal as Textual's does."""

    def __init__(self, app: Any, *, terminal: int) -> None:
        super().__init__(app)
        self.fileno = terminal
        self.attrs_before: list[Any] | None = None
        self.closed = False

    def write(self, data: str) -> None: ...

    def disable_input(self) -> None: ...

    def start_application_mode(self) -> None:
        self.attrs_before = termios.tcgetattr(self.fileno)
        tty.setraw(self.fileno)

    def stop_application_mode(self) -> None:
        if self.attrs_before is not None:
            termios.tcsetattr(self.fileno, termios.TCSANOW, self.attrs_before)

    def close(self) -> None:
        self.closed = True


class Broken(RawDriver):
    """A driver that fails at its end."""

    def stop_application_mode(self) -> None:
        raise RuntimeError("the end is broken")


@pytest.fixture
def ends() -> Iterator[tuple[int, int]]:
    """The keyboard of a pseudo-terminal, and the program's end."""
    pair = os.openpty()
    yield pair
    for end in pair:
        os.close(end)


def started(kind: type[RawDriver], terminal: int) -> Any:
    async def make() -> Any:
        return with_held_input(kind)(object(), terminal=terminal)  # type: ignore[arg-type, call-arg]

    driver = asyncio.run(make())
    driver.start_application_mode()
    return driver


def echoes(terminal: int) -> bool:
    flags = termios.tcgetattr(terminal)[3]
    usual = termios.ECHO | termios.ICANON | termios.ISIG
    assert flags & usual in (0, usual)
    return bool(flags & usual)


def test_input_that_is_not_held_is_released_with_the_screen(ends: tuple[int, int]) -> None:
    driver = started(RawDriver, ends[1])
    assert not echoes(ends[1])
    driver.stop_application_mode()
    assert echoes(ends[1])
    driver.close()
    assert driver.closed


def test_held_input_is_discarded_at_its_release(ends: tuple[int, int]) -> None:
    keyboard, terminal = ends
    driver = started(RawDriver, terminal)
    driver.hold_input()
    for _ in range(2):  # each thread that ends the panel leaves the screen
        driver.stop_application_mode()
        assert not echoes(terminal)
    driver.close()
    assert not driver.closed
    os.write(keyboard, b"\x1b[1;1Rrm x\n\x03")
    assert select.select([terminal], [], [], 10)[0]
    driver.release_input()
    assert echoes(terminal)
    assert not select.select([terminal, keyboard], [], [], 0)[0], "it was typed, or echoed"
    driver.close()
    assert driver.closed


def test_second_release_leaves_the_terminal_unchanged(ends: tuple[int, int]) -> None:
    driver = started(RawDriver, ends[1])
    driver.hold_input()
    driver.release_input()
    tty.setraw(ends[1])  # by the next program
    driver.release_input()
    assert not echoes(ends[1])


def test_error_in_leaving_the_screen_releases_the_input(ends: tuple[int, int]) -> None:
    driver = started(Broken, ends[1])
    with pytest.raises(RuntimeError):
        driver.stop_application_mode()
    assert echoes(ends[1])
