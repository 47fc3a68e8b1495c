"""Proof that a line is in step: that each reply belongs to the request before it.

A converter that is one reply behind answers each request with the reply to an earlier one. Address,
function, length and checksum are right, so the value of another register would be shown. A reply
proves the step if no recent request to its drive has one of its form: its length, or its number.
"""

from __future__ import annotations

from collections.abc import Callable

from ..errors import ONE_BEHIND, LineBehind
from ..expectation import EXCEPTION, IDENTIFY, REPORT_ID, Expectation
from ..master import ExchangeResult, Master, MonotonicClock, Piece, ResultKind, Sending
from ..model import Priority, Timing
from ..requests import Diagnose, Read, Request
from .device_record import judge_guess
from .outcomes import Outcomes
from .patience import Devices
from .probes import LOOKED_BACK, Probes, may_be_silent
from .queue import Job
from .unsent import fail_without_line, is_stop_word

CHECK_EVERY, CHECK_SHARE = 10.0, 0.01
"""Seconds from one proof to the next on a connection that buffers, and their longest share."""
SUSPECT = 2
"""Exchanges in a row with an earlier reply, after which the line is left quiet."""
LONGEST_DRAIN = 10.0
REOPENINGS = 3
"""Times that the line is opened again immediately; after that, every RETRY seconds."""
RETRY = 10.0
PROBE_AGAIN = 0.2
"""Seconds until a probe is tried again, if a late reply could be taken for that of any."""
LONGEST_FREE = 3.0
"""Seconds after which a probe unlike the last request alone is sent."""
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
        buffers: bool,
        gateway: bool = False,
    ) -> None:
        """`buffers`: the connection may come out of step with no request lost. `gateway`: a
        reply has the address of its request, also if another drive replied."""
        self._devices = devices
        self._outcomes = outcomes
        self._clock = clock
        self._timing = timing
        self._buffers = buffers
        self._gateway = gateway
        self._probes = Probes(devices, clock, gateway=gateway)
        self.lengthen = self._probes.lengthen
        self._proved: set[int] = set()
        self._weak: set[int] = set()
        """Drives whose next reply proves the step if it differs from the last one only."""
        self._missed: dict[int, bytes] = {}
        """By device, the last request if nothing came: a reply to it is as good for its repeat."""
        self._next_check = 0.0
        self._shifts = 0
        self._witness: Job | None = None
        self._rounds = self._tries = 0
        self._next_try = self._waited = 0.0
        self._last = -1
        """The device of the last exchange."""
        self.quiet_until = 0.0
        """End of the time in which the line is left quiet; 0 if it is not."""
        self.behind = ""
        """A sentence about the problem if the replies are behind."""
        self.reopen = False
        """True if the connection must be closed, and opened again immediately."""
        self.recovered: Callable[[], None] = lambda: None
        """Called once the replies are in step again."""

    def opened(self) -> None:
        """Trust no drive on a new connection before it has proved its step."""
        self._proved.clear()
        self._weak.clear()
        self._missed.clear()
        self._probes.heard = False
        self._shifts, self._tries, self._next_try = 0, 0, 0.0
        self._waited, self.quiet_until, self.reopen = 0.0, 0.0, False
        if not self.behind:
            self._probes.forget_sent()

    def refuses(self, job: Job) -> bool:
        """Fail a request on a line that is behind, unless it is a stop word."""
        if not self.behind or is_stop_word(job):
            return False
        fail_without_line(job, LineBehind(self.behind))
        return True

    def not_before(self, job: Job, now: float) -> float | None:
        """When a request may be sent, if that depends on nothing else; else None."""
        if self.behind and job.priority is not Priority.STOP:
            return 0.0  # to fail
        drains = self.quiet_until > now and job.priority > Priority.FEED
        return self.quiet_until if drains else None

    def prepare(self, job: Job) -> Request | None:
        """Give a job a form that proves the step, if it needs one; else the probe to send first."""
        device, own = job.request.device, job.expectation
        if own is None or is_stop_word(job) or own.function in (IDENTIFY, REPORT_ID):
            return None
        if not self._timing.probes or job.within is not None:
            return None  # a request with its own timeout checks if there is a device at all
        if self._buffers and self._clock() >= self._next_check:
            self._proved.discard(device)
        before = self._probes.sent(device)
        if device in self._proved or (before and own not in before and not job.request.changes):
            return None
        if job.repeats and self._missed.get(device) == job.pdu:
            return None
        if (before and self.lengthen(job)) or job.priority is Priority.STOP:
            return None
        if job.probes >= LOOKED_BACK:
            return None  # a drive that refuses so many probes will not prove its step
        job.probes += 1
        if (probe := self._probes.find(job)) is not None or not before:
            return probe
        # few forms: one that differs from the last request's is the best there is
        self._weak.add(device)
        return self._probes.find(job, 1) if own == before[-1] else None

    async def prove(self, master: Master, job: Job, probe: Request) -> ExchangeResult:
        """Send a probe for a job. Raises LineLost."""
        device, expectation, begun = probe.device, probe.expectation(), self._clock()
        time_out = self._devices.time_out(device, job.request.function, job.priority, job.within)
        result = None
        try:
            result = await master.exchange(Sending(device, probe.pdu(), expectation, time_out))
            self._outcomes.hear_gateway(job, result)
            self._outcomes.record(device, probe.pdu(), result, job)
        finally:
            if result is None or result.kind in UNANSWERED:
                sent = begun if result is None else result.sent
                self._devices.may_come(device, expectation, sent, self._clock())
        self.note(job, expectation, result, number=isinstance(probe, Diagnose))
        if isinstance(probe, Read):
            self._probes.forms.note(probe, result)
        if result.kind is ResultKind.NOTHING and may_be_silent(job, probe):
            self._probes.silent.add(device)
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
        before = self._probes.sent(device)
        certain = number or (bool(before) and expectation not in before and not job.mistakable)
        weak = device in self._weak and not job.mistakable
        proves = certain or (weak and expectation != before[-1])
        self._weak.discard(device)
        self._missed.clear() if self._gateway else self._missed.pop(device, None)
        if result.kind is ResultKind.NOTHING and expectation == job.expectation:
            self._missed[device] = job.pdu
        frames = result.strays if result.instead is None else [result.instead]
        read, replied = job.form or job.request, result.kind is ResultKind.REPLY
        self._probes.heard |= replied and not number
        shifted = result.kind in UNANSWERED and any(map(self._is_earlier, frames))
        before.append(expectation)
        if replied and isinstance(read, Read) and read.expectation() == expectation:
            self._probes.note_good(read)
            if device in self._probes.silent:
                self._probes.forms.note_silence(device)
        self._probes.silent.discard(device)
        if replied and certain and not result.strays and not self._gateway:
            judge_guess(self._devices[device], result.sent, now)
        if replied and proves:
            self._proved.add(device)
            self._next_check = now + max(CHECK_EVERY, (now - result.sent) / CHECK_SHARE)
            self._fall_in()
        elif result.kind in UNANSWERED:
            self._distrust(device)
        for piece in result.strays:
            self._distrust(piece.device)
        if shifted:
            self._witness = self._witness if self.behind else job
            self._shift(result.sent, now)
        elif self._is_cleared(device, result):
            self._shifts, self.quiet_until = 0, 0.0
        self._last = device

    def _distrust(self, device: int) -> None:
        """A reply may come late, to any device behind a gateway."""
        if self._gateway:
            self._proved.clear()
        self._proved.discard(device)

    def _is_cleared(self, device: int, result: ExchangeResult) -> bool:
        """True if an exchange that brought no earlier reply ends the suspicion.

        A reply that is held back comes with the next exchange, whatever that is.
        """
        if result.kind is ResultKind.REPLY and device != self._last and not self._gateway:
            return True
        return bool(self.quiet_until) and result.sent >= self.quiet_until

    def _is_earlier(self, piece: Piece) -> bool:
        """True if a frame may be the reply to an earlier request."""
        function = piece.pdu[0] & ~EXCEPTION
        refused = function != piece.pdu[0]
        sent = self._probes.sent(piece.device)
        return any(
            expectation.function == function if refused else expectation.fits(piece.pdu)
            for expectation in sent
        )

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
        self._probes.forms.note(job.form, result)
        if result.kind is ResultKind.EXCEPTION:
            device, expectation = job.request.device, job.form.expectation()
            self._devices.may_come(device, expectation, result.sent, self._clock())
            self._outcomes.count_beside(device, result)
            self._outcomes.note_strays(result.strays, result.end)
            job.take_form(None)
            return True
        return False

    async def attend(self, master: Master) -> float:
        """Check if a line that is behind is in step again; returns the seconds to the next check.

        Raises LineLost.
        """
        now = self._clock()
        if now < self._next_try:
            return self._next_try - now
        if self._tries >= PROBES:
            self.reopen = True
            return 0.0
        assert self._witness is not None
        waits = self._waited < LONGEST_FREE
        probe = self._probes.find_alone(self._witness, LOOKED_BACK if waits else 1)
        if probe is None and self._waited < LONGEST_DRAIN:
            self._waited += PROBE_AGAIN
            return PROBE_AGAIN
        if probe is None:
            self._tries = PROBES  # few forms: the line is opened again anyway
        else:
            await master.quiet()
            self._tries += 1
            result = await self.prove(master, self._witness, probe)
            if result.kind in UNANSWERED:
                self._outcomes.note_strays(result.strays, result.end)
        if self.behind and self._tries >= PROBES:
            self._rounds += 1
            if not self._shifts and probe is not None:
                self._fall_in()  # there is no further sign of it
            drain = self._timing.first_timeout
            self._next_try = self._clock() + (drain if self._rounds < REOPENINGS else RETRY)
        return 0.0
