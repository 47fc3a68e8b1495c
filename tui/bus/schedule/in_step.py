"""Proof that a line is in step: that each reply belongs to the request before it.

A converter that is one reply behind answers each request with the reply to an earlier one. Address,
function, length and checksum are right, so the value of another register would be shown. A reply
proves the step if no recent request to its drive has one of its form: its length, or its number.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from secrets import randbelow

from ..errors import ONE_BEHIND, LineBehind, NoAnswer
from ..expectation import EXCEPTION, IDENTIFY, REPORT_ID, Expectation
from ..master import Master, MonotonicClock, Sending
from ..model import Priority, Timing
from ..requests import Diagnose, Identify, Read, Request
from ..result import ExchangeResult, Piece, ResultKind
from .forms import FORM_TRIES, Forms, shorter
from .outcomes import Outcomes
from .patience import Devices
from .queue import Job

ECHO = 0
"""The sub-function that every device echoes, if it has function 8."""
LOOKED_BACK = 4
"""Requests to a drive whose replies have a form of their own."""
CHECK_EVERY, CHECK_SHARE = 10.0, 0.01
"""Seconds from one proof to the next on a connection that buffers, and their longest share."""
SUSPECT = 2
"""Exchanges in a row that brought an earlier reply, after which the line is left to drain."""
LONGEST_DRAIN = 10.0
REOPENINGS = 3
"""Times that the line is opened again immediately; after that, every RETRY seconds."""
RETRY = 10.0
PROBE_AGAIN = 0.2
"""Seconds until a probe is tried again, if a late reply could be taken for that of any."""
PROBES = 2
"""Requests that show whether an opened line is in step."""
BEHIND = (
    f"{ONE_BEHIND}: each request gets the reply to the one before. No value is shown, and"
    " only stops are sent. Switch the converter or gateway off and on."
)
UNANSWERED = (ResultKind.NOTHING, ResultKind.DAMAGED, ResultKind.WRONG)


class InStep:
    """Decides which replies are in step, and names a line that is behind; in the line's loop."""

    def __init__(
        self,
        devices: Devices,
        outcomes: Outcomes,
        clock: MonotonicClock,
        timing: Timing,
        *,
        buffers: bool,
    ) -> None:
        """`buffers`: the connection may come out of step with no request lost."""
        self._devices = devices
        self._outcomes = outcomes
        self._clock = clock
        self._timing = timing
        self._buffers = buffers
        self._forms = Forms()
        self._sent: dict[int, deque[Expectation]] = {}
        self._good: dict[int, dict[int, Read]] = {}
        """By device and length, the read that was answered last."""
        self._silences: dict[int, int] = {}
        """By device, the longer reads that met silence, and may always do so."""
        self._heard = False
        """True once a reply came that the adapter's own echo cannot be."""
        self._proved: set[int] = set()
        self._weak: set[int] = set()
        """Drives whose next reply proves its step if it is unlike the last one alone."""
        self._next_check = 0.0
        self._shifts = 0
        self._witness: Job | None = None
        self._rounds = self._probes = 0
        self._next_try = 0.0
        self.quiet_until = 0.0
        """Until then the line is left to drain; 0 if it is not."""
        self.behind = ""
        """The trouble in a sentence, if the replies are behind."""
        self.reopen = False
        """True if the connection must be closed, and opened again immediately."""
        self.recovered: Callable[[], None] = lambda: None
        """Called once the replies are in step again."""

    def opened(self) -> None:
        """Trust no drive on a new connection before it has proved its step."""
        self._proved.clear()
        self._heard = False
        self._shifts, self._probes, self._next_try = 0, 0, 0.0
        self.quiet_until, self.reopen = 0.0, False
        if not self.behind:
            self._sent.clear()

    def refuses(self, job: Job) -> bool:
        """Fail a request on a line that is behind, unless it is the word of a stop."""
        stops, request = job.priority is Priority.STOP, job.request
        if not self.behind or (stops and request.changes):
            return False
        place = (request.device, request.function, request.register)
        # a stop that cannot read goes on without: a lost line would end it
        job.fail(NoAnswer(*place, self.behind) if stops else LineBehind(self.behind))
        return True

    def prepare(self, job: Job) -> Request | None:
        """Give a job a form that proves the step, if it needs one; else the probe to send first."""
        device, own = job.request.device, job.expectation
        stops = job.priority is Priority.STOP
        if own is None or (stops and job.request.changes) or own.function in (IDENTIFY, REPORT_ID):
            return None
        if not self._timing.probes or job.within is not None:
            return None  # who says how long is waited looks whether anybody answers at all
        if self._buffers and self._clock() >= self._next_check:
            self._proved.discard(device)
        before = self._sent.get(device)
        if device in self._proved or (before and own not in before and not job.request.changes):
            return None
        if (before and self.lengthen(job)) or stops:
            return None
        if (probe := self._probe(job)) is not None or not before:
            return probe
        # few forms: one that differs from the last request's is the best there is
        self._weak.add(device)
        return self._probe(job, 1) if own == before[-1] else None

    def lengthen(self, job: Job) -> bool:
        """Have a read sent longer, so that no earlier reply can be taken for its own."""
        if not isinstance(job.request, Read) or not job.limits.answers_all:
            return False
        forms = self._forms.longer(job.request, job.limits)
        form = next((one for one in forms if self._is_new(job, one)), None)
        if form is not None:
            job.take_form(form)
        return form is not None

    def _is_new(self, job: Job, form: Request, depth: int = LOOKED_BACK) -> bool:
        device, expectation, now = form.device, form.expectation(), self._clock()
        recent = list(self._sent.get(device, ()))[-depth:]
        if expectation in recent or expectation == job.expectation:
            return False
        free = self._devices.not_before(device, expectation, Priority.POLL, now)
        return free <= max(now, self._devices.quiet_until)

    def _probe(self, job: Job, depth: int = LOOKED_BACK) -> Request | None:
        """A request that changes nothing, with a reply unlike those to so many before."""
        return next((one for one in self._probes_of(job) if self._is_new(job, one, depth)), None)

    def _probes_of(self, job: Job) -> Iterator[Request]:
        request, limits = job.request, job.limits
        if isinstance(request, Read):
            yield from shorter(request, limits)
        yield from self._good.get(request.device, {}).values()
        if isinstance(request, Read) and self._silences.get(request.device, 0) < FORM_TRIES:
            yield from self._forms.longer(request, limits)
        if self._heard and Diagnose.function in limits.functions and ECHO in limits.subfunctions:
            yield Diagnose(request.device, ECHO, randbelow(1 << 16))
        if IDENTIFY in limits.functions and limits.answers_all:
            yield Identify(request.device)
        if Read.function in limits.functions and not isinstance(request, Read):
            yield (read := Read(request.device, request.register, 1))
            yield from self._forms.longer(read, limits)

    @staticmethod
    def may_be_silent(job: Job, probe: Request) -> bool:
        """True if a drive that would answer the job may be silent to the probe."""
        read = job.request
        if not isinstance(probe, Read) or not isinstance(read, Read) or job.limits.answers_all:
            return False
        return probe.count > read.count

    async def prove(self, master: Master, job: Job, probe: Request) -> ExchangeResult:
        """Send a probe for a job. Raises LineLost."""
        device, expectation, begun = probe.device, probe.expectation(), self._clock()
        time_out = self._devices.time_out(device, job.request.function, job.priority, job.within)
        result = None
        try:
            result = await master.exchange(Sending(device, probe.pdu(), expectation, time_out))
        finally:
            if result is None or result.kind in UNANSWERED:
                sent = begun if result is None else result.sent
                self._devices.may_come(device, expectation, sent, self._clock())
        self.note(job, expectation, result, number=isinstance(probe, Diagnose))
        if isinstance(probe, Read):
            self._forms.note(probe, result)
        if result.kind in UNANSWERED and self.may_be_silent(job, probe):
            self._silences[device] = self._silences.get(device, 0) + 1
        if result.kind in (ResultKind.REPLY, ResultKind.EXCEPTION):
            self._outcomes.count_beside(device, result)
            self._outcomes.note_strays(result.strays, result.end)
            refused = result.kind is ResultKind.EXCEPTION
            self._devices.answered(
                device,
                expectation,
                result.turnaround,
                self._clock(),
                (probe.pdu(), result.pdu),
                refused=refused,
            )
        return result

    def note(
        self, job: Job, expectation: Expectation, result: ExchangeResult, *, number: bool = False
    ) -> None:
        """Note the end of an exchange, of a job or of a probe for it, maybe with a number."""
        device, now = job.request.device, self._clock()
        before = self._sent.setdefault(device, deque(maxlen=LOOKED_BACK))
        proves = number or (bool(before) and expectation not in before)
        proves = proves or (device in self._weak and expectation != before[-1])
        self._weak.discard(device)
        frames = result.strays if result.instead is None else [result.instead]
        self._heard |= result.kind is ResultKind.REPLY and not number
        shifted = result.kind in UNANSWERED and any(map(self._is_earlier, frames))
        before.append(expectation)
        read, replied = job.form or job.request, result.kind is ResultKind.REPLY
        if replied and isinstance(read, Read) and read.expectation() == expectation:
            self._good.setdefault(device, {})[read.count] = read
        if replied and proves:
            self._proved.add(device)
            self._next_check = now + max(CHECK_EVERY, (now - result.sent) / CHECK_SHARE)
            self._fall_in()
        elif result.kind in UNANSWERED:
            self._proved.discard(device)
        for piece in result.strays:
            self._proved.discard(piece.device)
        if shifted:
            self._witness = self._witness if self.behind else job
            self._shift(result.sent, now)

    def _is_earlier(self, piece: Piece) -> bool:
        """True if a frame may be the reply to an earlier request."""
        function = piece.pdu[0] & ~EXCEPTION
        refused = function != piece.pdu[0]
        sent = self._sent.get(piece.device, ())
        return any(one.function == function if refused else one.fits(piece.pdu) for one in sent)

    def _shift(self, sent: float, now: float) -> None:
        self._shifts += 1
        if self.behind or self._shifts < SUSPECT:
            return
        if not self.quiet_until:
            due = max(self._devices.last_reply_by(now), now + self._timing.first_timeout)
            self.quiet_until = min(due, now + LONGEST_DRAIN)
        elif sent >= self.quiet_until:
            # nothing came by itself: the reply was held until the next request
            self.behind, self.reopen, self._rounds = BEHIND, True, 0

    def _fall_in(self) -> None:
        self._shifts, self.quiet_until = 0, 0.0
        if self.behind:
            self.behind = ""
            self.recovered()

    def stray(self, piece: Piece) -> None:
        """Note a frame that came while none was due: replies are late, and not held back."""
        self._proved.discard(piece.device)
        self._shifts, self.quiet_until = 0, 0.0

    def end_form(self, job: Job, result: ExchangeResult) -> bool:
        """Note the end of a longer read; True if it was refused, and the job waits again."""
        if job.form is None:
            return False
        self._forms.note(job.form, result)
        if result.kind is ResultKind.EXCEPTION:
            device, expectation = job.request.device, job.form.expectation()
            self._devices.may_come(device, expectation, result.sent, self._clock())
            self._outcomes.count_beside(device, result)
            self._outcomes.note_strays(result.strays, result.end)
            job.take_form(None)
            return True
        return False

    async def attend(self, master: Master) -> float:
        """Look whether a line that is behind is in step again; returns the seconds to the next
        look. Raises LineLost."""
        now = self._clock()
        if now < self._next_try:
            return self._next_try - now
        if self._probes >= PROBES:
            self.reopen = True
            return 0.0
        assert self._witness is not None
        probe = self._probe(self._witness)
        if probe is None and (probe := self._probe(self._witness, 1)) is None:
            return PROBE_AGAIN
        await master.quiet()
        self._probes += 1
        result = await self.prove(master, self._witness, probe)
        if result.kind in UNANSWERED:
            self._outcomes.note_strays(result.strays, result.end)
        if self.behind and self._probes >= PROBES:
            self._rounds += 1
            if not self._shifts:
                self._fall_in()  # nothing speaks for it any more
            drain = self._timing.first_timeout
            self._next_try = self._clock() + (drain if self._rounds < REOPENINGS else RETRY)
        return 0.0
