"""Many simulated drives on one line, all monitored: line load, evenness and cost.

    python -m benchmarks.fleet [--drives N] [--seconds S] [--period S]
    python -m benchmarks.fleet --serve [--lines N] [--drives N] [--seconds S]

With --serve `drivepanel serve` reads them for Prometheus, with a configured cycle of 1 s. Without,
this program reads them: once all drives answer; once, from the same start, one of them is switched
off. All drives read their slow values at about the same time, in every tenth cycle: a stretch of
time holds that or not, so only stretches at the same distance from the start can be compared.
"""

from __future__ import annotations

import argparse
import json
import os
import re
import resource
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from statistics import median
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.wire import ROOT, Record, WireLine, Worker, share
from tui.bus.line import Line
from tui.bus.link import parse_link
from tui.drive.profile.library import load
from tui.drive.read_plan import WireTiming, plan_reads
from tui.session.drive import DriveSession
from tui.session.monitor.monitor import Monitor
from tui.session.monitor.rates import monitoring_codes
from tui.simulator import LineTiming

FAMILIES = ("atv21", "atv31", "atv312", "atv71", "powerdrive", "proxidrive", "varmeca")
GROUPS = 4
"""The families from this one on take an address with the digit 0 for that of a group."""
SETTLING = 5.0
"""Seconds from the start in which all drives are met for the first time; not counted."""


def fleet(count: int) -> dict[int, str]:
    """Families by address, mixed."""
    return {address: _family(address) for address in range(1, count + 1)}


def _family(address: int) -> str:
    kinds = FAMILIES[:GROUPS] if "0" in str(address) else FAMILIES
    return kinds[address % len(kinds)]


# The process that watches


def watch() -> None:
    """Watch all drives named in the first job; the next one asks for figures."""
    first = json.loads(sys.stdin.readline())
    line = Line(parse_link(first["text"]))
    line.open(wait=5.0)
    drives = {int(address): family for address, family in first["drives"].items()}
    monitors = {a: Monitor(DriveSession(line, a, load(item))) for a, item in drives.items()}
    for monitor in monitors.values():
        monitor.start(period=first["period"])
    print(json.dumps({}), flush=True)
    seconds = json.loads(sys.stdin.readline())["seconds"]
    before = _state(line, monitors)
    time.sleep(seconds)
    print(json.dumps({"before": before, "after": _state(line, monitors)}), flush=True)
    line.close()


def _state(line: Line, monitors: Mapping[int, Monitor]) -> dict[str, object]:
    used = resource.getrusage(resource.RUSAGE_SELF)
    latest = {address: monitor.latest for address, monitor in monitors.items()}
    return {
        "time": time.monotonic(),
        "cpu": used.ru_utime + used.ru_stime,
        "cycles": {
            address: snapshot.cycle if snapshot else 0 for address, snapshot in latest.items()
        },
        "failing": [
            address for address, snapshot in latest.items() if snapshot is None or snapshot.error
        ],
        "counters": {
            name: count
            for name, count in asdict(line.counters).items()
            if name not in ("devices", "programs", "minute")  # the line's own alone
        },
    }


# What the line saw of it


def figures(
    record: Record, drives: Mapping[int, str], reported: dict[str, Any], chosen: int
) -> dict[str, Any]:
    """Figures of one stretch of time; the others are all but the drive that is chosen to die."""
    before, after = reported["before"], reported["after"]
    seconds = after["time"] - before["time"]
    inside = [e for e in record.exchanges if before["time"] <= e.began < after["time"]]
    record = Record(record.times, inside)
    by_drive = _values(record, drives)
    values = sum(by_drive.values())
    cycles = {
        address: count - before["cycles"][address]
        for address, count in after["cycles"].items()
        if int(address) != chosen
    }
    late, gaps = record.lateness(), record.gaps()
    counters = {key: after["counters"][key] - was for key, was in before["counters"].items()}
    return {
        "seconds": seconds,
        "values_a_second": values / seconds,
        "others_values_a_second": (values - by_drive[chosen]) / seconds,
        "limit_of_same_requests": values / record.least(),
        "line_use": record.least() / seconds,
        "fewest_cycles": min(cycles.values()),
        "most_cycles": max(cycles.values()),
        "evenness": min(cycles.values()) / max(max(cycles.values()), 1),
        "cpu_share": (after["cpu"] - before["cpu"]) / seconds,
        "failing": after["failing"],
        "counters": counters,
        "smallest_silence": min(gaps) / record.times.silence,
        "broken_silences": sum(gap < record.times.silence for gap in gaps),
        "request_median": median(record.steps()),
        "simulator_late_ms": {"median": median(late) * 1e3, "99": (share(late, 0.99) or 0) * 1e3},
    }


def _values(record: Record, drives: Mapping[int, str]) -> Counter[int]:
    """Number of monitored values in the replies of each drive."""
    addresses = {}
    for family in set(drives.values()):
        profile = load(family)
        addresses[family] = [profile[code].address for code in monitoring_codes(profile)]
    values: Counter[int] = Counter()
    for exchange in record.exchanges:
        first = int.from_bytes(exchange.request[2:4], "big")
        last = first + (exchange.size - 5) // 2
        device = exchange.request[0]
        values[device] += sum(first <= address < last for address in addresses[drives[device]])
    return values


def full_sets(wire: WireLine, drives: Mapping[int, str]) -> float:
    """Values a second if nothing but whole monitoring sets by their best plans were read."""
    values, seconds = 0, 0.0
    for address, family in drives.items():
        profile = load(family)
        codes = monitoring_codes(profile)
        times = wire.times
        timing = WireTiming(times.character, times.silence, times.turnarounds[address])
        plan = plan_reads(profile, codes, timing)
        values += len(codes)
        seconds += sum(times.read(address, request.count) for request in plan.requests)
    return values / seconds


# Through serve

READ_WITHIN = 40.0
"""Seconds from the start of serve in which each drive is to be read."""
SAMPLE = re.compile(r"^drivepanel_(\w+)\{(.*)\} (\S+)$", re.MULTILINE)


def named_drives(wires: Sequence[WireLine], drives: Mapping[int, str]) -> str:
    """The settings file that names the profile of each drive."""
    return "".join(
        f'[lines.l{number}d{address}]\nline = "{wire.text}"\n'
        f'device = {address}\nprofile = "{family}"\n'
        for number, wire in enumerate(wires)
        for address, family in drives.items()
    )


def scraped(url: str) -> dict[str, list[tuple[str, float]]]:
    """The samples of each metric, with their labels."""
    found: dict[str, list[tuple[str, float]]] = {}
    with urllib.request.urlopen(url, timeout=30) as answer:
        for name, labels, value in SAMPLE.findall(answer.read().decode()):
            found.setdefault(name, []).append((labels, float(value)))
    return found


def served(given: argparse.Namespace) -> dict[str, Any]:
    """Figures of serve, from its start until so many seconds after every drive was read."""
    drives, wires = fleet(given.drives), [WireLine() for _ in range(given.lines)]
    with tempfile.TemporaryDirectory() as name:
        config = Path(name, "config")
        config.mkdir()
        try:
            for wire in wires:
                wire.set_up(drives, LineTiming(given.baud, "8E1", True))
            Path(config, "settings.toml").write_text(named_drives(wires, drives), "utf-8")
            places = {"DRIVEPANEL_STATE": f"{name}/state", "DRIVEPANEL_CONFIG": str(config)}
            command = [sys.executable, "-m", "tui", "serve", "--metrics", "127.0.0.1:0"]
            command += ["--every", "1", *(f"{wire.text}@1-{given.drives}" for wire in wires)]
            begun = time.monotonic()
            with subprocess.Popen(
                command, env=os.environ | places, cwd=ROOT, text=True,
                stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
            ) as process:  # fmt: skip
                try:
                    return followed(process, begun, given)
                finally:
                    process.send_signal(signal.SIGTERM)
        finally:
            for wire in wires:
                wire.close()


def followed(
    process: subprocess.Popen[str], begun: float, given: argparse.Namespace
) -> dict[str, Any]:
    """Metrics of the service, read each second."""
    assert process.stdout is not None
    url = re.search(r"metrics at (http:\S+metrics)", process.stdout.readline())
    assert url is not None, "serve did not start"
    first: dict[str, float] = {}
    """When each drive was seen to be read, in seconds from the start."""
    not_read: list[dict[str, int]] = []
    """Drives without current values at each look after that, by the reason."""
    cycles: dict[str, list[float]] = {}
    count, end = given.lines * given.drives, begun + READ_WITHIN + given.seconds
    while (now := time.monotonic()) < end:
        seen = scraped(url[1])
        for labels, value in seen["drive_up"]:
            if value:
                first.setdefault(labels, now - begun)
        if len(first) == count:
            contacts = Counter(
                labels.rpartition("contact=")[2].strip('"')
                for labels, value in seen["drive_contact"]
                if value
            )
            not_read.append({text: n for text, n in contacts.items() if text != "answers"})
            for labels, value in seen["drive_cycle_seconds"]:
                cycles.setdefault(labels, []).append(value)
        time.sleep(max(0.0, now + 1.0 - time.monotonic()))
    last = [values[-1] for values in cycles.values()]
    return {
        "drives": count,
        "read": len(first),
        "first_read": min(first.values(), default=None),
        "last_read": max(first.values(), default=None),
        "looks": len(not_read),
        "looks_with_all_read": sum(not row for row in not_read),
        "not_read": dict(sum((Counter(row) for row in not_read), Counter())),
        "cycle": {"least": min(last), "median": median(last), "most": max(last)} if last else None,
    }


def show_served(console: Console, found: dict[str, Any], given: argparse.Namespace) -> None:
    """Print the figures of serve."""
    cycle = found["cycle"] or {"least": 0.0, "median": 0.0, "most": 0.0}
    table = Table(title=f"serve, {given.lines} x {given.drives} drives at {given.baud} baud")
    table.add_column("")
    table.add_column("measured", justify="right")
    for name, text in {
        f"drives read (aim: within {READ_WITHIN:g} s)": f"{found['read']} of {found['drives']}",
        "first read, s": f"{found['first_read'] or 0:.0f}",
        "last read, s": f"{found['last_read'] or 0:.0f}",
        "looks with all read": f"{found['looks_with_all_read']} of {found['looks']}",
        "drives not read in the others": str(found["not_read"] or "none"),
        "cycle, least / median / most, s": "{least:.1f} / {median:.1f} / {most:.1f}".format(
            **cycle
        ),
    }.items():
        table.add_row(name, text)
    console.print(table)


# What is printed


def show(console: Console, stretches: Sequence[dict[str, Any]], title: str) -> None:
    """Print the figures of both stretches side by side."""
    table = Table(title=title)
    table.add_column("")
    table.add_column("all answer", justify="right")
    table.add_column("one dead", justify="right")
    rows: dict[str, Callable[[dict[str, Any]], str]] = {
        "values a second": lambda row: f"{row['values_a_second']:.1f}",
        "of these by the others": lambda row: f"{row['others_values_a_second']:.1f}",
        "limit for the same requests": lambda row: f"{row['limit_of_same_requests']:.1f}",
        "share of the limit": lambda row: f"{row['line_use']:.3f}",
        "others: fewest / most cycles": lambda row: (
            f"{row['fewest_cycles']} / {row['most_cycles']}"
        ),
        "CPU, share of a core": lambda row: f"{row['cpu_share']:.3f}",
        "requests": lambda row: str(row["counters"]["requests"]),
        "replies": lambda row: str(row["counters"]["replies"]),
        "timeouts": lambda row: str(row["counters"]["timeouts"]),
        "refusals": lambda row: str(row["counters"]["exceptions"]),
        "drives failing at the end": lambda row: str(len(row["failing"])),
        "request to request / theory": lambda row: f"{row['request_median']:.3f}",
        "least silence / 3.5 characters": lambda row: f"{row['smallest_silence']:.2f}",
        "silences broken": lambda row: str(row["broken_silences"]),
        "simulator late, ms": lambda row: f"{row['simulator_late_ms']['median']:.2f}",
    }
    for name, text in rows.items():
        table.add_row(name, *(text(stretch) for stretch in stretches))
    console.print(table)


def options() -> argparse.Namespace:
    """The options that were given."""
    parser = argparse.ArgumentParser(description="Many drives on one line.")
    parser.add_argument("--drives", type=int, default=31)
    parser.add_argument("--baud", type=int, default=19200)
    parser.add_argument("--serve", action="store_true", help="read them by drivepanel serve")
    parser.add_argument("--lines", type=int, default=1, help="lines of serve")
    parser.add_argument("--seconds", type=float, default=20.0, help="length of each stretch")
    parser.add_argument("--period", type=float, default=0.1, help="wished cycle time in seconds")
    return parser.parse_args()


def stretch(
    wire: WireLine, given: argparse.Namespace, chosen: int, *, dies: bool
) -> dict[str, Any]:
    """Figures of one stretch, from a fresh start of line and panel side."""
    drives = fleet(given.drives)
    wire.set_up(drives, LineTiming(given.baud, "8E1", True))
    worker = Worker("from benchmarks.fleet import watch; watch()")
    try:
        worker.ask(text=wire.text, drives=drives, period=given.period)
        time.sleep(SETTLING)
        if dies:
            wire.kill(chosen)
        reported = worker.ask(seconds=given.seconds)
        return figures(Record(wire.times, wire.take()), drives, reported, chosen)
    finally:
        worker.close()


def main() -> None:
    """Measure, print the table, and all figures as JSON in the last line."""
    given = options()
    console = Console()
    if given.serve:
        found = served(given)
        show_served(console, found, given)
        print(json.dumps({"benchmark": "fleet", "lines": given.lines, "serve": found}))
        return
    chosen = (given.drives + 1) // 2
    wire = WireLine()
    try:
        stretches = [stretch(wire, given, chosen, dies=dies) for dies in (False, True)]
        limit = full_sets(wire, fleet(given.drives))
    finally:
        wire.close()
    title = f"{given.drives} drives at {given.baud} baud, a cycle wished each {given.period} s"
    show(console, stretches, title)
    others = [row["others_values_a_second"] for row in stretches]
    change = others[1] / others[0] - 1
    console.print(f"Whole monitoring sets alone would bring {limit:.1f} values a second.")
    console.print(f"Drive {chosen} dead: values a second of the others {100 * change:+.1f} %.")
    result = {"benchmark": "fleet", "drives": given.drives, "baud": given.baud, "dead": chosen}
    both = {"all": stretches[0], "one_dead": stretches[1]}
    print(json.dumps({**result, "full_sets_limit": limit, "others_change": change, **both}))


if __name__ == "__main__":
    main()
