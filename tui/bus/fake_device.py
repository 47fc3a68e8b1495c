"""A device on a fake line: its registers, its planned failures, its state on the line."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from .errors import DeviceException, ExchangeError, LineError, NoAnswer
from .limits import STANDARD_EXCEPTIONS
from .model import DeviceState, IdentificationObjects
from .requests import (
    REFERENCE,
    Identify,
    Read,
    ReadWrite,
    ReportId,
    Request,
    WriteMany,
    WriteOne,
)

UNKNOWN_FUNCTION, UNKNOWN_ADDRESS = 1, 2


@dataclass(slots=True)
class PlannedFailure:
    """A planned failure; `times` is its remaining number, `taken` is True if the words arrive."""

    error: LineError | int
    address: int | None
    times: float
    taken: bool = False

    def hits(self, request: Request) -> bool:
        """Return True if a request meets it."""
        return self.times > 0 and (self.address is None or self.address in _span(request))

    def raised(self, request: Request) -> LineError:
        """The error; where only the code of an exception was given, the refusal with it."""
        if isinstance(self.error, LineError):
            return self.error
        return refusal(request.device, request.function, request.register, self.error)


class FakeDevice:
    """Registers in a dictionary; replace `held` and `take` for another behavior."""

    def __init__(self, number: int, words: Mapping[int, int] | None = None) -> None:
        self.number = number
        self.words = dict(words or {})
        """The registers, by address."""
        self.identity: Mapping[int, bytes] | None = None
        """Objects of function 43/14; None if the device does not support the function."""
        self.called: bytes | None = None
        """Reply to function 17; None if the device does not know the function."""
        self.silent = False
        self.seconds = 0.0
        """Delay of each answer in seconds."""
        self.state = DeviceState(None, 0, None, None, None, None, None)
        """State of the device on the line; may be set."""
        self._failures: dict[str, list[PlannedFailure]] = {}

    def held(self, address: int, count: int) -> tuple[int, ...]:
        """The words that a read finds. Raises the DeviceException with which it refuses."""
        span = range(address, address + count)
        if any(number not in self.words for number in span):
            raise refusal(self.number, Read.function, address, UNKNOWN_ADDRESS)
        return tuple(self.words[number] for number in span)

    def take(self, address: int, values: Sequence[int]) -> None:
        """Do with written words as it likes. Raises the DeviceException with which it refuses."""
        span = range(address, address + len(values))
        if any(number not in self.words for number in span):
            raise refusal(self.number, WriteOne.function, address, UNKNOWN_ADDRESS)
        self.words.update(zip(span, values, strict=True))

    def objects(self) -> IdentificationObjects:
        """Return its identity. Raises DeviceException if it does not support the function."""
        if self.identity is None:
            raise refusal(self.number, Identify.function, 0, UNKNOWN_FUNCTION)
        return IdentificationObjects(1, self.identity)

    def own_words(self) -> IdentificationObjects:
        """Return its own name. Raises DeviceException if it does not support the function."""
        if self.called is None:
            raise refusal(self.number, ReportId.function, 0, UNKNOWN_FUNCTION)
        return IdentificationObjects(0, {REFERENCE: self.called})

    def fail(self, kind: str, failure: PlannedFailure) -> None:
        """Plan a failure; it replaces an earlier one of the same address."""
        wanted = self._failures.setdefault(kind, [])
        wanted[:] = [
            planned_failure
            for planned_failure in wanted
            if planned_failure.address != failure.address
        ]
        wanted.append(failure)

    def next_failure(self, kind: str, request: Request) -> PlannedFailure | None:
        """The failure that a request meets; one less is left of it."""
        for failure in self._failures.get(kind, ()):
            if failure.hits(request):
                failure.times -= 1
                return failure
        return None

    def noted(self, error: ExchangeError | None, now: float) -> None:
        """An exchange with it has ended."""
        if error is None or isinstance(error, DeviceException):
            self.state = replace(
                self.state,
                answers=True,
                failures=0,
                silent_since=None,
                heard=now,
                refused=error is not None,
            )
        elif isinstance(error, NoAnswer):
            self.state = replace(
                self.state,
                answers=False,
                failures=self.state.failures + 1,
                silent_since=self.state.silent_since or now,
            )


def refusal(device: int, function: int, address: int, code: int) -> DeviceException:
    """Return the exception of a device that does not support it."""
    return DeviceException(device, function, address, code, STANDARD_EXCEPTIONS.get(code, ""))


def _span(request: Request) -> range:
    """The registers by which a failure is found: the written ones, if there are any."""
    match request:
        case Read(address=address, count=count):
            return range(address, address + count)
        case WriteOne(address=address):
            return range(address, address + 1)
        case WriteMany(address=address, values=values):
            return range(address, address + len(values))
        case ReadWrite(write_address=address, values=values):
            return range(address, address + len(values))
        case _:
            return range(0)
