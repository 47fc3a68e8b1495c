"""Shared parts of the steps of an acceptance test: the motor, the settings, and the person."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import dataclass
from typing import Any

from tui.drive.settings.parameter_set import ParameterSet

from ..running.watching import latest_of
from .motion import Motion, MotionBench, StepFailed
from .plan import HighSpeed, longest_of
from .result import StepResult
from .step_file import AcceptanceFile
from .steps import (
    MotionStep,
)

SETTLED_HERTZ = 0.3
"""Difference to the reference within which a speed counts as reached."""
AskTurned = Callable[[str], Coroutine[Any, Any, str]]
"""Asks the person which way the motor turned; returns right, left or nothing."""


@dataclass(slots=True)
class StepWork:
    """Shared parts of the steps of one test."""

    bench: MotionBench
    file: AcceptanceFile
    before: ParameterSet
    """Settings of the drive before the test."""
    ask_turned: AskTurned
    high_speed: HighSpeed | None = None
    """The high speed that the person has confirmed."""

    async def run(
        self, hz: float | None, steps: Callable[[], Awaitable[None]], result: StepResult
    ) -> None:
        """Run the motor for a step; its curve goes into the result, whatever the end."""
        step = result.step
        assert isinstance(step, MotionStep)
        motion = Motion(step.direction, hz, longest_of(step))
        try:
            await self.bench.run(motion, steps)
        finally:
            result.curve = self.bench.curve

    async def reach(
        self, hz: float | None, within: float, tolerance: float = SETTLED_HERTZ
    ) -> None:
        """Wait until the motor runs at a frequency. Raises StepFailed."""
        bench = self.bench
        clock = bench.console.session.clock
        begun = clock.monotonic()
        hertz: float | None = None
        while clock.monotonic() - begun < within:
            latest = latest_of(bench.console)
            if latest.time > begun and not latest.error:
                hertz = bench.hertz(latest)
                if hz is None or hertz is None:
                    if latest.state.kind == "running" and latest.state.reached is not False:
                        return
                elif abs(hertz - hz) <= tolerance:
                    return
            await bench.sleep(0.02)
        held = "unknown" if hertz is None else f"{hertz:.1f} Hz"
        goal = "its speed" if hz is None else f"{hz:g} Hz"
        raise StepFailed(f"The motor did not reach {goal} within {within:.1f} s: it is at {held}.")
