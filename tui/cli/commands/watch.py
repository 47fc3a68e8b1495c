"""`drivepanel watch`: values of one drive or several, cycle after cycle."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from ..shared.completion import complete_code
from ..shared.csv_files import CsvFile, refuse_unasked, rotation
from ..shared.errors import INTERRUPTED, LINE_TROUBLE, Failure, told
from ..shared.options import (
    Target,
    connect_drive,
    drives_options,
    force_profile_option,
    json_option,
    line_argument,
    on_line,
    read_only_option,
)
from ..shared.watch_outputs import (
    CsvOutput,
    JsonOutput,
    Output,
    csv_titles,
    csv_units,
    text_output,
)

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession


@dataclass(slots=True)
class CsvWish:
    """The file that is wanted, and the one that is written once the drives are known."""

    path: Path | None
    append: bool
    force: bool
    rotate: int | str | None
    file: CsvFile | None = None

    def check(self) -> None:
        """Raise Failure where a file would be lost, UsageError for options without a file."""
        if self.path is None:
            if self.append or self.force or self.rotate is not None:
                raise click.UsageError("--append, --force and --rotate go with --csv FILE.")
            return
        if self.append and self.force:
            raise click.UsageError("Either --append or --force.")
        refuse_unasked(self.path, append=self.append, force=self.force)

    def opened(self, watched: Sequence[tuple[DriveSession, list[str]]]) -> CsvOutput | None:
        """The file with the columns of these drives; None where none is wanted."""
        if self.path is None:
            return None
        units = csv_units(watched)
        titles = csv_titles(watched, units)
        self.file = CsvFile(
            self.path, titles, append=self.append, force=self.force, rotate=self.rotate
        )
        return CsvOutput(self.file, units, several=len(watched) > 1)


@click.command()
@line_argument
@click.argument("codes", nargs=-1, metavar="[CODE...]", shell_complete=complete_code)
@drives_options
@click.option(
    "--every",
    type=click.FloatRange(min=0.05),
    default=1.0,
    show_default=True,
    metavar="S",
    help="Target cycle time in seconds.",
)
@click.option("--count", type=click.IntRange(min=1), metavar="N", help="End after N cycles.")
@click.option(
    "--csv",
    "csv_path",
    type=click.Path(dir_okay=False, writable=True, path_type=Path),
    metavar="FILE",
    help="Also write the engineering values to a CSV file.",
)
@click.option("--append", is_flag=True, help="Continue a CSV file that exists.")
@click.option("--force", is_flag=True, help="Replace a CSV file that exists.")
@click.option(
    "--rotate",
    callback=rotation,
    metavar="SIZE|day",
    help="Rename the CSV file, with the time in its name, at this size (10MB) or when the day ends,"
    " and begin a new one.",
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
    append: bool,
    force: bool,
    rotate: int | str | None,
    read_only: bool,
    as_json: bool,
) -> None:
    """Watch parameters of drives, by default their monitoring set. Ctrl-C ends it.

    A value is good if it was read in that cycle; otherwise it is the last one, with the quality
    stale and the time at which it was read. State and direction are told while the status word
    is watched.
    """
    wish = CsvWish(csv_path, append, force, rotate)
    wish.check()
    seen = CyclesSeen()

    async def work(opened: OpenLine) -> None:
        from tui.session.monitor.rates import monitoring_codes

        sessions = [await connect_drive(opened, one) for one in target.each()]
        watched = [
            (one, [one.profile.find(code).code for code in codes] or monitoring_codes(one.profile))
            for one in sessions
        ]
        several = len(sessions) > 1
        with ExitStack() as stack:
            outputs: list[Output] = [
                JsonOutput(target.line_text)
                if as_json
                else stack.enter_context(text_output(several=several))
            ]
            if (csv_output := wish.opened(watched)) is not None:
                outputs.append(csv_output)
            await asyncio.gather(
                *(_follow(one, shown, every, count, outputs, seen) for one, shown in watched)
            )

    try:
        on_line(target, work, read_only=read_only)
    except KeyboardInterrupt:
        raise Failure(seen.at_the_end(wish), INTERRUPTED) from None
    finally:
        if wish.file is not None:
            wish.file.close()
    if seen.silent:
        raise Failure(seen.silent, LINE_TROUBLE)


@dataclass(slots=True)
class CyclesSeen:
    """What was told so far."""

    cycles: int = 0
    silent: str = ""
    """Why a drive never answered; empty while all did."""

    def at_the_end(self, wish: CsvWish) -> str:
        """What was told and written, in a sentence."""
        count = wish.file.rows if wish.file is not None else 0
        rows = f"; {count} rows written to {wish.path}" if wish.path is not None else ""
        return f"Ended by Ctrl-C after {self.cycles} cycles{rows}."


async def _follow(
    session: DriveSession,
    shown: list[str],
    every: float,
    count: int | None,
    outputs: Sequence[Output],
    seen: CyclesSeen,
) -> None:
    """Hand every cycle of a drive to the outputs; `shown` are all codes that they are to hold."""
    from tui.session.monitor.monitor import Monitor

    from ..shared.cycles import Cycles

    cycles = Cycles(session, shown)
    monitor = Monitor(session)
    leave = monitor.listen(cycles.take)
    monitor.start(shown, every)
    first_error = ""
    answered = False
    try:
        for _ in itertools.repeat(None) if count is None else range(count):
            snapshot = await cycles.next()
            answered = answered or any(r.raw is not None for r in snapshot.readings.values())
            first_error = first_error or snapshot.error
            for output in outputs:
                output.take(session, snapshot)
            seen.cycles += 1
    finally:
        leave()
        monitor.stop()
    if not answered and first_error:
        seen.silent = first_error
