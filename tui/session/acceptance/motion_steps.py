"""Steps that run the motor: direction, ramps, speeds and stops."""

from __future__ import annotations

from tui.drive.units import factor_between
from tui.drive.values import NOT_AVAILABLE, Value

from ..reading import Reading, with_text
from ..running.watching import latest_of
from ..shown import Quality
from .curve import ramp_seconds
from .motion import StepFailed
from .plan import ramp_within, stop_within
from .result import StepResult
from .step_file import MEASURED
from .step_work import SETTLED_HERTZ, StepWork
from .steps import (
    DirectionStep,
    RampStep,
    SpeedsStep,
    StopStep,
    ValueLimits,
)


async def run_direction(work: StepWork, step: DirectionStep, result: StepResult) -> None:
    """Run for some seconds; compare the drive's own direction, and what the person has seen."""
    seen: set[str] = set()
    signs: set[str] = set()

    async def look() -> None:
        bench = work.bench
        clock = bench.console.session.clock
        end = clock.monotonic() + step.seconds
        while clock.monotonic() < end:
            latest = latest_of(bench.console)
            if not latest.error and latest.state.kind == "running" and latest.state.direction:
                seen.add(latest.state.direction)
            await bench.sleep(0.05)
        signs.update("reverse" if p.hertz < 0 else "forward" for p in bench.curve.points if p.hertz)

    await work.run(step.hz, look, result)
    for name, values in (("Status word", seen), ("Output frequency", signs)):
        if values:
            text = ", ".join(sorted(values))
            result.check(name, text, step.direction, passed=values == {step.direction})
    if not seen and not signs and not step.turns:
        raise StepFailed(
            "The drive reports no direction. Add `turns` to this step, to ask the person."
        )
    if step.turns:
        question = f"Which way did the motor turn ({step.direction}), toward the end of its shaft?"
        turned = await work.bench.unless_ended(work.ask_turned(question))
        result.check(
            "Seen by the person", turned or "not stated", step.turns, passed=turned == step.turns
        )


async def measure_ramp(work: StepWork, step: RampStep, result: StepResult) -> None:
    """Time the ramp up to the reference, and down to standstill by the ramp stop."""
    hz = step.hz or 0.0
    base = step.base or hz

    async def accelerate() -> None:
        await work.reach(hz, ramp_within(step))
        await work.bench.sleep(0.5)

    await work.run(hz, accelerate, result)
    curve, stopped = work.bench.curve, work.bench.stopped_at
    for name, wanted, points, ends in (
        ("Acceleration", step.up, curve.since(0.0, stopped), (0.0, hz)),
        ("Deceleration", step.down, curve.since(stopped), (hz, 0.0)),
    ):
        if wanted is None:
            continue
        seconds = ramp_seconds(points, *ends, base)
        limit = f"{wanted:g} s ± {step.tolerance:g} s for {base:g} Hz"
        value = "not measured: too few values" if seconds is None else f"{seconds:.2f} s"
        near = seconds is not None and abs(seconds - wanted) <= step.tolerance
        result.check(name, value, limit, passed=near)


async def measure_speeds(work: StepWork, step: SpeedsStep, result: StepResult) -> None:
    """Run at each speed; read all values at its end."""
    speeds = [percent / 100 * (step.hz or 0.0) for percent in step.percent]

    async def visit() -> None:
        for percent, hz in zip(step.percent, speeds, strict=True):
            if hz != speeds[0]:
                await work.bench.refer(round(hz, 2))
            await work.reach(hz, step.settle, max(step.tolerance, SETTLED_HERTZ))
            work.bench.curve.marks.append(
                (work.bench.console.session.clock.monotonic(), f"{percent:g} %")
            )
            await work.bench.sleep(step.seconds)
            await _read_values(work, step, f"{percent:g} %", hz, result)

    await work.run(round(speeds[0], 2), visit, result)


async def _read_values(
    work: StepWork, step: SpeedsStep, speed: str, hz: float, result: StepResult
) -> None:
    profile, console = work.file.profile, work.bench.console
    found = {q: p.code for q in MEASURED if (p := profile.quantity(q)) is not None}
    readings = with_text(await console.read(found.values()))
    for quantity, code in found.items():
        reading = readings[code]
        name, limits = f"{speed}: {MEASURED[quantity]}", step.limits.get(quantity)
        held = _in_unit(reading, limits.unit) if limits else reading.value
        good = reading.quality is Quality.GOOD and held is not None
        value = f"{held.text} {held.unit}".rstrip() if held and good else NOT_AVAILABLE
        number = float(held.number) if held and good and held.number is not None else None
        if quantity == "output_frequency" and limits is None:
            near = number is not None and abs(abs(number) - hz) <= step.tolerance
            result.check(name, value, f"{hz:g} Hz ± {step.tolerance:g} Hz", passed=near)
        elif limits is not None:
            result.check(name, value, _limit_text(limits), passed=_within(number, limits))
        elif number is not None:
            result.check(name, value, "", passed=True)


def _in_unit(reading: Reading, unit: str) -> Value | None:
    """Return a value in a unit: as the drive reports it, or as a share of its rating."""
    found = (reading.value, reading.physical)
    return next((v for v in found if v is not None and factor_between(v.unit, unit) == 1), None)


def _within(number: float | None, limits: ValueLimits) -> bool:
    if number is None:
        return False
    above = limits.max is not None and number > limits.max
    return not above and not (limits.min is not None and number < limits.min)


def _limit_text(limits: ValueLimits) -> str:
    parts = [("at least", limits.min), ("at most", limits.max)]
    return ", ".join(f"{word} {n:g} {limits.unit}" for word, n in parts if n is not None)


async def measure_stop(work: StepWork, step: StopStep, result: StepResult) -> None:
    """Run, then stop by the method; time the standstill."""
    seconds = 0.0

    async def stop() -> None:
        nonlocal seconds
        await work.reach(step.hz, step.settle)
        await work.bench.sleep(step.seconds)
        seconds = await work.bench.stop_by(step.method, stop_within(step))

    await work.run(step.hz, stop, result)
    limit, near = f"{step.min:g} to {step.max:g} s", step.min <= seconds <= step.max
    result.check(f"Time of {step.method}", f"{seconds:.2f} s", limit, passed=near)
