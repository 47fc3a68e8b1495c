"""Wiring facts of a family: warnings, lamps, names of signals, waiting times."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from .base import Confidence, DecimalText, Identifier, Table


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


class PortPolarization(Table, frozen=True, kw_only=True):
    """Polarization resistors that the drive itself can have."""

    ohm: list[int]
    """Possible resistances to 5 V and to the common, in ohm; 0 is none. The first is usual."""
    note: str = ""
    source: str = ""


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
    port: PortPolarization | None = None
    """Polarization in the drive; absent if no document states it."""


class LineSchematic(Table, frozen=True, kw_only=True):
    """A schematic of the line, with its limits."""

    id: Identifier
    name: str
    slaves: int
    """Most slaves without a repeater."""
    length_m: int
    """Longest line at `length_baud`, in m."""
    length_baud: int
    tap_m: int
    """Longest tap link, in m."""
    shared_tap_m: int | None = None
    """Length in m that the tap links of one junction box share, divided by their number."""
    master_ohm: list[int] = []
    """Least and most polarization at the master, in ohm."""
    station_ohm: int = 0
    """Polarization in every station, in ohm; 0 is none."""
    total_ohm: list[int] = []
    """Least and most of all polarization resistors in parallel, in ohm."""
    best_ohm: int | None = None
    """Recommended polarization of the whole line, in ohm."""
    most_polarized: int | None = None
    """Most stations with 4.7 kohm, if the master has `most_polarized_ohm`."""
    most_polarized_ohm: int | None = None
    terminator: Literal["RC", "R"]
    """Terminator at both ends: RC is 120 ohm in series with 1 nF, R is 150 ohm."""
    cable: str
    """The cable in words."""
    drawing: str = ""
    """The schematic as text; it is shown unchanged."""
    source: str = ""
    confidence: Confidence = "manual"


class CablingPart(Table, frozen=True, kw_only=True):
    """A part for the line, by its catalog number."""

    number: str
    """Catalog number, with the spaces that its manufacturer prints."""
    use: Literal["box", "terminator", "cable", "other"]
    """Its place in the line."""
    ends: list[Literal["RJ45", "stripped", "SUB-D"]] = []
    """Ends of a cable, connection of a terminator, or sockets of a box for tap links."""
    taps: int | None = None
    """Tap links of a box."""
    meters: DecimalText | None = None
    """Length of a cable, or of the cable of a box."""
    terminator: Literal["RC", "R"] | None = None
    """Its terminator: RC is 120 ohm with 1 nF, R is 150 ohm."""
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
