"""Questions on the terminal: while the program goes on, and before frequent EEPROM writes."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import Collection
from contextlib import suppress
from typing import TYPE_CHECKING

from .say import Messages, say_prompt

if TYPE_CHECKING:
    from tui.session.journal import Journal
    from tui.session.settings.wear import WearGate


def wear_gate(journal: Journal, confirmed: Collection[str], messages: Messages) -> WearGate:
    """Return the decision of a command: warn, ask at a terminal, else require --confirm CODE."""
    from tui.session.settings.wear import WearGate

    return WearGate(
        journal.eeprom,
        confirmed,
        says_yes if may_ask() else None,
        messages.complain,
        "Use --confirm {code} to write it anyway.",
    )


YES = frozenset({"y", "yes"})


def may_ask() -> bool:
    """Return True if there is a person at a terminal to ask."""
    return sys.stdin.isatty() and sys.stderr.isatty()


async def says_yes(question: str) -> bool:
    """Show a question on standard error, and wait for a line; everything but y is no.

    The loop runs on, and may be cancelled.
    """
    return (await typed_answer(f"{question} [y/N]")).casefold() in YES


async def typed_answer(question: str) -> str:
    """Show a question on standard error, and return the line that is typed.

    The loop runs on, and may be cancelled.
    """
    _forget_typed()
    say_prompt(question)
    return (await _typed_line()).strip()


def _forget_typed() -> None:
    """Discard input typed before the question was shown."""
    if os.name == "posix":
        import termios

        with suppress(termios.error):
            termios.tcflush(sys.stdin.fileno(), termios.TCIFLUSH)


async def _typed_line() -> str:
    loop = asyncio.get_running_loop()
    if os.name != "posix":
        return await asyncio.to_thread(sys.stdin.readline)
    handle = sys.stdin.fileno()
    came = asyncio.Event()
    loop.add_reader(handle, came.set)
    try:
        await came.wait()
    finally:
        loop.remove_reader(handle)
    return os.read(handle, 1024).decode(errors="replace")
