"""Cost of the record of a line: rows and values per second, and its files after some hours.

    python -m benchmarks.record [--seconds S] [--hours H] [--drives N]

- `values`: replies of ten registers and of one go through a recorder into its file, in one process
  on one core: registers per second of processor time, and of the time of day;
- `ring`: each drive is read once a second, by the seven reads of a cycle of Monitor (Altivar 71).
  Their registers wander. A recorder gets the rows of so many hours, from noon on, and does what it
  does in that time: files of days, reduction after an hour, removal of the oldest rows. The clock
  of the recorder is simulated, and goes as fast as the disk accepts the rows.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Any
from unittest.mock import patch

from rich.console import Console
from rich.table import Table

from tui.bus.model import EndedExchange
from tui.session.record import record_file, recorder
from tui.session.record import ring as ring_files
from tui.session.record.history import oldest_reply
from tui.session.record.recorder import RECORD_BACKLOG, LineRecorder
from tui.session.record.schema import ReplyRow, reply_row

DAY = 10_000
"""Day of the file, counted from 1970."""
BLOCKS = (3201, 11), (3230, 11), (3255, 2), (7121, 1), (8401, 1), (8604, 1), (9630, 1)
"""Address and length of the reads of each drive."""


def reply_of(device: int, address: int, data: bytes, mono: float, wall: float) -> EndedExchange:
    """A reply with these registers that ends at these times."""
    request = bytes([3]) + address.to_bytes(2, "big") + (len(data) // 2).to_bytes(2, "big")
    reply = bytes([3, len(data)]) + data
    return EndedExchange(device, request, "reply", reply, mono - 0.01, mono, wall, "program")


def values_per_second(folder: Path, registers: int, seconds: float) -> dict[str, float]:
    """Registers per second that a recorder writes, while nothing is lost."""
    worker = LineRecorder(folder, "serial:x", f"line-{registers}")
    replies, begun, cpu = 0, time.monotonic(), time.process_time()
    while time.monotonic() - begun < seconds:
        for _ in range(RECORD_BACKLOG // 4):
            now = time.monotonic()
            data = random.randbytes(2 * registers)
            worker.note(reply_of(1 + replies % 31, 3200, data, now, time.time()))
            replies += 1
        while worker.waiting > RECORD_BACKLOG // 2:
            time.sleep(0.01)
    assert worker.close(60)
    assert not worker.lost
    values = replies * registers
    return {
        "per_second": values / (time.monotonic() - begun),
        "per_cpu_second": values / (time.process_time() - cpu),
    }


class Clock:
    """Simulated time for the recorder, which goes on in real time while it works."""

    def __init__(self) -> None:
        self.mono = 1000.0
        self.began: float | None = None
        """Real time at which the recorder began to work; None while it does not."""

    def monotonic(self) -> float:
        """Return seconds of the simulated monotonic clock."""
        return self.mono + (0.0 if self.began is None else time.monotonic() - self.began)

    def time(self) -> float:
        """Return seconds since 1970; the time begins at noon."""
        return (DAY + 0.5) * 86400 + self.monotonic() - 1000.0


def rows_of_second(
    words: dict[tuple[int, tuple[int, int]], list[int]], at: Clock
) -> list[ReplyRow]:
    """The rows of one second; the registers change."""
    rows = []
    for (device, (address, _)), held in words.items():
        place = random.randrange(len(held))
        held[place] = max(0, held[place] + random.randint(-20, 20))
        data = b"".join(word.to_bytes(2, "big") for word in held)
        mono, wall = at.mono + 0.03 * device, at.time() + 0.03 * device
        rows.append(reply_row(reply_of(1 + device, address, data, mono, wall), "program"))
    return rows


def ring(folder: Path, drives: int, hours: float) -> dict[str, float]:
    """Size, memory and processor time of so many hours of drives that are read once a second."""
    clock, reports = Clock(), list[str]()
    worker = LineRecorder(folder, "serial:x", "line", report=reports.append)
    worker._begin = lambda: None  # type: ignore[method-assign]
    words = {(device, block): [3000] * block[1] for device in range(drives) for block in BLOCKS}
    used, longest, largest, log, replies = 0.0, 0.0, 0, 0, 0
    with ExitStack() as patches:
        for module in (recorder, record_file, ring_files):
            patches.enter_context(patch.object(module, "time", clock))
        for second in range(int(hours * 3600)):
            rows = rows_of_second(words, clock)
            for row in rows:
                worker.note(row)
            replies += len(rows)
            clock.mono += 1.0
            clock.began, cpu = time.monotonic(), time.process_time()
            worker._turn()
            used += time.process_time() - cpu
            longest, clock.began = max(longest, time.monotonic() - clock.began), None
            if second % 60 == 0:
                sizes = {path: path.stat().st_size for path in folder.iterdir()}
                largest = max(largest, sum(sizes.values()))
                log = max(
                    log, *(size for path, size in sizes.items() if path.suffix.endswith("wal"))
                )
        worker._closed = True
        worker._turn()
        worker._close_files()
        oldest = oldest_reply(sorted(folder.glob("*.sqlite")), range(1, drives + 1))
        assert oldest is not None
        assert not reports
        kept = (clock.time() - oldest) / 3600
    return {
        "replies": replies,
        "hours_kept": kept,
        "file_mb": sum(path.stat().st_size for path in folder.iterdir()) / 1e6,
        "largest_mb": largest / 1e6,
        "largest_log_mb": log / 1e6,
        "longest_turn_s": longest,
        "lost": worker.lost,
        "cpu_us_per_reply": used / replies * 1e6,
        "core_percent": used / (hours * 3600) * 100,
        "memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


def main() -> None:
    """Measure, show a table, and print one line of JSON."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--hours", type=float, default=30.0)
    parser.add_argument("--drives", type=int, default=31)
    options = parser.parse_args()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    random.seed(1)
    found: dict[str, Any] = {"benchmark": "record"}
    with tempfile.TemporaryDirectory() as folder:
        for registers in (10, 1):
            found[f"values_of_{registers}"] = values_per_second(
                Path(folder), registers, options.seconds
            )
        found["ring"] = ring(Path(folder) / "ring", options.drives, options.hours)
    table = Table("", "figure")
    for name, figures in found.items():
        if isinstance(figures, dict):
            for figure, value in figures.items():
                table.add_row(f"{name} {figure}", f"{value:,.1f}")
    Console().print(table)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
