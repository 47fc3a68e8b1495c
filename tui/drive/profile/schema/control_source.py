"""Commander and reference source of the drive, and the settings that select them."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from .base import Identifier, RawWord, Table


class Setting(Table, frozen=True, kw_only=True):
    """A parameter and its required raw value."""

    parameter: str
    value: RawWord


class Way(Table, frozen=True, kw_only=True):
    """Source of the command or the reference, or the selection between two."""

    sources: Annotated[list[str], Meta(min_length=1, max_length=2)]
    """One source, or two: without the switch and with it."""
    switch: str = ""


class ControlSource(Table, frozen=True, kw_only=True):
    """A configuration of command source and reference source."""

    id: Identifier
    name: str
    command: Way
    reference: Way
    settings: list[Setting]
    """Settings that select it, in write order."""
    note: str = ""
    source: str = ""
