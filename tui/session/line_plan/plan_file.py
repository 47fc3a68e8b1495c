"""File of a planned line: its form, and reading it with every fault by line and key."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
from msgspec import Meta

from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.profile.converting import converted
from tui.drive.profile.form import form_faults
from tui.drive.profile.person_file import raise_faults, read_person_file
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import CablingMaster, CablingPart, LineSchematic, Table, about
from tui.drive.profile.toml_lines import TomlPath
from tui.drive.sentences import any_of

STATIONS_KEY = "stations"

PlanMeters = Annotated[float, Meta(ge=0, le=10000)]
PlanSeconds = Annotated[float, Meta(ge=0.001, le=3600)]
PlanOhm = Annotated[int, Meta(ge=0, le=1_000_000)]
PlanTerminator = Literal["RC", "R", "none"]
CablingWay = Literal["rj45", "boxes", "sub_d"]


class LineElement(Table, frozen=True, kw_only=True):
    """Fields common to the master and the stations."""

    name: Annotated[str, about("Name in the drawing and the reports.")] = ""
    cable: Annotated[
        PlanMeters | None,
        about("Cable of the line from the element before, in m. The first element has none."),
    ] = None
    polarization: Annotated[
        PlanOhm | None,
        about("Resistor to each of 5 V and common in this device, in ohm; 0 is none."),
    ] = None
    terminator: Annotated[
        PlanTerminator,
        about("Terminator at this place: RC is 120 ohm with 1 nF, R is 150 ohm."),
    ] = "none"
    timeout: Annotated[
        PlanSeconds | None,
        about("Master: its wait for a reply. Station: its communication timeout. In s."),
    ] = None


class PlanMaster(LineElement, frozen=True, kw_only=True):
    """The master of the line."""

    kind: Annotated[
        str,
        Meta(
            description='Kind of master in the tables of the manuals, for its cable: "TSX Micro".'
        ),
    ] = ""
    position: Annotated[
        int,
        Meta(ge=0, le=247),
        about("Number of stations that are before the master on the line."),
    ] = 0


class PlanStation(LineElement, frozen=True, kw_only=True):
    """A drive, or another device, on the line."""

    address: Annotated[int, Meta(ge=0, le=247), about("Its slave address.")]
    profile: Annotated[str, about("Its profile; empty for a device of another kind.")] = ""
    stub: Annotated[PlanMeters | None, about("Tap link from the line to the device, in m.")] = None
    box: Annotated[
        str,
        about("Name of its junction box, if several stations share one. They follow each other."),
    ] = ""
    values: Annotated[
        list[str],
        about("Codes that the master reads in each cycle (default: those that Monitor reads)."),
    ] = []
    words: Annotated[
        Annotated[int, Meta(ge=0, le=123)] | None,
        about("Words read in each cycle from a device without a profile."),
    ] = None
    writes: Annotated[
        int,
        Meta(ge=0, le=123),
        about("Words that the master writes in each cycle, such as command and reference: 2."),
    ] = 0
    turnaround: Annotated[
        PlanSeconds | None,
        about("Time from the end of a request to the reply, in s (default: that of the profile)."),
    ] = None


class PlantFile(Table, frozen=True, kw_only=True):
    """A planned line: its settings, its master and its stations in the order of the cable."""

    format: Annotated[Literal[1], about("Version of this form of file.")]
    name: Annotated[str, about("Name of the line.")] = "Line"
    baud: Annotated[int, Meta(ge=300, le=115200), about("Baud rate in bit/s.")] = 19200
    characters: Annotated[
        str,
        Meta(pattern=r"^8[NEO][12]$"),
        about("Data bits, parity and stop bits."),
    ] = "8E1"
    schematic: Annotated[
        Literal["standard", "uni-telway", "jbus"],
        about("Schematic of the line. Stations with 4.7 kohm make a standard one a mixed one."),
    ] = "standard"
    way: Annotated[
        CablingWay,
        about("Cabling: RJ45 splitters, boxes with screw terminals, or boxes with SUB-D sockets."),
    ] = "rj45"
    period: Annotated[
        PlanSeconds | None, about("Wanted time from one cycle to the next, in s.")
    ] = None
    master: Annotated[PlanMaster, about("The master.")] = PlanMaster()
    stations: Annotated[
        list[PlanStation],
        Meta(min_length=1, max_length=247),
        about("The stations in the order of the cable."),
    ]


class PlantFileError(DriveError):
    """Faults of a plan, one a line, each with file, line and key."""


@dataclass(frozen=True)
class LinePlan:
    """A planned line with the profiles of its stations, by id."""

    file: PlantFile
    profiles: Mapping[str, Profile]

    def profile(self, station: PlanStation) -> Profile | None:
        """Return the profile of a station; None for a device of another kind."""
        return self.profiles.get(station.profile)

    @cached_property
    def elements(self) -> list[PlanMaster | PlanStation]:
        """The master and the stations in the order of the cable."""
        at = self.file.master.position
        return [*self.file.stations[:at], self.file.master, *self.file.stations[at:]]

    @cached_property
    def places(self) -> list[list[PlanMaster | PlanStation]]:
        """The elements by their place on the line: those of one box have one place."""
        places: list[list[PlanMaster | PlanStation]] = []
        for item in self.elements:
            last = places[-1][-1] if places else None
            box = item.box if isinstance(item, PlanStation) else ""
            if box and isinstance(last, PlanStation) and last.box == box:
                places[-1].append(item)
            else:
                places.append([item])
        return places

    @cached_property
    def limits(self) -> tuple[Profile, Mapping[str, LineSchematic]]:
        """The schematics with the limits by id, and the profile of the manual that states them."""
        known = [p for p in self._in_order if p.data.schematics]
        if not any(p.data.schematics[0].confidence == "manual" for p in known):
            others = (library.load(listing.id) for listing in library.listings())
            known += [next(p for p in others if p.data.schematics)]
        stated = [p for p in known if p.data.schematics[0].confidence == "manual"]
        profile = (stated or known)[0]
        return profile, {item.id: item for item in profile.data.schematics}

    @cached_property
    def without_limits(self) -> list[Profile]:
        """Families whose manuals give no limits of the line."""
        return [
            profile
            for profile in self._in_order
            if not profile.data.schematics or profile.data.schematics[0].confidence != "manual"
        ]

    def ohm(self, item: PlanMaster | PlanStation) -> int | None:
        """Return the polarization of an element in ohm; None if neither file nor manual has it."""
        if item.polarization is not None or isinstance(item, PlanMaster):
            return item.polarization
        profile = self.profile(item)
        port = profile.data.wiring.port if profile else None
        return port.ohm[0] if port else None

    @cached_property
    def schematic(self) -> LineSchematic:
        """The schematic that applies: the standard one is mixed with stations of 4.7 kohm."""
        mixed = self.file.schematic == "standard" and any(map(self.ohm, self.file.stations))
        return self.limits[1]["mixed" if mixed else self.file.schematic]

    def parts(self) -> dict[str, CablingPart]:
        """Return the parts that the manuals of the stations name, by catalog number."""
        return {
            part.number.replace(" ", ""): part
            for profile in self._in_order
            for part in profile.data.parts
        }

    def masters(self) -> dict[str, CablingMaster]:
        """Return the kinds of masters that the manuals of the stations name."""
        return {item.name: item for p in self._in_order for item in p.data.masters}

    @property
    def _in_order(self) -> list[Profile]:
        found = map(self.profile, self.file.stations)
        return list({profile.id: profile for profile in found if profile}.values())


def read_plant(path: Path) -> LinePlan:
    """Read and check the file of a planned line. Raises PlantFileError with all faults."""
    text, tables = read_person_file(path, PlantFileError)
    found, _ = form_faults(tables, PlantFile)
    faults: list[tuple[TomlPath, str]] = list(found.found)
    plan = None if faults else _plan(converted(tables, PlantFile), faults)
    if plan is None or faults:
        raise_faults(path, text, faults, {STATIONS_KEY: "station"}, PlantFileError)
    return plan


def _plan(plant: PlantFile, faults: list[tuple[TomlPath, str]]) -> LinePlan:
    plan = LinePlan(plant, dict(_profiles(plant, faults)))
    faults += _faults(plan)
    return plan


def _profiles(
    plant: PlantFile, faults: list[tuple[TomlPath, str]]
) -> Iterator[tuple[str, Profile]]:
    for index, station in enumerate(plant.stations):
        if not station.profile:
            continue
        try:
            yield station.profile, library.load(station.profile)
        except DriveError as error:
            faults.append(((STATIONS_KEY, index, "profile"), str(error).rstrip(".")))


def _faults(plan: LinePlan) -> Iterator[tuple[TomlPath, str]]:
    plant = plan.file
    if plant.master.position > len(plant.stations):
        text = f"the line has {len(plant.stations)} stations, not {plant.master.position}"
        yield ("master", "position"), text
    known = plan.masters()
    if plant.master.kind and plant.master.kind not in known:
        allowed = any_of([repr(name) for name in known])
        text = f"{plant.master.kind!r} is not a kind of master. Allowed: {allowed}"
        yield ("master", "kind"), text
    first = plan.elements[0]
    addresses: dict[int, int] = {}
    boxes: dict[str, int] = {}
    for index, station in enumerate(plant.stations):
        at: TomlPath = (STATIONS_KEY, index)
        if (other := addresses.setdefault(station.address, index)) != index:
            yield (*at, "address"), f"{station.address} is also the address of station {other + 1}"
        if station is first and station.cable:
            yield (*at, "cable"), "the first element of the line has no cable before it"
        yield from (((*at, key), fault) for key, fault in _station_faults(plan, station))
        if station.box:
            last = boxes.setdefault(station.box, index)
            between = plant.master.position == index and last != index
            if index - last > 1 or between:
                text = f"the stations of box {station.box!r} must follow each other"
                yield (*at, "box"), text
            elif last != index and station.cable:
                yield (
                    (*at, "cable"),
                    f"it is at box {station.box!r}: only its first station has one",
                )
            boxes[station.box] = index
    if first is plant.master and plant.master.cable:
        yield ("master", "cable"), "the first element of the line has no cable before it"


def _station_faults(plan: LinePlan, station: PlanStation) -> Iterator[tuple[str, str]]:
    profile = plan.profile(station)
    if profile is None:
        if station.values and not station.profile:
            yield "values", "codes need a `profile`. Use `words` for another device"
        return
    if station.words is not None:
        yield "words", "this station has a profile: name its `values`"
    for code in station.values:
        parameter = profile.get(code)
        if parameter is None or parameter.access == "w":
            yield "values", f"{code!r} is not a parameter of {profile.name} that can be read"
    addresses = profile.data.addresses
    if not addresses.first <= station.address <= addresses.last:
        span = f"{addresses.first} to {addresses.last}"
        yield "address", f"{profile.name} has addresses {span}, not {station.address}"


def plant_schema() -> str:
    """Return the JSON Schema of the file for editors, made from its tables."""
    forms = [PlantFile, PlanMaster, PlanStation]
    _, parts = msgspec.json.schema_components(forms, ref_template="#/$defs/{name}")
    whole: dict[str, Any] = parts.pop(PlantFile.__name__)
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema"}
    return json.dumps({**head, **whole, "$defs": parts}, indent=2) + "\n"
