"""Conversion of received bytes to exchanges with their values, counted by line and drive."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field

from tui.drive.profile.profile import Profile, group_holds
from tui.drive.profile.schema import Parameter
from tui.wire.observed.pairing import ObservedExchange, Pairing
from tui.wire.observed.splitting import FrameSplitter, ObservedFrame

from .families import AssumedProfile, Families
from .words import ObservedValue, WordSpan, spans_of, values_of

CUT_BY = 0.002
"""Seconds by which a pause inside a frame must exceed t3.5 to count: bytes are read late."""
TOO_SOON = 0.5
"""Share of t3.5 below which a pause between two frames counts as too short, for the same reason."""
DECIDING = frozenset(
    {
        "command_word",
        "command_word_2",
        "extended_command_word",
        "frequency_reference",
        "speed_reference",
        "command_frequency",
        "command_speed",
    }
)
"""Quantities that control the motor."""
NOBODY_WAITS_SO_SHORT = 0.01
"""Seconds within which no master abandons a reply and continues: another master sent the
request."""
READS_KEPT = 500
"""Number of different reads of one drive that are counted separately."""


@dataclass(slots=True)
class WriteTally:
    """Writes of one parameter."""

    parameter: Parameter | None
    commands: bool
    times: int = 0
    first: float = 0.0
    last: float = 0.0
    text: str = ""
    """The last value, with its unit."""
    raw: int = 0

    @property
    def every(self) -> float | None:
        """Average seconds from one write to the next; None for a single one."""
        return (self.last - self.first) / (self.times - 1) if self.times > 1 else None


@dataclass(slots=True)
class ReadTally:
    """One read, with its count."""

    span: WordSpan
    times: int = 0
    first: float = 0.0
    last: float = 0.0

    @property
    def every(self) -> float | None:
        """Average seconds from one read to the next; None for a single one."""
        return (self.last - self.first) / (self.times - 1) if self.times > 1 else None


@dataclass(slots=True)
class DriveTally:
    """Traffic of one drive; times are those of the listener's clock."""

    device: int
    first: float
    last: float = 0.0
    requests: int = 0
    answers: Counter[str] = field(default_factory=Counter)
    exceptions: Counter[int] = field(default_factory=Counter)
    reads: dict[WordSpan, ReadTally] = field(default_factory=dict)
    writes: dict[str, WriteTally] = field(default_factory=dict)
    raws: dict[str, int] = field(default_factory=dict)
    """Last raw value of each parameter by code."""
    turnaround_sum: float = 0.0
    turnaround_least: float = float("inf")
    turnaround_most: float = 0.0
    fed: float | None = None
    """Time of its last request with a reply, damaged or not, which restarts its timeout."""
    longest_pause: float = 0.0
    """Longest time between two such requests, in seconds."""
    longest_gap: float = 0.0
    """Longest time between two requests, answered or not, in seconds."""
    measured: int = 0
    """Number of replies with a known turnaround."""

    @property
    def commanded(self) -> bool:
        """True if commands or references were written to it."""
        return any(write.commands for write in self.writes.values())

    @property
    def answered(self) -> int:
        """Number of requests that the drive answered or refused."""
        return self.answers["ok"] + self.answers["exception"]

    @property
    def turnaround(self) -> float | None:
        """Mean seconds; None if no turnaround was measured."""
        return self.turnaround_sum / self.measured if self.measured else None

    def pause_until(self, now: float) -> float:
        """Return the longest time without an answered request, until now, in seconds."""
        return max(self.longest_pause, now - self.fed if self.fed is not None else 0.0)

    def gap_until(self, now: float) -> float:
        """Return the longest time without a request, until now, in seconds."""
        return max(self.longest_gap, now - self.last if self.requests else 0.0)

    def take(
        self, exchange: ObservedExchange, values: Sequence[ObservedValue], profile: Profile | None
    ) -> None:
        """Count an exchange of this drive with its values."""
        self.answers[exchange.answer] += 1
        if exchange.answer in ("again", "unasked"):
            return
        if self.requests:
            self.longest_gap = max(self.longest_gap, exchange.time - self.last)
        self.requests += 1
        self.last = exchange.time
        if exchange.exception is not None:
            self.exceptions[exchange.exception] += 1
        if exchange.turnaround is not None:
            self.measured += 1
            self.turnaround_sum += exchange.turnaround
            self.turnaround_least = min(self.turnaround_least, exchange.turnaround)
            self.turnaround_most = max(self.turnaround_most, exchange.turnaround)
        if _has_reached(exchange):
            if self.fed is not None:
                self.longest_pause = max(self.longest_pause, exchange.time - self.fed)
            self.fed = exchange.time
        self._take_reads(exchange)
        for value in values:
            self._take_value(value, exchange.time, profile, confirmed=not exchange.has_other_echo)

    def _take_reads(self, exchange: ObservedExchange) -> None:
        for span in spans_of(exchange.request):
            if span.written or (span not in self.reads and len(self.reads) >= READS_KEPT):
                continue
            read = self.reads.setdefault(span, ReadTally(span, first=exchange.time))
            read.times += 1
            read.last = exchange.time

    def _take_value(
        self, value: ObservedValue, time: float, profile: Profile | None, *, confirmed: bool
    ) -> None:
        if value.parameter is not None and confirmed:
            self.raws[value.code] = value.raw
        if not value.written:
            return
        if value.code not in self.writes:
            commands = decides(profile, value.parameter)
            self.writes[value.code] = WriteTally(value.parameter, commands, first=time)
        write = self.writes[value.code]
        write.times += 1
        write.last, write.text, write.raw = time, value.value.display, value.raw


def _has_reached(exchange: ObservedExchange) -> bool:
    """True if the drive replied; noise counts only if it begins as its reply."""
    replied = exchange.noise[:1] == bytes([exchange.device])
    return exchange.answer in ("ok", "exception") or (exchange.answer == "damaged" and replied)


def decides(profile: Profile | None, parameter: Parameter | None) -> bool:
    """Return True if a parameter controls the motor."""
    if profile is None or parameter is None:
        return False
    commands = {chart.command for chart in profile.data.charts if chart.command}
    return (
        parameter.code in commands
        or parameter.quantity in DECIDING
        or group_holds(profile, parameter) == "commands"
    )


@dataclass(slots=True)
class LineTally:
    """Traffic of the whole line."""

    begun: float
    frames: int = 0
    bytes: int = 0
    noises: int = 0
    noise_bytes: int = 0
    together: int = 0
    """Frames read together with the one before, so that the pause between them is unknown."""
    cut: int = 0
    """Frames with a pause inside that is longer than t3.5."""
    longest_cut: float = 0.0
    """Longest such pause in seconds."""
    hasty: int = 0
    """Frames that began before the t3.5 after another had passed."""
    exchanges: int = 0
    crossed: int = 0
    """Requests that began while another awaited its reply."""
    drives: dict[int, DriveTally] = field(default_factory=dict)

    def take_frame(self, frame: ObservedFrame, silence: float) -> None:
        """Count a frame, or noise; `silence` is the required pause between two frames in seconds,
        or 0."""
        self.bytes += len(frame.data)
        if not frame.whole:
            self.noises += 1
            self.noise_bytes += len(frame.data)
            return
        self.frames += 1
        if silence and frame.gap > silence + CUT_BY:
            self.cut += 1
            self.longest_cut = max(self.longest_cut, frame.gap)
        if frame.pause is None:
            self.together += self.frames > 1
        elif frame.pause < silence * TOO_SOON:
            self.hasty += 1

    def take_exchange(self, exchange: ObservedExchange) -> None:
        """Count an exchange."""
        self.exchanges += 1
        if exchange.waited is not None and exchange.waited < NOBODY_WAITS_SO_SHORT:
            self.crossed += 1

    def drive(self, device: int, time: float) -> DriveTally:
        """Return the traffic of a drive, from this time on if it is new."""
        return self.drives.setdefault(device, DriveTally(device, time))


SHORTEST_PAUSE = 0.05
"""Seconds without a byte that end a frame: an adapter may deliver the rest this much later."""
BESIDE_SILENCE = 0.02
LONG_FOR_AN_ANSWER = 0.5
"""Seconds after which a request that is still open at the end counts as unanswered."""

OnFrame = Callable[[ObservedFrame, bool | None], None]
"""Receives each frame; True for a request, False for a reply, None for bytes outside any frame."""


@dataclass(frozen=True, slots=True)
class DecodedExchange:
    """Exchange interpreted by its drive's family."""

    exchange: ObservedExchange
    family: AssumedProfile | None
    values: tuple[ObservedValue, ...]

    @property
    def profile(self) -> Profile | None:
        """The profile used for the interpretation."""
        return self.family.profile if self.family is not None else None


class LineListener:
    """Listens to the traffic on one line; `character` and `silence` are the line's, in seconds.

    Times are those of a monotonic clock. A `character` of 0 means that pauses cannot be measured.
    """

    def __init__(
        self,
        families: Families,
        begun: float,
        *,
        character: float = 0.0,
        silence: float = 0.0,
        on_frame: OnFrame = lambda _frame, _request: None,
    ) -> None:
        self.families = families
        self.tally = LineTally(begun)
        self.silence = silence
        self.character = character
        self.pause = max(SHORTEST_PAUSE, silence + BESIDE_SILENCE)
        """Seconds without a byte after which `idle` must be called."""
        self._heard = on_frame
        self._pairing = Pairing()
        self._splitter = FrameSplitter(character, self._pairing.is_due)

    def take(self, data: bytes, time: float) -> list[DecodedExchange]:
        """Process bytes read at a time; return the exchanges completed so far."""
        return self._report(self._splitter.take(data, time))

    def idle(self, now: float) -> list[DecodedExchange]:
        """Process a pause without bytes; return the exchanges that it completes or leaves
        unanswered."""
        found = self._report(self._splitter.pause())
        return found + [self._tell(exchange) for exchange in self._pairing.wait(now)]

    def end(self, now: float) -> list[DecodedExchange]:
        """End monitoring; a request that has waited long for its reply counts as unanswered."""
        found = self._report(self._splitter.pause())
        return found + [
            self._tell(exchange) for exchange in self._pairing.wait(now, LONG_FOR_AN_ANSWER)
        ]

    def _report(self, frames: Iterable[ObservedFrame]) -> list[DecodedExchange]:
        found = []
        for frame in frames:
            self.tally.take_frame(frame, self.silence if self.character else 0.0)
            exchanges, request = self._pairing.take(frame)
            self._heard(frame, request)
            found += [self._tell(exchange) for exchange in exchanges]
        return found

    def _tell(self, exchange: ObservedExchange) -> DecodedExchange:
        self.families.note(exchange)
        family = self.families.family(exchange.device)
        profile = family.profile if family is not None else None
        self.tally.take_exchange(exchange)
        drive = self.tally.drive(exchange.device, exchange.time)
        values = values_of(exchange, profile, drive.raws)
        drive.take(exchange, values, profile)
        return DecodedExchange(exchange, family, tuple(values))
