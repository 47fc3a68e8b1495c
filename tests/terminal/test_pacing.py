"""No frame is sent to a terminal that has not drawn the previous one; links are simulated here."""

from __future__ import annotations

from dataclasses import dataclass, field

import pytest

from tui.terminal.lean_app import AHEAD, LOST_AFTER, MUTE_AFTER, WHOLE, Pacing


@dataclass
class Link:
    """A link with a rate in bytes/s and a delay in s; the sender fills it by `Pacing`."""

    rate: float
    way: float
    pacing: Pacing
    free: float = 0.0
    answers: list[float] = field(default_factory=list)

    def send(self, size: int, now: float) -> None:
        self.free = max(self.free, now) + size / self.rate
        self.pacing.sent(size, now)
        self.answers.append(self.free + 2 * self.way)

    def until(self, now: float) -> None:
        while self.answers and self.answers[0] <= now:
            self.pacing.answered(self.answers.pop(0))


def drawn(link: Link, sizes: list[int]) -> float:
    """Draw frames one after the other, with as much room as there is; the time it takes."""
    now = 0.0
    link.send(0, now)
    for size in sizes:
        left, begun = size, True
        while left > 0:
            link.until(now)
            room = link.pacing.room(now, rest=begun)
            if room:
                link.send(min(room, left), now)
                left -= room
            else:
                now += 0.01
            begun = True
    return link.free + link.way


def test_frame_waits_for_the_acknowledgment_of_the_previous() -> None:
    pacing = Pacing()
    assert pacing.room(0.0) == WHOLE
    pacing.sent(100, 0.0)
    assert pacing.room(1.0) == 0
    pacing.answered(1.1)
    assert pacing.room(1.1) == WHOLE


def test_urgent_output_waits_for_small_pieces_only() -> None:
    pacing = Pacing()
    pacing.sent(AHEAD, 0.0)
    assert pacing.room(0.1, hurry=True)
    pacing.sent(1, 0.1)
    assert not pacing.room(0.2, hurry=True)


def test_silent_terminal_gets_rare_frames_and_immediate_urgent_output() -> None:
    pacing = Pacing(slow=True)
    pacing.sent(5000, 0.0)
    assert not pacing.room(MUTE_AFTER - 0.01)
    assert not pacing.room(MUTE_AFTER - 0.01, hurry=True)
    assert pacing.wait(0.5) == pytest.approx(MUTE_AFTER - 0.5)
    assert pacing.room(MUTE_AFTER) == WHOLE
    pacing.sent(5000, MUTE_AFTER)
    assert not pacing.room(MUTE_AFTER + 0.1)
    assert pacing.room(MUTE_AFTER + 0.1, hurry=True) == WHOLE


def test_lost_acknowledgment_does_not_block_forever() -> None:
    pacing = Pacing()
    pacing.sent(10, 0.0)
    pacing.answered(0.1)
    pacing.sent(10, 1.0)
    assert not pacing.room(1.0 + LOST_AFTER - 0.1)
    assert pacing.wait(1.0) == pytest.approx(LOST_AFTER)
    assert pacing.room(1.0 + LOST_AFTER)
    pacing.sent(10, 12.0)
    pacing.answered(12.1)
    assert pacing.room(12.1), "the next answer is that of the next frame"


def test_unrequested_acknowledgment_adds_no_room() -> None:
    pacing = Pacing()
    pacing.answered(0.0)
    assert pacing.room(0.0) == WHOLE


@pytest.mark.parametrize("rate", [1000.0, 2000.0, 5000.0])
def test_slow_link_has_at_most_one_second_in_flight(rate: float) -> None:
    """Once the link has shown its rate: the reply to a key finds little before its own."""
    link = Link(rate, 0.15, Pacing(slow=True))
    drawn(link, [4000])
    now = link.free + 1.0
    link.until(now)
    longest = 0.0
    for _ in range(400):
        link.until(now)
        if room := link.pacing.room(now, hurry=True):
            link.send(min(room, 4000), now)
        longest = max(longest, link.free - now)
        now += 0.02
    assert longest < 2 * AHEAD / rate + 0.31


@pytest.mark.parametrize(("rate", "way"), [(2000.0, 0.15), (2000.0, 0.3), (20000.0, 0.05)])
def test_full_screen_uses_nearly_the_whole_link(rate: float, way: float) -> None:
    link = Link(rate, way, Pacing(slow=True))
    took = drawn(link, [4000])
    assert took < (4000 / rate + 2 * way) * 1.5


def test_fast_link_gets_whole_frames() -> None:
    link = Link(1e6, 0.001, Pacing(slow=True))
    drawn(link, [5000] * 6)
    link.until(100.0)
    assert link.pacing.room(100.0) > 5000
