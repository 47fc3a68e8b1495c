"""Owning a line or attaching to its owner: the lock decides, and losers attach."""

from __future__ import annotations

import asyncio
import logging
import time
from contextlib import suppress
from pathlib import Path

from ..errors import NotShared
from ..schedule.inside import LineInside
from .client import OwnerAway, Say, ShareClient
from .messages import VERSION
from .past_owner import PastOwner
from .place import Owner, OwnerLock, SharePlace, owner_of, owner_text
from .server import ShareServer
from .stops_past import StopsPast
from .turn import Turn

log = logging.getLogger(__name__)

OWNER_INTERVAL = 0.02
"""Seconds between two looks for an owner that is just beginning, or has just ended."""
LONGEST_QUIET = 30.0
"""Seconds that a line is left quiet at most, should a lock file tell of a later time."""
NO_OWNER = 3.0
"""Seconds after which a locked line without an owner that answers is given up."""


class Sharing:
    """How one program shares one line; lives in the line's loop."""

    def __init__(self, place: SharePlace, inside: LineInside) -> None:
        self._place = place
        self._inside = inside
        self._lock = OwnerLock(place)
        self._attached = False
        self._server: ShareServer | None = None
        self._client: ShareClient | None = None
        self._off = False
        self._quiet_until = 0.0

    @property
    def stops_only(self) -> bool:
        """Whether the owner is frozen, so that nothing but stops goes out."""
        return self._client is not None and self._client.frozen

    async def own(self, say: Say) -> None:
        """Return when this program owns the line; until then serve it as a client.

        Raises NotShared where the owner takes nobody in.
        """
        if self._lock.held or self._off:
            return
        inside = self._inside
        away_since: float | None = None
        served: Owner | None = None
        while True:
            try:
                taken = self._lock.take()
            except OSError as error:
                # without a lock nobody else can attach; a serial port stays locked by itself
                log.error("the line cannot be shared: %s", error)
                self._off = True
                return
            if taken:
                break
            owner = owner_of(self._place)
            try:
                if owner is None:
                    raise OwnerAway
                await self._attend(owner, say)
                served, away_since = owner, None
            except OwnerAway:
                now = inside.clock()
                away_since = away_since or now
                if now - away_since > NO_OWNER:
                    raise NotShared(
                        f"{owner_text(owner)} holds the line and cannot be reached. Close it."
                    ) from None
                await asyncio.sleep(OWNER_INTERVAL)
        await self._begin(served)

    async def _attend(self, owner: Owner, say: Say) -> None:
        """Be a client of an owner until it ends."""
        inside, place = self._inside, self._place
        past = PastOwner(inside, StopsPast(place), Turn(place), owner.program)
        self._client = client = ShareClient(inside, owner, say, past)
        client.again = self._attached
        try:
            await client.serve()
        finally:
            self._client = None
            self._attached = self._attached or client.taken_in
        log.info("%s does not own the line any more", owner.program.text)
        latest = inside.clock() + LONGEST_QUIET
        self._quiet_until = max(self._quiet_until, min(client.quiet_until, latest))

    async def _begin(self, served: Owner | None) -> None:
        """Listen as the owner, and wait until no reply to an owner before may come."""
        inside = self._inside
        if (before := owner_of(self._place)) is not None:
            inside.facts.stops.learn_times(before.stopped)
            left = _left_of(before, inside.timing.late_reply, inside.clock())
            self._quiet_until = max(self._quiet_until, inside.clock() + left)
        # should this program end before it listens
        stopped = inside.facts.stops.late_times
        self._lock.tell(Owner(VERSION, inside.facts.me, "", self._quiet_until, stopped))
        self._server = server = ShareServer(self._place, self._lock, inside)
        try:
            await server.start(served.program if served is not None else None)
        except OSError as error:
            log.error("the line cannot be shared: %s", error)
        await asyncio.sleep(max(0.0, self._quiet_until - inside.clock()))

    def pass_on(self, message: bytes) -> bool:
        """Send a finished message to the owner; False if none takes it."""
        client = self._client
        if client is None or client.frozen or client.writer is None:
            return False
        client.writer.write(message)
        return True

    def tell_state(self) -> None:
        """The line's state has changed."""
        if self._server is not None:
            self._server.tell_state()

    async def close(self, quiet: float) -> None:
        """Give the line to whoever is attached; a reply may still come for `quiet` seconds."""
        now = self._inside.clock()
        quiet = max(quiet, self._quiet_until - now)
        if self._server is not None:
            await self._server.close(quiet)
            self._server = None
        # whoever comes next may not have been attached
        me, stopped = self._inside.facts.me, self._inside.facts.stops.late_times
        last = Owner(VERSION, me, "", now + quiet if quiet > 0 else 0.0, stopped)
        self._lock.give_back(last if quiet > 0 or stopped else None)


def _left_of(before: Owner, lateness: float, now: float) -> float:
    """Seconds for which a reply to an owner that has ended may still come.

    One that was killed has left its socket, touched by each sign of life.
    """
    if not before.socket:
        return min(LONGEST_QUIET, max(0.0, before.quiet_until - now))
    with suppress(OSError):
        last = Path(before.socket).stat().st_mtime
        return min(lateness, max(0.0, last + lateness + 1.0 - time.time()))
    return lateness
