"""Parts list of a planned line by catalog number, for one of three ways to build it.

RJ45 has T-junctions or splitters, the others junction boxes with screw terminals or SUB-D sockets.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import ceil

from tui.drive.profile.schema import CablingPart

from .checks import element_text, line_length
from .plan_file import CablingWay, LinePlan, PlanStation

_TAP_ENDS: dict[CablingWay, str] = {"rj45": "RJ45", "boxes": "stripped", "sub_d": "SUB-D"}
"""Ends of the tap links at the boxes, by the way of cabling."""
_TRUNK = ["stripped", "stripped"]
_USUAL_STUB = 1.0
"""Tap link in m if the plan states none."""


@dataclass(frozen=True, slots=True)
class PartRow:
    """A part to order."""

    number: str
    count: int
    text: str
    source: str


@dataclass(frozen=True, slots=True)
class PartsList:
    """The parts of a line, and what the tables of the manuals do not have."""

    rows: list[PartRow]
    remarks: list[str]


def parts_list(plan: LinePlan) -> PartsList:
    """Return the parts of a planned line."""
    return _Chosen(plan).listed()


class _Chosen:
    """Parts chosen for one line."""

    def __init__(self, plan: LinePlan) -> None:
        self.plan, self.known = plan, plan.parts()
        self.counts: Counter[str] = Counter()
        self.remarks: list[str] = []
        self.tap_end = _TAP_ENDS[plan.file.way]

    def listed(self) -> PartsList:
        """Choose the parts of each place, the line and the master."""
        if not self.known:
            return PartsList([], ["The manuals of these devices name no parts for the line."])
        chains = self._places()
        self._trunk(chains)
        self._terminators()
        self._master()
        self._unknown_lengths()
        order = list(self.known)
        rows = [
            PartRow(self.known[n].number, self.counts[n], self.known[n].text, self.known[n].source)
            for n in sorted(self.counts, key=order.index)
        ]
        return PartsList(rows, self.remarks)

    def _unknown_lengths(self) -> None:
        """Name the lengths that the plan does not state."""
        for place in self.plan.places[1:]:
            if place[0].cable is None:
                name = element_text(place[0])
                text = f"The plan does not state the cable before {name}."
                self.remarks.append(f"{text} It is not in this list.")
        for station in self.plan.file.stations:
            if station.stub is None:
                name = element_text(station)
                text = f"The plan does not state the tap link of {name}."
                self.remarks.append(f"{text} It counts as {_USUAL_STUB:g} m.")

    def _find(self, use: str, ends: Sequence[str]) -> Iterator[tuple[str, CablingPart]]:
        """Yield the parts of a use with these ends, shortest first."""
        found = [
            (number, part)
            for number, part in self.known.items()
            if part.use == use and sorted(part.ends) == sorted(ends)
        ]
        yield from sorted(found, key=lambda item: float(item[1].meters or 0))

    def _places(self) -> float:
        """Choose boxes and tap links; return the m of line between T-junctions."""
        chained = 0.0
        for index, place in enumerate(self.plan.places):
            taps = [item for item in place if isinstance(item, PlanStation)]
            if not taps:
                continue
            cables = [p[0].cable or 0.0 for p in self.plan.places[index : index + 2]]
            if self._junction(taps, cables):
                chained += place[0].cable or 0.0
                continue
            self._box(taps)
            for station in taps:
                self._tap_link(station)
        return chained

    def _junction(self, taps: list[PlanStation], cables: list[float]) -> bool:
        """Choose a T-junction for a single station if its cables are short enough."""
        if self.tap_end != "RJ45" or len(taps) > 1 or max(cables) > self._longest_rj45():
            return False
        stub = _USUAL_STUB if taps[0].stub is None else taps[0].stub
        for number, part in self._find("box", ["RJ45"]):
            if part.meters is not None and float(part.meters) >= stub:
                self.counts[number] += 1
                self._rj45(cables[0], f"before {element_text(taps[0])}")
                return True
        return False

    def _longest_rj45(self) -> float:
        cables = self._find("cable", ["RJ45", "RJ45"])
        return max((float(part.meters or 0) for _, part in cables), default=0.0)

    def _rj45(self, meters: float, where: str) -> None:
        if not meters:
            return
        for number, part in self._find("cable", ["RJ45", "RJ45"]):
            if float(part.meters or 0) >= meters:
                self.counts[number] += 1
                return
        self.remarks.append(f"No cable with RJ45 at both ends has {meters:g} m, {where}.")

    def _box(self, taps: list[PlanStation]) -> None:
        boxes = [(n, p) for n, p in self._find("box", [self.tap_end]) if p.meters is None]
        if not boxes:
            names = element_text(taps[0])
            self.remarks.append(f"The manuals name no box with {self.tap_end} taps, at {names}.")
            return
        number, part = boxes[0]
        self.counts[number] += ceil(len(taps) / (part.taps or 1))

    def _tap_link(self, station: PlanStation) -> None:
        stub = _USUAL_STUB if station.stub is None else station.stub
        for number, part in self._find("cable", ["RJ45", self.tap_end]):
            if float(part.meters or 0) >= stub:
                self.counts[number] += 1
                return
        text = f"No cable for the tap link of {element_text(station)} has {stub:g} m."
        self.remarks.append(text)

    def _trunk(self, chained: float) -> None:
        """Choose drums of cable for the rest of the line."""
        drums = [(n, float(p.meters or 0)) for n, p in self._find("cable", _TRUNK)]
        rest = line_length(self.plan) - chained
        if not drums or rest <= 0:
            return
        largest, most = drums[-1]
        whole = int(rest // most)
        rest -= whole * most
        self.counts[largest] += whole
        fitting = next((number for number, meters in drums if meters >= rest), largest)
        self.counts[fitting] += rest > 0
        self.counts += Counter()  # without those of which there are none

    def _terminators(self) -> None:
        """Choose terminators for the ends; junction boxes have one of 120 ohm built in."""
        for place in (self.plan.places[0], self.plan.places[-1]):
            kind = next((item.terminator for item in place if item.terminator != "none"), "none")
            if kind == "none":
                continue
            is_tap = isinstance(place[0], PlanStation)
            box = next(iter(self._find("box", [self.tap_end])), None)
            if is_tap and box and box[1].terminator == kind:
                continue
            end = "RJ45" if is_tap and self.tap_end == "RJ45" else "stripped"
            found = [n for n, p in self._find("terminator", [end]) if p.terminator == kind]
            if found:
                self.counts[found[0]] += 1
            else:
                name = element_text(place[0])
                self.remarks.append(f"The manuals name no terminator {kind} for {name}.")

    def _master(self) -> None:
        kind = self.plan.file.master.kind
        master = self.plan.masters().get(kind)
        if master is None:
            self.remarks.append("The cable to the master follows from its `kind` in the plan.")
            return
        cable = getattr(master, self.plan.file.way)
        if cable:
            self.remarks.append(f"To the master, {kind}: {cable}.")
        else:
            self.remarks.append(f"The manuals name no cable from {kind} to such a line.")
