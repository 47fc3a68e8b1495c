"""A program on a line that several share, as the others know it."""

from __future__ import annotations

import os
from functools import cache

import msgspec

from .bounds import Number, ProgramId, Word

KEEPER = "keeper"
"""The name of the process that holds a line for the programs on it."""


ProcessKey = tuple[str, int]
"""A PID namespace and a process id in it: each container has a process 1."""


@cache
def pid_namespace() -> str:
    """The PID namespace of this program; empty if the system has none."""
    try:
        return os.readlink("/proc/self/ns/pid")
    except OSError:
        return ""


LONGEST_NAME, LONGEST_READABLE = 40, 500
"""Characters of a name, and of a sentence, of another program that a person is shown."""


def readable(text: str, longest: int = LONGEST_READABLE) -> str:
    """A text of another program as it may be shown: not endless, and nothing for the terminal."""
    plain = "".join(item if item.isprintable() else "?" for item in text[:longest])
    return plain if len(text) <= longest else f"{plain[:-1]}…"


class Program(msgspec.Struct, frozen=True):
    """A program on the line, as others name it."""

    id: ProgramId
    """Its own among all programs."""
    name: Word
    """`panel`, `run` and the like."""
    pid: Number = 0
    user: Word = ""
    where: Word = ""
    """Its terminal; empty if unknown."""
    space: Word = ""
    """Its PID namespace, in which `pid` counts; empty for the one of the reader."""

    @property
    def process(self) -> ProcessKey:
        """Its process, among those of all containers."""
        return self.space or pid_namespace(), self.pid

    @property
    def text(self) -> str:
        """Name of the program for people: `panel on pts/3 (pid 812)`."""
        name, where = readable(self.name, LONGEST_NAME), readable(self.where, LONGEST_NAME)
        return f"{name} on {where} (pid {self.pid})" if where else f"{name} (pid {self.pid})"
