"""Self-test of a profile: each step tests one claim of the file on the simulated drive.

The steps here are about commands, stops from every state, and references.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

from tui.drive.orders import STOP_ORDERS, optional_bits
from tui.drive.profile.profile import Profile
from tui.drive.profile.profile_frame import READING, frame_contents
from tui.drive.profile.reference_ways import reference_ways
from tui.drive.profile.register_identity import row_fits
from tui.drive.profile.rules.charts import RUN_ORDERS
from tui.drive.profile.schema import (
    Chart,
    IdentityRegister,
    Order,
    OrderId,
    Parameter,
    ProfileFrame,
    ReferenceWay,
)
from tui.drive.profile.toml_lines import TomlPath
from tui.drive.shown import depends_on, shown_text
from tui.drive.values import from_words, is_enumeration, raw_range, type_range, word_count
from tui.drive.words import unsigned

from .bench_motion import (
    REACHED_SECONDS,
    need_reset,
    present_hertz,
    present_number,
    refer_motor,
    running_chart,
    spin_motor,
    start_motor,
    stop_motor,
    top_hertz,
    trip_drive,
    without_role,
)
from .drive_steps import drive_steps
from .proof_bench import ProofBench, ProofStep, Unproved, proof_step
from .start_blocks import start_block_steps

HZ_TOLERANCE = 0.3
NO_EDGE = (
    "Its words have no edge: write the word without the reset bit before and after it, as in"
    " [stop, reset, stop]"
)
SLIP_HZ = 3.0
"""Most slip of a motor whose speed is the feedback."""
SHARES = (0.1, 0.25, 0.5, 0.75, 1.0)
"""Points of the range of a reference at which it is compared with its feedback."""
STOPS_PROVED: tuple[OrderId, ...] = ("stop", "quick-stop", "freewheel", "emergency-stop")


def command_steps(profile: Profile) -> Iterator[ProofStep]:
    """Test the commands, the stops and the references."""
    for index, chart in enumerate(profile.data.charts):
        if chart.orders:
            yield from _orders(profile, chart, ("charts", index))
            yield from _stops(profile, chart, ("charts", index))
            yield from start_block_steps(profile, chart, ("charts", index))
    yield from _references(profile)


def _orders(profile: Profile, chart: Chart, at: TomlPath) -> Iterator[ProofStep]:
    for place, order in enumerate(chart.orders):
        title = f"{order.id} ({order.name}) leads to its state"
        yield proof_step((*at, "orders", place), title, partial(_order, profile, chart, order))


def _order(profile: Profile, chart: Chart, order: Order) -> None:
    bench = ProofBench(profile, chart, order)
    if order.id in RUN_ORDERS:
        spin_motor(bench, order.id, order)
    elif order.id == "reset":
        trip_drive(bench)
        bench.send("reset", order)
        need_reset(bench)
        trip_drive(bench)
        bench.send("reset", order)
        try:
            need_reset(bench)
        except Unproved as error:
            raise Unproved(f"a second trip: {error}. {NO_EDGE}") from None
    elif order.id in (*STOP_ORDERS, "dc-braking"):
        if not start_motor(bench, "forward"):
            return
        own = bench.own().id
        stop_motor(bench, order.id, order)
        _need_transition(bench, own, order)
    else:
        bench.send(order.id, order)


def _need_transition(bench: ProofBench, source: str, order: Order) -> None:
    """Raise Unproved if the transitions declare a state that the drive has not shown."""
    chart = bench.chart
    if (order.parameter or chart.command) != chart.command or not order.words:
        return
    kept, last = optional_bits(chart, chart.command), unsigned(order.words[-1])
    for step in chart.transitions:
        same = step.command is not None and not (unsigned(step.command) ^ last) & ~kept
        if step.source == source and same and not _follows(chart, step.target) & set(bench.seen):
            seen = ", ".join(bench.seen[-3:])
            raise Unproved(f"the drive does not show {step.target}, but {seen}")


def _follows(chart: Chart, state: str) -> set[str]:
    """Return a state, and those to which the drive goes from it on its own."""
    found, left = {state}, [state]
    while left:
        at = left.pop()
        for step in chart.transitions:
            if step.source == at and step.command is None and step.target not in found:
                found.add(step.target)
                left.append(step.target)
    return found


def _stops(profile: Profile, chart: Chart, at: TomlPath) -> Iterator[ProofStep]:
    for id in STOPS_PROVED:
        places = [place for place, order in enumerate(chart.orders) if order.id == id]
        if places:
            path = (*at, "orders", places[0])
            for state, lead in _LEADS.items():
                title = f"{id} stops from {state}"
                yield proof_step(path, title, partial(_stop_from, profile, chart, id, lead))


def _stop_from(
    profile: Profile, chart: Chart, id: OrderId, lead: Callable[[ProofBench], bool]
) -> None:
    order = next(order for order in chart.orders if order.id == id)
    bench = ProofBench(profile, chart, order)
    if not lead(bench):
        return
    own = bench.own()
    usable = [o for o in chart.orders if o.id == id and (not o.states or own.id in o.states)]
    if usable or id in ("stop", "quick-stop", "freewheel"):
        stop_motor(bench, id)


def _at_rest(bench: ProofBench) -> bool:
    return True


def _slowing(bench: ProofBench) -> bool:
    if not start_motor(bench, "forward"):
        return False
    bench.send("stop")
    bench.wait(0.1)
    return True


def _in_fault(bench: ProofBench) -> bool:
    if start_motor(bench, "forward"):
        bench.wait(0.5)
    trip_drive(bench)
    return True


_LEADS: dict[str, Callable[[ProofBench], bool]] = {
    "standstill": _at_rest,
    "forward": lambda bench: start_motor(bench, "forward"),
    "reverse": lambda bench: start_motor(bench, "reverse"),
    "a ramp stop": _slowing,
    "a fault": _in_fault,
}
"""States from which stops are tested, and how the drive gets there; False if it cannot."""


def _references(profile: Profile) -> Iterator[ProofStep]:
    chart = running_chart(profile)
    for at, way, parameter in reference_ways(profile.data) if chart is not None else ():
        if at[0] == "parameters" and not parameter.unit:
            continue  # its scale is learned at the drive
        feedback = _feedback(profile, way)
        name = feedback.code if feedback is not None else "the motor"
        title = f"{way.parameter} and {name} agree"
        yield proof_step(at, title, partial(_compare, profile, chart, way))


def _feedback(profile: Profile, way: ReferenceWay) -> Parameter | None:
    return profile.get(way.feedback) or profile.quantity("output_frequency")


def _compare(profile: Profile, chart: Chart | None, way: ReferenceWay) -> None:
    bench = ProofBench(profile, chart)
    low, high = present_number(bench, profile.quantity("low_speed")) or 0.0, top_hertz(bench)
    refer_motor(bench, low + (high - low) * SHARES[0], way)
    bench.send("forward")
    for share in SHARES:
        hz = low + (high - low) * share
        refer_motor(bench, hz, way)
        if not bench.until(partial(_near, bench, hz), REACHED_SECONDS):
            raise Unproved(f"{hz:.1f} Hz: the motor turns at {bench.hz:.1f} Hz")
        bench.wait(0.5)
        feedback = _feedback(profile, way)
        shown = present_hertz(bench, feedback)
        slip = SLIP_HZ if feedback is not None and feedback.unit == "rpm" else 0.0
        if shown is not None and abs(shown - hz) > HZ_TOLERANCE + slip:
            why = without_role(feedback) if feedback is not None else ""
            raise Unproved(f"{hz:.1f} Hz: the feedback shows {shown:.1f} Hz{why}")
    stop_motor(bench, "stop")


def _near(bench: ProofBench, hz: float) -> bool:
    return abs(bench.hz - hz) < HZ_TOLERANCE


REPORT_ID, REPORT_TEXT = 17, 4
"""The function, and the place of the text in its reply."""


def prove_profile(profile: Profile) -> Iterator[ProofStep]:
    """Test a checked profile on the drive that is simulated from it, step by step."""
    yield from _reads(profile)
    yield from _identity(profile)
    yield from _frames(profile)
    yield from command_steps(profile)
    yield from _limits(profile)
    yield from drive_steps(profile)


def _each(path: TomlPath, title: str, rows: Iterator[tuple[TomlPath, str]]) -> Iterator[ProofStep]:
    """Yield the faults of many rows, each at its place, or one step that passed."""
    faults = [ProofStep(at, title, text) for at, text in rows]
    yield from faults or [ProofStep(path, title)]


def _reads(profile: Profile) -> Iterator[ProofStep]:
    bench = ProofBench(profile, None)

    def faults() -> Iterator[tuple[TomlPath, str]]:
        for index, parameter in enumerate(profile.parameters):
            if parameter.access != "w":
                try:
                    bench.read(parameter)
                except Unproved as error:
                    yield ("parameters", index), f"{parameter.code} cannot be read: {error}"

    yield from _each(("parameters",), "every parameter is read", faults())


def _identity(profile: Profile) -> Iterator[ProofStep]:
    """Test that the drive reports the text and the registers by which scans recognize it."""
    own = profile.data.identification
    at: TomlPath = ("identification",)
    for place, row in enumerate(own.registers):
        yield proof_step(
            (*at, "registers", place),
            f"register {row.parameter} identifies the drive",
            partial(_identifies, profile, row),
        )
    if own.reference_prefixes and profile.function(REPORT_ID) is not None:
        step = partial(_reports_its_id, profile)
        yield proof_step((*at, "reference_prefixes"), "function 17 identifies the drive", step)


def _identifies(profile: Profile, row: IdentityRegister) -> None:
    parameter = profile[row.parameter]
    raw = ProofBench(profile, None).read(parameter)
    if not row_fits(parameter, row, raw):
        raise Unproved(f"{row.parameter} is {raw}")


def _reports_its_id(profile: Profile) -> None:
    reply = ProofBench(profile, None).ask(bytes([REPORT_ID]))
    text = reply[REPORT_TEXT:].decode("ascii", "replace").upper()
    prefixes = tuple(p.upper() for p in profile.data.identification.reference_prefixes)
    if not any(found.startswith(prefixes) for found in (text, f"16#{reply[2:].hex().upper()}")):
        raise Unproved(f"it reports {text!r}")


def _limits(profile: Profile) -> Iterator[ProofStep]:
    bench = ProofBench(profile, None)

    def faults() -> Iterator[tuple[TomlPath, str]]:
        for index, parameter in enumerate(profile.parameters):
            if parameter.access in ("rw", "rw-stopped") and not parameter.forbidden:
                for raw in _beyond(profile, parameter):
                    if _takes(bench, parameter, raw):
                        text = f"{parameter.code} accepts {raw}, beyond its limits"
                        yield ("parameters", index), text

    yield from _each(("parameters",), "values beyond limits are refused", faults())


def _beyond(profile: Profile, parameter: Parameter) -> Iterator[int]:
    """Yield raw values that the profile excludes, and that its type can hold."""
    if word_count(parameter) == 2 or parameter.is_bits:
        return
    low, high = type_range(parameter)
    least, most = raw_range(parameter)
    names = profile.names(parameter)
    if names and is_enumeration(parameter):
        least, most = min(names), max(names)
    for raw in (least - 1, most + 1):
        if low <= raw <= high and raw not in names:
            yield raw


def _takes(bench: ProofBench, parameter: Parameter, raw: int) -> bool:
    try:
        bench.write(parameter, raw)
    except Unproved:
        return False
    return bench.read(parameter) == raw


# Example frames


def _frames(profile: Profile) -> Iterator[ProofStep]:
    for index, frame in enumerate(profile.data.frames):
        title = f"frame {frame.sent[:17]} means {', '.join(frame.means)}"
        yield proof_step(("frames", index), title, partial(_frame, profile, frame))


def _frame(profile: Profile, frame: ProfileFrame) -> None:
    """Replay a frame on a drive with the values that it contains, and compare its meaning."""
    contents = frame_contents(frame)
    bench = ProofBench(profile, None)
    raws = {}
    for parameter in profile.parameters:
        at = parameter.address - contents.address
        most = len(contents.words) - word_count(parameter)
        if parameter.function == contents.space and 0 <= at <= most:
            raws[parameter.code] = from_words(parameter, contents.words[at:])
    if contents.function in READING:
        for code, raw in raws.items():
            bench.drive.set(code, raw)
    if bench.ask(contents.request) != contents.reply:
        raise Unproved("the drive gives another reply")
    for code, raw in raws.items():
        if contents.function not in READING and bench.drive.raw(code) != raw:
            raise Unproved(f"{code} is {bench.drive.raw(code)} after it, not {raw}")
    shown = {text for code, raw in raws.items() for text in _texts(bench, profile[code], raw)}
    if wrong := [text for text in frame.means if text not in shown]:
        raise Unproved(f"it does not mean {wrong[0]}, but {', '.join(sorted(shown)) or 'nothing'}")


def _texts(bench: ProofBench, parameter: Parameter, raw: int) -> tuple[str, str]:
    """Return a value as it is shown, and as a word."""
    raws = bench.raws(depends_on(parameter))
    text = shown_text(bench.profile, parameter, raw, raws)
    return f"{parameter.code} = {text}", f"{parameter.code} = 16#{raw & 0xFFFF:04X}"
