"""Requests for the line as messages carry them from a program to the owner."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import msgspec

from ..limits import out_of_range
from ..requests import (
    Diagnose,
    Identify,
    Read,
    ReadInput,
    ReadWrite,
    ReportId,
    Request,
    WriteMany,
    WriteOne,
)
from .messages import Asking, NoMessage

REQUEST_KINDS: Mapping[str, type[Request]] = {
    kind.__name__: kind
    for kind in (Read, ReadInput, WriteOne, WriteMany, ReadWrite, Diagnose, Identify, ReportId)
}


def request_form(request: Request) -> tuple[str, dict[str, Any]]:
    """A request as a message carries it."""
    return type(request).__name__, msgspec.to_builtins(request, builtin_types=(bytes,))


def asked_request(message: Asking) -> Request:
    """The request that a message carries. Raises NoMessage."""
    kind = REQUEST_KINDS.get(message.kind)
    if kind is None:
        raise NoMessage(f"request {message.kind!r}")
    try:
        request = msgspec.convert(message.fields, kind)
        bytes([request.device])
        request.pdu()
    except Exception as error:
        # a request that cannot be put into bytes, for whichever reason, is none
        raise NoMessage(str(error)) from error
    if why := out_of_range(request):
        raise NoMessage(why)
    return request
