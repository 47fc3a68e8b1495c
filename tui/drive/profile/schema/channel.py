"""Words that show who commands the drive and what gives its reference now."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from .base import Confidence, Table, When, WordAddress


class ChannelRow(Table, frozen=True, kw_only=True):
    """A word that shows the channel in force, if its conditions hold."""

    parameter: str
    when: list[When] = []
    """Conditions under which the row counts; all must hold."""
    mask: WordAddress = 0xFFFF
    """Bits that show it, before the shift."""
    shift: Annotated[int, Meta(ge=0, le=15)] = 0
    line: list[int] = []
    """Values, behind mask and shift, with which the channel is this line."""
    names: dict[str, str] = {}
    """Names of the values; those of the parameter, or of its bits, where empty."""


class ChannelSwitch(Table, frozen=True, kw_only=True):
    """A parameter by which another channel can come into force while the drive runs."""

    parameter: str
    fixed: list[int]
    """Raw values with which nothing is switched."""
    when: list[When] = []
    """Conditions under which it switches; all must hold."""
    does: str
    """Further effect, after its name and value."""


class Channels(Table, frozen=True, kw_only=True):
    """Channels that command and give the reference; of several rows the first that applies
    counts."""

    command: list[ChannelRow] = []
    """Words that show who commands."""
    reference: list[ChannelRow] = []
    """Words that show what gives the reference."""
    switches: list[ChannelSwitch] = []
    """Parameters by which another channel can come into force."""
    remedy: str = ""
    """Setting that lets the line command the drive, as a sentence."""
    source: str = ""
    confidence: Confidence = "manual"
