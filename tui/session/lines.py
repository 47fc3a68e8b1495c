"""Opening a line from what a person typed: serial, TCP, RTU over TCP, or simulated."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tui.bus.line import Line
from tui.bus.link import Link, RtuTcpLink, SerialLink, label, parse_link

if TYPE_CHECKING:
    from tui.simulator import Simulation

SIMULATED = "sim:"


@dataclass(slots=True)
class OpenLine:
    """A line with what stands behind it."""

    text: str
    """As it was typed."""
    line: Line
    simulation: Simulation | None = None

    @property
    def label(self) -> str:
        """How the line is called on a screen."""
        return self.text if self.simulation else label(self.line.link)

    @property
    def devices(self) -> tuple[int, ...]:
        """Addresses known to be taken: those of a simulated line, else none."""
        return self.simulation.addresses if self.simulation else ()

    def close(self) -> None:
        """Close the line, then what it was connected to."""
        self.line.close()
        if self.simulation is not None:
            self.simulation.stop()


def open_line(text: str, *, read_only: bool = False, wait: float | None = None) -> OpenLine:
    """The line that a person means, opened.

    With `wait` it returns connected, or raises the line's error after so many seconds;
    without, it connects by itself. Raises LinkSyntaxError, UnknownProfile, ProfileError.
    """
    simulation: Simulation | None = None
    if text.casefold().startswith(SIMULATED):
        simulation, link = _simulate(text[len(SIMULATED) :])
    else:
        link = parse_link(text)
    line = Line(link, read_only=read_only)
    try:
        line.open(wait=wait)
    except BaseException:
        line.close()
        if simulation is not None:
            simulation.stop()
        raise
    return OpenLine(text, line, simulation)


def demo_line(drives: Mapping[str, float]) -> OpenLine:
    """One simulated line whose motors already run, for a first look.

    `drives` gives each profile's frequency in Hz; addresses count from 1.
    """
    from tui.simulator import DriveSpec, Simulation

    specs = [
        DriveSpec(profile, address, run_hz=hertz, wander=True)
        for address, (profile, hertz) in enumerate(drives.items(), start=1)
    ]
    simulation = Simulation(specs)
    line = Line(_serve(simulation))
    line.open()
    text = ",".join(f"{spec.profile}@{spec.address}" for spec in specs)
    return OpenLine(SIMULATED + text, line, simulation)


def _simulate(drives: str) -> tuple[Simulation, Link]:
    from tui.simulator import Simulation, parse_drives

    simulation = Simulation(parse_drives(drives))
    return simulation, _serve(simulation)


def _serve(simulation: Simulation) -> Link:
    """Start a simulation where the panel reaches it: a pseudo-terminal, or loopback."""
    simulation.start()
    if os.name == "posix":
        return SerialLink(simulation.serve_pty())
    return RtuTcpLink(*simulation.serve_rtu_tcp())
