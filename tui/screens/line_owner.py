"""The one line that the panel has open, and the drives on it."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from tui.bus.errors import LineClosed
from tui.session.paths import remember_line
from tui.terminal.loop import soon_in_loop

from .app_port import Panel

if TYPE_CHECKING:
    from tui.bus.program import Program
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession
    from tui.session.fleet import Fleet
    from tui.session.journal import Journal

log = logging.getLogger(__name__)

CHOSEN_CONNECTS_WITHIN = 4.0
"""Seconds in which a line chosen by a person must connect."""

Opener = Callable[..., "OpenLine"]


class LineOwner(Panel):
    """Opens a line in place of the one before, and closes it."""

    _open: Opener
    _gone = False
    """Whether the panel was left: what is opened from then on is closed again."""
    _journal: Journal | None = None
    opened: OpenLine | None = None
    fleet: Fleet | None = None

    @property
    def journal(self) -> Journal:
        """The record of what is written to drives."""
        if self._journal is None:
            from tui.session.journal import Journal

            self._journal = Journal()
        return self._journal

    @property
    def journal_trouble(self) -> str:
        """Why what is written is not on record; empty while it is."""
        return self._journal.trouble if self._journal is not None else ""

    async def connect(self, text: str) -> None:
        """Open a line in place of the one that is open; raises the line's errors."""
        await self.disconnect()
        opening = asyncio.ensure_future(asyncio.to_thread(self._open_here, text))
        try:
            self.opened = await asyncio.shield(opening)
        except asyncio.CancelledError:
            opening.add_done_callback(_close_unwanted)
            raise
        from tui.session.fleet import Fleet
        from tui.session.starts.keeper import StartKeeper

        # the motors of a simulated line end with it
        starts = StartKeeper("panel", clock=self.clock) if self.opened.simulation is None else None
        self.fleet = Fleet(self.opened.line, self.journal, starts, self.events, self.clock)
        self._look_after(self.fleet)
        log.info("opened %s", self.opened.label)
        await asyncio.to_thread(remember_line, self.opened.text)

    def _look_after(self, fleet: Fleet) -> None:
        """Tell who shares the line, and stop the motors of programs on it that are gone."""
        from tui.session.sharing.guardian import Guardian

        def session_of(device: int) -> DriveSession | None:
            console = fleet.console(device)
            return console.session if console is not None else None

        def timeout_of(device: int) -> float | None:
            watch = fleet.line_watch.watch(device)
            return watch.timeout if watch is not None else None

        def stopped(devices: tuple[int, ...], _by: str, _program: Program) -> None:
            soon_in_loop(self, self.stopped_elsewhere, list(devices))

        fleet.line.facts.on_stop(stopped)
        fleet.handover.person = True
        Guardian(
            fleet.line,
            self.journal,
            session_of=session_of,
            timeout_of=timeout_of,
            person=True,
            events=self.events,
            clock=self.clock,
        )

    def _open_here(self, text: str) -> OpenLine:
        """Open a line in a thread; closed again where the panel was left meanwhile."""
        opened = self._open(
            text, read_only=self.read_only, wait=CHOSEN_CONNECTS_WITHIN, program="panel"
        )
        # here, where nobody waits for a key: what the loop asks for next
        import tui.screens.monitor.screen
        import tui.session.fleet  # noqa: F401

        if self._gone:
            opened.close()
            raise LineClosed
        return opened

    def stopped_elsewhere(self, devices: list[int]) -> None:
        """Another program stopped drives: what is being asked about them is void."""

    async def disconnect(self) -> None:
        """Close the open line, if there is one."""
        opened, self.opened = self.opened, None
        fleet, self.fleet, self.chosen = self.fleet, None, None
        if opened is not None:
            await asyncio.to_thread(opened.close)
            if fleet is not None and fleet.starts is not None:
                await asyncio.to_thread(fleet.starts.close)
            log.info("closed %s", opened.label)


def _close_unwanted(opening: asyncio.Future[OpenLine]) -> None:
    """Close a line that was opened after another one had been chosen."""
    if not opening.cancelled() and opening.exception() is None:
        threading.Thread(target=opening.result().close, name="close line", daemon=True).start()
