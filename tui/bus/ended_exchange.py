"""An exchange that is over, for a recorder: what was sent, what came back, and when."""

from __future__ import annotations

from typing import NamedTuple


class EndedExchange(NamedTuple):
    """One request and its result, as they were on the wire."""

    device: int
    request: bytes
    """Function and data; empty if there are only strays."""
    result: str
    """Value of a ResultKind; `copy` for a reply that may repeat the one before, `sent` for a frame
    whose reply nobody awaits."""
    reply: bytes
    """Function and data of a checked reply or an exception, else what was received."""
    sent: float
    """When the last byte of the request left (monotonic)."""
    end: float
    """When the last byte of the reply came, or the timeout ended (monotonic)."""
    wall: float
    """Time of day of `end` in seconds since 1970, by the clock as it was then."""
    program: str = ""
    """Id of the requesting program; empty for the holder of the line itself."""
    repeat: int = 0
    """Number of earlier tries; a reply may be a late one to the first of them."""
    strays: tuple[bytes, ...] = ()
    """Whole frames that came with the reply, or without any request, and are not part of it."""
