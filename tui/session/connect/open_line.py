"""Opening of a line from the text of a person: serial, TCP, RTU over TCP, or simulated.

The modules of a line are imported when one is opened, so that the panel appears first.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Protocol

from tui.bus.errors import LinkSyntaxError

from .line_key import REPLAY_PREFIX, SIMULATED_PREFIX, is_replay, line_key

if TYPE_CHECKING:
    from tui.bus.api import ModbusLine
    from tui.bus.link import Link, SerialLink, UsualSettings
    from tui.simulator import Bench, DriveSpec, Simulation

    from ..record.recorder import LineRecorder
    from ..record.replay_line import ReplayLine
    from .known_line import KnownLine


class Farewell(Protocol):
    """Report on a drive before its line is closed."""

    async def tell(self) -> None:
        """Deliver the report; never raises the line's errors."""
        ...


@dataclass(slots=True)
class OpenLine:
    """A line with its address part."""

    text: str
    """The LINE as typed."""
    line: ModbusLine
    simulation: Simulation | None = None
    devices: tuple[int, ...] = ()
    """Addresses of the drives of a simulated line; otherwise empty."""
    profiles: Mapping[int, str] = field(default_factory=dict)
    """The profiles that the text of a simulated line names, by address."""
    known: KnownLine | None = None
    """Comparison with the stored line; None for a simulated line."""
    again: Callable[[SerialLink], ModbusLine] | None = None
    """Opens the line again at other settings, for this program alone."""
    farewells: dict[int, Farewell] = field(default_factory=dict)
    """By address, the report on each drive before the line is closed."""
    bench: Bench | None = None
    """Carries out lines on the simulated drives; None for other lines."""
    recorder: LineRecorder | None = None
    """Records what this process itself sends on the line; None if it does not."""
    private: TemporaryDirectory[str] | None = None
    """Folder of the record of a simulated line."""
    replay: ReplayLine | None = None
    """The line, if it is the replay of a record; no drive is on it."""

    @property
    def is_real(self) -> bool:
        """True if the drives on it are neither simulated nor replayed."""
        return self.simulation is None and self.replay is None

    @property
    def label(self) -> str:
        """Name of the line on a screen."""
        if self.replay is not None:
            return f"{REPLAY_PREFIX}{self.replay.path.name}"
        if self.simulation is None:
            from tui.bus.link import label

            return label(self.line.link).removeprefix("serial:").replace(",", " ")
        count = len(self.devices)
        return self.text if count == 1 else f"{SIMULATED_PREFIX}{count} drives"

    def close(self) -> None:
        """Close the line, then its transport."""
        self.line.close()
        if self.recorder is not None:
            self.recorder.close()
        if self.bench is not None:
            self.bench.close()
        if self.simulation is not None:
            self.simulation.stop()
        if self.private is not None:
            self.private.cleanup()

    def recorded_files(self) -> list[Path]:
        """Return the files of the line's record, or those that are replayed. Raises OSError."""
        if self.replay is not None:
            return self.replay.files
        return self.recorder.files() if self.recorder is not None else []

    def record_privately(self) -> None:
        """Record a simulated line until it is closed, outside the state folder."""
        from .recorded_line import may_record, record_privately

        if not may_record():
            return
        try:
            self.private = TemporaryDirectory(prefix="drivepanel-", ignore_cleanup_errors=True)
        except OSError:
            return  # without a record, Trend shows what this program reads from now on
        self.recorder = record_privately(self.line, Path(self.private.name))


def open_line(
    text: str,
    *,
    read_only: bool = False,
    wait: float | None = None,
    usual: UsualSettings | None = None,
    program: str = "",
    keeper: bool = True,
) -> OpenLine:
    """Open the line of a text; `usual` are the serial settings if it names none.

    `program` is the name of this program for others on the line; a program without a name shares
    nothing. Without `keeper`, this process holds a line itself if no other program does.

    With `wait`, it returns connected, or raises the line's error after that many seconds; otherwise
    it connects automatically. Raises LinkSyntaxError, UnknownProfile, ProfileError.
    """
    if text.casefold().startswith(SIMULATED_PREFIX):
        from tui.simulator import parse_drives

        check_line(text)
        return _simulated(
            parse_drives(text[len(SIMULATED_PREFIX) :]), read_only=read_only, wait=wait
        )
    if is_replay(text):
        return _replayed(text, wait)
    from tui.bus.line import Line
    from tui.bus.link import absolute, parse_link
    from tui.bus.share.keeping import can_start
    from tui.bus.share.place import file_name_of
    from tui.bus.share.sharing import Sharing

    from .recorded_line import record_line
    from .share_place import share_place, this_program

    link = absolute(parse_link(text, usual))
    place = share_place(text) if program else None
    line = Line(
        link,
        read_only=read_only,
        place=place,
        program=this_program(program),
        share=partial(Sharing, keeper=keeper and can_start()),
        gated=True,
    )

    def again(other: SerialLink) -> ModbusLine:
        return Line(other, read_only=read_only, gated=True)

    name = place.name if place is not None else file_name_of(line_key(text))
    return _opened(OpenLine(text, line, again=again, recorder=record_line(line, name)), wait)


def reopen(opened: OpenLine, baud: int, format: str, *, wait: float) -> None:
    """Reopen a serial line at another baud and format, from then on for this program alone.

    Raises the line's errors; then the line is closed.
    """
    from tui.bus.link import SerialLink

    link = opened.line.link
    assert opened.again is not None
    assert isinstance(link, SerialLink)
    opened.line.close()
    opened.line = opened.again(replace(link, baud=baud, format=format))
    opened.line.open(wait=wait)


def check_line(text: str) -> None:
    """Raise LinkSyntaxError, or the simulator's error, for an invalid LINE."""
    if text.casefold().startswith(SIMULATED_PREFIX):
        from tui.simulator import SimulatorError, parse_drives

        try:
            parse_drives(text[len(SIMULATED_PREFIX) :])
        except SimulatorError as error:
            raise LinkSyntaxError(str(error)) from error
    elif is_replay(text):
        from .recorded_line import replayed

        replayed(text).close()
    else:
        from tui.bus.link import parse_link

        parse_link(text)


def serial_ports() -> list[tuple[str, str]]:
    """Paths and descriptions of the serial ports of this machine."""
    from tui.bus.transport.ports import list_ports

    return [(port.path, port.description) for port in list_ports()]


def demo_line(drives: Mapping[str, float]) -> OpenLine:
    """Open a simulated line with running motors, for a demonstration.

    `drives` gives each profile's frequency in Hz; addresses count from 1.
    """
    from tui.simulator import DriveSpec

    return _simulated(
        [
            DriveSpec(profile, address, run_hz=hertz, wander=True)
            for address, (profile, hertz) in enumerate(drives.items(), start=1)
        ]
    )


def _simulated(
    specs: Sequence[DriveSpec], *, read_only: bool = False, wait: float | None = None
) -> OpenLine:
    from tui.bus.line import Line, Timing
    from tui.simulator import Simulation

    simulation = Simulation(specs)
    # drives simulated in this process are late if the computer is: do not count them as silent
    timing = Timing(min_timeout=1.0)
    line = Line(_serve(simulation), timing=timing, read_only=read_only, gated=True)
    text = SIMULATED_PREFIX + ",".join(f"{spec.profile}@{spec.address}" for spec in specs)
    line.facts.simulated_as = text
    profiles = {spec.address: spec.profile for spec in specs}

    def again(other: SerialLink) -> ModbusLine:
        made = Line(other, timing=timing, read_only=read_only, gated=True)
        made.facts.simulated_as = text
        return made

    opened = OpenLine(text, line, simulation, tuple(profiles), profiles, again=again)
    return _opened(opened, wait)


def _replayed(text: str, wait: float | None) -> OpenLine:
    from ..record.replay_text import REPLAY_LEAD
    from .recorded_line import replayed

    line = replayed(text, lead=REPLAY_LEAD)
    return _opened(OpenLine(text, line, devices=line.devices, replay=line), wait)


def _opened(opened: OpenLine, wait: float | None) -> OpenLine:
    """The line, connecting; closed with its transport if it cannot be opened."""
    try:
        opened.line.open(wait=wait)
    except BaseException:
        opened.close()
        raise
    return opened


def _serve(simulation: Simulation) -> Link:
    """Start a simulation on a pseudo-terminal or loopback for the panel."""
    from tui.bus.link import RtuTcpLink, SerialLink

    simulation.start()
    try:
        if os.name == "posix":
            return SerialLink(simulation.serve_pty())
        return RtuTcpLink(*simulation.serve_rtu_tcp())
    except BaseException:
        simulation.stop()
        raise
