"""One drive with its monitor, commander, editors and recorder."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

from tui.bus.api import Priority

from .command.commander import Commander
from .connect.identify import DriveIdentity
from .drive import DriveSession
from .drive_state import DriveState
from .journal import Journal
from .monitor.fault_record import Recorder
from .monitor.monitor import Monitor
from .monitor.snapshot import Snapshot
from .read.reader import Reader
from .shown import Shown
from .teaching.teacher import Teacher

if TYPE_CHECKING:
    from .blocks.editor import BlockEditor
    from .counters.watch import CounterWatch
    from .diagnosis.diagnosis import Diagnosis
    from .settings.editor import Editor
    from .startup.start_up import StartUp


@dataclass(eq=False)
class DriveConsole:
    """The one monitor, commander, settings, blocks, recorder and teacher of a drive."""

    session: DriveSession
    journal: Journal
    proved: str = ""
    """Result of the last communication loss test, in a few words."""
    diagnosis: Diagnosis | None = None
    """The last diagnosis of missing or bad replies; None before the first."""
    diagnosed_at: float = 0.0
    """Wall time of that diagnosis."""
    start_up: StartUp | None = None
    """The guided start-up of this drive; None until a screen has opened it."""

    def __post_init__(self) -> None:
        self.monitor = Monitor(self.session)
        self.commander = Commander(self.session, self.journal)
        self.recorder = Recorder(self.session, self.journal)
        self.monitor.listen(self.recorder.take)
        self.teacher = Teacher(self.session)

    async def read(self, codes: Iterable[str], *, again: bool = False) -> Mapping[str, Shown]:
        """Read codes for a person, with the priority of a poll if `again`.

        Raises the line's errors.
        """
        priority = Priority.POLL if again else Priority.OPERATOR_READ
        return await Reader(self.session).read(codes, priority=priority)

    def known(self, codes: Iterable[str]) -> Mapping[str, Shown]:
        """Return the last values that this program has read, however old; nothing is read."""
        return Reader(self.session).known(codes)

    @property
    def device(self) -> int:
        """The drive's address."""
        return self.session.device

    @property
    def identity(self) -> DriveIdentity | None:
        """Identity that the drive reports."""
        return self.session.identity

    @cached_property
    def editor(self) -> Editor:
        """Staged and written values of its parameters."""
        from .settings.editor import Editor  # what Monitor does not need is imported later

        return Editor(self.session, self.journal, lambda: self.current_state)

    @cached_property
    def blocks(self) -> BlockEditor:
        """Proposed and written assignments of its blocks."""
        from .blocks.editor import BlockEditor

        return BlockEditor(self.session, self.monitor, self.journal)

    @cached_property
    def counters(self) -> CounterWatch:
        """Exchanges with the drive, counted by this program and by the drive."""
        from .counters.watch import CounterWatch

        return CounterWatch(self.session)

    @property
    def begun_editor(self) -> Editor | None:
        """The editor, if a screen has opened the parameters."""
        return self.__dict__.get("editor")

    @property
    def begun_blocks(self) -> BlockEditor | None:
        """The block editor, if a screen has opened the blocks."""
        return self.__dict__.get("blocks")

    @property
    def latest(self) -> Snapshot | None:
        """The last cycle of the monitor."""
        return self.monitor.latest

    @property
    def current_state(self) -> DriveState | None:
        """State of the drive in the last cycle; None if that failed or is old."""
        latest = self.monitor.latest
        if latest is None or latest.error or latest.is_stale(self.session.clock.monotonic()):
            return None
        return latest.state

    def close(self) -> None:
        """Stop monitoring; the line stays open."""
        self.monitor.close()
