"""Requests with replies unlike those before: none of these can be mistaken for their reply."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import replace
from secrets import randbelow

from tui.safety import MISSES

from ..coils import single_read
from ..expectation import IDENTIFY, Expectation
from ..limits import Limits, send_refusal
from ..master import ExchangeResult, MonotonicClock, ResultKind
from ..model import Priority
from ..requests import Diagnose, Identify, Read, Request
from .patience import Devices
from .queue import Job

ECHO = 0
"""The sub-function that every device echoes, if it has function 8."""
LOOKED_BACK = 4
"""Number of recent requests to a drive whose replies differ in form."""


class Probes:
    """Finds a form of its own for a reply; lives in the line's loop."""

    def __init__(self, devices: Devices, clock: MonotonicClock, *, gateway: bool) -> None:
        """`gateway`: a reply has the address of its request, also if another drive replied."""
        self._devices = devices
        self._clock = clock
        self._gateway = gateway
        self.forms = Forms(clock)
        self._sent: dict[int, deque[Expectation]] = {}
        self.heard = False
        """True once a reply came that the adapter's own echo cannot be."""
        self.silent: set[int] = set()
        """Drives that were silent to a longer read just now, and may always be."""
        self._good: dict[int, dict[Expectation, Read]] = {}
        """By device and form, the read that was answered last."""

    def sent(self, device: int) -> deque[Expectation]:
        """Replies that are due or may come late, and could be taken for one of this device."""
        return self._sent.setdefault(0 if self._gateway else device, deque(maxlen=LOOKED_BACK))

    def forget_sent(self) -> None:
        """Forget earlier requests: on a new connection, their replies cannot come."""
        self._sent.clear()

    def note_good(self, read: Read) -> None:
        """A read was answered: it can be a probe."""
        self._good.setdefault(read.device, {})[read.expectation()] = read

    def lengthen(self, job: Job) -> bool:
        """Lengthen a read, so that no earlier reply can be mistaken for its own."""
        if not isinstance(job.request, Read) or not job.limits.answers_all:
            return False
        forms = self.forms.longer(job.request, job.limits)
        found = (read for read in forms if read.expectation() != job.expectation)
        form = next((read for read in found if self._is_new(read)), None)
        if form is not None:
            job.take_form(form)
        return form is not None

    def find(self, job: Job, depth: int = LOOKED_BACK) -> Request | None:
        """A request that changes nothing, with a reply unlike those to so many before, and to the
        job."""
        found = (request for request in self._of(job) if request.expectation() != job.expectation)
        return next((request for request in found if self._is_new(request, depth)), None)

    def find_alone(self, job: Job, depth: int) -> Request | None:
        """The same if the job itself is not sent; it may be the job."""
        return next((request for request in self._alone(job) if self._is_new(request, depth)), None)

    def _alone(self, job: Job) -> Iterator[Request]:
        yield from self._of(job, away=False)
        if isinstance(job.request, Read):
            yield job.request

    def _is_new(self, form: Request, depth: int = LOOKED_BACK) -> bool:
        device, expectation, now = form.device, form.expectation(), self._clock()
        if expectation in list(self.sent(device))[-depth:]:
            return False
        free = self._devices.not_before(device, expectation, Priority.POLL, now)
        return free <= max(now, self._devices.quiet_until)

    def _is_away(self, device: int) -> bool:
        """True if a drive that may be silent to longer reads is to be sent none."""
        silent = device in self.silent or self._devices[device].failures >= MISSES
        return silent or not self.forms.may_be_longer(device)

    def _of(self, job: Job, *, away: bool | None = None) -> Iterator[Request]:
        request, limits = job.request, job.limits
        if away is None:
            away = not limits.answers_all and self._is_away(request.device)
        if isinstance(request, Read):
            yield from shorter(request, limits)
        yield from self._good.get(request.device, {}).values()
        if isinstance(request, Read) and not away:
            yield from self.forms.longer(request, limits)
        if self.heard and Diagnose.function in limits.functions and ECHO in limits.subfunctions:
            yield Diagnose(request.device, ECHO, randbelow(1 << 16))
        if IDENTIFY in limits.functions and limits.answers_all:
            yield Identify(request.device)
        read = single_read(request)
        if read.function in limits.functions and not isinstance(request, Read):
            yield read
            yield from self.forms.longer(read, limits)


def may_be_silent(job: Job, probe: Request) -> bool:
    """True if a drive that would answer the job may be silent to the probe."""
    read = job.request
    if not isinstance(probe, Read) or not isinstance(read, Read) or job.limits.answers_all:
        return False
    return probe.count > read.count


MOST_MORE = 8
"""Registers that are read in addition at most."""
FORM_TRIES = 2
"""Longer reads in a row without a reply after which none so long is sent for a while."""
SILENT_FOR, DEVICE_SILENT_FOR = 60.0, 300.0
"""Seconds until they are sent again: of those registers, and to a drive that may be silent."""
REMEMBERED = 4096
"""Most longer reads whose failures are remembered."""


class Forms:
    """Lengths that a drive replies to; lives in the line's loop.

    A reply names no request, but its length is that of its own request. A drive may refuse a
    longer read, or be silent: the register after those needed need not exist.
    """

    def __init__(self, clock: MonotonicClock) -> None:
        self._clock = clock
        self._refused: set[Read] = set()
        self._silences: dict[Read | int, tuple[int, float]] = {}
        """Silences in a row, and when the last was; by read, and by device for reads that it may
        always meet with silence."""

    def longer(self, request: Read, limits: Limits) -> Iterator[Read]:
        """Reads of more registers from the same one on, shortest first; some may meet silence."""
        for more in range(1, MOST_MORE + 1):
            form = replace(request, count=request.count + more * request.step)
            if form in self._refused or self._rests(form, SILENT_FOR):
                return  # longer reads are refused too
            if not send_refusal(form, limits):
                yield form

    def may_be_longer(self, device: int) -> bool:
        """False while a drive does not answer longer reads."""
        return not self._rests(device, DEVICE_SILENT_FOR)

    def _rests(self, which: Read | int, seconds: float) -> bool:
        times, last = self._silences.get(which, (0, 0.0))
        if times and self._clock() - last > seconds:
            del self._silences[which]
            return False
        return times >= FORM_TRIES

    def note(self, form: Read, result: ExchangeResult) -> None:
        """Note the end of a longer read."""
        if result.kind is ResultKind.REPLY:
            self._silences.pop(form, None)
            self._silences.pop(form.device, None)
            return
        if len(self._silences) + len(self._refused) >= REMEMBERED:
            self._silences.clear()
            self._refused.clear()
        if result.kind is ResultKind.EXCEPTION:
            self._refused.add(form)
        else:
            self.note_silence(form)

    def note_silence(self, which: Read | int) -> None:
        """Note a read without a reply, or a drive silent to a longer read than it answers."""
        self._silences[which] = self._silences.get(which, (0, 0.0))[0] + 1, self._clock()


def shorter(request: Read, limits: Limits) -> Iterator[Read]:
    """Reads of fewer registers from the same one on, longest first."""
    for count in range(request.count - request.step, 0, -request.step):
        form = replace(request, count=count)
        if not send_refusal(form, limits):
            yield form
