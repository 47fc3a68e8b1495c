"""The table of steps: how each kind is carried out, and when it has failed."""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Mapping
from types import MappingProxyType
from typing import Any

from .limit_steps import run_limit, run_loss
from .motion import StepFailed
from .motion_steps import measure_ramp, measure_speeds, measure_stop, run_direction
from .result import StepResult
from .step_work import StepWork
from .still_steps import check_refused, check_settings, reset_fault

STEP_WORK: Mapping[str, Callable[[StepWork, Any, StepResult], Awaitable[None]]] = MappingProxyType(
    {
        "settings": check_settings,
        "refused": check_refused,
        "direction": run_direction,
        "ramp": measure_ramp,
        "speeds": measure_speeds,
        "stop": measure_stop,
        "limit": run_limit,
        "communication-loss": run_loss,
        "reset": reset_fault,
    }
)


async def carry_out_step(work: StepWork, result: StepResult) -> None:
    """Carry out a step; its checks go into the result.

    Raises StepFailed if a check is outside its limit, AcceptanceEnded, and errors.
    """
    await STEP_WORK[result.step.kind](work, result.step, result)
    if failed := [check.text for check in result.checks if not check.passed]:
        raise StepFailed(" ".join(failed))
