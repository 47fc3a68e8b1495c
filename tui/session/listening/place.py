"""Opening of a line for monitoring: a port, or simulated drives with a master."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from tui.bus.errors import LineError
from tui.bus.link import SerialLink, parse_link
from tui.bus.listening_line import ListeningLine

from ..connect.line_key import SIMULATED_PREFIX
from ..connect.share_place import share_place, this_program


class CannotListen(LineError):
    """The line cannot be monitored for other masters' traffic."""


@dataclass(frozen=True, slots=True)
class PlaceToListen:
    """Open line, and the action once monitoring is ready."""

    line: ListeningLine
    begin: Callable[[], None] = lambda: None


@contextmanager
def line_to_listen(text: str, program: str) -> Iterator[PlaceToListen]:
    """Open the line of a text for monitoring, for a program of that name.

    Raises CannotListen unless it is a serial line, LinkSyntaxError, and the errors of
    ListeningLine.
    """
    if text.casefold().startswith(SIMULATED_PREFIX):
        with _simulated(text, program) as place:
            yield place
        return
    link = parse_link(text)
    if not isinstance(link, SerialLink):
        raise CannotListen(
            f"{text} is not a serial port. Other masters cannot be monitored over a network. To see"
            " the traffic of a line that is open in Drive Panel, use the Frames screen."
        )
    with ListeningLine(link, share_place(text), this_program(program)) as line:
        yield PlaceToListen(line)


@contextmanager
def _simulated(text: str, program: str) -> Iterator[PlaceToListen]:
    """Simulated drives with a master that polls them once monitoring is ready."""
    from tui.simulator import PlcOnLine, Simulation, parse_drives, plc_cycle

    with Simulation(parse_drives(text[len(SIMULATED_PREFIX) :])) as simulation:
        cycle = plc_cycle([(drive.address, drive.profile) for drive in simulation.drives])
        master = PlcOnLine(simulation, cycle)
        try:
            link = SerialLink(master.path)
            with ListeningLine(link, None, this_program(program)) as line:
                yield PlaceToListen(line, master.start)
        finally:
            master.stop()
