"""The time before a replay: curves, trips and last checks, from cycles and samples."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import chain, pairwise
from typing import NamedTuple

from tui.drive.chart import watched_codes
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.drive.values import from_words, is_signed_type, word_count

from .console import DriveConsole
from .drive_state import DriveState, drive_state
from .monitor.line_watch import LineWatch
from .monitor.look import Look, last_that_brought
from .monitor.rates import codes_of_state
from .monitor.trend import Trend, trend_codes
from .read.decoded import Decoding
from .reading import Origin, Reading
from .record.newest import PAUSE_OF_CYCLES, ends_of_cycles
from .record.replay_line import ReplayLine
from .record.replay_reader import RecordedReply
from .record.schema import GOOD, REFUSED, to_microseconds

PAST_SECONDS, RECENT_SECONDS = 600.0, 60.0
"""Seconds of a curve before the replay, and of the last part of it, which Line shows."""
PAST_STEP, RECENT_STEP = 10.0, 3.0
"""Seconds between two samples."""
VALUES_WITHIN = 12.0
"""Seconds before a sample in which its values were read; the record has means over 10 s."""
MOST_OF_CURVE = 100_000
"""Replies of a curve at most."""
NEAR_PERIOD = 0.2
"""Share of a period by which a recorded cycle may be earlier or later."""
AFTER_REPLY = 0.001
"""Seconds after a reply at which its values are known, whatever the rounding of times."""


def past_times(begin: float, at: float, events: Sequence[float]) -> list[float]:
    """Return the times of the samples of a drive in a record before a time, also at events."""
    steps = [(PAST_SECONDS, RECENT_SECONDS, PAST_STEP), (RECENT_SECONDS, 0.0, RECENT_STEP)]
    times = [
        at - before + number * step
        for before, after, step in steps
        for number in range(round((before - after) / step))
    ]
    times += [time for time in events if time > at - PAST_SECONDS]
    return sorted(time for time in times if begin <= time < at)


def recall_past(
    past: RecordedCycles, watch: LineWatch, events: Sequence[float], since: float, monitored: float
) -> Trend:
    """Return the curve of a drive until it is monitored; have its last trip and state known.

    The curve has the recorded cycles from `since` on. Before that it has samples, also at `events`.
    """
    line, trend = past.line, Trend(past.console.session.profile)
    replies = past.replies(since, line.at)
    first = replies[0].ended / 1e6 if replies else line.at
    times = past_times(line.clock.begin, line.at, events)
    samples = (past.sample(time) for time in times if time < first)
    for look in _known(chain(samples, past.cycles(replies, line.at))):
        watch.recall(past.console.device, look)
        if look.time < monitored:
            trend.add(look)
    return trend


def recorded_curve(past: RecordedCycles, until: float) -> Trend:
    """Return the curve of a drive up to a time, with each recorded cycle."""
    trend = Trend(past.console.session.profile)
    for look in _known(past.cycles(past.replies(until - PAST_SECONDS, until), until)):
        trend.add(look)
    return trend


def _known(looks: Iterable[Look | None]) -> Iterator[Look]:
    """Yield the looks that failed, or that show a state."""
    for look in looks:
        if look is not None and (look.state is None or look.state.kind != "unknown"):
            yield look


@lru_cache(maxsize=64)
def means_of(profile: Profile) -> dict[tuple[int, int], bool]:
    """Return the registers that hold a quantity, with True for the signed ones."""
    found: dict[tuple[int, int], bool] = {}
    for parameter in profile.data.parameters:
        is_number = bool(parameter.unit) and not parameter.bits and not profile.names(parameter)
        if is_number and word_count(parameter) == 1:
            signed = is_signed_type(parameter)
            found[parameter.function, parameter.address] = signed
    return found


class _Place(NamedTuple):
    """Registers of a parameter."""

    parameter: Parameter
    function: int
    registers: range
    in_curve: bool


class RecordedCycles:
    """Values of one drive at times of a record, or at the ends of its cycles; oldest first."""

    def __init__(self, line: ReplayLine, console: DriveConsole) -> None:
        self.line, self.console = line, console
        profile = self._profile = console.session.profile
        self._curves = set(trend_codes(profile))
        self._words = set(watched_codes(profile))
        self._places = [
            self._place(parameter, parameter.function, parameter.address)
            for parameter in map(profile.__getitem__, codes_of_state(profile))
        ]
        self._covered: dict[tuple[int, int, int], list[_Place]] = {}
        """Places by the function, the address and the registers of a read."""
        self._in_block: Mapping[int, str] = {}
        self._decode = Decoding(console.session).decode
        self._new: dict[tuple[int, int, int], RecordedReply] = {}
        """The newest reply to each read since the last look, by time."""
        self._newest: RecordedReply | None = None
        self._readings: dict[str, Reading] = {}
        self._look: Look | None = None
        self._raws: dict[str, int | None] = {}
        self._state: DriveState | None = None

    def replies(self, since: float, until: float) -> list[RecordedReply]:
        """Return the replies that ended after `since`, those of a pause after `until` included."""
        end = until + PAUSE_OF_CYCLES
        found = self.line.last_before(self.console.device, since, end, MOST_OF_CURVE)
        return [reply for reply in reversed(found) if reply.ended > to_microseconds(since)]

    def cycles(self, replies: Sequence[RecordedReply], until: float) -> Iterator[Look]:
        """Yield the values at the end of each cycle that read those of the curve, or failed."""
        for reply, following in pairwise([*replies, None]):
            assert reply is not None
            if reply.ended > to_microseconds(until):
                return
            self._take(reply)
            pause = math.inf if following is None else (following.sent - reply.ended) / 1e6
            if pause > PAUSE_OF_CYCLES or (following is not None and self._has(following)):
                if self._is_of_curve():
                    yield self._look_at(reply.ended / 1e6)
                else:
                    self._read_new()
            end = until if following is None else following.sent / 1e6
            if pause > PAUSE_OF_CYCLES and (lost := self.line.lost_within(reply.ended / 1e6, end)):
                yield self._failed(lost.reason, lost.since)

    def checks(self, until: float) -> Iterable[Look]:
        """Return the cycles that follow the curve of the drive, up to a time."""
        last = self.console.monitor.last_point
        since = until - RECENT_SECONDS if last is None else last.time
        self._decode = Decoding(self.console.session).decode
        return _known(self.cycles(self.replies(since, until), until))

    def rest(self, now: float, period: float) -> float:
        """Return the seconds to the end of the recorded cycle that is about a period later."""
        near = period * NEAR_PERIOD
        until = now + period + near
        replies = self.replies(now + period - near, until)
        last = [reply.ended / 1e6 for reply in replies[-1:]]  # a pause follows it, too
        ends = [*ends_of_cycles(replies, until), *(end for end in last if end <= until)]
        # other reads of the drive may come before the check
        return ends[-1] + AFTER_REPLY - now if ends else period

    def sample(self, at: float) -> Look | None:
        """Return the values at a time; None if nothing was read shortly before it."""
        replies = self.line.last_of_each(self.console.device, at - VALUES_WITHIN, at)
        for reply in replies:
            self._take(reply)
        return self._look_at(at) if replies else None

    def _place(self, parameter: Parameter, function: int, address: int) -> _Place:
        registers = range(address, address + word_count(parameter))
        return _Place(parameter, function, registers, parameter.code in self._curves)

    def _take(self, reply: RecordedReply) -> None:
        self._newest = reply
        in_block = self.line.in_block(self.console.device, reply.sent)
        if in_block != self._in_block:
            self._read_new()
            self._covered.clear()
            self._in_block = in_block
        shape = reply.function, reply.address, reply.registers
        if reply.quality == REFUSED:
            for place in self._of(shape):
                self._readings.pop(place.parameter.code, None)
        if reply.quality == GOOD:
            self._new.pop(shape, None)
            self._new[shape] = reply

    def _has(self, reply: RecordedReply) -> bool:
        """Return True if a value of the curve in a reply was read since the last look."""
        new, following = (
            {place.parameter.code for shape in shapes for place in self._of(shape)}
            for shapes in (self._new, [(reply.function, reply.address, reply.registers)])
        )
        return not new.isdisjoint(following & self._curves)

    def _is_of_curve(self) -> bool:
        """True if the newest read failed, or all values of the curve were read since the last look.

        Other reads may bring some of them.
        """
        assert self._newest is not None
        if self._newest.quality > REFUSED:
            return True
        new = {place.parameter.code for shape in self._new for place in self._of(shape)}
        return not new.isdisjoint(self._curves) and new >= self._readings.keys() & self._curves

    def _of(self, shape: tuple[int, int, int]) -> list[_Place]:
        if shape not in self._covered:
            function, address, registers = shape
            read = range(address, address + registers)
            own = {place.parameter.code: place.parameter for place in self._places}
            in_block = [
                self._place(own[code], 3, register)
                for register, code in self._in_block.items()
                if code in own
            ]
            self._covered[shape] = [
                place
                for place in (*self._places, *in_block)
                if place.function == function
                and place.registers[0] in read
                and place.registers[-1] in read
            ]
        return self._covered[shape]

    def _look_at(self, at: float) -> Look:
        self._read_new()
        assert self._newest is not None
        if self._newest.quality > REFUSED:
            return self._failed(str(self._newest.error(self.console.device)), at)
        oldest = at - VALUES_WITHIN
        found = {code: item for code, item in self._readings.items() if item.time >= oldest}
        self._look = Look(self._state_of(found), "", at, None, found)
        return self._look

    def _failed(self, error: str, at: float) -> Look:
        self._look = Look(None, error, at, None, {}, last_that_brought(self._look))
        return self._look

    def _read_new(self) -> None:
        for shape, reply in self._new.items():
            for place in self._of(shape):
                self._read(place, reply)
        self._new.clear()

    def _read(self, place: _Place, reply: RecordedReply) -> None:
        """Take a value from a reply; it has none if its word changed within reduced ones."""
        parameter = place.parameter
        mean_of = means_of(self._profile).get
        words = [reply.word(register, mean_of) for register in place.registers]
        if None in words:
            self._readings.pop(parameter.code, None)
            return
        raw = from_words(parameter, [word for word in words if word is not None])
        found = Reading.undecoded(parameter, raw, reply.ended / 1e6, Origin.POLL)
        self._readings[parameter.code] = self._decode(found) if place.in_curve else found

    def _state_of(self, readings: Mapping[str, Reading]) -> DriveState:
        """The state, calculated again if a word has changed that is not one of its curves."""
        curves = self._curves - self._words
        raws = {code: item.raw for code, item in readings.items() if code not in curves}
        if self._state is None or raws != self._raws:
            self._raws, self._state = raws, drive_state(self._profile, readings)
        return self._state
