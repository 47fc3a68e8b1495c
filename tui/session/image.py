"""Known values of a drive's registers: raw values that the drive itself reported, with their time.

Only replies of the drive are stored, and only raw: the scale of a value may change later.
A write makes its word unknown until it is read back.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

from tui.drive.profile.profile import Profile

from .clock import REAL_CLOCK, Clock
from .reading import Origin, Reading

NEVER_READ = 0.0
"""Time of the reading of a register that was not read yet in a replay: nothing is known of it."""


@dataclass(frozen=True)
class _State:
    """All values at one moment; replaced as a whole, so that any thread may read it."""

    held: Mapping[str, Reading]
    refused: Mapping[str, Reading]
    since: float
    """Time before which values may be outdated."""

    # calculated on demand: replies arrive far more often than anything reads these
    @cached_property
    def raws(self) -> Mapping[str, int]:
        return MappingProxyType(
            {code: reading.raw for code, reading in self.held.items() if reading.raw is not None}
        )

    @cached_property
    def trusted(self) -> Mapping[str, int]:
        held, since = self.held, self.since
        return MappingProxyType({c: raw for c, raw in self.raws.items() if held[c].time >= since})


class RegisterImage:
    """Registers of one drive by code, from its replies; for any thread.

    The newer of two replies counts, in whichever order they are passed in.
    """

    def __init__(self, profile: Profile, clock: Clock = REAL_CLOCK) -> None:
        self._profile = profile
        self._clock = clock
        self._lock = threading.Lock()
        self._now = _State({}, {}, -math.inf)
        self._doubted: dict[str, float] = {}
        """When a word was last written, or may have been (monotonic)."""
        self._trusted_from = -math.inf
        self._waiting_for: dict[str, Callable[[int], None]] = {}
        """Callbacks by code, for words written without a certain answer."""

    @property
    def raws(self) -> Mapping[str, int]:
        """Last raw value by code, however old."""
        return self._now.raws

    @property
    def trusted(self) -> Mapping[str, int]:
        """Raw values that decisions may use: read since the drive may last have been reset."""
        return self._now.trusted

    @property
    def refused(self) -> Mapping[str, Reading]:
        """Registers that the drive refused, or did not answer, when they were last read."""
        return self._now.refused

    @property
    def lacking(self) -> frozenset[str]:
        """Codes that the drive itself reported as missing."""
        return frozenset(code for code, reading in self._now.refused.items() if reading.absent)

    def get(self, code: str) -> Reading | None:
        """Return the last reading of a register; None if never read, or written since."""
        return self._now.held.get(code)

    def changed(self, code: str) -> float:
        """Return when a register was last read or written (monotonic); -inf if it never was."""
        held = self._now.held.get(code)
        return max(self._doubted.get(code, -math.inf), -math.inf if held is None else held.time)

    def age(self, code: str) -> float:
        """Return the seconds since a register's value was on the wire; infinite if not known."""
        held = self._now.held.get(code)
        return math.inf if held is None else held.age(self._clock.monotonic())

    def fresh(self, longest: float) -> dict[str, int]:
        """Return the trusted raw values that are at most `longest` seconds old."""
        state, oldest = self._now, self._clock.monotonic() - longest
        return {c: raw for c, raw in state.trusted.items() if state.held[c].time >= oldest}

    def take(self, found: Mapping[str, Reading]) -> None:
        """Store values and refusals of the drive; call those that wait for one."""
        reported: list[tuple[Callable[[int], None], int]] = []
        with self._lock:
            held, refused = dict(self._now.held), dict(self._now.refused)
            for code, reading in found.items():
                if reading.time == NEVER_READ or reading.time < self._doubted.get(code, -math.inf):
                    continue
                before = held.get(code) or refused.get(code)
                if before is not None and before.time > reading.time:
                    continue
                held.pop(code, None)
                refused.pop(code, None)
                if reading.raw is None:
                    refused[code] = reading
                else:
                    held[code] = reading
                    if (requested := self._waiting_for.pop(code, None)) is not None:
                        reported.append((requested, reading.raw))
            self._set(held, refused)
        for requested, raw in reported:
            requested(raw)

    def tell_once(self, code: str, reported: Callable[[int], None]) -> None:
        """Call back with the value of a word at its next read, unless it is written before."""
        with self._lock:
            self._waiting_for[code] = reported

    def confirm(self, code: str, raw: int, time: float) -> None:
        """Store one raw value that was read at a time (monotonic)."""
        self.take({code: Reading.undecoded(self._profile[code], raw, time, Origin.READ_BACK)})

    def doubt(self, code: str) -> None:
        """Make a word unknown until it is read again, because it is being written."""
        with self._lock:
            self._waiting_for.pop(code, None)
            self._doubted = {**self._doubted, code: self._clock.monotonic()}
            held = {c: reading for c, reading in self._now.held.items() if c != code}
            self._set(held, self._now.refused)

    def believe(self, code: str, before: Reading | None) -> None:
        """Restore the reading of a word whose write was never sent."""
        with self._lock:
            self._doubted = {c: at for c, at in self._doubted.items() if c != code}
            if before is not None and code not in self._now.held:
                self._set({**self._now.held, code: before}, self._now.refused)

    def distrust(self) -> None:
        """Trust no value that was read before now, because the drive may have been reset."""
        with self._lock:
            self._trusted_from = self._clock.monotonic()
            silent = {c: reading for c, reading in self._now.refused.items() if reading.silent}
            self._set(self._now.held, silent)

    def forget(self, codes: Iterable[str] | None = None) -> None:
        """Forget these codes, or all: another drive may answer, or a command has changed them."""
        with self._lock:
            gone = None if codes is None else set(codes)
            held = self._now.held.items()
            kept = {} if gone is None else {c: reading for c, reading in held if c not in gone}
            self._set(kept, {} if gone is None else self._now.refused)

    def _set(self, held: Mapping[str, Reading], refused: Mapping[str, Reading]) -> None:
        self._now = _State(held, refused, self._trusted_from)
