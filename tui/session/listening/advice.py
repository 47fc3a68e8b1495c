"""Improvements for a master: fewer reads for the same values, a timeout with a margin."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from tui.drive.errors import DriveError
from tui.drive.profile.profile import Profile
from tui.drive.read_plan import ReadPlan, WireTiming, plan_reads
from tui.drive.shown import number_of

from .tally import DriveTally
from .words import WordSpan, names_of_words

WORTH_TELLING = 0.95
"""Part of the present time on the wire that a shorter plan takes at most."""
SAME_PACE = 2
"""Reads that come at least once for so many of the most frequent belong to one cycle."""
MILLISECONDS = "ms"


@dataclass(frozen=True, slots=True)
class ShorterPlan:
    """Reads of a master's cycle, and those that bring the same values in less time."""

    now: tuple[WordSpan, ...]
    now_seconds: float
    codes: tuple[str, ...]
    plan: ReadPlan


def shorter_plan(profile: Profile, drive: DriveTally, timing: WireTiming) -> ShorterPlan | None:
    """A shorter plan for what a master reads of a drive again and again; None where none is.

    Reads of words that no parameter of the family has are left as they are.
    """
    often = max((read.times for read in drive.reads.values()), default=0)
    if often < SAME_PACE:
        return None
    spans = [s for s, read in drive.reads.items() if read.times * SAME_PACE >= often]
    named = {span: names_of_words(span, profile) for span in spans}
    spans = [span for span in spans if all(_readable(profile, code) for code in named[span])]
    codes = tuple(dict.fromkeys(code for span in spans for code in named[span]))
    now = sum(timing.read(span.count) for span in spans)
    try:
        plan = plan_reads(profile, codes, timing)
    except DriveError:
        return None
    if not codes or plan.seconds > WORTH_TELLING * now:
        return None
    return ShorterPlan(tuple(spans), now, codes, plan)


def _readable(profile: Profile, code: str) -> bool:
    parameter = profile.get(code)
    return parameter is not None and parameter.access != "w"


@dataclass(frozen=True, slots=True)
class Feeding:
    """A drive's communication timeout, against how long nobody asked it; times in seconds."""

    code: str
    seconds: float | None
    """None where it is off."""
    known: Literal["heard", "factory"]
    begun: bool
    """False where it begins with a first command, and none was heard."""
    longest_pause: float

    @property
    def margin(self) -> float | None:
        """Seconds that were left at the worst moment; below zero it ran out."""
        return None if self.seconds is None else self.seconds - self.longest_pause

    @property
    def fed(self) -> bool | None:
        """True if it never ran out; None where it is off."""
        return None if self.margin is None else self.margin > 0


def feeding(profile: Profile, drive: DriveTally, now: float) -> Feeding | None:
    """Return how a drive's timeout is kept from running out; None if it has none, or is unknown.

    Values that the drive has reported to any program precede its factory setting; of several
    timeouts the shortest counts.
    """
    rules = profile.data.communication_fault
    if rules is None or not rules.timeout or drive.fed is None:
        return None
    codes = [code for code in (rules.timeout, *rules.other_timeouts) if profile.get(code)]
    heard = {code: drive.raws[code] for code in codes if code in drive.raws}
    factory = {c: raw for c in codes if (raw := profile[c].factory) is not None}
    raws = heard or factory
    if not raws:
        return None
    running = {code: _seconds(profile, code, raw, rules.off) for code, raw in raws.items()}
    shortest = min(((s, code) for code, s in running.items() if s is not None), default=None)
    seconds, code = shortest if shortest is not None else (None, next(iter(raws)))
    begun = drive.commanded or not rules.needs_write
    pause = drive.pause_until(now)
    return Feeding(code, seconds, "heard" if heard else "factory", begun, pause)


def _seconds(profile: Profile, code: str, raw: int, off: int | None) -> float | None:
    number = None if raw == off else number_of(profile, profile[code], raw, {})
    if not number:
        return None
    return float(number) / (1000 if profile[code].unit == MILLISECONDS else 1)
