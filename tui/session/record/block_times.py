"""Contents of a drive's indirect block or scanner over time, from the events of a record; pure."""

from __future__ import annotations

import json
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping
from itertools import pairwise
from typing import NamedTuple

UNSURE_BEFORE = 5_000_000
"""Microseconds before another content in which the old one may not apply any more."""
_EVER = 1 << 62


class BlockSpan(NamedTuple):
    """A time in which a register of a block has a parameter, in microseconds since 1970."""

    register: int
    begin: int
    end: int


class BlockTimes:
    """Codes by register, as the programs noted them that read the block."""

    def __init__(self, events: Iterable[tuple[int, str]]) -> None:
        """`events` are those of the kind `block` of one drive, with their time."""
        found = [(utc, _places(text)) for utc, text in sorted(events)]
        self._times = [utc for utc, _ in found]
        self._places = [places for _, places in found]

    def at(self, utc: int) -> Mapping[int, str]:
        """Return the codes of a moment; empty if they were unsure."""
        if not self._times:
            return {}
        place = bisect_right(self._times, utc) - 1
        later = bisect_right(self._times, utc + UNSURE_BEFORE)
        places = self._places[place:later] if place >= 0 else []
        return places[0] if places and all(item == places[0] for item in places) else {}

    def of(self, code: str) -> Iterator[BlockSpan]:
        """Yield the times in which a parameter was in the block."""
        for (begin, places), (end, after) in pairwise(
            [*zip(self._times, self._places, strict=True), (_EVER, {})]
        ):
            for register, held in places.items():
                if held == code:
                    sure = after.get(register) == code or end == _EVER
                    yield BlockSpan(register, begin, end if sure else end - UNSURE_BEFORE)


def _places(text: str) -> Mapping[int, str]:
    try:
        return {int(register): str(code) for register, code in json.loads(text)["places"].items()}
    except (ValueError, KeyError, TypeError, AttributeError):
        return {}
