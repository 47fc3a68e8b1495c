"""What a frame that was overheard on a line asks of whom; replies and noise ask nothing."""

from __future__ import annotations

from typing import NamedTuple

READS = {1: "coils", 2: "inputs", 3: "register", 4: "input register"}
WRITES = {5: "coil", 6: "register", 15: "coils", 16: "register"}
REPORT_ID, READ_WRITE, DIAGNOSE, IDENTIFY = 17, 23, 8, 43
_HEAD = 6
"""Bytes of device, function, first register and count or value."""


class OverheardRequest(NamedTuple):
    """A request of another master; `register` and `words` are 0 where it names none."""

    device: int
    function: int
    register: int = 0
    words: int = 0

    @property
    def text(self) -> str:
        """What it asks, in few words."""
        several = f" on, {self.words} words" if self.words > 1 else ""
        if self.function in READS:
            return f"read of {READS[self.function]} {self.register}{several}"
        if self.function in WRITES:
            return f"write of {WRITES[self.function]} {self.register}{several}"
        if self.function in (IDENTIFY, REPORT_ID):
            return f"who it is (function {self.function})"
        return f"function {self.function}"


def overheard_request(frame: bytes) -> OverheardRequest | None:
    """The request in a whole frame, checksum included; None where it is a reply.

    What a request and its reply have in common, as for function 6, counts as a request.
    """
    size = len(frame)
    device, function = frame[0], frame[1]
    register = int.from_bytes(frame[2:4], "big")
    number = int.from_bytes(frame[4:_HEAD], "big")
    if function in READS:
        # a reply of the same size holds three bytes: coils may, registers do not
        is_request = size == 8 and (function > 2 or frame[2] != 3)
        return OverheardRequest(device, function, register, number) if is_request else None
    if function in (5, 6) and size == 8:
        return OverheardRequest(device, function, register, 1)
    if function in (15, 16):
        whole = size > 9 and size == 9 + frame[6]
        return OverheardRequest(device, function, register, number) if whole else None
    if function == READ_WRITE:
        whole = size > 13 and size == 13 + frame[10]
        return OverheardRequest(device, function, register, number) if whole else None
    if (function, size) in ((REPORT_ID, 4), (DIAGNOSE, 8), (IDENTIFY, 7)):
        return OverheardRequest(device, function)
    return None
