"""A whole acceptance test of one drive, step by step; its result is complete at every end."""

from __future__ import annotations

import asyncio
import hashlib
import time
from collections.abc import Callable, Coroutine
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

import tui
from tui.bus.errors import LineError
from tui.drive.errors import DriveError
from tui.drive.settings.parameter_set import ParameterSet

from ..console import DriveConsole
from ..fleet import Fleet
from ..read.upload import Upload, setting_codes
from ..running.ending import Ending, MotorStopped, MotorTripped, NotStopped
from .carry_out import carry_out_step
from .motion import TEST_PERIOD, AcceptanceEnded, MotionBench
from .plan import HighSpeed, read_high_speed
from .result import AcceptanceResult, StepResult, settings_hash
from .step_file import MEASURED, AcceptanceFile
from .step_work import AskTurned, StepWork
from .steps import moves_motor

MOTOR_NOT_RUN = "The motor is not run after a failed step."
NOT_REACHED = "The test ended before this step."


@dataclass(slots=True)
class AcceptanceRun:
    """One test of one drive, in the loop of its program."""

    fleet: Fleet
    console: DriveConsole
    file: AcceptanceFile
    ending: Ending
    say: Callable[[str], None]
    """Reports progress."""
    warn: Callable[[str], None]
    """Reports at once that the motor could not be stopped yet."""
    ask_turned: AskTurned
    by: str
    """Person who runs the test."""
    result: AcceptanceResult = field(init=False)
    not_stopped: str = field(default="", init=False)
    """Why the motor could not be stopped; empty if it is at standstill."""
    _motor_may_run: bool = field(default=True, init=False)
    _before: ParameterSet | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        session, profile = self.console.session, self.console.session.profile
        identity = session.identity
        texts = {} if identity is None else {
            "vendor": identity.vendor,
            "reference": identity.reference,
            "version": identity.version_text,
            "name": identity.name,
        }  # fmt: skip
        self.result = AcceptanceResult(
            name=self.file.test.name,
            line=session.line_text,
            device=session.device,
            profile=profile.id,
            family=profile.name,
            profile_version=profile.data.profile.version,
            panel=tui.__version__,
            by=self.by,
            file=self.file.path.name,
            file_hash=hashlib.sha256(self.file.text.encode()).hexdigest(),
            begun=time.time(),
            steps=[StepResult(n, step) for n, step in enumerate(self.file.steps, start=1)],
            identity={key: text for key, text in texts.items() if text},
        )

    async def carry_out(
        self, confirm: Callable[[HighSpeed | None], Coroutine[Any, Any, None]]
    ) -> AcceptanceResult:
        """Read the settings, have the motions confirmed, and carry out every step.

        `confirm` gets the high speed of the drive, and raises if the person does not agree; then
        nothing was written. Raises the errors of the first read-out.
        """
        loop = asyncio.get_running_loop()
        bench = MotionBench(self.fleet, self.console, self.ending, self.say, self.warn)

        def end(why: str) -> None:
            with suppress(RuntimeError):  # the loop has ended: nothing runs any more
                loop.call_soon_threadsafe(self.ending.end, why)

        events = self.console.session.line.facts.events
        leave = events.subscribe(lambda event: bench.hear(event, end))
        try:
            self.say("Reading the settings.")
            self._before = await bench.unless_ended(self._settings())
            self.result.settings_hash = settings_hash(self._before)
            self.result.settings_read = len(self._before.raws)
            self.result.unreadable = len(self._before.absent)
            high = await bench.unless_ended(read_high_speed(self.console))
            await bench.unless_ended(confirm(high))
            self._watch()
            await self._steps(StepWork(bench, self.file, self._before, self.ask_turned, high))
        except AcceptanceEnded as error:
            self.result.ended_by = str(error).rstrip(".")
        finally:
            leave()
        self.result.ended = time.time()
        return self.result

    def _watch(self) -> None:
        """Poll faster, with every value that the steps need."""
        profile = self.console.session.profile
        codes = [p.code for q in MEASURED if (p := profile.quantity(q)) is not None]
        reference = profile.quantity("command_frequency")
        if reference is not None and reference.access != "w":
            codes.append(reference.code)
        self.console.monitor.start(period=TEST_PERIOD, extra=codes)

    async def _settings(self) -> ParameterSet:
        upload = Upload(self.console.session, setting_codes(self.console.session.profile))
        await upload.run()
        return upload.parameter_set()

    async def _steps(self, work: StepWork) -> None:
        bench = work.bench
        for step in self.result.steps:
            step.text = NOT_REACHED
        for step in self.result.steps:
            bench.check()
            if moves_motor(step.step) and not self._motor_may_run:
                step.text = MOTOR_NOT_RUN
                self.say(f"{step.number}. {step.title}: not run. {step.text}")
                continue
            await self._step(work, step)
        bench.check()
        self.say("Reading the settings again.")
        after = await bench.unless_ended(self._settings())
        self.result.settings_after = settings_hash(after)

    async def _step(self, work: StepWork, step: StepResult) -> None:
        """Carry out one step. Raises AcceptanceEnded."""
        step.begun, begun = time.time(), time.monotonic()
        self.say(f"{step.number}. {step.title}")
        try:
            await carry_out_step(work, step)
            step.outcome, step.text = "passed", ""
        except (DriveError, LineError) as error:
            step.outcome, step.text = "failed", str(error)
            # after a trip no later step may run it either
            may = step.step.goes_on and not isinstance(error, MotorStopped)
            self._motor_may_run = self._motor_may_run and may
            if isinstance(error, NotStopped):
                self.not_stopped = str(error)
                self.ending.end(str(error))
            elif isinstance(error, LineError):
                self.ending.end(f"the line failed: {error}")
            elif isinstance(error, MotorStopped) and not isinstance(error, MotorTripped):
                self.ending.end(str(error))
        finally:
            step.seconds = time.monotonic() - begun
        self.say(f"{step.number}. {step.title}: {step.outcome}. {step.text}".rstrip())
        work.bench.check()
