"""Result of a request once its exchange is over: an answer, an error, or a retry."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from enum import Enum
from time import time

from tui.safety import MISSES
from tui.wire.overheard import overheard_request

from ..errors import (
    OUTCOME_UNKNOWN,
    ChecksumFault,
    DeviceException,
    LineError,
    NoAnswer,
    WrongReply,
    request_text,
)
from ..limits import STANDARD_EXCEPTIONS
from ..line_events import DeviceWritten
from ..master import ExchangeResult, MonotonicClock, Piece, ResultKind
from ..model import EndedExchange, Priority, Reply, Timing
from ..requests import BROADCAST
from ..shared_state import SharedState
from ..tally import Tally
from .device_record import known_before
from .patience import Devices
from .queue import Job
from .shared_values import SharedValues

log = logging.getLogger(__name__)

GATEWAY_EXCEPTIONS = frozenset({10, 11})
"""Exceptions by which a gateway reports that a device behind it did not answer."""
STILL = 1.0
"""Seconds above the timeout after which an answer cannot have come just now."""
REPEATED_WHEN_SILENT = frozenset(range(Priority.POLL + 1))
SHORT_SILENCE = 5.0
"""Seconds after which several misses in a row are a trouble of the drive, not of the line."""
POLL_REPEATS = MISSES - 1
"""Repeats of a poll whose reply was lost or damaged: a value is needed in each cycle."""


class Next(Enum):
    """Next step for a request whose exchange brought no reply."""

    REPEAT = "repeat"
    NOTHING = "nothing"
    """It has failed."""


class Outcomes:
    """Notes the ends of exchanges, and hands them back; lives in the line's loop."""

    def __init__(
        self,
        devices: Devices,
        tally: Tally,
        timing: Timing,
        clock: MonotonicClock,
        facts: SharedState,
        *,
        gateway: bool,
    ) -> None:
        self.values = SharedValues()
        """Values read a moment ago."""
        self._devices = devices
        self._tally = tally
        self._timing = timing
        self._clock = clock
        self._facts = facts
        self._gateway = gateway

    def waited_for_us(self, job: Job, result: ExchangeResult) -> bool:
        """True if a read is sent again: the time of its answer is not known.

        This program may have been stopped in between, and the answer have waited for it.
        """
        if job.request.changes or result.kind not in (ResultKind.REPLY, ResultKind.EXCEPTION):
            return False
        request = job.request
        longest = self._devices.time_out(request.device, request.function, job.priority)
        # a long reply at 1200 baud is on the wire for longer than that
        return result.turnaround + self._clock() - result.end > longest + STILL

    def hear_gateway(self, job: Job, result: ExchangeResult) -> None:
        """Treat a gateway's report of a silent device as that silence."""
        if result.kind is ResultKind.EXCEPTION and self._is_gateways(job, result.exception):
            result.kind, result.detail = ResultKind.NOTHING, "the gateway heard nothing of it"

    def conclude(self, job: Job, result: ExchangeResult, *, unsent: bool = False) -> Reply | Next:
        """Note the result of a request; returns its reply, or what follows without one.

        A request that failed has its error then. `unsent`: the probe before it had no reply, so
        that it was not sent itself.
        """
        request, now = job.request, self._clock()
        if job.expectation is None:
            self.note_strays(result.strays, result.end)
            self._report_write(job, result.sent)
            return job.reply(b"", result.sent)
        if result.kind in (ResultKind.REPLY, ResultKind.EXCEPTION):
            self._count_good(request.device, result, now)
            exchanged = (job.pdu, result.pdu)
            refused = result.kind is ResultKind.EXCEPTION
            self._devices.answered(
                request.device, job.expectation, result.turnaround, now, exchanged, refused=refused
            )
        before = known_before(self._devices[request.device], result.sent)
        unexplained = self.note_strays(result.strays, result.end)
        if result.kind is ResultKind.WRONG and result.strays and request.device not in unexplained:
            result.kind = ResultKind.NOTHING
            self._devices[request.device].guess = before
        match result.kind:
            case ResultKind.REPLY:
                reply = job.reply(result.pdu, self._time_of(job, result))
                self._share(job, reply)
                self._report_write(job, result.end)
                return reply
            case ResultKind.EXCEPTION:
                self._tally.count_exception(request.device, result.exception)
                job.fail(self._exception(job, result.exception))
                repeated = False
            case _ if unsent and request.changes:
                repeated = self._unsent(job)
            case _:
                repeated = self._failed(job, result, now)
        return Next.REPEAT if repeated else Next.NOTHING

    def _unsent(self, job: Job) -> bool:
        request = job.request
        if job.repeats < self._timing.retries:
            job.repeats += 1
            return True
        text = f"Device {request.device} did not answer a test read. Nothing was written."
        job.fail(NoAnswer(request.device, request.function, request.register, text))
        return False

    def record(
        self, device: int, pdu: bytes, result: ExchangeResult, job: Job | None = None, as_: str = ""
    ) -> None:
        """Pass an exchange on to the recorder; `as_` names its result if that is not its kind."""
        if (record := self._facts.record) is None:
            return
        good = result.kind in (ResultKind.REPLY, ResultKind.EXCEPTION)
        try:
            record(
                EndedExchange(
                    device, pdu, as_ or result.kind.value,
                    result.pdu if good else result.received,
                    result.sent, result.end, time() - (self._clock() - result.end),
                    job.program if job is not None else "",
                    job.repeats if job is not None else 0,
                    tuple(piece.data for piece in result.strays),
                )
            )  # fmt: skip
        except Exception:
            # nothing may depend on the recorder
            log.exception("the recorder failed")
            self._facts.record = None

    def count_beside(self, device: int, result: ExchangeResult) -> None:
        """Count the reply to a request that was sent in addition to the requested one."""
        if result.kind in (ResultKind.REPLY, ResultKind.EXCEPTION):
            self._count_good(device, result, result.end)

    def _count_good(self, device: int, result: ExchangeResult, now: float) -> None:
        """A right reply; misses before it are those of the line if they were few."""
        record, tally = self._devices[device], self._tally
        tally.count_reply(device, result.turnaround)
        since = now if record.silent_since is None else record.silent_since
        short = record.failures < MISSES or now - since < SHORT_SILENCE
        tally.count_good(device, was_heard=record.ever_answered and short)

    def _share(self, job: Job, reply: Reply) -> None:
        """Keep the words of a reply, while another reader may use them.

        That is another program, or another client of this one: a gateway uses earlier values.
        """
        if not job.mistakable and (len(self._facts.programs) > 1 or job.max_age):
            self.values.note(job.request, reply.words, reply.time)

    def _report_write(self, job: Job, time: float) -> None:
        """Report registers that were written, with their program."""
        address, values = job.request.written
        if not values:
            return
        known = {item.id: item for item in (*self._facts.departed, *self._facts.programs)}
        if (program := known.get(job.program or self._facts.me.id)) is not None:
            written = DeviceWritten(job.request.device, address, values, program, max(0.0, time))
            self._facts.events.emit(written)

    @staticmethod
    def _time_of(job: Job, result: ExchangeResult) -> float:
        """The time of a reply; of a repeat, that of the first try.

        Its reply may be the late one to the first try: right for the request, but no newer.
        """
        return result.end if job.first_sent is None else min(job.first_sent, result.end)

    def _failed(self, job: Job, result: ExchangeResult, now: float) -> bool:
        request, expectation = job.request, job.expectation
        assert expectation is not None
        place = (request.device, request.function, request.register)
        again = b"" if request.changes else job.pdu
        # a request with its own timeout checks if there is a device at all
        known = job.within is None and self._devices[request.device].ever_answered
        searched = job.priority >= Priority.BACKGROUND and not known
        if result.kind in (ResultKind.DAMAGED, ResultKind.WRONG) and not searched:
            self._tally.count_minute(request.device, "damaged")
        error: LineError
        match result.kind:
            case ResultKind.DAMAGED:
                self._tally.count_checksum(request.device)
                if not result.recognized:
                    self._devices.may_come(request.device, expectation, result.sent, now, again)
                error = ChecksumFault(*place, received=result.received)
            case ResultKind.WRONG:
                self._tally.count_wrong(request.device)
                self._devices.may_come(request.device, expectation, result.sent, now, again)
                error = WrongReply(*place, result.detail, result.received)
            case _:
                self._tally.count_silence(request.device, searched=searched)
                self._devices.silent(request.device, expectation, result.sent, now, again)
                error = NoAnswer(*place, self._no_answer(job, result.detail))
        if self._is_repeated(job, result.kind):
            job.repeats += 1
            if job.first_sent is None:
                job.first_sent = result.sent
            self._tally.count_repeat(request.device)
            return True
        job.fail(error)
        return False

    def _is_repeated(self, job: Job, kind: ResultKind) -> bool:
        """True if a request is sent again: never one that changes anything."""
        polled = job.priority is Priority.POLL
        retries = POLL_REPEATS if polled and self._timing.retries else self._timing.retries
        if job.request.changes or job.repeats >= retries:
            return False
        if kind is ResultKind.DAMAGED:
            return job.priority < Priority.BACKGROUND
        if kind is ResultKind.WRONG:
            return polled
        record = self._devices[job.request.device]
        rests = polled and record.next_try is not None
        return record.ever_answered and not rests and job.priority in REPEATED_WHEN_SILENT

    def note_strays(self, strays: Iterable[Piece], time: float) -> set[int]:
        """Note frames that came with the reply; returns the devices of unexplained ones."""
        unexplained = set()
        for piece in strays:
            self._tally.stale += 1
            if not self.note_stray(piece, time):
                unexplained.add(piece.device)
        return unexplained

    def note_stray(self, piece: Piece, time: float) -> bool:
        """Note a frame that answers no present request; True if its origin is known."""
        kind, device = self._devices.stray(piece, time), piece.device
        answers = device in self._devices.known and self._devices[device].ever_answered
        if not kind and (not answers or overheard_request(piece.data) is not None):
            self._tally.count_minute(None, "foreign")
        elif kind != "late":
            self._tally.count_minute(device, "strays")
        return bool(kind)

    def _is_gateways(self, job: Job, code: int) -> bool:
        meanings = job.limits.exceptions
        own = code in meanings and meanings is not STANDARD_EXCEPTIONS
        return self._gateway and code in GATEWAY_EXCEPTIONS and not own

    def _exception(self, job: Job, code: int) -> DeviceException:
        request = job.request
        meaning = job.limits.exceptions.get(code) or STANDARD_EXCEPTIONS.get(code, "")
        return DeviceException(request.device, request.function, request.register, code, meaning)

    def _no_answer(self, job: Job, detail: str) -> str:
        request = job.request
        text = _SILENT_BECAUSE if detail else _SILENT
        what = request_text(request.function, request.register or None)
        return with_fate(job, text.format(device=request.device, request=what, detail=detail))


_SILENT = "Device {device} did not answer ({request})."
_SILENT_BECAUSE = "Device {device} did not answer ({request}): {detail}."


def with_fate(job: Job, text: str) -> str:
    """Add to an error of a write that it may have taken effect."""
    unknown = job.request.changes and job.request.device != BROADCAST
    return text + OUTCOME_UNKNOWN if unknown else text
