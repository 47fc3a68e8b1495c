"""Motion of the simulated motor on the bench: run, trip, reset, stop, and references in Hz."""

from __future__ import annotations

from decimal import Decimal

from tui.drive.orders import last_word
from tui.drive.profile.profile import Profile
from tui.drive.profile.reference_ways import reference_ways
from tui.drive.profile.schema import Chart, Order, OrderId, Parameter, ReferenceWay
from tui.drive.sentences import any_of
from tui.drive.shown import depends_on
from tui.drive.values import raw_range

from .proof_bench import ProofBench, Unproved

REACHED_SECONDS = 15.0
STOP_SECONDS = 30.0
"""Longest time to standstill; coasting included."""


def first_reference(profile: Profile) -> ReferenceWay | None:
    """Return the reference of a drive, listed or known by its quantity alone; None without one.

    A word of unknown scale cannot be written in Hz, so it is none.
    """
    ways = reference_ways(profile.data)
    return next((way for _, way, parameter in ways if parameter.unit), None)


def running_chart(profile: Profile) -> Chart | None:
    """Return the first chart that the line can run."""
    charts = profile.data.charts
    return next((c for c in charts if any(o.id == "forward" for o in c.orders)), None)


def spin_motor(bench: ProofBench, id: OrderId, order: Order | None = None) -> None:
    """Run the motor; raises Unproved if it does not turn as commanded and shown."""
    way = first_reference(bench.profile)
    # a sign of the reference may give the direction
    backward = id == "reverse" and way is not None and way.reverse == "negative"
    refer_motor(bench, top_hertz(bench) / (-2 if backward else 2))
    bench.send(id, order)
    sign = -1 if id == "reverse" else 1
    if not bench.until(lambda: bench.hz * sign > 1 and _kind(bench) == "running", REACHED_SECONDS):
        name, hz = bench.state().state.name, bench.hz
        raise Unproved(f"after {REACHED_SECONDS:.0f} s the drive shows {name} at {hz:.1f} Hz")
    shown = bench.state().direction
    if shown is not None and shown != id:
        mark = bench.chart.direction
        word = bench.profile[mark.parameter] if mark is not None else None
        text = f"the status word shows {shown}, the motor turns in {id}"
        if word is not None and word.code not in bench.chart.status_codes:
            text += without_role(word)
        raise Unproved(text)


ROLES = ("frequency_reference", "ramp_output", "output_frequency", "speed")
"""Quantities of the values that follow the simulated motor."""


def without_role(parameter: Parameter) -> str:
    """Return that a value has no quantity that follows the simulated motor; else empty."""
    if parameter.quantity in ROLES:
        return ""
    code, roles = parameter.code, any_of(ROLES)
    if parameter.quantity is None:
        return f". {code} has no quantity, so it does not follow the motor. Give it {roles}"
    return f". {code} is {parameter.quantity}, which does not follow the motor. Give it {roles}"


def start_motor(bench: ProofBench, id: OrderId) -> bool:
    """Run the motor before another command; False if the chart has no such run command."""
    if not any(order.id == id for order in bench.chart.orders):
        return False
    spin_motor(bench, id)
    return True


def _kind(bench: ProofBench) -> str:
    return bench.own().kind


def trip_drive(bench: ProofBench) -> None:
    faults = bench.profile.data.faults
    raw = next((fault.raw for fault in faults.codes if fault.raw != faults.none), faults.none + 1)
    bench.drive.provoke(raw)
    _need_fault(bench)


def _need_fault(bench: ProofBench) -> None:
    if not bench.until(lambda: bench.state().kind == "fault", 1):
        raise Unproved(f"a trip shows the state {bench.state().state.name}, not a fault")


def need_reset(bench: ProofBench) -> None:
    if not bench.until(lambda: bench.state().kind != "fault", 2):
        raise Unproved("the fault is still present after it")
    bench.wait(1)
    if bench.turns:
        raise Unproved("the motor turns after it")


def stop_motor(bench: ProofBench, id: OrderId, order: Order | None = None) -> Order:
    sent = bench.send(id, order)
    if (final := last_word(bench.chart, sent)) is not None:
        if not bench.until(lambda: abs(bench.hz) < 0.1, STOP_SECONDS):
            raise Unproved(f"it does not stop: the motor turns at {abs(bench.hz):.1f} Hz")
        bench.send(id, final)
    braking = id == "dc-braking"  # it holds the motor at standstill
    if not bench.until(
        lambda: (
            (braking and abs(bench.drive.motor.rotor) < 0.5)
            or (not bench.turns and _kind(bench) != "running")
        ),
        STOP_SECONDS,
    ):
        raise Unproved(
            f"it does not stop: after {STOP_SECONDS:.0f} s the drive shows"
            f" {bench.state().state.name} at {abs(bench.hz):.1f} Hz"
        )
    bench.wait(1)
    if abs(bench.hz) > 0.5:
        raise Unproved("the motor turns again after it")
    return sent


def top_hertz(bench: ProofBench) -> float:
    """Return the highest reference in Hz."""
    limits = (bench.profile.quantity("high_speed"), bench.profile.quantity("max_frequency"))
    known = [hz for hz in (present_hertz(bench, parameter) for parameter in limits) if hz]
    return min(known, default=50.0)


def present_number(bench: ProofBench, parameter: Parameter | None) -> float | None:
    """Return the present value in the parameter's unit; None if it is not known."""
    if parameter is None or parameter.access == "w" or not parameter.unit:
        return None
    scale = present_scale(bench, parameter)
    return None if scale is None else float(bench.read(parameter) * scale)


def present_scale(bench: ProofBench, parameter: Parameter) -> Decimal | None:
    return bench.profile.scale(parameter, bench.raws(depends_on(parameter)))


def present_hertz(bench: ProofBench, parameter: Parameter | None) -> float | None:
    number = present_number(bench, parameter)
    if number is None or parameter is None:
        return None
    return number * factor if (factor := _hertz_of_one(bench, parameter)) else None


def _hertz_of_one(bench: ProofBench, parameter: Parameter) -> float | None:
    """Return the Hz of one unit of a parameter; None for other units."""
    if parameter.unit == "rpm":
        poles = bench.profile.quantity("motor_poles")
        return ((bench.read(poles) if poles is not None else 0) or 4) / 120
    if parameter.unit == "%" and parameter.quantity not in ("high_speed", "max_frequency"):
        return top_hertz(bench) / 100
    return 1.0 if parameter.unit == "Hz" else None


def refer_motor(bench: ProofBench, hz: float, way: ReferenceWay | None = None) -> None:
    """Write a reference in Hz; nothing if the profile has none."""
    way = way or first_reference(bench.profile)
    if way is None:
        return
    parameter = bench.profile[way.parameter]
    scale, factor = present_scale(bench, parameter), _hertz_of_one(bench, parameter)
    if not scale or not factor:
        raise Unproved(f"{parameter.code} in {parameter.unit!r} cannot be converted to Hz")
    raw = round(hz / factor / float(scale))
    low, high = raw_range(parameter)
    if not low <= raw <= high:
        raise Unproved(f"{hz:.1f} Hz is {raw} in {parameter.code}, which holds {low} to {high}")
    bench.write(parameter, raw)
