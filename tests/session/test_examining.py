"""A whole examination: listening, the counts of many reads, and the other ways of a gateway."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import pytest

from tests.bus.peer import PtyPeer
from tests.sweeps import kept
from tui.bus.api import DeviceCounters, LastMinute, LineCounters
from tui.bus.line import Line
from tui.bus.link import RtuTcpLink, SerialLink, parse_link
from tui.bus.trace import Frame
from tui.drive.profile import library
from tui.session.diagnosis.diagnosis import Diagnosis, diagnosed
from tui.session.diagnosis.evidence import DiagnosticEvidence
from tui.session.diagnosis.examining import CLEAN_READS, LEAST_READS, clean_reads, examine_line
from tui.session.diagnosis.measure import Measure, measure_of
from tui.session.diagnosis.reply_evidence import ReplyEvidence
from tui.simulator import DriveSpec, Simulation, troubles_of
from tui.wire.frames import frame

EVIDENCE = frame(2, bytes.fromhex("030C810001"))
REPLY = frame(2, bytes.fromhex("03020637"))
OTHER = frame(2, bytes.fromhex("03020636"))
WIDE = frame(2, bytes.fromhex("030C810002"))
LONG = frame(2, bytes.fromhex("030406370001"))
ECHO = frame(2, bytes.fromhex("080000A537"))
OLD = "not the reply"
STRAY = "late or repeated, device 2"
Step = bytes | tuple[bytes, str]


def read_of(address: int) -> bytes:
    """A read of one word."""
    return frame(2, bytes([3, 0, address, 0, 1]))


def _asks(data: bytes) -> bool:
    return data == ECHO or (len(data) == len(EVIDENCE) and data[4:5] == b"\0" and data[5] < 3)


def counted(steps: Sequence[Step]) -> Measure:
    """The counts of frames 10 ms apart; an echo by function 8 is sent, and then received."""
    frames, sent = [], b""
    for at, step in enumerate(steps):
        data, note = step if isinstance(step, tuple) else (step, "")
        way = "out" if _asks(data) and (data != ECHO or sent != ECHO) and not note else "in"
        sent = data if way == "out" else b""
        frames.append(Frame(at / 100, way, data, note))  # type: ignore[arg-type]
    return measure_of(frames, 2)


@pytest.mark.parametrize(
    ("steps", "worst", "counts"),
    [
        ([EVIDENCE, REPLY, EVIDENCE, REPLY], "", {"requested": 2, "answered": 2}),
        ([EVIDENCE, EVIDENCE, REPLY], "lost", {"lost": 1, "answered": 1}),
        ([EVIDENCE, (REPLY[:4], "damaged"), EVIDENCE, REPLY], "damaged", {"damaged": 1, "lost": 0}),
        ([EVIDENCE, (b"\x00", "noise"), REPLY], "stray", {"stray": 1, "damaged": 0, "answered": 1}),
        ([EVIDENCE, REPLY, (b"\x00", "noise")], "stray", {"stray": 1, "damaged": 0}),
        ([EVIDENCE, (REPLY, STRAY), EVIDENCE, REPLY], "late", {"late": 1, "lost": 0}),
        ([EVIDENCE, REPLY, (REPLY, STRAY)], "duplicated", {"duplicated": 1}),
        ([EVIDENCE, frame(7, REPLY[1:-2])], "foreign", {"foreign": 1, "lost": 0}),
        ([EVIDENCE, REPLY, (OTHER, STRAY)], "", {"second": 1, "duplicated": 0}),
        ([EVIDENCE, WIDE, (REPLY, OLD)], "", {"behind": 1}),
    ],
)
def test_frames_are_counted_by_their_fault(
    steps: list[Step], worst: str, counts: Mapping[str, int]
) -> None:
    found = counted(steps)
    assert found.worst == worst
    assert {kind: found.count(kind) for kind in counts} == counts


def test_two_drives_are_distinguished_from_a_changing_value() -> None:
    assert not counted([EVIDENCE, REPLY, EVIDENCE, OTHER, EVIDENCE, OTHER]).two_drives
    assert counted([EVIDENCE, REPLY, (OTHER, STRAY), EVIDENCE, REPLY, (OTHER, STRAY)]).two_drives
    turned = Measure(damaged=2, turns=2)
    assert turned.two_drives
    assert not Measure(turns=2).two_drives


def test_copy_during_the_next_request_is_not_a_second_drive() -> None:
    """Taken for the reply to another setting, it leaves that one's own reply over."""
    first, second = read_of(1), read_of(2)
    values = {first: REPLY, second: OTHER}
    steps: list[Step] = []
    for request in (first, second) * 3:
        steps += [request, values[request]]
    steps[3:4] = [REPLY, (OTHER, STRAY)]
    found = counted(steps)
    found.decide(counted([first, REPLY, (REPLY, STRAY), second, OTHER, (OTHER, STRAY)]))
    assert (found.two_drives, found.worst) == (False, "duplicated")
    found.decide(counted([first, REPLY, (OTHER, STRAY), first, REPLY, (OTHER, STRAY)]))
    assert found.two_drives


@pytest.mark.parametrize(
    ("steps", "counts"),
    [
        # each request gets the reply to the one before, and its repeat its own
        (
            [EVIDENCE, REPLY, WIDE, (REPLY, OLD), WIDE, LONG, ECHO, (LONG, OLD),
             ECHO, ECHO, EVIDENCE, (ECHO, OLD), EVIDENCE, REPLY],
            {"behind": 3, "duplicated": 0},
        ),
        # a copy that arrives during the next request, whose own reply follows
        ([EVIDENCE, REPLY, WIDE, (REPLY, OLD), LONG], {"behind": 0, "duplicated": 1}),
        # the second drive's reply arrives then, and the own one collides
        (
            [EVIDENCE, REPLY, WIDE, (OTHER, OLD), (LONG[:5], "noise")],
            {"behind": 0, "second": 1},
        ),
        # a reply that arrives during the next request after a delay
        ([EVIDENCE, *[b"\0"] * 20, WIDE, (REPLY, OLD), LONG], {"behind": 0}),
    ],
)  # fmt: skip
def test_older_reply_is_classified_by_the_other_replies(
    steps: list[Step], counts: Mapping[str, int]
) -> None:
    found = counted(steps)
    assert {kind: found.count(kind) for kind in counts} == counts
    assert found.one_behind == (found.behind > 1)


@pytest.mark.parametrize(("after", "kind"), [(0.05, "behind"), (0.3, "late")])
def test_reply_one_behind_is_immediate_unlike_a_late_one(after: float, kind: str) -> None:
    frames = [Frame(0, "out", EVIDENCE), Frame(1, "out", WIDE), Frame(1 + after, "in", REPLY, OLD)]
    found = measure_of(frames, 2)
    assert {text: found.count(text) for text in ("behind", "late")} == {
        "behind": int(kind == "behind"),
        "late": int(kind == "late"),
    }


def test_replies_of_other_polled_drives_are_not_foreign() -> None:
    other = frame(7, EVIDENCE[1:-2])
    assert counted([EVIDENCE, frame(7, REPLY[1:-2])]).foreign == 1
    assert counted([other, frame(7, REPLY[1:-2]), EVIDENCE, frame(7, REPLY[1:-2])]).foreign == 0


def test_gateway_exceptions_are_counted() -> None:
    refused = frame(2, bytes([0x83, 11]))
    frames = [Frame(0, "out", EVIDENCE), Frame(0.1, "in", refused)]
    assert measure_of(frames, 2, unreached={10, 11}).worst == "unreached"
    assert measure_of(frames, 2).answered == 1


def test_missing_reply_of_a_slow_drive_counts_as_late() -> None:
    frames = [Frame(0, "out", EVIDENCE), Frame(0.6, "in", REPLY), Frame(1, "out", EVIDENCE)]
    assert (measure_of(frames, 2).late, measure_of(frames, 2).lost) == (1, 0)


@contextmanager
def opened(
    troubles: Mapping[str, float], scheme: str, served: str = "", seed: int = 0
) -> Iterator[Line]:
    """A line to an Altivar 71 at address 2 with these troubles."""
    rates, habits = troubles_of(troubles)
    drive = DriveSpec("atv71", 2)
    with Simulation([drive], faults=rates, habits=habits, seed=seed) as simulation:
        tcp = (served or scheme) == "tcp"
        host, port = simulation.serve_tcp() if tcp else simulation.serve_rtu_tcp()
        line = Line(parse_link(f"{scheme}:{host}:{port}"))
        line.open(wait=5)
        try:
            yield line
        finally:
            line.close()


async def found_on(line: Line, family: str | None = "atv71", reads: int = 80) -> Diagnosis:
    profile = library.load(family) if family else None
    return diagnosed(await examine_line(line, 2, profile, reads=reads))


async def test_nothing_is_sent_while_another_master_is_active() -> None:
    with opened({"master": 0.1}, "rtu-tcp") as line:
        found = await found_on(line)
        assert found.rung == "other-master"
        assert line.counters.requests == 0
        assert any("Address 2" in step for step in found.steps)


async def test_only_swapped_bytes_are_reported() -> None:
    with opened({"swapped": 1}, "tcp") as line:
        assert (await found_on(line)).rung == "swapped"
    with opened({}, "tcp") as line:
        well = await found_on(line, None)
        assert well.well
        assert well.sight.measure is not None
        assert well.sight.measure.straight > 3


@pytest.mark.parametrize(("scheme", "served"), [("tcp", "rtu-tcp"), ("rtu-tcp", "tcp")])
async def test_other_protocol_is_tried(scheme: str, served: str) -> None:
    with opened({}, scheme, served) as line:
        found = await found_on(line)
        assert found.rung == "wrong-protocol"
        assert f"{served}:127.0.0.1" in found.text


@pytest.mark.parametrize("unit", [255, 0])
async def test_only_unit_of_a_gateway_is_found(unit: int) -> None:
    with opened({"only-unit": unit}, "tcp") as line:
        found = await found_on(line)
    assert (found.rung, f"unit {unit}," in found.text) == ("other-unit", True)
    opens = re.search(r"tcp:127.0.0.1:\d+,unit=(\d+)", found.steps[0])
    assert opens is not None
    assert opens[1] == str(unit), "the line that works"


async def test_answering_line_gets_no_second_connection(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Many gateways take one client: a second one ends the connection of the line."""
    beside: list[object] = []

    async def refused(*place: object) -> None:
        beside.append(place)
        raise OSError

    with opened({}, "tcp") as line:
        await line.read(2, 3201)
        monkeypatch.setattr("asyncio.open_connection", refused)
        found = diagnosed(await examine_line(line, 9, None))
        assert (found.rung, beside) == ("silence", [])


async def test_idle_timeout_is_found() -> None:
    with opened({"idle-close": 1}, "tcp") as line:
        assert (await found_on(line)).rung == "idle-close"


@pytest.mark.usefixtures("patient_lines")  # after a late reply, all reads are needed
async def test_reads_end_early_once_clean_ones_exclude_a_poor_line() -> None:
    with opened({}, "rtu-tcp") as line:
        measure = (await found_on(line, reads=200)).sight.measure
        assert measure is not None
        # the few reads before, and the proof of the step, count too
        assert CLEAN_READS - 10 <= measure.requested <= CLEAN_READS
        again = (await found_on(line, reads=200)).sight.measure
        assert again is not None
        assert LEAST_READS <= again.requested < measure.requested


def test_clean_reads_are_fewer_only_after_a_minute_without_trouble() -> None:
    own = DeviceCounters(minute=LastMinute(good=99))

    def reads(**line: int) -> int:
        minute = LastMinute(good=200, **line)
        return clean_reads(LineCounters(minute=minute, devices={2: own}), 2)

    assert (reads(), reads(foreign=1), reads(strays=1), reads(damaged=1)) == (50, 149, 149, 149)
    assert clean_reads(LineCounters(), 2) == 149


@pytest.mark.parametrize("trouble", kept(["corrupted", "duplicated"], "corrupted"))
async def test_one_bad_reply_continues_the_reads(trouble: str) -> None:
    with opened({trouble: 0.02}, "rtu-tcp", seed=3) as line:
        measure = (await found_on(line, reads=200)).sight.measure
        assert measure is not None
        assert measure.worst
        assert measure.requested > 149


async def test_healthy_gateway_reports_the_idle_time_tested() -> None:
    with opened({"idle-close": 30}, "tcp") as line:
        found = await found_on(line)
    assert found.well
    assert "for 3 s without a request" in found.text


async def test_loss_of_each_second_request_is_not_healthy() -> None:
    with opened({"lost-every": 2}, "rtu-tcp") as line:
        assert (await found_on(line, reads=12)).rung == "lost"


@pytest.mark.sweep
async def test_two_drives_are_not_reported_as_one_behind() -> None:
    with opened({"twin": 1}, "rtu-tcp", seed=8) as line:
        assert (await found_on(line, None)).rung == "two-drives"


@pytest.mark.parametrize(("second", "rung"), [(0, "behind"), (1, "behind"), (5, "two-drives")])
def test_surplus_replies_contradict_a_line_one_behind(second: int, rung: str) -> None:
    measure = Measure(requested=8, answered=4, damaged=4, second=second)
    heard = ReplyEvidence(requested=3, answered=3)
    sight = DiagnosticEvidence(RtuTcpLink("h", 1), 2, heard=heard, measure=measure, behind=True)
    assert diagnosed(sight).rung == rung


@pytest.mark.sweep
async def test_line_one_behind_is_reported() -> None:
    with opened({"behind": 1}, "rtu-tcp") as line:
        assert (await found_on(line, None, 12)).rung == "behind"


async def test_good_replies_of_the_last_minute_prove_the_format() -> None:
    """All collide just now, as of two drives at one address: no other format is suggested."""
    collided = False

    def script(request: bytes, _count: int) -> Sequence[bytes | float]:
        good = frame(2, bytes.fromhex("03020637"))
        return [b"\xff" + good[1:] + b"\x40"] if collided else [good]

    with PtyPeer(script) as peer:
        line = Line(SerialLink(peer.path))
        line.open(wait=5)
        try:
            assert (await line.read(2, 3201)).words == (0x0637,)
            collided = True
            assert (await found_on(line, reads=12)).rung == "checksum"
        finally:
            line.close()
