"""Checks of a planned line against the limits of the manuals; each finding names its chapter."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

from tui.drive.sentences import all_of, counted

from .plan_file import LinePlan, PlanMaster, PlanStation
from .timing import LOST_CYCLES, RETRIES, LineTimes, StationTimeout

Severity = Literal["error", "warning", "note"]
OWN_RULE = "Drive Panel's own rule"
FAR_FROM_BEST = 0.8
"""Share of the recommended Re, below which another Rp is proposed."""
_CALCULATED = "calculated by the formulas of Drive Panel"


@dataclass(frozen=True, slots=True)
class PlanFinding:
    """A limit that the line does not keep, or a fact that is missing."""

    severity: Severity
    """`error` for a limit that is broken, `note` for a fact to check."""
    subject: str
    text: str
    chapter: str
    """Document and chapter with the limit."""
    addresses: tuple[int, ...] = ()
    """Stations that it concerns."""
    concerns_master: bool = False
    """True if it concerns the master."""


def element_text(item: PlanMaster | PlanStation) -> str:
    """Return the name of an element for texts."""
    if isinstance(item, PlanMaster):
        return item.name or "the master"
    return f"{item.name} ({item.address})" if item.name else f"station {item.address}"


def total_ohm(plan: LinePlan) -> float | None:
    """Return Re, all polarization resistors in parallel, in ohm; None if there is none."""
    known = [ohm for ohm in map(plan.ohm, plan.elements) if ohm]
    return 1 / sum(1 / ohm for ohm in known) if known else None


def best_master_ohm(plan: LinePlan) -> int | None:
    """Return the Rp at the master for the recommended Re; None if the stations give less."""
    best = plan.schematic.best_ohm
    if best is None:
        return None
    rest = 1 / best - sum(1 / ohm for ohm in map(plan.ohm, plan.file.stations) if ohm)
    return int(1 / rest) if rest > 1e-6 else None


def line_length(plan: LinePlan) -> float:
    """Return the known length of the line in m, without tap links."""
    return round(sum(item.cable or 0 for item in plan.elements), 3)


def plan_findings(plan: LinePlan, times: LineTimes) -> list[PlanFinding]:
    """Return all findings, errors first."""
    checks = _Checks(plan)
    found = [
        *checks.stations(),
        *checks.length(),
        *checks.taps(),
        *checks.polarization(),
        *checks.terminators(),
        *checks.addresses(),
        *checks.settings(),
        *_cycle(plan, times),
        *checks.missing(),
    ]
    order = ("error", "warning", "note")
    return sorted(found, key=lambda item: order.index(item.severity))


class _Checks:
    """Checks of one plan by one schematic."""

    def __init__(self, plan: LinePlan) -> None:
        self.plan, self.limits = plan, plan.schematic
        self.profile = plan.limits[0]
        self.chapter = f"{self.profile.name}: {self.limits.source}"

    def _finding(
        self,
        severity: Severity,
        subject: str,
        text: str,
        *items: PlanMaster | PlanStation,
        chapter: str = "",
    ) -> PlanFinding:
        addresses = tuple(item.address for item in items if isinstance(item, PlanStation))
        concerns_master = any(isinstance(item, PlanMaster) for item in items)
        return PlanFinding(
            severity, subject, text, chapter or self.chapter, addresses, concerns_master
        )

    def stations(self) -> Iterator[PlanFinding]:
        """Count the slaves."""
        count, most = len(self.plan.file.stations), self.limits.slaves
        if count > most:
            text = f"{count} slaves, but {most} at most without a repeater. Divide the line."
            yield self._finding("error", "Stations", text)

    def length(self) -> Iterator[PlanFinding]:
        """Compare the length with the limit, which applies at one baud rate."""
        length, limits, baud = line_length(self.plan), self.limits, self.plan.file.baud
        if length > limits.length_m:
            text = (
                f"The line has {length:g} m, but {limits.length_m} m at most at"
                f" {limits.length_baud} bit/s."
            )
            yield self._finding("error", "Length", text)
        elif baud > limits.length_baud and length:
            text = (
                f"The manuals give {limits.length_m} m at {limits.length_baud} bit/s, and no length"
                f" at {baud} bit/s. A faster line must be shorter."
            )
            yield self._finding("warning", "Length", text)

    def taps(self) -> Iterator[PlanFinding]:
        """Compare each tap link with the limit; those of one box share theirs."""
        for place in self.plan.places:
            taps = [item for item in place if isinstance(item, PlanStation)]
            shared = self.limits.shared_tap_m if len(taps) > 1 else None
            most = min(shared / len(taps), self.limits.tap_m) if shared else self.limits.tap_m
            for station in taps:
                if station.stub is None or station.stub <= most:
                    continue
                text = f"The tap link of {element_text(station)} has {station.stub:g} m."
                rule = f"At most {most:.3g} m."
                if shared:
                    rule = f"At most {most:.3g} m: {len(taps)} taps of one box share {shared} m."
                yield self._finding("error", "Tap links", f"{text} {rule}", station)

    def polarization(self) -> Iterator[PlanFinding]:
        """Check Rp at the master, and Re of all resistors in parallel."""
        plan, limits = self.plan, self.limits
        unknown = [s for s in plan.file.stations if plan.ohm(s) is None]
        if unknown:
            text = (
                f"No document states the polarization in {_names(unknown)}. It counts as none."
                " Measure it, and add `polarization` to the plan."
            )
            yield self._finding("warning", "Polarization", text, *unknown, chapter=OWN_RULE)
        if plan.file.master.polarization is None:
            text = "The plan does not state the polarization at the master. It counts as none."
            yield self._finding("warning", "Polarization", text, plan.file.master)
        yield from self._impossible_ports()
        re = total_ohm(plan)
        if re is None:
            yield from self._none()
        elif limits.station_ohm:
            yield from self._in_every_station(limits.station_ohm)
        elif limits.total_ohm:
            yield from self._mixed(re)
        else:
            yield from self._at_master()

    def _impossible_ports(self) -> Iterator[PlanFinding]:
        for station in self.plan.file.stations:
            profile, ohm = self.plan.profile(station), station.polarization
            port = profile.data.wiring.port if profile else None
            if profile and port and ohm is not None and ohm not in port.ohm:
                known = all_of([f"{value} ohm" for value in port.ohm])
                text = (
                    f"The plan has {ohm} ohm in {element_text(station)}, but the manual only"
                    f" {known}."
                )
                chapter = f"{profile.name}: {port.source}"
                yield self._finding("warning", "Polarization", text, station, chapter=chapter)

    def _none(self) -> Iterator[PlanFinding]:
        plan = self.plan
        ends = [{item.terminator for item in plan.places[n]} for n in (0, -1)]
        if all("R" in kinds for kinds in ends) and self.limits.id == "standard":
            text = (
                "No device has a polarization. Both ends have 150 ohm, as is right without it."
                " Limit the number of slaves."
            )
            yield self._finding("warning", "Polarization", text)
            return
        span = " to ".join(str(ohm) for ohm in dict.fromkeys(self.limits.master_ohm))
        text = (
            f"No device has a polarization. Install {span} ohm to each of 5 V and common at the"
            " master."
        )
        yield self._finding("error", "Polarization", text, plan.file.master)

    def _in_every_station(self, wanted: int) -> Iterator[PlanFinding]:
        others = [item for item in self.plan.elements if self.plan.ohm(item) != wanted]
        if others:
            names = all_of([element_text(item) for item in others])
            text = f"{wanted} ohm belong in every station and the master. Without it: {names}."
            yield self._finding("error", "Polarization", text, *others)

    def _mixed(self, re: float) -> Iterator[PlanFinding]:
        plan, limits = self.plan, self.limits
        low, high = limits.total_ohm
        rp, polarized = (
            plan.file.master.polarization,
            [s for s in plan.file.stations if plan.ohm(s)],
        )
        best = best_master_ohm(plan)
        advice = (
            f"Rp = {best} ohm at the master gives the recommended {limits.best_ohm} ohm."
            if best
            else "Install no Rp at the master."
        )
        if not low <= re <= high:
            text = f"All polarization resistors give Re = {re:.0f} ohm, not {low} to {high}."
            text, master = f"{text} {advice}", plan.file.master
            yield self._finding("error", "Polarization", text, master, *polarized)
        elif rp and re < FAR_FROM_BEST * (limits.best_ohm or 0):
            text = f"All polarization resistors give Re = {re:.0f} ohm, which is allowed."
            yield self._finding("note", "Polarization", f"{text} {advice}")
        most, at = limits.most_polarized, limits.most_polarized_ohm
        if most and at and rp and rp <= at and len(polarized) > most:
            text = (
                f"{len(polarized)} stations have a polarization. With {at} ohm at the master,"
                f" {most} at most."
            )
            yield self._finding("error", "Polarization", text, *polarized)

    def _at_master(self) -> Iterator[PlanFinding]:
        ohm = self.plan.file.master.polarization
        low, high = self.limits.master_ohm
        span = " to ".join(str(value) for value in dict.fromkeys((low, high)))
        others = [s for s in self.plan.file.stations if self.plan.ohm(s)]
        if others:
            text = f"The polarization belongs in one place, at the master, not in {_names(others)}."
            yield self._finding("error", "Polarization", text, *others)
        if ohm is not None and not low <= ohm <= high:
            text = f"The master has {ohm} ohm. It needs {span} ohm."
            yield self._finding("error", "Polarization", text, self.plan.file.master)

    def terminators(self) -> Iterator[PlanFinding]:
        """Check the terminators: one of the right kind at each end, and none between."""
        places, wanted = self.plan.places, self.limits.terminator
        # without polarization, 150 ohm belongs at the ends
        right = {wanted} if total_ohm(self.plan) is not None else {wanted, "R"}
        for number, place in enumerate(places):
            fitted = [item for item in place if item.terminator != "none"]
            name = all_of([element_text(item) for item in place])
            if number not in (0, len(places) - 1):
                if fitted:
                    text = f"A terminator at {name} is not at an end of the line. Remove it."
                    yield self._finding("error", "Termination", text, *fitted)
                continue
            if not fitted:
                text = f"The end at {name} has no terminator. Fit {wanted}."
                yield self._finding("error", "Termination", text, *place)
            elif len(fitted) > 1:
                text = f"The end at {name} has {len(fitted)} terminators. Keep one."
                yield self._finding("error", "Termination", text, *fitted)
            elif fitted[0].terminator not in right:
                text = f"The terminator at {name} is {fitted[0].terminator}. Fit {wanted}."
                yield self._finding("error", "Termination", text, *fitted)

    def addresses(self) -> Iterator[PlanFinding]:
        """Find addresses that do not select one drive."""
        for station in self.plan.file.stations:
            profile, digits = self.plan.profile(station), str(station.address)
            if station.address == 0:
                text = f"Address 0 of {station.name or 'a station'} selects every device."
                yield self._finding("error", "Addresses", text, station, chapter=OWN_RULE)
            elif profile and profile.data.addresses.zero_digit_is_group and "0" in digits:
                text = f"{station.address} has a digit 0, so it selects a group of drives."
                chapter = f"{profile.name}: {profile.data.addresses.source}"
                yield self._finding("error", "Addresses", text, station, chapter=chapter)

    def settings(self) -> Iterator[PlanFinding]:
        """Find drives that do not support the baud rate or the format of the line."""
        plant = self.plan.file
        for station in plant.stations:
            if (profile := self.plan.profile(station)) is None:
                continue
            link = profile.data.link
            chapter = f"{profile.name}: {link.source or 'settings of the line'}"
            if link.bauds and plant.baud not in link.bauds:
                rates = all_of([str(baud) for baud in link.bauds])
                text = f"{element_text(station)} has no {plant.baud} bit/s, only {rates}."
                yield self._finding("error", "Settings", text, station, chapter=chapter)
            if link.formats and plant.characters not in link.formats:
                text = f"{element_text(station)} has no {plant.characters}, only"
                text = f"{text} {all_of(link.formats)}."
                yield self._finding("error", "Settings", text, station, chapter=chapter)

    def missing(self) -> Iterator[PlanFinding]:
        """Report lengths that the plan does not state, and limits of another manual."""
        plan = self.plan
        bare = [item for place in plan.places[1:] for item in place[:1] if item.cable is None]
        if bare:
            text = counted(
                len(bare),
                "The plan does not state 1 length of `cable`: the line is longer than calculated.",
                "The plan does not state {count} lengths of `cable`: the line is longer than"
                " calculated.",
            )
            yield self._finding("note", "Length", text, *bare, chapter=OWN_RULE)
        stubs = [s for s in plan.file.stations if s.stub is None]
        if stubs:
            text = f"The plan does not state the tap link (`stub`) of {_names(stubs)}."
            yield self._finding("note", "Tap links", text, *stubs, chapter=OWN_RULE)
        if not plan.profiles:
            text = f"No station has a profile. The limits of the {self.profile.name} are used."
            yield self._finding("note", "Limits", text)
        for profile in plan.without_limits:
            text = (
                f"No manual gives limits of the line for {profile.name}. Those of the"
                f" {self.profile.name} are used."
            )
            sources = [item.source for item in profile.data.schematics[:1]]
            chapter = f"{profile.name}: {sources[0]}" if sources else OWN_RULE
            yield self._finding("note", "Limits", text, chapter=chapter)


def _cycle(plan: LinePlan, times: LineTimes) -> Iterator[PlanFinding]:
    period = plan.file.period
    if period is not None and times.cycle > period:
        text = f"One cycle takes {times.cycle:.3f} s, but the plan requires {period:g} s."
        yield PlanFinding("error", "Cycle time", text, _CALCULATED)
    wait = plan.file.master.timeout
    if wait is not None and wait < times.reply:
        text = f"The master waits {wait:g} s for a reply. Suitable is {times.reply:g} s or more."
        yield PlanFinding("warning", "Timeouts", text, OWN_RULE, concerns_master=True)
    for item in times.timeouts:
        yield from _timeout(plan, item, times)


def _timeout(plan: LinePlan, item: StationTimeout, times: LineTimes) -> Iterator[PlanFinding]:
    station, profile = item.station, plan.profile(item.station)
    rules = profile.data.communication_fault if profile else None
    name, concerned = element_text(station), (station.address,)
    chapter = f"{profile.name}: {rules.source or rules.timeout}" if profile and rules else ""
    wanted, longest = station.timeout, times.longest
    if item.suitable is None:
        wait = plan.file.master.timeout or 0
        advice = "Shorten the cycle."
        saved = (RETRIES + 1) * (wait - times.reply)
        if saved > 0 and LOST_CYCLES * (longest - saved) <= item.high:
            advice = f"Shorten the timeout of the master, {wait:g} s."
        text = (
            f"{item.parameter} of {name} is {item.high:g} s at most, but the line needs"
            f" {item.shortest:g} s. {advice}"
        )
        yield PlanFinding("error", "Timeouts", text, chapter, concerned)
    elif wanted is not None and wanted > item.high:
        text = f"{item.parameter} of {name} is {item.high:g} s at most, not {wanted:g} s."
        yield PlanFinding("error", "Timeouts", text, chapter, concerned)
    elif wanted is not None and wanted < item.low:
        text = (
            f"{item.parameter} of {name} is {item.low:g} s at least, not {wanted:g} s. Set"
            f" {item.suitable:g} s or more."
        )
        yield PlanFinding("error", "Timeouts", text, chapter, concerned)
    elif wanted is not None and wanted < longest:
        text = (
            f"{name} trips after {wanted:g} s ({item.parameter}), but may be polled only every"
            f" {longest:.2f} s if another device does not answer. Set {item.suitable:g} s or more."
        )
        yield PlanFinding("error", "Timeouts", text, chapter, concerned)
    elif wanted is not None and wanted < item.shortest:
        text = (
            f"{name} trips after {wanted:g} s ({item.parameter}) if one more request is lost. Set"
            f" {item.suitable:g} s or more."
        )
        yield PlanFinding("warning", "Timeouts", text, chapter, concerned)


def _names(stations: list[PlanStation]) -> str:
    return all_of([element_text(station) for station in stations])
