"""The trips of a drive out of the journal: one record each, however often a panel was opened."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from .journal import FAULT_WHYS, Entry


@dataclass(frozen=True, slots=True)
class Trip:
    """One trip; times as texts of the journal."""

    code: str
    name: str
    seen: str
    """The first time that the drive was seen in this fault."""
    tripped: str = ""
    """The time of the trip itself; empty if it was not seen."""
    reset: str = ""
    """The time at which its end was seen; empty if it was not."""


def trips_of(entries: Iterable[Entry]) -> list[Trip]:
    """One record per trip of one drive, oldest first; `entries` are its `fault` entries.

    A fault that is seen again without an end or another fault in between is the same trip.
    """
    found: list[Trip] = []
    for entry in entries:
        last = found[-1] if found else None
        ongoing = last is not None and not last.reset and last.code in ("", entry.code)
        if entry.answer == "reset":
            if last is not None and ongoing:
                found[-1] = replace(last, code=entry.code, name=entry.new, reset=entry.time)
            continue
        # older files say "tripped" of each fault that was there when a panel was opened
        tripped = entry.answer == "tripped" and entry.why == FAULT_WHYS["tripped"]
        if last is not None and ongoing and not tripped:
            found[-1] = replace(last, code=entry.code, name=entry.new)
        else:
            found.append(Trip(entry.code, entry.new, entry.time, entry.time if tripped else ""))
    return found
