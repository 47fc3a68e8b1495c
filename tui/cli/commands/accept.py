"""`drivepanel accept`: an acceptance test from a file, with a person at the keyboard."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass, field
from getpass import getuser
from pathlib import Path
from typing import TYPE_CHECKING

import click

from tui.drive.chart import ENABLED_KINDS
from tui.session.signals import BY_SIGNAL

from ..documents.accept_documents import (
    AcceptanceCheckField,
    AcceptanceStepField,
    AcceptDocument,
)
from ..running.buffered_output import BufferedOutput
from ..shared import asking
from ..shared.asking import says_yes
from ..shared.drive_commands import arm_drive, arm_option, complain, need_arming, watched
from ..shared.errors import (
    DIFFERENT,
    DRIVE_REFUSED,
    ENDED_AFTER_WRITING,
    REFUSED_HERE,
    USAGE,
    Failure,
)
from ..shared.options import (
    Target,
    drive_options,
    json_option,
    line_argument,
    never_forced,
    on_line,
    read_only_option,
)
from ..shared.registration import WRITING, command
from ..shared.say import say
from ..shared.sets import write_down
from ..shared.standard_streams import given_file

if TYPE_CHECKING:
    from tui.drive.profile.schema import EvidenceKind
    from tui.session.acceptance.plan import HighSpeed
    from tui.session.acceptance.result import AcceptanceResult
    from tui.session.acceptance.step_file import AcceptanceFile
    from tui.session.connect.open_line import OpenLine
    from tui.session.console import DriveConsole
    from tui.session.drive import DriveSession
    from tui.session.running.ending import Ending

    Prove = Callable[[DriveSession, AcceptanceResult, EvidenceKind], None]
    """Keeps what a test shows about a profile, with the kind of the drive as a person stated."""

UNATTENDED = (
    "An acceptance test needs a person at the keyboard of a terminal: it is never run by a script,"
    " a pipe or in the background. Nothing was sent."
)
TURNED = {"r": "right", "right": "right", "l": "left", "left": "left"}


@command(
    "Run an acceptance test from a file.", group="Run", statuses=(DIFFERENT, *WRITING), acts=True
)
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@line_argument
@drive_options
@arm_option
@click.option("--by", metavar="NAME", help="Put this name in the report (default: login name).")
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="FOLDER",
    help="Write the result to this new folder.",
)
@click.option("--check", is_flag=True, help="Check FILE and show its motions; send nothing.")
@read_only_option
@json_option
@never_forced
def accept(
    file: Path,
    target: Target,
    arm: bool,
    by: str | None,
    out: Path | None,
    check: bool,
    read_only: bool,
    as_json: bool,
) -> None:
    """Carry out the acceptance test in FILE on a drive, and write its result.

    It shows what will move and for how long, and asks once. Ctrl-C, Enter, any stop, a lost line
    or another commander stops the motor and ends the test. Ends with 0 if all passed, with 1
    otherwise, with 6 if it ended early.
    """
    test = _test_in(given_file(file))
    if check:
        for text in plan_lines(test):
            say(text)
        return
    need_arming(arm, "accept runs the motor and tests its reactions")
    if target.profile_id not in (None, test.profile.id):
        text = f"{file} is a test of {test.profile.id}, not of {target.profile_id}."
        raise Failure(text, USAGE)
    accept_test(test, target, by=by, out=out, read_only=read_only, as_json=as_json)


def accept_test(
    test: AcceptanceFile,
    target: Target,
    *,
    by: str | None = None,
    out: Path | None = None,
    read_only: bool = False,
    as_json: bool = False,
    prove: Prove | None = None,
) -> None:
    """Carry out a test on a drive with a person at the terminal; --arm was given.

    `prove` keeps what the test shows about the profile. Raises Failure and Exit with the status.
    """
    _need_person()
    folder = out or Path(f"{test.path.stem}-{time.strftime('%Y%m%d-%H%M%S')}")
    if folder.exists():
        raise Failure(f"{folder} already exists. Name a new folder with --out.", USAGE)
    wanted = target._replace(profile_id=test.profile.id)
    session = AcceptSession(test, wanted, folder, by or _login_name(), as_json, prove)
    status = on_line(wanted, session.work, read_only=read_only)
    if status:
        raise click.exceptions.Exit(status)


def _test_in(path: Path) -> AcceptanceFile:
    """Return the test in a file; raises Failure with status 2 for a bad one."""
    from tui.session.acceptance.step_file import AcceptanceFileError, read_test

    try:
        return read_test(path)
    except AcceptanceFileError as error:
        raise Failure(str(error), USAGE) from error


def _need_person() -> None:
    """Raise Failure unless a person can see the question and stop the motor."""
    from ..running.keyboard import person_is_here

    if not person_is_here():
        raise Failure(UNATTENDED, REFUSED_HERE)


def _login_name() -> str:
    with suppress(OSError, KeyError):
        return getuser()
    return "unknown"


def plan_lines(test: AcceptanceFile, high: HighSpeed | None = None) -> list[str]:
    """Return the steps that move the motor or trip the drive, and the longest time of the runs."""
    from tui.session.acceptance.plan import REST_LINES, longest_motion, planned_motions

    motions = planned_motions(test, high)
    if not motions:
        return [f"{test.test.name}: {len(test.steps)} steps. None moves the motor."]
    longest = longest_motion(test)
    total = f" The motor runs for {longest:.0f} s at most, without its stops." if longest else ""
    return [f"{test.test.name}: {len(test.steps)} steps.{total}", *motions, *REST_LINES]


@dataclass(slots=True)
class AcceptSession:
    """One test on an open line, with its person and its files."""

    test: AcceptanceFile
    target: Target
    folder: Path
    by: str
    as_json: bool
    prove: Prove | None = None
    _kind: EvidenceKind = "unknown"
    _stack: ExitStack = field(default_factory=ExitStack)
    _ending: Ending | None = None
    _begun: bool = False

    async def work(self, opened: OpenLine) -> int:
        """Carry out the test; return the exit status. Its motor is at standstill afterwards."""
        from tui.session.acceptance.acceptance_run import AcceptanceRun
        from tui.session.acceptance.profile_test import with_reset
        from tui.session.running.ending import Ending
        from tui.session.running.watching import latest_of
        from tui.session.starts.keeper import StartKeeper

        loop, ending = asyncio.get_running_loop(), Ending()

        def gone() -> None:
            with suppress(RuntimeError):  # the loop has ended: nothing runs any more
                loop.call_soon_threadsafe(ending.end, "its output is no longer read")

        voice = None if self.as_json else BufferedOutput(gone)
        with ending.by_signals(), self._stack:
            try:
                async with watched(opened, self.target, StartKeeper("accept")) as (fleet, console):
                    if self.prove is not None and latest_of(console).state.motion == "fault":
                        self.test = with_reset(self.test)
                    run = AcceptanceRun(
                        fleet,
                        console,
                        self.test,
                        ending,
                        _stamped(voice.say) if voice else lambda _: None,
                        complain,
                        self._ask_turned,
                        self.by,
                    )
                    result = await run.carry_out(
                        lambda high: self._confirm(opened, console, ending, high)
                    )
            finally:
                if voice:
                    voice.finish()
        self._report(result)
        if run.not_stopped:
            raise Failure(run.not_stopped, DRIVE_REFUSED)
        if self.prove is not None and self._begun:
            self.prove(console.session, result, self._kind)
        return self._status(result, ending)

    def _status(self, result: AcceptanceResult, ending: Ending) -> int:
        if result.passed:
            return 0
        if ending.number:
            return BY_SIGNAL + ending.number
        return ENDED_AFTER_WRITING if result.ended_by else DIFFERENT

    async def _confirm(
        self, opened: OpenLine, console: DriveConsole, ending: Ending, high: HighSpeed | None
    ) -> None:
        """Show what will move; arm after a yes. Raises Failure, with nothing written."""
        from ..running.confirming import drive_kind
        from ..running.keyboard import ended_by_typing

        _may_arm(console)
        self._need_standstill(console)
        for text in plan_lines(self.test, high):
            say(text, err=True)
        if not await says_yes(f"Carry out this test on device {console.device}?"):
            raise Failure("Not confirmed. Nothing was tested.", REFUSED_HERE)
        if self.prove is not None:
            self._kind = await drive_kind(opened)
        self._need_standstill(console)
        _may_arm(console)
        try:
            self.folder.mkdir(parents=True)
        except OSError as error:
            text = f"{self.folder}: cannot be made: {error.strerror or error}."
            raise Failure(text, USAGE) from error
        self._begun = True
        self._ending = ending
        self._stack.enter_context(ended_by_typing(ending))

    def _resets(self) -> bool:
        """Return True if the test of a profile resets a fault before anything else."""
        from tui.session.acceptance.steps import ResetStep

        first = self.test.steps[:1]
        return self.prove is not None and any(isinstance(step, ResetStep) for step in first)

    def _need_standstill(self, console: DriveConsole) -> None:
        """Raise Failure if the drive runs, is in fault, or its state is not known."""
        from tui.session.running.watching import latest_of

        state = latest_of(console).state
        if state.motion == "fault" and not self._resets():
            text = (
                f"Not tested: device {console.device} is in fault. Clear its cause, then:"
                f" drivepanel reset {self.target.line_text} -d {console.device} --arm"
            )
            raise Failure(text, REFUSED_HERE)
        if state.motion in (*ENABLED_KINDS, "unknown"):
            text = f"Not tested: device {console.device} is {state.headline}. Stop it first."
            raise Failure(text, REFUSED_HERE)

    async def _ask_turned(self, question: str) -> str:
        """Ask which way the motor turned; return nothing for any answer but r and l."""
        from ..running.keyboard import ended_by_typing

        self._stack.close()  # what is typed now is the answer
        try:
            answer = await asking.typed_answer(f"{question} [r right / l left]")
        finally:
            if self._ending is not None:
                self._stack.enter_context(ended_by_typing(self._ending))
        return TURNED.get(answer.casefold(), "")

    def _report(self, result: AcceptanceResult) -> None:
        """Write the files of the result, and print it."""
        from tui.session.acceptance.report_files import curve_files, result_junit, result_markdown

        from ..shared.output import json_text, print_json

        stem = self.test.path.stem
        curves = curve_files(result, stem)
        document = accept_document(
            self.target.line_text, result, {n: name for n, (name, _) in curves.items()},
            str(self.folder) if self._begun else None,
        )  # fmt: skip
        files = {
            f"{stem}.json": json_text(document) + "\n",
            f"{stem}.md": result_markdown(result, curves),
            f"{stem}.xml": result_junit(result),
            **dict(curves.values()),
        }
        try:  # before anything is printed: its reader may have gone
            for name, text in files.items() if self._begun else ():
                write_down(self.folder / name, text)
        finally:
            if self.as_json:
                print_json(document)
            else:
                say("PASSED." if result.passed else f"NOT PASSED. {result.why_not}")
        if self._begun and not self.as_json:
            say(f"Result: {self.folder / stem}.md, .json and .xml")


def _may_arm(console: DriveConsole) -> None:
    """Raise OrderRefused or Failure if the drive may not be armed now."""
    arm_drive(console)
    console.session.arming.disarm()


def _stamped(put: Callable[[str], None]) -> Callable[[str], None]:
    return lambda text: put(f"{time.strftime('%H:%M:%S')}  {text}")


def accept_document(
    line: str, result: AcceptanceResult, curves: dict[int, str], folder: str | None
) -> AcceptDocument:
    """Return the result as a document; `curves` are file names by step."""
    from ..shared.output import iso_time

    return AcceptDocument(
        line=line,
        device=result.device,
        profile=result.profile,
        name=result.name,
        passed=result.passed,
        why_not=result.why_not or None,
        begun=iso_time(result.begun),
        ended=iso_time(result.ended),
        ended_by=result.ended_by or None,
        by=result.by,
        panel=result.panel,
        profile_version=result.profile_version,
        identity=dict(result.identity),
        file=result.file,
        file_hash=result.file_hash,
        settings_hash=result.settings_hash or None,
        settings_hash_after=result.settings_after or None,
        folder=folder,
        steps=[
            AcceptanceStepField(
                number=step.number,
                kind=step.step.kind,
                name=step.title,
                outcome=step.outcome,
                text=step.text or None,
                seconds=round(step.seconds, 2),
                checks=[
                    AcceptanceCheckField(
                        name=check.name, value=check.value, limit=check.limit, passed=check.passed
                    )
                    for check in step.checks
                ],
                curve=curves.get(step.number),
            )
            for step in result.steps
        ],
    )
