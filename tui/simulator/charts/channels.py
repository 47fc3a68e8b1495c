"""Which channel commands an Altivar 31, 312 or 71 and which gives its reference; pure functions.

Sources: ATV71 Modbus manual, configuration, and communication parameters list (CHCF, FR1, FR1B,
FR2, RCB, RFC, CD1, CD2, CCS, COP, FLO, FLOC, CCC, CRC, LRS3, LRS7); ATV312 communication
variables, command and reference channels.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import Enum

SEPARATE, IO_PROFILE = 2, 3
CHANNEL_2, CHANNEL_2_TOO, CHANNEL_1B, ALWAYS = 97, 99, 100, 128
FIRST_INPUT, INPUTS = 129, 14
FIRST_COMMAND_BIT, FIRST_LINE_BIT, COMMAND_BITS = 160, 176, 16
AI_1, FACTORY_COMMAND_2 = 1, 10
COPIES_REFERENCE, COPIES_COMMAND = (1, 3), (2, 3)


class ChannelPlace(Enum):
    """Source of a command or a reference; the value is its bit in CCC and CRC."""

    TERMINALS = 0
    KEYPAD = 1
    DISPLAY = 2
    LINE = 3
    CANOPEN = 6
    CARD = 9
    INSIDE = 10
    NOWHERE = 16

    @property
    def network(self) -> bool:
        """True if it is a network, Modbus or another."""
        return self in (
            ChannelPlace.LINE,
            ChannelPlace.CANOPEN,
            ChannelPlace.CARD,
            ChannelPlace.INSIDE,
        )


REFERENCE_PLACES: Mapping[int, ChannelPlace] = {
    **dict.fromkeys((1, 2, 3, 4, 160, 181, 182), ChannelPlace.TERMINALS),
    **dict.fromkeys((16, 161), ChannelPlace.KEYPAD),
    163: ChannelPlace.DISPLAY,
    164: ChannelPlace.LINE,
    167: ChannelPlace.CANOPEN,
    169: ChannelPlace.CARD,
    170: ChannelPlace.INSIDE,
}
COMMAND_PLACES: Mapping[int, ChannelPlace] = {
    1: ChannelPlace.TERMINALS,
    2: ChannelPlace.KEYPAD,
    3: ChannelPlace.DISPLAY,
    10: ChannelPlace.LINE,
    20: ChannelPlace.CANOPEN,
    30: ChannelPlace.CARD,
    31: ChannelPlace.INSIDE,
}

ReadSetting = Callable[[str, int], int]
Active = Callable[[int], bool]


@dataclass(frozen=True, slots=True)
class ChannelsInForce:
    """The channels in force."""

    command: ChannelPlace
    reference: ChannelPlace
    input: int = AI_1
    """Raw value of the reference channel: 1 for AI1, 2 for AI2 and so on."""
    command_2: bool = False
    reference_2: bool = False
    reference_1b: bool = False
    local: bool = False
    """True if local control is forced by an input."""


def switch_is_on(raw: int, closed: Callable[[str], bool], word: int) -> bool:
    """Return True if an assignment holds: an input, or a bit of the command word that the line
    wrote."""
    if raw in (CHANNEL_2, CHANNEL_2_TOO, CHANNEL_1B, ALWAYS):
        return True
    if FIRST_INPUT <= raw < FIRST_INPUT + INPUTS:
        return closed(f"LI{raw - FIRST_INPUT + 1}")
    for first in (FIRST_COMMAND_BIT, FIRST_LINE_BIT):
        if first <= raw < first + COMMAND_BITS:
            return bool(word >> (raw - first) & 1)
    return False


def channels_in_force(setting: ReadSetting, active: Active) -> ChannelsInForce:
    """Return the channels selected by the settings, with the present switches."""
    second = active(setting("RFC", 96))
    first_b = not second and setting("FR1B", 0) != 0 and active(setting("RCB", 96))
    own = setting("FR1", AI_1)
    raw = setting("FR2", 0) if second else setting("FR1B", 0) if first_b else own
    if setting("CHCF", 1) < SEPARATE:
        command_2 = second
        command = REFERENCE_PLACES.get(raw if second else own, ChannelPlace.NOWHERE)
    else:
        command_2 = active(setting("CCS", 98))
        given = setting("CD2", FACTORY_COMMAND_2) if command_2 else setting("CD1", 1)
        command = COMMAND_PLACES.get(given, ChannelPlace.NOWHERE)
    reference = REFERENCE_PLACES.get(raw, ChannelPlace.NOWHERE)
    forced = setting("FLO", 0)
    if forced and active(forced):
        raw = setting("FLOC", AI_1)
        reference = REFERENCE_PLACES.get(raw, ChannelPlace.NOWHERE)
        command = (
            ChannelPlace.DISPLAY if reference is ChannelPlace.DISPLAY else ChannelPlace.TERMINALS
        )
        return ChannelsInForce(command, reference, raw, command_2, second, first_b, local=True)
    return ChannelsInForce(command, reference, raw, command_2, second, first_b)


def channel_bit(place: ChannelPlace) -> int:
    """Return a source as CCC and CRC show it; the keypad has no bit of its own."""
    return 1 << place.value if place not in (ChannelPlace.NOWHERE, ChannelPlace.KEYPAD) else 0


def extended_status_bits(place: ChannelPlace) -> tuple[bool, bool]:
    """Return bits 13 and 14 of ETI: the source of commands."""
    if place in (ChannelPlace.TERMINALS, ChannelPlace.KEYPAD, ChannelPlace.NOWHERE):
        return False, False
    if place is ChannelPlace.DISPLAY:
        return True, False
    return place is not ChannelPlace.LINE, True


def channel_marks(channels: ChannelsInForce, *, second_ramp: bool) -> tuple[int, int]:
    """Return LRS3 and LRS7, as far as they show the channels and the ramp."""
    second = (channels.reference_2, channels.command_2, second_ramp)
    each = (
        not channels.reference_2,
        channels.reference_2,
        not channels.command_2,
        channels.command_2,
        channels.reference_1b,
    )
    return _bits(second), _bits(each)


def _bits(marks: tuple[bool, ...]) -> int:
    return sum(1 << bit for bit, holds in enumerate(marks) if holds)
