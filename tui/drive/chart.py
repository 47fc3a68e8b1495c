"""Reading a state chart: which state a status word means, and what else its bits say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from .profile.profile import Profile
from .profile.schema import ChannelBits, Chart, DirectionBit, State, StateKind, StatusBit

UNKNOWN = State(id="unknown", name="Unknown", kind="unknown", mask=0, value=0)
Direction = Literal["forward", "reverse"]


@dataclass(frozen=True, slots=True)
class ChartState:
    """What the status words say; a part is None where its word was not read."""

    state: State
    direction: Direction | None = None
    reached: bool | None = None
    alarm: bool | None = None
    local: bool | None = None
    channel: str = ""
    """Who commands the drive, where the chart tells it."""

    @property
    def kind(self) -> StateKind:
        """The kind of the state, the same words on every family."""
        return self.state.kind


def read_chart(profile: Profile, raws: Mapping[str, int]) -> ChartState:
    """The state of a drive, given raw values by code; UNKNOWN where none fits."""
    chart = profile.chart(raws)
    word = raws.get(chart.status) if chart else None
    if chart is None or word is None:
        return ChartState(UNKNOWN)
    return ChartState(
        state=state_of(chart, word),
        direction=_direction(chart.direction, raws),
        reached=_status_bit(chart.reached, raws),
        alarm=_status_bit(chart.alarm, raws),
        local=_status_bit(chart.local, raws),
        channel=_channel(chart.channel, raws),
    )


def state_of(chart: Chart, word: int) -> State:
    """The first state of the chart whose masked value the word has."""
    return next((s for s in chart.states if word & s.mask == s.value), UNKNOWN)


def watched_codes(profile: Profile) -> list[str]:
    """Codes of every word that the charts of a profile look at."""
    codes: list[str] = []
    for chart in profile.data.charts:
        marks = (
            chart.direction,
            chart.reached,
            chart.alarm,
            chart.local,
            chart.channel,
            chart.when,
        )
        codes += [chart.status, *(mark.parameter for mark in marks if mark)]
    return list(dict.fromkeys(codes))


def _direction(mark: DirectionBit | None, raws: Mapping[str, int]) -> Direction | None:
    if mark is None or (word := raws.get(mark.parameter)) is None:
        return None
    return "reverse" if word >> mark.bit & 1 == mark.reverse else "forward"


def _channel(bits: ChannelBits | None, raws: Mapping[str, int]) -> str:
    if bits is None or (word := raws.get(bits.parameter)) is None:
        return ""
    return bits.names.get(str(word >> bits.shift & bits.mask), "")


def _status_bit(mark: StatusBit | None, raws: Mapping[str, int]) -> bool | None:
    if mark is None or (word := raws.get(mark.parameter)) is None:
        return None
    return word >> mark.bit & 1 == mark.value
