"""Listening at work: bytes in, exchanges with their values out, and all of it counted."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from tui.drive.profile.profile import Profile
from tui.wire.heard.pairing import HeardExchange, Pairing
from tui.wire.heard.splitting import FrameSplitter, HeardFrame

from .families import AssumedProfile, Families
from .tally import LineTally
from .words import HeardValue, values_of

SHORTEST_PAUSE = 0.05
"""Seconds without a byte that end a frame: an adapter may hand over the rest so much later."""
BESIDE_SILENCE = 0.02
LONG_FOR_AN_ANSWER = 0.5
"""Seconds after which a request that is open at the end counts as not answered."""

FrameHeard = Callable[[HeardFrame, bool | None], None]
"""Takes each frame, with whether it is a request; None of bytes that form no frame."""


@dataclass(frozen=True, slots=True)
class ToldExchange:
    """An exchange in the words of its drive's family."""

    exchange: HeardExchange
    family: AssumedProfile | None
    values: tuple[HeardValue, ...]

    @property
    def profile(self) -> Profile | None:
        """The profile that explains it."""
        return self.family.profile if self.family is not None else None


class LineListener:
    """Reports the traffic on one line; `character` and `silence` are the line's, in seconds.

    Times are those of a monotonic clock. A character of 0 is that of a line whose pauses cannot be
    measured.
    """

    def __init__(
        self,
        families: Families,
        begun: float,
        *,
        character: float = 0.0,
        silence: float = 0.0,
        frame_heard: FrameHeard = lambda _frame, _request: None,
    ) -> None:
        self.families = families
        self.tally = LineTally(begun)
        self.silence = silence
        self.character = character
        self.pause = max(SHORTEST_PAUSE, silence + BESIDE_SILENCE)
        """Seconds without a byte after which `idle` is to be called."""
        self._heard = frame_heard
        self._pairing = Pairing()
        self._splitter = FrameSplitter(character, self._pairing.is_due)

    def take(self, data: bytes, time: float) -> list[ToldExchange]:
        """Bytes that were read at a time; the exchanges that are known by now."""
        return self._report(self._splitter.take(data, time))

    def idle(self, now: float) -> list[ToldExchange]:
        """No byte came for a pause: what ends with it, and what is not answered any more."""
        found = self._report(self._splitter.pause())
        return found + [self._tell(exchange) for exchange in self._pairing.wait(now)]

    def end(self, now: float) -> list[ToldExchange]:
        """Nothing more is heard: a request that waits for its answer since long has none."""
        found = self._report(self._splitter.pause())
        return found + [
            self._tell(exchange) for exchange in self._pairing.wait(now, LONG_FOR_AN_ANSWER)
        ]

    def _report(self, frames: Iterable[HeardFrame]) -> list[ToldExchange]:
        found = []
        for frame in frames:
            self.tally.take_frame(frame, self.silence if self.character else 0.0)
            exchanges, request = self._pairing.take(frame)
            self._heard(frame, request)
            found += [self._tell(exchange) for exchange in exchanges]
        return found

    def _tell(self, exchange: HeardExchange) -> ToldExchange:
        self.families.note(exchange)
        family = self.families.family(exchange.device)
        profile = family.profile if family is not None else None
        self.tally.take_exchange(exchange)
        drive = self.tally.drive(exchange.device, exchange.time)
        values = values_of(exchange, profile, drive.raws)
        drive.take(exchange, values, profile)
        return ToldExchange(exchange, family, tuple(values))
