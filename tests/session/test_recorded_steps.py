"""Steps of an acceptance test on a motor of the test's own time, and their reports, as text.

`recorded_steps.txt` has a section for each subject: for each case its calls, checks and error.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import msgspec
import pytest

from tests.recorded import sections
from tui.bus.errors import DeviceException, NoAnswer
from tui.drive.errors import DriveError, ValueRefused
from tui.drive.profile import library
from tui.drive.shown import shown
from tui.session.acceptance.carry_out import carry_out_step
from tui.session.acceptance.curve import RunCurve, RunPoint, curve_svg, ramp_seconds
from tui.session.acceptance.motion import AcceptanceEnded
from tui.session.acceptance.plan import HighSpeed
from tui.session.acceptance.report_files import curve_files, result_junit, result_markdown
from tui.session.acceptance.result import AcceptanceResult, StepResult
from tui.session.acceptance.steps import STEP_KINDS
from tui.session.proof.prover import NothingToProve
from tui.session.reading import Reading
from tui.session.running.ending import MotorStopped
from tui.session.shown import Quality

from .motor_bench import PROFILE, Motor, bench_of

TEXTS = Path(__file__).parent / "recorded_steps.txt"
PROOF = SimpleNamespace(
    configured=2.0, reaction=SimpleNamespace(name="Freewheel stop"), text="tripped", as_set=True
)
FULL = {"hz": 40.0, "percent": [100.0]}
LOSS = {"timeout": 2.0}
TURNING = {**LOSS, "turning": True, "hz": 20.0}
BACK = {"hz": 20.0, "direction": "reverse"}
LEFT = {"hz": 20.0, "turns": "left"}
HIGH = {"high speed": HighSpeed(50.0, "HSP")}
PROVED = {"answers": {"prove": PROOF}}


def within(quantity: str = "motor_current", **limits: object) -> dict[str, Any]:
    """A step at one speed with limits of a value."""
    return {**FULL, "limits": {quantity: limits}}


def answered(**answers: object) -> dict[str, Any]:
    """A drive with the usual high speed, and with answers to other calls."""
    return {"answers": {**HIGH, **{key.replace("_", " "): found for key, found in answers.items()}}}


STEPS: Sequence[tuple[str, dict[str, Any], dict[str, Any]]] = (
    ("direction", {"hz": 20.0, "seconds": 2.0}, {}), ("direction", BACK, {}),
    ("direction", BACK, {"reported": "forward"}), ("direction", LEFT, {"turned": "left"}),
    ("direction", LEFT, {"turned": "right"}),
    ("direction", LEFT, {"turned": "", "reported": "", "most": 0.0}),
    ("direction", {"hz": 20.0}, {"reported": "", "most": 0.0}),
    ("direction", {"hz": 20.0}, {"failing": "no answer", "most": 0.0}),
    ("ramp", {"hz": 50.0, "up": 2.5, "down": 2.5}, {}),
    ("ramp", {"hz": 50.0, "up": 2.5}, {}), ("ramp", {"hz": 50.0, "down": 2.4}, {}),
    ("ramp", {"hz": 25.0, "base": 50.0, "up": 2.5, "down": 2.5}, {}),
    ("ramp", {"hz": 50.0, "up": 2.0, "down": 3.0}, {}),
    ("ramp", {"hz": 50.0, "up": 2.0, "down": 3.0, "tolerance": 0.6}, {}),
    ("ramp", {"hz": 3.0, "up": 2.5, "down": 2.5}, {}),
    ("ramp", {"hz": 50.0, "up": 0.2}, {"most": 40.0}),
    ("ramp", {"hz": 50.0, "down": 1.0}, {"unread": True}),
    ("speeds", {"hz": 40.0, "seconds": 1.0}, {}),
    ("speeds", {**FULL, "percent": [50.0, 100.0], "settle": 2.0, "tolerance": 0.1}, {"most": 39.5}),
    ("speeds", within(unit="A", max=2.1), {}), ("speeds", within(unit="A", max=2, min=1), {}),
    ("speeds", within(unit="A", min=2.1), {}), ("speeds", within(unit="A", min=2.2), {}),
    ("speeds", within(unit="kW", min=2.1), {}),
    ("speeds", within(unit="A", min=1), {"raws": {"LCr": None}}),
    ("speeds", within("output_frequency", unit="Hz", max=39), {}),
    ("speeds", FULL, {"raws": {"rFr": 394, "tHd": 87, "OPr": 12}}),
    ("speeds", FULL, {"raws": {"rFr": 395}}),
    ("stop", {"hz": 40.0, "max": 2.5}, {}), ("stop", {"hz": 40.0, "max": 1.5, "min": 0.5}, {}),
    ("stop", {"hz": 40.0, "max": 9.0, "min": 2.5, "method": "quick-stop"}, {}),
    ("stop", {"max": 1.0, "seconds": 0.5, "method": "freewheel"}, {"stays": True}),
    ("stop", {"hz": 40.0, "max": 1.0, "settle": 0.5}, {}), ("stop", {"max": 3.0}, {"unread": True}),
    ("limit", {}, answered(high_speed=None)),
    ("limit", {}, answered(high_speed=HighSpeed(60.0, "HSP"))), ("limit", {}, answered()),
    ("limit", {"over": 2.0, "tolerance": 0.5}, answered(put_a_write=52.0)),
    ("limit", {"tolerance": 0.5}, answered(put_a_write=50.4)),
    ("limit", {"seconds": 1.0}, {"most": 49.6, **answered()}),
    ("limit", {"settle": 1.0}, answered()),
    ("limit", {}, answered(put_a_write=DeviceException(4, 6, 1, 3))),
    ("limit", {}, answered(put_a_write=NoAnswer(4, 6, 1))),
    ("limit", {}, {**answered(put_a_write=NoAnswer(4, 6, 1)), "raws": {"LFr": 500}}),
    ("limit", {}, {**answered(put_a_write=NoAnswer(4, 6, 1)), "raws": {"LFr": 510}}),
    ("limit", {}, answered(put_a_write=AcceptanceEnded("Ctrl-C"), refer_50=NoAnswer(4, 6, 1))),
    ("limit", {}, answered(put_a_write=52.0, refer_50=NoAnswer(4, 6, 1))),
    ("communication-loss", LOSS, PROVED), ("communication-loss", {"timeout": 2.1}, PROVED),
    ("communication-loss", {**LOSS, "reaction": "Freewheel stop"}, PROVED),
    ("communication-loss", {**LOSS, "reaction": "Ramp stop"}, PROVED),
    ("communication-loss", LOSS, answered(prove=NothingToProve("It is off."))),
    ("communication-loss", TURNING, PROVED),
    ("communication-loss", TURNING, answered(prove=MotorStopped("no longer runs"))),
    ("settings", {"values": {"ACC": "3.0 s", "dEC": "3.0 s", "tLS": "1 s"}}, {}),
    ("settings", {"values": {"ACC": "3.0 A"}}, {}), ("settings", {"file": "set.toml"}, {}),
    ("settings", {"file": "set.toml", "ignore": ["dEC"]}, {}),
    ("settings", {"file": "set.toml", "ignore": ["dEC", "HSP"]}, {}),
    ("refused", {"references": ["60Hz", "50.5Hz"]},
     {"answers": {"check forward 60Hz": ValueRefused("too high")}}),
    ("reset", {}, {}), ("reset", {}, {"kind": "fault", "fault": "OCF"}),
    ("reset", {}, {"kind": "fault"}),
)  # fmt: skip


def steps() -> Iterator[str]:
    """Each step: the calls, the checks, and the error."""
    for kind, fields, how in STEPS:
        step = msgspec.convert({"kind": kind, **fields}, STEP_KINDS[kind])
        yield f"{kind} {fields} {short(how)}"
        motor = Motor(**how)
        with ExitStack() as stack:
            work = bench_of(motor, step, stack)
            result = StepResult(2 if "file" in fields else 4, step)
            error = "none"
            try:
                asyncio.run(carry_out_step(work, result))
            except DriveError as found:
                error = f"{type(found).__name__}: {found}"
            except (DeviceException, NoAnswer) as found:
                error = f"{type(found).__name__}: {found}"
        yield from (f"  {text}" for text in motor.log)
        yield from (
            f"  > {'ok' if check.passed else 'NOT OK'} {check.text}" for check in result.checks
        )
        curve = result.curve
        marks = [(round(at - 100, 2), text) for at, text in curve.marks] if curve else None
        yield f"  {error} {marks} {len(curve.points) if curve else 0}"


def short(how: Mapping[str, Any]) -> str:
    texts = (f"{key}={value!r}" for key, value in how.items() if key != "answers")
    answers = (f"{key}: {value}" for key, value in how.get("answers", {}).items())
    return ", ".join((*texts, *answers)).replace(repr(PROOF), "PROOF")


def line_of(*parts: tuple[float, float, float], period: float = 0.1) -> list[RunPoint]:
    """Points of straight parts: the seconds, and the frequencies at their begin and end."""
    points, start = [], 10.0
    for seconds, first, last in parts:
        count = round(seconds / period)
        for at in range(count):
            hertz = first + (last - first) * at / count
            points.append(RunPoint(start + at * period, round(hertz, 4), 1 + abs(hertz) / 10))
        start += seconds
    return points


CURVES: Mapping[str, Sequence[RunPoint]] = {
    "none": [], "one": [RunPoint(5.0, 7.5)], "level": line_of((1, 20, 20)),
    "up": line_of((1, 0, 0), (2, 0, 50), (1, 50, 50)),
    "up and down": line_of((0.5, 0, 0), (1.3, 0, 30), (1, 30, 30), (2.1, 30, 0), (0.4, 0, 0)),
    "reverse": line_of((0.5, 0, 0), (1.3, 0, -30), (0.5, -30, -30), (1, -30, 0)),
    "both ways": line_of((1, 0, 12), (1, 12, 0), (1, 0, -12)),
    "through a gap": [*line_of((1, 0, 10)), *line_of((9, 10, 10))[60:]],
    "without current": [point._replace(amperes=None)
                        for point in line_of((400, 0, 120), period=10)],
    "some current": [point._replace(amperes=None if at % 7 < 3 else -0.2 * at)
                     for at, point in enumerate(line_of((3, 2, 0.4)))],
}  # fmt: skip


def curves() -> Iterator[str]:
    """Ramp times of curves, their parts, and their drawings."""
    for name, points in CURVES.items():
        yield name
        for low, high, base in ((0, 50, 50), (50, 0, 50), (0, 30, 60), (30, 0, 30), (0, 10, 5)):
            seconds = ramp_seconds(points, low, high, base)
            yield f"  {low} {high} {base}: {seconds and round(seconds, 4)}"
        marks = [(10.0, "forward"), (11.0, "51Hz <&>"), (9.0, "before"), (900.0, "after")]
        curve = RunCurve(PROFILE, list(points), marks)
        spans = ((10.0, 10.5), (11.0, None), (10.95, 11.05), (0.0, None))
        yield f"  {[len(curve.since(*span)) for span in spans]}"
        yield curve_svg(curve, 'Ramp <1> \x1b & "2"')
        yield from curve_svg(curve, "", 0.15).splitlines()[-8:] if "gap" in name else ()


def cycles() -> Iterator[str]:
    """Points that are taken from cycles: failed ones, old values, both directions."""
    for family in ("atv312", "atv71", "varmeca"):
        profile = library.load(family)
        curve = RunCurve(profile)
        codes = [entry.code for quantity in ("output_frequency", "motor_current")
                 if (entry := profile.quantity(quantity)) is not None]  # fmt: skip
        for at, (raws, error, quality, direction) in enumerate((
            ((300, 21), "", Quality.GOOD, "forward"), ((301, 22), "", Quality.GOOD, "reverse"),
            ((302, 23), "lost", Quality.GOOD, ""), ((303, 24), "", Quality.STALE, ""),
            ((None, 25), "", Quality.GOOD, ""), ((304,), "", Quality.GOOD, "reverse"),
            ((), "", Quality.GOOD, ""), ((305, None), "", Quality.GOOD, ""),
        )):  # fmt: skip
            for when in (at + 1.0, at + 0.5):
                found = {}
                for code, raw in zip(codes, raws, strict=False):
                    entry = profile[code]
                    value = None if raw is None else shown(profile, entry, raw, {})
                    found[code] = Reading(entry, raw, value, quality, when)
                state = SimpleNamespace(direction=direction)
                curve.take(cast(Any, SimpleNamespace(readings=found, error=error, state=state)))
        yield f"{family}: {curve.points}"


def results() -> Iterator[str]:
    """Reports of results: passed, failed, ended early, with other settings."""
    first = StepResult(1, msgspec.convert(
        {"kind": "direction", "hz": 5, "name": "A | B"}, STEP_KINDS["direction"]
    ), seconds=2.04)  # fmt: skip
    second = StepResult(2, msgspec.convert({"kind": "reset"}, STEP_KINDS["reset"]), text="x < y")
    first.check("Status word", "forward", "forward", passed=True)
    first.check("Output | frequency", "5.0 Hz", "5 Hz ± 0.5 Hz \x1b", passed=False)
    first.curve = RunCurve(PROFILE, list(CURVES["up"]), [(10.0, "forward")])
    whole = AcceptanceResult(
        "Pump \x1b 4", "sim:x", 4, "atv312", "Altivar 312", "1.0", "0.2", "A. <Person>", "t.toml",
        "abc", 1000.0, [first, second], {"version": "2.1"}, 1010.6, "", "aa", "aa", 100, 2,
    )  # fmt: skip
    for kinds, changes in (
        (("passed", "passed"), {}), (("failed", "not run"), {}), (("failed", "failed"), {}),
        (("passed", "not run"), {}), (("passed", "passed"), {"ended_by": "ended by SIGINT"}),
        (("passed", "passed"), {"settings_after": "bb"}), (("passed", "failed"), {"begun": 2000.0}),
        (("passed", "passed"), {"settings_after": "", "unreadable": 0, "ended": 0.0}),
        (("passed", "passed"), {"settings_after": "", "settings_hash": "", "identity": {}}),
    ):  # fmt: skip
        first.outcome, second.outcome = cast(Any, kinds)
        found = replace(whole, **changes)
        files = curve_files(found, "run")
        yield f"{kinds} {changes}: {found.passed} {found.why_not!r}"
        yield f"{[(number, name, len(text)) for number, (name, text) in files.items()]}"
        yield result_markdown(found, files)
        yield result_junit(found)
    first.curve.points.clear()
    yield result_markdown(whole, curve_files(whole, "run"))[-300:]


SECTIONS = (steps, curves, cycles, results)


@pytest.mark.usefixtures("in_utc")
@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_steps_and_their_reports_are_the_recorded_ones(
    section: Callable[[], Iterator[str]],
) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
