"""`drivepanel watch`: values of a drive, cycle after cycle."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..shared.errors import LINE_TROUBLE, Failure, told
from ..shared.left_alone import timeout_json, timeout_of
from ..shared.options import (
    Target,
    connect_drive,
    drive_options,
    force_profile_option,
    json_option,
    line_argument,
    on_line,
    read_only_option,
)
from ..shared.watch_outputs import JsonOutput, Output, csv_output, text_output

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession
    from tui.session.monitor.snapshot import Snapshot

SNAPSHOTS_WAITING = 64
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
@force_profile_option
@read_only_option
@json_option
@told
def watch(
    target: Target,
    codes: tuple[str, ...],
    every: float,
    count: int | None,
    csv_path: Path | None,
    read_only: bool,
    as_json: bool,
) -> None:
    """Watch parameters of a drive, by default its monitoring set.

    What can no longer be read keeps its last value with the quality stale. Ctrl-C ends it.
    """

    async def work(opened: OpenLine) -> None:
        from tui.session.monitor.rates import monitoring_codes

        session = await connect_drive(opened, target)
        wanted = [session.profile.find(code).code for code in codes] or None
        shown = wanted or monitoring_codes(session.profile)
        timeout = timeout_json(await timeout_of(opened, session)) if as_json else None
        with ExitStack() as stack:
            outputs = [
                JsonOutput(target.line_text, session, timeout)
                if as_json
                else stack.enter_context(text_output())
            ]
            if csv_path is not None:
                outputs.append(stack.enter_context(csv_output(csv_path, session, shown)))
            await _follow(session, wanted, shown, every, count, outputs)

    with suppress(KeyboardInterrupt):
        on_line(target, work, read_only=read_only)


async def _follow(
    session: DriveSession,
    codes: list[str] | None,
    shown: list[str],
    every: float,
    count: int | None,
    outputs: Sequence[Output],
) -> None:
    """Hand every cycle to the outputs; `shown` are all codes that they are to hold.

    Raises Failure where `count` cycles passed and the drive never answered.
    """
    from tui.session.monitor.monitor import Monitor

    loop = asyncio.get_running_loop()
    cycles: asyncio.Queue[Snapshot] = asyncio.Queue(SNAPSHOTS_WAITING)

    def put(snapshot: Snapshot) -> None:
        if cycles.full():
            cycles.get_nowait()
        cycles.put_nowait(snapshot)

    def hand_over(snapshot: Snapshot) -> None:
        loop.call_soon_threadsafe(put, snapshot)

    monitor = Monitor(session)
    leave = monitor.listen(hand_over)
    monitor.start(codes, every)
    first_error = ""
    answered = False
    try:
        for _ in itertools.repeat(None) if count is None else range(count):
            snapshot = await cycles.get()
            answered = answered or bool(snapshot.readings)
            first_error = first_error or snapshot.error
            for output in outputs:
                output.take(_complete(session, snapshot, shown))
    finally:
        leave()
        monitor.stop()
    if not answered:
        raise Failure(first_error, LINE_TROUBLE)


def _complete(session: DriveSession, snapshot: Snapshot, shown: list[str]) -> Snapshot:
    """The cycle with all codes in their order; what was never read is bad, and says why."""
    from tui.session.reading import Reading

    readings = {
        code: snapshot.readings.get(code)
        or Reading.bad(session.profile[code], snapshot.time, snapshot.error)
        for code in shown
    }
    return replace(snapshot, readings=readings)
