"""Owning a line or attaching to its owner: the lock decides, and losers attach."""

from __future__ import annotations

import asyncio
import logging
import time
from contextlib import suppress
from pathlib import Path

from ..errors import NotShared
from ..schedule.inside import LineInside
from .client import OwnerAway, Say, ShareClient, owner_text
from .messages import VERSION
from .place import Owner, OwnerLock, SharePlace, owner_of
from .server import ShareServer
from .stops_past import StopsPast

log = logging.getLogger(__name__)

LOOK_INTERVAL = 0.02
"""Seconds between two looks for an owner that is just beginning, or has just ended."""
NO_OWNER = 3.0
"""Seconds after which a locked line without an owner that answers is given up."""


class Sharing:
    """How one program shares one line; lives in the line's loop."""

    def __init__(self, place: SharePlace, inside: LineInside) -> None:
        self._place = place
        self._inside = inside
        self._lock = OwnerLock(place)
        self._stops_past = StopsPast(place)
        self._attached = False
        self._server: ShareServer | None = None
        self._client: ShareClient | None = None
        self._off = False

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
        quiet_until = 0.0
        away_since: float | None = None
        served: Owner | None = None
        while True:
            before = owner_of(self._place)
            try:
                taken = self._lock.take()
            except OSError as error:
                # without a lock nobody else can attach; a serial port stays locked by itself
                log.error("the line cannot be shared: %s", error)
                self._off = True
                return
            if taken:
                self._lock.tell(Owner(VERSION, inside.facts.me, ""))
                break
            owner = owner_of(self._place)
            try:
                if owner is None:
                    raise OwnerAway
                served = owner
                quiet_until = await self._attend(owner, say)
                away_since = None
            except OwnerAway:
                now = inside.clock()
                away_since = away_since or now
                if now - away_since > NO_OWNER:
                    raise NotShared(
                        f"{owner_text(owner)} holds the line and cannot be reached. Close it."
                    ) from None
                await asyncio.sleep(LOOK_INTERVAL)
        await self._begin(before, quiet_until, served)

    async def _attend(self, owner: Owner, say: Say) -> float:
        """Be a client of an owner until it ends; returns when its last reply cannot come."""
        self._client = client = ShareClient(self._inside, owner, say, self._stops_past)
        client.again, self._attached = self._attached, True
        try:
            await client.serve()
        finally:
            self._client = None
        log.info("%s does not own the line any more", owner.program.text)
        return client.heard + client.quiet

    async def _begin(self, before: Owner | None, quiet_until: float, served: Owner | None) -> None:
        """Listen as the owner, and wait until no reply to an owner before may come."""
        inside = self._inside
        if not quiet_until and before is not None:
            quiet_until = inside.clock() + _left_of(inside.timing.late_reply, before)
        server = ShareServer(self._place, self._lock, inside)
        try:
            await server.start(served.program if served is not None else None)
        except OSError as error:
            log.error("the line cannot be shared: %s", error)
        self._server = server
        await asyncio.sleep(max(0.0, quiet_until - inside.clock()))

    def tell_state(self) -> None:
        """The line's state has changed."""
        if self._server is not None:
            self._server.tell_state()

    async def close(self, quiet: float) -> None:
        """Give the line to whoever is attached; a reply may still come for `quiet` seconds."""
        if self._server is not None:
            await self._server.close(quiet)
            self._server = None
        self._lock.give_back()


def _left_of(lateness: float, dead: Owner) -> float:
    """Seconds for which a reply to an owner that was killed may still come.

    Its socket is left behind, touched by each sign of life.
    """
    with suppress(OSError):
        last = Path(dead.socket).stat().st_mtime
        return min(lateness, max(0.0, last + lateness + 1.0 - time.time()))
    return 0.0
