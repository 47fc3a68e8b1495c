"""Effect of a write by a third-party program on a drive. Pure functions of a profile.

A SCADA system knows registers, not their meaning. Each word is classified here as a setting, a
command, or a word that can only stop the motor.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from typing import Literal

from .channel import channel_codes
from .chart import state_of
from .errors import DriveError
from .orders import WAYS_TO_STOP, chart_codes, optional_bits, order_target, with_options
from .profile.profile import Profile, is_verified
from .profile.schema import Chart, Order, Parameter
from .settings.writable import cuts_line, is_order, is_setting, never_set
from .values import check_raw, from_words, is_field, word_count
from .words import unsigned

WRITTEN_SPACES = (3, 1)
"""Functions that read registers and coils: all else is only read."""
ALL = "all"
"""Instead of codes: every setting that may be written without being named."""

StartDirection = Literal["forward", "reverse"]


class WordKind(Enum):
    """Kind of a word's effect."""

    SETTING = "setting"
    COMMAND = "command"
    STOP = "stop"
    UNKNOWN = "unknown"
    """The profile has no such register, or it must not be written."""


@dataclass(frozen=True, slots=True)
class ExternalWord:
    """One word of a write, and the parameters at its address."""

    address: int
    """Its register, or the place of a coil."""
    word: int
    kind: WordKind
    parameters: tuple[Parameter, ...] = ()


@lru_cache(maxsize=32)
def _places(profile: Profile) -> Mapping[int, tuple[Parameter, ...]]:
    """Return the parameters at each place; one of several words or coils is at each of them."""
    places: dict[int, list[Parameter]] = {}
    for parameter in profile.parameters:
        if parameter.function in WRITTEN_SPACES:
            for place in registers_of(parameter):
                places.setdefault(place, []).append(parameter)
    return {address: tuple(found) for address, found in places.items()}


def classify_words(
    profile: Profile, words: Mapping[int, int], raws: Mapping[str, int]
) -> list[ExternalWord]:
    """Return the effect of each word of a write, given raw values that were just read."""
    return [_word(profile, address, words, raws) for address in words]


def _word(
    profile: Profile, address: int, words: Mapping[int, int], raws: Mapping[str, int]
) -> ExternalWord:
    found, word = _places(profile).get(address, ()), words[address]
    if any(
        is_order(profile, parameter) or parameter.code in _ordered(profile) for parameter in found
    ):
        stops = any(only_stops(profile, parameter, words, raws) for parameter in found)
        return ExternalWord(address, word, WordKind.STOP if stops else WordKind.COMMAND, found)
    if found and all(is_setting(profile, parameter) for parameter in found):
        return ExternalWord(address, word, WordKind.SETTING, found)
    return ExternalWord(address, word, WordKind.UNKNOWN, found)


def parameters_at(words: Collection[ExternalWord]) -> list[Parameter]:
    """Return the parameters of several words, without repeats."""
    return list({p.code: p for word in words for p in word.parameters}.values())


def has_reference(profile: Profile, words: Collection[ExternalWord]) -> bool:
    """Return True if a reference is among the words of a write."""
    return any(_is_reference(profile, parameter) for parameter in parameters_at(words))


def _is_reference(profile: Profile, parameter: Parameter) -> bool:
    references = {reference.parameter for reference in profile.data.references}
    own = parameter.code in references
    return own or parameter.quantity in ("command_frequency", "command_speed")


def starts_by(profile: Profile, words: Collection[ExternalWord]) -> StartDirection | None:
    """Return the direction in which words may start the motor; None if they cannot.

    Every command counts, but not a reference: it starts nothing without an enabling command.
    """
    found = [
        word
        for word in words
        if word.kind is WordKind.COMMAND
        and not all(_is_reference(profile, p) for p in word.parameters)
    ]
    back = {
        unsigned(order.words[-1])
        for chart in profile.data.charts
        for order in chart.orders
        if order.id == "reverse"
    }
    if not found:
        return None
    written = {word.address: word.word for word in found}
    bits = {_bits(parameter, written) for word in found for parameter in word.parameters}
    return "reverse" if bits & back else "forward"


def _bits(parameter: Parameter, words: Mapping[int, int]) -> int | None:
    """Return the bits that a write puts into all registers of a parameter; None for a part."""
    own = registers_of(parameter)
    if is_field(parameter) or any(address not in words for address in own):
        return None
    pair = [words[address] for address in own]
    if len(pair) == 1:
        return pair[0]
    if parameter.is_bits:
        return from_words(parameter, pair)
    low, high = pair if parameter.low_word_first else reversed(pair)
    return high << 16 | low


def registers_of(parameter: Parameter) -> range:
    """Return the places of a parameter's registers or coils; a register's is its address."""
    return range(parameter.place, parameter.place + word_count(parameter))


@lru_cache(maxsize=32)
def _ordered(profile: Profile) -> frozenset[str]:
    """Return the codes of words that commands write, including settings that take control."""
    orders = (order for chart in profile.data.charts for order in chart.orders)
    return frozenset(order.parameter for order in orders if order.parameter)


def only_stops(
    profile: Profile, parameter: Parameter, words: Mapping[int, int], raws: Mapping[str, int]
) -> bool:
    """Return True if the bits of a command word stop the motor in every chart and state that may
    be active.

    A stop of one chart runs the motor in another, and half of 32 bits may do anything. So the
    result is False if a value or a word that it depends on is unknown.
    """
    own = {address: words[address] for address in registers_of(parameter) if address in words}
    charts = [
        chart
        for chart in profile.data.charts
        if chart.orders and (chart.when is None or chart.when.holds(raws) is not False)
    ]
    return bool(charts) and all(
        any(_is_stop(profile, chart, order, own, raws) for order in chart.orders)
        for chart in charts
    )


def _is_stop(
    profile: Profile,
    chart: Chart,
    order: Order,
    words: Mapping[int, int],
    raws: Mapping[str, int],
) -> bool:
    if not _may_stop(profile, chart, order, words):
        return False
    if not all(when.holds(raws) for when in order.when):
        return False
    if order.states and state_of(chart, raws).id not in order.states:
        return False
    bits = _bits(order_target(profile, chart, order), words)
    return bits in (unsigned(order.words[0]), *with_options(chart, order, raws))


def _may_stop(profile: Profile, chart: Chart, order: Order, words: Mapping[int, int]) -> bool:
    """Return True if the words carry out a stop, provided its conditions hold."""
    if order.id not in WAYS_TO_STOP or len(order.words) != 1:
        return False
    place = order_target(profile, chart, order)
    word, own = _bits(place, words), unsigned(order.words[0])
    if word is None:
        return False
    optional = optional_bits(chart, place.code) if own else 0
    return word | optional == own | optional


def stop_deciding_codes(profile: Profile, words: Mapping[int, int]) -> list[str]:
    """Return the codes that show if one of these words only stops; none if none can.

    As few as possible, because a stop waits until they are read.
    """
    found = [
        (chart, order)
        for chart in profile.data.charts
        for order in chart.orders
        if _may_stop(profile, chart, order, words)
    ]
    codes = chart_codes(profile) if found else []
    for chart, order in found:
        codes += [when.parameter for when in order.when]
        place = order_target(profile, chart, order)
        if order.states:
            codes += chart.status_codes
        if _bits(place, words) != unsigned(order.words[0]):
            codes.append(place.code)
    return [
        code
        for code in dict.fromkeys(codes)
        if (parameter := profile.get(code)) is not None and parameter.access != "w"
    ]


def setting_refusal(profile: Profile, found: ExternalWord, allowed: Collection[str]) -> str:
    """Return why a setting is not written for a third-party program; empty if it may be.

    `allowed` are codes, or `ALL`. `ALL` excludes settings that select the command source, cut the
    line, or that no document confirms: these must be named.
    """
    for parameter in found.parameters:
        if parameter.forbidden:
            return f"{parameter.code} is never written by Drive Panel: {parameter.forbidden}"
        if parameter.code in allowed:
            continue
        if ALL not in allowed:
            return f"{parameter.code} is not allowed. Use --allow-writes {parameter.code}."
        if parameter.code in _named_only(profile) or not is_verified(parameter):
            return f"`all` does not allow {parameter.code}. Use --allow-writes {parameter.code}."
    return ""


@lru_cache(maxsize=32)
def _named_only(profile: Profile) -> frozenset[str]:
    """Return the settings of command and reference sources, and those that cut communication."""
    cutting = {parameter.code for parameter in profile.parameters if cuts_line(profile, parameter)}
    channels = {
        parameter.code
        for parameter in profile.parameters
        if parameter.quantity in ("command_channel", "reference_channel")
    }
    return frozenset({*cutting, *channels, *channel_codes(profile)})


def half_refusal(parameter: Parameter, words: Mapping[int, int]) -> str:
    """Return why half of a value is not written; empty if all its words were sent."""
    if all(address in words for address in registers_of(parameter)):
        return ""
    if parameter.is_bits:
        return f"{parameter.code} has {parameter.words} coils. Write them in one request."
    return f"{parameter.code} has two words. Write both in one request."


def value_refusal(profile: Profile, parameter: Parameter, words: Mapping[int, int]) -> str:
    """Return why a value is never written, or only half of it was sent; empty if it may be
    written."""
    if why := half_refusal(parameter, words):
        return why
    raw = from_words(parameter, [words[address] for address in registers_of(parameter)])
    if why := never_set(profile, parameter, raw):
        return why
    try:
        check_raw(parameter, raw, profile.names(parameter), None)
    except DriveError as error:
        return str(error)
    return ""
