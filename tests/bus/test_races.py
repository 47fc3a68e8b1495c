"""Two threads at the same time: a checked condition still holds when one acts on it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterable, Mapping

from tui.bus.shared_state import SharedState
from tui.bus.stop_counts import StopCounts

A_MOMENT = 0.2
"""Seconds in which another thread would be done, unless it waits for a lock."""


class Meeting:
    """Another thread that begins in the middle of this one's work."""

    def __init__(self, work: Callable[[], object]) -> None:
        self._thread = threading.Thread(target=work, daemon=True)
        self._begun = False

    def begin(self) -> None:
        """Begin once, and go on when it is done or waits."""
        if not self._begun:
            self._begun = True
            self._thread.start()
            self._thread.join(A_MOMENT)

    def end(self) -> None:
        """Wait until it is done."""
        assert self._begun
        self._thread.join(20.0)
        assert not self._thread.is_alive()


def test_two_simultaneous_stops_count_as_two() -> None:
    class Met(StopCounts):
        def of(self, program: str, devices: Iterable[int]) -> tuple[int, ...]:
            found = super().of(program, devices)
            if threading.current_thread() is threading.main_thread():
                meeting.begin()
            return found

    counts = Met()
    meeting = Meeting(lambda: counts.give("me", (1,), "a key"))
    counts.give("me", (1,), "another key")
    meeting.end()
    assert counts.of("me", (1,)) == (2,)


class MetState(SharedState):
    """Facts of a line; another program takes control once they are read by the main thread."""

    meeting: Meeting | None = None
    _commanders: Mapping[int, str] = {}

    @property
    def commanders(self) -> Mapping[int, str]:
        """By device, the program that commands it."""
        found = self._commanders
        if self.meeting and threading.current_thread() is threading.main_thread():
            self.meeting.begin()
        return found

    @commanders.setter
    def commanders(self, new: Mapping[int, str]) -> None:
        self._commanders = new


def test_control_taken_by_another_program_is_not_taken_back() -> None:
    facts = MetState()
    facts.meeting = Meeting(lambda: facts.note_commander(1, "other"))
    facts.claim(1)
    facts.meeting.end()
    assert facts._commanders == {1: "other"}


def test_control_taken_by_another_program_is_not_released() -> None:
    facts = MetState()
    facts.claim(1)
    facts.meeting = Meeting(lambda: facts.note_commander(1, "other"))
    facts.release(1)
    facts.meeting.end()
    assert facts._commanders == {1: "other"}
