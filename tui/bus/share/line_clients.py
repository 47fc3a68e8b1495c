"""The programs and the last minute of a line, asked for without being attached.

A program sends LOOK_HEAD in place of a Hello. The answer is JSON, then the connection closes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from time import monotonic

import msgspec

from ..bounds import Number, Share, Word
from ..model import LastMinute
from ..program import LONGEST_NAME, Program, readable
from ..program_use import use_by_program
from .place import Owner, reached

LOOK_HEAD = b"LOOK"
"""Read as the length of a message, this is longer than any."""
LOOK_WITHIN = 0.5
LONGEST_LOOK_ANSWER = 1 << 16


class LineClient(msgspec.Struct, frozen=True):
    """A program on a line, and the share of the line's time that it has had of late."""

    program: Word
    pid: Number
    share: Share


class LineLook(msgspec.Struct, frozen=True):
    """The answer to a program that looks."""

    clients: list[LineClient]
    minute: LastMinute | None = None
    """None from a holder of an older version."""


def look_answer(
    programs: Iterable[Program], shares: Mapping[str, float], minute: LastMinute
) -> bytes:
    """The answer to a program that looks."""
    clients = [
        LineClient(readable(one.name, LONGEST_NAME), one.pid, round(share, 3))
        for one, share in use_by_program(programs, shares)
    ]
    return msgspec.json.encode(LineLook(clients, minute))


def line_look(owner: Owner) -> LineLook | None:
    """Ask the holder of a line; None without an answer."""
    data, end = b"", monotonic() + LOOK_WITHIN
    try:
        with reached(Path(owner.socket), LOOK_WITHIN) as connection:
            connection.sendall(LOOK_HEAD)
            while (part := connection.recv(4096)) and len(data) < LONGEST_LOOK_ANSWER:
                data += part
                connection.settimeout(max(0.01, end - monotonic()))
        # a holder of an older version answers its clients alone
        found = msgspec.json.decode(data, type=LineLook | list[LineClient])
        return found if isinstance(found, LineLook) else LineLook(found)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError):
        return None
