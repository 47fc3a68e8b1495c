"""Present and previous channels of one Altivar 31, 312 or 71."""

from __future__ import annotations

from ..body import Body
from ..rules import MODBUS_COMMAND, MODBUS_REFERENCE
from .channels import ChannelPlace, ChannelsInForce, channels_in_force, switch_is_on

COMMISSIONED = {"FR1": MODBUS_REFERENCE, "CD1": MODBUS_COMMAND}
"""Channels of a drive whose profile has no words that select them."""
FULL_ACCESS = 2


class DrivecomChannels:
    """Reads settings, inputs and command bits, and shows which channels are in force."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self.line_spoke = False
        """True after a first command of the line; below access level L3 the line then commands."""
        self.now = ChannelsInForce(ChannelPlace.LINE, ChannelPlace.LINE)

    def power_up(self) -> None:
        """Start without a command of the line."""
        self.line_spoke = False
        self.now = self._look()

    def follow(self) -> tuple[ChannelsInForce, ChannelsInForce]:
        """Update the channels; return the previous and the present ones."""
        before, self.now = self.now, self._look()
        return before, self.now

    def is_on(self, raw: int) -> bool:
        """Return True if an assignment to an input or a command bit holds."""
        word = self._body.raw("command_word") & 0xFFFF
        return switch_is_on(raw, self._body.terminals.closed, word)

    def _look(self) -> ChannelsInForce:
        channels = channels_in_force(self._setting, self.is_on)
        if self.low_access and not channels.local:
            place = ChannelPlace.LINE if self.line_spoke else ChannelPlace.TERMINALS
            return ChannelsInForce(place, place)
        return channels

    def _setting(self, code: str, default: int) -> int:
        return self._body.setting(code, COMMISSIONED.get(code, default))

    @property
    def low_access(self) -> bool:
        """True if LAC is below L3: the drive enables itself (ATV31/312)."""
        levels = self._body.traits.access_levels
        return levels and self._body.setting("LAC", FULL_ACCESS) < FULL_ACCESS
