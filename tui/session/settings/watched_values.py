"""Values of one drive for a screen of parameters: those that are shown first, then the rest.

A worker in the line's loop reads them, with low priority unless they are shown. Shown values are
read again and again, so that a change by another source becomes visible.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from tui.bus.api import LineWorker, Priority
from tui.bus.errors import LineError, NoAnswer
from tui.drive.profile.schema import Parameter, StateKind
from tui.drive.settings.factory import factory_sources
from tui.drive.shown import scale_sources, shown
from tui.drive.values import Value
from tui.safety import LOOK_IS_OLD, WAS_OFF

from ..drive import DriveSession
from ..read.retrying_reader import RetryingReader, neighbors
from ..read.upload import readable_codes
from ..shown import Shown

IDLE_POLL_INTERVAL = 0.1
"""Seconds between two checks of a reader that has nothing to do."""
REREAD_AFTER = 1.0
"""Seconds after which a shown value is read again."""
REREAD_AFTER_ERROR = 1.0


@dataclass(slots=True)
class WatchedValues:
    """Values of a drive, read while they are shown."""

    session: DriveSession
    state: Callable[[], StateKind | None]
    """The monitored kind of state of the drive; None if it is not known."""
    was_reset: Callable[[], None]
    """Called in the line's thread when the drive was reset or switched off."""
    visible: tuple[str, ...] = ()
    """Codes that are shown now."""
    trouble: str = ""
    """Why nothing can be read now; empty if it can."""
    _reader: LineWorker | None = None
    _silent: float | None = None
    """Since when the drive has not answered."""
    _starting: bool = False
    """True if the drive was starting up when it was last read."""
    _requested: dict[str, float] = field(default_factory=dict)

    @property
    def raws(self) -> Mapping[str, int]:
        """Last raw values, by whichever reader."""
        return self.session.image.raws

    @property
    def absent(self) -> dict[str, str]:
        """Codes without a value, with the error of the drive or the line."""
        return {code: reading.error for code, reading in self.session.image.refused.items()}

    @property
    def lacking(self) -> frozenset[str]:
        """Codes that the drive itself reported as missing."""
        return self.session.image.lacking

    @property
    def progress(self) -> tuple[int, int]:
        """Number of parameters read so far, and of all that can be read."""
        codes = readable_codes(self.session.profile)
        return sum(code in self.raws or code in self.absent for code in codes), len(codes)

    def held(self, code: str) -> Shown | None:
        """Return the value that the drive holds; stale if it was not read again in time.

        None if it was never read, or has been written since.
        """
        reading = self.session.image.get(code)
        if reading is None or reading.raw is None:
            return None
        longest = 0.0 if self.trouble else LOOK_IS_OLD
        found = reading.decoded(self.value_of(code, reading.raw), None)
        return found.aged(self.session.clock.monotonic(), longest)

    def value_of(self, code: str, raw: int) -> Value:
        """Return the value of a raw value that is not read, but proposed or compared with."""
        return shown(self.session.profile, self.session.profile[code], raw, self.raws, self.lacking)

    def start(self) -> None:
        """Begin to read, and read all values again."""
        self.stop()
        self._requested = {}
        self._reader = self.session.line.spawn(self._read, f"editor {self.session.device}")

    def stop(self) -> None:
        """Stop reading."""
        if self._reader is not None:
            self._reader.cancel()
            self._reader = None

    async def _read(self) -> None:
        profile = self.session.profile
        first = RetryingReader(self.session)
        later = RetryingReader(self.session, Priority.BACKGROUND)
        follow = {code for p in profile.parameters for code in factory_sources(p)}
        rest = [*sorted(scale_sources(profile) | follow), *readable_codes(profile)]
        all_parts = neighbors(profile, dict.fromkeys(rest))
        parts, listed = iter(all_parts), self.session.clock.monotonic()
        waiting: list[tuple[str, ...]] = []
        while True:
            try:
                if due := self._due():
                    await first.ask(due)
                    self._requested |= dict.fromkeys(due, self.session.clock.monotonic())
                elif waiting:
                    await later.ask(waiting[0])
                    self._requested |= dict.fromkeys(waiting.pop(0), self.session.clock.monotonic())
                elif (part := next(parts, None)) is not None:
                    known, absent = self.raws, self.absent
                    left = [c for c in part if c not in known and c not in absent]
                    waiting = [tuple(group) for group in later.reader.groups(left)]
                elif (now := self.session.clock.monotonic()) > listed + REREAD_AFTER:
                    parts, listed = iter(all_parts), now  # in a replay, some follow later
                else:
                    await self.session.clock.sleep(IDLE_POLL_INTERVAL)
                self.trouble = ""
                self._look_for_a_reset()
            except LineError as error:
                if isinstance(error, NoAnswer) and self._silent is None:
                    self._silent = self.session.clock.monotonic()
                self.trouble = str(error)
                await self.session.clock.sleep(REREAD_AFTER_ERROR)

    def _look_for_a_reset(self) -> None:
        """Read all values again after the drive was silent or has restarted."""
        since, self._silent = self._silent, None
        off = since is not None and self.session.clock.monotonic() - since > WAS_OFF
        before, self._starting = self._starting, self.state() == "starting"
        if not off and (before or not self._starting):
            return
        self.was_reset()
        self._requested = {}
        self.session.image.forget()

    def _due(self) -> list[str]:
        """Return the shown codes whose value is old."""
        oldest = self.session.clock.monotonic() - REREAD_AFTER
        due = [code for code in self.visible if self._requested.get(code, 0.0) < oldest]
        if not due:
            return []
        follows = [p.scale_source for c in due if (p := self._parameter(c)) and p.scale_source]
        return list(dict.fromkeys((*follows, *due)))

    def _parameter(self, code: str) -> Parameter | None:
        parameter = self.session.profile.get(code)
        return parameter if parameter is not None and parameter.access != "w" else None
