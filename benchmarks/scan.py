"""A scan compared with the limit of its line: one setting, all settings, a hit on the screen.

    python -m benchmarks.scan [--addresses N] [--rounds N] [--all]

No drive answers while the time is taken, as a scan spends its time on empty addresses. The limit of
an address is its request, the longest turnaround of the profiles or the gap that ends the request,
and the first character of a reply. --all takes two minutes.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import subprocess
import sys
import time
from collections.abc import Sequence
from itertools import pairwise
from statistics import median
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.wire import ROOT, Exchange, WireLine
from tui.drive.finding import LineSetting, longest_turnaround, silent_cost, wait_for_reply
from tui.session.connect.address_prober import known_profiles, settings_worth_a_try
from tui.session.connect.identify import ScanResult
from tui.session.connect.open_line import OpenLine, open_line, reopen
from tui.session.connect.search import Search
from tui.simulator import LineTiming

FACTORY = LineSetting(19200, "8E1")
ELSEWHERE = 200
"""Address of the only drive, on a line where it is not scanned."""
AIM_ONE, AIM_ALL = 5.0, 60.0
"""Seconds in which 31 addresses should be scanned at one setting, and at all."""
IN_COMMAND = (4, 17, 31)
"""Addresses of the drives that the command finds."""


def limit(setting: LineSetting) -> float:
    """Seconds that an empty address takes at the least."""
    return silent_cost(setting, wait_for_reply(setting, longest_turnaround(known_profiles())))


async def searched(opened: OpenLine, addresses: Sequence[int]) -> float:
    """Seconds of one search."""

    async def found(_: ScanResult) -> None:
        raise RuntimeError("nobody should have answered")

    began = time.monotonic()
    await Search(addresses, once=True).run(opened.line, found)
    return time.monotonic() - began


def steps(exchanges: Sequence[Exchange]) -> list[float]:
    """Seconds from each request to the next one."""
    return [b.began - a.began for a, b in pairwise(exchanges)]


def one_setting(wire: WireLine, setting: LineSetting, addresses: Sequence[int]) -> dict[str, Any]:
    """A search at one setting on a line of its pace."""
    timing = LineTiming(setting.baud, setting.format, True)
    wire.set_up({ELSEWHERE: "atv71"}, timing)
    opened = open_line(wire.text, wait=5.0)
    try:
        seconds = asyncio.run(searched(opened, addresses))
    finally:
        opened.close()
    taken = [exchange for exchange in wire.take() if exchange.request[0] != ELSEWHERE]
    least = limit(setting)
    return {
        "setting": str(setting),
        "seconds": seconds,
        "limit": least * len(addresses),
        "requests": len(taken),
        "request_to_limit": median(steps(taken)) / least,
    }


def all_settings(wire: WireLine, addresses: Sequence[int]) -> dict[str, Any]:
    """Every setting in turn; the line is reopened for each."""
    wire.set_up({ELSEWHERE: "atv71"}, LineTiming(FACTORY.baud, FACTORY.format, True))
    settings = settings_worth_a_try(FACTORY)
    opened = open_line(wire.text, wait=5.0)
    began = time.monotonic()
    ends: list[float] = []
    try:
        for number, setting in enumerate(settings):
            if number:
                reopen(opened, setting.baud, setting.format, wait=5.0)
            asyncio.run(searched(opened, addresses))
            ends.append(time.monotonic() - began)
    finally:
        opened.close()
    least = [limit(item) * len(addresses) for item in settings]
    in_time = sum(end <= AIM_ALL for end in ends)
    likely = sum(not item.slow for item in settings)
    return {
        "settings": len(settings),
        "seconds": ends[-1],
        "limit": sum(least),
        "within_60_s": in_time,
        "within_60_s_by_the_limit": sum(sum(least[: n + 1]) <= AIM_ALL for n in range(len(least))),
        "not_within_60_s": [str(item) for item in settings[in_time:]],
        "likely": likely,
        "likely_seconds": ends[likely - 1],
        "likely_limit": sum(least[:likely]),
    }


def command(wire: WireLine, last: int) -> dict[str, Any]:
    """The command itself, three drives on its line: all of its time, and how soon a hit shows."""
    families = dict(zip(IN_COMMAND, ("atv71", "atv312", "powerdrive"), strict=True))
    wire.set_up(families, LineTiming(FACTORY.baud, FACTORY.format, True))
    typed = [sys.executable, "-m", "tui", "scan", wire.text, "--addresses", f"1-{last}", "--json"]
    began = time.monotonic()
    process = subprocess.Popen(
        typed, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
    )
    shown: dict[int, float] = {}
    assert process.stdout is not None
    for line in process.stdout:
        reported = json.loads(line)
        if reported["event"] == "hit":
            shown[reported["device"]] = time.monotonic()
    process.wait()
    seconds = time.monotonic() - began
    first: dict[int, float] = {}
    for exchange in wire.take():
        if exchange.size and exchange.request[0] in families:
            first.setdefault(exchange.request[0], exchange.ended)
    late = {families[device]: shown[device] - first[device] for device in shown}
    return {"seconds": seconds, "found": len(shown), "hit_shown_after": late}


def show(console: Console, rows: Sequence[dict[str, Any]]) -> None:
    """Print the searches at one setting."""
    table = Table(title="Empty addresses at one setting")
    for title in ("setting", "seconds", "limit", "/ limit", "request / limit", "requests"):
        table.add_column(title, justify="left" if title == "setting" else "right")
    for row in rows:
        table.add_row(
            row["setting"],
            f"{row['seconds']:.2f}",
            f"{row['limit']:.2f}",
            f"{row['seconds'] / row['limit']:.3f}",
            f"{row['request_to_limit']:.3f}",
            str(row["requests"]),
        )
    console.print(table)


def _to_limit(reported: dict[str, Any], which: str = "") -> str:
    """Seconds, those that the line allows, and how the two compare."""
    seconds, least = reported[f"{which}seconds"], reported[f"{which}limit"]
    return f"{seconds:.1f} s, limit {least:.1f} s ({seconds / least:.3f})"


def main() -> None:
    """Measure, print the tables, and all figures as JSON in the last line."""
    parser = argparse.ArgumentParser(description="A search for drives.")
    parser.add_argument("--addresses", type=int, default=31, help="the last address asked")
    parser.add_argument("--rounds", type=int, default=3, help="searches at each setting")
    parser.add_argument("--all", action="store_true", help="all settings too, in two minutes")
    given = parser.parse_args()
    console, wire = Console(width=100), WireLine()
    addresses = range(1, given.addresses + 1)
    settings = [FACTORY, LineSetting(19200, "8N2"), LineSetting(9600, "8E1")]
    figures: dict[str, Any] = {"benchmark": "scan"}
    try:
        figures["one"] = rows = [
            one_setting(wire, setting, addresses)
            for setting in settings
            for _ in range(given.rounds)
        ]
        show(console, rows)
        figures["command"] = reported = command(wire, given.addresses)
        late = ", ".join(
            f"{item} {1000 * s:.0f} ms" for item, s in reported["hit_shown_after"].items()
        )
        console.print(
            f"The command, with 1.5 s of listening: {reported['seconds']:.2f} s (aim {AIM_ONE:g}"
            " s),"
            f" {reported['found']} of {len(IN_COMMAND)} found; from the first answer to the line"
            " that"
            f" tells of it: {late}."
        )
        if given.all:
            figures["all"] = reported = all_settings(wire, addresses)
            console.print(
                f"The {reported['likely']} likely settings: {_to_limit(reported, 'likely_')} (aim"
                f" {AIM_ALL:g} s). All {reported['settings']}: {_to_limit(reported)}; in"
                f" {AIM_ALL:g} s"
                f" {reported['within_60_s']} of them, by the limit"
                f" {reported['within_60_s_by_the_limit']}."
                f" Left then: {', '.join(reported['not_within_60_s'])}."
            )
    finally:
        wire.close()
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
