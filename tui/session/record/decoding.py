"""Decoding of recorded words: each point gets the scale and the unit of its time."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import NamedTuple

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Parameter
from tui.drive.shown import number_of
from tui.drive.values import is_enumeration

from .reduction import Extent
from .schema import QUALITIES

WITHOUT_VALUE = "no value"
"""Quality of a reply with the word of the family for "no value", perhaps in a part of 10 s."""
NO_GOOD_REPLY = "no good reply"
UNKNOWN_SCALE = "scale not recorded"
NOT_KEPT = "changed within 10 s"
"""Quality of names or bits that changed, and of a part of a word, which has no extent."""
OTHER_UNIT = "in another unit"
_GOOD = QUALITIES[0]


class HistoryPoint(NamedTuple):
    """One reply, or the replies of up to 10 s; times in seconds since 1970."""

    time: float
    """Time of the reply; the first request of a reduced point."""
    end: float
    """The same as `time`, or the end of the last reply of a reduced point."""
    least: float | None
    """None, as the next two, if there is no value; `quality` gives the reason."""
    mean: float | None
    """None too for names or bits that changed: their mean means nothing."""
    most: float | None
    quality: str = _GOOD
    good: int = 1
    bad: int = 0
    """Numbers of good replies and of others."""
    reduced: bool = False
    exact: bool = True
    """False if the values may lie within `least` and `most`: a value of two registers whose high
    word changed."""
    raw: int | None = None
    """The raw value, if it is one."""


READ_BESIDE = 2.0
"""Seconds after a word in which another word of the same cycle is read."""
KNOWN_FOR = 60.0
"""Seconds for which a word that was read before another one counts with it."""


def joined_points(
    points: Iterable[HistoryPoint], further: Sequence[HistoryPoint], shift: int
) -> Iterator[HistoryPoint]:
    """Yield the points of a word with a further word, shifted left by so many bits.

    The further word is the last one that was read before or in the same cycle. Without one, the
    point has no value.
    """
    times = [point.time for point in further]
    for point in points:
        at = bisect_right(times, point.end + READ_BESIDE) - 1
        last = further[at] if at >= 0 else None
        fresh = last is not None and point.time - last.end <= KNOWN_FOR
        values = (
            point.least,
            point.most,
            *((last.least, last.most) if last and fresh else (None,)),
        )
        if None in values:
            yield point._replace(least=None, most=None)
            continue
        least, most, low, high = (int(value) for value in values if value is not None)
        yield point._replace(least=least | low << shift, most=most | high << shift)


@dataclass(slots=True)
class RawPoint:
    """A point before it is decoded; times in microseconds."""

    time: int
    end: int
    extent: Extent | None
    quality: str = _GOOD
    good: int = 1
    bad: int = 0
    reduced: bool = False
    exact: bool = True
    raw: int | None = None


ScaleWords = Sequence[tuple[int, int | None, bool]]
"""Raw values of a word that determines a scale, by time in microseconds; None if unknown, and True
if the drive has no such word."""


def curve_number(
    profile: Profile,
    entry: Parameter,
    raw: int,
    raws: Mapping[str, int],
    absent: Collection[str] = (),
) -> float | None:
    """Return the number of a raw value for a curve; None if its scale is not known.

    Names and bits have the raw value; a number has its engineering value, even if it is named.
    """
    if entry.bits or is_enumeration(entry):
        return float(raw)
    number = number_of(profile, entry, raw, raws, absent)
    return None if number is None else float(number)


def curve_unit(profile: Profile, entry: Parameter, raws: Mapping[str, int]) -> str:
    """Return the unit of `curve_number`."""
    if entry.bits or is_enumeration(entry):
        return ""
    if (taught := profile.taught.get(entry.code)) is not None:
        return taught.unit
    return profile.unit(entry, raws)


@dataclass(slots=True)
class PointDecoder:
    """Makes engineering values of raw ones, with the scale of their time."""

    profile: Profile
    entry: Parameter
    sources: Mapping[str, ScaleWords]
    unit: str = field(init=False, default="")
    """Unit of the first value, and of all others that are not gaps."""
    _raws: dict[str, int] = field(init=False, default_factory=dict)
    _absent: set[str] = field(init=False, default_factory=set)

    def point(self, raw: RawPoint) -> HistoryPoint:
        """Return a point with its values."""
        if raw.extent is None:
            return self._gap(raw, raw.quality)
        self._set_sources(raw.time)
        number = partial(
            curve_number, self.profile, self.entry, raws=self._raws, absent=self._absent
        )
        least, most = (number(end) for end in (raw.extent.least, raw.extent.most))
        if least is None or most is None:
            return self._gap(raw, UNKNOWN_SCALE)
        unit = curve_unit(self.profile, self.entry, self._raws)
        if self.unit and unit != self.unit:
            return self._gap(raw, OTHER_UNIT)
        self.unit = unit
        mean: float | None = self._mean(raw.extent, least, most)
        quality = raw.quality
        if least != most and (self.entry.bits or is_enumeration(self.entry)):
            mean, quality = None, NOT_KEPT
        return HistoryPoint(
            raw.time / 1e6, raw.end / 1e6, min(least, most), mean, max(least, most), quality,
            raw.good, raw.bad, raw.reduced, raw.exact, raw.raw,
        )  # fmt: skip

    def _gap(self, raw: RawPoint, why: str) -> HistoryPoint:
        return HistoryPoint(
            raw.time / 1e6, raw.end / 1e6, None, None, None, why,
            raw.good, raw.bad, raw.reduced, raw.exact, raw.raw,
        )  # fmt: skip

    def _set_sources(self, utc: int) -> None:
        for code, source in self.sources.items():
            at = bisect_right(source, utc, key=lambda item: item[0]) - 1
            _, raw, missing = source[at] if at >= 0 else (0, None, False)
            self._raws.pop(code, None)
            self._absent.discard(code)
            if raw is not None:
                self._raws[code] = raw
            if missing:
                self._absent.add(code)

    def _mean(self, extent: Extent, least: float, most: float) -> float:
        """Return the mean between two ends; scales are linear."""
        if extent.least == extent.most:
            return least
        share = (extent.mean - extent.least) / (extent.most - extent.least)
        return least + share * (most - least)
