"""The errors of a line as messages carry them from its owner to the program that asked."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import msgspec

from ..errors import (
    ChecksumFault,
    DeviceException,
    LineBusy,
    LineClosed,
    LineError,
    LineLost,
    NoAnswer,
    RequestRefused,
    Superseded,
    WrongReply,
)


class ErrorForm(msgspec.Struct, frozen=True, omit_defaults=True):
    """An error as a message carries it; which fields count is its kind's own business."""

    text: str = ""
    device: int = 0
    function: int = 0
    address: int = 0
    detail: str = ""
    received: bytes = b""
    code: int = 0
    meaning: str = ""
    register: int = 0
    retry_in: float | None = None


_PLAIN: Mapping[str, type[LineError]] = {
    kind.__name__: kind for kind in (RequestRefused, LineBusy, LineLost, LineClosed)
}


_MADE: Mapping[str, Callable[[ErrorForm], LineError]] = {
    "NoAnswer": lambda e: NoAnswer(e.device, e.function, e.address, e.detail, retry_in=e.retry_in),
    "ChecksumFault": lambda e: ChecksumFault(e.device, e.function, e.address, e.detail, e.received),
    "WrongReply": lambda e: WrongReply(e.device, e.function, e.address, e.detail, e.received),
    "DeviceException": lambda e: DeviceException(
        e.device, e.function, e.address, e.code, e.meaning
    ),
    "Superseded": lambda e: Superseded(e.device, e.register),
}
"""How each error with fields of its own is made anew."""


def failure_told(error: BaseException) -> tuple[str, ErrorForm]:
    """The kind of an error and what it tells, as a message carries them."""
    name = type(error).__name__
    if name not in _MADE:
        return name if name in _PLAIN else "LineError", ErrorForm(str(error))
    held = {
        key: getattr(error, key)
        for key in ErrorForm.__struct_fields__
        if key != "text" and hasattr(error, key)
    }
    return name, ErrorForm(str(error), **held)


def error_of(kind: str, form: ErrorForm) -> LineError:
    """The error that a message carries."""
    if (make := _MADE.get(kind)) is not None:
        return make(form)
    return _PLAIN.get(kind, LineError)(form.text)
