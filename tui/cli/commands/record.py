"""`drivepanel record`: values of named codes in a file, always or around triggers."""

from __future__ import annotations

import asyncio
import math
import time
from collections.abc import Coroutine, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from tui.drive.sentences import counted

from ..documents.document import Document, DocumentPart
from ..shared.completion import complete_line_or_code
from ..shared.errors import INTERRUPTED, USAGE, Failure
from ..shared.numbers import FiniteRange, check_rate
from ..shared.numbers import seconds as seconds_range
from ..shared.options import (
    Target,
    connect_drive,
    drives_options,
    every_option,
    force_profile_option,
    json_option,
    line_argument,
    on_line,
    read_only_option,
)
from ..shared.output import iso_time, print_json
from ..shared.registration import ON_LINE, command
from ..shared.say import say
from ..shared.standard_streams import STANDARD

if TYPE_CHECKING:
    from tui.drive.profile.schema import Parameter
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession
    from tui.session.monitor.snapshot import Snapshot
    from tui.session.recording.recording_file import RecordingFile
    from tui.session.recording.triggers import Trigger, TriggeredRows

WRITTEN_AGAIN = 0.5
"""Seconds from one write to the file to the next."""
NOT_TO_OUTPUT = (
    "A recording is a database: it needs a FILE. To print its values as CSV afterward, run:"
    " drivepanel export FILE --out -"
)
LONGEST_AROUND = 3600.0
"""Most seconds before and after a trigger."""


class TriggerField(DocumentPart):
    """A trigger that fired."""

    time: str
    device: int
    text: str


class RecordDocument(Document, kw_only=True):
    """`record`: the file, at the end."""

    command: Literal["record"] = "record"
    file: str
    values: int
    lost: int
    triggers: list[TriggerField]


@dataclass(slots=True)
class RecordOptions:
    """The recording as typed."""

    codes: Sequence[str]
    path: Path
    every: float
    triggers: Sequence[str]
    before: float
    after: float
    seconds: float
    count: float
    as_json: bool


@dataclass(slots=True)
class RecordedDrive:
    """One drive, with the codes that are recorded, and those that its triggers need."""

    session: DriveSession
    codes: list[str]
    triggers: Sequence[Trigger]
    rows: TriggeredRows
    command: str = ""
    """Code of the command word."""
    error: str = ""
    """Why the last cycle failed; empty if it did not."""
    read: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        from tui.drive.orders import chart_codes
        from tui.session.recording.triggers import CommandTrigger, FaultTrigger, LevelTrigger

        profile = self.session.profile
        more: list[str] = []
        for trigger in self.triggers:
            match trigger:
                case LevelTrigger():
                    trigger.code = profile.find(trigger.code).code
                    more.append(trigger.code)
                case FaultTrigger():
                    more += [*chart_codes(profile), profile.data.faults.parameter]
                    more += [chart.status for chart in profile.data.charts]
                case CommandTrigger():
                    self.command = profile.data.charts[0].command
                    more.append(self.command)
        self.read = [code for code in dict.fromkeys((*self.codes, *more)) if code]

    def fired(self, snapshot: Snapshot) -> list[str]:
        """Return the texts of the triggers that a cycle fires."""
        from tui.session.reading import with_text
        from tui.session.recording.triggers import CycleSeen

        if not self.triggers:
            return []
        readings = with_text(snapshot.readings)
        numbers = {code: reading.current_number for code, reading in readings.items()}
        held = readings.get(self.command)
        known = held is not None and held.quality == "good"
        fault = snapshot.state.fault
        look = CycleSeen(
            snapshot.wall,
            {code: number for code, number in numbers.items() if number is not None},
            fault.name if fault is not None else "",
            held.raw if held is not None and known else None,
        )
        return [text for trigger in self.triggers if (text := trigger.fired(look))]


@command("Record values to a file, always or around triggers.", group="Watch", statuses=ON_LINE)
@line_argument
@click.argument(
    "codes", nargs=-1, required=True, metavar="CODE...", shell_complete=complete_line_or_code
)
@drives_options
@every_option
@click.option(
    "--out",
    "path",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write this SQLite file.",
)
@click.option("--force", is_flag=True, help="Replace a file that exists.")
@click.option(
    "--trigger",
    "triggers",
    multiple=True,
    metavar="TRIGGER",
    help="Record around fault, command, 14:30, CODE>9,8; repeatable.",
)
@click.option(
    "--before",
    type=FiniteRange(0, LONGEST_AROUND),
    default=10.0,
    show_default=True,
    metavar="S",
    help="Keep these seconds before a trigger.",
)
@click.option(
    "--after",
    type=FiniteRange(0, LONGEST_AROUND),
    default=30.0,
    show_default=True,
    metavar="S",
    help="Keep these seconds after a trigger.",
)
@click.option(
    "--for",
    "seconds",
    type=seconds_range(above=True),
    metavar="S",
    help="Stop recording after S seconds.",
)
@click.option(
    "--count", type=click.IntRange(min=1), metavar="N", help="Stop recording after N triggers."
)
@force_profile_option
@read_only_option
@json_option
def record(
    target: Target,
    codes: tuple[str, ...],
    every: float,
    path: Path,
    force: bool,
    triggers: tuple[str, ...],
    before: float,
    after: float,
    seconds: float | None,
    count: int | None,
    read_only: bool,
    as_json: bool,
) -> None:
    """Record the values of CODEs until Ctrl-C, as raw words with their times and quality.

    With --trigger, only the seconds around each trigger are recorded. A trigger is a new fault, a
    changed command word, a time of day, or a value that passes a level. The second number of a
    level is the value at which it can fire again: LCR>9,8.
    """
    if path == STANDARD:
        raise click.UsageError(NOT_TO_OUTPUT)
    if path.exists() and not path.is_file():
        raise Failure(f"{path} is not a regular file. Choose another name.", USAGE)
    if path.exists() and not force:
        raise Failure(f"{path} already exists. Choose another name or use --force.", USAGE)
    if count is not None and not triggers:
        raise click.UsageError("--count requires --trigger.")
    check_triggers(triggers)
    wish = RecordOptions(
        codes, path, every, triggers, before, after,
        math.inf if seconds is None else seconds, math.inf if count is None else count, as_json,
    )  # fmt: skip
    work = Recording(wish)
    try:
        on_line(target, lambda opened: work.run(opened, target), read_only=read_only)
    except KeyboardInterrupt:
        work.tell()
        raise Failure("Ended by Ctrl-C.", INTERRUPTED) from None
    work.tell()


def check_triggers(texts: Sequence[str]) -> None:
    """Raise UsageError for the first text that is not a trigger."""
    from tui.session.recording.triggers import TriggerError, parse_trigger

    for text in texts:
        try:
            parse_trigger(text)
        except TriggerError as error:
            raise click.UsageError(str(error)) from None


@dataclass(slots=True)
class Recording:
    """One recording, with what has happened so far."""

    wish: RecordOptions
    file: RecordingFile | None = None
    fired: list[TriggerField] = field(default_factory=list)
    _places: list[tuple[int, Parameter]] = field(default_factory=list)
    _failed: float = 0.0
    """When the disk last refused rows (monotonic); 0 if that was not reported."""

    async def run(self, opened: OpenLine, target: Target) -> None:
        """Record until the end that was typed."""
        from tui.bus.link import label
        from tui.session.connect.recorded_line import recording_is_on
        from tui.session.record.disk_trouble import disk_words
        from tui.session.recording.recording_file import RecordingFile, parameter_events
        from tui.session.recording.triggers import TriggeredRows, parse_trigger

        wish = self.wish
        parsed = [[parse_trigger(text) for text in wish.triggers] for _ in target.each()]
        sessions = [await connect_drive(opened, each) for each in target.each()]
        check_rate(opened.line.link, wish.every, len(sessions))
        rows = TriggeredRows(wish.before, wish.after, always=not wish.triggers)
        drives = []
        for session, triggers in zip(sessions, parsed, strict=True):
            found = dict.fromkeys(session.profile.find(code).code for code in wish.codes)
            drives.append(RecordedDrive(session, list(found), triggers, rows))
        try:  # all that was typed is valid: only now may a file be replaced
            wish.path.unlink(missing_ok=True)
            program = opened.line.facts.me.text
            # the recorder of a real line reports them, too
            report = len if opened.is_real and recording_is_on() else _complain
            self.file = RecordingFile(wish.path, label(opened.line.link), program, report)
        except OSError as error:
            with suppress(OSError):
                wish.path.unlink(missing_ok=True)  # what a full disk took of it
            text = f"{wish.path} cannot be written: {disk_words(error)}. Choose another place."
            raise Failure(text, USAGE) from None
        with closing(self.file):
            for drive in drives:
                session, codes = drive.session, drive.codes
                self.file.add(parameter_events(session, codes))
                self._places += [(session.device, session.profile[code]) for code in codes]
            await self._until_end([self._follow(drive) for drive in drives], wish)

    async def _until_end(
        self, drives: Sequence[Coroutine[object, object, None]], wish: RecordOptions
    ) -> None:
        """Write the rows of the drives until the time or the number of triggers is reached."""
        tasks = [asyncio.create_task(drive) for drive in drives]
        end = time.monotonic() + wish.seconds
        last = math.inf
        try:
            while (now := time.monotonic()) < min(end, last) and not any(t.done() for t in tasks):
                await asyncio.sleep(min(WRITTEN_AGAIN, end - now, last - now))
                self._write()
                if len(self.fired) >= wish.count and last == math.inf:
                    last = time.monotonic() + wish.after
        finally:
            for task in tasks:
                task.cancel()
            for result in await asyncio.gather(*tasks, return_exceptions=True):
                if isinstance(result, Exception):
                    raise result

    def _write(self) -> None:
        assert self.file is not None
        from tui.session.record.recorder import SETTLED_AFTER

        self.file.write()
        path, trouble, now = self.file.path, self.file.trouble, time.monotonic()
        if trouble and not self._failed:
            _complain(f"{path} cannot be written: {trouble}. Trying again.")
        if trouble:
            self._failed = now
        elif self._failed and now - self._failed > SETTLED_AFTER:
            self._failed = 0.0
            _complain(f"{path} is written again.")

    async def _follow(self, drive: RecordedDrive) -> None:
        """Record the cycles of a drive."""
        from tui.session.monitor.monitor import Monitor

        from ..shared.cycles import Cycles

        session = drive.session
        cycles = Cycles(session, drive.read)
        monitor = Monitor(session)
        leave = monitor.listen(cycles.take)
        monitor.start(drive.read, self.wish.every)
        try:
            while True:
                self._take(drive, await cycles.next())
        finally:
            leave()
            monitor.stop()

    def _take(self, drive: RecordedDrive, snapshot: Snapshot) -> None:
        """Record one cycle, if it is always recorded or near a trigger."""
        from tui.session.reading import with_text
        from tui.session.recording.recording_file import rows_of_cycle, trigger_event

        assert self.file is not None
        device, readings = drive.session.device, with_text(snapshot.readings)
        if bool(snapshot.error) != bool(drive.error):
            again = f"Device {device} is recorded again."
            _complain(snapshot.error or again)
        drive.error = snapshot.error
        texts = drive.fired(snapshot)
        rows = rows_of_cycle(device, [readings[code] for code in drive.codes], snapshot.wall)
        events = [trigger_event(device, text, snapshot.wall) for text in texts]
        self.file.add([*drive.rows.take(snapshot.time, rows, fired=bool(texts)), *events])
        for text in texts:
            self.fired.append(TriggerField(iso_time(snapshot.wall), device, text))
            if not self.wish.as_json:
                say(f"{iso_time(snapshot.wall)}  device {device}  {text}")

    def tell(self) -> None:
        """Report the file, as it reads back."""
        from tui.session.recording.recording_file import values_in

        if self.file is None:
            return
        path, found = self.file.path, values_in(self.file.path, self._places)
        lost = self.file.written - found + self.file.lost
        if self.wish.as_json:
            file = str(path)
            print_json(RecordDocument(file=file, values=found, lost=lost, triggers=self.fired))
            return
        say(counted(found, "Recorded 1 value to {path}.", _RECORDED, path=path))
        if lost:
            why = self.file.trouble or "the disk was too slow"
            say(counted(lost, "1 value was lost: {why}.", _LOST, why=why), err=True)


def _complain(text: str) -> None:
    say(f"drivepanel: {text}", err=True)


_RECORDED = "Recorded {count} values to {path}."
_LOST = "{count} values were lost: {why}."
