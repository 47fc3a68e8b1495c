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


class LinkSyntaxError(LineError):
    """A typed link cannot be understood; the text shows the forms that can."""


class PortBusy(LineError):
    """A serial port is held by another program; `holder` names it if the system knows it."""

    def __init__(self, path: str, holder: str | None = None) -> None:
        self.path = path
        self.holder = holder
        who = f"in use by {holder}" if holder else "in use by another program"
        super().__init__(f"{path} is {who}. Close that program, or choose another port.")


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


def _request_text(function: int, address: int) -> str:
    return f"function {function}" + (f", register {address}" if function in _WITH_ADDRESS else "")


_WITH_ADDRESS = frozenset({3, 4, 6, 16, 23})


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
        text = detail or f"Device {device} did not answer ({_request_text(function, address)})."
        if retry_in is not None:
            text += f" Retrying in {retry_in:.1f} s."
        super().__init__(device, function, address, text)


class ChecksumFault(ExchangeError):
    """The reply was damaged or cut short; `received` are its bytes."""

    def __init__(
        self, device: int, function: int, address: int, detail: str = "", received: bytes = b""
    ) -> None:
        self.received = received
        self.detail = detail
        text = detail or (
            f"The answer of device {device} was damaged ({_request_text(function, address)}). "
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
        request = _request_text(function, address)
        text = f"Device {device} sent an unexpected reply ({request})"
        super().__init__(device, function, address, f"{text}: {detail}." if detail else f"{text}.")


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
        why = f": {meaning.rstrip('.')}" if meaning else ""
        super().__init__(
            device,
            function,
            address,
            f"Device {device} refused {_request_text(function, address)} with exception"
            f" {code}{why}.",
        )


HOPELESS = (PortBusy, PortMissing, PortRefused, NotShared)
"""Failures that do not end by waiting."""
