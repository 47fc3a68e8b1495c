"""The shared knowledge of the programs on a line, step by step, as text.

`whole_state.txt` has a section for each part of that state. Each line is one step, followed by all
that is known then, and by the messages and events that the step caused.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest

from tests.recorded import sections
from tui.bus.keep_alive import KeepAlive, KeepAlives
from tui.bus.leases import WriteLease, WriteLeases
from tui.bus.line_events import DevicesStopped
from tui.bus.notes import LineNote, Notes
from tui.bus.program import KEEPER, Program
from tui.bus.program_use import ProgramUse, use_by_program
from tui.bus.share.messages import Facts
from tui.bus.shared_state import LinePublisher, SharedState
from tui.bus.stop_counts import StopCounts, is_newer, next_count
from tui.bus.tally import MinuteWindow, Tally
from tui.bus.trace import Trace

TEXTS = Path(__file__).parent / "whole_state.txt"
ME, OTHER, THIRD = Program("me", "panel", 1), Program("b", "run", 2), Program("c", "watch", 3)
HOLDER = Program("k", KEEPER, 4)
TIMED = ("leases", "stop_counts", "keep_alive")
"""Modules of tui.bus whose time the scenarios set."""


class Clock:
    """Time that passes only if a scenario says so."""

    def __init__(self) -> None:
        self.now = 1000.0

    def monotonic(self) -> float:
        return self.now


@contextmanager
def set_time() -> Iterator[Clock]:
    """Give the modules of a line a time that the scenario sets."""
    clock = Clock()
    with ExitStack() as stack:
        for name in TIMED:
            stack.enter_context(patch(f"tui.bus.{name}.time", clock))
        stack.enter_context(patch("tui.bus.trace.monotonic", clock.monotonic))
        yield clock


def brief(text: object) -> str:
    """A text with long repetitions of a character counted."""
    return re.sub(r"(.)\1{20,}", lambda found: f"{found[1]}*{len(found[0])}", str(text))


def plain(found: Any) -> Any:
    """Mappings as dictionaries, so that they are compared by their content."""
    return dict(found) if hasattr(found, "items") else found


def counted(counts: StopCounts) -> str:
    """All that is known of stops."""
    known = (counts.totals, counts.plain, counts.by, counts.times, counts.late_times)
    return " ".join(str(plain(each)) for each in known)


def stops() -> Iterator[str]:
    with set_time() as clock:
        counts = StopCounts()
        yield f"{counted(counts)} {counts.stamp(0)} {counts.of('me', (1, 2))}"
        most = (1 << 32) - 1
        steps: tuple[tuple[str, Callable[[], object]], ...] = (
            ("give", lambda: counts.give("me", (1, 2), "space")),
            ("give again", lambda: counts.give("me", (2,), "s")),
            ("note", lambda: counts.note("b", (1, 3), (4, 1), "stop", 990.0)),
            ("note the same", lambda: counts.note("b", (1, 3), (4, 1), "again", 999.0)),
            ("note an older count", lambda: counts.note("b", (1,), (2,), "old")),
            ("note without a time", lambda: counts.note("b", (3,), (2,), "now")),
            ("learn", lambda: counts.learn({2: {"me": 1, "c": 7}, 4: {"c": 1}})),
            ("learn times", lambda: counts.learn_times({1: 995.0, 4: 400.0, 5: 2000.0, 3: 1.0})),
            ("wrap", lambda: counts.learn({4: {"c": most}})),
            ("half", lambda: counts.learn({6: {"d": 1 << 31}, 7: {"d": (1 << 31) - 1}})),
            ("greet", lambda: counts.learn_greeting("c", {2: {"c": 3, "b": 9}, 8: {"x": 1}}, "b")),
            ("greet with less", lambda: counts.learn_greeting("b", {1: {"b": 1}}, ("b", "me"))),
            ("fold", lambda: counts.fold({"c", "d"})),
            ("replace", lambda: counts.replace({1: {"b": 9}, 2: {"me": 1}, 9: {"z": 2}}, "me")),
        )
        for name, step in steps:
            clock.now += 1.0
            yield f"{name}: {step()!r} {counted(counts)}"
            yield f"  {[counts.stamp(device) for device in range(10)]} {counts.of('b', (1, 9))}"
        for number in range(2, 300):
            counts.learn({1: {f"p{number}": 1}})
        yield f"{counts.learn_greeting('p3', {1: {'p3': 2}}, ('p4', 'me'))} {counted(counts)}"
        clock.now += 1e5
        yield f"{counts.late_times}"
    for count, than in ((1, 0), (0, 0), (0, 1), (0, most), (most, 0), (1 << 31, 0)):
        yield f"{count} after {than}: {is_newer(count, than)} {next_count(count)}"


def leases() -> Iterator[str]:
    with set_time() as clock:
        counts, sent = StopCounts(), list[object]()
        of = WriteLeases("me", counts, sent.append)
        seen: list[list[str]] = []

        def known() -> str:
            text = f"{of.of('me')} {of.of('b')} {sent}"
            refused = [of.refusal(program, device) for program in "ab" for device in (1, 2)]
            refused += [of.refusal("me", device) for device in (0, 1, 2, 3)]
            sent.clear()
            seen.append(refused)
            shown = "" if seen[-2:-1] == seen[-1:] else refused
            return f"{text} {shown} {[lease.has_ended for lease in of.of('me').values()]}"

        steps: tuple[tuple[str, Callable[[], object]], ...] = (
            ("arm", lambda: of.arm(1, 60.0, b"care")),
            ("arm without end", lambda: of.arm(2, None, b"more")),
            ("without care", lambda: of.arm(3, 5.0, b"")),
            ("stay", lambda: of.stay_armed(1, 60.5)),
            ("stay a moment later", lambda: of.stay_armed(1, 60.6)),
            ("stay without end", lambda: of.stay_armed(1, None)),
            ("stay where there is none", lambda: of.stay_armed(9, 60.0)),
            ("stay what is endless", lambda: of.stay_armed(2, 60.0)),
            ("disarm", lambda: of.disarm(1)),
            ("disarm again", lambda: of.disarm(1)),
            ("stay what has ended", lambda: of.stay_armed(1, 600.0)),
            ("grant", lambda: of.grant("b", 1, WriteLease(0, 1100.0, b"its"))),
            ("grant without care", lambda: of.grant("b", 1, WriteLease(1, None))),
            ("grant another", lambda: of.grant("b", 2, WriteLease(0, 1010.5))),
            ("stop", lambda: counts.give("b", (1, 2), "space")),
            ("arm after a stop", lambda: of.arm(1, 7.0, b"new")),
            ("arm with too much care", lambda: of.arm(2, 7.0, bytes((1 << 20) + 1))),
            ("most care", lambda: len(of.grant("b", 3, WriteLease(0, None, bytes(9))).care)),
            ("forget one that lasts", lambda: of.forget_ended((1, 2, 9))),
            ("end it", lambda: of.disarm(1)),
            ("forget it", lambda: of.forget_ended((1, 2))),
            ("end one", lambda: of.end("b", 1)),
            ("end all", lambda: of.end("b")),
        )
        for name, step in steps:
            clock.now += 0.5
            yield f"{name}: {step()!r} {known()}"
        of.arm(5, 2.0, b"late")
        for seconds in (2.0, 1.0, 10.0):
            clock.now += seconds
            yield f"{seconds}: {of.refusal('me', 5)!r}"


def kept_alive() -> Iterator[str]:
    with set_time() as clock:
        sent: list[object] = []
        of = KeepAlives("me", sent.append)
        of.changed = lambda: sent.append("changed")
        wanted = KeepAlive(3, 2.0, 3201, 2)
        steps: tuple[tuple[str, Callable[[], object]], ...] = (
            ("keep", lambda: of.keep(wanted)),
            ("keep the same", lambda: of.keep(wanted)),
            ("keep for a time", lambda: of.keep(wanted, 5.0)),
            ("too short", lambda: of.keep(KeepAlive(4, 0.001, 1, 1, 43))),
            ("too long", lambda: of.keep(KeepAlive(5, 1e9, 1, 1, 1), 1.0)),
            ("hear", lambda: of.hear("b", KeepAlive(3, 1.0, function=4))),
            ("let go", lambda: of.let_go(3)),
            ("let go again", lambda: of.let_go(3)),
            ("end", lambda: of.end("me")),
        )
        for name, step in steps:
            clock.now += 0.5
            step()
            yield f"{name}: {plain(of.kept)} {sent} {of.of('me')} {of.of('b')}"
            yield f"  {[each.request for each in of.kept.values()]}"
            sent.clear()


def notes() -> Iterator[str]:
    clock, sent = Clock(), list[object]()
    of = Notes(lambda note: sent.append(("tell", note)), clock.monotonic)
    of.heard = lambda note: sent.append(("heard", note))
    first, two, big = LineNote(1, "a", b"1"), LineNote(2, "a", b"2"), 1 << 14
    steps: tuple[tuple[str, Callable[[], object]], ...] = (
        ("leave", lambda: of.leave(first)),
        ("keep", lambda: of.keep(two)),
        ("keep again", lambda: of.keep(two)),
        ("ask", lambda: of.ask(1, "a")),
        ("old", lambda: setattr(clock, "now", clock.now + 600.0)),
        ("older", lambda: setattr(clock, "now", clock.now + 0.1)),
        ("new", lambda: of.keep(first)),
        ("kind", lambda: of.keep(LineNote(1, "b"))),
    )
    for name, step in steps:
        step()
        yield f"{name}: {of.all} {of.of(1, 'a')} {sent}"
        sent.clear()
    for number in range(130):
        of.keep(LineNote(7, f"{number}", bytes(big)))
    yield f"{len(of.all)} {of.all[0].kind} {of.all[-1].kind}"


class Watched:
    """The state of a line, with what it sends and reports."""

    def __init__(self, me: Program | None = ME) -> None:
        self.heard: list[object] = []
        self.state = SharedState(me)
        self.state.voice = LinePublisher(lambda message: self.heard.append(("sent", message)))
        self.state.events.subscribe(self.heard.append)

    def step(self, name: str, done: Callable[[SharedState], object]) -> Iterator[str]:
        """Do one step; return all that is known afterwards, and what was heard."""
        state, found = self.state, done(self.state)
        yield f"{name}: {found!r}"
        yield f"  {[each.id for each in state.programs]} {[each.id for each in state.others]}"
        yield f"  {[each.id for each in state.departed]} {plain(state.commanders)}"
        yield f"  {brief(plain(state.paused))} {brief(counted(state.stops))}"
        yield from (f"  {brief(each)}" for each in self.heard)
        self.heard.clear()


def facts(*programs: Program, **more: Any) -> Facts:
    """A message of the holder of a line."""
    return Facts(programs, **{"commanders": {}, "stops": {}, "paused": {}, **more})


def shared() -> Iterator[str]:
    with set_time() as clock:
        of = Watched()
        reported = facts(
            HOLDER, ME, OTHER, THIRD, commanders={2: "b", 3: "me", 4: "c"}, stops={2: {"b": 3}},
            paused={5: ("c", "test"), 6: ("me", "mine")}, stopped={2: 990.0},
            departed=(Program("d", "scan", 8), OTHER),
        )  # fmt: skip
        many = tuple(Program(f"m{number}", "run", number) for number in range(20))
        steps: tuple[tuple[str, Callable[[SharedState], object]], ...] = (
            ("claim", lambda state: state.claim(1)),
            ("claim again", lambda state: state.claim(1)),
            ("pause", lambda state: state.pause_polling(6, "w" * 510)),
            ("learn", lambda state: state.learn(reported)),
            ("claim what another has", lambda state: state.claim(2)),
            ("commander", lambda state: [state.commander(device) for device in range(5)]),
            ("program", lambda state: (state.program("c"), state.program("x"))),
            ("stop", lambda state: state.give_stop(iter((5, 1)), "s" * 4100)),
            ("stop nothing", lambda state: state.give_stop((), "space")),
            (
                "a stop of another",
                lambda state: state.events.emit(DevicesStopped((6,), "s", OTHER)),
            ),
            ("resume", lambda state: state.resume_polling(6)),
            ("tell", lambda state: state.tell_all(3, "t" * 4100)),
            ("ask", lambda state: state.ask_for(2)),
            ("refuse", lambda state: state.answer(1, "b", yes=False, why="w" * 4100)),
            ("grant", lambda state: state.answer(1, "b", yes=True)),
            ("release another's", lambda state: state.release(2)),
            ("granted", lambda state: state.hear_reply(2, "yes", yes=True)),
            ("not granted", lambda state: state.hear_reply(4, "no", yes=False)),
            ("commanded by nobody", lambda state: state.note_commander(9, None)),
            ("lease", lambda state: state.leases.grant("c", 4, WriteLease(0, None, b"x"))),
            ("alive", lambda state: state.keep_alives.hear("c", KeepAlive(4, 1.0))),
            ("gone", lambda state: state.hear_gone(THIRD)),
            ("its leases", lambda state: (state.leases.of("c"), state.keep_alives.of("c"))),
            ("many", lambda state: state.set_programs((ME, *many))),
            ("none", lambda state: state.set_programs((ME,))),
            ("back", lambda state: state.set_programs((ME, many[7]))),
        )
        for name, step in steps:
            clock.now += 1.0
            yield from of.step(name, step)
        yield f"{SharedState().me.name} {SharedState().me.id} {SharedState().accepts_care(1, b'')}"


def permitted() -> Iterator[str]:
    with set_time():
        state = SharedState(ME)
        state.set_programs((ME, OTHER))
        state.note_commander(2, "b")
        state.note_commander(3, "gone")
        state.leases.grant("me", 1, WriteLease(0, None, b"x"))
        for gated, writes in ((False, True), (True, True), (True, False)):
            state.gated = gated
            for program in ("me", "b"):
                found = [state.refusal(program, device, 0, writes=writes) for device in range(4)]
                yield f"{gated} {writes} {program}: {found}"
        state.stops.give("b", (1,), "the key")
        yield f"{[state.refusal('me', device, 0) for device in (0, 1, 2)]}"
        yield f"{[state.refusal('b', device, 1) for device in (0, 1, 2)]}"


def filled(counts: Any) -> str:
    """The counts that are not 0."""
    if not dataclasses.is_dataclass(counts):
        return str(counts)
    names = [field.name for field in dataclasses.fields(counts)]
    known = {name: getattr(counts, name) for name in names}
    devices = known.pop("devices", {})
    own = [f"{name}={filled(each)}" for name, each in known.items() if each]
    return " ".join([*own, *(f"({device}: {filled(each)})" for device, each in devices.items())])


def tallies() -> Iterator[str]:
    clock = Clock()
    of = Tally(clock=clock.monotonic)
    steps: tuple[tuple[str, Callable[[], object]], ...] = (
        ("sent", lambda: of.count_sent(1, 8)),
        ("end", lambda: of.count_end(1, 0.5, 20)),
        ("reply", lambda: of.count_reply(1, 0.005)),
        ("late reply", lambda: of.count_reply(1, 3.0)),
        ("exception", lambda: of.count_exception(2, 6)),
        ("exception again", lambda: of.count_exception(2, 6)),
        ("checksum", lambda: of.count_checksum(1)),
        ("wrong", lambda: of.count_wrong(1)),
        ("repeat", lambda: of.count_repeat(2)),
        ("searched", lambda: of.count_silence(9, searched=True)),
        ("silent", lambda: of.count_silence(1, searched=False)),
        ("silent again", lambda: of.count_silence(1, searched=False)),
        ("good", lambda: of.count_good(1, was_heard=True)),
        ("silent once more", lambda: of.count_silence(1, searched=False)),
        ("good after long", lambda: of.count_good(1, was_heard=False)),
        ("foreign", lambda: of.count_minute(None, "foreign")),
        ("damaged", lambda: of.count_minute(2, "damaged")),
    )
    for name, step in steps:
        clock.now += 2.0
        step()
        yield f"{name}: {filled(of.frozen())}"
    for seconds in (20.0, 8.0, 5.0, 20.0, 60.0):
        clock.now += seconds
        yield f"{filled(of.frozen().minute)}, {filled(of.frozen().devices[1].minute)}"
    copy, frozen = Tally(clock=clock.monotonic), of.frozen()
    copy.copy(frozen, {1: frozen.devices[1]})
    yield filled(copy.frozen())
    window = MinuteWindow()
    for now, number in ((100.0, 2), (104.9, 1), (105.0, -1), (90.0, 1), (160.0, 5)):
        window.count("good", now, number)
        yield f"{now}: {[window.total(at).good for at in (now, now + 54.9, now + 60, 99.0)]}"


def uses() -> Iterator[str]:
    clock = Clock()
    of = ProgramUse(clock.monotonic)

    def shares() -> list[tuple[str, float]]:
        return [(program, round(share, 6)) for program, share in of.shares.items()]

    for program, seconds, later in (("a", 1.0, 0.0), ("b", 0.5, 5.0), ("", 9.0, 0.0),
                                    ("a", 1.0, 5.0), ("c", 0.02, 0.0), ("c", 0.019, 30.0),
                                    ("b", 50.0, -5.0)):  # fmt: skip
        clock.now += later
        of.count(program, seconds)
        yield f"{program} {seconds}: {shares()}"
    for number in range(70):
        of.count(f"p{number}", 0.1 + number / 100)
    yield f"{len(shares())} {shares()[:2]} {shares()[-1]}"
    these = (HOLDER, THIRD, Program("a", "x", 3), ME)
    yield f"{[(item.id, share) for item, share in use_by_program(these, {'me': 0.5, 'k': 1})]}"


def traced() -> Iterator[str]:
    with set_time() as clock:
        of = Trace(2)
        yield f"{of.looked_at}"
        for number in range(3):
            of.add(float(number), "out" if number % 2 else "in", bytes(4000 + number * 100), "note")
        kept = [(each.time, each.direction, len(each.data), each.note) for each in of.frames()]
        yield f"{kept} {of.count} {of.looked_at}"
        for later in (4.9, 0.2):
            clock.now += later
            yield f"{of.looked_at}"


SECTIONS = (
    stops, leases, kept_alive, notes, shared, permitted, tallies, uses, traced,
)  # fmt: skip


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_state_of_a_line_is_the_recorded_one_after_each_step(
    section: Callable[[], Iterable[str]],
) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
