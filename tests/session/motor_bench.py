"""A motor in the time of a test, with the bench of an acceptance test around it."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import replace
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import patch

from tui.drive.profile import library
from tui.drive.settings.parameter_set import ParameterSet, SetHead
from tui.drive.shown import shown
from tui.session.acceptance import carry_out, motion, motion_steps, step_work
from tui.session.acceptance.curve import RunCurve, RunPoint
from tui.session.acceptance.motion import Motion, MotionBench
from tui.session.acceptance.plan import HighSpeed
from tui.session.acceptance.step_work import StepWork
from tui.session.acceptance.steps import AcceptanceStep
from tui.session.reading import Reading
from tui.session.running.ending import Ending
from tui.session.shown import Quality

PROFILE = library.load("atv312")
SET_HEAD = SetHead("atv312", "1.0", "Altivar 312", "2026-11-22T09:40:54+01:00", "x", 4, "0.2", {})
RATE = 20.0
"""Hz that the motor gains or loses in a second."""
FREQUENCY = PROFILE.quantity("output_frequency")
assert FREQUENCY is not None


def reading(code: str, raw: int | None, at: float, quality: Quality = Quality.GOOD) -> Reading:
    """A reading of a parameter with its value."""
    parameter = PROFILE[code]
    if raw is None:
        return Reading.bad(parameter, at, "no answer")
    return Reading(parameter, raw, shown(PROFILE, parameter, raw, {}), quality, at)


class Motor:
    """A drive and its motor; the time goes on while the test waits."""

    def __init__(self, **how: Any) -> None:
        self.now, self.hertz, self.wanted = 100.0, 0.0, 0.0
        self.kind, self.fault = "ready", ""
        self.direction = "forward"
        self.log: list[str] = []
        self.cycle = 0
        self.most = math.inf
        """Highest frequency that the motor reaches."""
        self.reported: str | None = None
        """The direction that the drive reports, if it is another one."""
        self.stays, self.unread, self.failing = False, False, ""
        """True if it does not stop, or if its frequency is not read; why its cycles fail."""
        self.turned = ""
        self.raws: dict[str, int | None] = {}
        self.answers: dict[str, Any] = {}
        """By a call: what it returns or raises."""
        vars(self).update(how)

    def pass_time(self, seconds: float) -> None:
        end = self.now + seconds
        while self.now < end - 1e-9:
            self.now += 0.02
            goal = min(self.wanted, self.most) if self.kind == "running" else 0.0
            step = max(-RATE * 0.02, min(RATE * 0.02, goal - self.hertz))
            self.hertz = round(self.hertz + (0.0 if self.stays and step < 0 else step), 3)
            if self.kind == "stopping" and not self.hertz:
                self.kind = "ready"
        self.cycle += 1

    async def sleep(self, seconds: float) -> None:
        self.pass_time(seconds)

    @property
    def latest(self) -> Any:
        direction = self.direction if self.reported is None else self.reported
        state = SimpleNamespace(
            kind=self.kind, direction=direction, local=False, headline=self.kind,
            reached=self.hertz >= self.wanted,
            fault=SimpleNamespace(code=self.fault) if self.fault else None,
        )  # fmt: skip
        raw = None if self.unread else round(10 * self.hertz)
        assert FREQUENCY is not None
        readings = {FREQUENCY.code: reading(FREQUENCY.code, raw, self.now)}
        return SimpleNamespace(
            time=self.now, read_at=self.now, error=self.failing, readings=readings, state=state,
            cycle=self.cycle,
        )  # fmt: skip

    async def read(self, codes: Iterable[str]) -> Mapping[str, Reading]:
        self.log.append(f"read {' '.join(codes := list(codes))}")
        own = {FREQUENCY.code: round(10 * self.hertz), "LCr": 21, **self.raws} if FREQUENCY else {}
        return {code: reading(code, own.get(code), self.now) for code in codes}

    def call(self, text: str) -> Any:
        """Log a call; return or raise what is set for it."""
        self.log.append(f"{self.now - 100:.2f} {text}")
        found = self.answers.get(text)
        if isinstance(found, Exception):
            raise found
        return found

    def put(self, _: object) -> Any:
        """Take a write of a reference."""
        found = self.call("put a write")
        self.wanted = found if isinstance(found, float) else self.wanted
        return found

    def order(self, order: str) -> Any:
        """Take a command; a fault with a code is reset by it."""
        self.kind = "ready" if self.fault else self.kind
        return self.call(f"order {order}")

    def stop(self, _: object, order: str, by: str) -> None:
        self.call(f"stop {order} by {by}")
        self.kind = "stopping" if not self.stays else "running"


class MotorBench(MotionBench):
    """A bench whose runs begin and end at once."""

    motor: Motor

    async def run(self, motion: Motion, steps: Callable[[], Awaitable[None]]) -> None:
        motor = self.motor
        motor.call(f"run {motion.direction} {motion.hz} {motion.at_most:.1f}")
        motor.kind, motor.wanted, motor.direction = "running", motion.hz or 30.0, motion.direction
        self.curve, self.stopped_at = RunCurve(PROFILE), 0.0
        try:
            await steps()
        finally:
            if not self.stopped_at:
                self.stopped_at = motor.now
            motor.kind, motor.stays = "stopping", False
            await self.sleep(4.0)

    async def unless_ended(self, work: Any) -> Any:
        return await work

    async def refer(self, hz: float) -> None:
        self.motor.call(f"refer {hz:g}")
        self.motor.wanted = hz

    async def sleep(self, seconds: float) -> None:
        sign = -1 if self.motor.direction == "reverse" else 1
        for _ in range(max(1, round(seconds / 0.1))):
            self.motor.pass_time(min(seconds, 0.1))
            if not self.curve.points or self.motor.now > self.curve.points[-1].time + 0.09:
                self.curve.points.append(RunPoint(self.motor.now, sign * self.motor.hertz, 2.0))

    def permit(self, *, after_end: bool = False) -> Any:
        self.motor.call("permit after the end" if after_end else "permit")

    def disarm(self) -> None:
        self.motor.call("disarm")


class ProverFake:
    """Returns the proof that is set for the motor."""

    def __init__(self, session: Any, journal: object, permit: object, turning: bool) -> None:
        self.session, self.turning = session, turning
        self.report: Callable[[str], None]

    async def prove(self) -> Any:
        self.report(f"proving, turning {self.turning}")
        return self.session.motor.call("prove")


def bench_of(motor: Motor, step: AcceptanceStep, stack: ExitStack) -> StepWork:
    """The parts of a step, with fakes in the place of the drive's own."""
    facts = SimpleNamespace(commander=lambda _: None)
    session = SimpleNamespace(
        profile=PROFILE, motor=motor, device=4, clock=SimpleNamespace(monotonic=lambda: motor.now),
        work=SimpleNamespace(permit=lambda: "permit", put=motor.put),
        image=SimpleNamespace(raws={}), line=SimpleNamespace(facts=facts),
    )  # fmt: skip
    commander = SimpleNamespace(
        check_run=lambda way, text: motor.call(f"check {way} {text}"),
        order=motor.order, given=None,
    )  # fmt: skip
    console = SimpleNamespace(
        session=session, commander=commander, read=motor.read, device=4,
        journal=SimpleNamespace(add=lambda entry: motor.call(f"journal {entry}")),
    )  # fmt: skip
    fleet = SimpleNamespace(stop=motor.stop, stopper=SimpleNamespace(reports={}))

    async def outcome(_: object, work: Callable[[], object]) -> Any:
        if isinstance(found := work(), Exception):
            raise found
        return SimpleNamespace(text="the outcome")

    async def high(_: object) -> Any:
        return motor.call("high speed")

    async def ask(question: str) -> str:
        motor.call(f"ask {question}")
        return motor.turned

    slept = SimpleNamespace(sleep=motor.sleep)
    replaced: dict[Any, dict[str, Any]] = {
        motion: {"asyncio": slept, "latest_of": lambda _: motor.latest},
        step_work: {"latest_of": lambda _: motor.latest},
        motion_steps: {"latest_of": lambda _: motor.latest},
        carry_out: {
            "latest_of": lambda _: motor.latest, "outcome_or_error": outcome, "Prover": ProverFake,
            "read_high_speed": high, "proof_entry": lambda session, proof: proof.text,
        },
    }  # fmt: skip
    for module, names in replaced.items():
        for name, value in names.items():
            stack.enter_context(patch.object(module, name, value))
    bench = MotorBench(
        cast(Any, fleet), cast(Any, console), Ending(), lambda text: motor.call(f"say {text}"),
        lambda text: motor.call(f"warn {text}"),
    )  # fmt: skip
    bench.motor = motor
    before = ParameterSet(
        SET_HEAD, {"ACC": 30, "dEC": 45, "HSP": 500, "LSP": 0, "CHP": 0, "Inr": 1}
    )
    wanted = ParameterSet(SET_HEAD, {"ACC": 30, "dEC": 30, "HSP": 600, "LSP": 0})
    file = SimpleNamespace(profile=PROFILE, sets={1: wanted, 2: replace(before)})
    return StepWork(bench, cast(Any, file), before, ask, HighSpeed(50.0, "HSP"))
