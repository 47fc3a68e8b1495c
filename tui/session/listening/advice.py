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
"""Greatest share of the present time on the wire that a reported shorter plan takes."""
SAME_PACE = 2
"""Reads count as one cycle if they occur at least once per this many of the most frequent read."""
MILLISECONDS = "ms"


@dataclass(frozen=True, slots=True)
class ShorterPlan:
    """Reads of a master's cycle, and those that return the same values in less time."""

    now: tuple[WordSpan, ...]
    now_seconds: float
    codes: tuple[str, ...]
    plan: ReadPlan


def shorter_plan(profile: Profile, drive: DriveTally, timing: WireTiming) -> ShorterPlan | None:
    """Return a shorter plan for the repeated reads of a master; None if there is none.

    Reads of words that no parameter of the family has stay unchanged.
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
    """Margin of a drive's communication timeout over the longest pause in polling; times in
    seconds."""

    code: str
    seconds: float | None
    """Timeout in seconds; None if it is off."""
    known: Literal["heard", "factory"]
    begun: bool
    """False if it begins with a first command, and none was observed."""
    longest_pause: float

    @property
    def margin(self) -> float | None:
        """Least seconds left before the timeout; negative if it expired."""
        return None if self.seconds is None else self.seconds - self.longest_pause

    @property
    def fed(self) -> bool | None:
        """True if it never expired; None if it is off."""
        return None if self.margin is None else self.margin > 0


def feeding(profile: Profile, drive: DriveTally, now: float) -> Feeding | None:
    """Return the margin of a drive's timeout; None if it has none, or it is unknown.

    Values reported to any program take precedence over the factory setting; of several timeouts the
    shortest counts.
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
