"""Work for the disk that keeps starts of motors."""

from __future__ import annotations

import threading
from dataclasses import dataclass, field

from .record import StartRecord

DriveKey = tuple[str, int]
"""A line's text and a device: one program calls one line by one text."""


@dataclass(eq=False, slots=True)
class StartTask:
    """Work for the disk: a record to write, or with None those of a drive to remove."""

    drive: DriveKey
    record: StartRecord | None
    done: threading.Event = field(default_factory=threading.Event)
    trouble: str = ""
    void: bool = False
    """Nobody waits for it any more, or a stop came first: it is not to be put in its place."""
