"""Keys of a replay: hold it, go to another time, change its speed. Nothing here reaches a drive."""

from __future__ import annotations

import asyncio
from datetime import datetime
from typing import TYPE_CHECKING, Protocol, runtime_checkable

from tui.bus.errors import LineError

from .keys.action import CONNECTION, MONITOR
from .line_owner import LineOwner
from .open_lines import PanelLine
from .places import Places
from .status_refresher import StatusRefresher

if TYPE_CHECKING:
    from tui.session.record.replay_line import ReplayLine

NO_REPLAY = "This key is for a replay. To open one, end the panel and run: drivepanel replay FILE"
EVENT_LEAD = 2.0
"""Seconds before an event at which a jump to it ends."""


@runtime_checkable
class Resumable(Protocol):
    """A screen that keeps what a person has set on it when a replay goes to another time."""

    def resume(self, before: object) -> None:
        """Continue the screen that was shown before."""


class ReplayKeys(StatusRefresher, LineOwner, Places):
    """Plays, holds and moves the replay that is shown."""

    _wanted: float | None = None
    """Time to which it is to go; None if it is there."""
    _is_moving = False

    def _replay_or_tell(self) -> ReplayLine | None:
        if self.replay is None:
            self.tell(NO_REPLAY)
        return self.replay

    def action_replay_hold(self) -> None:
        """Hold the replay, or let it go on."""
        if (replay := self._replay_or_tell()) is None:
            return
        clock = replay.clock
        if clock.playing:
            clock.hold()
        elif clock.monotonic() >= clock.end:
            self.tell("This is the end of the record.")
        else:
            clock.play()
        self._show_moved()

    def action_replay_speed(self, step: int) -> None:
        """Play faster or slower."""
        from tui.session.record.replay_clock import SPEEDS

        if (replay := self._replay_or_tell()) is None:
            return
        place = min(range(len(SPEEDS)), key=lambda i: abs(SPEEDS[i] - replay.clock.speed))
        replay.clock.set_speed(SPEEDS[max(0, min(len(SPEEDS) - 1, place + step))])
        self._show_moved()

    def action_replay_step(self, seconds: int) -> None:
        """Go forward or back by seconds."""
        if (replay := self._replay_or_tell()) is not None:
            now = replay.clock.monotonic() if self._wanted is None else self._wanted
            self._go_to(now + seconds)

    def action_replay_event(self, step: int) -> None:
        """Go to the next recorded event, or to the one before."""
        if (replay := self._replay_or_tell()) is None:
            return
        now = replay.clock.monotonic()
        times = [event.utc / 1e6 for event in replay.events]
        later = [at for at in times if at - EVENT_LEAD > now + 0.5]
        earlier = [at for at in times if at - EVENT_LEAD < now - 0.5]
        found = (later[0] if later else None) if step > 0 else (earlier[-1] if earlier else None)
        if found is None:
            self.tell("No event follows." if step > 0 else "No event comes before this time.")
        else:
            self._go_to(found - EVENT_LEAD)

    def action_replay_time(self) -> None:
        """Ask for a time of the record, and go there."""
        from tui.session.record.replay_text import time_in

        from .dialogs.ask import Ask

        if (replay := self._replay_or_tell()) is None:
            return
        clock = replay.clock

        def fault(text: str) -> str:
            try:
                time_in(text, clock.begin, clock.end)
            except LineError as error:
                return str(error)
            return ""

        def typed(text: str | None) -> None:
            if text and self.replay is replay:
                self._go_to(time_in(text, clock.begin, clock.end))

        first, last = (datetime.fromtimestamp(at) for at in (clock.begin, clock.end))
        about = f"The record has {first:%H:%M:%S} to {last:%H:%M:%S} of {first:%d %b %Y}."
        self.push_screen(Ask("Time to go to", fault, about=about, takes="Go there"), typed)

    def _go_to(self, at: float) -> None:
        """Go to a time of the record; keys that come in the meantime change it."""
        if (replay := self.replay) is None:
            return
        self._wanted = min(max(at, replay.clock.begin), replay.clock.end)
        if not self._is_moving:
            self.run_worker(self._move(), group="replay", exit_on_error=False)

    async def _move(self) -> None:
        self._is_moving = True
        try:
            while (at := self._wanted) is not None and (replay := self.replay) is not None:
                await self._begin_again(replay, at)
                self._wanted = self._wanted if self._wanted != at else None
                self._show_moved()
        except LineError as error:
            self.notify(str(error), severity="error")
        finally:
            self._is_moving, self._wanted = False, None

    async def _begin_again(self, replay: ReplayLine, at: float) -> None:
        """Open the record again at another time, and show the same screen on it."""
        before = next((item for item in self.panel_lines if item.opened.replay is replay), None)
        if before is None:
            return
        chosen, place, shown = self.chosen, self.place, self.screen
        device = chosen.device if chosen in before.fleet.consoles and chosen is not None else None
        when = datetime.fromtimestamp(at).astimezone().isoformat()
        text = f"{before.opened.text.partition(',at=')[0]},at={when}"
        opened = await asyncio.to_thread(self._open_here, text, remember=False)
        opened.text = before.opened.text
        assert opened.replay is not None
        opened.replay.clock.set_speed(replay.clock.speed)
        playing = replay.clock.playing
        try:
            opened.replay.events = replay.events  # with the trips that were sought
            line = await self._with_replayed(opened, device, goes_on=place != CONNECTION)
        except BaseException:
            opened.close()
            raise
        self._replace(before, line)
        if playing:
            opened.replay.clock.play()
        console = line.fleet.console(device) if device is not None else None
        if console is not None and place == CONNECTION:
            self._choose(console)
        elif console is not None:
            self.show_monitor(console)
            if place != MONITOR:
                self.show_place(place, console)
                if isinstance(self.screen, Resumable):
                    self.screen.resume(shown)
        before.fleet.forget()
        await asyncio.to_thread(before.opened.close)

    def _replace(self, before: PanelLine, line: PanelLine) -> None:
        shown = self.opened is before.opened
        self.panel_lines = tuple(line if item is before else item for item in self.panel_lines)
        if shown:
            self.show_line(line)

    def _show_moved(self) -> None:
        """Show the new time at once."""
        self.draw_frame()
