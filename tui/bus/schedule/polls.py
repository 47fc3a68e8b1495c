"""Plans of this program that the process which holds the line carries out."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import suppress
from typing import Protocol

from ..poll_plan import PolledTurn, PollPlan


class Subscription:
    """One plan that is carried out elsewhere; used in the line's loop.

    Of cycles that come faster than they are taken the last one counts.
    """

    def __init__(self, plan: PollPlan, leave: Callable[[], None]) -> None:
        self.plan = plan
        self.ended = False
        self._leave = leave
        self._latest: PolledTurn | None = None
        self._moved = asyncio.Event()

    async def next(self, within: float) -> PolledTurn | None:
        """The next cycle; None if it has ended, or brings nothing within so many seconds."""
        if self._latest is None and not self.ended:
            with suppress(TimeoutError):
                async with asyncio.timeout(within):
                    await self._moved.wait()
        self._moved.clear()
        found, self._latest = self._latest, None
        return found

    def hear(self, turn: PolledTurn) -> None:
        """A cycle has come."""
        self._latest = turn
        self._moved.set()

    def lose(self) -> None:
        """The process that carries it out is gone, or does not answer."""
        self.ended = True
        self._moved.set()

    def end(self) -> None:
        """Have no more cycles."""
        if not self.ended:
            self.lose()
            self._leave()


class PollCarrier(Protocol):
    """Carries plans to the process that holds the line."""

    def subscribe(self, plan: PollPlan) -> Subscription | None:
        """Have a plan carried out; None if that process does not answer.

        Raises RequestRefused for a plan beyond the limits of its device.
        """
