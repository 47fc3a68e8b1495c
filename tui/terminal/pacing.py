"""When the next frame may go to the terminal, and how much of it: what is on its way is counted.

The queue of a pseudo-terminal does not show what sshd and the network hold. So the terminal is
asked for its cursor behind each frame (`ASK`); it answers once it has drawn what came before, and
the next frame waits for that. Times are seconds of one clock, given with each call; nothing here
looks at a clock.
"""

from __future__ import annotations

from collections import deque
from typing import Final

ASK: Final = "\x1b[6n"
"""Requests the place of the cursor; every terminal since the VT100 answers."""

MUTE_AFTER: Final = 2.0
"""Seconds that a frame waits for the answer of a terminal that has never answered."""

LOST_AFTER: Final = 10.0
"""Seconds after which an answer is taken for lost where others came."""

PIECE_LEAST: Final = 300
"""Bytes that a piece of a frame may always have. SSH shows a piece once all of it has come."""

AHEAD: Final = 450
"""Bytes that may be on their way when something that hurries follows them."""

AHEAD_OF_REST: Final = 900
"""The same for the rest of a frame that has begun: the link stays full on a long way, too."""

WHOLE: Final = 1 << 20
"""Bytes that no frame has."""

PIECE_TIME: Final = 0.3
"""Seconds that the link may take for one piece of a frame, above its shortest round trip."""

GROWTH: Final = 4
"""Growth of a piece after one that was sent fast."""

OWED_MOST: Final = 32
"""Questions that a terminal without answers is kept account of."""


class Pacing:
    """Counts the frames that a terminal has not answered yet; their answers measure the link.

    With `slow` the link is taken for slow until it has shown that it is not.
    """

    def __init__(self, *, slow: bool = False) -> None:
        self._requested: deque[tuple[float, int]] = deque(maxlen=OWED_MOST)
        self._answers = False
        self._quickest = float("inf")
        self._piece = PIECE_LEAST if slow else WHOLE

    def sent(self, size: int, now: float) -> None:
        """So many bytes went out, and the question behind them."""
        self._requested.append((now, size))

    def answered(self, now: float) -> None:
        """An answer came: the oldest frame on its way is drawn."""
        self._answers = True
        if not self._requested:
            return  # it was taken for lost
        since, size = self._requested.popleft()
        self._quickest = min(self._quickest, now - since)
        self._learn(size, now - since - self._quickest)

    def _learn(self, size: int, took: float) -> None:
        """Fit the size of a piece to the time that one took."""
        if took > 2 * PIECE_TIME:
            self._piece = max(PIECE_LEAST, int(size * PIECE_TIME / took))
        elif took < PIECE_TIME / 4 and size > self._piece / 2:
            self._piece = min(WHOLE, GROWTH * self._piece)

    def room(self, now: float, *, hurry: bool = False, rest: bool = False) -> int:
        """Bytes that may go out now; 0 while what went before is on its way.

        What hurries (what a key brings, a stop, a fault) and the `rest` of a frame that has begun
        follow a small piece at once.
        """
        on_its_way, mute = self._on_its_way(now), self._is_mute(now)
        ahead = AHEAD_OF_REST if rest else AHEAD if hurry else 0
        if on_its_way and sum(on_its_way) > ahead and not (mute and (hurry or rest)):
            return 0
        return WHOLE if mute else self._piece

    def wait(self, now: float) -> float | None:
        """Seconds until an answer that is waited for counts as lost; None where none is."""
        if not self._on_its_way(now):
            return None
        return max(0.0, self._requested[-1][0] + self._patience - now)

    def forget(self) -> None:
        """The terminal was left for a while: what it still owes does not come."""
        self._requested.clear()

    @property
    def _patience(self) -> float:
        return LOST_AFTER if self._answers else MUTE_AFTER

    def _is_mute(self, now: float) -> bool:
        """Return True if the terminal has had the time to answer, and never did."""
        return (
            not self._answers
            and bool(self._requested)
            and now >= self._requested[0][0] + MUTE_AFTER
        )

    def _on_its_way(self, now: float) -> list[int]:
        """The sizes of the frames that are still waited for; an empty one counts as a byte."""
        if self._answers:
            while self._requested and now >= self._requested[0][0] + self._patience:
                self._requested.popleft()
        return [max(1, size) for at, size in self._requested if now < at + self._patience]
