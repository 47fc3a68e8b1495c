"""State chart evaluation: the state of a status word, and the meaning of its other bits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from .channel import command_channel, reference_channel
from .profile.profile import Profile
from .profile.schema import ChannelBits, Chart, DirectionBit, State, StateKind, StatusBit

UNKNOWN = State(id="unknown", name="Unknown", kind="unknown", mask=0, value=0)
UNLISTED_FAULT = State(id="fault", name="Fault", kind="fault", mask=0, value=0)
"""State for a fault word if the chart has none."""
ENABLED_KINDS: frozenset[StateKind] = frozenset({"running", "stopping"})
"""Kinds of state in which the drive may turn its motor."""
Direction = Literal["forward", "reverse"]


@dataclass(frozen=True, slots=True)
class ChartState:
    """State from the status words; a part is None if its word was not read."""

    state: State
    """The state; a fault if the fault word shows one, independent of the status word."""
    own: State = UNKNOWN
    """The state according to the status word only."""
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
        """Kind of the state; the same terms for every family."""
        return self.state.kind

    @property
    def motion(self) -> StateKind:
        """Kind for callers that need a motor at standstill: a fault word alone does not show it."""
        return self.own.kind if self.own.kind in ENABLED_KINDS else self.state.kind


def read_chart(profile: Profile, raws: Mapping[str, int]) -> ChartState:
    """Return the state of a drive from raw values by code; UNKNOWN if no state matches."""
    chart = profile.chart(raws)
    word = raws.get(chart.status) if chart else None
    if chart is None or word is None:
        return ChartState(UNLISTED_FAULT if fault_number(profile, raws) is not None else UNKNOWN)
    return ChartState(
        state=state_now(profile, chart, raws),
        own=state_of(chart, raws),
        direction=_direction(chart.direction, raws),
        reached=status_bit(chart.reached, raws),
        alarm=status_bit(chart.alarm, raws),
        local=status_bit(chart.local, raws),
        channel=_commanded_by(profile, chart, raws),
        reference=found.text if (found := reference_channel(profile, raws)) else "",
    )


def state_of(chart: Chart, raws: Mapping[str, int]) -> State:
    """Return the first state of the chart whose words fit, from raw values by code.

    UNKNOWN if none fits, or if a word that decides was not read.
    """
    word = raws.get(chart.status)
    for state in chart.states if word is not None else ():
        if word is not None and word & state.mask == state.value:
            held = [when.holds(raws) for when in state.also]
            if False not in held:
                return state if None not in held else UNKNOWN
    return UNKNOWN


def state_now(profile: Profile, chart: Chart, raws: Mapping[str, int]) -> State:
    """Return the state in a chart; a fault word takes precedence over the status word.

    UNKNOWN if the status word was not read and there is no fault.
    """
    own = state_of(chart, raws)
    if own.kind == "fault" or fault_number(profile, raws) is None:
        return own
    return next((state for state in chart.states if state.kind == "fault"), UNLISTED_FAULT)


def fault_number(profile: Profile, raws: Mapping[str, int]) -> int | None:
    """Return the present fault from the fault word; None if it shows none, or the last one."""
    faults = profile.data.faults
    raw = raws.get(faults.parameter)
    return None if faults.shows_last or raw == faults.none else raw


def fault_code(profile: Profile) -> str:
    """Return the code of the word that shows a present fault; empty if the family has none."""
    faults = profile.data.faults
    return "" if faults.shows_last else faults.parameter


def state_codes(profile: Profile, chart: Chart) -> list[str]:
    """Return the codes of the words that show the state in a chart."""
    return [code for code in (*chart.status_codes, fault_code(profile)) if code]


def watched_codes(profile: Profile) -> list[str]:
    """Return the codes of all words that the charts of a profile use, and of the fault word."""
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
        codes += [*chart.status_codes, *(mark.parameter for mark in marks if mark)]
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


def status_bit(mark: StatusBit | None, raws: Mapping[str, int]) -> bool | None:
    """Return True if a mark of the status holds; None without one, or if its word is unknown."""
    if mark is None or (word := raws.get(mark.parameter)) is None:
        return None
    return word >> mark.bit & 1 == mark.value
