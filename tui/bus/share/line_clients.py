"""The programs on a line, asked for without being attached: each with its share of the line.

A program sends LOOK_HEAD in place of a Hello. The answer is JSON, then the connection closes.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from time import monotonic

import msgspec

from ..bounds import Number, Share, Word
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


def look_answer(programs: Iterable[Program], shares: Mapping[str, float]) -> bytes:
    """The answer to a program that looks."""
    return msgspec.json.encode(
        [
            LineClient(readable(one.name, LONGEST_NAME), one.pid, round(share, 3))
            for one, share in use_by_program(programs, shares)
        ]
    )


def line_clients(owner: Owner) -> list[LineClient] | None:
    """Ask the holder of a line; None without an answer."""
    data, end = b"", monotonic() + LOOK_WITHIN
    try:
        with reached(Path(owner.socket), LOOK_WITHIN) as connection:
            connection.sendall(LOOK_HEAD)
            while (part := connection.recv(4096)) and len(data) < LONGEST_LOOK_ANSWER:
                data += part
                connection.settimeout(max(0.01, end - monotonic()))
        return msgspec.json.decode(data, type=list[LineClient])
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError):
        return None
