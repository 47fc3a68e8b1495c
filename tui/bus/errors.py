"""Errors of a line, of its links and of single exchanges, in words for the person at the panel."""

from __future__ import annotations

from collections.abc import Sequence


class LineError(Exception):
    """A problem of a line; the text says what happened and what to do next."""


OUTCOME_UNKNOWN = " The write may or may not have taken effect. Read the register before retrying."
"""End of an error's text after a write that may have taken effect."""


def strip_outcome_note(error: LineError) -> str:
    """Return the text of an error once the result of the write was read."""
    return str(error).removesuffix(OUTCOME_UNKNOWN)


RETRYING = " Retrying in "


def strip_retry_note(text: str) -> str:
    """Return the text of an error for a record: without the time of the next try."""
    return text.partition(RETRYING)[0]


class LinkSyntaxError(LineError):
    """A typed link cannot be understood; the text shows the forms that can."""


STOPPED_FIRST = "Not sent: a stop came after it."
STOPPED_FIRST_BY = "Not sent: a stop came after it ({by})."


def stopped_first_text(by: str) -> str:
    """Return the refusal of a frame that was requested before a stop; `by` may be empty."""
    return STOPPED_FIRST_BY.format(by=by) if by else STOPPED_FIRST


PORT_IN_USE = "{path} is in use by {holder}. Close that program, or choose another port."
PORT_IN_USE_BY_OTHER = (
    "{path} is in use by another program. Close that program, or choose another port."
)


class PortBusy(LineError):
    """A serial port is held by another program; `holder` names it if the system knows it."""

    def __init__(self, path: str, holder: str | None = None) -> None:
        self.path = path
        self.holder = holder
        text = PORT_IN_USE if holder else PORT_IN_USE_BY_OTHER
        super().__init__(text.format(path=path, holder=holder))


class NotShared(LineError):
    """A line is owned by another program, which does not share it with this one."""


class PortMissing(LineError):
    """A serial port does not exist; `ports` are the existing ones."""

    def __init__(self, path: str, ports: Sequence[str] = ()) -> None:
        self.path = path
        self.ports = tuple(ports)
        there = f"Ports found: {', '.join(ports)}." if ports else "No serial port was found."
        super().__init__(f"{path} does not exist. {there} Check the adapter and the name.")


class PortRefused(LineError):
    """A serial port exists but cannot be opened: no permission, or settings it does not support."""

    def __init__(self, path: str, reason: str) -> None:
        self.path = path
        self.reason = reason
        super().__init__(f"{path} cannot be opened: {reason}")


class LineClosed(LineError):
    """The line was closed by the program itself."""

    def __init__(self, text: str = "The line is closed.") -> None:
        super().__init__(text)


class LineLost(LineError):
    """The line was lost or cannot be reached; it is opened again automatically."""


class LineBehind(LineLost):
    """The line gives each request the reply to an earlier one; only stops are sent."""


class LineFailed(LineLost):
    """The line's own code failed: an internal error, not one of the port or of a drive."""


ONE_BEHIND = "Replies are one behind"
"""Opens the text of a LineBehind."""
OWNER_SILENT = "owns the line and does not answer"
"""Text of a LineLost if a frozen program of Drive Panel holds the line."""


class LineBusy(LineError):
    """Too many requests wait for the line; this one was not queued."""


class Superseded(LineError):
    """A write that was never sent, because a newer one of the same register took its place."""

    def __init__(self, device: int, register: int) -> None:
        self.device, self.register = device, register
        super().__init__(
            f"A newer value for register {register} of device {device} took the place of this"
            " one, which was not sent."
        )


class RequestRefused(LineError):
    """A request that was not sent: it is beyond the device's limits, or the line is read-only."""


class ExchangeError(LineError):
    """A request was sent, but no valid reply came.

    `device` is the address, `function` the function code, `address` the first register (0 for
    functions without one).
    """

    def __init__(self, device: int, function: int, address: int, text: str) -> None:
        self.device = device
        self.function = function
        self.address = address
        super().__init__(text)


def request_text(function: int, address: int | None) -> str:
    """Return a request as a text for a sentence about it."""
    if address is not None and function in _WITH_ADDRESS:
        what = "coil" if function in _WITH_COIL else "input" if function == 2 else "register"
        return f"function {function}, {what} {address}"
    return f"function {function}"


_WRONG_REPLY = "Device {device} sent an unexpected reply ({request})."
_WRONG_REPLY_BECAUSE = "Device {device} sent an unexpected reply ({request}): {detail}."
_REFUSED = "Device {device} refused {request} with exception {code}."
_REFUSED_BECAUSE = "Device {device} refused {request} with exception {code}: {why}."

_WITH_COIL = frozenset({1, 5, 15})
_WITH_ADDRESS = frozenset({2, 3, 4, 6, 16, 23, *_WITH_COIL})


class NoAnswer(ExchangeError):
    """No reply came in time, or the device is not polled for another `retry_in` seconds."""

    def __init__(
        self,
        device: int,
        function: int,
        address: int,
        detail: str = "",
        *,
        retry_in: float | None = None,
    ) -> None:
        self.retry_in = retry_in
        self.detail = detail
        text = detail or f"Device {device} did not answer ({request_text(function, address)})."
        if retry_in is not None:
            text = f"{text}{RETRYING}{retry_in:.1f} s."
        super().__init__(device, function, address, text)


class ChecksumFault(ExchangeError):
    """The reply was damaged or cut short; `received` are its bytes."""

    def __init__(
        self, device: int, function: int, address: int, detail: str = "", received: bytes = b""
    ) -> None:
        self.received = received
        self.detail = detail
        text = detail or (
            f"The answer of device {device} was damaged ({request_text(function, address)}). "
            "Check wiring, termination and the format of the line."
        )
        super().__init__(device, function, address, text)


class WrongReply(ExchangeError):
    """A whole reply came that does not belong to the request; it was discarded."""

    def __init__(
        self, device: int, function: int, address: int, detail: str = "", received: bytes = b""
    ) -> None:
        self.received = received
        self.detail = detail
        text = _WRONG_REPLY_BECAUSE if detail else _WRONG_REPLY
        request = request_text(function, address)
        text = text.format(device=device, request=request, detail=detail)
        super().__init__(device, function, address, text)


class BytesSwapped(ExchangeError):
    """The two bytes of each word of a device arrive swapped; `codes` are words that show it."""

    def __init__(self, device: int, codes: Sequence[str]) -> None:
        self.codes = tuple(codes)
        shown = ", ".join(self.codes[:4])
        super().__init__(
            device,
            3,
            0,
            f"The bytes of each word of device {device} arrive swapped: {shown} make sense only the"
            " other way round. Check the byte order setting of the gateway or converter."
            " Only stops are sent.",
        )


class DeviceException(ExchangeError):
    """The device refused the request with a Modbus exception `code`; `meaning` explains it."""

    def __init__(
        self, device: int, function: int, address: int, code: int, meaning: str = ""
    ) -> None:
        self.code = code
        self.meaning = meaning
        # a sentence from a profile already ends with a full stop
        text = _REFUSED_BECAUSE if meaning else _REFUSED
        request = request_text(function, address)
        why = meaning.removesuffix(".")
        text = text.format(device=device, request=request, code=code, why=why)
        super().__init__(device, function, address, text)


class NotRecorded(DeviceException):
    """A replay has no value of these registers, because they were not read by then."""

    def __init__(self, device: int, function: int, address: int) -> None:
        super().__init__(device, function, address, 0)
        self.args = ("Not read by then: the record has no value.",)


HOPELESS = (PortBusy, PortMissing, PortRefused, NotShared)
"""Failures that do not end by waiting."""
