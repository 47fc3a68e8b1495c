"""A serial line that is only monitored while others use it; nothing is ever sent."""

from __future__ import annotations

from contextlib import suppress
from typing import Self

from .errors import NotShared, PortBusy
from .link import SerialLink, character_time, silence
from .program import Program
from .share.keeping import ends_unneeded
from .share.messages import VERSION
from .share.place import Owner, OwnerLock, SharePlace, owner_of
from .transport.ports import is_pseudo_terminal
from .transport.serial_listening import ListeningPort, open_listening, others_at

_HELD_BY = (
    "drivepanel {program} has {path}, and a port that is listened to can have no other user."
    " Frames (7) of a panel on this line shows what goes over it."
)
_HELD = (
    "Another drivepanel has {path}, and a port that is listened to can have no other user."
    " Frames (7) of a panel on this line shows what goes over it."
)


class ListeningLine:
    """The port of a line, for this program alone, and open for reading only.

    Opened by `with`. Raises NotShared where another drivepanel has the line, PortBusy, PortMissing,
    PortRefused.
    """

    def __init__(self, link: SerialLink, place: SharePlace | None, program: Program) -> None:
        self.link = link
        self.has_times = not is_pseudo_terminal(link.path)
        """True if pauses can be recognized in the bytes that the port delivers."""
        self._lock = OwnerLock(place) if place is not None else None
        self._place = place
        self._program = program
        self._port: ListeningPort | None = None

    @property
    def character(self) -> float:
        """Seconds of one byte on the wire; 0 if bytes take no time."""
        return character_time(self.link) if self.has_times else 0.0

    @property
    def silence(self) -> float:
        """Least seconds of silence between two frames."""
        return silence(self.link)

    def __enter__(self) -> Self:
        self._own()
        try:
            if others := others_at(self.link.path):
                raise PortBusy(self.link.path, others)
            self._port = open_listening(self.link.path, self.link.baud, self.link.format)
        except BaseException:
            self._give_back()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        if self._port is not None:
            self._port.close()
            self._port = None
        self._give_back()

    def read(self, wait: float) -> bytes:
        """The received bytes; empty if none came within `wait` seconds. Raises LineLost."""
        return self._port.read(wait) if self._port is not None else b""

    def _own(self) -> None:
        """Keep every other drivepanel from the line, like an owner that admits no client."""
        if self._lock is None or self._place is None:
            return
        with suppress(OSError):  # without a lock the port itself is locked
            owner = owner_of(self._place)
            if self._lock.take() or (owner is not None and ends_unneeded(owner, self._lock)):
                self._lock.tell(Owner(VERSION, self._program, ""))
                return
            text = _HELD_BY if owner is not None else _HELD
            program = owner.program.text if owner is not None else ""
            raise NotShared(text.format(program=program, path=self.link.path))

    def _give_back(self) -> None:
        if self._lock is not None:
            self._lock.give_back()
