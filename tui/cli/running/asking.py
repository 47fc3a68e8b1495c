"""A question on the terminal while the program goes on with its work."""

from __future__ import annotations

import asyncio
import os
import sys

import click

from ..shared.say import printable

YES = frozenset({"y", "yes"})


def may_ask() -> bool:
    """Whether there is a person at a terminal to ask."""
    return sys.stdin.isatty() and sys.stderr.isatty()


async def says_yes(question: str) -> bool:
    """Ask on standard error, and wait for a line; everything but y is no.

    The loop goes on meanwhile, and may be cancelled.
    """
    click.echo(f"{printable(question, sys.stderr.encoding)} [y/N] ", err=True, nl=False)
    answer = await _typed_line()
    return answer.strip().casefold() in YES


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
