"""Reading a state chart: which state a status word means, and what else its bits say."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from .channel import command_channel, reference_channel
from .profile.profile import Profile
from .profile.schema import ChannelBits, Chart, DirectionBit, State, StateKind, StatusBit

UNKNOWN = State(id="unknown", name="Unknown", kind="unknown", mask=0, value=0)
TOLD_FAULT = State(id="fault", name="Fault", kind="fault", mask=0, value=0)
"""State for a fault word if the chart has none."""
ENABLED_KINDS: frozenset[StateKind] = frozenset({"running", "stopping"})
"""Kinds of state in which the drive may turn its motor."""
Direction = Literal["forward", "reverse"]


@dataclass(frozen=True, slots=True)
class ChartState:
    """State from the status words; a part is None if its word was not read."""

    state: State
    """The state in force: a fault if the fault word shows one, whatever the status word."""
    own: State = UNKNOWN
    """The state by the status word alone."""
    direction: Direction | None = None
    reached: bool | None = None
    alarm: bool | None = None
    local: bool | None = None
    channel: str = ""
    """Commander of the drive, if its words show it."""
    reference: str = ""
    """Source of its reference, if its words show it."""

    @property
    def kind(self) -> StateKind:
        """The kind of the state, the same words on every family."""
        return self.state.kind

    @property
    def motion(self) -> StateKind:
        """The kind for callers that need a motor at rest: a fault word alone stops no motor."""
        return self.own.kind if self.own.kind in ENABLED_KINDS else self.state.kind


def read_chart(profile: Profile, raws: Mapping[str, int]) -> ChartState:
    """The state of a drive, given raw values by code; UNKNOWN where none fits."""
    chart = profile.chart(raws)
    word = raws.get(chart.status) if chart else None
    if chart is None or word is None:
        return ChartState(TOLD_FAULT if fault_number(profile, raws) is not None else UNKNOWN)
    return ChartState(
        state=state_now(profile, chart, raws),
        own=state_of(chart, word),
        direction=_direction(chart.direction, raws),
        reached=_status_bit(chart.reached, raws),
        alarm=_status_bit(chart.alarm, raws),
        local=_status_bit(chart.local, raws),
        channel=_commanded_by(profile, chart, raws),
        reference=found.text if (found := reference_channel(profile, raws)) else "",
    )


def state_of(chart: Chart, word: int) -> State:
    """The first state of the chart whose masked value the word has."""
    return next((s for s in chart.states if word & s.mask == s.value), UNKNOWN)


def state_now(profile: Profile, chart: Chart, raws: Mapping[str, int]) -> State:
    """The state in force in a chart; a fault word goes before the status word.

    UNKNOWN if the status word was not read and there is no fault.
    """
    word = raws.get(chart.status)
    own = state_of(chart, word) if word is not None else UNKNOWN
    if own.kind == "fault" or fault_number(profile, raws) is None:
        return own
    return next((state for state in chart.states if state.kind == "fault"), TOLD_FAULT)


def fault_number(profile: Profile, raws: Mapping[str, int]) -> int | None:
    """The present fault by the fault word; None if it shows none, or keeps the last one."""
    faults = profile.data.faults
    raw = raws.get(faults.parameter)
    return None if faults.shows_last or raw == faults.none else raw


def fault_code(profile: Profile) -> str:
    """The code of the word that alone shows a present fault; empty where none does."""
    faults = profile.data.faults
    return "" if faults.shows_last else faults.parameter


def state_codes(profile: Profile, chart: Chart) -> list[str]:
    """Codes of the words that show the state in a chart."""
    return [code for code in (chart.status, fault_code(profile)) if code]


def watched_codes(profile: Profile) -> list[str]:
    """Codes of every word that the charts of a profile look at, and of a present fault."""
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
    if codes and (code := fault_code(profile)):
        codes.append(code)
    return list(dict.fromkeys(codes))


def _direction(mark: DirectionBit | None, raws: Mapping[str, int]) -> Direction | None:
    if mark is None or (word := raws.get(mark.parameter)) is None:
        return None
    return "reverse" if word >> mark.bit & 1 == mark.reverse else "forward"


def _commanded_by(profile: Profile, chart: Chart, raws: Mapping[str, int]) -> str:
    """Return the commander: by the channels of the profile, else by bits of the chart."""
    found = command_channel(profile, raws)
    return found.text if found is not None else _channel(chart.channel, raws)


def _channel(bits: ChannelBits | None, raws: Mapping[str, int]) -> str:
    if bits is None or (word := raws.get(bits.parameter)) is None:
        return ""
    return bits.names.get(str(word >> bits.shift & bits.mask), "")


def _status_bit(mark: StatusBit | None, raws: Mapping[str, int]) -> bool | None:
    if mark is None or (word := raws.get(mark.parameter)) is None:
        return None
    return word >> mark.bit & 1 == mark.value
