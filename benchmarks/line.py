"""Cycle time of the monitoring set on a simulated line, beside other Modbus masters.

    python -m benchmarks.line [--families atv71,...] [--bauds 9600,19200] [--seconds S]

The simulator, in a process of its own, records each exchange; every time is taken there.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import mean, median
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.masters import (
    DEVICE,
    ONE_BY_ONE,
    OURS,
    PANEL,
    Cell,
    Contestant,
    contestants_of,
    worker,
)
from benchmarks.wire import Record, WireLine, share
from tui.drive.profile.library import load
from tui.drive.read_plan import WireTiming, plan_reads
from tui.drive.values import word_count
from tui.session.monitor.rates import monitoring_codes
from tui.simulator import LineTiming

FAMILIES = "atv21,atv31,atv312,atv71,powerdrive,proxidrive,varmeca"


def cell(wire: WireLine, family: str, timing: LineTiming, seconds: float) -> Cell:
    """Serve a drive of this family and plan its monitoring set."""
    wire.set_up({DEVICE: family}, timing)
    profile = load(family)
    codes = monitoring_codes(profile)
    turnaround = wire.times.turnarounds[DEVICE]
    plan = plan_reads(profile, codes, WireTiming(timing.character, timing.silence, turnaround))
    blocks = [(request.address, request.count) for request in plan.requests]
    values = [(profile[code].address, word_count(profile[code])) for code in codes]
    return Cell(wire, family, seconds, blocks, values, plan.seconds)


# Figures


@dataclass(slots=True)
class Row:
    """Figures of one contestant on one family and baud, over all its rounds."""

    cell: Cell
    contestant: Contestant
    records: list[Record]

    def figures(self) -> dict[str, Any]:
        """All figures; times in ms, silences in units of 3.5 characters, None where none is."""
        records, times = self.records, self.cell.wire.times
        steps = [step for record in records for step in record.steps()]
        lengths = [length for record in records for length in record.lengths()]
        gaps = [gap / times.silence for record in records for gap in record.gaps()]
        cycles = [cycle for record in records for cycle in record.cycles()]
        cycle = median(lengths) if lengths else None
        whole = cycle if self.contestant.whole else None
        own = [sum(map(times.shortest, cycle)) for cycle in cycles]
        return {
            "contestant": self.contestant.name,
            "requests": mean(map(len, cycles)) if cycles else None,
            "cycles": len(lengths),
            "cycle_ms": cycle and cycle * 1e3,
            "cycle_to_best_plan": whole and whole / self.cell.limit,
            "cycle_to_design": whole and whole / self.cell.design,
            "cycle_to_own_requests": sum(lengths) / sum(own) if own else None,
            "line_use": mean(record.use() for record in records),
            "request_median": median(steps) if steps else None,
            "request_mean": mean(steps) if steps else None,
            "request_99": share(steps, 0.99),
            "smallest_silence": min(gaps, default=None),
            "broken_silences": sum(gap < 1 for gap in gaps),
            "silences": len(gaps),
            "unanswered": sum(record.unanswered for record in records),
        }


def measured(cell: Cell, contestants: Sequence[Contestant], rounds: int) -> dict[str, Any]:
    """Figures of every contestant on one cell, in rounds of one run each."""
    rows = [Row(cell, contestant, []) for contestant in contestants]
    for number in range(rounds):
        for row in rows:
            if number == 0 or not row.contestant.once:
                row.records.append(row.contestant.run(cell))
    late = [late for row in rows for record in row.records for late in record.lateness()]
    least = sum(record.least() for row in rows for record in row.records)
    figures = [row.figures() for row in rows]
    singly = cell.least(cell.values)
    by_name = {row["contestant"]: row["cycle_ms"] for row in figures}
    one_by_one = by_name[ONE_BY_ONE]
    return {
        "family": cell.family,
        "baud": cell.wire.timing.baud,
        "values": len(cell.values),
        "requests": len(cell.blocks),
        "limit_ms": cell.limit * 1e3,
        "design_ms": cell.design * 1e3,
        "turnaround_ms": cell.wire.times.turnarounds[DEVICE] * 1e3,
        "limit_to_one_a_value": cell.limit / singly,
        "ours_to_one_a_value": _ratio(by_name[OURS], one_by_one),
        "panel_to_one_a_value": _ratio(by_name[PANEL], one_by_one),
        "simulator_late_ms": {"median": median(late) * 1e3, "99": (share(late, 0.99) or 0) * 1e3},
        "simulator_late_share": sum(late) / least,
        "contestants": figures,
    }


def _ratio(value: float | None, other: float | None) -> float | None:
    return value / other if value and other else None


# What is printed

COLUMNS = (
    ("requests", "requests", "{:.1f}"),
    ("cycle_ms", "cycle ms", "{:.1f}"),
    ("cycle_to_best_plan", "/ best", "{:.3f}"),
    ("cycle_to_design", "/ design", "{:.3f}"),
    ("cycle_to_own_requests", "/ own", "{:.3f}"),
    ("line_use", "use", "{:.2f}"),
    ("request_median", "request", "{:.3f}"),
    ("request_mean", "mean", "{:.3f}"),
    ("request_99", "99 %", "{:.3f}"),
    ("smallest_silence", "silence", "{:.2f}"),
)


def show(console: Console, item: dict[str, Any]) -> None:
    """Print the table of one family at one baud."""
    table = Table(
        title=f"{item['family']} at {item['baud']} baud: {item['values']} values"
        f" in {item['requests']} requests, limit {item['limit_ms']:.1f} ms",
        caption=f"The simulator itself ended replies {item['simulator_late_ms']['median']:.2f} ms"
        f" late (99 %: {item['simulator_late_ms']['99']:.2f} ms),"
        f" {100 * item['simulator_late_share']:.1f} % of the limit; nothing is subtracted.",
    )
    table.add_column("contestant", no_wrap=True)
    for _, title, _ in COLUMNS:
        table.add_column(title, justify="right")
    table.add_column("broken", justify="right")
    for row in item["contestants"]:
        cells = [form.format(row[key]) if row[key] else "-" for key, _, form in COLUMNS]
        broken = f"{row['broken_silences']} of {row['silences']}"
        table.add_row(row["contestant"], *cells, broken)
    console.print(table)


def show_blocks(console: Console, cells: Sequence[dict[str, Any]]) -> None:
    """Print what the best plan gains over one request a value."""
    table = Table(
        title="The whole monitoring set, as a share of the time of one request a value",
        caption=f"Peer: {ONE_BY_ONE}. The panel reads only its fast values in each cycle.",
    )
    for title in ("family", "baud", "by the limit", OURS, "panel's cycle"):
        table.add_column(title, justify="left" if title == "family" else "right")
    for cell in cells:
        keys = ("limit_to_one_a_value", "ours_to_one_a_value", "panel_to_one_a_value")
        shares = (f"{cell[key]:.2f}" if cell[key] else "-" for key in keys)
        table.add_row(cell["family"], str(cell["baud"]), *shares)
    console.print(table)


def options() -> argparse.Namespace:
    """The options that were given."""
    parser = argparse.ArgumentParser(description="Cycle time of the monitoring set.")
    parser.add_argument("--families", default=FAMILIES)
    parser.add_argument("--bauds", default="9600,19200")
    parser.add_argument("--format", default="8E1", help="characters of the simulated line")
    parser.add_argument("--seconds", type=float, default=0.3, help="length of a run")
    parser.add_argument("--rounds", type=int, default=1, help="rounds of all contestants")
    return parser.parse_args()


def main() -> None:
    """Measure, print the tables, and all figures as JSON in the last line."""
    given = options()
    console = Console(width=150)
    wire, process = WireLine(), worker()
    contestants, missing = contestants_of(process)
    cells = []
    try:
        for baud in map(int, given.bauds.split(",")):
            for family in given.families.split(","):
                timing = LineTiming(baud, given.format, True)
                item = cell(wire, family, timing, given.seconds)
                cells.append(measured(item, contestants, given.rounds))
                show(console, cells[-1])
    finally:
        process.close()
        wire.close()
    show_blocks(console, cells)
    for name, reason in missing.items():
        console.print(f"{name} is missing: {reason}.")
    console.print(
        "Limit of an exchange: its characters, the drive's turnaround (which the simulator counts"
        " from the end of the request) and 3.5 silent characters before the next request."
        " '/ best': cycle to the limit of the best plan; '/ design': with one silence more an"
        " exchange, as the panel's planner counts; '/ own': to the limit of the requests that were"
        " sent. 'request': median from one request to the next inside a cycle, to the limit."
        " 'silence': the least that was kept, in units of 3.5 characters."
        " A silence that is broken costs nothing here; a real drive may miss the request."
        " The panel leaves a tenth of the line to its operator: its ratio to its own requests"
        " holds that pause, the ratios of its requests do not."
    )
    console.print(
        f"Characters of {given.format}. A pseudo-terminal has no parity: the peers open it"
        " without one, and the simulator keeps the time of the line."
    )
    print(json.dumps({"benchmark": "line", "cells": cells, "missing": missing}))


if __name__ == "__main__":
    main()
