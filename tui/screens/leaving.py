"""Leaving a line or the panel: nothing is left to itself unasked, motors least of all."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

from tui.terminal.loop import soon_in_loop

from .app_port import Panel
from .last_stops import LastStops, LineStops

if TYPE_CHECKING:
    from tui.session.drive import DriveSession
    from tui.session.fleet import Fleet
    from tui.session.timeout_report import TimeoutWatch

    from .dialogs.confirm import Confirm
    from .dialogs.leave import LeaveChoice

STOP_OR_TAKE_OVER = "Space stops it. To take it over: Esc, then T on Monitor."


class Leaving(Panel):
    """Steps of the app before it lets drives go."""

    settled: bool
    """True if it was decided what happens to motors that run by a command of this panel."""
    _requested: Confirm | None = None
    """The question before leaving, while nothing runs by a command from here."""

    async def action_quit(self) -> None:
        """Leave; where a motor runs by a command from here, or a drive trips, not unasked."""
        from .dialogs.leave import Leave
        from .dialogs.now import MotorStates

        if any(isinstance(screen, Leave) for screen in self.screen_stack):
            return
        if running := self._motors():
            reported = self._leaving_report(self.fleets, on_purpose=True)
            requested = Leave("\n".join(reported), MotorStates(self, running))
            self.push_screen(requested, self._leave_motors)
            return
        if self._requested in self.screen_stack:
            return
        self._requested = self._question(self.fleets, "Leave the panel?", yes="Leave", no="Stay")
        if self._requested is None:
            self.exit()
        else:
            self.push_screen(self._requested, self._leave)

    def _motors(self) -> list[DriveSession]:
        """Drives of all lines commanded by this panel whose motors are not surely at standstill."""
        return [session for fleet in self.fleets for session in fleet.line_watch.under_command()]

    def _leaving_report(self, fleets: Sequence[Fleet], *, on_purpose: bool = False) -> list[str]:
        """Return what happens to the drives of lines that are left; several lines by their names.

        `on_purpose`: motors that run are put on record as left running.
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
        """Which motors run, what each drive does left alone, and what others on its line do."""
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
        """Motors that no program commands, who started each, and what to do."""
        from tui.session.monitor.timeout import names_of

        return [
            f"{names_of([console.session])}: {left} {STOP_OR_TAKE_OVER}"
            for console in fleet.consoles
            if (left := fleet.left_behind(console))
        ]

    def _tripping(self, fleet: Fleet, but: Sequence[DriveSession] = ()) -> list[str]:
        """Which drives act on their communication timeout once they are left, and when."""
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
            f"{names_of([item])}: what it does on loss of communication was not read yet."
            for item in line_watch.unread()
            if item.device not in reported
        ]
        found += [
            f"Device {device}: its reaction when polling stops is not known."
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
        """Stop what runs by an order from here, then leave; stay where one does not stop."""
        if await asyncio.to_thread(self.stop_motors):
            self.settled = True
            self.exit()

    def leave_now(self) -> None:
        """End the screen; may be called in any thread."""
        self.settled = True
        soon_in_loop(self, self.exit)

    def stop_motors(self) -> bool:
        """Stop every motor that runs by an order from here; True when none runs any more.

        Waits for it; may be called in any thread but the loop's.
        """
        return self.order_stops().wait()

    def order_stops(self) -> LastStops:
        """Order a stop of every motor that Drive Panel runs, and end all other work.

        May be called in any thread, returns at once and raises nothing.
        """
        labels = {id(item.fleet): f"{item.opened.label}: " for item in self.panel_lines}
        several = len(labels) > 1
        lines = [
            LineStops(fleet, labels.get(id(fleet), "") if several else "") for fleet in self.fleets
        ]
        for line in lines:
            line.order()
        return LastStops(lines)

    def _leave(self, sure: bool | None) -> None:
        if sure:
            self.exit()

    async def may_let_go(self, question: str, *, yes: str, no: str, always: str = "") -> bool:
        """Return True if the drives of the line may be left alone; asks where that trips one that
        runs.

        With `always` it asks in any case, and says that. Belongs into a worker: it waits for
        the answer.
        """
        fleets = [self.fleet] if self.fleet is not None else []
        requested = self._question(fleets, question, yes=yes, no=no, always=always)
        if requested is None:
            return True
        answer: asyncio.Future[bool | None] = asyncio.get_running_loop().create_future()

        def reported(sure: bool | None) -> None:
            if not answer.done():  # who asked may have given up meanwhile
                answer.set_result(sure)

        self.push_screen(requested, reported)
        return bool(await answer)

    def _question(
        self, fleets: Sequence[Fleet], question: str, *, yes: str, no: str, always: str = ""
    ) -> Confirm | None:
        """Return the question before polling stops; None if nothing needs to be reported."""
        from .dialogs.confirm import Confirm
        from .dialogs.now import MotorStates

        reported = self._leaving_report(fleets)
        if always:
            reported.insert(0, always)
        if not reported:
            return None
        drives = [session for fleet in fleets for session in _concerned(fleet)]
        now = MotorStates(self, drives) if drives else None
        return Confirm(question, "\n".join(reported), yes=yes, no=no, loses=True, now=now)

    def _unfinished(self, fleet: Fleet) -> list[str]:
        """Return the unfinished work on parameters that would be lost."""
        reported = []
        for console in fleet.consoles:
            device, editor = console.device, console.begun_editor
            if editor is not None and len(editor.staging.edits):
                count = len(editor.staging.edits)
                edits = "edit is" if count == 1 else "edits are"
                reported.append(f"Device {device}: {count} staged {edits} not written.")
            if count := len(console.session.unsaved):
                are, they = ("setting is", "it is") if count == 1 else ("settings are", "they are")
                reported.append(
                    f"Device {device}: {count} written {are} not saved to EEPROM; {they} lost at"
                    " power-off."
                )
        return reported


def _concerned(fleet: Fleet) -> list[DriveSession]:
    """Drives of a line that run by a command from here, or act once they are left alone."""
    turning = {session.device for session in fleet.line_watch.under_command()}
    turning |= fleet.line_watch.pending_timeouts().keys()
    turning |= {console.device for console in fleet.consoles if fleet.left_behind(console)}
    return [session for session in fleet.sessions if session.device in turning]
