"""Requests in a monitored frame; replies and noise contain none."""

from __future__ import annotations

from typing import NamedTuple

from .observed.splitting import fits_reply, fits_request

READS = {1: "coil", 2: "input", 3: "register", 4: "input register"}
WRITES = {5: "coil", 6: "register", 15: "coil", 16: "register"}
COILS, ONE = (1, 2), (5, 6)
REPORT_ID, READ_WRITE, IDENTIFY = 17, 23, 43
_HEAD = 6
"""Bytes of device, function, first register and count or value."""


_TEXTS = {
    (True, False): "read of {kind} {at}",
    (True, True): "read of {kind}s {at} to {last}",
    (False, False): "write of {kind} {at}",
    (False, True): "write of {kind}s {at} to {last}",
}
"""By whether it reads, and whether it names several words."""


class OverheardRequest(NamedTuple):
    """A request of another master; `register` and `words` are 0 if it names none."""

    device: int
    function: int
    register: int = 0
    words: int = 0

    @property
    def text(self) -> str:
        """Short description of the request."""
        kind = READS.get(self.function) or WRITES.get(self.function, "")
        if kind:
            text = _TEXTS[self.function in READS, self.words > 1]
            return text.format(kind=kind, at=self.register, last=self.register + self.words - 1)
        if self.function in (IDENTIFY, REPORT_ID):
            return f"its identity (function {self.function})"
        return f"function {self.function}"


def overheard_request(frame: bytes) -> OverheardRequest | None:
    """Return the request in a whole frame with its checksum; None if it is a reply.

    A frame that may be either, as with function 6, counts as a request.
    """
    device, function = frame[0], frame[1]
    # a reply of three bytes is as long as a request; this is possible for coils, not registers
    if not fits_request(frame) or (function in COILS and fits_reply(frame)):
        return None
    if function not in {*READS, *WRITES, READ_WRITE}:
        return OverheardRequest(device, function)
    register = int.from_bytes(frame[2:4], "big")
    number = 1 if function in ONE else int.from_bytes(frame[4:_HEAD], "big")
    return OverheardRequest(device, function, register, number)
