"""Leaving a line or the panel: nothing is left to itself unasked, motors least of all."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from contextlib import suppress
from typing import TYPE_CHECKING

from tui.terminal.loop import soon_in_loop

from .app_port import Panel
from .dialogs.confirm import Confirm
from .dialogs.leave import Leave, LeaveChoice
from .dialogs.now import MotorsNow

if TYPE_CHECKING:
    from tui.session.drive import DriveSession
    from tui.session.timeout_told import TimeoutWatch

STOPPED_WITHIN = 60.0
"""Seconds that a motor may take to its standstill before the panel gives up waiting."""


class Leaving(Panel):
    """What the app does before it lets drives go."""

    settled: bool
    """Whether it was decided what becomes of motors that run by an order from here."""
    _asked: Confirm | None = None
    """The question before leaving, while nothing runs by a command from here."""

    async def action_quit(self) -> None:
        """Leave; where a motor runs by a command from here, or a drive trips, not unasked."""
        if any(isinstance(screen, Leave) for screen in self.screen_stack):
            return
        if running := self._motors():
            follows = [self._left_running(running), *self._tripping(running), *self._unfinished()]
            asked = Leave("\n".join(follows), MotorsNow(self, running))
            self.push_screen(asked, self._leave_motors)
            return
        if self._asked in self.screen_stack:
            return
        self._asked = self._question("Leave the panel?", yes="leaves", no="stays")
        if self._asked is None:
            self.exit()
        else:
            self.push_screen(self._asked, self._leave)

    def _motors(self) -> list[DriveSession]:
        """Drives commanded from here whose motors do not surely stand."""
        return self.fleet.line_watch.under_command() if self.fleet else []

    def _left_running(self, sessions: list[DriveSession]) -> str:
        """Which motors run, and what each drive does when nobody asks it any more."""
        from tui.session.monitor.timeout import left_alone_text

        assert self.fleet is not None
        line_watch = self.fleet.line_watch
        return "\n".join(
            left_alone_text(one, watch=line_watch.watch(one.device)) for one in sessions
        )

    def _tripping(self, but: Sequence[DriveSession] = ()) -> list[str]:
        """Which drives act on their communication time-out once they are left, and when."""
        if self.fleet is None:
            return []
        from tui.session.monitor.timeout import left_alone_text, names_of

        told = {session.device for session in but}
        line_watch = self.fleet.line_watch
        alike: dict[tuple[str, TimeoutWatch], list[DriveSession]] = {}
        for console in self.fleet.consoles:
            watch = line_watch.left_alone().get(console.device)
            if watch is not None and console.device not in told:
                alike.setdefault((console.session.profile.id, watch), []).append(console.session)
        found = [left_alone_text(*same, watch=watch) for (_, watch), same in alike.items()]
        found += [
            f"{names_of([one])}: what it does on loss of communication was not read yet."
            for one in line_watch.unread()
            if one.device not in told
        ]
        head = "Once nobody asks them any more, drives act on their time-out, at rest too:"
        return [head, *found] if found else []

    def _leave_motors(self, choice: LeaveChoice | None) -> None:
        if choice == "leave":
            self.run_worker(self._leave_running(), exclusive=True, group="leave")
        elif choice == "stop":
            self.run_worker(self._stop_and_leave(), exclusive=True, group="leave")

    async def _leave_running(self) -> None:
        """Leave motors running, on record for whoever comes next."""
        from tui.session.starts.starts import StartNotRecorded

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
        fleet, running = self.fleet, self._motors()
        if not running or fleet is None:
            return True
        from tui.bus.errors import LineClosed

        try:
            fleet.stop(running, by="leaving the panel")
        except LineClosed:
            return False
        return not fleet.stopper.wait(running, STOPPED_WITHIN).failed

    def _leave(self, sure: bool | None) -> None:
        if sure:
            self.exit()

    async def may_let_go(self, question: str, *, yes: str, no: str, always: str = "") -> bool:
        """Whether the drives of the line may be left alone; asks where that trips one that runs.

        With `always` it asks in any case, and says that. Belongs into a worker: it waits for
        the answer.
        """
        asked = self._question(question, yes=yes, no=no, always=always)
        if asked is None:
            return True
        answer: asyncio.Future[bool | None] = asyncio.get_running_loop().create_future()

        def told(sure: bool | None) -> None:
            if not answer.done():  # who asked may have given up meanwhile
                answer.set_result(sure)

        self.push_screen(asked, told)
        return bool(await answer)

    def _question(self, question: str, *, yes: str, no: str, always: str = "") -> Confirm | None:
        """What to ask before the drives are left alone; None where nothing is to be said."""
        running = self._motors()
        told = [*self._tripping(running), *self._unfinished()]
        if running:
            told.insert(0, self._left_running(running))
        if always:
            told.insert(0, always)
        if not told:
            return None
        alone = self.fleet.line_watch.left_alone() if self.fleet else {}
        turning = {session.device for session in running} | alone.keys()
        sessions = self.fleet.sessions if self.fleet else []
        drives = [session for session in sessions if session.device in turning]
        now = MotorsNow(self, drives) if drives else None
        return Confirm(question, "\n".join(told), yes=yes, no=no, loses=True, now=now)

    def _unfinished(self) -> list[str]:
        """What would be lost of the work on parameters."""
        told = []
        for console in self.fleet.consoles if self.fleet else ():
            device, editor = console.device, console.begun_editor
            if editor is None:
                continue
            if len(editor.staging.edits):
                count = len(editor.staging.edits)
                edits = "edit is" if count == 1 else "edits are"
                told.append(f"Device {device}: {count} staged {edits} not written.")
            if editor.unsaved:
                count = len(editor.unsaved)
                are, they = ("setting is", "it is") if count == 1 else ("settings are", "they are")
                told.append(
                    f"Device {device}: {count} written {are} not saved to EEPROM; {they} lost at"
                    " power-off."
                )
        return told
