"""Wiring facts of a family: warnings, lamps, names of signals, waiting times."""

from typing import Annotated, Literal

from msgspec import Meta

from .base import Confidence, DecimalText, Identifier, Table, about


class FamilyWarning(Table, frozen=True, kw_only=True):
    """A fact that surprises, injures or damages, as a sentence."""

    text: Annotated[str, about("Warning, as a sentence.")]
    source: str = ""
    confidence: Confidence = "manual"


class Opening(Table, frozen=True, kw_only=True):
    """Waiting time with everything switched off, before opening or plugging."""

    minutes: Annotated[
        Annotated[int, Meta(ge=1)] | None,
        about("Absent if no available document states it."),
    ] = None
    below_volts: Annotated[
        Annotated[int, Meta(ge=1)] | None,
        about("Measured DC bus voltage below which the bus is considered discharged."),
    ] = None
    note: str = ""
    source: str = ""
    confidence: Confidence = "manual"


class Lamp(Table, frozen=True, kw_only=True):
    """A lamp or display symbol, and its meaning."""

    name: str
    tells: Annotated[str, about("Meaning of the lamp.")]
    source: str = ""
    confidence: Confidence = "manual"


class SignalName(Table, frozen=True, kw_only=True):
    """A signal of the line and its names in other standards."""

    signal: Annotated[str, about("Name of the signal in this profile.")]
    names: Annotated[dict[str, str], about("Its names by standard.")]


class PortPolarization(Table, frozen=True, kw_only=True):
    """Polarization resistors that the drive itself can have."""

    ohm: Annotated[
        list[int],
        about(
            "Possible resistances to 5 V and to the common, in ohm; 0 is none. The first is usual."
        ),
    ]
    note: str = ""
    source: str = ""


class Wiring(Table, frozen=True, kw_only=True):
    """Facts to know before touching the line or the drive."""

    warnings: Annotated[list[FamilyWarning], about("Facts that surprise, injure or damage.")] = []
    opening: Annotated[Opening | None, about("Waiting time before the drive is opened.")] = None
    signals: Annotated[
        list[SignalName], about("Names of the line's signals in other standards.")
    ] = []
    signals_source: Annotated[str, about("Source of those names.")] = ""
    lamps: Annotated[list[Lamp], about("Lamps and display symbols.")] = []
    port: Annotated[
        PortPolarization | None,
        about("Polarization in the drive; absent if no document states it."),
    ] = None


class LineSchematic(Table, frozen=True, kw_only=True):
    """A schematic of the line, with its limits."""

    id: Identifier
    name: str
    slaves: Annotated[int, about("Most slaves without a repeater.")]
    length_m: Annotated[int, about("Longest line at `length_baud`, in m.")]
    length_baud: Annotated[int, about("Baud rate in bit/s for which the length applies.")]
    tap_m: Annotated[int, about("Longest tap link, in m.")]
    shared_tap_m: Annotated[
        int | None,
        about("Length in m that the tap links of one junction box share, divided by their number."),
    ] = None
    master_ohm: Annotated[
        list[int], about("Least and most polarization at the master, in ohm.")
    ] = []
    station_ohm: Annotated[int, about("Polarization in every station, in ohm; 0 is none.")] = 0
    total_ohm: Annotated[
        list[int],
        about("Least and most of all polarization resistors in parallel, in ohm."),
    ] = []
    best_ohm: Annotated[
        int | None, about("Recommended polarization of the whole line, in ohm.")
    ] = None
    most_polarized: Annotated[
        int | None,
        about("Most stations with 4.7 kohm, if the master has `most_polarized_ohm`."),
    ] = None
    most_polarized_ohm: Annotated[
        int | None,
        about("Polarization at the master in ohm for which that number applies."),
    ] = None
    terminator: Annotated[
        Literal["RC", "R"],
        about("Terminator at both ends: RC is 120 ohm in series with 1 nF, R is 150 ohm."),
    ]
    cable: Annotated[str, about("The cable in words.")]
    drawing: Annotated[str, about("The schematic as text; it is shown unchanged.")] = ""
    source: str = ""
    confidence: Confidence = "manual"


class CablingPart(Table, frozen=True, kw_only=True):
    """A part for the line, by its catalog number."""

    number: Annotated[str, about("Catalog number, with the spaces that its manufacturer prints.")]
    use: Annotated[Literal["box", "terminator", "cable", "other"], about("Its place in the line.")]
    ends: Annotated[
        list[Literal["RJ45", "stripped", "SUB-D"]],
        about("Ends of a cable, connection of a terminator, or sockets of a box for tap links."),
    ] = []
    taps: Annotated[int | None, about("Tap links of a box.")] = None
    meters: Annotated[DecimalText | None, about("Length of a cable, or of the cable of a box.")] = (
        None
    )
    terminator: Annotated[
        Literal["RC", "R"] | None,
        about("Its terminator: RC is 120 ohm with 1 nF, R is 150 ohm."),
    ] = None
    text: Annotated[str, about("Length, ends and what it is for.")]
    source: str = ""
    confidence: Confidence = "manual"


class CablingMaster(Table, frozen=True, kw_only=True):
    """The cable from a kind of master to the line, by the two ways to build a line."""

    name: str
    rj45: Annotated[str, about("Cable to splitter blocks and T-junction boxes for RJ45.")] = ""
    boxes: Annotated[str, about("Cable to junction boxes with screw terminals.")] = ""
    sub_d: Annotated[str, about("Cable to junction boxes with SUB-D sockets.")] = ""
    source: str = ""
    confidence: Confidence = "manual"


class KeypadFunction(Table, frozen=True, kw_only=True):
    """A function of the keypad that has no address on the line."""

    code: Annotated[str, about("Its name on the keypad.")]
    text: Annotated[str, about("Its purpose, values and factory setting.")]
    source: str = ""
    confidence: Confidence = "manual"
