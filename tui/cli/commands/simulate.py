"""`drivepanel simulate`: serves simulated drives to any Modbus client."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from typing import TYPE_CHECKING

import click

from tui.session.signals import handled, wait_for

from ..shared.completion import complete_profile
from ..shared.numbers import FiniteRange
from ..shared.options import host_port, json_option, written_host_port
from ..shared.output import print_json
from ..shared.registration import command
from ..shared.say import say
from ..shared.signals import never_suspended

if TYPE_CHECKING:
    from tui.simulator import DriveSpec, Simulation
    from tui.simulator.ghost import GhostDrive


def show_about(name: str, as_json: bool) -> None:
    """Print how a simulated drive of a profile behaves, and where that is from."""
    from tui.drive.profile.library import load
    from tui.simulator.about import behaviors_of

    from ..documents.other_documents import BehaviorField, SimulatedBehaviorDocument

    profile = load(name.casefold())
    found = behaviors_of(profile)
    if as_json:
        behaviors = [
            BehaviorField(text=item.text, provenance=item.provenance, source=item.source)
            for item in found
        ]
        print_json(SimulatedBehaviorDocument(profile=profile.id, behaviors=behaviors))
        return
    say(f"Simulated {profile.name}: printed in its manual, public elsewhere, or a guess.")
    for item in found:
        say(f"{item.provenance:<8} {item.text} ({item.source})", indent=9)


USUAL = (19200, "8E1")
"""Baud and format of a LINE that names none."""


@command("Serve simulated drives to any Modbus client.", group="Profiles")
@click.argument(
    "drives",
    nargs=-1,
    metavar="PROFILE[@ADDRESS]...",
    shell_complete=complete_profile,
)
@click.option("--pty", "pty", metavar="PATH", help="Serve a pseudo-terminal, linked at PATH.")
@click.option("--serial", "serial", metavar="PATH", help="Serve a serial port.")
@click.option("--tcp", metavar="HOST:PORT", help="Serve Modbus TCP.")
@click.option("--rtu-tcp", "rtu_tcp", metavar="HOST:PORT", help="Serve RTU over TCP.")
@click.option(
    "--baud",
    type=click.IntRange(min=300),
    help="Use this baud rate (default: that of the first drive).",
)
@click.option(
    "--format",
    "form",
    metavar="8E1|8N2|...",
    help="Use this format (default: that of the first drive).",
)
@click.option(
    "--any-settings",
    is_flag=True,
    help="Answer at any baud rate and stop bits of a client.",
)
@click.option("--real-time", is_flag=True, help="Keep the transmission times of the line.")
@click.option(
    "--set",
    "sets",
    multiple=True,
    metavar="[ADDRESS:]CODE=RAW",
    help="Set a raw value at power-up; a measured word keeps it.",
)
@click.option(
    "--protect",
    "protects",
    multiple=True,
    metavar="[ADDRESS:]CODE,...",
    help="Refuse writes of these parameters over the line.",
)
@click.option(
    "--line-fault",
    "faults",
    multiple=True,
    metavar="KIND=VALUE",
    help="Add a trouble to the line, such as lost=0.1 (docs/cli.md).",
)
@click.option(
    "--seed", type=int, default=0, show_default=True, help="Use this seed for line faults."
)
@click.option(
    "--run",
    "run_hz",
    type=FiniteRange(-1000, 1000),
    default=0.0,
    metavar="HZ",
    help="Run the motors at this frequency from the start.",
)
@click.option(
    "--about",
    metavar="PROFILE",
    help="List the simulated behavior with its sources, then end.",
    shell_complete=complete_profile,
)
@click.option(
    "--from",
    "sources",
    multiple=True,
    metavar="FILE@ADDRESS",
    help="Answer as the drive of a record did (docs/recording.md).",
)
@click.option("--once", is_flag=True, help="Stop at the end of a record.")
@click.option(
    "--script",
    metavar="FILE",
    help="Run the lines of this file (docs/cli.md, the bench).",
)
@click.option(
    "--socket",
    "control",
    metavar="PATH",
    help="Take such lines at this Unix socket, and answer JSON.",
)
@json_option
def simulate(
    drives: tuple[str, ...],
    pty: str | None,
    serial: str | None,
    tcp: str | None,
    rtu_tcp: str | None,
    baud: int | None,
    form: str | None,
    any_settings: bool,
    real_time: bool,
    sets: tuple[str, ...],
    protects: tuple[str, ...],
    faults: tuple[str, ...],
    seed: int,
    run_hz: float,
    about: str | None,
    sources: tuple[str, ...],
    once: bool,
    script: str | None,
    control: str | None,
    as_json: bool,
) -> None:
    """Serve simulated drives until Ctrl-C or SIGTERM.

    Lines on standard input change a drive: "2: LI1=1, AI1=5V", "2: trip OCF", "all: power off",
    "in 3.5s: 2: jam". "2:" shows its inputs, "2: state" its real state.
    """
    if about is not None:
        show_about(about, as_json)
        return
    if sum(way is not None for way in (pty, serial, tcp, rtu_tcp)) != 1:
        raise click.UsageError("Say where: one of --pty, --serial, --tcp, --rtu-tcp.")
    if not drives and not sources:
        raise click.UsageError("Say what: PROFILE@ADDRESS, or --from FILE@ADDRESS.")
    from ..running.ghosts import ghost_field, ghosts_of, say_ghost

    recorded = ghosts_of(sources)
    ghosts = [
        item.ghost(repeats=not once, report=lambda text: say_ghost(text, as_json))
        for item in recorded
    ]
    simulation = simulation_of(
        drives, baud, form, any_settings, real_time, sets, protects, faults, seed, run_hz, ghosts
    )
    from tui.simulator import Bench

    from ..running.bench_lines import (
        BenchSocket,
        follow_input,
        run_script,
        say_result,
        script_lines,
    )

    bench = Bench(simulation, lambda result: say_result(result, as_json))
    lines = script_lines(bench, script) if script is not None else []
    stop = threading.Event()
    with never_suspended(), handled(lambda *_: stop.set()), simulation, ExitStack() as ending:
        ending.callback(bench.close)
        where = _serve(simulation, pty, serial, tcp, rtu_tcp)
        if control is not None:
            ending.callback(BenchSocket(bench, control).close)
        bench.start()
        specs = [drive.spec for drive in simulation.drives]
        names = ", ".join(
            [f"{spec.profile}@{spec.address}" for spec in specs]
            + [f"ghost@{item.device} ({item.text})" for item in recorded]
        )
        if as_json:
            from ..documents.other_documents import SimulatedDriveField, SimulationReady

            found = [
                SimulatedDriveField(profile=spec.profile, device=spec.address) for spec in specs
            ]
            ready = SimulationReady(
                line=where, drives=found, ghosts=[ghost_field(item, once) for item in recorded]
            )
            print_json(ready, compact=True)
        else:
            say(f"Ready: {names} on {where}. Ctrl-C ends it.")
        run_script(bench, lines, as_json)
        inputs = (bench, as_json)
        threading.Thread(target=follow_input, args=inputs, name="inputs", daemon=True).start()
        wait_for(stop)


def simulation_of(
    drives: tuple[str, ...],
    baud: int | None,
    form: str | None,
    any_settings: bool,
    real_time: bool,
    sets: tuple[str, ...],
    protects: tuple[str, ...],
    faults: tuple[str, ...],
    seed: int,
    run_hz: float,
    ghosts: Sequence[GhostDrive] = (),
) -> Simulation:
    """The simulated drives that these options describe, served nowhere as yet."""
    from tui.drive.profile.library import load
    from tui.simulator import LineTiming, Simulation, SimulatorError, parse_drives, troubles_of

    specs = [
        replace(spec, run_hz=run_hz, wander=bool(run_hz))
        for spec in _configured(parse_drives(",".join(drives)) if drives else [], sets, protects)
    ]
    profiles = [load(spec.profile) for spec in specs[:1]]
    profiles += [ghost.profile for ghost in ghosts if ghost.profile is not None]
    own = profiles[0].data.link if profiles else None
    usual_baud, usual_form = (own.baud, own.format) if own else USUAL
    try:
        rates, habits = troubles_of(_typed_troubles(faults))
    except SimulatorError as error:
        raise click.UsageError(str(error)) from None
    return Simulation(
        specs,
        timing=LineTiming(baud or usual_baud, (form or usual_form).upper(), real_time),
        faults=rates,
        habits=habits,
        seed=seed,
        any_settings=any_settings,
        ghosts=ghosts,
    )


def _serve(
    simulation: Simulation,
    pty: str | None,
    serial: str | None,
    tcp: str | None,
    rtu_tcp: str | None,
) -> str:
    """Start serving; the place as a LINE."""
    if pty is not None:
        simulation.serve_pty(pty)
        timing = simulation.timing
        usual = (timing.baud, timing.format) == USUAL
        return f"serial:{pty}" if usual else f"serial:{pty},{timing.baud},{timing.format}"
    if serial is not None:
        from tui.bus.transport.ports import open_serial

        timing = simulation.timing
        simulation.serve_stream(open_serial(serial, timing.baud, timing.format))
        return f"serial:{serial},{timing.baud},{timing.format}"
    serve: Callable[[str, int], tuple[str, int]]
    scheme, place, serve = (
        ("tcp", tcp, simulation.serve_tcp)
        if tcp is not None
        else ("rtu-tcp", rtu_tcp or "", simulation.serve_rtu_tcp)
    )
    host, port = serve(*host_port(place))
    return f"{scheme}:{written_host_port(host, port)}"


def _addressed(text: str) -> tuple[int | None, str]:
    address, colon, rest = text.partition(":")
    if colon and address.isdecimal():
        return int(address), rest
    return None, text


def _configured(
    specs: list[DriveSpec], sets: tuple[str, ...], protects: tuple[str, ...]
) -> list[DriveSpec]:
    """The drives with their set and protected words; without an address, of every drive."""
    values: dict[int, dict[str, int]] = {spec.address: {} for spec in specs}
    hidden: dict[int, set[str]] = {spec.address: set() for spec in specs}
    for text in sets:
        address, assignment = _addressed(text)
        code, _, raw = assignment.partition("=")
        for number in _addresses(values, address, text):
            values[number][code] = _raw(raw, text)
    for text in protects:
        address, codes = _addressed(text)
        for number in _addresses(hidden, address, text):
            hidden[number].update(codes.split(","))
    return [
        replace(spec, sets=values[spec.address], protects=frozenset(hidden[spec.address]))
        for spec in specs
    ]


def _addresses(
    known: dict[int, object] | dict[int, dict[str, int]] | dict[int, set[str]],
    address: int | None,
    text: str,
) -> list[int]:
    if address is not None and address not in known:
        raise click.UsageError(f"{text!r}: no simulated drive has address {address}.")
    return list(known) if address is None else [address]


def _raw(text: str, whole: str) -> int:
    digits = text.strip().lower().replace("16#", "0x")
    try:
        raw = int(digits, 0)
    except ValueError:
        raise click.UsageError(f"{whole!r}: write CODE=RAW, for example ACC=30.") from None
    if not -0x8000 <= raw <= 0xFFFF:
        raise click.UsageError(f"{whole!r}: {raw} does not fit a word of 16 bits.")
    return raw


def _typed_troubles(faults: tuple[str, ...]) -> dict[str, float]:
    """Values by kind. Raises UsageError."""
    from tui.simulator import TROUBLES

    values: dict[str, float] = {}
    for text in faults:
        kind, _, value = text.partition("=")
        if kind not in TROUBLES:
            raise click.UsageError(f"{text!r}: a line fault is one of {', '.join(TROUBLES)}.")
        try:
            values[kind] = FiniteRange().convert(value, None, None)
        except click.BadParameter:
            raise click.UsageError(f"{text!r}: write KIND=VALUE, for example late=0.15.") from None
    return values
