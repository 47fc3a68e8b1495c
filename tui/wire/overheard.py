"""Requests in a frame overheard on a line; replies and noise have none."""

from __future__ import annotations

from typing import NamedTuple

from .heard.lengths import fits_reply, fits_request

READS = {1: "coils", 2: "inputs", 3: "register", 4: "input register"}
WRITES = {5: "coil", 6: "register", 15: "coils", 16: "register"}
COILS, ONE = (1, 2), (5, 6)
REPORT_ID, READ_WRITE, IDENTIFY = 17, 23, 43
_HEAD = 6
"""Bytes of device, function, first register and count or value."""


class OverheardRequest(NamedTuple):
    """A request of another master; `register` and `words` are 0 if it names none."""

    device: int
    function: int
    register: int = 0
    words: int = 0

    @property
    def text(self) -> str:
        """Request in few words."""
        several = f" to {self.register + self.words - 1}" if self.words > 1 else ""
        if self.function in READS:
            return f"read of {READS[self.function]} {self.register}{several}"
        if self.function in WRITES:
            return f"write of {WRITES[self.function]} {self.register}{several}"
        if self.function in (IDENTIFY, REPORT_ID):
            return f"its identity (function {self.function})"
        return f"function {self.function}"


def overheard_request(frame: bytes) -> OverheardRequest | None:
    """The request in a whole frame, checksum included; None if it is a reply.

    A frame that may be either, as with function 6, counts as a request.
    """
    device, function = frame[0], frame[1]
    # a reply of three bytes has the length of a request: coils may, registers do not
    if not fits_request(frame) or (function in COILS and fits_reply(frame)):
        return None
    if function not in {*READS, *WRITES, READ_WRITE}:
        return OverheardRequest(device, function)
    register = int.from_bytes(frame[2:4], "big")
    number = 1 if function in ONE else int.from_bytes(frame[4:_HEAD], "big")
    return OverheardRequest(device, function, register, number)
