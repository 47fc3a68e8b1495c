"""`drivepanel watch`: values of one drive or several, cycle after cycle."""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Awaitable, Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click

from ..shared.completion import complete_line_or_code
from ..shared.csv_files import CsvFile, refuse_unasked, rotation
from ..shared.drives import failed
from ..shared.errors import DONE, INTERRUPTED, LINE_TROUBLE, Failure, end_with, failure_of
from ..shared.numbers import check_rate
from ..shared.options import (
    Target,
    connect_drive,
    drives_options,
    every_option,
    force_profile_option,
    json_option,
    on_line,
    read_only_option,
)
from ..shared.output import print_json
from ..shared.registration import ON_LINE, command
from ..shared.several_lines import (
    LineWish,
    connected,
    further_lines,
    lines_argument,
    lines_wished,
    on_lines,
)
from ..shared.silence import silence_hint
from ..shared.standard_streams import STANDARD
from ..shared.watch_outputs import (
    CsvOutput,
    JsonOutput,
    LabelsNeeded,
    Output,
    WatchedDrive,
    csv_columns,
    csv_units,
    text_output,
)

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession


@dataclass(slots=True)
class CsvOptions:
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
                raise click.UsageError("--append, --force and --rotate require --csv FILE.")
            return
        if self.append and self.force:
            raise click.UsageError("Either --append or --force.")
        if self.path == STANDARD and (self.append or self.rotate is not None):
            raise click.UsageError("--append and --rotate require --csv FILE, not standard output.")
        refuse_unasked(self.path, append=self.append, force=self.force)

    def opened(self, watched: Sequence[WatchedDrive], several: LabelsNeeded) -> CsvOutput | None:
        """The file with the columns of these drives; None without --csv."""
        if self.path is None:
            return None
        units = csv_units(watched)
        titles = [column.title for column in csv_columns(watched, units, several)]
        self.file = CsvFile(
            self.path, titles, append=self.append, force=self.force, rotate=self.rotate
        )
        return CsvOutput(self.file, units, several)


@command("Poll parameters and print every cycle.", group="Watch", statuses=ON_LINE)
@lines_argument
@click.argument("codes", nargs=-1, metavar="[CODE...]", shell_complete=complete_line_or_code)
@drives_options
@every_option
@click.option(
    "--count", type=click.IntRange(min=1), metavar="N", help="Stop polling after N cycles."
)
@click.option(
    "--csv",
    "csv_path",
    type=click.Path(dir_okay=False, writable=True, path_type=Path),
    metavar="FILE",
    help="Write the engineering values to a CSV file too.",
)
@click.option("--append", is_flag=True, help="Add to a CSV file that exists.")
@click.option("--force", is_flag=True, help="Replace a CSV file that exists.")
@click.option(
    "--rotate",
    callback=rotation,
    metavar="SIZE|day",
    help="Start a new CSV file at this size (10MB) or each day.",
)
@force_profile_option
@read_only_option
@json_option
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
    """Poll parameters of drives, by default their monitoring set. Ctrl-C ends it.

    To watch several lines, put their LINEs before the CODEs; LINE@ADDRESS names a drive on its
    line, as in pump@1,2 or tcp:HOST@5.

    A value is good if it was read in that cycle. Otherwise it is the last one, with the quality
    stale and the time at which it was read. State and direction are shown if the status word is
    watched.
    """
    more, codes = further_lines(codes)
    wishes = lines_wished(target, more)
    wish = CsvOptions(csv_path, append, force, rotate)
    wish.check()
    if as_json and csv_path == STANDARD:
        raise click.UsageError("Either --csv - or --json: both write to standard output.")
    seen = CyclesSeen()

    async def work(lines: Sequence[OpenLine]) -> None:
        pairs = list(zip(lines, wishes, strict=True))
        found, seen.missing = await find_drives(pairs, as_json=as_json)
        watched = [_watched(session, item, codes) for item, session in found]
        drives = sum(len(item.on(opened)) for opened, item in pairs)
        for opened, item in pairs:
            check_rate(opened.line.link, every, len(item.on(opened)))
        several = LabelsNeeded(lines=len(wishes) > 1, drives=drives > 1)
        with ExitStack() as stack:
            outputs: list[Output] = []
            if as_json:
                outputs.append(JsonOutput(several))
            elif csv_path != STANDARD:
                outputs.append(stack.enter_context(text_output(watched, several)))
            if (csv_output := wish.opened(watched, several)) is not None:
                outputs.append(csv_output)
            await asyncio.gather(
                *(_follow(drive, every, count, outputs, seen) for drive in watched)
            )

    try:
        if len(wishes) > 1:
            on_lines(wishes, work, read_only=read_only)
        else:
            on_line(wishes[0].drives[0], lambda opened: work([opened]), read_only=read_only)
    except KeyboardInterrupt:
        raise Failure(seen.at_the_end(wish), INTERRUPTED) from None
    finally:
        if wish.file is not None:
            wish.file.close()
    if seen.silent:
        raise Failure(seen.silent, LINE_TROUBLE)
    end_with(seen.missing)


@dataclass(slots=True)
class CyclesSeen:
    """Cycles reported so far."""

    cycles: int = 0
    silent: str = ""
    """Why the last cycle of a drive brought nothing; empty where each brought its values."""
    missing: int = 0
    """The highest status of the drives that were not there at the start."""

    def at_the_end(self, wish: CsvOptions) -> str:
        """Return the summary in a sentence."""
        count = wish.file.rows if wish.file is not None else 0
        if wish.path is None:
            return f"Ended by Ctrl-C after {self.cycles} cycles."
        return f"Ended by Ctrl-C after {self.cycles} cycles; {count} rows written to {wish.path}."


def _watched(session: DriveSession, line: LineWish, codes: Sequence[str]) -> WatchedDrive:
    """A drive with the codes that were named, else its monitoring set."""
    from tui.session.monitor.rates import monitoring_codes

    profile = session.profile
    shown = [profile.find(code).code for code in codes] or monitoring_codes(profile)
    return WatchedDrive(session, shown, line.text, line.name)


async def _follow(
    drive: WatchedDrive,
    every: float,
    count: int | None,
    outputs: Sequence[Output],
    seen: CyclesSeen,
) -> None:
    """Hand every cycle of a drive to the outputs."""
    from tui.session.monitor.monitor import Monitor

    from ..shared.cycles import Cycles

    cycles = Cycles(drive.session, drive.codes)
    monitor = Monitor(drive.session)
    leave = monitor.listen(cycles.take)
    monitor.start(drive.codes, every)
    error = since = ""
    try:
        for _ in itertools.repeat(None) if count is None else range(count):
            snapshot = await cycles.next()
            error = snapshot.error
            since = (since or error) if error else ""  # the first of a row of errors says most
            for output in outputs:
                output.take(drive, snapshot)
            seen.cycles += 1
    finally:
        leave()
        monitor.stop()
    if error:
        seen.silent = since


T = TypeVar("T")
FoundOnLines = list[tuple[LineWish, "DriveSession"]]


async def find_drives(
    lines: Sequence[tuple[OpenLine, LineWish]], *, as_json: bool
) -> tuple[FoundOnLines, int]:
    """The drives that answer, in order, and the highest status of the others.

    An error of one of several drives is reported; that of a single drive is raised.
    """
    wanted = sum(len(wish.on(opened)) for opened, wish in lines)
    found = _Finding(alone=wanted == 1, several=len(lines) > 1, as_json=as_json)
    each = await asyncio.gather(*(found.on_line(opened, wish) for opened, wish in lines))
    return [pair for some in each for pair in some], found.worst


class _Finding:
    """Finds drives, and reports those that it does not find."""

    def __init__(self, *, alone: bool, several: bool, as_json: bool) -> None:
        self.worst = DONE
        self._alone = alone
        self._several = several
        self._as_json = as_json

    async def on_line(self, opened: OpenLine, wish: LineWish) -> FoundOnLines:
        """The drives of one line."""
        drives = wish.on(opened)
        there = partial(_there, opened, wish)
        if self._several and not await self._done(there, opened, wish, drives):
            return []
        found: FoundOnLines = []
        for drive in drives:
            connect = partial(connect_drive, opened, drive)
            made = await self._done(connect, opened, wish, [drive])
            found += [(wish, made)] if made is not None else []
        return found

    async def _done(
        self,
        work: Callable[[], Awaitable[T]],
        opened: OpenLine,
        wish: LineWish,
        drives: Sequence[Target],
    ) -> T | None:
        try:
            return await work()
        except Exception as error:
            if self._alone:
                raise
            failure = failure_of(error)
            self.worst = max(self.worst, failure.status)
            first = wish.drives[0]
            by_profile = first.profile_id is not None
            hint = silence_hint(error, opened, first.line_text, by_profile=by_profile)
            text = failure.message + hint
            for drive in drives:
                reported = failed(drive, text, failure.status, wish.name if self._several else "")
                if self._as_json:
                    print_json(reported, compact=True)
            return None


async def _there(opened: OpenLine, wish: LineWish) -> bool:
    await connected(opened, wish.name)
    return True
