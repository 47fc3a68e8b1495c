"""Leaving a line or the panel: nothing is left to itself unasked, motors least of all."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from .confirm import Confirm
from .leave import Choice, Leave
from .panel import Panel

if TYPE_CHECKING:
    from tui.session.drive_session import DriveSession
    from tui.session.editor import Editor

STOPPED_WITHIN = 60.0
"""Seconds that a motor may take to its standstill before the panel gives up waiting."""


class Leaving(Panel):
    """What the app does before it lets drives go."""

    editors: dict[int, Editor]
    """By device, the work on parameters that has begun."""
    settled: bool
    """Whether it was decided what becomes of motors that run by an order from here."""

    async def action_quit(self) -> None:
        """Leave; where a motor runs by an order from here, or is tripped by that, not unasked."""
        if isinstance(self.screen, Leave):
            return
        if running := self.keeper.under_command() if self.keeper else []:
            follows = [self._left_running(running), *self._unfinished()]
            self.push_screen(Leave("\n".join(follows)), self._leave_motors)
            return
        asked = self._question("Leave the panel?", "q or Enter leaves   Esc stays")
        if asked is None or isinstance(self.screen, Confirm):
            self.exit()
        else:
            self.push_screen(asked, self._leave)

    def _left_running(self, sessions: list[DriveSession]) -> str:
        """Which motors run, and what each drive does when nobody asks it any more."""
        lines = []
        for session in sessions:
            watch = self.keeper.watch(session.device) if self.keeper else None
            does = "goes on running: it does not watch the line"
            if watch is not None:
                reaction = watch.reaction.does if watch.reaction else "its own reaction follows"
                does = f"acts {watch.timeout:g} s after the last request: {reaction}"
            who = f"Device {session.device}, {session.profile.name}"
            lines.append(f"{who}: left alone it {does.rstrip('.')}.")
        return "\n".join(lines)

    def _leave_motors(self, choice: Choice | None) -> None:
        if choice == "leave":
            self.settled = True
            self.exit()
        elif choice == "stop":
            self.run_worker(self._stop_and_leave(), exclusive=True, group="leave")

    async def _stop_and_leave(self) -> None:
        """Stop what runs by an order from here, then leave; stay where one does not stop."""
        if await asyncio.to_thread(self.stop_motors):
            self.settled = True
            self.exit()

    def leave_now(self) -> None:
        """End the screen; may be called in any thread."""
        self.settled = True
        loop = self._loop
        if loop is not None and loop.is_running():
            loop.call_soon_threadsafe(self.exit)

    def stop_motors(self) -> bool:
        """Stop every motor that runs by an order from here; True when none runs any more.

        Waits for it; may be called in any thread but the loop's.
        """
        keeper, stopper = self.keeper, self.stopper
        running = keeper.under_command() if keeper else []
        if not running or stopper is None:
            return True
        from tui.bus.errors import LineClosed

        try:
            stopper.stop(running)
        except LineClosed:
            return False
        return not stopper.wait(running, STOPPED_WITHIN).failed

    def _leave(self, sure: bool | None) -> None:
        if sure:
            self.exit()

    async def may_let_go(self, question: str, keys: str) -> bool:
        """Whether the drives of the line may be left alone; asks where that trips one that runs.

        Belongs into a worker: it waits for the answer.
        """
        asked = self._question(question, keys)
        if asked is None:
            return True
        answer: asyncio.Future[bool | None] = asyncio.get_running_loop().create_future()

        def told(sure: bool | None) -> None:
            if not answer.done():  # who asked may have given up meanwhile
                answer.set_result(sure)

        self.push_screen(asked, told)
        return bool(await answer)

    def _question(self, question: str, keys: str) -> Confirm | None:
        """What to ask before the drives are left alone; None where that trips none."""
        alone = self.keeper.left_alone() if self.keeper else {}
        told = self._unfinished()
        if running := self.keeper.under_command() if self.keeper else []:
            told.insert(0, self._left_running(running))
        if alone:
            which = ", ".join(f"device {device} after {time:g} s" for device, time in alone.items())
            told.append(
                "These motors run, and their drives watch the line. Once nobody asks them any"
                f" more, they act on their communication time-out: {which}."
            )
        return Confirm(question, "\n".join(told), keys) if told else None

    def _unfinished(self) -> list[str]:
        """What would be lost of the work on parameters."""
        told = []
        for device, editor in sorted(self.editors.items()):
            if len(editor.edits):
                told.append(f"Device {device}: {len(editor.edits)} staged edits are not written.")
            if editor.unsaved:
                count = len(editor.unsaved)
                told.append(
                    f"Device {device}: {count} written settings are not saved to EEPROM; they are"
                    " lost at power-off."
                )
        return told
