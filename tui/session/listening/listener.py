"""Conversion of received bytes to counted exchanges with their values."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

from tui.drive.profile.profile import Profile
from tui.wire.observed.pairing import ObservedExchange, Pairing
from tui.wire.observed.splitting import FrameSplitter, ObservedFrame

from .families import AssumedProfile, Families
from .tally import LineTally
from .words import ObservedValue, values_of

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
