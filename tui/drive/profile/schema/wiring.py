"""Wiring facts of a family: warnings, lamps, names of signals, waiting times."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from .base import Confidence, Table


class FamilyWarning(Table, frozen=True, kw_only=True):
    """A fact that surprises, injures or damages, as a sentence."""

    text: str
    source: str = ""
    confidence: Confidence = "manual"


class Opening(Table, frozen=True, kw_only=True):
    """Waiting time with everything switched off, before opening or plugging."""

    minutes: Annotated[int, Meta(ge=1)] | None = None
    """Absent if no available document states it."""
    below_volts: Annotated[int, Meta(ge=1)] | None = None
    """Measured DC bus voltage below which the bus is considered discharged."""
    note: str = ""
    source: str = ""
    confidence: Confidence = "manual"


class Lamp(Table, frozen=True, kw_only=True):
    """A lamp or display symbol, and its meaning."""

    name: str
    tells: str
    source: str = ""
    confidence: Confidence = "manual"


class SignalName(Table, frozen=True, kw_only=True):
    """A signal of the line and its names in other standards."""

    signal: str
    names: dict[str, str]
    """Its names by standard."""


class Wiring(Table, frozen=True, kw_only=True):
    """Facts to know before touching the line or the drive."""

    warnings: list[FamilyWarning] = []
    """Facts that surprise, injure or damage."""
    opening: Opening | None = None
    """Waiting time before the drive is opened."""
    signals: list[SignalName] = []
    """Names of the line's signals in other standards."""
    signals_source: str = ""
    """Source of those names."""
    lamps: list[Lamp] = []
    """Lamps and display symbols."""


class CablingPart(Table, frozen=True, kw_only=True):
    """A part for the line, by its catalog number."""

    number: str
    """Catalog number, with the spaces that its manufacturer prints."""
    use: Literal["box", "terminator", "cable", "other"]
    """Its place in the line."""
    text: str
    """Length, ends and what it is for."""
    source: str = ""
    confidence: Confidence = "manual"


class CablingMaster(Table, frozen=True, kw_only=True):
    """The cable from a kind of master to the line, by the two ways to build a line."""

    name: str
    rj45: str = ""
    """Cable to splitter blocks and T-junction boxes for RJ45."""
    boxes: str = ""
    """Cable to junction boxes with screw terminals."""
    sub_d: str = ""
    """Cable to junction boxes with SUB-D sockets."""
    source: str = ""
    confidence: Confidence = "manual"


class KeypadFunction(Table, frozen=True, kw_only=True):
    """A function of the keypad that has no address on the line."""

    code: str
    """Its name on the keypad."""
    text: str
    """Its purpose, values and factory setting."""
    source: str = ""
    confidence: Confidence = "manual"
