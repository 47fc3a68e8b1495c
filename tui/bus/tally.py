"""Running counts of a line, and their frozen copy for others."""

from __future__ import annotations

from dataclasses import dataclass

from .model import LineCounters, Priority


@dataclass(slots=True)
class Tally:
    """Counts that the line's thread adds to; fields as in Counters."""

    requests: int = 0
    replies: int = 0
    timeouts: int = 0
    searched: int = 0
    checksum: int = 0
    wrong: int = 0
    exceptions: int = 0
    resyncs: int = 0
    stale: int = 0
    bytes_out: int = 0
    bytes_in: int = 0
    busy_seconds: float = 0.0
    framing: int = 0
    parity: int = 0
    breaks: int = 0
    overruns: int = 0

    def count_silence(self, priority: Priority, *, known: bool) -> None:
        """No answer came; an empty address that a search has asked is no failure of the line."""
        if priority >= Priority.BACKGROUND and not known:
            self.searched += 1
        else:
            self.timeouts += 1

    def copy(self, counters: LineCounters) -> None:
        """Take over the counts of the program that owns the line."""
        for name in LineCounters.__slots__:
            setattr(self, name, getattr(counters, name))

    def frozen(self) -> LineCounters:
        """The counts of this moment."""
        return LineCounters(**{name: getattr(self, name) for name in LineCounters.__slots__})
