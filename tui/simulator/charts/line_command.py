"""Command word of the line for an Altivar 31, 312 or 71, Drivecom or I/O profile."""

from __future__ import annotations

from ..body import Body
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
