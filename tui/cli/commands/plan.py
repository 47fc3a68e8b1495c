"""`drivepanel plan`: a line on paper, checked against the limits of the manuals."""

from __future__ import annotations

import math
from pathlib import Path
from shutil import get_terminal_size
from typing import TYPE_CHECKING, Annotated, Literal

import click
from msgspec import Meta

from tui.drive.plain import plain
from tui.drive.sentences import counted

from ..documents.document import Document, DocumentPart
from ..shared.errors import DIFFERENT, USAGE, Failure
from ..shared.options import json_option
from ..shared.registration import command
from ..shared.say import say
from ..shared.sets import write_down
from ..shared.standard_streams import STANDARD, given_file

if TYPE_CHECKING:
    from tui.session.line_plan.checks import PlanFinding
    from tui.session.line_plan.parts import PartsList
    from tui.session.line_plan.plan_file import LinePlan
    from tui.session.line_plan.timing import LineTimes


class PlanFindingField(DocumentPart):
    """A limit that the line does not keep, or a fact that is missing."""

    severity: Literal["error", "warning", "note"]
    subject: str
    text: str
    chapter: str
    stations: Annotated[list[int], Meta(description="Addresses of the stations concerned.")]


class PlanStationField(DocumentPart):
    """A station with its time in each cycle, in seconds."""

    address: int
    name: str
    profile: str | None
    requests: int
    words: int
    seconds: float
    singly: Annotated[float, Meta(description="With one request for each value.")]


class PlanTimeoutField(DocumentPart):
    """The communication timeout of a station, in seconds."""

    address: int
    parameter: str
    suitable: Annotated[float | None, Meta(description="Null if it cannot be set so long.")]
    highest: float | None


class PlanPartField(DocumentPart):
    """A part to order."""

    number: str
    count: int
    text: str
    source: str


class PlanDocument(Document, kw_only=True):
    """`plan`: a planned line, its times and parts, and what is wrong with it."""

    command: Literal["plan"] = "plan"
    name: str
    file: str
    keeps_limits: bool
    schematic: str
    chapter: str
    length: Annotated[float, Meta(description="Known length without tap links, in m.")]
    slaves: int
    polarization: Annotated[float | None, Meta(description="Re in ohm; null if there is none.")]
    best_master: Annotated[int | None, Meta(description="Rp for the recommended Re, in ohm.")]
    cycle: Annotated[float, Meta(description="Seconds of one cycle.")]
    cycle_singly: float
    cycle_by_baud: dict[str, float]
    longest_pause: float
    reply_timeout: float
    stations: list[PlanStationField]
    timeouts: list[PlanTimeoutField]
    parts: list[PlanPartField]
    remarks: list[str]
    findings: list[PlanFindingField]
    diagram: list[str]


class PlanBegunDocument(Document, kw_only=True):
    """`plan --from-scan`: the file that was written."""

    command: Literal["plan"] = "plan"
    file: str


@command("Check a planned line: wiring, times and parts.", group="Set up", statuses=(DIFFERENT,))
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--svg",
    type=click.Path(path_type=Path),
    metavar="SVG",
    help="Write the diagram to this file.",
)
@click.option(
    "--from-scan",
    "scan",
    type=click.Path(path_type=Path),
    metavar="JSON",
    help="Begin FILE from the output of scan --json.",
)
@json_option
def plan(file: Path, svg: Path | None, scan: Path | None, as_json: bool) -> None:
    """Check the line that FILE describes, before it is built. Nothing is sent.

    It compares stations, lengths, tap links, polarization and terminators with the limits of the
    manuals. It prints a diagram, the cycle time, suitable timeouts and the parts to order. Ends
    with 1 if the line does not keep a limit. Each file may be -, standard input or output.
    """
    if scan is not None:
        if svg is not None:
            raise click.UsageError("--svg is for a plan: leave out --from-scan.")
        _begin(given_file(scan), file, as_json)
        return
    found = PlanResult.of(given_file(file))
    if svg is not None:
        from tui.session.line_plan.drawing import diagram_svg

        if svg == STANDARD and as_json:
            raise click.UsageError("Either --svg - or --json: both write to standard output.")
        write_down(svg, diagram_svg(found.plan, found.findings), force=True)
    if as_json:
        from ..shared.output import print_json

        print_json(found.document(str(file)))
    elif svg != STANDARD:
        for line in found.lines():
            say(line)
    if found.errors:
        raise click.exceptions.Exit(DIFFERENT)


def _begin(scan: Path, file: Path, as_json: bool) -> None:
    """Write a first plan from a scan; never over a file."""
    from tui.session.line_plan.from_scan import NotAScan, plant_of_scan

    from ..shared.output import print_json

    try:
        text = plant_of_scan(scan)
    except NotAScan as error:
        raise Failure(str(error), USAGE) from error
    write_down(file, text)
    if file == STANDARD:
        return
    if as_json:
        print_json(PlanBegunDocument(file=str(file)))
    else:
        say(f"Wrote {file}. Put its stations in the order of the cable, and add the lengths.")


class PlanResult:
    """A plan with its times, parts and findings."""

    def __init__(
        self, plan: LinePlan, times: LineTimes, parts: PartsList, findings: list[PlanFinding]
    ) -> None:
        self.plan, self.times, self.parts, self.findings = plan, times, parts, findings
        self.errors = [item for item in findings if item.severity == "error"]

    @classmethod
    def of(cls, path: Path) -> PlanResult:
        """Read a plan and check it. Raises Failure with status 2 for a bad file."""
        from tui.session.line_plan.checks import plan_findings
        from tui.session.line_plan.parts import parts_list
        from tui.session.line_plan.plan_file import PlantFileError, read_plant
        from tui.session.line_plan.timing import line_times

        try:
            read = read_plant(path)
        except PlantFileError as error:
            raise Failure(str(error), USAGE) from error
        times = line_times(read)
        return cls(read, times, parts_list(read), plan_findings(read, times))

    def lines(self) -> list[str]:
        """Return the result for a person."""
        from tui.session.line_plan.drawing import diagram_text

        diagram = diagram_text(self.plan, self.findings)
        parts = [
            text
            for row in self.parts.rows
            for text in _wrapped(f"  {row.count:>3} x {row.number:<15} ", row.text)
        ]
        remarks = [text for remark in self.parts.remarks for text in _wrapped("  ", remark)]
        blocks = (
            self._head(),
            diagram,
            ["Checks", *self._check_lines()],
            ["Cycle time", *self._cycle_lines()],
            ["Timeouts", *self._timeout_lines()],
            ["Parts to order", *parts, *remarks],
        )
        return [line for block in blocks for line in (*block, "")][:-1]

    def _head(self) -> list[str]:
        from tui.session.line_plan.checks import best_master_ohm, line_length, total_ohm

        plant, limits = self.plan.file, self.plan.schematic
        re, rp = total_ohm(self.plan), best_master_ohm(self.plan)
        text = f"Re = {re:.0f} ohm" if re else "none"
        best = [f"  Recommended   Rp = {rp} ohm at the master, Re = {limits.best_ohm} ohm"]
        slaves = len(plant.stations)
        return [
            plant.name,
            f"  Schematic     {limits.name}, {plant.baud} bit/s, {plant.characters}",
            f"  Slaves        {slaves} of {limits.slaves}",
            f"  Length        {line_length(self.plan):g} m of {limits.length_m} m, plus tap links",
            f"  Polarization  {text}",
            *(best if rp else []),
        ]

    def _check_lines(self) -> list[str]:
        if not self.findings:
            return ["  The line keeps the limits of the manuals."]
        found = [
            text
            for item in self.findings
            for text in _wrapped(f"  {item.severity.upper():<7} ", f"{item.text} [{item.chapter}]")
        ]
        if self.errors:
            text = counted(len(self.errors), "1 limit is broken.", "{count} limits are broken.")
            return [*found, f"  {text}"]
        return [*found, "  The line keeps the limits of the manuals."]

    def _cycle_lines(self) -> list[str]:
        from tui.session.line_plan.drawing import short_name

        times = self.times
        rows = [
            f"  {item.station.address:>3}  requests {item.requests:>2}  words {item.words:>3}"
            f"  {item.seconds * 1000:>6.1f} ms  {short_name(item.station)}".rstrip()
            for item in times.stations
        ]
        bauds = ", ".join(f"{baud}: {s:.3f} s" for baud, s in times.by_baud.items())
        return [
            *rows,
            f"  One cycle takes {times.cycle:.3f} s. With one request for each value it takes"
            f" {times.singly:.3f} s.",
            *([f"  By baud rate: {bauds}."] if bauds else []),
        ]

    def _timeout_lines(self) -> list[str]:
        from tui.session.line_plan.drawing import short_name

        times = self.times
        rows = [
            f"  {item.station.address:>3}  {item.parameter:<6} {_seconds(item.suitable)}"
            f"  {short_name(item.station)}".rstrip()
            for item in times.timeouts
        ]
        return [
            f"  The master waits {times.reply:g} s for a reply, and repeats a request twice.",
            f"  The longest pause in polling is {times.longest:.2f} s, while one device does not"
            " answer.",
            *(
                ["  Suitable communication timeouts, which outlast two such pauses:"]
                if rows
                else []
            ),
            *rows,
        ]

    def document(self, file: str) -> PlanDocument:
        """Return the result for programs."""
        from tui.session.line_plan.checks import best_master_ohm, line_length, total_ohm
        from tui.session.line_plan.drawing import diagram_text

        plan, times = self.plan, self.times
        return PlanDocument(
            name=plan.file.name,
            file=file,
            keeps_limits=not self.errors,
            schematic=plan.schematic.id,
            chapter=f"{plan.limits[0].name}: {plan.schematic.source}",
            length=line_length(plan),
            slaves=len(plan.file.stations),
            polarization=total_ohm(plan),
            best_master=best_master_ohm(plan),
            cycle=times.cycle,
            cycle_singly=times.singly,
            cycle_by_baud={str(baud): seconds for baud, seconds in times.by_baud.items()},
            longest_pause=times.longest,
            reply_timeout=times.reply,
            stations=[
                PlanStationField(
                    address=item.station.address,
                    name=item.station.name,
                    profile=item.station.profile or None,
                    requests=item.requests,
                    words=item.words,
                    seconds=item.seconds,
                    singly=item.singly,
                )
                for item in times.stations
            ],
            timeouts=[
                PlanTimeoutField(
                    address=item.station.address,
                    parameter=item.parameter,
                    suitable=item.suitable,
                    highest=item.high if math.isfinite(item.high) else None,
                )
                for item in times.timeouts
            ],
            parts=[
                PlanPartField(number=r.number, count=r.count, text=r.text, source=r.source)
                for r in self.parts.rows
            ],
            remarks=self.parts.remarks,
            findings=[
                PlanFindingField(
                    severity=item.severity,
                    subject=item.subject,
                    text=item.text,
                    chapter=item.chapter,
                    stations=list(item.addresses),
                )
                for item in self.findings
            ],
            diagram=diagram_text(plan, self.findings),
        )


def _wrapped(head: str, text: str) -> list[str]:
    """Return a text in lines of the terminal's width, below its head."""
    import textwrap

    width = max(60, min(100, get_terminal_size().columns))
    return textwrap.wrap(plain(text), width, initial_indent=head, subsequent_indent=" " * len(head))


def _seconds(value: float | None) -> str:
    return "  too long" if value is None else f"{value:>6g} s"
