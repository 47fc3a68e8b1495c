"""Notes for the next program on a line: kept for some time, within bounds, sent on request."""

from __future__ import annotations

from tests.line_events import on_event
from tui.bus.line_events import NoteReceived
from tui.bus.notes import MOST_NOTE, MOST_NOTES, NOTE_COSTS, NOTES_KEPT, LineNote, Notes

from .conftest import Share
from .peer import PtyPeer, eventually, honest


class Bench:
    """Notes of a holder, with a clock that is moved on."""

    def __init__(self) -> None:
        self.now = 1000.0
        self.notes = Notes(lambda _: None, lambda: self.now)


def test_note_is_kept_for_ten_minutes() -> None:
    bench = Bench()
    bench.notes.keep(LineNote(1, "a", b"old"))
    bench.now += NOTES_KEPT - 1
    bench.notes.keep(LineNote(1, "a", b"new"))
    assert [note.data for note in bench.notes.of(1, "a")] == [b"old", b"new"]
    bench.now += 2
    assert [note.data for note in bench.notes.of(1, "a")] == [b"new"]
    assert NOTES_KEPT == 600


def test_same_note_is_kept_once() -> None:
    bench = Bench()
    for _ in range(3):
        bench.notes.keep(LineNote(1, "a", b"same"))
    assert len(bench.notes.all) == 1


def test_expired_note_is_not_kept_again() -> None:
    bench = Bench()
    bench.notes.keep(LineNote(1, "a", b"old"))
    bench.now += NOTES_KEPT + 1
    bench.notes.keep(LineNote(1, "a", b"old"))
    assert bench.notes.all == ()
    bench.notes.keep(LineNote(1, "a", b"old"))
    assert len(bench.notes.all) == 1


def test_oldest_notes_are_dropped_for_new_ones() -> None:
    bench = Bench()
    for number in range(2 * MOST_NOTES // MOST_NOTE):
        bench.notes.keep(LineNote(1, "a", number.to_bytes(4, "big") * (MOST_NOTE // 4)))
    kept = bench.notes.all
    assert sum(len(note.data) for note in kept) <= MOST_NOTES
    assert len(kept) > 100
    assert kept[-1].data.startswith((2 * MOST_NOTES // MOST_NOTE - 1).to_bytes(4, "big"))


def test_notes_are_kept_up_to_their_total_size_with_what_each_costs() -> None:
    bench = Bench()
    count = MOST_NOTES // (MOST_NOTE + NOTE_COSTS)
    assert count * (MOST_NOTE + NOTE_COSTS) < MOST_NOTES < (count + 1) * (MOST_NOTE + NOTE_COSTS)
    rest = MOST_NOTES - count * (MOST_NOTE + NOTE_COSTS) - NOTE_COSTS
    notes = [LineNote(1, f"{number}", bytes(MOST_NOTE)) for number in range(count)]
    for note in (*notes, LineNote(1, "rest", bytes(rest))):
        bench.notes.keep(note)
    assert len(bench.notes.all) == count + 1, "they fill it to the last byte"
    bench.notes.keep(LineNote(2, "one more"))
    assert bench.notes.all[0] == notes[1]
    assert len(bench.notes.all) == count + 1
    bench.notes.keep(LineNote(2, "and one more"))
    assert bench.notes.all[0] == notes[1], "the oldest one left room for several"


async def test_program_gets_notes_of_a_program_that_has_closed(share: Share) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        lines.open("panel")
        first = lines.open("watch")
        await first.read(1, 100)
        for data in (b"one", b"two"):
            first.facts.notes.leave(LineNote(1, "trend", data))
        first.facts.notes.leave(LineNote(2, "trend", b"other"))
        first.close()
        heard: list[bytes] = []
        following = lines.open("watch")
        await following.read(1, 100)
        on_event(following.facts, NoteReceived, lambda event: heard.append(event.note.data))
        following.facts.notes.ask(1, "trend")
        eventually(lambda: heard == [b"one", b"two"])


async def test_next_holder_has_the_notes_of_remaining_programs(
    share: Share,
) -> None:
    with PtyPeer(honest) as peer:
        lines = share(peer.path)
        owner, stays = lines.open("panel"), lines.open("watch")
        await owner.read(1, 100)
        await stays.read(1, 100)
        stays.facts.notes.leave(LineNote(1, "trend", b"kept"))
        owner.close()
        await stays.read(1, 100)
        third = lines.open("backup")
        await third.read(1, 100)
        heard: list[bytes] = []
        on_event(third.facts, NoteReceived, lambda event: heard.append(event.note.data))
        third.facts.notes.ask(1, "trend")
        eventually(lambda: heard == [b"kept"])
