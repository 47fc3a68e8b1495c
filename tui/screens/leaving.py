"""Leaving a line or the panel: asks first if a drive would react, or a motor runs."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

from tui.terminal.loop import soon_in_loop

from .app_port import Panel
from .last_stops import LastStops, LineStops

if TYPE_CHECKING:
    from tui.session.console import DriveConsole
    from tui.session.drive import DriveSession
    from tui.session.fleet import Fleet
    from tui.session.timeout_report import TimeoutWatch

    from .dialogs.confirm import Confirm, SaveOffer
    from .dialogs.leave import LeaveChoice

STOP_OR_TAKE_OVER = "Press Space to stop it. To take it over, press Esc, then T on Monitor."
SAVE_FIRST = "Save drive {} to EEPROM first"
ONE_STAGED = "Device {device}: 1 staged edit is not written."
MANY_STAGED = "Device {device}: {count} staged edits are not written."
ONE_UNSAVED = "Device {device}: 1 written setting is not saved to EEPROM. It is lost at power-off."
MANY_UNSAVED = (
    "Device {device}: {count} written settings are not saved to EEPROM. They are lost at power-off."
)


class Leaving(Panel):
    """Steps of the app before it disconnects drives."""

    settled: bool
    """True once it is decided what happens to motors that this panel commands."""
    _requested: Confirm | None = None
    """The question before leaving, if no motor runs on a command of this panel."""

    async def action_quit(self) -> None:
        """Quit; ask first if a motor runs on a command of this panel, or a drive would react."""
        from .dialogs.leave import Leave
        from .dialogs.now import MotorStates

        if any(isinstance(screen, Leave) for screen in self.screen_stack):
            return
        if running := self._motors():
            reported = self._leaving_report(self.live_fleets, on_purpose=True)
            states, offer = MotorStates(self, running), self._save_offer(self.live_fleets)
            requested = Leave("\n".join(reported), states, offer)
            self.push_screen(requested, self._leave_motors)
            return
        if self._requested in self.screen_stack:
            return
        self._requested = self._question(self.live_fleets, "Quit the panel?", yes="Quit", no="Stay")
        if self._requested is None:
            self.exit()
        else:
            self.push_screen(self._requested, self._leave)

    def _motors(self) -> list[DriveSession]:
        """Drives that this panel commands and whose motors are not known to be at standstill."""
        return [
            session for fleet in self.live_fleets for session in fleet.line_watch.under_command()
        ]

    def _leaving_report(self, fleets: Sequence[Fleet], *, on_purpose: bool = False) -> list[str]:
        """Return what happens to the drives of these lines; with line names if there are several.

        `on_purpose`: running motors are recorded as left running.
        """
        reported = []
        for fleet in fleets:
            running = fleet.line_watch.under_command()
            here = self._left_running(fleet, running, on_purpose=on_purpose)
            here += self._left_behind(fleet)
            here += [*self._tripping(fleet, running), *self._unfinished(fleet)]
            label = next((o.opened.label for o in self.panel_lines if o.fleet is fleet), "")
            reported += [f"{label}:", *here] if here and len(self.panel_lines) > 1 else here
        return reported

    def _left_running(
        self, fleet: Fleet, sessions: list[DriveSession], *, on_purpose: bool
    ) -> list[str]:
        """The running motors with their drives' reactions, and what other programs do."""
        from tui.session.monitor.timeout import polling_stop_text
        from tui.session.sharing.handover import peer_effect_text

        reported = []
        for session in sessions:
            reported.append(
                polling_stop_text(session, watch=fleet.line_watch.watch(session.device))
            )
            reported += (
                [others] if (others := peer_effect_text(session, on_purpose=on_purpose)) else []
            )
        return reported

    def _left_behind(self, fleet: Fleet) -> list[str]:
        """Motors that no program commands, with their starters and what to do."""
        from tui.session.monitor.timeout import names_of

        return [
            f"{names_of([console.session])}: {left} {STOP_OR_TAKE_OVER}"
            for console in fleet.consoles
            if (left := fleet.left_behind(console))
        ]

    def _tripping(self, fleet: Fleet, but: Sequence[DriveSession] = ()) -> list[str]:
        """The drives that react to their communication timeout when polling stops, and when."""
        from tui.session.monitor.timeout import names_of, polling_stop_text

        reported = {session.device for session in but}
        line_watch = fleet.line_watch
        alike: dict[tuple[str, TimeoutWatch], list[DriveSession]] = {}
        for console in fleet.consoles:
            watch = line_watch.pending_timeouts().get(console.device)
            if watch is not None and console.device not in reported:
                alike.setdefault((console.session.profile.id, watch), []).append(console.session)
        found = [polling_stop_text(*same, watch=watch) for (_, watch), same in alike.items()]
        found += [
            f"{names_of([item])}: its communication loss reaction has not been read yet."
            for item in line_watch.unread()
            if item.device not in reported
        ]
        found += [
            f"Device {device}: its communication loss reaction is not known."
            for device, drive in fleet.found.items()
            if drive.console is None
        ]
        head = "When polling stops, these drives react to their timeout, even at standstill:"
        return [head, *found] if found else []

    def _leave_motors(self, choice: LeaveChoice | None) -> None:
        if choice == "leave":
            self.run_worker(self._leave_running(), exclusive=True, group="leave")
        elif choice == "stop":
            self.run_worker(self._stop_and_leave(), exclusive=True, group="leave")

    async def _leave_running(self) -> None:
        """Leave motors running, recorded for the next program."""
        from tui.session.starts.record import StartNotRecorded

        self.settled = True
        for session in self._motors():
            if session.starts is not None:
                with suppress(StartNotRecorded):
                    await asyncio.to_thread(session.starts.leave, session)
        self.exit()

    async def _stop_and_leave(self) -> None:
        """Stop all motors that this panel commands, then quit; stay if one does not stop."""
        if await asyncio.to_thread(self.stop_motors):
            self.settled = True
            self.exit()

    def leave_now(self) -> None:
        """End the screen; may be called in any thread."""
        self.settled = True
        soon_in_loop(self, self.exit)

    def stop_motors(self) -> bool:
        """Stop every motor that this panel commands; True if all have stopped.

        Blocks until then; may be called in any thread except the loop's.
        """
        return self.order_stops().wait()

    def order_stops(self) -> LastStops:
        """Order a stop of every motor that Drive Panel runs, and end all other work.

        May be called in any thread, returns immediately and raises nothing.
        """
        labels = {id(item.fleet): f"{item.opened.label}: " for item in self.panel_lines}
        several = len(labels) > 1
        lines = [
            LineStops(fleet, labels.get(id(fleet), "") if several else "")
            for fleet in self.live_fleets
        ]
        for line in lines:
            line.order()
        return LastStops(lines)

    def _leave(self, sure: bool | None) -> None:
        if sure:
            self.exit()

    async def may_let_go(self, question: str, *, yes: str, no: str, always: str = "") -> bool:
        """Return True if polling of the line's drives may stop; ask first if a drive reacts.

        With `always` it asks in any case, with that text. Call it in a worker: it waits for the
        answer.
        """
        fleets = [fleet for fleet in self.live_fleets if fleet is self.fleet]
        requested = self._question(fleets, question, yes=yes, no=no, always=always)
        if requested is None:
            return True
        answer: asyncio.Future[bool | None] = asyncio.get_running_loop().create_future()

        def reported(sure: bool | None) -> None:
            if not answer.done():  # the worker may have been canceled
                answer.set_result(sure)

        self.push_screen(requested, reported)
        return bool(await answer)

    def _question(
        self, fleets: Sequence[Fleet], question: str, *, yes: str, no: str, always: str = ""
    ) -> Confirm | None:
        """Return the question before polling stops; None if nothing is to be confirmed."""
        from .dialogs.confirm import Confirm
        from .dialogs.now import MotorStates

        reported = self._leaving_report(fleets)
        if always:
            reported.insert(0, always)
        if not reported:
            return None
        drives = [session for fleet in fleets for session in _concerned(fleet)]
        now = MotorStates(self, drives) if drives else None
        text, offer = "\n".join(reported), self._save_offer(fleets)
        return Confirm(question, text, yes=yes, no=no, loses=True, now=now, offer=offer)

    def _save_offer(self, fleets: Sequence[Fleet]) -> SaveOffer | None:
        """Offer to save the settings of the first drive that has some not in EEPROM."""
        from .dialogs.confirm import SaveOffer

        consoles = (console for fleet in fleets for console in fleet.consoles)
        unsaved = next((console for console in consoles if console.session.unsaved), None)
        if unsaved is None:
            return None
        return SaveOffer(SAVE_FIRST.format(unsaved.device), lambda: self._save_first(unsaved))

    async def _save_first(self, console: DriveConsole) -> None:
        """Show Parameters on a drive, of any line, and ask to save its settings."""
        line = next((line for line in self.panel_lines if console in line.fleet.consoles), None)
        if line is not None and line.fleet is not self.fleet:
            self.show_line(line)
        if self.chosen is not console:  # showing Monitor again would disarm the drive
            self.show_monitor(console)
        await self.run_action("eeprom")

    def _unfinished(self, fleet: Fleet) -> list[str]:
        """Return the unfinished work on parameters that would be lost."""
        reported = []
        for console in fleet.consoles:
            device, editor = console.device, console.begun_editor
            if editor is not None and len(editor.staging.edits):
                staged = len(editor.staging.edits)
                text = ONE_STAGED if staged == 1 else MANY_STAGED
                reported.append(text.format(device=device, count=staged))
            if unsaved := len(console.session.unsaved):
                text = ONE_UNSAVED if unsaved == 1 else MANY_UNSAVED
                reported.append(text.format(device=device, count=unsaved))
        return reported


def _concerned(fleet: Fleet) -> list[DriveSession]:
    """Drives of a line that this panel runs, or that react when polling stops."""
    turning = {session.device for session in fleet.line_watch.under_command()}
    turning |= fleet.line_watch.pending_timeouts().keys()
    turning |= {console.device for console in fleet.consoles if fleet.left_behind(console)}
    return [session for session in fleet.sessions if session.device in turning]
