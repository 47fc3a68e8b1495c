"""Requests, errors and polls as messages carry them between programs; for polls see PollPlan."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from ..bounds import (
    MOST_BYTES,
    ByteString,
    ByteValue,
    DeviceId,
    MonotonicTime,
    Number,
    RegisterAddress,
    Seconds,
    Text,
    Word,
)
from ..coils import ReadCoils, ReadDiscrete, WriteCoil, WriteCoils
from ..errors import (
    ChecksumFault,
    DeviceException,
    LineBehind,
    LineBusy,
    LineClosed,
    LineError,
    LineFailed,
    LineLost,
    NoAnswer,
    PortBusy,
    PortMissing,
    PortRefused,
    RequestRefused,
    Superseded,
    WrongReply,
)
from ..limits import out_of_range
from ..poll_plan import MOST_READS, MOST_TURNS, PollPlan
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

MOST_PORTS = 64
"""Serial ports that a message names; more are left out."""
_REQUESTS: tuple[type[Request], ...] = (
    Read, ReadInput, ReadCoils, ReadDiscrete, WriteOne, WriteMany, WriteCoil, WriteCoils,
    ReadWrite, Diagnose, Identify, ReportId,
)  # fmt: skip
REQUEST_KINDS: Mapping[str, type[Request]] = {kind.__name__: kind for kind in _REQUESTS}


def request_form(request: Request) -> tuple[str, dict[str, Any]]:
    """A request as a message carries it."""
    return type(request).__name__, msgspec.to_builtins(request, builtin_types=(bytes,))


def request_from(kind: str, fields: dict[str, Any]) -> Request:
    """The request that a message carries. Raises ValueError."""
    if kind not in REQUEST_KINDS:
        raise ValueError(f"request {kind!r}")
    try:
        request = msgspec.convert(fields, REQUEST_KINDS[kind])
        bytes([request.device])
        request.pdu()
    except Exception as error:
        # a request that cannot be put into bytes, for whichever reason, is none
        raise ValueError(str(error)) from error
    if why := out_of_range(request):
        raise ValueError(why)
    return request


class ErrorForm(msgspec.Struct, frozen=True, omit_defaults=True):
    """An error as a message carries it; its kind decides which of the other fields count."""

    kind: Word = "LineError"
    text: Text = ""
    device: DeviceId = 0
    function: ByteValue = 0
    address: RegisterAddress = 0
    detail: Text = ""
    received: ByteString = b""
    code: ByteValue = 0
    meaning: Text = ""
    register: RegisterAddress = 0
    path: Text = ""
    holder: Text | None = None
    ports: Annotated[tuple[Text, ...], Meta(max_length=MOST_PORTS)] = ()
    reason: Text = ""
    retry_in: Seconds | None = None


_EXCHANGE = ("device", "function", "address")
_KINDS: Mapping[type[LineError], tuple[str, ...]] = {
    **dict.fromkeys(
        (RequestRefused, LineBusy, LineBehind, LineLost, LineFailed, LineClosed, LineError), ()
    ),
    NoAnswer: (*_EXCHANGE, "detail", "retry_in"),
    ChecksumFault: (*_EXCHANGE, "detail", "received"),
    WrongReply: (*_EXCHANGE, "detail", "received"),
    DeviceException: (*_EXCHANGE, "code", "meaning"),
    Superseded: ("device", "register"),
    PortBusy: ("path", "holder"),
    PortMissing: ("path", "ports"),
    PortRefused: ("path", "reason"),
}
"""The fields from which each error is made; without any, it is made from its text."""
_NAMED = {kind.__name__: kind for kind in _KINDS}


def error_form(error: BaseException) -> ErrorForm:
    """An error as a message carries it; one that is not the line's as a LineError."""
    kind = _NAMED.get(type(error).__name__, LineError)
    held = {name: _clipped(getattr(error, name)) for name in _KINDS[kind]}
    return ErrorForm(kind.__name__, _clipped(str(error)), **held)


def _clipped(value: Any) -> Any:
    """The end of a text or bytes, if it is longer than a message may carry."""
    if isinstance(value, tuple):
        return value[:MOST_PORTS]
    return value[-MOST_BYTES:] if isinstance(value, str | bytes) else value


def error_from(form: ErrorForm) -> LineError:
    """The error that a message carries; a LineError if its kind is unknown."""
    made = _NAMED.get(form.kind, LineError)
    fields = {name: getattr(form, name) for name in _KINDS[made]}
    return made(**fields) if fields else made(form.text)


class Subscribe(msgspec.Struct, frozen=True, tag=True):
    """Request for the cycles of a plan; replaces an earlier one of that number."""

    number: Number
    plan: PollPlan


class Unsubscribe(msgspec.Struct, frozen=True, tag=True):
    """End of the cycles of a plan."""

    number: Number


class PolledReply(msgspec.Struct, frozen=True, array_like=True):
    """A reply of a cycle, or its error."""

    pdu: ByteString
    time: MonotonicTime
    failure: ErrorForm | None = None


class Polled(msgspec.Struct, frozen=True, tag=True):
    """A cycle of a plan; replies in the order of its turn, none after the error that ended it."""

    number: Number
    turn: Annotated[int, Meta(ge=0, lt=MOST_TURNS)]
    begun: MonotonicTime
    replies: Annotated[tuple[PolledReply, ...], Meta(max_length=MOST_READS)]
