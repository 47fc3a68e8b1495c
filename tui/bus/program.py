"""A program on a line that several share, as the others know it."""

from __future__ import annotations

import msgspec

from .bounds import Number, ProgramId, Word

KEEPER = "keeper"
"""The name of the process that holds a line for the programs on it."""


class Program(msgspec.Struct, frozen=True):
    """A program on the line, as others name it."""

    id: ProgramId
    """Its own among all programs."""
    name: Word
    """`panel`, `run` and the like."""
    pid: Number = 0
    user: Word = ""
    where: Word = ""
    """Its terminal; empty where that is unknown."""

    @property
    def text(self) -> str:
        """How people are told of it: `panel on pts/3 (pid 812)`."""
        where = f" on {self.where}" if self.where else ""
        return f"{self.name}{where} (pid {self.pid})"
