"""Flow control: when the next frame may be sent to the terminal, and how much of it.

The queue of a pseudo-terminal does not show what sshd and the network hold. So each frame is
followed by a cursor request (`ASK`). The terminal answers after it has drawn the frame, and the
next frame waits for that. The caller passes all times, in seconds of one clock.
"""

from __future__ import annotations

from collections import deque
from typing import Final

ASK: Final = "\x1b[6n"
"""Requests the cursor position; every terminal since the VT100 answers."""

MUTE_AFTER: Final = 2.0
"""Seconds that a frame waits for the answer of a terminal that has never answered."""

LOST_AFTER: Final = 10.0
"""Seconds after which an answer counts as lost, if earlier ones came."""

PIECE_LEAST: Final = 300
"""Bytes that a piece of a frame may always have. SSH delivers a piece once it is complete."""

AHEAD: Final = 450
"""Bytes that may be on the way when urgent output follows."""

AHEAD_OF_REST: Final = 900
"""The same for the rest of a frame: so a link with a long delay stays busy."""

WHOLE: Final = 1 << 20
"""More bytes than any frame has."""

PIECE_TIME: Final = 0.3
"""Seconds that the link may take for one piece of a frame, above its shortest round trip."""

GROWTH: Final = 4
"""Factor by which the piece grows after a fast one."""

OWED_MOST: Final = 32
"""Unanswered requests that are remembered at most."""


class Pacing:
    """Counts the frames that a terminal has not answered yet; the answers measure the link.

    With `slow` the link counts as slow until its rate has been measured.
    """

    def __init__(self, *, slow: bool = False) -> None:
        self._requested: deque[tuple[float, int]] = deque(maxlen=OWED_MOST)
        self._answers = False
        self._quickest = float("inf")
        self._piece = PIECE_LEAST if slow else WHOLE

    def sent(self, size: int, now: float) -> None:
        """Note that `size` bytes were sent, followed by a cursor request."""
        self._requested.append((now, size))

    def answered(self, now: float) -> None:
        """Note an answer: the oldest frame on the way has been drawn."""
        self._answers = True
        if not self._requested:
            return  # it had counted as lost
        since, size = self._requested.popleft()
        self._quickest = min(self._quickest, now - since)
        self._learn(size, now - since - self._quickest)

    def _learn(self, size: int, took: float) -> None:
        """Adapt the size of a piece to the time that the last one took."""
        if took > 2 * PIECE_TIME:
            self._piece = max(PIECE_LEAST, int(size * PIECE_TIME / took))
        elif took < PIECE_TIME / 4 and size > self._piece / 2:
            self._piece = min(WHOLE, GROWTH * self._piece)

    def room(self, now: float, *, hurry: bool = False, rest: bool = False) -> int:
        """Bytes that may be sent now; 0 while the last frame is on the way.

        Urgent output (after a key, a stop, a fault) and the `rest` of a frame may be sent sooner,
        while only a small piece is on the way.
        """
        on_its_way, mute = self._on_its_way(now), self._is_mute(now)
        ahead = AHEAD_OF_REST if rest else AHEAD if hurry else 0
        if on_its_way and sum(on_its_way) > ahead and not (mute and (hurry or rest)):
            return 0
        return WHOLE if mute else self._piece

    def wait(self, now: float) -> float | None:
        """Seconds until the awaited answer counts as lost; None if none is awaited."""
        if not self._on_its_way(now):
            return None
        return max(0.0, self._requested[-1][0] + self._patience - now)

    def forget(self) -> None:
        """Expect no more answers, because the app was suspended."""
        self._requested.clear()

    @property
    def _patience(self) -> float:
        return LOST_AFTER if self._answers else MUTE_AFTER

    def _is_mute(self, now: float) -> bool:
        """Return True if the terminal never answered, although it had the time."""
        return (
            not self._answers
            and bool(self._requested)
            and now >= self._requested[0][0] + MUTE_AFTER
        )

    def _on_its_way(self, now: float) -> list[int]:
        """The sizes of the frames whose answers are awaited; an empty one counts as a byte."""
        if self._answers:
            while self._requested and now >= self._requested[0][0] + self._patience:
                self._requested.popleft()
        return [max(1, size) for at, size in self._requested if now < at + self._patience]
