"""Commands to an Altivar 31, 312 or 71: from its inputs, two-wire or three-wire, and from the line.

Sources: ATV71 communication parameters list and ATV312 communication variables (TCC, TCT, RRS).
"""

from __future__ import annotations

from dataclasses import dataclass

from ..body import Body
from ..plant.motor import Stop
from .channels import IO_PROFILE
from .io_profile import IoCommand, read_io_command

CMD_REVERSE = 1 << 11
ENABLE_WORD, IO_FORWARD, IO_REVERSE = 0x000F, 0x0001, 0x0002


class LineCommand:
    """Last command word, and its command in the I/O profile."""

    def __init__(self, body: Body) -> None:
        self._body = body
        self.word = 0
        self.io = IoCommand()

    @property
    def is_io(self) -> bool:
        """True if the I/O profile is chosen."""
        return self._body.setting("CHCF", 1) == IO_PROFILE

    @property
    def reverse(self) -> bool:
        """True if the word commands reverse."""
        return self.io.reverse if self.is_io else bool(self.word & CMD_REVERSE)

    def clear(self) -> None:
        """Start without a command, as after power-up."""
        self.word = 0
        self.io = IoCommand()

    def let_go(self) -> None:
        """Discard the run command of the I/O profile."""
        self.io = IoCommand()

    def take(self, word: int, *, in_force: bool) -> int:
        """Accept a written word; return the bits that have just become 1."""
        rising = word & ~self.word
        self.word = word
        if in_force and self.is_io:
            self.io = read_io_command(self.io, word, rising, self._wiring)
        return rising

    def enable(self, *, reverse: bool) -> None:
        """Command a run, as another master or a copied command does."""
        if self.is_io:
            self.word = IO_REVERSE if reverse else IO_FORWARD
            self.io = IoCommand(True, reverse)
        else:
            self.word = ENABLE_WORD | (CMD_REVERSE if reverse else 0)
        self._body.show_raw("command_word", self.word)

    def adopt(self) -> None:
        """Process the present word, now that the line commands."""
        self.word = self._body.raw("command_word") & 0xFFFF
        if self.is_io:
            self.io = read_io_command(IoCommand(), self.word, 0, self._wiring)

    @property
    def _wiring(self) -> int:
        return self._body.setting("TCC", 0)


THREE_WIRE, TRANSITION = 1, 1
FORWARD, START, REVERSE_INPUT = "LI1", "LI2", 130
FREEWHEEL_INPUT, FAST_INPUT = "NST", "FST"


@dataclass(frozen=True, slots=True)
class WiredOrder:
    """Present command of the inputs."""

    run: bool = False
    reverse: bool = False


class TerminalWiring:
    """Follower of the run inputs of one drive.

    With two wires, a closed contact runs the motor for as long as it is closed, also after a reset.
    If TCT requires a transition, it must have been open once since power-up, reset or change of
    channel. With three wires, LI1 allows running, a pulse of LI2 starts, one of LI3 or of the input
    of RRS starts reverse.
    """

    def __init__(self, body: Body) -> None:
        self._body = body
        self.order = WiredOrder()
        self._before: frozenset[str] = frozenset()
        self._spent = False
        """True if the closed inputs must open first."""

    def renew(self) -> None:
        """Require a new transition after a fault, a loss of supply or a change of channel."""
        self.order = WiredOrder()
        self._spent = self._body.setting("TCT", 0) == TRANSITION

    def spend(self) -> None:
        """Require that the closed inputs open first, as after the STOP key."""
        self.order = WiredOrder()
        self._spent = True

    def follow(self) -> None:
        """Read the present inputs."""
        terminals = self._body.terminals
        closed = frozenset(name for name in terminals.names.logic if terminals.closed(name))
        pressed = closed - self._before
        self._before = closed
        backward = self._backward()
        if self._body.setting("TCC", 0) == THREE_WIRE:
            self.order = self._by_pulses(closed, pressed, backward)
            return
        forward, reverse = FORWARD in closed, backward in closed
        if not forward and not reverse:
            self._spent = False
        runs = (forward or reverse) and not self._spent
        self.order = WiredOrder(runs, reverse and not forward)

    def _by_pulses(
        self, closed: frozenset[str], pressed: frozenset[str], backward: str
    ) -> WiredOrder:
        if FORWARD not in closed:
            return WiredOrder()
        if START in pressed:
            return WiredOrder(True, False)
        backward = "LI3" if backward == START else backward
        return WiredOrder(True, True) if backward in pressed else self.order

    def _backward(self) -> str:
        raw = self._body.setting("RRS", REVERSE_INPUT)
        return f"LI{raw - 128}" if 129 <= raw <= 142 else "LI2"

    def stop(self) -> Stop | None:
        """Return the stop by an input that must be closed to run (NST, FST), from any command
        source."""
        for code, way in ((FREEWHEEL_INPUT, Stop.FREEWHEEL), (FAST_INPUT, Stop.FAST)):
            raw = self._body.setting(code, 0)
            if 129 <= raw <= 142 and not self._body.terminals.closed(f"LI{raw - 128}"):
                return way
        return None
