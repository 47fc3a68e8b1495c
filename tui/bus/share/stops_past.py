"""Stops that went out past a frozen owner, noted where it finds them when it goes on.

What a program wrote into a socket is lost where the program has ended meanwhile; a file is not.
"""

from __future__ import annotations

import logging
import os
from contextlib import suppress

from .messages import NoMessage, StopGiven, message_of, packed
from .place import PRIVATE_FILE, SHARED_FILE, SharePlace, make_private

log = logging.getLogger(__name__)

ENDING, UNFINISHED = ".stop", ".part"
LONGEST_NOTE = 1 << 16


class StopsPast:
    """The notes of one line, a file each: added before a stop goes out, taken by the owner.

    Nothing is locked: a stop must not wait for a program that is frozen.
    """

    def __init__(self, place: SharePlace) -> None:
        self._shared = place.group is not None
        self._folder = place.lock_folder
        self._name = place.name
        self._count = 0

    def note(self, stop: StopGiven) -> None:
        """Leave a note for the owner; what cannot be written is logged, and sent all the same.

        The owner is told by the socket, too.
        """
        self._count += 1
        name = f"{self._name}-{os.getpid()}-{stop.program.id[:12]}-{self._count}"
        part = self._folder / f"{name}{UNFINISHED}"
        try:
            make_private(self._folder, shared=self._shared)
            flags = os.O_WRONLY | os.O_CREAT | os.O_TRUNC | os.O_CLOEXEC
            descriptor = os.open(part, flags, SHARED_FILE if self._shared else PRIVATE_FILE)
            try:
                os.write(descriptor, packed(stop))
            finally:
                os.close(descriptor)
            part.replace(part.with_suffix(ENDING))
        except OSError as error:
            log.error("a stop past the owner is not noted: %s", error)

    def take(self) -> list[StopGiven]:
        """The notes, which are taken away; what is none of ours is thrown away."""
        found = []
        with suppress(OSError):
            for path in sorted(self._folder.glob(f"{self._name}-*{ENDING}")):
                with suppress(OSError):
                    with path.open("rb") as file:
                        data = file.read(LONGEST_NOTE)
                    path.unlink()
                    try:
                        message = message_of(data)
                    except NoMessage as error:
                        log.error("the note of a stop, %s, is damaged: %s", path, error)
                        continue
                    if isinstance(message, StopGiven):
                        found.append(message)
        return found
