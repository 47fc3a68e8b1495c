"""From errors to exit statuses and one or two lines for a person."""

from __future__ import annotations

import functools
import logging
import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, ParamSpec, TypeVar

import click

from tui.drive.sentences import first_of

from .say import say
from .standard_streams import STANDARD

if TYPE_CHECKING:
    from tui.session.journal import Journal

DONE, DIFFERENT, USAGE, LINE_TROUBLE, DRIVE_REFUSED, REFUSED_HERE, ENDED_AFTER_WRITING = range(7)
OWN_ERROR = 70
OUTPUT_LOST = 74
"""Standard output cannot be written: the disk is full, for example."""
INTERRUPTED = 130
NOTHING_SENT = (USAGE, REFUSED_HERE)
"""Statuses that promise that nothing was written."""
WRITES_NAMED = 6
_JOURNALS = "drivepanel.journals"

P = ParamSpec("P")
R = TypeVar("R")
ClickError = click.ClickException | click.exceptions.Exit
"""The two ways in which a command ends with a status of its own."""


class Failure(click.ClickException):
    """An error with its exit status, printed as plain lines on standard error."""

    def __init__(self, message: str, status: int) -> None:
        super().__init__(message)
        self.status = status

    @property
    def exit_code(self) -> int:  # type: ignore[override]
        """The status with which the process ends."""
        return self.status

    def show(self, file: object = None) -> None:
        """Print the message on standard error."""
        say(f"drivepanel: {self.message}", err=True)


@contextmanager
def file_failures(path: Path) -> Iterator[None]:
    """Raise errors of writing this file as Failure: status 2, for standard output 74.

    BrokenPipeError passes if the reader of standard output has exited.
    """
    try:
        yield
    except FileExistsError as error:
        text = f"{path} already exists. Choose another name or use --force."
        raise Failure(text, USAGE) from error
    except OSError as error:
        why = error.strerror or str(error)
        if path != STANDARD:
            raise Failure(f"{path} cannot be written: {why}.", USAGE) from error
        if isinstance(error, BrokenPipeError):
            raise
        raise Failure(_LOST.format(why=why), OUTPUT_LOST) from error


_LOST = "What was printed is lost: standard output cannot be written: {why}."


@contextmanager
def plain_errors(*, as_json: bool) -> Iterator[None]:
    """Turn usage errors and Ctrl-C into a Failure; with `as_json` print every error as JSON too."""
    try:
        try:
            yield
        except click.UsageError as error:
            path = error.ctx.command_path if error.ctx is not None else _command_path()
            command = path.removesuffix(" panel")
            text = f"{error.format_message()}\nTry '{command} --help'."
            raise Failure(text, USAGE) from error
        except (KeyboardInterrupt, click.Abort) as error:
            raise Failure("Ended by Ctrl-C.", INTERRUPTED) from error
    except click.ClickException as error:
        if as_json:
            from ..documents.document import ErrorDocument
            from .output import command_name, print_json

            with suppress(OSError):
                document = ErrorDocument(
                    command=command_name(), error=error.format_message(), status=error.exit_code
                )
                print_json(document, compact=True)
        raise


def _command_path() -> str:
    """Return the words that call the present command."""
    from .output import command_name

    name = command_name()
    return f"drivepanel {name}" if name else "drivepanel"


def status_of(error: Exception) -> int | None:
    """The exit status of a known error; None for an unexpected one."""
    from tui.bus.errors import DeviceException, LineError, LinkSyntaxError, RequestRefused
    from tui.drive.blocks.assignment import MappingError
    from tui.drive.errors import (
        DriveError,
        ProfileError,
        UnknownParameter,
        UnknownProfile,
        ValueRefused,
        ValueUndetermined,
    )
    from tui.session.blocks.write import AssignmentRefused
    from tui.session.command.access import NotFollowed
    from tui.session.running.ending import MotorStopped, MotorTripped, NotStopped
    from tui.session.settings.write import NotTaken
    from tui.simulator.errors import SimulatorError

    table: tuple[tuple[type[Exception], int], ...] = (
        (LinkSyntaxError, USAGE),
        (UnknownProfile, USAGE),
        (UnknownParameter, USAGE),
        (ProfileError, USAGE),
        (ValueUndetermined, REFUSED_HERE),
        (ValueRefused, USAGE),
        (AssignmentRefused, REFUSED_HERE),
        (MappingError, USAGE),
        (SimulatorError, USAGE),
        (RequestRefused, REFUSED_HERE),
        (NotTaken, DRIVE_REFUSED),
        (NotFollowed, DRIVE_REFUSED),
        (NotStopped, DRIVE_REFUSED),
        (MotorTripped, DRIVE_REFUSED),
        (MotorStopped, ENDED_AFTER_WRITING),
        (DriveError, REFUSED_HERE),
        (DeviceException, DRIVE_REFUSED),
        (LineError, LINE_TROUBLE),
    )
    return next((status for kind, status in table if isinstance(error, kind)), None)


def _tell_lost_output(*, acts: bool) -> None:
    """Report a lost output. Raises Failure if the output is the result of the command."""
    from .standard_streams import output_lost

    if lost := output_lost():
        text = _LOST.format(why=lost)
        if not acts:
            raise Failure(text, OUTPUT_LOST)
        say(f"drivepanel: {text}", err=True)


def failure_of(error: Exception) -> Failure:
    """A known error with its exit status. Raises an unexpected error again."""
    if isinstance(error, click.ClickException):
        return Failure(error.format_message(), error.exit_code)
    status = status_of(error)
    if status is None:
        raise error
    return Failure(str(error), status)


def end_with(status: int) -> None:
    """End the command with a status other than 0; raises Exit."""
    if status != DONE:
        raise click.exceptions.Exit(status)


def note_journal(journal: Journal) -> None:
    """Include the writes of a journal in the final message of this command."""
    if (context := click.get_current_context(silent=True)) is not None:
        context.meta.setdefault(_JOURNALS, []).append(journal)


def _writes_text() -> str:
    """A sentence with what this command has written so far; empty if it has written nothing."""
    context = click.get_current_context(silent=True)
    journals: list[Journal] = [] if context is None else context.meta.get(_JOURNALS, [])
    written = [f"{entry.code} = {entry.new}" for journal in journals for entry in journal.sent]
    names = list(dict.fromkeys(written))
    return f"Sent by this command: {first_of(names, WRITES_NAMED)}." if names else ""


def _with_writes(error: ClickError) -> ClickError:
    """The same end, with status 6 instead of 2 or 5 if something was written."""
    if error.exit_code not in NOTHING_SENT or not (text := _writes_text()):
        return error
    if isinstance(error, click.ClickException):
        return Failure(f"{error.format_message()}\n{text}", ENDED_AFTER_WRITING)
    say(f"drivepanel: {text}", err=True)
    return click.exceptions.Exit(ENDED_AFTER_WRITING)


def reported(command: Callable[P, R], *, acts: bool = False) -> Callable[P, R]:
    """Turn what a command raises into a message and an exit status; never a traceback."""

    @functools.wraps(command)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            result = command(*args, **kwargs)
            sys.stdout.flush()  # a closed pipe is still distinguishable from an error here
            _tell_lost_output(acts=acts)
            return result
        except click.Abort:
            raise
        except (click.ClickException, click.exceptions.Exit) as error:
            if (truly := _with_writes(error)) is not error:
                raise truly from error
            raise
        except BrokenPipeError:
            # the reader of the output has exited, so no message can reach it
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise click.exceptions.Exit(DONE) from None
        except Exception as error:
            status = status_of(error)
            if status is None:
                logging.getLogger(__name__).exception("unforeseen error")
                from tui.session.logs import log_file

                raise Failure(
                    f"Internal error: {type(error).__name__}: {error}\n"
                    f"The details are in {log_file()}.",
                    OWN_ERROR,
                ) from error
            logging.getLogger(__name__).info("%s: %s", type(error).__name__, error)
            raise _with_writes(Failure(str(error), status)) from error

    return wrapped
