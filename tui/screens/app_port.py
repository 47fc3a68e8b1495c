"""Interface of the app for its screens."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from tui.terminal.lean_app import LeanApp

if TYPE_CHECKING:
    from textual.notifications import SeverityLevel
    from textual.widget import AwaitMount

    from tui.drive.profile.schema import OrderId
    from tui.session.bundle.subject import DriveDocuments
    from tui.session.clock import Clock
    from tui.session.connect.open_line import OpenLine
    from tui.session.console import DriveConsole
    from tui.session.events import Event, EventLog
    from tui.session.fleet import Fleet
    from tui.session.record.replay_line import ReplayLine
    from tui.terminal.stroke import Stroke
    from tui.widgets.strip import FrameView

    from .open_lines import LineOpening, PanelLine


class Panel(LeanApp):
    """The app as its screens see it: open lines, the line that is shown, their drives."""

    panel_clock: Clock
    """The real clock, for keys, questions and drives; a test may replace it."""
    read_only: bool
    low_bandwidth: bool
    """True if as little as possible is to be sent to the terminal."""
    leave_running: bool
    """True if motors started by this panel keep running when its terminal is lost."""
    period: float
    """Intended time of a monitoring cycle in seconds, the same for every drive."""
    opened: OpenLine | None
    """The line that is shown."""
    fleet: Fleet | None
    """The drives of the line that is shown."""
    panel_lines: tuple[PanelLine, ...]
    """All lines that are open."""
    events: EventLog
    """All messages."""
    opening: LineOpening
    """The line that is being opened, if any; until it is open only stops, Esc and help work."""
    key_hint: tuple[Event | None, str, str] = (None, "", "")
    """Keys shown after a message: the message, the screen on which they work, the sentence."""
    hearing: str = ""
    """The monitored line as it was typed; nothing is sent on it, not even a stop."""
    drive_documents: Callable[[], DriveDocuments]
    """JSON documents of drives; imported when needed."""
    stops_of_all: int
    """Number of stops of all so far; counted before the drives are looked up."""
    unreached: tuple[str, float]
    """The last text about drives that a stop of all did not reach, and its monotonic time."""
    chosen: DriveConsole | None
    """The open drive: the one opened last on the line that is shown. The stop key stops it."""

    @property
    @abstractmethod
    def stroke(self) -> Stroke | None:
        """The stroke of the key that is taking effect now; None if there is none."""

    @abstractmethod
    def stop_stamp(self) -> object:
        """Return a value that changes with every stop."""

    @abstractmethod
    def follow(self, line: str, device: int) -> None:
        """Open the line again with a drive's new settings, and show that drive."""

    @abstractmethod
    def stop_drive(self, console: DriveConsole, order: OrderId) -> None:
        """Stop one drive by this kind of stop."""

    def notify(
        self,
        message: str,
        *,
        title: str = "",
        severity: SeverityLevel = "information",
        timeout: float | None = None,
        markup: bool = False,
    ) -> None:
        """Show a message in the message line, where the newest replaces the one before."""
        kinds = {"information": "told", "warning": "alarm", "error": "failed"}
        self.events.add(kinds[severity], f"{title} {message}".strip())

    def action_help_quit(self) -> None:
        """Report that Ctrl+C does not end the panel."""
        self.tell("Ctrl+C does not end the panel. Press q to quit.")

    @property
    def clock(self) -> Clock:
        """The clock of what is shown: in a replay, its own."""
        return self.panel_clock if self.replay is None else self.replay.clock

    @property
    def replay(self) -> ReplayLine | None:
        """The replay that is shown; None if a live line is, or none."""
        return self.opened.replay if self.opened is not None else None

    @property
    def line_text(self) -> str:
        """The open line as it was typed, or nothing."""
        return self.opened.text if self.opened else ""

    @property
    def line_label(self) -> str:
        """The open line as it is called on a screen, or nothing."""
        return self.opened.label if self.opened else ""

    @property
    def fleets(self) -> list[Fleet]:
        """The drives of every open line, of the one that is shown first."""
        shown = [self.fleet] if self.fleet is not None else []
        return [*shown, *(line.fleet for line in self.panel_lines if line.fleet is not self.fleet)]

    @property
    def live_fleets(self) -> list[Fleet]:
        """The drives of every open line that exists: those of a replay cannot be stopped."""
        replays = {id(line.fleet) for line in self.panel_lines if line.opened.replay is not None}
        return [fleet for fleet in self.fleets if id(fleet) not in replays]

    @property
    def open_texts(self) -> list[str]:
        """Every open line as it was typed."""
        return [self.line_text, *(line.opened.text for line in self.panel_lines)]

    @property
    def faulty_texts(self) -> list[str]:
        """The open lines with a drive in fault, as they were typed."""
        lines = self.panel_lines
        return [line.opened.text for line in lines if line.fleet.alarms.active]

    @abstractmethod
    def open_line_of(self, text: str) -> PanelLine | None:
        """The open line that a text means, whatever its settings; None where it is not open."""

    @abstractmethod
    def show_line(self, line: PanelLine | None) -> None:
        """Show another of the open lines; no drive is open then."""

    @abstractmethod
    async def connect(self, text: str, *, remember: bool = True) -> None:
        """Open a line and show it, beside those with drives; raises the line's errors."""

    @abstractmethod
    async def disconnect(self) -> None:
        """Close the line that is shown, if there is one."""

    @abstractmethod
    async def may_let_go(self, question: str, *, yes: str, no: str, always: str = "") -> bool:
        """Return True if the drives of the line may be left alone; asks where that trips one that
        runs.

        With `always` it asks in any case, and says that. Belongs into a worker: it waits for
        the answer.
        """

    @abstractmethod
    def show_monitor(self, console: DriveConsole) -> None:
        """Show Monitor on a drive."""

    @property
    @abstractmethod
    def place(self) -> str:
        """The name of the screen below any dialog."""

    @abstractmethod
    def action_goto(self, place: str) -> AwaitMount | None:
        """Show a screen, on the drive that is open."""

    @abstractmethod
    async def open_parameter(self, code: str, proposed: int | None = None) -> None:
        """Show a parameter of the open drive in the editor, under the cursor.

        With a `proposed` raw value, its dialog opens with this value, which is not staged.
        """

    @property
    @abstractmethod
    def journal_trouble(self) -> str:
        """Why what is written is not on record; empty while it is."""

    @abstractmethod
    def frame_now(self) -> FrameView:
        """Return the frame around every screen at this moment."""

    @abstractmethod
    def say_first(self, happened: str, next_step: str, kind: str = "") -> None:
        """Say something on Line, where a person begins."""

    @property
    @abstractmethod
    def stop_target_text(self) -> str:
        """The words of the stop key in the line of keys."""

    def tell(self, text: str) -> None:
        """Say why a key did nothing."""
        self.events.add("told", text)


UNREACHED = (
    "NOT STOPPED: device {}, not identified. Stop it at the machine, or enter its profile on Line"
    " and press s."
)


def tell_unreached(panel: Panel, devices: Sequence[int]) -> None:
    """Report drives without a profile, which a stop of all does not reach."""
    tell_not_stopped(panel, UNREACHED.format(", ".join(map(str, devices))))


def tell_not_stopped(panel: Panel, text: str) -> None:
    """Report what a stop of all does not reach, over every screen."""
    panel.events.add("failed", text)
    panel.unreached = text, panel.panel_clock.monotonic()
