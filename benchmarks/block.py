"""Cycle time of Monitor with and without an indirect block or scanner, on a real-time line.

    python -m benchmarks.block [--bauds 9600,19200] [--seconds S]

The same drive, the same values: first with every slot unused, then with slots that are mapped to
some of them. Times of cycles are taken between snapshots; the design is what the read plan counts.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from itertools import pairwise
from statistics import median

from rich.console import Console
from rich.table import Table

from tui.drive.blocks.assignment import empty
from tui.drive.blocks.picking import pick
from tui.drive.blocks.wire_cost import cost
from tui.drive.profile.library import load
from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Block
from tui.drive.read_plan import WireTiming
from tui.session.connect.open_line import open_line
from tui.session.drive import DriveSession
from tui.session.monitor.monitor import Monitor
from tui.session.monitor.rates import rates_of
from tui.session.monitor.snapshot import Snapshot
from tui.simulator import DriveSpec, LineTiming, Simulation

EIGHT = ("ETA", "RFRD", "LCR", "OTR", "ULN", "THD", "THR", "LFT")
CASES: tuple[tuple[str, str, tuple[str, ...], tuple[str, ...]], ...] = (
    ("atv21", "monitoring", (), ("FD01", "FD00", "FE03", "FE05", "FE90")),
    ("atv71", "monitoring", (), ("RFRD", "ETA", "LCR", "OTR", "ULN", "THD", "THR", "LFT")),
    ("atv71", "manual's eight", EIGHT, EIGHT),
)
"""Family, name of the set of values, its codes (the monitoring set's fast ones where there are
none), and what the slots stand for."""
RUN_HZ = 35.0
PROVED_WITHIN = 60.0
"""Seconds until the monitor must use the block as far as possible."""
WARM = 10
"""Cycles before anything is measured."""
AS_DESIGNED = 1.1
"""The monitor's plan may cost so many times the design: turnaround is measured in steps."""


@dataclass(frozen=True, slots=True)
class Row:
    """One family at one baud, without or with its block; times in ms."""

    family: str
    set: str
    baud: int
    block: str
    values: int
    requests: int
    design_ms: float
    cycle_ms: float | None
    cycles: int
    used: float
    """Share of the cycles that came through the block."""


def read_block(profile: Profile) -> Block:
    """The block that Monitor reads."""
    return next(block for block in profile.data.blocks if block.direction == "read")


def slots_for(profile: Profile, codes: tuple[str, ...]) -> dict[str, int]:
    """Raw values of the slots of the read block, standing for these from the first on."""
    plan = empty(read_block(profile))
    for place, code in enumerate(codes):
        plan = pick(profile, plan, place, code)
    return plan.slots


async def measured(
    case: tuple[str, str, tuple[str, ...], tuple[str, ...]],
    baud: int,
    seconds: float,
    *,
    with_block: bool,
) -> Row:
    """Let Monitor run on a drive, and take the time of its cycles."""
    family, name, given, stand = case
    profile = load(family)
    codes = given or rates_of(profile).fast
    line_timing = LineTiming(baud, "8N1", True)
    spec_turnaround = float(profile.data.link.turnaround_ms) / 1000
    timing = WireTiming(line_timing.character, line_timing.silence, spec_turnaround)
    block = read_block(profile)
    slots = slots_for(profile, stand if with_block else ())
    counted = cost(profile, codes, timing, slots)
    simulation = Simulation([DriveSpec(family, 1, sets=slots, run_hz=RUN_HZ)], timing=line_timing)
    simulation.start()
    opened = open_line(f"serial:{simulation.serve_pty()},{baud},8N1", wait=5.0)
    monitor = Monitor(DriveSession(opened.line, 1, profile))
    taken: list[Snapshot] = []
    monitor.listen(taken.append)
    try:
        monitor.start(list(codes), period=0.05)
        await _settled(monitor, codes, counted.microseconds / 1e6)
        taken.clear()
        await asyncio.sleep(seconds)
    finally:
        monitor.stop()
        opened.close()
        simulation.stop()
    good = [snapshot for snapshot in taken if not snapshot.error]
    gaps = [b.time - a.time for a, b in pairwise(good)]
    return Row(
        family=family,
        set=name,
        baud=baud,
        block=block.name if with_block else "",
        values=len(codes),
        requests=counted.requests,
        design_ms=counted.microseconds / 1000,
        cycle_ms=median(gaps) * 1000 if gaps else None,
        cycles=len(good),
        used=sum(bool(snapshot.block) for snapshot in good) / len(good) if good else 0.0,
    )


async def _settled(monitor: Monitor, codes: Sequence[str], design: float) -> None:
    """Wait until the monitor knows the drive's turnaround, and uses all that it is to use."""
    end = time.monotonic() + PROVED_WITHIN
    while time.monotonic() < end:
        latest = monitor.latest
        warm = latest is not None and latest.cycle > WARM
        if warm and monitor.reader.seconds(codes) <= design * AS_DESIGNED:
            return
        await asyncio.sleep(0.05)


def main() -> None:
    """Measure, print the table, and all figures as JSON in the last line."""
    parser = argparse.ArgumentParser(description="Monitor with and without a block.")
    parser.add_argument("--bauds", default="9600,19200")
    parser.add_argument("--seconds", type=float, default=10.0, help="length of a run")
    given = parser.parse_args()
    console = Console(width=120)
    table = Table(title="Cycle of Monitor in ms, without and with the block")
    for heading in (
        "drive", "set", "baud", "block", "values", "requests", "design", "measured", "cycles",
        "used",
    ):  # fmt: skip
        table.add_column(
            heading, justify="left" if heading in ("drive", "set", "block") else "right"
        )
    rows = []
    for case in CASES:
        for baud in map(int, given.bauds.split(",")):
            for with_block in (False, True):
                row = asyncio.run(measured(case, baud, given.seconds, with_block=with_block))
                rows.append(row)
                cycle = f"{row.cycle_ms:.1f}" if row.cycle_ms else "-"
                table.add_row(
                    row.family, row.set, str(baud), row.block or "none", str(row.values),
                    str(row.requests),
                    f"{row.design_ms:.1f}", cycle, str(row.cycles), f"{row.used:.0%}",
                )  # fmt: skip
    console.print(table)
    console.print(
        "The panel leaves a part of the line to its operator, and learns the slots again now and"
        " then: cycles are longer than the design by that. The cost of a scanner holds the read"
        " of its slots after each use."
    )
    print(json.dumps({"benchmark": "block", "rows": [asdict(row) for row in rows]}))


if __name__ == "__main__":
    main()
