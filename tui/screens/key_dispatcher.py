"""Keys before they reach a screen: stop keys first, and each other key in its turn."""

from __future__ import annotations

import logging
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from functools import partial
from typing import TYPE_CHECKING

from textual.events import Event, InputEvent, Key, Paste

from tui.bus.errors import LineClosed
from tui.session.carry_on import carried_on
from tui.terminal.fields import takes_space, takes_text
from tui.terminal.loop import soon_in_loop
from tui.terminal.names import STOP_KEYS
from tui.terminal.stroke import Stroke, stroke_of
from tui.widgets.replay_bar import NO_MOTOR
from tui.widgets.small import is_too_small

from .app_port import Panel, tell_not_stopped, tell_unreached
from .harmless_keys import HarmlessKeys
from .keys.action import CONNECTION, LINE_ONLY_IN_REPLAY, NOT_IN_REPLAY
from .keys.table import STOPS_ALL, STOPS_LIVE, STOPS_NONE

if TYPE_CHECKING:
    from textual.actions import ActionParseResult
    from textual.dom import DOMNode

    from tui.drive.profile.schema import OrderId
    from tui.session.console import DriveConsole
    from tui.session.drive import DriveSession
    from tui.session.fleet import Fleet

log = logging.getLogger(__name__)

NO_STOP_HERE = (
    "No stop is sent on a monitored line. Stop the motor at its master, or press Esc to end"
    " listening."
)
NOBODY_TO_STOP = "Nothing was stopped: no drive is known."
NOBODY_IN_REPLAY = "Nothing was stopped: this is a replay, and no line is open."
LIVE_STOPPED = "Stopping all drives of the live lines. The drives on this screen are a replay."
NO_COMMAND_IN_REPLAY = "This is a replay: nothing is sent to a drive."
STILL_OPENS = (
    "{} is still being opened: no stop was sent there yet. Its scan stops each drive that it finds."
)
OTHERS_STOP = f"Stopping all drives of the open lines. {STILL_OPENS}"
READ_ONLY_STOPS_NONE = (
    "NOT STOPPED: the panel is read-only, so no stop is sent to any drive. Stop the motors at the"
    " machine."
)
SCAN_STOPS = "Stopping all drives. The scan goes on, and stops each drive that it finds."
STOP, STOP_ALL, STOP_OUTSIDE_TEXT = "f12", "f9", "space"
IGNORED = "Opening {}: keys are ignored until it is open. Press Esc to cancel."
TYPED_BEFORE = "Key ignored: it was typed while {} was being opened. Press it again."


class KeyDispatcher(HarmlessKeys):
    """Handles all keys of the panel; the first part runs in the thread that reads keys."""

    def __init__(self) -> None:
        super().__init__()
        self._stops = 0
        self._trying_f12 = False
        self.stops_of_all = 0
        self.unreached = ("", 0.0)

    def take_stop_key(self, key: str, left_at: float | None = None) -> bool:
        """Stop if the key is a stop key now; may be called in any thread.

        `left_at` is when a key was read that may leave a text field, such as Escape. A Space after
        it is not text, even if that key has not taken effect yet.
        """
        if key not in STOP_KEYS:
            return False
        if key == STOP_OUTSIDE_TEXT and self._is_text(left_at):
            return False
        carried_on(self.hurry)
        self._stop(everything=key == STOP_ALL)
        if key == STOP and self._trying_f12:
            carried_on(self._f12_arrived)
        return True

    def _is_text(self, left_at: float | None) -> bool:
        """True if a space is text now; after an internal error it is a stop."""
        try:
            left = left_at is not None and left_at > self._typed.done_to
            return self._space_is_text() and not left
        except Exception:
            log.exception("Space counts as a stop")
            return False

    def last_stop(self, error: Exception) -> None:
        """Stop every drive by its prepared frames, after an internal error in handling keys.

        Uses nothing that `take_stop_key` uses.
        """
        self._stops += 1
        for line in self.panel_lines:
            if line.opened.replay is None:
                line.fleet.last_stop(error)

    def sequence_swallowed(self, data: bytes) -> None:
        """Report an unknown key during the F12 test; in the thread that reads keys."""
        if self._trying_f12:
            from tui.screens.keys.first_keys import unknown_text

            self._from_keys(self.say_first, unknown_text(data), "", "alarm")

    def try_f12(self) -> None:
        """On the first start on a terminal, offer to test if F12 arrives."""
        from tui.screens.keys.first_keys import OFFER, was_tried

        self._trying_f12 = not self.is_headless and not was_tried()
        if self._trying_f12:
            self.say_first(OFFER, "Or choose a line and press Enter, or n to type one.")

    def _f12_arrived(self) -> None:
        """Report that F12 arrived in the test; in the thread that reads keys."""
        from tui.screens.keys.first_keys import ARRIVED, remember

        self._trying_f12 = False
        remember()
        self._from_keys(self.say_first, ARRIVED, "Choose a line and press Enter.")

    def _from_keys(self, tell: Callable[..., None], *words: str) -> None:
        """Show a message in the app's loop, from the thread that reads keys."""
        soon_in_loop(self, tell, *words)

    def stop_stamp(self) -> object:
        """Return a value that changes with every stop; may be called in any thread."""
        return self._stops

    @property
    def stroke(self) -> Stroke | None:
        """The stroke of the key that is taking effect now; None if there is none."""
        return self._typed.stroke

    async def run_action(
        self,
        action: str | ActionParseResult,
        default_namespace: DOMNode | None = None,
        namespaces: Mapping[str, DOMNode] | None = None,
    ) -> bool:
        """Carry out an action of a key or of the palette; refuse those that need a drive.

        The drives of a replay are not there.
        """
        name = action.partition("(")[0] if isinstance(action, str) else action[1]
        needs_line = name in LINE_ONLY_IN_REPLAY and self.place != CONNECTION
        if self.replay is not None and (needs_line or name in NOT_IN_REPLAY):
            self.notify(NO_COMMAND_IN_REPLAY, severity="warning")
            return True
        return await super().run_action(action, default_namespace, namespaces)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Disable the stop by Space while a text is being typed."""
        if action == "stop_by_space":
            return not self._space_is_text()
        return super().check_action(action, parameters)

    def _space_is_text(self) -> bool:
        """True if Space is text in the focused field. While a line opens, nothing is typed."""
        ignored = self.opening.goes_on and not self.screen.is_modal
        return takes_space(self.focused) and not ignored and not is_too_small(*self.size)

    def action_stop_by_space(self) -> None:
        """Stop the drive that is shown, while no text is being typed."""
        self._stop(everything=False)

    def action_stop(self) -> None:
        """Stop the drive that is shown."""
        self._stop(everything=False)

    def action_stop_all(self) -> None:
        """Stop every drive of the line."""
        self._stop(everything=True)

    def _stop(self, *, everything: bool) -> None:
        self._stops += 1
        try:
            chosen = None if everything else self._open_drive()
        except Exception:
            log.exception("which drive is open is not known: every drive is stopped")
            chosen = None
        if chosen is None:
            # first: a scan that begins later looks at the count, after it is in its fleet
            self.stops_of_all += 1
        for fleet in every_fleet(self):
            try:
                if chosen is None:
                    # first: a drive found from now on is stopped by the scan, others here
                    carried_on(partial(_stop_found, fleet))
                    self._stop_sessions(fleet, fleet.sessions)
                elif chosen in fleet.consoles:
                    self._stop_sessions(fleet, [chosen.session])
            except Exception as error:
                fleet.last_stop(error, chosen)
        others: dict[Fleet, Collection[int]] = {}
        if chosen is None:
            # after this program's own, which depend on no other process
            for fleet in every_fleet(self):
                carried_on(partial(_stop_others, fleet, others))
        if self.hearing:
            carried_on(lambda: soon_in_loop(self, self._warn, NO_STOP_HERE))
        elif chosen is None:
            tell = self._tell_stop_of_all
            carried_on(lambda: soon_in_loop(self, tell, others, self._unopened()))

    def _warn(self, text: str) -> None:
        """Report on every screen that a stop has stopped nothing."""
        self.notify(text, severity="warning")

    def _unopened(self) -> str:
        """Return the line that is being opened, which no stop reaches yet; empty for none."""
        scans = self.opening.connected and self.fleet is not None and self.fleet.search is not None
        return self.opening.text if self.opening.goes_on and not scans else ""

    def _tell_stop_of_all(
        self, others: Mapping[Fleet, Collection[int]], unopened: str = ""
    ) -> None:
        """Report what a stop of all does not reach, or not yet, or that there is no drive.

        `others` are drives of other programs, which the holder of the line stops. `unopened` is a
        line that was still being opened.
        """
        from tui.session.connect.line_key import is_replay

        unopened = "" if is_replay(unopened) else unopened
        if self.read_only and (self.live_fleets or unopened):
            tell_not_stopped(self, READ_ONLY_STOPS_NONE)
            return
        strangers = [
            device
            for fleet in self.live_fleets
            for device in fleet.strangers
            if device not in others.get(fleet, ())
        ]
        if strangers:
            tell_unreached(self, strangers)
        searches = [fleet.search for fleet in self.live_fleets if fleet.search is not None]
        has_drives = any(others.values()) or any(fleet.sessions for fleet in self.live_fleets)
        if unopened:
            self._warn((OTHERS_STOP if has_drives else STILL_OPENS).format(unopened))
        if any(search.is_stopping for search in searches):
            self._warn(SCAN_STOPS)
        elif strangers or unopened:
            return
        elif not has_drives:
            self._warn(NOBODY_IN_REPLAY if self.replay is not None else NOBODY_TO_STOP)
        elif self.replay is not None:
            self._warn(LIVE_STOPPED)

    def _stop_sessions(
        self, fleet: Fleet, sessions: list[DriveSession], order: OrderId = "stop"
    ) -> None:
        """Stop drives, and end the questions about them; may be called in any thread."""
        if not sessions:
            return
        with suppress(LineClosed):
            fleet.stop(sessions, order)
        devices = [session.device for session in sessions]
        carried_on(lambda: soon_in_loop(self, self._void_questions, devices))

    def _void_questions(self, devices: list[int]) -> None:
        from .dialogs.question import void_questions

        for device in devices:
            void_questions(self, device)

    def stopped_elsewhere(self, devices: list[int]) -> None:
        """Discard keys and questions after another program stopped drives."""
        self._stops += 1
        self._void_questions(devices)

    def stop_drive(self, console: DriveConsole, order: OrderId) -> None:
        """Stop one drive by this kind of stop."""
        self._stops += 1
        for fleet in self.live_fleets:
            if console in fleet.consoles:
                self._stop_sessions(fleet, [console.session], order)
                return
        if self.replay is not None:
            self.notify(NO_COMMAND_IN_REPLAY, severity="warning")

    async def on_event(self, event: Event) -> None:
        """Handle a key in its turn; each key extends the arming of armed drives."""
        if isinstance(event, InputEvent | Paste) and not self.is_running:
            return  # the panel ends: no screen is left for it
        if isinstance(event, Key | Paste) and not event.is_forwarded:
            if not self._typed.admit(event) or is_too_small(*self.size):
                return  # keys do not act on a screen that cannot be seen
            if self._is_ignored(event):
                return
            self.hurry()
            if isinstance(event, Key):
                for fleet in self.live_fleets:
                    for session in fleet.sessions:
                        session.arming.touch()
        elif isinstance(event, Key) and self._is_void(event):
            return
        await super().on_event(event)

    def _is_ignored(self, typed: Key | Paste) -> bool:
        """Ignore a key typed while a line opens, and report it; Esc cancels the opening."""
        name = typed.key if isinstance(typed, Key) else ""
        if name in STOP_KEYS or self.screen.is_modal:
            return False
        if not self.opening.goes_on:
            stroke = stroke_of(typed)
            if stroke is None or stroke.read_at > self.opening.ended:
                return False
            self.tell(TYPED_BEFORE.format(self.opening.text))
        elif name == "f1" or (name == "question_mark" and not takes_text(self.focused)):
            return False  # help
        elif name == "escape" and self.opening.cancel():
            self._tell_canceled()
        else:
            self.tell(IGNORED.format(self.opening.text))
        return True

    def _tell_canceled(self) -> None:
        if self.opening.connected:
            self.say_first("The scan was canceled.", "The line stays open: press s to scan.")
        else:
            canceled = f"Opening {self.opening.text} was canceled."
            self.say_first(canceled, "Choose a line and press Enter.")

    def _is_void(self, key: Key) -> bool:
        """Return True if a stop came after a key was read, before the key took effect."""
        stroke = stroke_of(key)
        return stroke is not None and stroke.stamp != self.stop_stamp()

    def _open_drive(self) -> DriveConsole | None:
        """Return the target of the stop key: the open drive; None for every drive."""
        chosen = self.chosen
        known = chosen is not None and any(chosen in fleet.consoles for fleet in self.live_fleets)
        return chosen if known else None

    @property
    def stop_target_text(self) -> str:
        """The label of the stop key in the key bar."""
        chosen = self._open_drive()
        if self.hearing and not self.fleets:
            return STOPS_NONE
        if self.replay is not None:
            return STOPS_LIVE if self.live_fleets else NO_MOTOR
        return f"STOP {chosen.device}" if chosen is not None else STOPS_ALL


def _stop_found(fleet: Fleet) -> None:
    """Have a scan in progress stop each drive that it finds from now on, unless no stop is sent."""
    if fleet.search is not None and not fleet.line.read_only:
        fleet.search.stops_found = True


def _stop_others(fleet: Fleet, stopped: dict[Fleet, Collection[int]]) -> None:
    stopped[fleet] = fleet.stop_others()


def every_fleet(panel: Panel) -> list[Fleet]:
    """The drives of every live line, even after an internal error in finding the shown one."""
    try:
        return panel.live_fleets
    except Exception:
        log.exception("which line is shown is not known")
        return [line.fleet for line in panel.panel_lines if line.opened.replay is None]
