"""A question on the terminal while the program goes on with its work."""

from __future__ import annotations

import asyncio
import os
import sys
from contextlib import suppress

from ..shared.say import say_prompt

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
