"""Shared parts of the commands about settings and parameter sets."""

from __future__ import annotations

import asyncio
import re
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from .completion import complete_code
from .errors import (
    DONE,
    DRIVE_REFUSED,
    INTERRUPTED,
    LINE_TROUBLE,
    REFUSED_HERE,
    USAGE,
    Failure,
)
from .options import Target, connect_drive, on_line
from .say import Messages, say_over
from .standard_streams import STANDARD, given_file

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile
    from tui.drive.settings.edits import Edit
    from tui.drive.settings.parameter_set import ParameterSet
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession
    from tui.session.read.upload import Upload
    from tui.session.settings.applied import Result

    from ..documents.parts import EditField, OutcomeText

_REGISTER = re.compile(r", register \d+")
OUTAGE = 20.0
"""Seconds for which a read-out waits for a lost line to come back."""
SET_POLL_INTERVAL = 0.1

file_argument = click.argument("file", type=click.Path(path_type=Path))
force_option = click.option("--force", is_flag=True, help="Replace FILE if it exists.")
confirm_option = click.option(
    "--confirm",
    "confirmed",
    multiple=True,
    metavar="CODE",
    shell_complete=complete_code,
    help="Write this unverified or often written parameter.",
)
save_option = click.option(
    "--save", is_flag=True, help="Save the settings to the drive's EEPROM at the end."
)
round_option = click.option(
    "--round",
    "rounded",
    is_flag=True,
    help="Write values even if rounded to 0 or by half a step.",
)
dry_run_option = click.option(
    "--dry-run", is_flag=True, help="Show what would be written; write nothing."
)


def set_in(path: Path) -> ParameterSet:
    """The parameter set in a file; raises Failure with status 2 for a bad one."""
    from tui.drive.settings.parameter_set import SetError
    from tui.drive.settings.set_file import read_set

    try:
        return read_set(given_file(path))
    except SetError as error:
        raise Failure(str(error), USAGE) from error


def refuse_output(file: Path, *, force: bool, as_json: bool) -> None:
    """Raise an error with status 2 if a file would be lost, or output mixed.

    It is checked before the line is opened.
    """
    if file == STANDARD:
        if as_json:
            raise click.UsageError("Either - or --json: both write to standard output.")
    elif file.exists() and not force:
        raise Failure(f"{file} already exists. Choose another name or use --force.", USAGE)


def write_down(
    file: Path, content: str | bytes, *, force: bool = False, private: bool = False
) -> None:
    """Write a file completely or not at all, or to standard output.

    Raises Failure with status 2 if the file cannot be written.
    """
    from tui.drive.settings.parameter_set import SetError
    from tui.drive.settings.set_file import write_file

    if file == STANDARD:
        sys.stdout.flush()
        sys.stdout.buffer.write(content.encode() if isinstance(content, str) else content)
        sys.stdout.buffer.flush()
        return
    try:
        write_file(file, content, force=force, private=private)
    except SetError as error:
        raise Failure(str(error), USAGE) from error


def complain_absent(messages: Messages, absent: Mapping[str, str]) -> None:
    """Report unreadable parameters and why; those with one reason in one line."""
    reasons: dict[str, list[str]] = {}
    for code, why in absent.items():
        reasons.setdefault(_REGISTER.sub("", why), []).append(code)
    for reason, codes in reasons.items():
        if len(codes) == 1:
            messages.complain(f"{codes[0]} could not be read: {absent[codes[0]]}")
        else:
            messages.complain(f"{len(codes)} could not be read: {', '.join(codes)}. {reason}")


def codes_of(session: DriveSession, names: Iterable[str]) -> frozenset[str]:
    """The codes that a person named in any notation; raises UnknownParameter."""
    return frozenset(session.profile.find(name).code for name in names)


def set_of_drive(
    target: Target, *, settings_only: bool = False
) -> tuple[DriveSession, ParameterSet]:
    """A drive and every readable parameter of it, read now on a line that is not written to."""

    async def work(opened: OpenLine) -> tuple[DriveSession, ParameterSet]:
        session = await connect_drive(opened, target)
        values = await take_set(session, settings_only=settings_only)
        return session, values

    return on_line(target, work, read_only=True)


async def take_set(session: DriveSession, *, settings_only: bool = False) -> ParameterSet:
    """Every readable parameter of a drive, with its identity, as far as it reports one.

    With `settings_only` no measurement, counter or command word is among them.
    """
    from tui.bus.errors import ExchangeError
    from tui.session.connect.identify import identify_drive
    from tui.session.read.upload import Upload, setting_codes

    if session.identity is None and session.profile.function(43) is not None:
        try:
            session.identity = await identify_drive(session.line, session.device)
        except ExchangeError:
            session.identity = None
    codes = setting_codes(session.profile) if settings_only else []
    upload = Upload(session, codes, progress=counter())
    await read_out(upload)
    return upload.parameter_set()


async def read_out(upload: Upload) -> None:
    """Read the rest of an upload; a lost line is awaited for `OUTAGE` seconds.

    Raises the line's errors if it does not return.
    """
    from tui.bus.api import LineStatus
    from tui.bus.errors import LineLost

    line = upload.session.line
    while not upload.done:
        try:
            await upload.run()
        except LineLost:
            end = time.monotonic() + OUTAGE
            while line.state.status is not LineStatus.CONNECTED:
                if time.monotonic() > end:
                    raise
                await asyncio.sleep(SET_POLL_INTERVAL)


def counter() -> Callable[[int, int], None] | None:
    """Shows the progress of reading in one line of a terminal; None without a terminal."""
    if not sys.stderr.isatty():
        return None

    def show(done: int, of: int) -> None:
        say_over(f"Read: {done} of {of}", last=done >= of)

    return show


class ResultTelling:
    """Reports each written or refused setting as soon as it is known, and keeps the reports."""

    def __init__(self, messages: Messages) -> None:
        self.messages = messages
        self.results: dict[str, Result] = {}
        self._of = 0
        self._alike = ""
        """Text of the last unwritten setting, without its code."""
        self._more: list[str] = []
        """Codes of those behind it of which the same is true."""

    def __call__(self, done: int, of: int, result: Result) -> None:
        """One setting: on standard output, or as an error; those that fail alike in one line."""
        code = result.edit.code
        self.results[code] = result
        self._of = max(self._of, of)
        alike = "" if result.done else result.text.replace(code, "", 1)
        if alike and alike == self._alike:
            self._more.append(code)
        else:
            self._tell_more()
            self._alike = alike
            tell = self.messages.tell if result.done else self.messages.complain
            tell(f"{done}/{of}  {result.text}")
        if done >= of:
            self._tell_more()

    def _tell_more(self) -> None:
        more, self._more = self._more, []
        if more:
            self.messages.complain(f"The same of {len(more)} more: {', '.join(more)}.")

    def interrupted(self) -> Failure:
        """The failure after Ctrl-C, with the written settings and the unknown ones."""
        from tui.session.settings.applied import EditOutcome

        outcomes = {code: result.outcome for code, result in self.results.items()}
        written = [code for code, outcome in outcomes.items() if outcome is EditOutcome.DONE]
        if not self.results:
            text = "Ended by Ctrl-C. The first setting may have been written: read it."
            return Failure(text, INTERRUPTED)
        count, names = len(written), ", ".join(written) or "none"
        text = f"Ended by Ctrl-C: {count} of {self._of} written: {names}."
        if sent := ", ".join(c for c, o in outcomes.items() if o is EditOutcome.SENT):
            text = f"{text} Sent, not verified: {sent}."
        if unknown := ", ".join(c for c, o in outcomes.items() if o is EditOutcome.UNKNOWN):
            text = f"{text} May have been written: {unknown}. Read it."
        if len(self.results) < self._of:
            text = f"{text} The next one may have been written too: read it."
        return Failure(text, INTERRUPTED)


def result_fields(results: Iterable[Result]) -> list[EditField]:
    """The result of each edit."""
    return [
        edit_field(
            result.edit,
            outcome=cast("OutcomeText", result.outcome.name.lower().replace("_", "-")),
            held=result.held,
            text=result.text,
        )
        for result in results
    ]


def edit_field(edit: Edit, *, outcome: OutcomeText, held: int | None, text: str) -> EditField:
    """One edit with its result: values with their units as texts, and raw."""
    from ..documents.parts import EditField

    return EditField(
        code=edit.code,
        typed=edit.typed or None,
        old=edit.old_text or None,
        old_raw=edit.old,
        new=edit.text,
        new_raw=edit.new,
        rounded=edit.rounded,
        outcome=outcome,
        held=held,
        text=text,
    )


def status_of_results(results: Iterable[Result]) -> int:
    """The exit status of a number of writes: the worst that has happened."""
    from tui.session.settings.applied import EditOutcome

    table = {
        EditOutcome.DRIVE_REFUSED: DRIVE_REFUSED,
        EditOutcome.NOT_TAKEN: DRIVE_REFUSED,
        EditOutcome.REFUSED: REFUSED_HERE,
        EditOutcome.CHANGED: REFUSED_HERE,
        EditOutcome.HELD_BACK: REFUSED_HERE,
        EditOutcome.UNKNOWN: LINE_TROUBLE,
        EditOutcome.NOT_SENT: LINE_TROUBLE,
    }
    statuses = {
        # a stop is not a line error: a script must not repeat the write automatically
        REFUSED_HERE if r.voided else USAGE if r.is_beyond_limit else table[r.outcome]
        for r in results
        if r.outcome in table
    }
    order = (LINE_TROUBLE, DRIVE_REFUSED, USAGE, REFUSED_HERE)
    return next((status for status in order if status in statuses), DONE)


def need_way_to_save(profile: Profile, codes: Sequence[str] = (), *, save: bool) -> None:
    """Raise UsageError, before anything is written, if a family cannot save these settings.

    Without codes, only a family that saves by a command is checked. Does nothing without `save`.
    """
    from tui.drive.settings.memory_orders import MemoryRefused, save_effect

    if not save or (
        not codes and any(parameter.eeprom_address for parameter in profile.parameters)
    ):
        return
    try:
        save_effect(profile, codes)
    except MemoryRefused as refused:
        raise click.UsageError(f"--save: {refused} Nothing was written; omit --save.") from refused


def say_afterwards(
    messages: Messages,
    profile: Profile,
    after_reset: Iterable[str],
    unsaved: Sequence[str],
    *,
    saved: bool,
) -> None:
    """Report what a person must know after a write."""
    if waiting := ", ".join(after_reset):
        messages.tell(f"In force only after the next reset of the drive: {waiting}.")
    if unsaved and not saved:
        from tui.drive.settings.memory_orders import MemoryRefused, save_effect

        try:
            save_effect(profile, unsaved)
        except MemoryRefused as refused:
            messages.tell(f"Lost at power-off: {', '.join(unsaved)}. {refused}")
        else:
            text = "Lost at power-off until they are saved: --save does that, motor stopped."
            messages.tell(text)
