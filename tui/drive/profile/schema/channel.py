"""Words that show the active command and reference channels."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from .base import Confidence, Table, When, WordAddress


class ChannelRow(Table, frozen=True, kw_only=True):
    """A word that shows the active channel, if its conditions hold."""

    parameter: str
    when: list[When] = []
    """Conditions for the row; all must hold."""
    mask: WordAddress = 0xFFFF
    """Bits that show the channel, before the shift."""
    shift: Annotated[int, Meta(ge=0, le=15)] = 0
    line: list[int] = []
    """Values, after mask and shift, that mean this line."""
    names: dict[str, str] = {}
    """Names of the values; empty: names of the parameter or its bits."""


class ChannelSwitch(Table, frozen=True, kw_only=True):
    """A parameter that can switch channels while the drive runs."""

    parameter: str
    fixed: list[int]
    """Raw values for which nothing is switched."""
    when: list[When] = []
    """Conditions for switching; all must hold."""
    does: str
    """Further effect; a clause that follows the parameter's name and value."""


class Channels(Table, frozen=True, kw_only=True):
    """Command and reference channels; the first row that applies is used."""

    command: list[ChannelRow] = []
    """Words that show the command channel."""
    reference: list[ChannelRow] = []
    """Words that show the reference channel."""
    switches: list[ChannelSwitch] = []
    """Parameters that can switch channels."""
    remedy: str = ""
    """Setting that gives command to Modbus, as a sentence."""
    source: str = ""
    confidence: Confidence = "manual"
