"""Writes made ready in advance, for a stop whose usual way fails by an internal error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from tui.wire.frames import frame

from .coils import write_request
from .limits import Limits
from .link import Link, TcpLink
from .model import Priority
from .requests import Request
from .share.carried import request_form
from .share.messages import Asking, packed


@dataclass(frozen=True, slots=True)
class PreparedWrite:
    """One write, finished down to its bytes: nothing is left to be decided or computed."""

    request: Request
    frame: bytes
    """The bytes for the port or the connection."""
    message: bytes
    """The bytes for the program that owns the line."""


def prepared_write(
    link: Link, limits: Limits, device: int, address: int, values: Sequence[int]
) -> PreparedWrite:
    """Make a write of registers ready for one kind of line."""
    request = write_request(device, address, values, None, limits.functions)
    pdu = request.pdu()
    if isinstance(link, TcpLink):
        # transaction 0 is never used by TcpMaster: no other request gets this reply
        head = bytes(4) + (len(pdu) + 1).to_bytes(2, "big") + bytes([link.unit_of(device)])
        data = head + pdu
    else:
        data = frame(device, pdu)
    kind, fields = request_form(request)
    # number 0 is never used by PendingRequests: nothing waits for this answer
    asking = Asking(0, kind, fields, Priority.STOP, False, 0.0, 0, 0.0, limits)
    return PreparedWrite(request, data, packed(asking))
