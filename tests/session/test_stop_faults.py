"""An internal error anywhere on the way of a stop: its frame is sent, or NOT STOPPED is said."""

from __future__ import annotations

import gc
import os
import threading
import time
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.bus.sharing import place_in
from tui.bus.errors import LineClosed
from tui.bus.line import Line
from tui.bus.link import RtuTcpLink
from tui.bus.program import Program
from tui.drive.profile import library
from tui.session.command.stop_report import Phase
from tui.session.drive import DriveSession
from tui.session.fleet import Fleet
from tui.session.journal import Journal
from tui.simulator import DriveSpec, Simulation
from tui.simulator.server.conversation import RtuConversation

from .planting import Passage, Place, plant, traced

pytestmark = [
    # a line that failed in the midst of its work leaves connections to the collector
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning"),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]
ROOMS = (
    "tui.session.command",
    "tui.session.read",
    "tui.session",
    "tui.drive",
    "tui.bus.share",
    "tui.bus.schedule",
    "tui.bus",
    "tui.wire",
)
"""Functions of each of these that are in none before it."""
BOTTOM = {"TcpTransport.send"}
"""Points without which nothing can be sent: the frame passes them on every path."""
SOME = 24
"""Every nth function outside the sweeps, which take all."""
PARTS = 3
"""Tests that the functions of a room are divided among in the sweeps: each has a time limit."""
AT_ONCE = 1.0
FRAME_WITHIN = 12.0
FAMILY, COMMAND = "atv71", 8501


class Wire:
    """Simulated drives, and the stop words on their line."""

    def __init__(self) -> None:
        self.stops: list[float] = []
        self.simulation = Simulation([DriveSpec(FAMILY, 1, run_hz=20.0)])
        self.simulation.start()
        self.link = RtuTcpLink(*self.simulation.serve_rtu_tcp())

    def hear(self, data: bytes) -> None:
        if bytes([1, 6]) + COMMAND.to_bytes(2, "big") in data:
            self.stops.append(time.monotonic())

    def run_again(self) -> None:
        self.simulation.drive(1).run(20.0)
        self.stops.clear()


@pytest.fixture(autouse=True)
def collected() -> Iterator[None]:
    """Leftovers of the errors end with their test: their warnings would fail a later one.

    What is left is frozen: the next collection is of the next test only, and short.
    """
    yield
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="module")
def wire() -> Iterator[Wire]:
    """One simulated drive for all errors."""
    heard = RtuConversation.feed
    made = Wire()

    def feed(conversation: RtuConversation, data: bytes, now: float) -> None:
        made.hear(data)
        heard(conversation, data, now)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(RtuConversation, "feed", feed)
        yield made
    made.simulation.stop()


class Bench:
    """A program with a drive, that owns the line or is attached to the owner."""

    def __init__(self, wire: Wire, folder: Path, *, attached: bool) -> None:
        self.wire = wire
        self.owner: Line | None = None
        place = place_in(folder) if attached else None
        if attached:
            owner = Program("owner", "owner", os.getpid())
            self.owner = Line(wire.link, place=place, program=owner)
            self.owner.open(wait=5.0)
        self.line = Line(wire.link, place=place, program=Program("me", "panel", os.getpid()))
        self.journal = Journal(folder)
        self.fleet = Fleet(self.line, self.journal)
        self.shown_at = 0.0
        """When it was first seen that NOT STOPPED was said."""

    def open(self) -> None:
        self.line.open(wait=5.0)
        self.fleet.take(DriveSession(self.line, 1, library.load(FAMILY)))

    def is_witness(self) -> bool:
        """True if this is a thread of the owner or of a simulated drive."""
        thread = threading.current_thread()
        mine = (threading.main_thread(), self.line._engine._thread)
        return thread not in mine and thread.name != "stops sent"

    def press(self) -> float:
        """Action of the stop key; see KeyDispatcher."""
        pressed = time.monotonic()
        try:
            self.fleet.stop(self.fleet.sessions)
        except LineClosed:
            pass
        except Exception as error:
            self.fleet.last_stop(error)
        return pressed

    def phase(self) -> Phase | None:
        report = self.fleet.stopper._reports.get(1)
        return report.phase if report is not None else None

    def not_stopped(self) -> bool:
        failed = self.phase() is Phase.FAILED
        if failed and not self.shown_at:
            self.shown_at = time.monotonic()
        return failed

    def close(self) -> None:
        self.line.close()
        if self.owner is not None:
            self.owner.close()
        self.journal.close()


def until(holds: Callable[[], bool], seconds: float) -> bool:
    end = time.monotonic() + seconds
    while not holds() and time.monotonic() < end:
        time.sleep(0.005)
    return holds()


@cache
def passed(wire: Wire, attached: bool, folder: Path) -> tuple[Place, ...]:
    """The functions that one stop passes through, from the key to the word that it stops."""
    bench = Bench(wire, folder, attached=attached)
    passage = Passage(bench.is_witness)
    wire.run_again()
    with traced(passage):
        bench.open()
        passage.open = True
        bench.press()
        assert until(lambda: bench.phase() is Phase.STOPPED, 20.0)
        passage.open = False
    bench.close()
    assert all(room_of(place) for place in passage.places), "a room is missing in the list"
    return tuple(sorted(passage.places))


def room_of(place: Place) -> str:
    return next((room for room in ROOMS if place.module.startswith(room)), "")


@pytest.mark.parametrize(
    ("once", "first", "every"),
    [
        pytest.param(False, 0, SOME, id="some-each-call"),
        *(
            pytest.param(once, part, PARTS, id=f"{name}-{part}", marks=pytest.mark.sweep)
            for once, name in ((False, "each-call"), (True, "first-call"))
            for part in range(PARTS)
        ),
    ],
)
@pytest.mark.parametrize("attached", [False, True], ids=["direct", "attached"])
@pytest.mark.parametrize("room", ROOMS)
@pytest.mark.internal_errors
def test_error_anywhere_in_a_stop_does_not_prevent_its_frame(
    wire: Wire,
    room: str,
    attached: bool,
    once: bool,
    first: int,
    every: int,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    folder = tmp_path_factory.mktemp("stop")
    places = [item for item in passed(wire, attached, folder) if room_of(item) == room]
    assert places
    wrong = []
    for number, place in enumerate(places[first::every]):
        made = Bench(wire, tmp_path_factory.mktemp(f"error{number}"), attached=attached)
        try:
            made.open()
            wire.run_again()
            with pytest.MonkeyPatch.context() as patch:
                if plant(patch, place, once=once, spared=made.is_witness):
                    wrong += stopped(made, place)
        finally:
            made.close()
    assert not wrong, "\n".join(wrong)


def stopped(made: Bench, place: Place) -> list[str]:
    """Press the stop key; return the resulting error."""
    wire, pressed = made.wire, made.press()
    sent = until(lambda: bool(wire.stops) or made.not_stopped(), FRAME_WITHIN)
    # the owner may not have reached it yet, or a follow-up failed before the frame was sent
    if wire.stops or (place.name not in BOTTOM and until(lambda: bool(wire.stops), 1.0)):
        return []
    after = made.shown_at - pressed
    if not sent:
        return [f"{place}: neither a frame nor NOT STOPPED"]
    if place.name in BOTTOM and after < AT_ONCE:
        return []
    return [f"{place}: NOT STOPPED after {after:.1f} s"]
