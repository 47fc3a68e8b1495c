"""End of a command: done, failed, or cut short by a signal; and the reaction of its drives."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Sequence
from typing import TYPE_CHECKING, Any, TypeVar

import click

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine

T = TypeVar("T")


async def to_its_end(lines: Sequence[OpenLine], work: Callable[[], Coroutine[Any, Any, T]]) -> T:
    """Do the work; in any case, report what drives do when polling stops.

    Raises Exit with 128 and the number of a signal that ended it; one that comes once the work is
    done ends only what is said of the drives.
    """
    from tui.session.signals import BY_SIGNAL

    from .pending_timeouts import say_farewells
    from .signals import cancelled_by_signal

    task = asyncio.current_task()
    assert task is not None
    with cancelled_by_signal(task) as came:
        try:
            return await work()
        except asyncio.CancelledError:
            if not came:
                raise
            raise click.exceptions.Exit(BY_SIGNAL + came[0]) from None
        finally:
            try:
                await asyncio.gather(*(say_farewells(line) for line in lines))
            except asyncio.CancelledError:
                # what the work came to, or why it failed, is told all the same
                if not came:
                    raise
