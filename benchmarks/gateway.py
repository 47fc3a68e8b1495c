"""Reads a second through the Modbus TCP of `drivepanel serve`, beside mbpoll alone on the line.

    python -m benchmarks.gateway [--seconds S] [--rounds N]

A simulated drive on a line of 19200 baud in a process of its own notes every exchange. In turn, in
one run, ten words are read again and again:

- by mbpoll on the serial line itself, which waits 11 ms after each read, its least;
- by mbpoll through the gateway, so that every read goes to the drive;
- by clients that wait for nothing but the answer: through to the drive, and from fresh values.

The limit is what the line allows: the characters, the drive's turnaround and the silence.

Then the keeper polls five drives for metrics, which fills the line. One client reads as before,
back to back and with pauses, and stops a motor now and then, beside the same without polls.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import re
import shutil
import signal
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from random import Random
from statistics import fmean, median
from typing import Any

from rich.console import Console
from rich.table import Table

from benchmarks.masters import MBPOLL_PERIOD_MS
from benchmarks.wire import ROOT, Exchange, Record, WireLine, share
from tui.simulator import LineTiming

DEVICE, ADDRESS, WORDS = 1, 3201, 10
REQUEST = struct.pack(">HHHBBHH", 1, 0, 6, DEVICE, 3, ADDRESS, WORDS)
ANSWER = 7 + 2 + 2 * WORDS
FRESH = 1.0
CLIENTS = 8
ALONE = "mbpoll, alone on the line"
POLLED = "mbpoll, through the gateway"
THROUGH = "one client, through to the drive"
SEVERAL = f"{CLIENTS} clients, through to the drive"
STORED = f"one client, values fresh for {FRESH:g} s"
POLLED_DRIVES, EVERY = 5, 0.5
PAUSES = {"back to back": 0.0, "11 ms after each answer": 0.011, "0 to 100 ms after it": 0.1}
STOP_WORD = struct.pack(">HHHBBHH", 2, 0, 6, DEVICE, 6, 8501, 0x0007)
STORED_SEVERAL = f"{CLIENTS} clients, values fresh for {FRESH:g} s"


def mbpoll_reads(seconds: float, *where: str) -> int:
    """Number of times that mbpoll got all words in this many seconds."""
    options = f"-a {DEVICE} -0 -r {ADDRESS} -c {WORDS} -t 4:hex -l {MBPOLL_PERIOD_MS}".split()
    process = subprocess.Popen(
        ["stdbuf", "-oL", "mbpoll", *options, *where], stdout=subprocess.PIPE, text=True
    )
    time.sleep(seconds)
    process.send_signal(signal.SIGTERM)
    reported, _ = process.communicate(timeout=10)
    return len(re.findall(rf"^\[{ADDRESS}\]:", reported, re.MULTILINE))


async def client_reads(port: int, clients: int, seconds: float) -> tuple[int, float]:
    """Number of replies that the clients got, each sending as soon as it has one; deadline in s."""
    begun = time.monotonic()
    end = begun + seconds
    counts = await asyncio.gather(*(_one_client(port, end) for _ in range(clients)))
    return sum(counts), time.monotonic() - begun


async def _one_client(port: int, end: float) -> int:
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    count = 0
    while time.monotonic() < end:
        writer.write(REQUEST)
        head = await reader.readexactly(9)
        if head[7] != 3:
            raise RuntimeError(f"the gateway answers exception {head[8]}")
        await reader.readexactly(ANSWER - len(head))
        count += 1
    writer.close()
    return count


async def read_times(port: int, longest: float, seconds: float) -> list[float]:
    """Seconds from each request to its answer; a pause follows, the longest one or by chance."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    times, end, chance = [], time.monotonic() + seconds, Random(1)
    while time.monotonic() < end:
        begun = time.monotonic()
        writer.write(REQUEST)
        await reader.readexactly(ANSWER)
        times.append(time.monotonic() - begun)
        if longest:
            await asyncio.sleep(longest if longest < EVERY / 10 else chance.uniform(0.0, longest))
    writer.close()
    return times


async def stop_times(port: int, count: int) -> list[tuple[float, float]]:
    """When stop words were sent and answered, each some time after a read of the client."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    times, chance = [], Random(2)
    for _ in range(count):
        writer.write(REQUEST)
        await reader.readexactly(ANSWER)
        await asyncio.sleep(chance.uniform(0.3, 0.6))
        begun = time.monotonic()
        writer.write(STOP_WORD)
        await reader.readexactly(12)
        times.append((begun, time.monotonic()))
    writer.close()
    return times


def beside_polls(wire: WireLine, seconds: float) -> dict[str, dict[str, float]]:
    """Times of one client without polls, and beside polls that fill the line."""
    found: dict[str, dict[str, float]] = {}
    wire.set_up(dict.fromkeys(range(1, 1 + POLLED_DRIVES), "atv71"), LineTiming(19200, "8E1", True))
    plant = ("--metrics", ":0", "--every", f"{EVERY:g}")
    for polls, line in ((False, wire.text), (True, f"{wire.text}@1-{POLLED_DRIVES}")):
        with gateway(line, 0.0, *(plant if polls else ())) as port:
            asyncio.run(read_times(port, 0.0, 1.0))
            time.sleep(3.0)  # by then all drives are polled
            beside = "beside polls" if polls else "alone"
            for name, pause in PAUSES.items():
                times = asyncio.run(read_times(port, pause, seconds))
                found[f"read {name}, {beside}"] = _of_times(times)
            wire.take()
            stops = asyncio.run(stop_times(port, max(2, int(2 * seconds))))
            record = wire.take()
            found[f"stop, {beside}"] = _of_times([end - begun for begun, end in stops]) | {
                "most_exchanges": max(_up_to_stop(record, *stop) for stop in stops)
            }
    for name, row in found.items():
        base = found[name.replace("beside polls", "alone")]
        row["median_to_alone"] = row["median"] / base["median"]
        row["mean_to_alone"] = row["mean"] / base["median"]
    return found


def _up_to_stop(record: Sequence[Exchange], sent: float, answered: float) -> int:
    """Exchanges from the sending of a stop word to its reply: that in flight, and its own, too."""
    there = [exchange for exchange in record if exchange.ended > sent and exchange.began < answered]
    word = next(at for at, exchange in enumerate(there) if exchange.request[1:6] == STOP_WORD[7:12])
    return word + 1


def _of_times(times: list[float]) -> dict[str, float]:
    return {
        "median": median(times), "mean": fmean(times), "p95": share(times, 0.95) or 0.0
    }  # fmt: skip


@contextmanager
def gateway(line: str, fresh: float, *options: str) -> Iterator[int]:
    """`serve` on the line; the port of its Modbus TCP."""
    with tempfile.TemporaryDirectory() as state:
        command = [sys.executable, "-m", "tui", "serve", line, "--tcp", ":0", "--json"]
        process = subprocess.Popen(
            [*command, "--fresh", f"{fresh:g}", *options],
            cwd=ROOT,
            env={"PATH": "/usr/bin:/bin", "PYTHONPATH": str(ROOT), "DRIVEPANEL_STATE": state},
            stdout=subprocess.PIPE,
            text=True,
        )
        try:
            assert process.stdout is not None
            ready: dict[str, Any] = json.loads(process.stdout.readline())
            yield int(ready["tcp"].rpartition(":")[2])
        finally:
            process.terminate()
            process.communicate(timeout=20)


def measured(wire: WireLine, seconds: float, *, with_mbpoll: bool) -> dict[str, dict[str, float]]:
    """Reads a second of each contestant, and what of it went over the line."""
    found: dict[str, dict[str, float]] = {}

    def note(name: str, reads: int, span: float) -> None:
        exchanges = [exchange for exchange in wire.take() if exchange.size]
        gaps = [gap / wire.times.silence for gap in Record(wire.times, exchanges).gaps()]
        found[name] = {
            "reads_a_second": reads / span,
            "on_the_line": len(exchanges) / span,
            "broken_silences": sum(gap < 1 for gap in gaps),
        }

    if with_mbpoll:
        timing = wire.timing
        wire.take()
        reads = mbpoll_reads(seconds, "-m", "rtu", "-b", str(timing.baud), "-P", "none", wire.path)
        note(ALONE, reads, seconds)
    for fresh, names in ((0.0, (THROUGH, SEVERAL)), (FRESH, (STORED, STORED_SEVERAL))):
        with gateway(wire.text, fresh) as port:
            asyncio.run(client_reads(port, 1, 0.5))  # by then the drive is identified
            if with_mbpoll and not fresh:
                wire.take()
                reads = mbpoll_reads(seconds, "-m", "tcp", "-p", str(port), "127.0.0.1")
                note(POLLED, reads, seconds)
            for name, clients in zip(names, (1, CLIENTS), strict=True):
                wire.take()
                note(name, *asyncio.run(client_reads(port, clients, seconds)))
    return found


def main() -> None:
    """Measure, print a table, and all figures as JSON in the last line."""
    parser = argparse.ArgumentParser(description="Reads a second through the gateway.")
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--rounds", type=int, default=3)
    given = parser.parse_args()
    console = Console()
    with_mbpoll = shutil.which("mbpoll") is not None
    if not with_mbpoll:
        console.print("mbpoll is not installed: no ratio to it.")
    wire = WireLine()
    try:
        wire.set_up({DEVICE: "atv71"}, LineTiming(19200, "8E1", True))
        limit = 1 / wire.times.read(DEVICE, WORDS)
        rounds = [
            measured(wire, given.seconds, with_mbpoll=with_mbpoll) for _ in range(given.rounds)
        ]
        polled = beside_polls(wire, given.seconds)
    finally:
        wire.close()
    figures = {}
    for name in rounds[0]:
        each = {key: [row[name][key] for row in rounds] for key in rounds[0][name]}
        figures[name] = {key: median(values) for key, values in each.items()}
        reads = figures[name]["reads_a_second"]
        figures[name]["of_the_limit"] = reads / limit
        alone = [row[ALONE]["reads_a_second"] for row in rounds] if with_mbpoll else []
        mine = each["reads_a_second"]
        ratios = [a / b for a, b in zip(mine, alone, strict=True)] if alone else []
        figures[name]["to_mbpoll"] = median(ratios) if ratios else 0.0
    table = Table(
        title=f"Reads of {WORDS} words at 19200 baud; the line allows {limit:.1f} a second"
    )
    for title in ("who", "reads/s", "to mbpoll alone", "of the limit", "on the line/s", "broken"):
        table.add_column(title)
    for name, row in figures.items():
        table.add_row(
            name, f"{row['reads_a_second']:.1f}", f"{row['to_mbpoll']:.2f}",
            f"{row['of_the_limit']:.3f}", f"{row['on_the_line']:.1f}",
            f"{row['broken_silences']:.0f}",
        )  # fmt: skip
    console.print(table)
    table = Table(title=f"One client beside polls of {POLLED_DRIVES} drives each {EVERY:g} s, ms")
    for title in ("what", "median", "mean", "95 %", "median / alone", "mean / alone", "exchanges"):
        table.add_column(title)
    for name, row in polled.items():
        table.add_row(
            name, *(f"{1000 * row[key]:.1f}" for key in ("median", "mean", "p95")),
            f"{row['median_to_alone']:.2f}", f"{row['mean_to_alone']:.2f}",
            f"{row['most_exchanges']:.0f}" if "most_exchanges" in row else "",
        )  # fmt: skip
    console.print(table)
    all_found = {"limit_a_second": limit, "figures": figures, "beside_polls": polled}
    print(json.dumps({"benchmark": "gateway", **all_found}))


if __name__ == "__main__":
    main()
