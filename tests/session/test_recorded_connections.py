"""Identifications, searches, and stored facts of lines, in many cases, as recorded text.

`recorded_connections.txt` has a section for each subject. Each entry names the case.
"""

from __future__ import annotations

import asyncio
import os
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import msgspec
import pytest

from tests.adapters import Adapters
from tests.drive.test_whole_values import whole
from tests.recorded import filled, sections
from tests.session.framed_line import BEGUN, FramedLine, Piece, well
from tui.bus.errors import (
    ChecksumFault,
    DeviceException,
    LineError,
    LineLost,
    NoAnswer,
    RequestRefused,
    WrongReply,
)
from tui.bus.fake import FakeLine
from tui.bus.fake_device import FakeDevice
from tui.bus.link import Link, RtuTcpLink, SerialLink, TcpLink
from tui.bus.model import LineStatus, Priority
from tui.bus.schedule.pace import Pace
from tui.bus.trace import Frame
from tui.drive.finding import LineSetting, PresenceProbe
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.session.connect import line_key, named_lines
from tui.session.connect.address_prober import probers_of, settings_worth_a_try
from tui.session.connect.contradiction import contradiction, own_words
from tui.session.connect.identify import DriveIdentity, find_drive, identify_drive
from tui.session.connect.known_line import KnownLine
from tui.session.connect.known_lines import load_memory, remembered_text
from tui.session.connect.limits import limits_of
from tui.session.connect.other_masters import MasterDetector, OtherMaster, listen_first
from tui.session.connect.port_settings import last_settings, port_of, with_last_settings
from tui.session.connect.scan_estimate import scan_estimate
from tui.session.connect.search import Search
from tui.wire.frames import frame

TEXTS = Path(__file__).parent / "recorded_connections.txt"
SERIAL = SerialLink("/dev/ttyUSB9", 19200, "8E1")
DEVICE, STATUS = 2, 1039
PROBES = (PresenceProbe(STATUS, ("powerdrive", "varmeca")), PresenceProbe(None))
ERRORS: dict[str, Callable[[], LineError]] = {
    "l": lambda: NoAnswer(DEVICE, 43, 0), "d": lambda: ChecksumFault(DEVICE, 43, 0),
    "f": lambda: WrongReply(DEVICE, 43, 0), "x": lambda: DeviceException(DEVICE, 43, 0, 1),
    "r": lambda: RequestRefused("beyond its limits"), "c": lambda: LineLost("cut"),
}  # fmt: skip
"""By a letter of a pattern: the result of one request; `w` is its reply."""


class Patterned:
    """Gives each request the result of the next letter; after the last one, replies."""

    def __init__(self, pattern: str) -> None:
        self._left = list(pattern)

    def __call__(self, number: int, request: bytes, reply: bytes) -> Any:
        letter = self._left.pop(0) if self._left else "w"
        if letter == "w":
            return well(number, request, reply)
        pieces: list[Piece] = [(0.01, request[:3], "damaged")] if letter == "d" else []
        return pieces, ERRORS[letter]()


def drive(kind: str) -> FakeDevice:
    """A drive by how it identifies itself."""
    there = FakeDevice(DEVICE, {})
    match kind:
        case "named":
            there.identity = {0: b"Telemecanique\0", 1: b" ATV71HU15M3", 2: b"0201", 6: b"P\x1b["}
            there.words = {STATUS: 1}
        case "unknown":
            there.identity = {0: b"Else", 1: b"X9"}
        case "called":
            there.called = b"ATV312HU09M3"
        case "called oddly":
            there.called = b"\x01\x02"
        case "status only":
            there.words = {STATUS: 1}
    return there


def result_of(runner: asyncio.Runner, line: FramedLine, call: Callable[[Any], Any]) -> str:
    """The result of a call or its error, what was sent, and the time."""
    try:
        found = runner.run(call(line))
    except LineError as error:
        result = f"{type(error).__name__}: {error}"
    else:
        result = filled(found)
    sent = [text.replace(f" of {DEVICE} ", " ") for text in line.sent]
    return f"{result} | {'; '.join(sent)} | {line.time.now - BEGUN:.2f} s"


def identities() -> Iterator[str]:
    """Each way to identify a drive, with requests that are lost or damaged."""
    with asyncio.Runner() as runner:
        yield from identified(runner)


def identified(runner: asyncio.Runner) -> Iterator[str]:
    operator, background = Priority.OPERATOR_READ, Priority.BACKGROUND
    calls: tuple[tuple[str, Callable[[Any], Any]], ...] = (
        ("identify", lambda line: identify_drive(line, DEVICE)),
        ("brief", lambda line: identify_drive(line, DEVICE, brief=True)),
        ("background", lambda line: identify_drive(line, DEVICE, priority=background)),
        ("find", lambda line: find_drive(line, DEVICE, PROBES, priority=background, within=0.02,
                                         patience=0.05)),
        ("find by its identity", lambda line: find_drive(
            line, DEVICE, PROBES[::-1], priority=operator, within=None)),
        ("own words, atv71", lambda line: own_words(line, DEVICE, library.load("atv71"))),
        ("own words, powerdrive", lambda line: own_words(line, DEVICE, library.load("powerdrive"))),
    )  # fmt: skip
    patterns = ("", "l", "ll", "lll", "d", "ddd", "f", "lwd", "x", "xd", "r", "wll", "wdw", "wlwlw",
                "wlll", "dl", "c")  # fmt: skip
    kinds = ("named", "unknown", "called", "called oddly", "status only", "mute")
    for kind, (name, call) in product(kinds, calls):
        is_short = kind not in ("named", "status only") or name in ("brief", "background")
        for pattern in patterns[:6] if is_short else patterns:
            line = FramedLine(SERIAL, {}, Patterned(pattern))
            line.devices[DEVICE] = drive(kind)
            yield f"{kind}, {name}, {pattern}: {result_of(runner, line, call)}"
    for minute in ("damaged", "foreign", "strays", "lost"):
        line = FramedLine(SERIAL, {}, Patterned("wlwlwlw"))
        line.devices[DEVICE] = drive("status only")
        line.tally.count_minute(None, minute)
        yield f"status only after {minute}: {result_of(runner, line, calls[3][1])}"


def contradictions() -> Iterator[str]:
    """Differences of each kind of identity from each profile."""
    profiles = (whole(), *map(library.load, ("atv71", "atv312", "powerdrive")))
    plain = DriveIdentity(DEVICE, "", "", "", "", None, ())
    references = ("", "ATV71HU15M3", "ATV312HU09M3", "ATV", "A", "X9", "EXFAN-22", "EXF", "exfan")
    identities_: list[DriveIdentity | None] = [None]
    for reference in references:
        fits = tuple(library.matching_profiles(reference)) if reference else ()
        identities_.append(replace(plain, reference=reference, candidates=fits))
    identities_ += [
        replace(plain, candidates=("atv312",)), replace(plain, denied="NCV 3, not 7"),
        replace(plain, profile="atv312", candidates=("atv312",)),
        replace(plain, profile="gone", candidates=("gone",), reference="Y"),
    ]  # fmt: skip
    for profile, identity in product(profiles, identities_):
        shown = filled(identity) if identity is not None else "none"
        yield f"{profile.id}, {shown}: {contradiction(identity, profile)}"


def limits() -> Iterator[str]:
    """The requests that each family allows."""
    names = ("atv71", "atv312", "atv21", "powerdrive", "varmeca", "lexium32")
    known = {listing.id for listing in library.listings()}
    profiles = [whole(), *(library.load(name) for name in names if name in known)]
    for profile in (*profiles, edited(whole())):
        found = limits_of(profile)
        yield f"{profile.id}: {filled(found)}"
    links: tuple[Link, ...] = (
        SERIAL, SerialLink("/dev/x", 300, "8N2"), SerialLink("/dev/x", timeout=0.7),
        TcpLink("h"), RtuTcpLink("h", 1),
    )  # fmt: skip
    for link, wait, patient in product(links, (0.4, 1.0), (False, True)):
        prober = probers_of(link, wait, patient=patient)
        probes = [(probe.register, probe.families) for probe in prober.probes]
        within = None if prober.within is None else round(prober.within, 5)
        yield f"{link} {wait} {patient}: {within} {prober.patience:.5f} {prober.cost:.5f}"
        yield f"  {probes}"
    setting = LineSetting(19200, "8O2")
    yield f"{[f'{each}' for each in settings_worth_a_try(setting)]}"
    worth = settings_worth_a_try(setting, parity=False)
    yield f"{[f'{each}' for each in worth]}"
    for patient in (False, True):
        estimate = scan_estimate(SERIAL, 0.4, worth[:5], 31, patient=patient)
        shown = {f"{each}": round(seconds, 4) for each, seconds in estimate.each.items()}
        yield f"{shown} {estimate.seconds(worth[:7]):.2f}"
        yield estimate.before_slow(worth[3:6], "Esc")


def edited(profile: Profile) -> Profile:
    """The profile with a drive that allows little."""
    return Profile(msgspec.structs.replace(
        profile.data, exceptions=[], blocks=[],
        functions=[each for each in profile.data.functions if each.code == 43],
    ))  # fmt: skip


def keys() -> Iterator[str]:
    """Lines in several spellings: their keys, and the last settings of their ports."""
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        machine = Adapters(Path(folder, "machine"))
        machine.use(patch)
        patch.chdir(folder)
        first = machine.plug("ttyUSB0", "1-1", serial="A5")
        second = machine.plug("ttyUSB1", "1-2")
        hosts = Path(folder, "hosts")
        hosts.write_text(
            "# none\n10.0.0.9 Gate gate.local # its name\n::1 six six.local\nfe80::2 both\n"
            "10.0.0.7 BOTH both. \n10.0.0.8 both\n\nlonely\n", "utf-8",
        )  # fmt: skip
        patch.setattr(line_key, "HOSTS", hosts)
        texts = (
            first, f"serial:{first},9600,8N1", f"{first} 19200 8E1", f"{first} 9600 8n2 timeout=2",
            second, "COM3", r"\\.\com4", "/dev/none", "tcp:gate", "TCP:GATE.:502", "tcp:10.0.0.9",
            "tcp:10.9", "tcp:six", "tcp:[::1]:503", "tcp:both", "tcp:gate,unit=255",
            "tcp:::ffff:10.0.0.9", "tcp:lonely", "tcp:other", "rtu-tcp:gate:1", "rtu-tcp:[::1]:2",
            "sim:atv71@2,atv312@1", "SIM:atv312@1,atv71@2", "sim:atv71", "sim:none", "not a line,,",
            f"replay:{folder}/x.db,at=12:00", f"REPLAY:{folder}/./x.db", " tcp:gate ", "",
        )  # fmt: skip
        for text in texts:
            found = line_key.line_key(text), remembered_text(text), port_of(text)
            yield hidden(f"{text}: {found}", folder)
        recent = [f"serial:{first},9600,8N1,timeout=3", second, f"serial:{first},4800,8O1",
                  "tcp:gate", "sim:atv71"]  # fmt: skip
        yield hidden(f"{last_settings(recent)}", folder)
        for text in (first, f"serial:{first},19200", f"serial:{first},9601,8N2", f"{first},8E1",
                     f"serial:{first},timeout=9", second, "tcp:gate", "/dev/none", "sim:atv71",
                     f"serial:{first},19200,8E1", f"serial:{first},8N2"):  # fmt: skip
            yield hidden(f"{text}: {with_last_settings(text, recent)}", folder)
        hosts.unlink()
        yield line_key.host_key("gate")


def hidden(text: str, folder: str) -> str:
    """The text without a temporary folder."""
    return text.replace(os.path.realpath(folder), "FOLDER").replace(folder, "FOLDER")


def known_lines() -> Iterator[str]:
    """One line after another at one computer: differences, held writes, and what is stored."""
    pump = DriveIdentity(2, "Tele", "ATV71HU15M3", "0201", "PUMP", "atv71", ("atv71",))
    fan = replace(pump, reference="ATV71HD22N4", name="FAN\x1b[2J")
    newer, nameless = (
        replace(pump, version="0301"),
        replace(pump, vendor="", reference="", version="", name="", profile=None),
    )
    long = replace(pump, device=9, vendor="V" * 300, reference="", name="")
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setenv("DRIVEPANEL_STATE", f"{folder}/state")
        machine = Adapters(Path(folder, "machine"))
        machine.use(patch)
        port = machine.plug("ttyUSB0", "1-1", serial="A5")
        steps: tuple[tuple[str, Callable[[], object], Any, tuple[Any, ...]], ...] = (
            ("first", lambda: None, port, ((pump, 2, ""), (nameless, 3, ""), (None, 4, "atv312"))),
            ("the same", lambda: None, port, ((pump, 2, "atv71"), (nameless, 3, "atv71"))),
            ("without a name", lambda: None, port, ((nameless, 2, "atv71"), (None, 2, ""))),
            ("others", lambda: None, port, ((fan, 2, ""), (None, 4, "atv71"), (pump, 5, ""))),
            ("another version", lambda: None, port, ((newer, 2, ""), (pump, 2, ""))),
            ("long texts", lambda: None, port, ((long, 9, ""),)),
            ("other adapter", lambda: machine.plug("ttyUSB0", "1-2", serial="B6"), port,
             ((pump, 2, ""), (fan, 6, ""))),
            ("no name of its own", lambda: machine.plug("ttyUSB2", "1-3"), machine.port("ttyUSB2"),
             ((pump, 2, ""),)),
            ("same socket", lambda: machine.plug("ttyUSB2", "1-3", product="6015"),
             machine.port("ttyUSB2"), ((pump, 2, ""),)),
            ("a gateway", lambda: None, TcpLink("10.0.0.9"), ((fan, 2, ""),)),
            ("a terminal", lambda: None, "/dev/pts/7", ((fan, 2, ""),)),
        )  # fmt: skip
        for title, change, at, drives in steps:
            change()
            for accepts in (
                ((), ("once",), ("all",)) if title in ("others", "other adapter") else ((),)
            ):
                line = FakeLine({}, link=SerialLink(at) if isinstance(at, str) else at)
                known = KnownLine(line, way="Look.")
                yield hidden(f"  at first {load_memory().names} {len(load_memory().lines)}", folder)
                if accepts == ("all",):
                    known.accept(all_that_comes=True)
                for identity, device, profile in drives:
                    known.note(identity, device, profile)
                if accepts == ("once",):
                    known.accept()
                    known.note(fan, 7, "")
                yield hidden(f"{title} {accepts}: {known.changed}\n  {line.held}", folder)
                yield hidden(f"  {load_memory()}", folder)


SETTINGS = (
    "[lines]\na = 'tcp:h'\nB-1 = 'tcp:g'\nb-1 = 'tcp:f'\n1a = 'tcp:e'\nfactory = 'tcp:d'\nc = 3\n"
    "d = ' '\ne = 'a'\ncom3 = 'tcp:h'\n",
    "[lines.a]\nline = ' tcp:h '\ndevice = 247\nprofile = ' ATV71 '\n[lines.b]\ndevice = 0\n"
    "[lines.c]\nline = 'tcp:h'\ndevice = 248\n[lines.d]\nline = 'x y'\ndevice = true\n"
    "[lines.e]\nline = 'tcp:h'\nprofile = ''\n[lines.f]\nline = 'tcp:h'\nother = 1\n"
    "[lines.g]\nline = 'tcp:h'\nprofile = 'atv312'\n[lines.h]\nline = 'tcp:i'\ndevice = 5\n"
    "profile = 'atv21'\n",
    "[record]\non = false\nx = 1\n[report]\ncompany = 'C'\nname = 3\nother = 'x'\ncustomer = '"
    + "x" * 60 + "'\ncustomer_name = '" + "x" * 61 + "'\n[more]\n",
    "record = 1\nreport = 2\nlines = 3\n", "[record]\non = 'no'\n", "[record]\non = true\n",
    "lines = [1]\n", "[lines]\nx = \n",
    "[lines]\n" + "\n".join(f"n{n} = 'tcp:h'" for n in range(203)),
    "[lines]\na = 'tcp:h' 'x'\nb = { line = 'tcp:g', device = 5 }\n[lines.c]\nline = \"tcp:f\"\n"
    "device = 7\nprofile = 'atv71'\n[ \"d\" ]\nline = 'tcp:e'\ndevice = x\n[more]\na = 'tcp:z'\n",
    "lines.a = 'tcp:h\nlines.b = 'tcp:i'\nlines.c = { line = 'tcp:j', device = 300 }\n",
)  # fmt: skip


def settings() -> Iterator[str]:
    """Files of settings, right and damaged: lines, faults, and the line of a stop."""
    with tempfile.TemporaryDirectory() as folder, pytest.MonkeyPatch.context() as patch:
        patch.setenv("DRIVEPANEL_CONFIG", folder)
        patch.chdir(folder)
        path = named_lines.settings_file()
        yield hidden(f"{path} {named_lines.line_settings()}", folder)
        path.parent.mkdir(parents=True, exist_ok=True)
        for number, text in enumerate(SETTINGS):
            path.write_text(text, "utf-8")
            named_lines._read.cache_clear()
            found = named_lines.line_settings()
            names = list(found.lines.values())
            yield f"file {number}: {len(names)} {found.record} {found.names}"
            yield from (f"  {named}" for named in names[:9])
            yield from (hidden(f"  {fault}", folder) for fault in found.faults)
            yield hidden(f"  {list(found.places.items())[:9]}", folder)
            for name in ("a", "A", "b", "c", "d", "b-1", "factory", "tcp:h", "none"):
                for each in (named_lines.line_named, named_lines.line_to_stop):
                    try:
                        yield f"  {name}: {each(name)}"
                    except named_lines.SettingsError as error:
                        yield hidden(f"  {name}: {error}", folder)
            for key, device in product(("tcp:h:502", "tcp:i:502"), (5, 247)):
                yield f"  {key} {device}: {named_lines.profile_named(key, device)}"
                yield f"  {named_lines.profiles_of_line(key)}"


def masters() -> Iterator[str]:
    """A line that is listened to before the first request, and frames during a search."""
    read, other = frame(7, bytes.fromhex("030C810001")), frame(9, bytes.fromhex("030C810002"))
    reply = frame(7, bytes.fromhex("03020637"))
    late = "late or repeated"
    pieces: tuple[tuple[str, list[tuple[Any, bytes, str]]], ...] = (
        ("none", []), ("a request", [("in", read, late)]), ("a reply", [("in", reply, late)]),
        ("requests", [("in", read, late), ("in", other, "noise"), ("in", reply, late)]),
        ("noise", [("in", b"\0\0\0\0", "noise")]), ("less noise", [("in", b"\0\0\0", "noise")]),
        ("own", [("out", read, ""), ("in", read, "echo"), ("in", reply, "")]),
        ("own and noise", [("out", read, ""), ("in", b"\0\0\0\0\0", "noise")]),
        ("an echo", [("in", read, "echo of it")]), ("our reply", [("in", reply, "")]),
        ("own, late", [("out", read, ""), ("in", read, late)]),
        ("many", [("in", frame(7, bytes([3, 0, n, 0, n])), late) for n in range(6)]),
        ("other notes", [("in", b"\0\0\0\0", "damaged"), ("in", reply, "of device 7")]),
    )  # fmt: skip
    for title, before in product((piece[0] for piece in pieces), (False, True)):
        frames = dict(pieces)[title]
        line = FramedLine(SERIAL, {})
        if before:
            line.hear("in", read, late)
        detector = MasterDetector(line)
        for at, (way, data, note) in enumerate(frames):
            line.time.events.append((0.5 + at / 10, partial(line.hear, way, data, note)))
        heard = asyncio.run(listen_first(line, 1.25, line.time))
        yield f"{title}, {before}: {heard.text!r} {heard.answered} {heard.loose} {line.time.now}"
        try:
            detector.look()
        except OtherMaster as error:
            yield f"  {error}"
    for size, framed in ((3, True), (4, True), (9, True), (9, False)):
        line = FramedLine(SERIAL, {})
        line.tally.bytes_in = 100

        def come(line: FramedLine = line, size: int = size, framed: bool = framed) -> None:
            line.tally.bytes_in += size
            if framed:
                line.frames.append(Frame(line.time.now, "in", b"\0\0", "damaged"))

        line.time.events.append((0.5, come))
        yield f"{size} bytes, {framed}: {asyncio.run(listen_first(line, 1.0, line.time)).text!r}"


def searches() -> Iterator[str]:
    """Searches in steps of time: progress at each address, drives found, and requests."""
    for title, how, devices in (
        ("usual", {}, range(1, 6)), ("once", {"once": True}, range(1, 6)),
        ("patient", {"patient": True}, range(1, 4)), ("one", {}, [2]), ("one, silent", {}, [9]),
        ("one, paused", {}, [3]), ("one, nameless", {}, [4]), ("none", {}, []),
        ("busy", {}, range(1, 6)), ("stopping", {}, range(1, 6)), ("ended", {}, range(1, 6)),
        ("cut", {}, range(1, 6)), ("late", {}, range(1, 4)), ("network", {}, range(1, 4)),
    ):  # fmt: skip
        yield title
        yield from searched(title, how, devices)


class BusyPace(Pace):
    """A line with regular polling."""

    busy = True


def searched(title: str, how: dict[str, Any], devices: Any) -> Iterator[str]:
    line = FramedLine(RtuTcpLink("h", 1) if title == "network" else SERIAL, {})
    line.devices[2] = drive("named")
    line.devices[4] = drive("mute")
    line.facts.paused = {3: ("other", "It is paused.")}
    if title in ("busy", "stopping"):
        line.pace = BusyPace()
    shown: list[str] = []

    def progress(search: Search) -> str:
        return (f"{search.text}; {search.at} {search.requested} of {search.of}, {search.again}"
                f" {search.left:.2f} s, cost {search.cost:.3f}, {search.unprobed}"
                f" {sorted(search.answered)} {search.goes_on} {search.is_stopping}")  # fmt: skip

    def between() -> None:
        shown.append(f"  {line.time.now - BEGUN:.2f} {progress(search)}")
        if title == "ended" and search.requested == 2:
            raise RuntimeError("ended")
        if title == "cut" and search.requested == 3:
            line.become(LineStatus.LOST, "cut")
        if title == "stopping" and search.requested == 1:
            search.stops_found = True
        if title == "late" and search.requested == 2:
            there = line._device(1)
            there.state = replace(there.state, answers=True)

    async def found(result: Any) -> None:
        shown.append(f"  found {filled(result)}")

    search = Search(devices, line.time.sleep, between=between, now=line.time.monotonic, **how)
    try:
        asyncio.run(search.run(line, found))
    except (LineError, RuntimeError) as error:
        shown.append(f"  {type(error).__name__} {error}")
    yield f"  {progress(search)} {search.ended!r} {line.time.now - BEGUN:.2f} s"
    yield from shown
    yield f"  {'; '.join(line.sent)}"


SECTIONS = (
    identities, contradictions, limits, keys, known_lines, settings, masters, searches,
)  # fmt: skip


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_connections_find_and_store_what_is_recorded(section: Callable[[], Iterator[str]]) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
