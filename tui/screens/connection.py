"""Connection: choose a line, find the drives on it."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, ClassVar

from rich.text import Text
from textual import work
from textual.app import ComposeResult
from textual.containers import Horizontal, Vertical
from textual.screen import Screen
from textual.timer import Timer
from textual.widgets import Input, Label, OptionList
from textual.widgets.option_list import Option
from textual.worker import Worker, WorkerState

from tui.bus.errors import LineError
from tui.drive.errors import DriveError
from tui.session.addresses import parse_addresses
from tui.session.state import recent_lines
from tui.widgets.drawing import cut, key_line, rule, wrapped
from tui.widgets.lines import Lines
from tui.widgets.palette import ALARM, FAINT, FAULT, PLAIN, STRONG

from .actions import CONNECTION, bindings, keys_of
from .choices import LINE_FORMS, Group, LineChoice, choice_line, fault_of_line, groups
from .found import FoundDrive, about_drive, drive_line, next_step
from .hints import hint_for
from .panel import Panel

if TYPE_CHECKING:
    from tui.session.identify import ScanResult
    from tui.session.keeper import Look

log = logging.getLogger("drivepanel")

ERROR_KIND, ALARM_KIND = "error", "alarm"
CLOSE_KEYS = "y or Enter closes it   Esc keeps it"

LOOK = 0.5
"""Seconds between two looks at the states that the keeper has seen."""


class ConnectionScreen(Screen[None]):
    """Lines on the left, the chosen line and its drives on the right, what to do next below."""

    CSS_PATH = "connection.tcss"
    BINDINGS: ClassVar = bindings(CONNECTION)
    TITLE = "Connection"
    AUTO_FOCUS = "#lines"

    app: Panel

    def __init__(self) -> None:
        super().__init__()
        self.found: dict[int, FoundDrive] = {}
        self._choices: dict[str, LineChoice] = {}
        self._groups: list[Group] = []
        self._listed: tuple[int, list[Group]] | None = None
        self._happened: tuple[str, str, str] = ("", "", "")
        self._warned: set[int] = set()
        self._looking: list[Timer] = []
        self._away = False

    def compose(self) -> ComposeResult:
        """Two columns and the lines below."""
        yield Lines(id="header")
        with Horizontal(id="body"):
            with Vertical(id="left"):
                yield Lines(id="lines-title")
                yield OptionList(id="lines", compact=True)
            with Vertical(id="right"):
                yield Lines(id="line-title")
                with Horizontal(classes="settings"):
                    yield Label("Baud")
                    yield Input("19200", id="baud", type="integer", max_length=6, compact=True)
                    yield Label("Format")
                    yield Input("8E1", id="format", max_length=3, compact=True)
                with Horizontal(classes="settings"):
                    yield Label("Ask")
                    yield Input("1-10", id="addresses", compact=True)
                    yield Label("Profile")
                    yield Input("", id="profile", placeholder="identify", compact=True)
                yield Lines(id="drives-title")
                yield OptionList(id="drives", compact=True)
        yield Lines(id="message")
        yield Lines(id="keys")

    def on_mount(self) -> None:
        """Show what there is."""
        self.query_one("#keys", Lines).show([key_line(keys_of(CONNECTION))])
        self.say("", "Choose a line and press Enter, or n to type one.")
        self._groups = _lines_found()
        self._looking = [
            self.set_interval(1.0, self.show_heads),
            self.set_interval(LOOK, self.look),
        ]

    def on_resize(self) -> None:
        """Titles have the width of their columns, which is known before they are drawn."""
        self._redraw()
        self.call_after_refresh(self._redraw)  # with a scroll bar where one came

    def on_screen_suspend(self) -> None:
        """Stand still while another screen is on top.

        What stirs below a screen makes Textual draw the whole terminal again.
        """
        self._away = True
        for timer in self._looking:
            timer.pause()

    def on_screen_resume(self) -> None:
        """States may have changed meanwhile."""
        if self._away:
            self._away = False
            self._groups = _lines_found()
        for timer in self._looking:
            timer.resume()
        self.call_after_refresh(self._redraw)

    def _redraw(self) -> None:
        self.show_heads()
        self._show_lines()
        self.show_drives()
        self._show_message()

    # what is shown

    def show_heads(self) -> None:
        """The titles, with the state of the line."""
        if not self.is_current:
            return
        width = self.size.width
        right = f"{self.app.clock.time_of_day()} "
        head = Text(no_wrap=True)
        head.append(cut(" Drive Panel · Connection", width - len(right)), STRONG)
        head.append(right, FAINT)
        self.query_one("#header", Lines).show([head])
        self._title("#lines-title", "Lines")
        opened = self.app.opened
        state = opened.line.state if opened else None
        words = state.status.value if state else "not open"
        self._title("#line-title", self.app.line_label or "No line", words)
        count = f"{len(self.found)} found" if self.found else ""
        self._title("#drives-title", "Drives", count)
        if state is not None:
            from tui.bus.line import LineStatus

            if state.status is LineStatus.LOST:
                reason = f"LINE LOST: {state.reason}"
                self.say(reason, "It is tried again by itself.", ALARM_KIND)

    def _title(self, where: str, title: str, right: str = "") -> None:
        lines = self.query_one(where, Lines)
        width = lines.size.width
        lines.show([rule(cut(title, min(len(title), max(4, width - 14))), width, right)])

    def say(self, happened: str, next_step: str, kind: str = "") -> None:
        """What happened last, and what to try next."""
        self._happened = (happened, next_step, kind)
        self._show_message()

    def _show_message(self) -> None:
        happened, next_step, kind = self._happened
        width = max(10, self.size.width - 2)
        style = {ERROR_KIND: FAULT, ALARM_KIND: ALARM}.get(kind, PLAIN)
        parts = wrapped(happened, width, 2)
        lines = [Text(f" {part}", style) for part in parts]
        lines += [Text(f" {part}", FAINT) for part in wrapped(next_step, width, 3 - len(lines))]
        lines += [Text("")] * (3 - len(lines))
        self.query_one("#message", Lines).show(lines)

    def show_drives(self) -> None:
        """The drives that answered, one a line."""
        drives = self.query_one("#drives", OptionList)
        width = max(20, drives.size.width - 1)
        chosen = drives.highlighted
        drives.clear_options()
        drives.add_options(
            Option(drive_line(drive, width), id=str(device))
            for device, drive in sorted(self.found.items())
        )
        if self.found:
            drives.highlighted = min(chosen or 0, len(self.found) - 1)

    # lines

    def action_refresh_lines(self) -> None:
        """Look for serial ports and recent lines."""
        self._groups = _lines_found()
        self._show_lines()

    def _show_lines(self) -> None:
        options = self._lines()
        width = max(20, options.size.width - 1)
        if self._listed == (width, self._groups):
            return
        self._listed = (width, self._groups)
        chosen = options.highlighted
        self._choices.clear()
        shown: list[Option] = []
        for group in self._groups:
            shown.append(Option(Text(group.title, FAINT), disabled=True))
            for choice in group.choices:
                key = f"{group.title} {choice.text}"
                self._choices[key] = choice
                shown.append(Option(choice_line(choice, width), id=key))
            if not group.choices:
                shown.append(Option(Text(f"  {group.empty}", FAINT), disabled=True))
        options.clear_options()
        options.add_options(shown)
        first = next((i for i, o in enumerate(shown) if not o.disabled), None)
        options.highlighted = chosen if chosen is not None else first

    def on_option_list_option_selected(self, event: OptionList.OptionSelected) -> None:
        """Enter on a line opens it, Enter on a drive watches it."""
        if event.option_list.id == "lines":
            choice = self._choices[event.option.id or ""]
            self.open_line(self._line_text(choice))
        else:
            self.open_drive(int(event.option.id or 0))

    def _line_text(self, choice: LineChoice) -> str:
        """The LINE of a choice; a serial port with the settings typed beside it."""
        if not choice.path:
            return choice.text
        baud = self.query_one("#baud", Input).value.strip() or "19200"
        form = self.query_one("#format", Input).value.strip().upper() or "8E1"
        return f"serial:{choice.path},{baud},{form}"

    def action_type_line(self) -> None:
        """Type a line."""
        from .ask import Ask

        def typed(text: str | None) -> None:
            if text:
                self.open_line(text)

        about = "\n".join(LINE_FORMS)
        dialog = Ask("Line to open", fault_of_line, text=self.app.line_text, about=about)
        self.app.push_screen(dialog, typed)

    @work(exclusive=True, group="line", exit_on_error=False)
    async def open_line(self, text: str) -> None:
        """Open a line and ask for its drives."""
        if not await self.app.may_let_go("Close the line for another?", CLOSE_KEYS):
            return
        self._forget_drives()
        self.say(f"Opening {text}", "")
        if await self._opens(text):
            self.action_scan()

    @work(exclusive=True, group="line", exit_on_error=False)
    async def start(self, text: str, device: int | None) -> None:
        """Open a line; with a device, watch that drive as soon as it is known."""
        if not await self._opens(text):
            return
        if device is None:
            self.action_scan()
            return
        await self.scan([device]).wait()
        if device in self.found:
            self.open_drive(device)

    async def _opens(self, text: str) -> bool:
        """Whether the line could be opened; if not, why is shown."""
        try:
            await self.app.connect(text)
        except (LineError, DriveError) as error:
            self.fail(error)
            return False
        self.action_refresh_lines()
        self.show_heads()
        return True

    def _forget_drives(self) -> None:
        self.workers.cancel_group(self, "scan")
        self.workers.cancel_group(self, "open")
        self.found.clear()
        self._warned.clear()
        self.show_drives()

    def on_worker_state_changed(self, event: Worker.StateChanged) -> None:
        """An error that nobody foresaw: all of it to the log, one line to the person."""
        if event.state is WorkerState.ERROR:
            log.error("%s failed", event.worker.name, exc_info=event.worker.error)
            self.say(
                f"The panel failed at this: {event.worker.error}",
                "Try again; drivepanel.log in the state folder has more.",
                ERROR_KIND,
            )

    def fail(self, error: Exception) -> None:
        """Show an error with what to try next."""
        self.say(str(error), hint_for(error), ERROR_KIND)

    # drives

    def action_scan(self) -> None:
        """Look for drives at the addresses given."""
        opened = self.app.opened
        if opened is None:
            self.say("No line is open.", "Choose one and press Enter.", ALARM_KIND)
            return
        try:
            wanted = list(opened.devices) or parse_addresses(
                self.query_one("#addresses", Input).value
            )
        except LineError as error:
            self.fail(error)
            return
        self.scan(wanted)

    @work(exclusive=True, group="scan", exit_on_error=False)
    async def scan(self, devices: Sequence[int]) -> None:
        """Ask each address; drives appear as they answer."""
        from tui.session.identify import scan

        opened = self.app.opened
        if opened is None:
            return
        results: list[ScanResult] = []
        for number, device in enumerate(devices, start=1):
            self.say(f"Asking address {device}, {number} of {len(devices)}", "Esc stops.")
            try:
                await scan(opened.line, [device], results.append)
            except LineError as error:
                self.fail(error)
                return
            while results:
                await self._take(results.pop())
        self._sum_up(devices)

    def _sum_up(self, devices: Sequence[int]) -> None:
        if not self.found:
            span = f"{devices[0]} to {devices[-1]}" if len(devices) > 1 else f"{devices[0]}"
            self.say(
                f"No drive answered at address {span}.",
                "Check baud, format and wiring; try other addresses (Ask), then s.",
                ALARM_KIND,
            )
            return
        self.say(
            f"{len(self.found)} of {len(devices)} addresses answered.",
            "Choose a drive and press Enter to watch it.",
        )
        self.query_one("#drives", OptionList).focus()

    async def _take(self, result: ScanResult) -> None:
        """Keep a drive that answered, with its profile and state."""
        if result.identity is None:
            self.say(result.error, "The address is taken; scan again with s.", ALARM_KIND)
            return
        drive = FoundDrive(result.identity)
        self.found[result.device] = drive
        await self._equip(drive)
        self.show_drives()
        self.show_heads()

    async def _equip(self, drive: FoundDrive) -> None:
        """Give a drive its profile: the typed one, else the one that fits."""
        from tui.drive import library
        from tui.session.drive_session import DriveSession

        typed = self.query_one("#profile", Input).value.strip().lower()
        identity = drive.identity
        wanted = typed or identity.profile or next(iter(identity.candidates), None)
        opened = self.app.opened
        if wanted is None or opened is None:
            return
        try:
            profile = await asyncio.to_thread(library.load, wanted)
        except DriveError as error:
            self.fail(error)
            return
        drive.session = DriveSession(opened.line, identity.device, profile, identity)
        drive.guessed = not typed and identity.profile is None
        drive.state = "asking"
        if self.app.keeper is not None:
            self.app.keeper.keep(drive.session)

    def look(self) -> None:
        """Show the states that the keeper of the line has seen."""
        keeper = self.app.keeper
        if not self.is_current or keeper is None:
            return
        looks = keeper.looks
        before = {device: drive.state for device, drive in self.found.items()}
        connected = self._connected()
        for device, drive in self.found.items():
            if not connected:
                drive.state, drive.kind = "not known", "unknown"
            elif look := looks.get(device):
                drive.state = look.state.headline if look.state else "no answer"
                drive.kind = look.state.kind if look.state else "unknown"
        if before != {device: drive.state for device, drive in self.found.items()}:
            self.show_drives()
        self._warn(looks)

    def _connected(self) -> bool:
        from tui.bus.line import LineStatus

        opened = self.app.opened
        return opened is not None and opened.line.state.status is LineStatus.CONNECTED

    def _warn(self, looks: Mapping[int, Look]) -> None:
        """Say once of a drive that it trips when it is left alone."""
        watching = {d: look.timeout for d, look in looks.items() if look.timeout is not None}
        if not watching or watching.keys() <= self._warned:
            return
        self._warned |= watching.keys()
        which = ", ".join(f"{device} ({timeout:g} s)" for device, timeout in watching.items())
        self.say(
            f"Left alone so long, these drives act on their communication time-out: {which}.",
            "The panel asks them on while the line is open. Enter on a drive watches it.",
            ALARM_KIND,
        )

    @work(exclusive=True, group="open", exit_on_error=False)
    async def open_drive(self, device: int) -> None:
        """Open Monitor on a drive."""
        drive = self.found.get(device)
        if drive is None:
            return
        if drive.session is None:
            await self._equip(drive)
        if drive.session is None:
            from tui.drive import library

            known = ", ".join(listing.id for listing in library.listings())
            self.say(
                f"Device {device} does not say which drive it is.",
                f"Type its profile beside Profile: {known}.",
                ALARM_KIND,
            )
            self.query_one("#profile", Input).focus()
            return
        self.action_stop_scan()
        self.app.show_monitor(drive.session)

    def action_stop_scan(self) -> None:
        """Stop looking for drives."""
        stopped = [w for w in self.workers if w.group == "scan" and w.is_running]
        self.workers.cancel_group(self, "scan")
        if stopped:
            self.say("Stopped looking for drives.", "s looks again.")

    @work(exclusive=True, group="line", exit_on_error=False)
    async def action_disconnect(self) -> None:
        """Close the line; where that trips a running drive, only after saying so."""
        if not await self.app.may_let_go("Close the line?", CLOSE_KEYS):
            return
        self._forget_drives()
        await self.app.disconnect()
        self.say("The line is closed.", "Choose a line and press Enter.")
        self.show_heads()
        self.query_one("#lines", OptionList).focus()

    def on_option_list_option_highlighted(self, event: OptionList.OptionHighlighted) -> None:
        """Say all that the chosen drive says of itself; a line that is no port has no settings."""
        drives = event.option_list
        if drives.id == "lines":
            choice = self._choices.get(event.option.id or "")
            for setting in ("#baud", "#format"):
                self.query_one(setting, Input).disabled = not (choice and choice.path)
        if drives.id != "drives" or not drives.has_focus or not event.option.id:
            return
        if drive := self.found.get(int(event.option.id)):
            self.say(about_drive(drive), next_step(drive))

    def action_open_chosen(self) -> None:
        """What Enter does in the lists; a field hands Enter over to the list of lines."""
        focused = self.focused
        (focused if isinstance(focused, OptionList) else self._lines()).action_select()

    def action_watch_chosen(self) -> None:
        """Watch the drive that is chosen in the list of drives."""
        drives = self.query_one("#drives", OptionList)
        if drives.highlighted is None:
            self.say("No drive is found yet.", "Enter on a line opens it and looks.", ALARM_KIND)
        else:
            drives.action_select()

    def _lines(self) -> OptionList:
        return self.query_one("#lines", OptionList)


def _lines_found() -> list[Group]:
    """The serial ports there are now, and the lines used lately."""
    from tui.session.lines import serial_ports

    return groups(serial_ports(), recent_lines())
