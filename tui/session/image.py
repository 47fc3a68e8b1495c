"""Known values of a drive's registers: raw values that the drive itself reported, with their time.

Only replies of the drive come in here, as readings without a value: what scales them may change.
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


@dataclass(frozen=True)
class _State:
    """Everything at one moment; replaced as a whole, so that any thread may look."""

    held: Mapping[str, Reading]
    refused: Mapping[str, Reading]
    since: float
    """Time before which values may be outdated."""

    # worked out where somebody asks: replies come far more often
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
    """The registers of one drive by code, as its replies told them; for any thread.

    A newer reply counts, however late an older one is handed in.
    """

    def __init__(self, profile: Profile, clock: Clock = REAL_CLOCK) -> None:
        self._profile = profile
        self._clock = clock
        self._lock = threading.Lock()
        self._now = _State({}, {}, -math.inf)
        self._doubted: dict[str, float] = {}
        """When a word was last written, or may have been."""
        self._trusted_from = -math.inf
        self._waiting_for: dict[str, Callable[[int], None]] = {}
        """Callers that wait for the value of a word written without a sure answer."""

    @property
    def raws(self) -> Mapping[str, int]:
        """The last raw value of every register that was read."""
        return self._now.raws

    @property
    def trusted(self) -> Mapping[str, int]:
        """The raw values that decisions may rest on: read since the drive may have changed."""
        return self._now.trusted

    @property
    def refused(self) -> Mapping[str, Reading]:
        """The registers that the drive refused, or met with silence, when they were last read."""
        return self._now.refused

    @property
    def lacking(self) -> frozenset[str]:
        """Codes that the drive itself said it does not have."""
        return frozenset(code for code, reading in self._now.refused.items() if reading.absent)

    def get(self, code: str) -> Reading | None:
        """Return the value of a register; None if it was never read, or is unknown by now."""
        return self._now.held.get(code)

    def changed(self, code: str) -> float:
        """When a register was last read or written; minus infinity if it never was."""
        held = self._now.held.get(code)
        return max(self._doubted.get(code, -math.inf), -math.inf if held is None else held.time)

    def age(self, code: str) -> float:
        """Seconds since a register's value was on the wire; infinite where it is not known."""
        held = self._now.held.get(code)
        return math.inf if held is None else held.age(self._clock.monotonic())

    def fresh(self, longest: float) -> dict[str, int]:
        """Trusted raw values no older than so many seconds."""
        state, oldest = self._now, self._clock.monotonic() - longest
        return {c: raw for c, raw in state.trusted.items() if state.held[c].time >= oldest}

    def take(self, found: Mapping[str, Reading]) -> None:
        """Keep replies of the drive: values, and refusals."""
        reported: list[tuple[Callable[[int], None], int]] = []
        with self._lock:
            held, refused = dict(self._now.held), dict(self._now.refused)
            for code, reading in found.items():
                if reading.time < self._doubted.get(code, -math.inf):
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
        """Call back with what a word holds as soon as it is read again, before its next write."""
        with self._lock:
            self._waiting_for[code] = reported

    def confirm(self, code: str, raw: int, time: float, origin: Origin = Origin.READ_BACK) -> None:
        """Keep one raw value that was read at a time on the monotonic clock."""
        self.take({code: Reading.undecoded(self._profile[code], raw, time, origin)})

    def doubt(self, code: str) -> None:
        """A word is being written: what it holds is unknown until it is read again."""
        with self._lock:
            self._waiting_for.pop(code, None)
            self._doubted = {**self._doubted, code: self._clock.monotonic()}
            held = {c: reading for c, reading in self._now.held.items() if c != code}
            self._set(held, self._now.refused)

    def believe(self, code: str, before: Reading | None) -> None:
        """The write of a word was never sent: what was known of it before still holds."""
        with self._lock:
            self._doubted = {c: at for c, at in self._doubted.items() if c != code}
            if before is not None and code not in self._now.held:
                self._set({**self._now.held, code: before}, self._now.refused)

    def distrust(self) -> None:
        """The drive may have been reset: no decision rests on what was read before now."""
        with self._lock:
            self._trusted_from = self._clock.monotonic()
            silent = {c: reading for c, reading in self._now.refused.items() if reading.silent}
            self._set(self._now.held, silent)

    def forget(self, codes: Iterable[str] | None = None) -> None:
        """Another drive may answer now, or these words may hold anything: nothing is known."""
        with self._lock:
            gone = None if codes is None else set(codes)
            held = self._now.held.items()
            kept = {} if gone is None else {c: reading for c, reading in held if c not in gone}
            self._set(kept, {} if gone is None else self._now.refused)

    def _set(self, held: Mapping[str, Reading], refused: Mapping[str, Reading]) -> None:
        self._now = _State(held, refused, self._trusted_from)
