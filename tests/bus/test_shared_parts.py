"""Parts of the shared state of a line: notes, keep-alive reads, use of the line."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from tui.bus import program_use
from tui.bus.keep_alive import LONGEST_TIMEOUT, SHORTEST_TIMEOUT, KeepAlive, KeepAlives
from tui.bus.notes import NOTES_KEPT, LineNote, Notes
from tui.bus.program import KEEPER, Program, pid_namespace
from tui.bus.program_use import LEAST_USE, USE_WINDOW, ProgramUse, use_by_program
from tui.bus.share.place import has_ended

NOW = 1024.0


def test_note_is_sent_to_the_others_and_heard_once() -> None:
    sent: list[LineNote] = []
    heard: list[LineNote] = []
    notes = Notes(sent.append, lambda: NOW)
    notes.heard = heard.append
    note = LineNote(1, "a", b"data")
    notes.leave(note)
    notes.leave(note)
    assert (notes.all, sent, heard) == ((note,), [note, note], [note])
    notes.ask(2, "b")
    assert sent[2:] == [LineNote(2, "b", b"")]
    assert notes.all == (note,)


def test_note_is_kept_for_its_time_and_no_longer() -> None:
    now = [NOW]
    notes = Notes(lambda _: None, lambda: now[0])
    first, second = LineNote(1, "a", b"1"), LineNote(1, "a", b"2")
    notes.keep(first)
    now[0] += NOTES_KEPT
    notes.keep(second)
    assert notes.all == (first, second)
    now[0] += 0.25
    notes.keep(second)
    assert list(notes._kept) == [second]


@pytest.fixture
def alive(monkeypatch: pytest.MonkeyPatch) -> tuple[KeepAlives, list[object]]:
    """The devices of the program `me`, with the messages and changes in their order."""
    monkeypatch.setattr("tui.bus.keep_alive.time.monotonic", lambda: NOW)
    done: list[object] = []
    made = KeepAlives("me", done.append)
    made.changed = lambda: done.append("changed")
    return made, done


def test_device_is_kept_alive_for_a_time_or_until_it_is_let_go(
    alive: tuple[KeepAlives, list[object]],
) -> None:
    made, done = alive
    other = KeepAlive(1, 2.0, 77)
    made.hear("other", other)
    made.keep(KeepAlive(1, 4.0, 77), seconds=8.0)
    mine = KeepAlive(1, 4.0, 77, until=NOW + 8)
    assert dict(made.kept) == {("other", 1): other, ("me", 1): mine}
    assert done == ["changed", "changed", mine]
    made.keep(KeepAlive(1, 4.0, 77), seconds=8.0)
    assert len(done) == 3, "nothing has changed"
    made.keep(KeepAlive(2, 4.0, 77))
    assert made.of("me") == [mine, KeepAlive(2, 4.0, 77)]
    made.let_go(1)
    made.let_go(1)
    assert done[-2:] == ["changed", KeepAlive(1, 4.0, 77, until=0.0)]
    assert list(made.kept) == [("other", 1), ("me", 2)]
    made.end("me")
    assert list(made.kept) == [("other", 1)]


@pytest.mark.parametrize(
    ("timeout", "kept"), [(0.001, SHORTEST_TIMEOUT), (1e9, LONGEST_TIMEOUT), (3.0, 3.0)]
)
def test_timeout_of_a_device_is_within_bounds(
    timeout: float, kept: float, alive: tuple[KeepAlives, list[object]]
) -> None:
    alive[0].keep(KeepAlive(1, timeout))
    assert alive[0].of("me")[0].timeout == kept


def test_use_of_a_line_fades_and_only_the_busiest_programs_are_counted(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(program_use, "MOST_PROGRAMS", 2)
    now = [NOW]
    use = ProgramUse(lambda: now[0])
    for program, seconds in (("z", 1.0), ("a", 3.0), ("m", 2.0), ("", 9.0)):
        use.count(program, seconds)
    assert use.shares == {"a": 0.3, "m": 0.2}
    use.count("m", 2.0)
    assert use.shares == {"a": 0.3, "m": 0.4}
    now[0] += USE_WINDOW
    assert use.shares == pytest.approx({"a": 0.3 / 2.718281828, "m": 0.4 / 2.718281828})
    use.count("a", 99.0)
    assert use.shares["a"] == 1.0
    now[0] -= 5.0
    assert use.shares["a"] == 1.0, "a clock that goes back adds no use"
    exact = ProgramUse(lambda: NOW)
    exact.count("a", LEAST_USE * USE_WINDOW)
    assert exact.shares == {"a": LEAST_USE}


def test_use_is_shown_by_program_without_the_keeper() -> None:
    programs = [Program("b", "panel", 2), Program("k", KEEPER, 1), Program("a", "run", 2)]
    found = use_by_program(programs, {"a": 0.5})
    assert [(program.id, share) for program, share in found] == [("a", 0.5), ("b", 0.0)]


@pytest.mark.parametrize(
    ("error", "ended"),
    [
        (None, False),
        (ProcessLookupError(), True),
        (PermissionError(), False),
        (OSError(), False),
        (OverflowError(), False),
    ],
)
def test_program_has_surely_ended_only_if_its_process_is_unknown(
    error: Exception | None, ended: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    checked: list[tuple[int, int]] = []

    def kill(pid: int, number: int) -> None:
        checked.append((pid, number))
        if error is not None:
            raise error

    monkeypatch.setattr("tui.bus.share.place.os.kill", kill)
    here = Program("a", "run", 4711, space=pid_namespace())
    assert has_ended(here) is ended
    assert checked == [(4711, 0)]
    assert not has_ended(replace(here, space="of a container"))
    assert checked == [(4711, 0)], "the number means another process here"
