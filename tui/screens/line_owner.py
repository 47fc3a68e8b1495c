"""Opening and closing of the panel's lines."""

from __future__ import annotations

import asyncio
import logging
import threading
from collections.abc import Callable
from typing import TYPE_CHECKING

from tui.bus.errors import LineClosed
from tui.session.events import EventLog
from tui.session.paths import remember_line
from tui.terminal.loop import soon_in_loop

from .app_port import Panel
from .open_lines import LineEvents, PanelLine

if TYPE_CHECKING:
    from tui.bus.line_events import LineEvent
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession
    from tui.session.fleet import Fleet
    from tui.session.journal import Journal

log = logging.getLogger(__name__)

CHOSEN_CONNECTS_WITHIN = 4.0
"""Seconds within which a line chosen by a person must connect."""

WAY_TO_ACCEPT = "If this is the right line, press Ctrl+P and type accept."

Opener = Callable[..., "OpenLine"]


class LineOwner(Panel):
    """Opens and closes lines; the one opened or chosen last is shown."""

    _open: Opener
    _gone = False
    """True after the panel has ended: a line opened since is closed again."""
    _journal: Journal | None = None
    panel_lines: tuple[PanelLine, ...] = ()
    opened: OpenLine | None = None
    fleet: Fleet | None = None

    @property
    def journal(self) -> Journal:
        """The record of all writes to drives."""
        if self._journal is None:
            from tui.session.journal import Journal

            self._journal = Journal()
        return self._journal

    @property
    def journal_trouble(self) -> str:
        """Why writes cannot be recorded; empty while they are."""
        return self._journal.trouble if self._journal is not None else ""

    async def connect(self, text: str, *, remember: bool = True) -> None:
        """Open a line and show it; raises the line's errors.

        Lines with drives stay open. The same line with other settings is closed first. Without
        `remember` it is not added to the recent lines.
        """
        if (here := self.open_line_of(text)) is not None:
            await self._close(here)
        shown = self._shown()
        if shown is not None and not shown.fleet.found:
            await self._close(shown)  # it has no drives
        opening = asyncio.ensure_future(asyncio.to_thread(self._open_here, text, remember=remember))
        try:
            opened = await asyncio.shield(opening)
        except asyncio.CancelledError:
            opening.add_done_callback(_close_unwanted)
            raise
        if opened.replay is not None:
            only = opened.devices[0] if len(opened.devices) == 1 else None
            line = await self._with_replayed(opened, only)
        else:
            line = self._with_fleet(opened)
        self.panel_lines = (*self.panel_lines, line)
        self.show_line(line)
        if opened.replay is not None:
            opened.replay.clock.play()
        else:
            self._look_after(line.fleet)
            line.fleet.event_notes.ask()
        if unkept := opened.line.facts.unkept:
            line.fleet.events.add("alarm", unkept)
        log.info("opened %s", opened.label)
        self.opening.connected = True

    def _with_fleet(self, opened: OpenLine) -> PanelLine:
        from tui.session.fleet import Fleet
        from tui.session.starts.keeper import StartKeeper

        # no record for a simulated line: its motors end with it
        starts = StartKeeper("panel", clock=self.panel_clock) if opened.is_real else None
        if starts is not None:
            starts.left_running = self.leave_running
        events = LineEvents(self.events, opened.label, lambda: self.opened is opened)
        return PanelLine(opened, Fleet(opened.line, self.journal, starts, events, self.panel_clock))

    async def _with_replayed(
        self, opened: OpenLine, device: int | None, *, goes_on: bool = True
    ) -> PanelLine:
        """Return a replay with its drives at its time; messages in it are not those of the panel.

        The drive `device` was monitored before that time; if it `goes_on`, it still is.
        """
        from tui.session.fleet import Fleet
        from tui.session.replay import (
            UnwrittenJournal,
            add_trips,
            pass_lead,
            recall_trip,
            take_drives,
        )

        from .monitor.assembly import start_monitor

        replay = opened.replay
        assert replay is not None
        events = EventLog(replay.clock.wall)
        fleet = Fleet(replay, UnwrittenJournal(), None, events, replay.clock)
        for text in await asyncio.to_thread(take_drives, replay, fleet):
            self.events.add("alarm", text)

        await pass_lead(replay, fleet, device, start_monitor, self.period, goes_on=goes_on)

        async def seek_trips() -> None:
            await asyncio.to_thread(add_trips, replay, device)
            if device is not None and (console := fleet.console(device)) is not None:
                await recall_trip(replay, console, start_monitor, self.period)

        group = f"trips of {replay.path}"
        self.run_worker(seek_trips(), group=group, exclusive=True, exit_on_error=False)
        return PanelLine(opened, fleet)

    def open_line_of(self, text: str) -> PanelLine | None:
        """The open line that a text names, whatever its settings; None if it is not open."""
        if not self.panel_lines:
            return None
        from tui.session.connect.line_key import line_key

        wanted = line_key(text)
        return next(
            (line for line in self.panel_lines if line_key(line.opened.text) == wanted), None
        )

    def show_line(self, line: PanelLine | None) -> None:
        """Show another open line; no drive of it is open yet."""
        self.chosen = None
        self.opened, self.fleet = (line.opened, line.fleet) if line is not None else (None, None)

    def _shown(self) -> PanelLine | None:
        return next((line for line in self.panel_lines if line.opened is self.opened), None)

    def _look_after(self, fleet: Fleet) -> None:
        """Follow stops by other programs, and stop motors of programs that have exited."""
        from tui.bus.line_events import DevicesStopped
        from tui.session.sharing.orphan_motors import OrphanMotorGuard

        def session_of(device: int) -> DriveSession | None:
            console = fleet.console(device)
            return console.session if console is not None else None

        def hear(event: LineEvent) -> None:
            if isinstance(event, DevicesStopped):
                soon_in_loop(self, self.stopped_elsewhere, list(event.devices))

        fleet.line.facts.events.subscribe(hear)
        fleet.handover.person = True
        OrphanMotorGuard(
            fleet.line,
            self.journal,
            session_of=session_of,
            events=fleet.events,
            clock=self.panel_clock,
        )

    def _open_here(self, text: str, *, remember: bool) -> OpenLine:
        """Open a line in a thread; close it again if the panel has ended in the meantime."""
        opened = self._open(
            text, read_only=self.read_only, wait=CHOSEN_CONNECTS_WITHIN, program="panel"
        )
        if opened.is_real:
            from tui.session.connect.known_line import KnownLine

            opened.known = KnownLine(opened.line, way=WAY_TO_ACCEPT)
        elif opened.simulation is not None and opened.recorder is None:
            opened.record_privately()
        # imported here, in a thread, because the loop needs them next and would block on them
        import tui.screens.monitor.screen
        import tui.session.fleet  # noqa: F401

        if self._gone:
            opened.close()
            raise LineClosed
        if remember and opened.replay is None:
            _remember(opened.text)
        return opened

    def stopped_elsewhere(self, devices: list[int]) -> None:
        """End the questions about drives that another program stopped."""

    async def disconnect(self) -> None:
        """Close the line that is shown, if any; then show another open one."""
        if (shown := self._shown()) is not None:
            await self._close(shown)

    async def disconnect_all(self) -> None:
        """Close every line."""
        for line in self.panel_lines:
            await self._close(line)

    async def _close(self, line: PanelLine) -> None:
        self.panel_lines = tuple(other for other in self.panel_lines if other is not line)
        if self.opened is line.opened:
            self.show_line(self.panel_lines[-1] if self.panel_lines else None)
        line.fleet.forget()
        # completed even if the opening that needs it is canceled
        await asyncio.shield(asyncio.to_thread(_close_all_of, line))
        log.info("closed %s", line.opened.label)


def _close_all_of(line: PanelLine) -> None:
    """Close a line, and wait until the records of its motors are written."""
    line.opened.close()
    if line.fleet.starts is not None:
        line.fleet.starts.close()


def _remember(text: str) -> None:
    """Add the line to the recent ones, by its adapter's permanent name."""
    from tui.session.connect.known_lines import remembered_text

    remember_line(remembered_text(text))


def _close_unwanted(opening: asyncio.Future[OpenLine]) -> None:
    """Close a line whose opening was canceled before it finished."""
    if not opening.cancelled() and opening.exception() is None:
        threading.Thread(target=opening.result().close, name="close line", daemon=True).start()
