"""Owning a line or attaching to its owner: the lock decides, and losers attach."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable

from tui.safety import STOP_DISK_WITHIN

from ..errors import LineLost, NotShared
from ..line_events import NoticeReceived
from ..link import label
from ..model import LineStatus
from ..program import KEEPER, Program, pid_namespace
from ..schedule.inside import LineInside, Say, SharedLine
from ..transport.opening import opened_beside
from .client import OwnerAway, ShareClient
from .keeping import KeeperOrder, start_keeper
from .messages import VERSION
from .place import (
    MOST_DEATHS,
    STARTING,
    Owner,
    OwnerLock,
    SharePlace,
    owner_of,
)
from .server import ShareServer

log = logging.getLogger(__name__)

ShareLine = Callable[[SharePlace, LineInside], SharedLine]
"""Makes the sharing of a line by the programs that meet at a place."""
OWNER_INTERVAL = 0.02
"""Seconds between two looks for an owner that is just beginning, or has just ended."""
LONGEST_QUIET = 30.0
"""Longest quiet time of a line in seconds, should a lock file state a later time."""
NO_OWNER = 3.0
"""Seconds after which a locked line without an owner that answers is given up."""
AWAY_FOR = 0.5
"""Seconds without an owner after which that is shown."""
UNKEPT = (
    "This program holds the line itself, as its keeper {why}. If this program is killed, nothing"
    " stops the motors that it has started."
)
DISK_WITHIN = 2.0
"""Timeout in seconds for locking a file; then the line is used without a lock."""
NO_DISK = "the system does not answer"
DIED_OFTEN = f"has died {MOST_DEATHS} times within a minute"
HOLDER_AWAY = "The process that held the line has ended; the next one starts."
KEEPER_STARTS = 20.0
"""Seconds in which the keeper of a line must listen: a small computer starts it slowly."""


class Sharing:
    """Sharing of one line by one program; lives in the line's loop."""

    def __init__(self, place: SharePlace, inside: LineInside, *, keeper: bool = False) -> None:
        """With `keeper` a process is started that owns the line; without, this program does."""
        self._keeper = keeper
        self._keeper_lives: Callable[[], bool] = bool
        self._place = place
        self._inside = inside
        self._lock = OwnerLock(place)
        self._attached = False
        self._server: ShareServer | None = None
        self._client: ShareClient | None = None
        self._off = False
        self._finding = False
        """True while a thread uses the lock; if nothing waits for it, it gives the lock back."""
        self._starts_until = 0.0
        self._quiet_until = 0.0

    @property
    def frozen(self) -> bool:
        """True while the process that holds the line does not answer."""
        return self._client is not None and self._client.watching.frozen

    @property
    def starts(self) -> bool:
        """True while a keeper starts, for some time."""
        attached = self._client is not None and self._client.taken_in
        return not attached and self._inside.clock() < self._starts_until

    async def own(self, say: Say) -> None:
        """Return when this program owns the line; until then serve it as a client.

        Raises NotShared if the owner rejects this program.
        """
        if self._lock.held or self._off:
            return
        inside = self._inside
        away_since: float | None = None
        shown = False
        path = str(self._place.lock_path)
        while True:
            try:
                self._finding = True
                within = DISK_WITHIN if self._keeper else STOP_DISK_WITHIN
                owner, why = await opened_beside(path, self._find_holder, self._drop_lock, within)
                self._finding = False
            except (OSError, LineLost) as error:
                self._finding = isinstance(error, LineLost)
                # without a lock nobody else can attach; a serial port stays locked by itself
                self._off = True
                why = NO_DISK if isinstance(error, LineLost) else error.strerror or str(error)
                log.error("the line cannot be shared: %s", why)
                self._hold_unkept(f"has no folder that can be used ({why})")
                return
            if why:
                self._hold_unkept(why)
            if self._lock.held:
                break
            try:
                if owner is None:
                    raise OwnerAway
                await self._attend(owner, say)
                away_since, shown = None, False
            except OwnerAway:
                now = inside.clock()
                away_since = away_since or now
                begins = self._keeper_lives() or (owner is not None and owner.starts)
                self._starts_until = away_since + KEEPER_STARTS if begins else 0.0
                if self._attached and now - away_since > AWAY_FOR and not shown:
                    shown = True
                    say(LineStatus.CONNECTING, HOLDER_AWAY, None)
                if now - away_since > (KEEPER_STARTS if begins else NO_OWNER):
                    who = owner.program.text if owner else "another program"
                    raise NotShared(
                        f"{who} holds the line and cannot be reached. Close it."
                    ) from None
                await asyncio.sleep(OWNER_INTERVAL)
        await self._listen()
        self._doubt_replies()

    def _find_holder(self) -> tuple[Owner | None, str]:
        """Take the lock or find its owner, in a thread: the disk may hang.

        The line's keeper is started with the lock. If that fails, this program keeps the lock, and
        the text is the reason. Raises OSError.
        """
        taken = self._lock.take()
        owner = owner_of(self._place)
        return owner, self._give_to_keeper() if taken and self._keeper else ""

    def _drop_lock(self, _: object) -> None:
        """Release a lock that came too late; in the thread that has used it."""
        self._lock.hand_over()

    def _give_to_keeper(self) -> str:
        """Start the line's keeper, which has the lock from then on; returns why it cannot be."""
        now = self._inside.clock()
        self._keeper_lives = bool
        if len(self._lock.deaths) >= MOST_DEATHS:
            return DIED_OFTEN
        facts, place = self._inside.facts, self._place
        self._learn_of_before()
        before = (*facts.departed, *facts.programs)
        order = KeeperOrder.of(place, label(self._inside.link), before)

        def started(pid: int) -> None:
            if self._off:
                raise OSError("it comes too late: this program holds the line")
            keeper = Program(STARTING, KEEPER, pid, space=pid_namespace())
            stopped = facts.stops.late_times
            self._lock.tell(Owner(VERSION, keeper, "", self._quiet_until, stopped))

        try:
            self._keeper_lives = start_keeper(order, self._lock.descriptor, started)
        except OSError as error:
            log.error("the keeper of the line could not be started: %s", error)
            return f"could not be started ({error.strerror or error})"
        self._starts_until = now + KEEPER_STARTS
        self._lock.hand_over()
        return ""

    def _hold_unkept(self, why: str) -> None:
        """This program holds a line that a keeper was to hold; a person is to know."""
        if self._keeper:
            self._inside.facts.unkept = text = UNKEPT.format(why=why)
            self._inside.facts.events.emit(NoticeReceived(0, text))

    async def _attend(self, owner: Owner, say: Say) -> None:
        """Be a client of an owner until it ends."""
        self._inside.facts.unkept = ""
        self._client = client = ShareClient(self._inside, owner, say)
        client.again = self._attached
        try:
            await client.serve()
        finally:
            self._client = None
            self._attached = self._attached or client.taken_in
        log.info("%s no longer owns the line", owner.program.text)
        self._keeper_lives()  # collects its exit status, if this program has started it
        self._keeper_lives, self._starts_until = bool, 0.0

    async def _listen(self) -> bool:
        """Serve the programs on the line; False if that cannot be."""
        facts = self._inside.facts
        try:
            self._learn_of_before()
            # should this program end before it listens
            stopped = facts.stops.late_times
            self._lock.tell(Owner(VERSION, facts.me, "", self._quiet_until, stopped))
            self._server = ShareServer(self._place, self._lock, self._inside, self)
            await self._server.start()
        except OSError as error:
            log.error("the line cannot be shared: %s", error)
            facts.set_programs((facts.me,))
            return False
        return True

    def _learn_of_before(self) -> None:
        """Heed the times that the last owner has left in the lock file."""
        inside = self._inside
        if (before := owner_of(self._place)) is not None:
            inside.facts.stops.learn_times(before.stopped)
            now, until = inside.clock(), before.quiet_until
            # one that was killed has left its socket: it may have sent until a moment ago
            latest = inside.timing.late_reply if before.socket else min(until - now, LONGEST_QUIET)
            self._quiet_until = max(self._quiet_until, now + latest)

    def _doubt_replies(self) -> None:
        """Trust no reply of a drive that may be one to an earlier request."""
        self._inside.dispatcher.proof.doubt(self._quiet_until)

    async def unwanted(self) -> None:
        """Never: the line is open for this program, too."""
        await asyncio.Event().wait()

    def moved(self, *, arrived: bool) -> None:
        """Note that a program has attached or left."""

    async def port_left(self) -> None:
        """Return once the port is closed, or in use by others; a program that leaves relies on
        that."""

    async def makes_way(self) -> bool:
        """End if no program is served, and return True; not this program, which uses the line
        itself."""
        return False

    async def pause(self, seconds: float) -> None:
        """Wait before a lost line is tried again."""
        await asyncio.sleep(seconds)

    def rest(self, quiet: float) -> None:
        """Note that the port is closed; a reply may still come for `quiet` seconds."""
        if quiet > 0:
            self._quiet_until = max(self._quiet_until, self._inside.clock() + quiet)

    def pass_on(self, message: bytes) -> bool:
        """Send a finished message to the owner; False if no owner accepts it."""
        return self._client is not None and self._client.pass_on(message)

    def tell_state(self) -> None:
        """The line's state has changed."""
        if self._server is not None:
            self._server.tell_state()

    async def close(self, quiet: float) -> None:
        """Hand the line over to an attached program; a reply may still come for `quiet` seconds."""
        now = self._inside.clock()
        quiet = max(quiet, self._quiet_until - now)
        if self._server is not None:
            await self._server.close()
            self._server = None
        # the next owner may not have been attached
        me, stopped = self._inside.facts.me, self._inside.facts.stops.late_times
        last = Owner(VERSION, me, "", now + quiet if quiet > 0 else 0.0, stopped)
        if not self._finding:
            self._lock.give_back(last if quiet > 0 or stopped else None)
