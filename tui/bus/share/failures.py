"""The errors of a line as messages carry them from its owner to the program that asked."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any

import msgspec
from msgspec import Meta

from ..bounds import (
    MOST_BYTES,
    ByteString,
    ByteValue,
    DeviceId,
    RegisterAddress,
    Seconds,
    Text,
)
from ..errors import (
    ChecksumFault,
    DeviceException,
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

MOST_PORTS = 64
"""Serial ports that a message names; more are left out."""


class ErrorForm(msgspec.Struct, frozen=True, omit_defaults=True):
    """An error as a message carries it; which fields count is its kind's own business."""

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


_PLAIN: Mapping[str, type[LineError]] = {
    kind.__name__: kind for kind in (RequestRefused, LineBusy, LineLost, LineFailed, LineClosed)
}


_MADE: Mapping[str, Callable[[ErrorForm], LineError]] = {
    "NoAnswer": lambda e: NoAnswer(e.device, e.function, e.address, e.detail, retry_in=e.retry_in),
    "ChecksumFault": lambda e: ChecksumFault(e.device, e.function, e.address, e.detail, e.received),
    "WrongReply": lambda e: WrongReply(e.device, e.function, e.address, e.detail, e.received),
    "DeviceException": lambda e: DeviceException(
        e.device, e.function, e.address, e.code, e.meaning
    ),
    "Superseded": lambda e: Superseded(e.device, e.register),
    "PortBusy": lambda e: PortBusy(e.path, e.holder),
    "PortMissing": lambda e: PortMissing(e.path, e.ports),
    "PortRefused": lambda e: PortRefused(e.path, e.reason),
}
"""How each error with fields of its own is made anew."""


def failure_told(error: BaseException) -> tuple[str, ErrorForm]:
    """The kind of an error and what it tells, as a message carries them."""
    name = type(error).__name__
    if name not in _MADE:
        return name if name in _PLAIN else "LineError", ErrorForm(_clipped(str(error)))
    held = {
        key: _clipped(getattr(error, key))
        for key in ErrorForm.__struct_fields__
        if key != "text" and hasattr(error, key)
    }
    return name, ErrorForm(_clipped(str(error)), **held)


def _clipped(value: Any) -> Any:
    """A text or bytes without its beginning, if it is longer than a message may carry."""
    if isinstance(value, tuple):
        return value[:MOST_PORTS]
    return value[-MOST_BYTES:] if isinstance(value, str | bytes) else value


def error_of(kind: str, form: ErrorForm) -> LineError:
    """The error that a message carries."""
    if (make := _MADE.get(kind)) is not None:
        return make(form)
    return _PLAIN.get(kind, LineError)(form.text)
