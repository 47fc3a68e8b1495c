"""The scan: every address once, silent ones again, after everything else."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import cast

import pytest

from tests.bus.peer import PtyPeer, Step
from tui.bus.api import DeviceState, IdentificationObjects, LineCounters, ModbusLine, Priority
from tui.bus.errors import (
    ChecksumFault,
    DeviceException,
    LineBusy,
    LineClosed,
    LineError,
    LineLost,
    NoAnswer,
    Superseded,
    WrongReply,
)
from tui.bus.line import Line, Timing
from tui.bus.link import Link, SerialLink, TcpLink
from tui.bus.schedule.pace import Pace
from tui.bus.shared_state import SharedState
from tui.drive.profile import library
from tui.session.connect.address_prober import JITTER, AddressProber
from tui.session.connect.identify import ScanResult, identify_drive
from tui.session.connect.open_line import demo_line, open_line
from tui.session.connect.search import LATE_WAIT, REST, SECOND_WAIT, Search
from tui.session.drive import DriveSession
from tui.simulator import DriveSpec, Simulation


@dataclass
class Replies:
    """A line on which these addresses answer, some only on a second request.

    The read that finds them is refused, as by a drive that has no such word.
    """

    present: set[int]
    late: set[int] = field(default_factory=set)
    errors: dict[int, LineError] = field(default_factory=dict)
    requested: list[tuple[int, Priority]] = field(default_factory=list)
    pace: Pace = field(default_factory=Pace)
    timing: Timing = field(default_factory=Timing)
    link: Link = field(default_factory=lambda: SerialLink("/dev/null", 19200, "8E1"))
    facts: SharedState = field(default_factory=SharedState)
    heard_late: set[int] = field(default_factory=set)
    waits: list[float | None] = field(default_factory=list)
    """Wait for each missing reply."""
    counters: LineCounters = field(default_factory=LineCounters)

    def device_state(self, device: int) -> DeviceState:
        return DeviceState(device in self.heard_late, 0, None, None, None, None, None)

    async def identify(self, device: int, **_: object) -> IdentificationObjects:
        if device in self.errors:
            raise self.errors[device]
        return IdentificationObjects(1, {1: b"ATV71HU15M3"})

    async def read(
        self,
        device: int,
        address: int,
        _count: int,
        *,
        priority: Priority,
        within: float | None = None,
    ) -> None:
        self.requested.append((device, priority))
        if device in self.errors:
            raise self.errors[device]
        if device in self.present or (device in self.late and priority is Priority.PATIENT):
            raise DeviceException(device, 3, address, 2)
        self.waits.append(within)
        raise NoAnswer(device, 3, address)

    async def no_time(self, _seconds: float) -> None:
        """Replaces a pause."""

    def background(self) -> list[int]:
        """Addresses probed in the first round."""
        return [device for device, priority in self.requested if priority is Priority.BACKGROUND]

    def patiently(self) -> list[int]:
        """Addresses probed again."""
        return [device for device, priority in self.requested if priority is Priority.PATIENT]


async def searched(
    search: Search, line: Replies | ModbusLine, texts: list[str] | None = None
) -> list[ScanResult]:
    """Drives found, and the progress each time."""
    results: list[ScanResult] = []

    async def found(result: ScanResult) -> None:
        results.append(result)
        if texts is not None:
            texts.append(search.text)

    await search.run(cast("ModbusLine", line), found)
    return results


async def test_single_drive_is_identified_before_profiles_are_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def read_them(*_: object, **__: object) -> AddressProber:
        raise AssertionError

    monkeypatch.setattr("tui.session.connect.search.probers_of", read_them)
    line = Replies(present=set())
    texts: list[str] = []
    search = Search([7], line.no_time)
    (result,) = await searched(search, line, texts)
    assert result.identity is not None
    assert result.identity.reference == "ATV71HU15M3"
    assert (search.ended, texts) == ("done", ["1 of 1 address, 1 found"])
    # nothing else was requested
    assert line.requested == []


async def test_single_drive_without_identification_is_probed_like_others() -> None:
    line = Replies(present={7}, errors={7: DeviceException(7, 43, 0, 1)})
    search = Search([7], line.no_time)
    (result,) = await searched(search, line)
    assert (search.ended, search.answered) == ("done", frozenset({7}))
    assert line.requested
    assert result.identity is None or not result.identity.reference


def devices(results: Iterable[ScanResult]) -> list[int]:
    return [result.device for result in results]


async def test_drive_missed_once_is_probed_again_with_a_longer_wait() -> None:
    line, texts = Replies({1, 4}, late={3}), list[str]()
    search = Search(range(1, 6), line.no_time)
    assert devices(await searched(search, line, texts)) == [1, 4, 3]
    assert (line.background(), line.patiently()) == ([1, 2, 3, 4, 5], [2, 3, 5])
    assert texts == [
        "1 of 5 addresses, 1 found",
        "4 of 5 addresses, 2 found",
        "2 of 3 addresses again",
    ]
    assert (search.text, set(search.answered)) == ("done, 3 found", {1, 3, 4})


async def test_empty_address_costs_one_request_and_the_longest_turnaround() -> None:
    line = Replies({1})
    await searched(Search(range(1, 4), line.no_time, once=True), line)
    assert line.requested == [
        (1, Priority.BACKGROUND),
        (2, Priority.BACKGROUND),
        (3, Priority.BACKGROUND),
    ]
    # Leroy-Somer's 10 ms, the first character of the reply, and what a computer is late
    assert line.waits == [pytest.approx(0.010 + 11 / 19200 + JITTER)] * 2


async def test_slow_characters_extend_the_wait() -> None:
    line = Replies(set(), link=SerialLink("/dev/null", 1200, "8N1"))
    await searched(Search([1, 2], line.no_time, once=True), line)
    # the silence that ends the request, and the first character
    assert line.waits == [pytest.approx(4.5 * 10 / 1200 + JITTER)] * 2


async def test_network_line_has_the_default_wait() -> None:
    line = Replies(set(), link=TcpLink("127.0.0.1"))
    await searched(Search([1, 2], line.no_time, once=True), line)
    assert line.waits == [None, None]


async def test_remaining_estimate_counts_silent_addresses_again() -> None:
    line = Replies({1})
    clock, left = [0.0], list[float]()

    def look() -> None:
        left.append(search.left)
        clock[0] += 1.0  # each address takes a second

    search = Search(range(1, 5), line.no_time, between=look, now=lambda: clock[0])
    await searched(search, line)
    once, again, within = left[0] - LATE_WAIT, left[4], line.waits[0]
    assert within is not None
    # before anything is known: four at the line's limit, and the four of the next round
    assert once == pytest.approx(4 * (search.cost + search.cost + SECOND_WAIT - within))
    assert again == pytest.approx(3 * (search.cost + SECOND_WAIT - within))
    assert search.left == 0


async def test_paused_drive_is_not_reported_as_silent() -> None:
    line = Replies({1})
    line.facts.pause_polling(2, "It is being proved.")
    search = Search(range(1, 4), line.no_time, once=True)
    (_, reported) = await searched(search, line)
    assert (reported.device, reported.identity, reported.error) == (2, None, "It is being proved.")
    assert [device for device, _ in line.requested] == [1, 3]
    assert 2 in search.answered


async def test_slow_silent_addresses_increase_the_estimate() -> None:
    line, clock, left = Replies(set()), [0.0], list[float]()

    async def rest(_seconds: float) -> None:
        clock[0] += 2.0

    def look() -> None:
        left.append(search.left)

    search = Search(range(1, 4), rest, once=True, between=look, now=lambda: clock[0])
    line.pace.claim("a monitor", 1, 0.1, 0.5)
    await searched(search, line)
    assert left == [pytest.approx(3 * search.cost), 4.0, 2.0]


async def test_late_reply_is_accepted_and_requested_again() -> None:
    line = Replies({1}, late={3}, heard_late={3})
    assert devices(await searched(Search(range(1, 5), line.no_time, once=True), line)) == [1, 3]
    assert (line.background(), line.patiently()) == ([1, 2, 3, 4], [3])


async def test_drive_with_a_long_response_delay_is_found() -> None:
    simulation = Simulation([DriveSpec("powerdrive", 3), DriveSpec("atv71", 5)], any_settings=True)

    def script(request: bytes, _count: int) -> Sequence[Step]:
        reply = simulation.line.receive(request)
        return [0.1, reply.data] if reply is not None else []

    with simulation, PtyPeer(script) as peer:
        line = Line(SerialLink(peer.path))
        line.open(wait=10.0)
        try:
            results = await searched(Search(range(1, 12), once=True), line)
        finally:
            line.close()
    assert devices(results) == [3, 5]
    assert [result.by for result in results] == ["read of register 1039", "function 43"]


async def test_callback_between_two_addresses_can_end_the_scan() -> None:
    line, requested = Replies({1, 2}), list[int]()

    def look() -> None:
        requested.append(len(line.requested))
        if len(requested) > 1:
            raise LineBusy("another master")

    search = Search([1, 2], line.no_time, between=look)
    with pytest.raises(LineBusy):
        await searched(search, line)
    assert (line.background(), search.text) == ([1], "stopped, 1 found")


async def test_polls_run_between_two_probes() -> None:
    rests: list[float] = []

    async def rest(seconds: float) -> None:
        rests.append(seconds)

    line = Replies({1}, link=TcpLink("127.0.0.1"))
    await searched(Search([1, 2], rest), line)
    assert not rests, "nobody polls: nothing to wait for"
    line.pace.claim("a monitor", 1, 0.1, 0.5)
    await searched(Search([1, 2], rest), line)
    assert rests == [REST * line.timing.scan_timeout, REST * line.timing.patient_timeout]


async def test_cancelled_scan_reports_it() -> None:
    line, search = Replies({1}), Search([1, 2, 3])
    at_the_first = asyncio.Event()

    async def found(_: ScanResult) -> None:
        at_the_first.set()
        await asyncio.sleep(60)

    running = asyncio.ensure_future(search.run(cast("ModbusLine", line), found))
    await at_the_first.wait()
    assert search.goes_on
    running.cancel()
    with pytest.raises(asyncio.CancelledError):
        await running
    assert (search.goes_on, search.text, search.at) == (False, "stopped, 1 found", None)


async def test_scan_finds_every_drive_and_no_other() -> None:
    opened = demo_line({"atv21": 35.0, "atv71": 50.0, "powerdrive": 30.0})
    try:
        assert devices(await searched(Search(range(1, 6), patient=True), opened.line)) == [1, 2, 3]
        # a scanned empty address is not a line failure
        assert opened.line.counters.timeouts == 0
        assert opened.line.counters.searched > 4
    finally:
        opened.close()


@pytest.mark.sweep
async def test_second_scan_finds_drives_without_function_43_and_later_ones() -> None:
    opened = open_line("sim:powerdrive@1,varmeca@2,atv71@3")
    try:
        first = await searched(Search(range(1, 5), patient=True), opened.line)
        for device, profile in enumerate(("powerdrive", "varmeca", "atv71"), start=1):
            DriveSession(opened.line, device, library.load(profile))  # describes it to the line
        again = await searched(Search(range(1, 5), patient=True), opened.line)
        assert again == first
        assert devices(again) == [1, 2, 3]
        assert not any(result.error for result in again)
        nobody = library.load("powerdrive")
        DriveSession(opened.line, 4, nobody)
        with pytest.raises(NoAnswer):  # what is known of it does not make it present
            await identify_drive(opened.line, 4)
    finally:
        opened.close()


@pytest.mark.parametrize(
    "error",
    [
        LineBusy("Too many requests wait."),
        WrongReply(2, 43, 0),
        ChecksumFault(2, 43, 0),
        Superseded(2, 0),
    ],
    ids=lambda error: type(error).__name__,
)
async def test_error_at_one_address_does_not_end_the_scan(error: LineError) -> None:
    results = await searched(Search(range(1, 4), patient=True), Replies({1, 3}, errors={2: error}))
    assert devices(results) == [1, 2, 3]
    assert [result.error for result in results] == ["", str(error), ""]


@pytest.mark.parametrize("error", [LineLost("gone"), LineClosed()])
async def test_scan_ends_with_its_line(error: LineError) -> None:
    search = Search(range(1, 4), patient=True)
    with pytest.raises(type(error)):
        await searched(search, Replies({1, 3}, errors={2: error}))
    assert search.text == "stopped, 1 found"


async def test_broken_own_profile_does_not_end_a_scan() -> None:
    folder = library.user_folder()
    folder.mkdir(parents=True)
    (folder / "mine.toml").write_text('[profile]\nid = "mine"\n', encoding="utf-8")
    opened = demo_line({"atv71": 50.0, "powerdrive": 30.0})
    try:
        results = await searched(Search([1, 2], patient=True), opened.line)
    finally:
        opened.close()
    assert [r.identity.candidates[0] for r in results if r.identity] == ["atv71", "powerdrive"]


async def test_search_names_the_addresses_that_it_has_not_probed_yet() -> None:
    line = Replies({2, 4})
    search = Search(range(1, 6), line.no_time)
    unprobed: list[tuple[int, ...]] = [search.unprobed]

    async def found(_: ScanResult) -> None:
        unprobed.append(search.unprobed)

    await search.run(cast("ModbusLine", line), found)
    assert unprobed == [(1, 2, 3, 4, 5), (2, 3, 4, 5), (4, 5)]
    assert search.unprobed == ()


async def test_search_for_motors_to_stop_leaves_no_pauses_for_polling() -> None:
    rests: list[float] = []

    async def rest(seconds: float) -> None:
        rests.append(seconds)

    line = Replies(set(), link=TcpLink("127.0.0.1"))
    line.pace.claim("a monitor", 1, 0.1, 0.5)
    search = Search([1, 2], rest)
    search.stops_found = True
    await searched(search, line)
    assert rests == []
