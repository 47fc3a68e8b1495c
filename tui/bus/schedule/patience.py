"""Knowledge of the line about each device: limits, turnaround, silence, late replies."""

from __future__ import annotations

from statistics import median

from tui.safety import LATE_MARGIN, LONGEST_WAIT, MARGIN, MISSES, QUIET_SHARE
from tui.wire.frames import SPACES

from ..coils import WriteCoils
from ..expectation import EXCEPTION, Expectation
from ..limits import Limits
from ..master import Piece, StrayKind
from ..model import DeviceState, Priority, Timing
from ..requests import WriteMany
from .device_record import Device, Outstanding, note_turnaround, usual

FORGET = 0.99
"""Share of the worst lateness that remains after each timely reply."""
SHORT_WAIT = 0.1
"""A wait between two like requests up to which a line that repeats replies is not soon trusted."""
LONG_MEMORY, SHORT_MEMORY = 600.0, 30.0
"""Seconds without a repeated reply after which a short wait is over, and a longer one is short."""
KNOWN = 4
"""Turnarounds that must be known before one can be called unusual."""
UNUSUAL_EARLY, UNUSUAL_LATE, JITTER = 0.5, 2.0, 0.002
"""Shares of the shortest recent turnaround and of their median, and seconds, that are usual."""


class Devices:
    """The records of all devices of one line; changed in the line's loop only.

    `describe` and `state` may be called from any thread: they replace or read single fields.
    """

    def __init__(self, timing: Timing, *, mistakable: bool) -> None:
        self._timing = timing
        self._mistakable = mistakable
        self._devices: dict[int, Device] = {}
        self._settle = 0.0
        self._repeated = 0.0
        """Of the whole line: the short wait after each reply, and when one last came twice."""
        self.quiet_until = 0.0

    def __getitem__(self, device: int) -> Device:
        return self._devices.get(device) or self._devices.setdefault(device, Device())

    def describe(self, device: int, limits: Limits) -> None:
        """Set the requests that a device accepts."""
        self[device].limits = limits

    def state(self, device: int) -> DeviceState:
        """Return the state of a device, as shown to programs."""
        record = self[device]
        return DeviceState(
            record.answers,
            record.failures,
            record.silent_since,
            record.next_try,
            record.turnaround,
            usual(record.recent) or record.reported_usual,
            record.heard,
            record.lateness,
            max(record.settle, self._settle),
            record.refused,
        )

    @property
    def known(self) -> tuple[int, ...]:
        """Devices that something is known of."""
        return tuple(self._devices)

    def copy(self, device: int, state: DeviceState) -> None:
        """Take over the state of a device from the program that owns the line."""
        record = self[device]
        record.answers, record.failures = state.answers, state.failures
        record.silent_since, record.next_try = state.silent_since, state.next_try
        record.turnaround, record.reported_usual = state.turnaround, state.usual_turnaround
        record.heard, record.repeated = state.heard, state.heard or 0.0
        record.refused, record.lateness = state.refused, state.lateness
        record.settle = state.copies_within
        if 0.0 < state.copies_within < SHORT_WAIT:
            self._settle = max(self._settle, state.copies_within)
            self._repeated = max(self._repeated, record.repeated)

    def last_reply_by(self, now: float) -> float:
        """When the last reply that is due may have come, of those who ever answered; else now."""
        there = (record.outstanding for record in self._devices.values() if record.ever_answered)
        return max((now, *(outstanding.expires for due in there for outstanding in due)))

    def time_out(
        self, device: int, function: int, priority: Priority, within: float | None = None
    ) -> float:
        """Seconds to wait for a reply, from the end of the request to the reply's start.

        No longer than the longest ever waited, also where the asker says `within`.
        """
        timing, record = self._timing, self[device]
        if within is not None and within >= 0.0:
            return min(within, timing.first_timeout)
        if priority >= Priority.BACKGROUND and not record.ever_answered:
            wait = timing.patient_timeout if priority is Priority.PATIENT else timing.scan_timeout
            return min(wait, timing.first_timeout)
        recent = record.recent.get(function)
        if not recent:
            return timing.first_timeout
        known = max(timing.min_timeout, MARGIN * max(recent))
        # not while a poll is repeated at once: others wait for the line
        doubled = min(max(0, record.failures - MISSES + 1), 8)
        return min(timing.first_timeout, known * 2.0**doubled)

    def backed_off(
        self, device: int, priority: Priority, now: float, within: float | None = None
    ) -> float | None:
        """Seconds until a silent device is polled again; None now, or to look `within` a time."""
        record = self[device]
        on_request = within is not None or priority < Priority.POLL
        if on_request or record.next_try is None or now >= record.next_try:
            return None
        if priority >= Priority.BACKGROUND and not record.ever_answered:
            return None
        return record.next_try - now

    def not_before(
        self,
        device: int,
        expectation: Expectation | None,
        priority: Priority,
        now: float,
        repeated: tuple[bytes, float | None] = (b"", None),
    ) -> float:
        """When a request may go out at the earliest.

        Held back while an earlier request's reply could be taken for its own, and while the
        line is left quiet for a late reply. A stop is never held back, nor is a read that keeps
        a drive from tripping: replies that may come first are skipped instead. A repeat is not
        held back for its own earlier tries: `repeated` is the request and the time of its first.
        """
        if priority <= Priority.FEED:
            return 0.0
        there = self._still_outstanding(device, now)
        same = (late for late in there if late.expectation == expectation)
        expires = [late.expires for late in same if not late.is_reply_to(*repeated)]
        return max([self.quiet_until, *expires])

    def doubts(
        self,
        device: int,
        expectation: Expectation,
        now: float,
        repeated: tuple[bytes, float | None] = (b"", None),
    ) -> tuple[bool, int]:
        """Return whether a refusal would surely be that of the next request, and how many
        fitting replies may come first. One to an earlier try of a repeat is as good as its own."""
        late = [
            each for each in self._still_outstanding(device, now) if not each.is_reply_to(*repeated)
        ]
        sure = all(each.expectation.function != expectation.function for each in late)
        # a reply that repeats all of its request is as good from the same request before;
        # that of function 15 or 16 says nothing of the values
        whole = expectation.length == len(expectation.prefix)
        whole = whole and expectation.function not in (WriteMany.function, WriteCoils.function)
        same = 0 if whole else sum(each.expectation == expectation for each in late)
        return sure, same

    def _still_outstanding(self, device: int, now: float) -> list[Outstanding]:
        record = self[device]
        due = [late for late in record.outstanding if late.expires > now]
        if len(due) != len(record.outstanding):
            record.missed += (
                late for late in record.outstanding if late.expires <= now and not late.copy
            )
        record.outstanding = due
        return due

    def is_repeat(self, device: int, pdu: bytes, reply: bytes, turnaround: float) -> bool:
        """Return True if a reply is more likely a copy of one before than that of this request.

        It is the same to the last bit, though other registers were asked for, and it came
        earlier or later than this device ever answers.
        """
        record = self[device]
        recent = record.recent.get(pdu[0], ())
        if not self._mistakable or pdu[0] not in SPACES or len(recent) < KNOWN:
            return False
        if not any(reply == replied and pdu != sent for sent, replied in record.exchanges):
            return False
        # the median: one late reply must not make every lateness usual
        early, late = UNUSUAL_EARLY * min(recent), UNUSUAL_LATE * median(recent) + JITTER
        return not early <= turnaround <= late

    def answered(
        self,
        device: int,
        expectation: Expectation,
        turnaround: float,
        now: float,
        exchanged: tuple[bytes, bytes] = (b"", b""),
        *,
        refused: bool = False,
    ) -> None:
        """Note a reply or a refusal; `exchanged` are the request and its reply."""
        record = self[device]
        record.answers = record.ever_answered = True
        record.heard = now
        record.refused = refused
        record.failures = 0
        record.silent_since = record.next_try = None
        note_turnaround(record, expectation.function, turnaround)
        record.last, record.last_time = expectation, now
        record.exchanges.append(exchanged)
        record.lateness *= FORGET
        settle = self._settle_of(record, now)
        if settle and self._mistakable:
            record.outstanding.append(Outstanding(expectation, now, now, now + settle, copy=True))

    def _settle_of(self, record: Device, now: float) -> float:
        """Return the seconds without a similar request after a reply, if replies came twice."""
        single = now - record.repeated
        if single > SHORT_MEMORY:
            record.settle = min(record.settle, SHORT_WAIT)
        if single > LONG_MEMORY:
            record.settle = 0.0
        if now - self._repeated > LONG_MEMORY:
            self._settle = 0.0
        return max(record.settle, self._settle)

    def silent(
        self, device: int, expectation: Expectation, sent: float, now: float, pdu: bytes = b""
    ) -> None:
        """Nothing came in time: await a late reply, and pause polling, of a known device after
        several misses in a row."""
        record = self[device]
        record.answers = False
        record.failures += 1
        if record.silent_since is None:
            record.silent_since = now
        self.may_come(device, expectation, sent, now, pdu)
        failures = record.failures
        if record.ever_answered and failures < MISSES:
            return
        pauses = self._timing.back_off_first, self._timing.back_off_longest
        rest = pause(failures, *pauses)
        if record.ever_answered and failures == MISSES:
            rest = pause(1, *pauses)
        elif record.ever_answered and failures == MISSES + 1:
            # a drive that is away now costs no more than with a pause after each miss
            rest = sum(pause(each, *pauses) for each in range(2, failures + 1))
        record.next_try = now + rest

    def may_come(
        self, device: int, expectation: Expectation, sent: float, now: float, pdu: bytes = b""
    ) -> None:
        """Note that the reply to a request of `sent` has not come, but may yet."""
        if not self._mistakable:
            return
        record = self[device]
        wait = min(LATE_MARGIN * record.lateness, LONGEST_WAIT)
        expires = max(sent + self._timing.late_reply, now + self._timing.first_timeout, now + wait)
        record.outstanding.append(Outstanding(expectation, sent, now, expires, pdu=pdu))
        if record.lateness:
            quiet = QUIET_SHARE * self._timing.first_timeout
            self.quiet_until = now + min(LATE_MARGIN * record.lateness, quiet)

    def stray(self, piece: Piece, now: float) -> StrayKind:
        """Determine the origin of a whole frame that was not the awaited one, if possible."""
        record = self._devices.get(piece.device)
        if record is None:
            return ""
        for late in record.outstanding:
            if late.copy and late.expires < now:
                continue
            refused = piece.pdu[0] == late.expectation.function | EXCEPTION
            if refused or late.expectation.fits(piece.pdu):
                record.outstanding.remove(late)
                if late.copy:
                    self._note_copy(record, now - late.sent, now)
                    return "copy"
                self._note_late(record, late, now)
                return "late"
        for late in record.missed:
            refused = piece.pdu[0] == late.expectation.function | EXCEPTION
            if now - late.expires < SHORT_MEMORY and (refused or late.expectation.fits(piece.pdu)):
                # of a drive that was frozen: it says nothing of how long replies usually take
                record.missed.remove(late)
                return "late"
        if record.last is not None and record.last.fits(piece.pdu):
            self._note_copy(record, now - record.last_time, now)
            again = Outstanding(record.last, record.last_time, now, now + record.settle, copy=True)
            record.outstanding.append(again)
            return "copy"
        return ""

    @staticmethod
    def _note_late(record: Device, late: Outstanding, now: float) -> None:
        record.lateness = max(record.lateness, now - late.due)
        record.answers = record.ever_answered = True
        # should it come once more, it is known
        record.last, record.last_time = late.expectation, now
        # the next timeout allows for it
        note_turnaround(record, late.expectation.function, now - late.sent)

    def _note_copy(self, record: Device, came: float, now: float) -> None:
        """A reply came once more, `came` seconds after it.

        From now on as long is waited before the same is asked again, and by a gap longer: adapters
        and busy computers hand one copy over later than the other.
        """
        after = max(LATE_MARGIN * came, came + self._timing.frame_gap)
        after = min(after, self._timing.late_reply)
        record.settle = max(record.settle, after)
        record.repeated = now
        if after <= SHORT_WAIT:
            # what repeats frames quickly stands in the line, not in one drive
            self._settle, self._repeated = max(self._settle, after), now


def pause(failures: int, first: float, longest: float) -> float:
    """Seconds to wait after so many failures in a row: `first`, doubled each time, capped."""
    if failures <= 0:
        return 0.0
    # the exponent is capped as well: a night of failures must not overflow
    return min(longest, first * float(2 ** min(failures - 1, 30)))
