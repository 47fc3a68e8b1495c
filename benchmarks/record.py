"""Cost of the record of a line: rows and values per second, and the size of a day.

    python -m benchmarks.record [--seconds S] [--hours H] [--drives N]

- `values`: replies of ten registers and of one go through a recorder into its file, in one process
  on one core: registers per second of processor time, and of the time of day;
- `day`: each drive is read once a second, by the seven reads of a cycle of Monitor (Altivar 71).
  Their registers wander. The rows of so many hours are written with the times that they would
  have, as fast as the disk accepts them. The file, its memory and its processor time are those of
  a day; the clock is not.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import tempfile
import time
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from tui.bus.model import EndedExchange
from tui.session.record.reader import RecordReader
from tui.session.record.record_file import RecordFile
from tui.session.record.recorder import RECORD_BACKLOG, LineRecorder
from tui.session.record.ring import record_path
from tui.session.record.schema import ReplyRow, reply_row

DAY = 10_000
"""Day of the file, counted from 1970."""
BLOCKS = (3201, 11), (3230, 11), (3255, 2), (7121, 1), (8401, 1), (8604, 1), (9630, 1)
"""Address and length of the reads of each drive."""
WRITTEN_EVERY = 1.0
EXPIRED_EVERY = 10.0


def reply_of(device: int, address: int, data: bytes, mono: float, wall: float) -> EndedExchange:
    """A reply with these registers that ends at these times."""
    request = bytes([3]) + address.to_bytes(2, "big") + (len(data) // 2).to_bytes(2, "big")
    reply = bytes([3, len(data)]) + data
    return EndedExchange(device, request, "reply", reply, mono - 0.01, mono, wall, "program")


def values_per_second(folder: Path, registers: int, seconds: float) -> dict[str, float]:
    """Registers per second that a recorder writes, while nothing is lost."""
    recorder = LineRecorder(folder, "serial:x", f"line-{registers}")
    replies, begun, cpu = 0, time.monotonic(), time.process_time()
    while time.monotonic() - begun < seconds:
        for _ in range(RECORD_BACKLOG // 4):
            now = time.monotonic()
            data = random.randbytes(2 * registers)
            recorder.note(reply_of(1 + replies % 31, 3200, data, now, time.time()))
            replies += 1
        while recorder.waiting > RECORD_BACKLOG // 2:
            time.sleep(0.01)
    assert recorder.close(60)
    assert not recorder.lost
    values = replies * registers
    return {
        "per_second": values / (time.monotonic() - begun),
        "per_cpu_second": values / (time.process_time() - cpu),
    }


def rows_of_day(drives: int, hours: float, begun: float) -> Iterator[tuple[float, list[ReplyRow]]]:
    """The rows of each second, and its time."""
    words = {(device, block): [3000] * block[1] for device in range(drives) for block in BLOCKS}
    for second in range(int(hours * 3600)):
        rows = []
        for (device, (address, _)), held in words.items():
            at = random.randrange(len(held))
            held[at] = max(0, held[at] + random.randint(-20, 20))
            data = b"".join(word.to_bytes(2, "big") for word in held)
            mono = begun + second + 0.03 * device
            wall = DAY * 86400 + second + 0.03 * device
            rows.append(reply_row(reply_of(1 + device, address, data, mono, wall), "program"))
        yield begun + second, rows


def day(folder: Path, drives: int, hours: float) -> dict[str, float]:
    """Size, memory and processor time of so many hours of drives that are read once a second."""
    path = record_path(folder, "day", DAY)
    file, begun = RecordFile(path, "serial:x", "benchmark"), time.monotonic()
    largest_log, making, cpu, replies = 0, 0.0, time.process_time(), 0
    mark = time.process_time()
    for mono, rows in rows_of_day(drives, hours, begun):
        making += time.process_time() - mark
        file.write(rows, ())
        replies += len(rows)
        if (mono - begun) % EXPIRED_EVERY < WRITTEN_EVERY:
            file.end_window(round(mono * 1e6))
            while file.expire(DAY * 86400 + mono - begun, mono):
                pass
            largest_log = max(largest_log, os.stat(f"{path}-wal").st_size)
            file.flush()
        mark = time.process_time()
    used = time.process_time() - cpu - making
    file.close(shrink=True)
    with closing(RecordReader(path)) as reader:
        found = sum(1 for _ in reader.reduced(1, BLOCKS[0][0], 0, 1 << 62))
    return {
        "replies": replies,
        "file_mb": path.stat().st_size / 1e6,
        "largest_log_mb": largest_log / 1e6,
        "cpu_us_per_reply": used / replies * 1e6,
        "core_percent": used / (hours * 3600) * 100,
        "reduced_rows_of_a_register": found,
        "memory_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


def main() -> None:
    """Measure, show a table, and print one line of JSON."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--hours", type=float, default=8.0)
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
        found["day"] = day(Path(folder), options.drives, options.hours)
    table = Table("", "figure")
    for name, figures in found.items():
        if isinstance(figures, dict):
            for figure, value in figures.items():
                table.add_row(f"{name} {figure}", f"{value:,.1f}")
    Console().print(table)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
