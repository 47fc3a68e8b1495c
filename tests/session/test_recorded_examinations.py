"""Examinations of lines with each fault, in steps of time: the evidence, and all that was sent.

`recorded_examinations.txt` has a section for each subject. Each entry names the case.
"""

from __future__ import annotations

import asyncio
import tempfile
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import is_dataclass
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import pytest

from tests.recorded import filled, sections
from tests.session.framed_line import BEGUN, Fault, FramedLine, Piece, well
from tui.bus.errors import (
    ONE_BEHIND,
    BytesSwapped,
    ChecksumFault,
    DeviceException,
    LineError,
    LineLost,
    NoAnswer,
    RequestRefused,
    WrongReply,
)
from tui.bus.link import Link, RtuTcpLink, SerialLink, TcpLink, label
from tui.bus.model import LineStatus
from tui.bus.program import Program
from tui.bus.transport.ports import PortSeen
from tui.drive.profile import library
from tui.session.counters.watch import CounterWatch
from tui.session.diagnosis import asking, examining, short_reads
from tui.session.diagnosis.diagnosis import diagnosed
from tui.session.diagnosis.evidence import DiagnosticEvidence
from tui.session.diagnosis.examining import examine_line
from tui.session.diagnosis.reply_evidence import evidence_of_errors
from tui.session.drive import DriveSession
from tui.session.journal import Journal
from tui.wire.frames import frame

TEXTS = Path(__file__).parent / "recorded_examinations.txt"
SERIAL, RTU, TCP = SerialLink("/dev/ttyUSB9"), RtuTcpLink("10.0.0.9", 502), TcpLink("10.0.0.9")
DEVICE, READ = 2, 3
STRAY = f"late or repeated, device {DEVICE}"
PORT = PortSeen(SERIAL.path, latency=4)
HELD = PORT._replace(holder="keeper (7)", others="minicom (8)")
Ended = tuple[list[Piece], LineError | None]


def broken(data: bytes) -> bytes:
    """The bytes with another checksum."""
    return data[:-1] + bytes([data[-1] ^ 0x55])


def other_word(data: bytes) -> bytes:
    """A valid reply with another last word."""
    body = data[:-2]
    return frame(body[0], body[1:-1] + bytes([body[-1] ^ 3]))


def at_times(period: int, faulty: Fault, last: int = 1000) -> Fault:
    """A fault of each so many-th request, up to a number of requests."""

    def fault(number: int, request: bytes, reply: bytes) -> Ended:
        hit = number % period == 0 and number <= last
        return (faulty if hit else well)(number, request, reply)

    return fault


def lost(_number: int, _request: bytes, _reply: bytes) -> Ended:
    return [], NoAnswer(DEVICE, 3, 0)


def late(_number: int, _request: bytes, reply: bytes) -> Ended:
    return [(1.2, reply, STRAY)], NoAnswer(DEVICE, 3, 0)


def slow(_number: int, _request: bytes, reply: bytes) -> Ended:
    return [(0.3, reply, "")], None


def damaged(_number: int, _request: bytes, reply: bytes) -> Ended:
    return [(0.01, broken(reply), "damaged")], ChecksumFault(DEVICE, 3, 0, "", broken(reply))


def noisy(number: int, request: bytes, reply: bytes) -> Ended:
    return [(0.004, b"\0\0", "noise"), *well(number, request, reply)[0]], None


def twice(number: int, request: bytes, reply: bytes) -> Ended:
    return [*well(number, request, reply)[0], (0.012, reply, STRAY)], None


def twins(number: int, request: bytes, reply: bytes) -> Ended:
    if request[1] != READ:
        return well(number, request, reply)
    return [*well(number, request, reply)[0], (0.012, other_word(reply), STRAY)], None


def foreign(number: int, request: bytes, reply: bytes) -> Ended:
    if request[1] != READ:
        return well(number, request, reply)
    data = frame(9, reply[1:-2])
    return [(0.01, data, "other address")], WrongReply(DEVICE, 3, 0, "of 9", data)


def other_function(_number: int, _request: bytes, _reply: bytes) -> Ended:
    data = frame(DEVICE, b"\x04\x02\0\1")
    return [(0.01, data, "other function")], WrongReply(DEVICE, 3, 0, "", data)


def misshapen(_number: int, _request: bytes, _reply: bytes) -> Ended:
    data = frame(DEVICE, bytes([3, 12, *range(12)]))
    return [(0.01, data, "other length")], WrongReply(DEVICE, 3, 0, "", data)


def echoed(number: int, request: bytes, reply: bytes) -> Ended:
    return [(0.001, request, "echo"), *well(number, request, reply)[0]], None


def echo_alone(_number: int, request: bytes, _reply: bytes) -> Ended:
    return [(0.001, request, "echo")], NoAnswer(DEVICE, 3, 0, "Only an echo came.")


def garbage(_number: int, _request: bytes, _reply: bytes) -> Ended:
    data = bytes(range(0x81, 0x8F))
    return [(0.01, data, "noise")], ChecksumFault(DEVICE, 3, 0, "", data)


def refused(code: int) -> Fault:
    def fault(_number: int, request: bytes, reply: bytes) -> Ended:
        head = 6 if request[2:6] == (len(request) - 6).to_bytes(4, "big") else 0
        function = request[head + 1]
        pdu = bytes([function | 0x80, code])
        data = request[:5] + bytes([3, DEVICE]) + pdu if head else frame(DEVICE, pdu)
        return [(0.01, data, "")], DeviceException(DEVICE, function, 0, code)

    return fault


class Behind:
    """Each request gets the reply to the one before, from one request on."""

    def __init__(self, after: int) -> None:
        self._after, self._before = after, b""

    def __call__(self, number: int, request: bytes, reply: bytes) -> Ended:
        before, self._before = self._before, reply
        if number < self._after or not before:
            return well(number, request, reply)
        return [(0.01, before, "not the reply")], WrongReply(DEVICE, 3, 0, "", before)


def registers(family: str = "atv71", **raws: int) -> dict[int, int]:
    """All registers of a drive, with a small value each."""
    profile = library.load(family)
    words = {p.address + n: 0x10 + n for p in profile.parameters for n in range(2)}
    words.update({profile.find(code).address: raw for code, raw in raws.items()})
    return words


def swapped_registers() -> dict[int, int]:
    return {address: word << 8 for address, word in registers().items()}


class Turning(dict[int, int]):
    """Registers that are those of two drives in turn."""

    turn = 0

    def __getitem__(self, address: int) -> int:
        self.turn += 1
        return super().__getitem__(address) + self.turn // 7 % 2


def seen(sight: DiagnosticEvidence, line: FramedLine, *, full: bool = False) -> Iterator[str]:
    """All of the evidence but what is empty, and how the line was used."""
    found = diagnosed(sight)
    yield f"  {found.rung}, {found.certainty}: {found.text} {found.others}"
    empty = DiagnosticEvidence(sight.link, sight.device, port=PORT)
    for name in ("trouble", "port", "changed", "heard", "withheld", "errors", "turnaround",
                 "overheard", "loose", "measure", "works", "behind", "idle_closed", "idle",
                 "neighbors", "identity"):  # fmt: skip
        if (value := getattr(sight, name)) != getattr(empty, name):
            value = str(value) if isinstance(value, Exception) else value
            yield f"  {name}: {filled(value) if is_dataclass(value) else value}"
    family = sight.profile.id if sight.profile is not None else None
    yield f"  {family}, {line.time.now - BEGUN:.2f} s, {sorted(line.limits)} described"
    if full:
        yield from (f"  {text}" for text in line.sent)
    else:
        yield f"  {', '.join(line.sent[:4])}"
        kinds = [text.partition("+")[2] or text for text in line.sent[4:]]
        yield f"  {', '.join(f'{kinds.count(kind)} x {kind}' for kind in dict.fromkeys(kinds))}"


def examined(
    patch: pytest.MonkeyPatch, line: FramedLine, family: str | None = "atv71", *,
    full: bool = False, port: PortSeen = PORT, **how: Any,
) -> Iterator[str]:  # fmt: skip
    """Examine a line in its own time."""
    for module in (asking, examining, short_reads):
        patch.setattr(module, "REAL_CLOCK", line.time)
    patch.setattr(short_reads, "randbelow", lambda most: most // 3)
    patch.setattr(asking, "see_port", lambda path: port._replace(path=path))
    profile = library.load(family) if family else None
    sight = asyncio.run(examine_line(line, DEVICE, profile, **how))
    return seen(sight, line, full=full)


def line_of(link: Link, fault: Fault = well, words: dict[int, int] | None = None) -> FramedLine:
    """A line with one drive, an Altivar 71 unless other words are given."""
    line = FramedLine(link, {DEVICE: {}}, fault)
    line.devices[DEVICE].words = registers() if words is None else words
    return line


FAULTS: tuple[tuple[str, Fault], ...] = (
    ("well", well), ("each third lost", at_times(3, lost)), ("all lost", lost),
    ("first lost", at_times(1, lost, 1)), ("each fourth late", at_times(4, late)),
    ("all late", late), ("slow, some lost", at_times(2, slow)),
    ("each fifth damaged", at_times(5, damaged)), ("all damaged", damaged),
    ("noise", at_times(6, noisy)), ("one noise", at_times(20, noisy, 20)),
    ("copies", at_times(4, twice)), ("one copy", at_times(40, twice, 40)),
    ("second replies", at_times(4, twins)), ("some second replies", at_times(50, twins)),
    ("foreign", at_times(3, foreign)), ("all foreign", foreign),
    ("other function", other_function), ("other length", at_times(2, misshapen)),
    ("echo", echoed), ("echo alone", echo_alone), ("garbage", garbage),
    ("refused", refused(2)), ("gateway", at_times(7, refused(11))), ("no gateway", refused(10)),
    ("behind", Behind(4)),
)  # fmt: skip


def faults() -> Iterator[str]:
    """A serial line with each fault."""
    for name, fault in FAULTS:
        yield name
        with pytest.MonkeyPatch.context() as patch:
            yield from examined(patch, line_of(SERIAL, fault), reads=70, full=name == "well")


def drives() -> Iterator[str]:
    """Drives of several families, with their values, on a good line."""
    for family in ("atv71", "atv21", "atv312", "powerdrive", "varmeca"):
        for name, fault in (("well", well), ("some copies", at_times(9, twice))):
            yield f"{family}, {name}"
            with pytest.MonkeyPatch.context() as patch:
                line = line_of(SERIAL, fault, registers(family))
                yield from examined(patch, line, family, reads=60, full=name == "well")
    named = {0: b"Telemecanique", 1: b"ATV71HU15M3", 2: b"0201"}
    for title, identity, words in (
        ("named", named, None), ("unknown name", {1: b"X9"}, None), ("no name", None, None),
        ("likely by registers", None, registers("atv312")), ("mute", None, {}),
        ("swapped", None, swapped_registers()), ("two drives", None, Turning(registers())),
    ):  # fmt: skip
        for chosen in (None, "atv71"):
            yield f"{title}, profile {chosen}"
            with pytest.MonkeyPatch.context() as patch:
                line = line_of(SERIAL, well, words)
                line.devices[DEVICE].identity = identity
                yield from examined(patch, line, chosen, reads=40)


def at_time(line: FramedLine, seconds: float, happen: Callable[[], None]) -> None:
    """Let something happen on a line at a time, later than the others."""
    line.time.events.append((seconds, happen))


def lose(
    line: FramedLine, at: float, until: float | None = None, reason: str = "It is cut."
) -> None:
    """Lose the line at a time, until another one."""
    at_time(line, at, lambda: line.become(LineStatus.LOST, reason))
    if until is not None:
        at_time(line, until, lambda: line.become(LineStatus.CONNECTED))


def overhear(line: FramedLine, at: float, data: bytes, note: str) -> None:
    """Let a frame of others come at a time."""
    at_time(line, at, lambda: line.hear("in", data, note))


def noise_twice(line: FramedLine) -> None:
    """Noise while it is monitored, and again as long later."""
    for at in (0.7, 2.2):
        overhear(line, at, b"\x81" * 4, "noise")


MASTER = frame(7, bytes.fromhex("030C810001"))
SLAVE = frame(7, bytes.fromhex("03020637"))


def attach(line: FramedLine) -> None:
    """Let another program own the line."""
    line.facts.voice = object()  # type: ignore[assignment]
    line.facts.programs = (Program("other", "panel", 7), line.facts.me)


def count_errors(line: FramedLine) -> None:
    """Let the port count errors of characters now."""
    tally = line.tally
    tally.framing, tally.parity = tally.framing + 3, tally.parity + 4
    tally.breaks, tally.overruns = tally.breaks + 5, tally.overruns + 6


def fails(error: Any, after: int = 0) -> Fault:
    """The error of each request after some, without a frame."""

    def fault(number: int, request: bytes, reply: bytes) -> Any:
        return ([], error) if number > after else well(number, request, reply)

    return fault


def serial_lines() -> Iterator[str]:
    """Serial lines on which something else happens."""

    def first(line: FramedLine) -> None:
        line.become(LineStatus.LOST, "not yet")

    def without_reason(line: FramedLine) -> None:
        line.become(LineStatus.CONNECTING)

    def unrecorded(line: FramedLine) -> None:
        line.frames = deque(maxlen=0)

    def before(line: FramedLine) -> None:
        for data in (MASTER, SLAVE, b"\0\0\0\0"):
            line.hear("in", data, "late or repeated")
        count_errors(line)

    def known_well(line: FramedLine) -> None:
        for _ in range(30):
            line.tally.count_good(DEVICE, was_heard=True)

    def no_turnaround(line: FramedLine) -> None:
        line.usual = None

    def none_at_all(line: FramedLine) -> None:
        line.usual = line.longest = None

    def poll_and_noise(line: FramedLine) -> None:
        at_time(line, 0.5, lambda: line.hear("out", frame(9, bytes.fromhex("030C810001"))))
        overhear(line, 0.7, b"\x81\x82\x83\x84", "noise")

    cases: tuple[tuple[str, Callable[[FramedLine], None], Fault], ...] = (
        ("not open", first, well), ("not open, no reason", without_reason, well),
        ("no frames, well", unrecorded, well), ("no frames, lost", unrecorded, lost),
        ("no frames, damaged", unrecorded, damaged), ("no frames, foreign", unrecorded, foreign),
        ("frames before", before, well), ("known well", known_well, well),
        ("known well, all damaged", known_well, damaged), ("known well, mute", known_well, lost),
        ("longest turnaround", no_turnaround, well), ("no turnaround", none_at_all, well),
        ("attached", attach, well), ("attached, lost", attach, lost),
        ("held", lambda _: None, well),
        ("errors of the port", lambda line: at_time(line, 1.505, partial(count_errors, line)),
         well),
        ("master before", lambda line: overhear(line, 0.7, MASTER, "late or repeated"), well),
        ("slave before", lambda line: overhear(line, 0.7, SLAVE, "late or repeated"), well),
        ("noise before", lambda line: overhear(line, 0.7, b"\x81\x82\x83\x84", "noise"), well),
        ("much noise before", lambda line: overhear(line, 0.7, b"\x81\x82" * 4, "noise"), well),
        ("noise twice", noise_twice, well),
        ("some noise", lambda line: overhear(line, 0.7, b"\x81\x82\x83", "noise"), well),
        ("polls and noise before", poll_and_noise, well),
        ("master meanwhile", lambda line: overhear(line, 1.8, MASTER, "late or repeated"), well),
        ("slave meanwhile", lambda line: overhear(line, 1.8, SLAVE, "late or repeated"), well),
        ("lost at once", lambda line: lose(line, 1.501), well),
        ("lost meanwhile", lambda line: lose(line, 1.8, 9.0), well),
        ("behind", lambda line: lose(line, 1.52, 1.521, f"{ONE_BEHIND}: restart it."), well),
        ("behind later", lambda line: lose(line, 1.8, 1.801, f"{ONE_BEHIND}: restart it."), well),
        ("withheld", attach, fails(RequestRefused("Paused by panel (pid 7)."))),
        ("withheld meanwhile", attach, fails(RequestRefused("Paused by panel (pid 7)."), 20)),
        ("gone meanwhile", attach, fails(LineLost("It is gone."), 20)),
    )  # fmt: skip
    for title, prepare, fault in cases:
        yield title
        with pytest.MonkeyPatch.context() as patch:
            line = line_of(SERIAL, fault)
            prepare(line)
            yield from examined(
                patch,
                line,
                reads=60,
                changed="Another adapter.",
                answering=[3, 4],
                port=HELD if "held" in title or "attached" in title else PORT,
            )


class Connection:
    """A second connection to a gateway, without a network, which gives a reply in two pieces."""

    def __init__(self, reply: Callable[[bytes], bytes] | None) -> None:
        self.sent: list[str] = []
        self._reply, self._pieces = reply, list[bytes]()

    async def open(self, host: str, port: int) -> tuple[Any, Any]:
        self.sent.append(f"opened {host} {port}")
        if self._reply is None:
            raise ConnectionRefusedError
        return self, self

    def write(self, data: bytes) -> None:
        self.sent.append(f"{data.hex()}")
        assert self._reply is not None
        reply = self._reply(data)
        self._pieces = [reply[:3], reply[3:]]

    async def read(self, most: int) -> bytes:
        assert most >= 256
        return self._pieces.pop(0) if self._pieces else b""

    def close(self) -> None:
        self.sent.append("closed")


def rtu_reply(data: bytes) -> bytes:
    """The reply of an RTU drive to an RTU request."""
    return frame(data[0], bytes.fromhex("03020637"))


def tcp_reply(unit: int, exception: int = 0, transaction: int = 0x44) -> Callable[[bytes], bytes]:
    """The reply of a gateway that answers one unit, by a value or an exception."""

    def reply(data: bytes) -> bytes:
        if data[6:7] != bytes([unit]):
            return b""
        body = bytes([0x83, exception]) if exception else bytes.fromhex("03020637")
        return bytes([transaction]) + data[1:4] + bytes([0, 1 + len(body), unit]) + body

    return reply


def cut_twice(line: FramedLine) -> None:
    lose(line, 0.001, 1.0)
    lose(line, 1.001)


def gateways() -> Iterator[str]:
    """Lines over a network: idle and cut connections, and what a silent gateway answers."""
    cases: tuple[tuple[str, Callable[[FramedLine], object], Fault, Any], ...] = (
        ("well", lambda _: None, well, None),
        ("idle close", lambda line: lose(line, 2.9, 3.0), well, None),
        ("lost in the reads", lambda line: lose(line, 0.3), well, None),
        ("withheld in the reads", lambda _: None,
         fails(RequestRefused("Paused by panel (pid 7)."), 20), None),
        ("opened again later", lambda line: lose(line, 4.4, 4.5), well, None),
        ("cut once", lambda line: lose(line, 0.001, 1.0), well, None),
        ("cut for long", lambda line: lose(line, 0.001, 3.2), well, rtu_reply),
        ("cut for good", lambda line: lose(line, 0.001), well, None),
        ("cut twice", cut_twice, well, None),
        ("not open", lambda line: line.become(LineStatus.LOST, "gone"), well, None),
        ("behind", lambda line: lose(line, 0.001, 0.002, f"{ONE_BEHIND}."), well, None),
        ("silent", lambda _: None, lost, None),
        ("silent, speaks RTU", lambda _: None, lost, rtu_reply),
        ("silent, speaks TCP", lambda _: None, lost, tcp_reply(DEVICE)),
        ("silent, refuses on TCP", lambda _: None, lost, tcp_reply(DEVICE, 2)),
        ("silent, no drive on TCP", lambda _: None, lost, tcp_reply(DEVICE, 11)),
        ("silent, other transaction", lambda _: None, lost, tcp_reply(DEVICE, 0, 0x45)),
        ("silent, unit 0", lambda _: None, lost, tcp_reply(0)),
        ("silent, damaged RTU", lambda _: None, lost, lambda data: broken(rtu_reply(data))),
        ("silent, other RTU", lambda _: None, lost, lambda _: frame(9, b"\x03\x02\0\1")),
        ("silent, others use it", attach, lost, rtu_reply),
        ("silent, 9 answers", lambda line: line.tally.count_reply(9, 0.1), lost, rtu_reply),
        ("silent, answered before", lambda line: line.tally.count_reply(2, 0.1), lost, rtu_reply),
        ("silent, unit 255", lambda line: line.devices.update(
            {255: type(line.devices[DEVICE])(255, registers())}), for_device(DEVICE, lost), None),
        ("no way to it", lambda _: None, refused(10), rtu_reply),
        ("it was not heard", lambda _: None, refused(11), rtu_reply),
        ("refused", lambda _: None, refused(2), rtu_reply),
        ("some not heard", lambda _: None, at_times(7, refused(11)), None),
        ("cut short", lambda _: None, at_times(5, cut_short(1)), None),
        ("cut short to a function", lambda _: None, at_times(5, cut_short(2)), None),
    )  # fmt: skip
    for title, prepare, fault, reply in cases:
        for link in (RTU, TCP, TcpLink("10.0.0.9", 502, unit=0)):
            if getattr(link, "unit", None) == 0 and "255" not in title:
                continue
            yield f"{title}, {label(link)}"
            beside = Connection(reply)
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr("asyncio.open_connection", beside.open)
                line = line_of(link, fault)
                prepare(line)
                yield from examined(patch, line, reads=60)
            yield from (f"  beside: {text}" for text in beside.sent)


def cut_short(length: int) -> Fault:
    """Replies of only so many bytes after the header of Modbus TCP."""

    def fault(_number: int, request: bytes, _reply: bytes) -> Ended:
        data = request[:6] + bytes([DEVICE, 0x83])[:length]
        return [(0.01, data, "no Modbus TCP")], WrongReply(DEVICE, 3, 0, "", data)

    return fault


def for_device(device: int, fault: Fault) -> Fault:
    """A fault of the requests to one device."""

    def chosen(number: int, request: bytes, reply: bytes) -> Ended:
        return (fault if request[6] == device else well)(number, request, reply)

    return chosen


def errors() -> Iterator[str]:
    """The evidence from the results of requests alone."""
    requested = bytes([DEVICE, 3, 0, 0, 0, 1])
    single: tuple[LineError | None, ...] = (
        None, DeviceException(DEVICE, 3, 0, 2), DeviceException(DEVICE, 3, 0, 11),
        ChecksumFault(DEVICE, 3, 0), ChecksumFault(DEVICE, 3, 0, "", requested),
        ChecksumFault(DEVICE, 3, 0, "", b"\2\x83\2"), ChecksumFault(DEVICE, 3, 0, "", b"\0" * 5),
        ChecksumFault(DEVICE, 4, 0, "", b"\0" * 5), ChecksumFault(DEVICE, 43, 0, "", b"\0" * 5),
        WrongReply(DEVICE, 3, 0, "", frame(9, b"\3\2\0\1")), WrongReply(DEVICE, 3, 0, ""),
        WrongReply(DEVICE, 3, 0, "", frame(DEVICE, b"\4\2\0\1")),
        WrongReply(DEVICE, 3, 0, "", frame(DEVICE, b"\3\4\0\1\0\1")),
        WrongReply(DEVICE, 3, 0, "", b"\x09\4\0"), WrongReply(DEVICE, 3, 0, "", b"\x09"),
        NoAnswer(DEVICE, 3, 0), NoAnswer(DEVICE, 3, 0, "Only an echo came."),
        BytesSwapped(DEVICE, ["ACC"]), LineLost("gone"),
    )  # fmt: skip
    for outcome in single:
        for outcomes in ([outcome], [None, outcome, outcome]):
            yield f"{outcome}: {filled(evidence_of_errors(outcomes, DEVICE))}"


def counter_watches() -> Iterator[str]:
    """Counters of drives compared with the line's, over several readings."""
    for family, fault in product(("atv71", "atv312", "powerdrive"), (well, at_times(3, lost))):
        line = line_of(SERIAL, fault, registers(family))
        line.tally.count_sent(DEVICE, 8)
        line.hear("in", SLAVE, STRAY)
        watch = CounterWatch(DriveSession(line, DEVICE, library.load(family), clock=line.time))
        yield f"{family}: {watch.has_diagnostics} {watch.can_reset_drive} {watch.counted_by!r}"
        with tempfile.TemporaryDirectory() as folder:
            yield from asyncio.run(counted_watch(watch, line, Journal(Path(folder))))


async def counted_watch(watch: CounterWatch, line: FramedLine, journal: Journal) -> list[str]:
    """Each reading of both sides, while the drive counts more or less than was sent."""
    found: list[str] = []

    def note(title: str) -> None:
        now = watch.now()
        found.append(f"  {title}: {now.agree} {now.agreeing} {now.trouble}")
        loads = [load and round(load, 3) for load in (now.line_load, now.device_load)]
        found.append(f"    {now.seconds:.2f} s, {loads}, {now.counted_by!r}")
        found.extend(f"    {each.kind} {each.count}: {each.text}" for each in now.differences)
        found.extend(f"    {name}: {comparison}" for name, comparison in now.drive)
        counts = (now.total, now.since)
        found.extend(f"    {c.requests} {c.replies} {c.timeouts}" for c in counts)
        found.append(f"    {'; '.join(line.sent)}")
        line.sent.clear()

    note("first")
    for frames, damaged in ((100, 5), (112, 5), (118, 6), (900, 6), (3, 0), (9, 0)):
        line.diagnosed = {0x0C: damaged, 0x0E: frames}
        await watch.look()
        found.append(f"  echoes {await watch.echo(4)}")
        note(f"{frames} {damaged}")
    line.hear("in", SLAVE, STRAY)
    line.tally.stale += 2
    note("strays")
    attach(line)
    await watch.look()
    note("attached")
    watch.reset_ours()
    note("reset")
    try:
        await watch.reset_drive(journal)
    except LineError as error:
        found.append(f"  {type(error).__name__}: {error}")
    note("reset there")
    for entry in journal.sent:
        found.append(f"  {entry.code} {entry.address} {entry.new} {entry.answer} {entry.why}")
        found.append(f"  {entry.kind} {entry.old_raw} {entry.old!r} {entry.new_raw} {entry.line}")
    line.read_only = True
    found.append(f"  {watch.can_reset_drive}")
    line.become(LineStatus.LOST, "cut")
    await watch.look()
    note("cut")
    journal.close()
    return found


SECTIONS = (faults, drives, serial_lines, gateways, errors, counter_watches)


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_examinations_find_and_send_what_is_recorded(
    section: Callable[[], Iterator[str]],
) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
