"""The time before a replay: curves, trips and last checks, from samples of the record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

from tui.drive.chart import watched_codes
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.drive.values import from_words, is_signed_type, word_count

from .console import DriveConsole
from .drive_state import DriveState, drive_state
from .monitor.line_watch import LineWatch
from .monitor.look import Look, last_that_brought
from .monitor.monitor import codes_of_state
from .monitor.trend import Trend, trend_codes
from .read.reader import Decoding
from .reading import Origin, Reading
from .record.replay_line import ReplayLine
from .record.replay_reader import RecordedReply
from .record.schema import GOOD, REFUSED

PAST_SECONDS, RECENT_SECONDS = 600.0, 60.0
"""Seconds of a curve before the replay, and of the last part of it that has more samples."""
PAST_STEP, RECENT_STEP = 10.0, 3.0
"""Seconds between two samples."""
ROWS_OF_STATE = 64
"""Last replies of a drive that have all values of its state."""
VALUES_WITHIN = 12.0
"""Seconds before a sample in which its values were read; the record has means over 10 s."""


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
    line: ReplayLine,
    console: DriveConsole,
    watch: LineWatch,
    times: Sequence[float],
    monitored: float,
) -> None:
    """Have a drive know its last trip and state, and its curve until it is monitored.

    It reads the record. Values that scales depend on are those that the session knows.
    """
    past, trend = _Past(line, console), Trend(console.session.profile)
    look: Look | None = None
    for time in times:
        found = past.look(time, look)
        if found is not None and (found.state is None or found.state.kind != "unknown"):
            look = found
            watch.recall(console.device, look)
            if time < monitored:
                trend.add(look)
    console.monitor.recall(trend)


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
    address: int
    registers: int


class _Past:
    """Samples of one drive."""

    def __init__(self, line: ReplayLine, console: DriveConsole) -> None:
        self._line = line
        profile = console.session.profile
        self._device, self._profile = console.device, profile
        self._places = [
            _Place(parameter, parameter.function, parameter.address, word_count(parameter))
            for parameter in map(profile.__getitem__, codes_of_state(profile))
        ]
        self._mean_of = means_of(profile).get
        self._curves = set(trend_codes(profile))
        self._words = set(watched_codes(profile))
        self._decode = Decoding(console.session).decode
        self._raws: dict[str, int | None] = {}
        self._state: DriveState | None = None

    def look(self, at: float, before: Look | None) -> Look | None:
        """Return the values at a time; None if nothing was read before it."""
        replies = self._line.last_before(self._device, at - VALUES_WITHIN, at, ROWS_OF_STATE)
        if not replies:
            return None
        if replies[0].quality > REFUSED:
            error = str(replies[0].error(self._device))
            return Look(None, error, at, None, {}, last_that_brought(before))
        readings = {
            place.parameter.code: reading
            for place in self._places
            if (reading := self._reading(place, replies)) is not None
        }
        return Look(self._state_of(readings), "", at, None, readings)

    def _reading(self, place: _Place, replies: Sequence[RecordedReply]) -> Reading | None:
        end = place.address + place.registers
        for reply in replies:
            if (
                reply.function == place.function
                and reply.address <= place.address
                and end <= reply.address + reply.registers
                and reply.quality == GOOD
            ):
                words = [reply.word(at, self._mean_of) for at in range(place.address, end)]
                if None in words:
                    return None
                raw = from_words(place.parameter, [word for word in words if word is not None])
                found = Reading.undecoded(place.parameter, raw, reply.ended / 1e6, Origin.POLL)
                return self._decode(found) if place.parameter.code in self._curves else found
        return None

    def _state_of(self, readings: Mapping[str, Reading]) -> DriveState:
        """The state, calculated again if a word has changed that is not one of its curves."""
        curves = self._curves - self._words
        raws = {code: item.raw for code, item in readings.items() if code not in curves}
        if self._state is None or raws != self._raws:
            self._raws, self._state = raws, drive_state(self._profile, readings)
        return self._state
