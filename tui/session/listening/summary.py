"""Result of monitoring: commander of each drive, quality of polling, errors, advice."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from tui.bus.limits import STANDARD_EXCEPTIONS
from tui.drive.errors import DriveError
from tui.drive.profile.profile import Profile
from tui.drive.read_plan import ReadPlan, ReadRequest, WireTiming, plan_reads
from tui.drive.sentences import any_of, counted, first_of, without_stop
from tui.drive.shown import number_of

from . import summary_texts as texts
from .families import AssumedProfile, Families
from .listener import DriveTally, LineListener, LineTally, WriteTally
from .words import WordSpan, names_of_words

CODES_SHOWN = 6
"""Number of parameters of a list that are named; the others are counted."""
HOW_SURE = {
    "named": "set by -p",
    "identified": "reported by the drive",
    "remembered": "stored earlier",
    "likely": "likely",
}


@dataclass(frozen=True, slots=True)
class DriveSummary:
    """Counts and conclusions for one drive."""

    tally: DriveTally
    family: AssumedProfile | None
    pace: float | None
    """Requests per second."""
    feeding: Feeding | None
    shorter: ShorterPlan | None

    @property
    def silent(self) -> bool:
        """True if the drive answered no request."""
        return not self.tally.answered


@dataclass(frozen=True, slots=True)
class ListeningSummary:
    """Summary of a line over a number of seconds."""

    seconds: float
    tally: LineTally
    load: float | None
    """Share of the time with bytes on the line; None if unknown."""
    drives: tuple[DriveSummary, ...]
    reports_silences: bool
    """True if pauses between bytes could be measured."""


def summary_of(listener: LineListener, now: float, timing: WireTiming) -> ListeningSummary:
    """Return the present summary; `timing` is that of the line."""
    tally = listener.tally
    seconds = max(0.0, now - tally.begun)
    busy = tally.bytes * listener.character
    drives = tuple(
        _drive(drive_tally, listener.families, now, timing)
        for _, drive_tally in sorted(tally.drives.items())
        if drive_tally.requests or drive_tally.answers
    )
    load = min(1.0, busy / seconds) if listener.character and seconds else None
    return ListeningSummary(seconds, tally, load, drives, bool(listener.character))


def _drive(tally: DriveTally, families: Families, now: float, timing: WireTiming) -> DriveSummary:
    family = families.family(tally.device)
    profile = family.profile if family is not None else None
    lasted = tally.last - tally.first
    pace = (tally.requests - 1) / lasted if tally.requests > 1 and lasted > 0 else None
    own = WireTiming(timing.character, timing.silence, tally.turnaround or timing.turnaround)
    return DriveSummary(
        tally,
        family,
        pace,
        feeding(profile, tally, now) if profile is not None else None,
        shorter_plan(profile, tally, own) if profile is not None else None,
    )


def summary_lines(summary: ListeningSummary) -> list[str]:
    """The summary for a person; lines of a drive begin with two spaces."""
    tally, lines = summary.tally, []
    pace = tally.exchanges / summary.seconds if summary.seconds else 0.0
    text = counted(tally.exchanges, *texts.LISTENED_TEXTS, seconds=summary.seconds, pace=pace)
    if not tally.exchanges:
        text = texts.HEARD_NONE_TEXT.format(seconds=summary.seconds)
    if summary.load is not None:
        text = f"{text} The line is {summary.load * 100:.0f} % busy."
    lines.append(text)
    if not tally.bytes:
        lines.append("Nothing was received. Check that a master polls, and that A and B are wired.")
    elif not tally.frames:
        lines.append(counted(tally.noise_bytes, *texts.NO_FRAME_TEXTS))
    for drive in summary.drives:
        lines += _drive_lines(drive)
    return [*lines, *_line_troubles(summary)]


def _drive_lines(drive: DriveSummary) -> Iterator[str]:
    tally, profile = drive.tally, drive.family.profile if drive.family is not None else None
    if not tally.device:
        yield "Broadcast to all devices"
    else:
        yield f"Device {tally.device}: {family_text(drive.family)}"
    if not tally.requests:
        yield f"  {counted(tally.answers['unasked'], *texts.UNASKED_TEXTS)}"
        return
    if drive.silent and tally.device:
        single, several = "  no answer to 1 request", "  no answer to {count} requests"
        yield counted(tally.requests, single, several)
    elif tally.device:
        yield f"  {_drive_request_text(drive)}"
    yield f"  {_commanded_text(drive)}"
    if drive.feeding is not None:
        yield f"  {feeding_text(drive.feeding)}"
    for text in _trouble_texts(drive, profile):
        yield f"  {text}"
    if drive.shorter is not None:
        yield f"  {shorter_text(drive.shorter)}"


def family_text(family: AssumedProfile | None) -> str:
    """Return a family, with its certainty."""
    if family is None:
        return "family unknown; name it with -p"
    name, how = family.profile.name, HOW_SURE[family.how]
    return f"{name} ({how}, or {', '.join(family.others)})" if family.others else f"{name} ({how})"


def _drive_request_text(drive: DriveSummary) -> str:
    tally = drive.tally
    text = "polled once"
    if drive.pace is not None:
        text = texts.POLLED_OFTEN_TEXT if drive.pace >= 1 else texts.POLLED_SELDOM_TEXT
        text = text.format(pace=drive.pace, cycle=1 / drive.pace, longest=tally.longest_gap)
    if tally.turnaround is None:
        return text
    least, most = tally.turnaround_least * 1000, tally.turnaround_most * 1000
    return f"{text}; answers in {tally.turnaround * 1000:.1f} ms ({least:.1f} to {most:.1f})"


def _commanded_text(drive: DriveSummary) -> str:
    writes = drive.tally.writes
    commands = {code: tally for code, tally in writes.items() if tally.commands}
    others = {code: tally for code, tally in writes.items() if not tally.commands}
    text = texts.COMMANDED_TEXTS[bool(commands), bool(others)]
    return text.format(commands=_writes_text(commands), others=_writes_text(others))


def _writes_text(writes: dict[str, WriteTally]) -> str:
    shown = [
        f"{code} {tally.text} once"
        if tally.every is None
        else f"{code} {tally.text} every {tally.every:.2f} s"
        for code, tally in writes.items()
    ]
    return first_of(shown, CODES_SHOWN)


def feeding_text(feeding: Feeding) -> str:
    """Return a text on a drive's timeout: whether polling prevents it, and with what margin."""
    known = "as read on the line"
    if feeding.known != "heard":
        known = "factory setting; no master has read it"
    elif feeding.unread:
        known = f"as read on the line; no master has read {any_of(feeding.unread)}"
    if feeding.seconds is None or feeding.margin is None:
        text = f"timeout {feeding.code} off ({known})"
        if feeding.known != "heard" or feeding.unread:
            return text
        return f"{text}: it does not react to a communication loss"
    head = f"timeout {feeding.code} {feeding.seconds:g} s ({known})"
    if not feeding.begun:
        text = f"{head}: starts with the first command; none was heard while listening"
        return text if feeding.fed else f"{text}. If one was sent before, it has expired"
    if feeding.fed:
        return f"{head}: polled in time, {feeding.margin:.2f} s to spare"
    if feeding.polled:
        return f"{head}: NO ANSWERED REQUEST for {feeding.longest_pause:.2f} s"
    return f"{head}: NOT POLLED for {feeding.longest_pause:.2f} s"


def _trouble_texts(drive: DriveSummary, profile: Profile | None) -> Iterator[str]:
    tally = drive.tally
    for code, times in sorted(tally.exceptions.items()):
        meaning = without_stop(exception_meaning(code, profile))
        yield counted(times, *texts.REFUSED_TIMES_TEXTS, code=code, meaning=meaning)
    if tally.answers["none"] and not drive.silent:
        yield counted(tally.answers["none"], "no answer once", "no answer {count} times")
    if tally.answers["damaged"]:
        yield counted(tally.answers["damaged"], *texts.DAMAGED_TEXTS, device=tally.device)
    if tally.answers["again"]:
        yield counted(tally.answers["again"], *texts.TWO_ANSWERS_TEXTS, device=tally.device)


def exception_meaning(code: int, profile: Profile | None) -> str:
    """Return the meaning of a code in this family, else by the standard."""
    for exception in profile.data.exceptions if profile is not None else ():
        if exception.code == code:
            return exception.meaning
    return STANDARD_EXCEPTIONS.get(code, "meaning unknown")


def shorter_text(shorter: ShorterPlan) -> str:
    """Return a shorter read for a master."""
    requests = shorter.plan.requests
    now = counted(
        len(shorter.now),
        *texts.READS_NOW_TEXTS,
        codes=first_of(shorter.codes, CODES_SHOWN),
        milliseconds=shorter.now_seconds * 1000,
    )
    plan = counted(
        len(requests),
        *texts.WOULD_TAKE_TEXTS,
        reads=first_of([_request_text(request) for request in requests], CODES_SHOWN, "; "),
        milliseconds=shorter.plan.seconds * 1000,
    )
    return f"{now} {plan}"


def _request_text(request: ReadRequest) -> str:
    single, several = "1 word from {address}", "{count} words from {address}"
    return counted(request.count, single, several, address=request.address)


def _line_troubles(summary: ListeningSummary) -> Iterator[str]:
    tally = summary.tally
    if tally.noises and tally.frames:
        yield counted(tally.noises, *texts.OUTSIDE_TEXTS, bytes=tally.noise_bytes)
    if tally.crossed:
        yield counted(tally.crossed, *texts.SECOND_MASTER_TEXTS)
    if not tally.frames:
        return
    if not summary.reports_silences:
        yield "Gaps between frames are not checked: this port has no baud rate of its own."
        return
    if tally.cut:
        yield counted(tally.cut, *texts.BROKEN_TEXTS, pause=tally.longest_cut * 1000)
    if tally.hasty:
        yield counted(tally.hasty, *texts.TOO_SOON_TEXTS)
    if tally.together * 3 > tally.frames:
        yield "The adapter delivers several frames at once: the gaps between them are unknown."
    elif not tally.cut and not tally.hasty:
        yield "The gaps between frames are long enough."


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
    """Longest time without an answered request."""
    polled: bool = False
    """True if requests without a reply were sent in that time."""
    unread: tuple[str, ...] = ()
    """Other timeouts of the drive that no master has read, if one was read."""

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
    unread = tuple(code for code in codes if code not in heard) if heard else ()
    known: Literal["heard", "factory"] = "heard" if heard else "factory"
    polled = bool(drive.requests) and drive.gap_until(now) < pause
    return Feeding(code, seconds, known, begun, pause, polled, unread)


def _seconds(profile: Profile, code: str, raw: int, off: int | None) -> float | None:
    number = None if raw == off else number_of(profile, profile[code], raw, {})
    if not number:
        return None
    return float(number) / (1000 if profile[code].unit == MILLISECONDS else 1)
