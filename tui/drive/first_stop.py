"""Stop words for a drive whose family is not certain. Pure functions.

A word that stops one family may start another: a ramp stop in one state chart is a run command in
the other. So, before the drive is identified, only a word is sent that stops in every chart that
the drive may have.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from .chart import state_of
from .orders import GENTLE_FIRST
from .profile.schema import Chart, Order, OrderId
from .profile.stop_profile import StopProfile
from .words import registers_of_word, unsigned


@dataclass(frozen=True, slots=True)
class FirstWord:
    """A word that stops every family that the drive may belong to."""

    address: int
    """The place of its register or of its first coil, see wire_place()."""
    word: int
    """The bits of the command word."""
    values: tuple[int, ...]
    """Words of the registers, in their order."""
    code: str
    """Name of the register in those families."""
    order: OrderId
    families: tuple[StopProfile, ...]


@dataclass(frozen=True, slots=True)
class StopPlace:
    """A register that stops families; families that the user named come first."""

    address: int
    families: tuple[StopProfile, ...]

    @property
    def status(self) -> tuple[int, ...]:
        """Addresses of the families' status words; a drive without them is of another family."""
        return self._addresses(chart.status for family in self.families for chart in family.charts)

    @property
    def deciding(self) -> tuple[int, ...]:
        """Addresses of further words that select the stop word."""
        codes = (
            code
            for family in self.families
            for chart in family.charts
            for code in (
                *((chart.when.parameter,) if chart.when else ()),
                *(w.parameter for order in _stops(chart) for w in order.when),
            )
        )
        return tuple(address for address in self._addresses(codes) if address not in self.status)

    def _addresses(self, codes: Iterator[str]) -> tuple[int, ...]:
        wanted = set(codes)
        found = {
            address
            for family in self.families
            for code, address in family.places.items()
            if code in wanted
        }
        return tuple(sorted(found))


def stop_places(families: Sequence[StopProfile], named: Sequence[str] = ()) -> list[StopPlace]:
    """Return the stop registers of families: named ones first, then those that ignore a wrong word.

    The others immediately refuse a word that they do not have.
    """
    places: dict[int, list[StopProfile]] = {}
    for profile in families:
        for address in {
            _place(profile, chart, order) for chart in profile.charts for order in _stops(chart)
        }:
            if address is not None:
                places.setdefault(address, []).append(profile)
    rank = {id: number for number, id in enumerate(named)}

    def place_of(profile: StopProfile) -> int:
        return rank.get(profile.id, len(rank))

    found = [
        StopPlace(address, tuple(sorted(group, key=place_of))) for address, group in places.items()
    ]
    return sorted(
        found,
        key=lambda place: (
            min(place_of(family) for family in place.families),
            all(family.names_itself for family in place.families),
            place.address,
        ),
    )


def families_beside(families: Sequence[StopProfile], named: str) -> tuple[StopProfile, ...]:
    """Return a named family, and those that are stopped by one of its registers.

    If the user has named the family, no other register may be written.
    """
    places = stop_places(families, [named])
    ids = {
        profile.id
        for place in places
        if any(family.id == named for family in place.families)
        for profile in place.families
    }
    return tuple(profile for profile in families if profile.id in ids)


def first_word(
    place: StopPlace, raws: Mapping[int, int], wanted: OrderId, named: Sequence[str] = ()
) -> FirstWord | None:
    """Return the gentlest word that stops every possible family; None if there is none.

    `raws` are words read from the drive, by address. A family without a word that the drive has
    answered is ruled out, unless the user named it.
    """
    may_be = tuple(
        profile
        for profile in place.families
        if profile.id in named or raws.keys() <= profile.addresses
    )
    ways = (wanted, *(way for way in GENTLE_FIRST if way != wanted))
    for way in ways:
        for family in may_be:
            known = _known(family, raws)
            for chart in _charts(family, known):
                for order in chart.orders:
                    if order.id != way or len(order.words) != 1:
                        continue
                    if _place(family, chart, order) != place.address:
                        continue
                    values = _values(family, chart, order)
                    if _holds(order, chart, known) and all(
                        _stopped_by(other, place.address, values, raws) for other in may_be
                    ):
                        word, code = unsigned(order.words[0]), order.parameter or chart.command
                        return FirstWord(place.address, word, values, code, way, may_be)
    return None


def followers(what: FirstWord, raws: Mapping[int, int], wanted: OrderId) -> tuple[str, ...]:
    """Return the families whose own stop is the word that was sent, for the same read words.

    An unidentified drive may be stopped further only by these: the word of another family may start
    it.
    """
    found = []
    for family in what.families:
        alone = first_word(StopPlace(what.address, (family,)), raws, wanted, (family.id,))
        if alone is not None and alone.values == what.values:
            found.append(family.id)
    return tuple(found)


def blind_stops(families: Sequence[StopProfile]) -> list[FirstWord]:
    """Return the words that stop a drive of any of these families in any chart, one per register.

    Nothing has to be read for them. Empty if no word stops all families.
    """
    named = [family.id for family in families]
    found = [first_word(place, {}, "stop", named) for place in stop_places(families, named)]
    return [word for word in found if word is not None] if all(found) else []


def _stopped_by(
    family: StopProfile, address: int, values: Sequence[int], raws: Mapping[int, int]
) -> bool:
    """Return True if a command stops a family in every chart that may be active."""
    known = _known(family, raws)
    charts = _charts(family, known)
    return bool(charts) and all(
        any(
            len(order.words) == 1
            and _values(family, chart, order) == values
            and _place(family, chart, order) == address
            and _holds(order, chart, known)
            for order in _stops(chart)
        )
        for chart in charts
    )


def _charts(family: StopProfile, known: Mapping[str, int]) -> list[Chart]:
    """Return the charts that may be active.

    A chart without commands is returned only if it is certainly active: no word is known to stop
    it, so none is sent.
    """
    sure = [chart for chart in family.charts if chart.when is not None and chart.when.holds(known)]
    if sure:
        return sure
    may = [
        chart for chart in family.charts if chart.when is None or chart.when.holds(known) is None
    ]
    may = may or list(family.charts)  # a value that belongs to no chart selects none
    return [chart for chart in may if chart.orders]


def _holds(order: Order, chart: Chart, known: Mapping[str, int]) -> bool:
    """Return True if a command is certainly possible now."""
    if any(not when.holds(known) for when in order.when):
        return False
    return not order.states or state_of(chart, known).id in order.states


def _stops(chart: Chart) -> list[Order]:
    return [order for order in chart.orders if order.id in GENTLE_FIRST]


def _place(family: StopProfile, chart: Chart, order: Order) -> int | None:
    code = order.parameter or chart.command
    pair = family.pairs.get(code)
    return family.places.get(code) if pair is None else pair.place


def _values(family: StopProfile, chart: Chart, order: Order) -> tuple[int, ...]:
    """Return the registers of the first word of a command."""
    pair = family.pairs.get(order.parameter or chart.command)
    word = order.words[0]
    return (word & 0xFFFF,) if pair is None else registers_of_word(pair, word)


def _known(family: StopProfile, raws: Mapping[int, int]) -> dict[str, int]:
    """Return the raw values by the family's own codes."""
    return {code: raws[address] for code, address in family.places.items() if address in raws}
