"""`drivepanel watch`: values of a drive, cycle after cycle."""

from __future__ import annotations

import asyncio
import csv
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

import click

from .errors import told
from .options import Target, connect, drive_options, json_option, line_argument, on_line

if TYPE_CHECKING:
    from tui.session.drive_session import DriveSession
    from tui.session.lines import OpenLine
    from tui.session.monitor import Snapshot

WAITING_LONGEST = 64
"""Snapshots kept for an output that is slower than the line; older ones are dropped."""


@click.command()
@line_argument
@click.argument("codes", nargs=-1, metavar="[CODE...]")
@drive_options
@click.option(
    "--every",
    type=click.FloatRange(min=0.05),
    default=1.0,
    show_default=True,
    metavar="S",
    help="Wished time of a cycle in seconds.",
)
@click.option("--count", type=click.IntRange(min=1), metavar="N", help="End after N cycles.")
@click.option(
    "--csv",
    "csv_path",
    type=click.Path(dir_okay=False, writable=True, path_type=Path),
    metavar="FILE",
    help="Also write the engineering values to a CSV file.",
)
@json_option
@told
def watch(
    line_text: str,
    codes: tuple[str, ...],
    device: int,
    profile_id: str | None,
    rated_current: float | None,
    every: float,
    count: int | None,
    csv_path: Path | None,
    as_json: bool,
) -> None:
    """Watch parameters of a drive, by default its monitoring set.

    Values that could not be read stay with the quality stale; Ctrl-C ends it.
    """
    target = Target(line_text, device, profile_id, rated_current)

    async def work(opened: OpenLine) -> None:
        session = await connect(opened, target)
        wanted = [session.profile.find(code).code for code in codes] or None
        with (
            csv_path.open("w", newline="", encoding="utf-8") if csv_path else nullcontext() as file
        ):
            await _follow(session, wanted, every, count, _Output(line_text, session, file, as_json))

    try:
        on_line(line_text, work)
    except KeyboardInterrupt:
        return


class _Output:
    """Where the cycles go: standard output and perhaps a CSV file."""

    def __init__(
        self, line_text: str, session: DriveSession, file: TextIO | None, as_json: bool
    ) -> None:
        self._line_text = line_text
        self._session = session
        self._csv = csv.writer(file) if file else None
        self._file = file
        self._as_json = as_json
        self._titled = False

    def take(self, snapshot: Snapshot) -> None:
        """Print one cycle."""
        from .output import iso_time, print_json, readings_json

        time = iso_time(snapshot.wall)
        if self._as_json:
            data = readings_json(self._line_text, self._session, snapshot.readings)
            print_json({"time": time, **data}, compact=True)
        else:
            print(_sentence(time, snapshot), flush=True)
        if self._csv is not None:
            self._write(time, snapshot)

    def _write(self, time: str, snapshot: Snapshot) -> None:
        assert self._csv is not None
        assert self._file is not None
        readings = snapshot.readings
        if not self._titled and readings:
            titles = [f"{c} [{r.unit}]" if r.unit else c for c, r in readings.items()]
            self._csv.writerow(["time", *titles, "error"])
            self._titled = True
        good = [r.text if r.quality == "good" else "" for r in readings.values()]
        self._csv.writerow([time, *good, snapshot.error])
        self._file.flush()


def _sentence(time: str, snapshot: Snapshot) -> str:
    """One cycle as a line of text; stale values in brackets."""
    parts = []
    for code, reading in snapshot.readings.items():
        shown = f"{reading.text} {reading.unit}".rstrip()
        parts.append(f"{code} {shown if reading.quality == 'good' else f'({shown}, old)'}")
    trouble = f"  {snapshot.error}" if snapshot.error else ""
    return f"{time[11:23]}  {snapshot.state.headline}  " + "  ".join(parts) + trouble


async def _follow(
    session: DriveSession,
    codes: list[str] | None,
    every: float,
    count: int | None,
    output: _Output,
) -> None:
    """Print every cycle; raises the first one's error where nothing was ever read."""
    loop = asyncio.get_running_loop()
    cycles: asyncio.Queue[Snapshot] = asyncio.Queue(WAITING_LONGEST)

    def put(snapshot: Snapshot) -> None:
        if cycles.full():
            cycles.get_nowait()
        cycles.put_nowait(snapshot)

    def hand_over(snapshot: Snapshot) -> None:
        loop.call_soon_threadsafe(put, snapshot)

    leave = session.monitor.listen(hand_over)
    session.monitor.start(codes, every)
    try:
        done = 0
        while count is None or done < count:
            snapshot = await cycles.get()
            if snapshot.readings or snapshot.error:
                output.take(snapshot)
            done += 1
    finally:
        leave()
        session.close()
