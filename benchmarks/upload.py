"""All parameters of a drive read for a backup: time on the line, compared with its limit.

    python -m benchmarks.upload [--baud BAUD] [--rounds N]

The limit of the plan is the time of the cheapest requests for all readable parameters; the other
figure is the least time with one request per parameter, as most tools do. Drives refuse missing
parameters, and then each word is requested separately. That is part of the time, not of the limit.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import time
from statistics import median
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.wire import Record, WireLine
from tui.bus.line import Line
from tui.bus.link import parse_link
from tui.drive.profile.library import load
from tui.drive.profile.profile import Profile
from tui.drive.read_plan import WireTiming, plan_reads
from tui.drive.values import word_count
from tui.session.drive import DriveSession
from tui.session.read.retrying_reader import neighbors
from tui.session.read.upload import Upload, readable_codes
from tui.simulator import LineTiming

FAMILIES = ("atv21", "atv31", "atv312", "atv71", "powerdrive", "proxidrive", "varmeca")
FORMAT = "8E1"


def measure(wire: WireLine, family: str, baud: int) -> dict[str, Any]:
    """Read one drive out; times in s."""
    wire.set_up({1: family}, LineTiming(baud, FORMAT, True))
    line = Line(parse_link(wire.text))
    line.open(wait=5.0)
    try:
        session = DriveSession(line, 1, load(family))
        upload = Upload(session)
        wire.take()
        begun = time.monotonic()
        asyncio.run(upload.run())
        seconds = time.monotonic() - begun
    finally:
        line.close()
    record = Record(wire.times, wire.take())
    gaps = record.gaps()
    return {
        "seconds": seconds,
        "read": len(upload.raws),
        "refused": len(upload.absent),
        "requests": len(record.exchanges),
        "same_requests": record.least(),
        "smallest_silence": min(gaps) / wire.times.silence,
    }


def limits(wire: WireLine, family: str) -> dict[str, float]:
    """Least seconds by the best plan, and with one request a parameter."""
    profile = load(family)
    codes = readable_codes(profile)
    single = sum(wire.times.read(1, word_count(profile[code])) for code in codes)
    return {"plan": best_plan(wire, profile, codes), "single": single}


def best_plan(wire: WireLine, profile: Profile, codes: list[str]) -> float:
    """The cheapest requests for these parameters, in s; no request spans two parts."""
    times = wire.times
    timing = WireTiming(times.character, times.silence, times.turnarounds.get(1, 0.0))
    parts = neighbors(profile, codes)
    return sum(plan_reads(profile, part, timing).seconds for part in parts)


def table_of(rows: list[dict[str, Any]], baud: int) -> Table:
    """The figures as ratios."""
    table = Table(title=f"A whole drive read out, {baud} baud {FORMAT}")
    for name in ("drive", "parameters", "requests", "seconds"):
        table.add_column(name, justify="left" if name == "drive" else "right")
    for name in ("/ same requests", "/ best plan", "/ one a parameter", "least silence"):
        table.add_column(name, justify="right")
    for row in rows:
        table.add_row(
            row["family"],
            f"{row['read']} + {row['refused']} refused" if row["refused"] else str(row["read"]),
            str(row["requests"]),
            f"{row['seconds']:.2f}",
            f"{row['seconds'] / row['same_requests']:.3f}",
            f"{row['seconds'] / row['plan']:.3f}",
            f"{row['seconds'] / row['single']:.3f}",
            f"{row['smallest_silence']:.2f}",
        )
    return table


def main() -> None:
    """Measure every family, print the table and one line of JSON."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--baud", type=int, default=19200)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    wire = WireLine()
    rows: list[dict[str, Any]] = []
    try:
        for family in FAMILIES:
            rounds = [measure(wire, family, options.baud) for _ in range(options.rounds)]
            middle = median(row["seconds"] for row in rounds)
            chosen = min(rounds, key=lambda item: abs(item["seconds"] - middle))
            rows.append({"family": family} | chosen | limits(wire, family))
    finally:
        wire.close()
    Console(width=120).print(table_of(rows, options.baud))
    print(json.dumps({"benchmark": "upload", "baud": options.baud, "rows": rows}))


if __name__ == "__main__":
    main()
