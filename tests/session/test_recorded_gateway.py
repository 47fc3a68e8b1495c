"""Requests of clients to a gateway: replies, frames, journal and notices, as recorded text.

`recorded_gateway.txt` has a section for each subject. Each entry names the case.
"""

from __future__ import annotations

import asyncio
import logging
import tempfile
from collections.abc import Awaitable, Callable, Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any

import pytest

from tests.recorded import result, sections
from tui.bus.errors import ChecksumFault, LineBusy, LineLost, NoAnswer, RequestRefused, WrongReply
from tui.bus.fake import FakeLine
from tui.bus.gateway.server import TcpRequest
from tui.bus.gateway.talk import TcpClient
from tui.bus.line_events import (
    ControlDenied,
    ControlRequested,
    DevicesStopped,
    LineEvent,
    NoticeReceived,
)
from tui.bus.link import SerialLink
from tui.bus.model import LineStatus, Priority, Reply
from tui.bus.program import Program
from tui.bus.requests import Request
from tui.drive.profile import library
from tui.session.gateway import drives, resting, started, writes
from tui.session.gateway.gateway import Gateway, exception_of
from tui.session.gateway.line import GatewayLine
from tui.session.gateway.rules import GatewayRules, allowed_codes, as_written, unit_map
from tui.session.journal import Journal

TEXTS = Path(__file__).parent / "recorded_gateway.txt"
PANEL = Program("panel's id", "panel", 4711)
ALL = GatewayRules(0.0, frozenset({"all"}), commands=True)
RULES = {
    "none": GatewayRules(), "ACC": GatewayRules(5.0, frozenset({"ACC"})),
    "commands": GatewayRules(commands=True), "all": ALL,
}  # fmt: skip
FAMILIES = {1: "atv71", 2: "atv312", 4: "powerdrive"}
IDENTITIES = {1: b"ATV71HU15M3", 2: b"ATV312HU09M3", 3: b"X9"}
HELD = {"CHCF": 1, "ETA": 0x0237, "LAC": 2}


BESIDE = ("identify", "chart", "standstill", "resting", "question")
"""Tasks that work beside a request, by the beginning of their names."""


class GatewayLineFake(FakeLine):
    """A fake line that keeps each request with its priority; those of other tasks apart."""

    def __init__(self) -> None:
        super().__init__({}, link=SerialLink("/dev/ttyUSB9"))
        self.sent: list[str] = []
        self.beside: list[str] = []
        self._how = ""

    async def read(self, device: int, address: int, count: int = 1, **how: Any) -> Reply:
        self._how = f"{how.get('priority', Priority.POLL).name} {how.get('max_age', 0.0)}"
        return await super().read(device, address, count, **how)

    async def write(self, device: int, address: int, values: Sequence[int], **how: Any) -> float:
        self._how = f"{how['priority'].name} {how.get('multiple')}"
        return await super().write(device, address, values, **how)

    async def _exchange(self, request: Request, *rest: Any) -> Any:
        task = asyncio.current_task()
        is_beside = task is not None and task.get_name().startswith(BESIDE)
        (self.beside if is_beside else self.sent).append(f"{request} {self._how}")
        self._how = ""
        return await super()._exchange(request, *rest)


def several_drives() -> GatewayLineFake:
    """A line with drives of three families, and one of none."""
    line = GatewayLineFake()
    for device in (1, 2, 3, 4):
        profile = library.load(FAMILIES.get(device, "atv71"))
        words = {p.address + n: 3 for p in profile.parameters for n in range(2)}
        known = {p.code: p.address for p in profile.parameters}
        words.update({known[code]: raw for code, raw in HELD.items() if code in known})
        made = FakeLine({device: words})
        line.devices[device] = made.devices[device]
        if device in IDENTITIES:
            line.devices[device].identity = {0: b"Maker", 1: IDENTITIES[device], 2: b"0201"}
    return line


class GatewayBench:
    """A gateway on such a line, with its effects as text."""

    def __init__(self, folder: Path, rules: GatewayRules = ALL, **named: Any) -> None:
        self.line = several_drives()
        self.journal = Journal(folder)
        self.notes: list[str] = []
        gate = GatewayLine(self.line, self.journal, self._note, **named)
        self.gate = gate
        self.gateway = Gateway([gate], unit_map(1, ()), rules)
        self.line.facts.events.subscribe(self._hear)
        self.clients = {n: TcpClient(n, f"10.0.0.{n}:5000", f"10.0.0.{n}") for n in (1, 2)}
        self._entries = 0

    def _note(self, device: int, identity: Any, profile: str) -> None:
        self.notes.append(f"{device} is {identity and identity.reference} {profile}")

    def _hear(self, event: LineEvent) -> None:
        if isinstance(event, NoticeReceived):
            self.notes.append(f"{event.device}: {event.text}")

    def request(self, text: str, client: int = 1, **how: Any) -> Any:
        """A request by its unit and the bytes of its function and data."""
        unit, _, data = text.partition(":")
        request = TcpRequest(self.clients[client], int(unit), bytes.fromhex(data), **how)
        return self.gateway.answer(request)

    async def ask(self, text: str, client: int = 1, **how: Any) -> str:
        """The reply, and all that the request has caused."""
        reply = await self.request(text, client, **how)
        await self.settled()
        return f"{text} of {client}: {reply.hex(' ')}{self.effects()}"

    async def settled(self) -> None:
        """Wait until identifications and questions have ended, and other tasks wait."""
        for _ in range(5):
            await asyncio.sleep(0)
        for name in ("identify", "chart", "question"):
            work = [task for task in asyncio.all_tasks() if task.get_name().startswith(name)]
            await asyncio.gather(*work, return_exceptions=True)
        for _ in range(5):
            await asyncio.sleep(0)

    def effects(self) -> str:
        """Frames, entries of the journal, and notices since the last call."""
        entries = self.journal.sent
        new, self._entries = entries[self._entries :], len(entries)
        found = [*self.line.sent, *(f"beside: {text}" for text in sorted(self.line.beside))]
        self.line.sent.clear()
        self.line.beside.clear()
        found += [
            f"journal {e.device} {e.profile} {e.code} {e.address} {e.old_raw} {e.old!r} {e.new_raw}"
            f" {e.new!r} {e.answer!r} {e.read_back} {e.why!r} {e.kind} {e.eeprom}"
            for e in new
        ]
        found += self.notes
        self.notes.clear()
        facts = self.line.facts
        commanded = {d: bool(facts.commander(d)) for d in (1, 2) if d in facts.commanders}
        held = [device for device in (1, 2) if self.gate.started.holds(device)]
        if commanded or held:
            found.append(f"commanded {sorted(commanded)}, started {held}")
        return "".join(f"\n    {text}" for text in found)


def carried_out(script: Callable[[GatewayBench], Awaitable[list[str]]], **how: Any) -> list[str]:
    """The texts of a script on a new gateway."""
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setenv("DRIVEPANEL_STATE", f"{folder}/state")
        for module, name in (
            (started, "STANDSTILL_LOOK"), (resting, "UNKNOWN_TIMEOUT"), (drives, "CHART_READ_EACH"),
            (drives, "WHO_AGAIN_AFTER"), (writes, "JUST_READ"),
        ):  # fmt: skip
            patch.setattr(module, name, 1e6)  # however slow this computer is

        async def work() -> list[str]:
            bench = GatewayBench(Path(folder), **how)
            try:
                return await script(bench)
            finally:
                await bench.gateway.close()
                bench.journal.close()

        logging.disable(logging.CRITICAL)
        try:
            return asyncio.run(work())
        finally:
            logging.disable(logging.NOTSET)


REQUESTS = (
    "1:030c810001", "1:03ffff0001", "1:0408130001", "1:0100000001", "1:030813007e", "1:0308130000",
    "1:0308", "9:030c810001", "250:030c810001", "3:030c810001", "3:0408130001", "4:04040f0001",
    "1:2b0e0100", "1:2b0e0302", "1:2b0e0402", "1:2b0e0500", "1:2b0d0100", "3:2b0e0100",
    "4:2b0e0100", "9:2b0e0100", "1:08000012a5", "1:080000a55a", "1:08000a0000", "1:08000c0000",
    "1:0800040000", "2:080000a55a", "3:080000a55a", "1:1600010002000300", "1:6400",
    "1:0623290020", "1:062329ffff", "1:0600010001", "1:0621350000", "1:0621350006",
    "1:062135000f", "1:0621360064", "1:10232900020400200021", "1:102135000204000f0064",
    "1:1021350002040000 0064", "1:102136000204006423290000", "1:170c8100012135000102 0006",
    "1:170c8100012329000102 0020", "1:170c81000123290001020020ff", "1:0500010000", "1:0500010001",
    "1:0f000100030105", "2:0621350000", "2:062135000f", "2:0623290020", "3:0621350000",
    "3:0623290020", "4:0604000000", "4:0604000001", "4:06040f0000", "9:0621350000",
)  # fmt: skip
"""Each with its unit, as bytes from the function on."""


def requests() -> Iterator[str]:
    """One request of a client each, with each kind of permission."""
    for name, rules in RULES.items():
        written = [text for text in REQUESTS if int(text.partition(":")[2][:2], 16) in WRITES]
        texts = REQUESTS if name == "none" else written

        async def script(bench: GatewayBench, texts: Sequence[str] = texts) -> list[str]:
            return [await bench.ask(text) for text in texts]

        yield name
        yield from carried_out(script, rules=rules)


WRITES = (5, 6, 15, 16, 23)
READ, RUN, STOP, SHUT = "1:030c810001", "1:062135000f", "1:0621350000", "1:0621350006"
RAMP, OTHER_DRIVE = "1:0623290020", "2:062135000f"


async def several_clients(bench: GatewayBench) -> list[str]:
    """Two clients command, stop, and leave."""
    found = [await bench.ask(text, client) for text, client in (
        (READ, 1), (RUN, 1), (RUN, 1), (RAMP, 2), (RUN, 2), (STOP, 1), (RUN, 1), (RUN, 2),
        (STOP, 2), (RUN, 2), (SHUT, 2), (OTHER_DRIVE, 1), (RUN, 2),
    )]  # fmt: skip
    bench.gateway.gone(bench.clients[2])
    found.append(f"2 has left{bench.effects()}")
    return [*found, await bench.ask(RUN, 1), await bench.ask(STOP, 1)]


async def stopped_by_others(bench: GatewayBench) -> list[str]:
    """Other programs stop, command, or request the drive of a client."""
    found = [await bench.ask(RUN)]
    events, facts = bench.line.facts.events, bench.line.facts
    events.emit(DevicesStopped((1,), "Esc", PANEL))
    found += [f"stopped{bench.effects()}", await bench.ask(RUN), await bench.ask(RAMP)]
    found += [await bench.ask(STOP), await bench.ask(RUN)]
    events.emit(ControlDenied(1, "It is commanded by panel (pid 4711)."))
    found += [f"denied{bench.effects()}", await bench.ask(RUN)]
    for state in (0x0237, 0x0231):
        bench.line.devices[1].words[3201] = state
        events.emit(ControlRequested(1, PANEL))
        await bench.settled()
        found.append(f"requested at {state:04X}{bench.effects()}")
    bench.line.fail_read(1, None, NoAnswer(1, 3, 3201), times=1)
    events.emit(ControlRequested(1, PANEL))
    await bench.settled()
    found.append(f"requested while silent{bench.effects()}")
    facts.set_programs((facts.me, PANEL))
    facts.note_commander(1, PANEL.id)
    found += [await bench.ask(RUN), await bench.ask(RAMP), await bench.ask(STOP)]
    facts.paused = {1: (PANEL.id, "It is maintained.")}
    return [*found, await bench.ask(READ), await bench.ask(RAMP)]


async def old_requests(bench: GatewayBench) -> list[str]:
    """Requests that waited, whose client has left, or that a stop overtakes."""
    found = [await bench.ask(text, stale=True) for text in (READ, RUN, RAMP, STOP)]
    waiting = [bench.request(text) for text in (RUN, RAMP, STOP, RAMP)]
    replies = [(await each).hex(" ") for each in waiting]
    found.append(f"in turn {replies}{bench.effects()}")
    waiting = [bench.request(RAMP), bench.request(RUN)]
    bench.line.facts.give_stop([1], "Esc")
    replies = [(await each).hex(" ") for each in waiting]
    found.append(f"stopped before {replies}{bench.effects()}")
    bench.clients[1].left = True
    return [*found, *[await bench.ask(text) for text in (RAMP, RUN, STOP)]]


async def failing_line(bench: GatewayBench) -> list[str]:
    """Errors of the line and of the drive."""
    found = [await bench.ask(READ)]
    errors: tuple[Any, ...] = (
        4, 6, NoAnswer(1, 6, 9001), ChecksumFault(1, 6, 9001), WrongReply(1, 6, 9001),
        RequestRefused("beyond its limits"), LineBusy("full"), LineLost("cut"),
    )  # fmt: skip
    for error in errors:
        for address in (9001, 8501):
            bench.line.fail_write(1, address, error, times=1)
        for address in (9001, 3201, 3201):
            bench.line.fail_read(1, address, error, times=1)
        texts = [await bench.ask(text) for text in (READ, RAMP, STOP, RUN)]
        found += [f"{error}", *texts]
        for address in (9001, 3201, 3201):
            bench.line.fail_read(1, address, error, times=0)
    bench.line.read_only = True
    found += [await bench.ask(text) for text in (RAMP, STOP)]
    bench.line.read_only, bench.line.held = False, "Another adapter."
    found += [await bench.ask(text) for text in (RAMP, STOP)]
    bench.line.held = ""
    bench.line.become(LineStatus.LOST, "cut")
    found += [await bench.ask(text) for text in (READ, STOP)]
    bench.line.become(LineStatus.CONNECTED)
    bench.line.devices[1].identity = {1: b"ATV312HU09M3"}
    return [*found, *[await bench.ask(text) for text in (READ, RAMP, STOP, RUN)]]


async def swapped_bytes(bench: GatewayBench) -> list[str]:
    """A drive whose bytes arrive swapped, and one that does not identify itself any more."""
    words = bench.line.devices[1].words
    bench.line.devices[1].words = {address: raw << 8 & 0xFFFF for address, raw in words.items()}
    found = [await bench.ask(text) for text in (READ, RAMP, RUN, STOP)]
    bench.line.devices[2].identity = None
    return [*found, *[await bench.ask(text) for text in ("2:0623290020", "2:0621350000")]]


def scripts() -> Iterator[str]:
    """Several requests, one after another, and events of the line between them."""
    for script in (several_clients, stopped_by_others, old_requests, failing_line, swapped_bytes):
        yield script.__name__
        yield from carried_out(script)
    yield "named profiles"
    for profile in ("atv71", "atv312", "powerdrive"):

        async def named(bench: GatewayBench) -> list[str]:
            return [await bench.ask(text) for text in ("4:0304000001", "4:0604000000", RAMP, STOP)]

        yield from carried_out(named, profiles={1: profile, 4: profile})


def rules() -> Iterator[str]:
    """Typed codes and maps of units."""
    for text in ("ACC, dec,", "ALL", "all,ACC", " ", "", "Hsp,none"):
        yield f"{text!r}: {result(lambda text=text: sorted(allowed_codes(text)))}"
        if text.strip():
            found = result(lambda text=text: sorted(as_written(allowed_codes(text))))
            yield f"  {found}"
    texts = ("1-31=1", "101-131=2@1", "5=1", "5=1@247", "5-6=1@247", "0-3=1", "250-255=2@240",
             "250-256=1", "3-2=1", "5=3", "5=0", "x", "5=1@0", " 7=2 ", "255=1@1")  # fmt: skip
    for lines, text in product((1, 2), texts):
        yield f"{lines} {text!r}: {result(unit_map, lines, [text])}"
    yield result(unit_map, 2, [])
    yield result(unit_map, 2, ["1-3=1", "3=2"])
    units = unit_map(1, ())
    yield f"{len(units)} {units[1]} {units[247]}"
    for error in (NoAnswer(1, 3, 0), LineBusy("full"), LineLost("cut"), ChecksumFault(1, 3, 0)):
        yield f"{type(error).__name__}: {exception_of(error)}"


SECTIONS = (requests, scripts, rules)


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_gateway_sends_and_records_what_is_recorded(section: Callable[[], Iterator[str]]) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
