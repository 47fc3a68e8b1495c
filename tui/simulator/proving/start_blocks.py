"""Steps for interlocks and local control: they block a start, and it is possible otherwise."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

from tui.drive.profile.profile import Profile
from tui.drive.profile.schema import Chart, Interlock
from tui.drive.profile.toml_lines import TomlPath

from .bench_motion import spin_motor
from .proof_bench import BENCH_STEP, ProofBench, ProofStep, Unproved, proof_step


def start_block_steps(profile: Profile, chart: Chart, at: TomlPath) -> Iterator[ProofStep]:
    """Test each interlock that applies to a start, and the bit of local control."""
    if not any(order.id == "forward" for order in chart.orders):
        return
    for place, lock in enumerate(chart.interlocks):
        if not lock.orders or "forward" in lock.orders:
            title = f"the interlock of {lock.parameter} blocks a start"
            test = partial(_locks, profile, chart, lock)
            yield proof_step((*at, "interlocks", place), title, test)
    if chart.local is not None and "LOC" in ProofBench(profile, chart).drive.keypad:
        yield proof_step(
            (*at, "local"), "local control blocks a start", partial(_local, profile, chart)
        )


def _locks(profile: Profile, chart: Chart, lock: Interlock) -> None:
    bench = ProofBench(profile, chart)
    for when in lock.when:
        bench.drive.set(when.parameter, when.values[0])
    raw = bench.drive.raw(lock.parameter)
    wrong = (value for value in _masked(lock.mask) if value not in lock.values)
    if (blocking := next(wrong, None)) is None:
        raise Unproved(f"no value of {lock.parameter} blocks it")
    bench.drive.set(lock.parameter, raw & ~lock.mask | blocking)
    bench.wait(BENCH_STEP)
    if bench.blocked("forward") is None:
        raise Unproved(f"a start is possible while {lock.parameter} is {blocking:#x}")


def _masked(mask: int) -> Iterator[int]:
    """Yield values of the masked bits: none, each alone, and all."""
    yield 0
    yield from (mask & 1 << bit for bit in range(32) if mask >> bit & 1)
    yield mask


def _local(profile: Profile, chart: Chart) -> None:
    bench = ProofBench(profile, chart)
    if bench.state().local:
        raise Unproved("the drive shows local control although the line commands it")
    bench.drive.keypad["LOC"]()
    bench.wait(BENCH_STEP)
    if not bench.state().local:
        raise Unproved("the drive in local control does not show it")
    if bench.blocked("forward") is None:
        raise Unproved("a start is possible in local control")
    bench.drive.keypad["REM"]()
    bench.wait(BENCH_STEP)
    spin_motor(bench, "forward")
