"""Line of a family in the manuals: warnings, lamps, names of signals, waiting times."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta

from .base import Confidence, Table


class FamilyWarning(Table, frozen=True, kw_only=True):
    """Something that surprises, hurts or breaks, as a sentence."""

    text: str
    source: str = ""
    confidence: Confidence = "manual"


class Opening(Table, frozen=True, kw_only=True):
    """Waiting time, everything switched off, before the drive is opened or plugged."""

    minutes: Annotated[int, Meta(ge=1)] | None = None
    """Absent if no available document states it."""
    below_volts: Annotated[int, Meta(ge=1)] | None = None
    """Voltage of the DC bus, measured, below which it counts as discharged."""
    note: str = ""
    source: str = ""
    confidence: Confidence = "manual"


class Lamp(Table, frozen=True, kw_only=True):
    """A lamp or a sign of the display, and its meaning."""

    name: str
    tells: str
    source: str = ""
    confidence: Confidence = "manual"


class SignalName(Table, frozen=True, kw_only=True):
    """A signal of the line and what other standards and makers call it."""

    signal: str
    names: dict[str, str]
    """Its names by standard."""


class Wiring(Table, frozen=True, kw_only=True):
    """Facts that a person must know before touching the line or the drive."""

    warnings: list[FamilyWarning] = []
    """Facts that surprise, injure or damage."""
    opening: Opening | None = None
    """Waiting time before the drive is opened."""
    signals: list[SignalName] = []
    """Names of the line's signals in other standards."""
    signals_source: str = ""
    """Source of those names."""
    lamps: list[Lamp] = []
    """Lamps and signs of the display."""
