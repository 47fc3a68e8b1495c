"""All that the pure functions of a line return, as text.

`whole_values.txt` has a section for each subject. Its lines name what was passed, and the result
or the error. Read a changed line as a sentence of its own, and change the file only if it is right.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import pytest

from tests.recorded import sections
from tui.bus.coils import (
    ReadCoils,
    ReadDiscrete,
    WriteCoil,
    WriteCoils,
    read_request,
    single_read,
    write_request,
)
from tui.bus.errors import (
    HOPELESS,
    BytesSwapped,
    ChecksumFault,
    DeviceException,
    LineBehind,
    LineBusy,
    LineClosed,
    LineError,
    LineFailed,
    LineLost,
    NoAnswer,
    NotRecorded,
    NotShared,
    PortBusy,
    PortMissing,
    PortRefused,
    RequestRefused,
    Superseded,
    WrongReply,
    request_text,
    stopped_first_text,
    strip_outcome_note,
    strip_retry_note,
)
from tui.bus.expectation import exception_code, exception_extents, identification_extent
from tui.bus.gateway import pdu as gateway
from tui.bus.limits import CAUTIOUS, STANDARD_EXCEPTIONS, Limits, Window, out_of_range, send_refusal
from tui.bus.line_events import DevicesStopped, DeviceWritten, NoticeReceived
from tui.bus.link import (
    FORMS,
    Link,
    RtuTcpLink,
    SerialLink,
    TcpLink,
    UsualSettings,
    character_time,
    label,
    parse_link,
    silence,
)
from tui.bus.model import DeviceState, LastMinute, Reply, contact_of
from tui.bus.poll_plan import PlannedRead, PolledTurn, PollPlan
from tui.bus.prepared import prepared_write
from tui.bus.program import Program, readable
from tui.bus.requests import (
    Diagnose,
    Identify,
    Objects,
    Read,
    ReadInput,
    ReadWrite,
    ReportId,
    Request,
    WriteMany,
    WriteOne,
    diagnostic_of,
    own_words_of,
)
from tui.bus.share.beside import look_answer, stop_devices
from tui.bus.share.carried import error_form, error_from, request_form, request_from
from tui.bus.share.place import SharePlace, file_name_of

TEXTS = Path(__file__).parent / "whole_values.txt"
REQUESTS: tuple[Request, ...] = (
    Read(1, 3201, 4), ReadInput(2, 40, 2), ReadCoils(1, 6, 11), ReadCoils(1, 6, 8),
    ReadDiscrete(3, 0, 3), WriteOne(1, 8501, 15), WriteMany(1, 9001, (30, 65535)),
    WriteCoil(1, 7, 1), WriteCoil(1, 7, 0), WriteCoils(1, 7, (1, 0, 1)), WriteOne(0, 8501, 7),
    ReadWrite(2, 3102, 3, 9001, (20, 30)), Diagnose(4, 0, 0x3132), Diagnose(4, 1, 0xFF00),
    Diagnose(4, 11, 0), Identify(2), Identify(2, 4, 3), ReportId(1),
)  # fmt: skip
WIDE = Limits(
    functions=frozenset({1, 2, 3, 4, 5, 6, 8, 15, 16, 17, 23, 43}), max_read=63, max_write=27,
    max_read_23=20, max_write_23=10, subfunctions=frozenset({0, 4}), max_read_4=12, max_read_1=16,
    max_read_2=24, max_write_15=9, broadcast_functions=frozenset({6}),
)  # fmt: skip
SINGLE = dataclasses.replace(
    WIDE, single_words_only=True, read_windows=(Window(100, 2, 10, False), Window(300, 3, 8, True)),
    write_windows=(Window(500, 4, 4, True),),
)  # fmt: skip


def outcome(call: Callable[..., Any], *args: Any, **named: Any) -> str:
    """The result of a function, or its error, whole."""
    try:
        found = call(*args, **named)
    except (LineError, ValueError, gateway.Unanswerable) as error:
        return f"{type(error).__name__}: {error} {vars(error)}"
    except Exception as error:
        return f"{type(error).__name__}: {error}"
    is_short = isinstance(found, bytes) and len(found) < 40
    return found.hex(" ") if is_short else repr(found)


def requests() -> Iterator[str]:
    for request in REQUESTS:
        pdu, due = request.pdu(), request.expectation()
        yield f"{request}: {pdu.hex(' ')}"
        yield f"  {due} {due.padding} {request.register} {request.changes} {request.written}"
        yield f"  {outcome(single_read, request)} {out_of_range(request)!r}"
        kind, fields = request_form(request)
        yield f"  {kind} {fields} {request_from(kind, fields) == request}"
        for reply in ("03 08 00 01 ff ff 12 34 00 00", "04 04 80 00 00 07", "01 02 ff 07",
                      "01 02 ff 0f", "01 01 81", "02 01 05", "17 06 00 01 00 02 00 03",
                      "08 00 00 31 32", "11 03 41 42 43", "83 02", "2b 0e 01", "06 21 35 00 0f",
                      "05 00 07 ff 00", "0f 00 07 00 03", "10 23 29 00 02", ""):  # fmt: skip
            data = bytes.fromhex(reply)
            words = request.words(data) if due.fits(data) else ""
            if due.extent(data) != 0 or not data or data[0] == request.function:
                yield f"  {reply}: {due.extent(data)} {due.fits(data)} {words}"
                yield f"    {due.mismatch(data)}"
        for more in ("", "00", "00 01 02 03 04 05 06 07 08 09"):
            yield f"  in it: {due.extent(bytes([9, 9]) + pdu + bytes.fromhex(more), 2)}"
    yield outcome(Read(1, 0, 3).pdu_of, (1, 0x8000, 2))
    yield outcome(ReadCoils(1, 0, 3).pdu_of, (1, 0, 1, 0, 0, 0, 0, 0, 1))
    for kind, fields in (("Gone", {}), ("Read", {"device": 300, "address": 1, "count": 1}),
                         ("Read", {"device": 1, "address": 1, "count": 126}),
                         ("Read", {"device": 1})):  # fmt: skip
        yield f"{kind} {fields}: {outcome(request_from, kind, fields)}"


def choices() -> Iterator[str]:
    for function in (1, 2, 3, 4):
        yield repr(read_request(5, 6, 7, function))
    some = (frozenset({6}), frozenset({16}), frozenset({6, 16, 5, 15}), frozenset({5, 15, 1}))
    for address, values, multiple, functions in itertools.product(
        (8501, 0xFFFF, 0x1FFFF, 0x20000, 0x20005, 0x2FFFF, 0x30000),
        ((7,), (1, 0), ()), (None, True, False), some,
    ):  # fmt: skip
        made = outcome(write_request, 1, address, values, multiple, functions)
        yield f"{address} {values} {multiple} {sorted(functions)}: {made}"
    links: tuple[Link, ...] = (SerialLink("/dev/ttyUSB0"), TcpLink("plc", unit=255), TcpLink("a"))
    for link in links:
        made_ready = prepared_write(link, WIDE, 1, 8501, [7])
        yield f"{made_ready.request} {made_ready.frame.hex(' ')} {made_ready.message!r}"


def identities() -> Iterator[str]:
    for found in ("11 05 41 42 43 00 ff", "11 09 ff 41 42 20 00 20 41 42 43 20", "11 02 2a ff",
                  "11 00", "11", "11 04 20 20 20 20"):  # fmt: skip
        yield f"{found}: {own_words_of(bytes.fromhex(found))!r}"
    objects = Objects()
    for found in ("2b 0e 01 81 ff 02 02 00 02 41 42 01 01 43", "2b 0e 01 81 ff 02 01 02 01 44",
                  "2b 0e 01 82 ff 03 01 00 02 41 58", "2b 0e 01 01 00 00 01 02 01 44"):  # fmt: skip
        data = bytes.fromhex(found)
        objects = objects.with_more(data)
        yield f"{found}: {objects} {identification_extent(data)} {identification_extent(data[:9])}"
    long = bytes.fromhex("2b 0e 01 81 00 00 02 00 f0") + bytes(240) + bytes((1, 9)) + bytes(9)
    yield f"{identification_extent(long)} {identification_extent(bytes(3) + long, 3)}"
    yield f"{diagnostic_of(bytes.fromhex('08 00 0b 12 34 56'))}"
    for function, found in itertools.product(
        (3, 43),
        ("83 02", "83 0e 02", "ab 02", "ab 0e 02", "ab 0d 02", "ab", "03 02", "ab 0e 01 02"),
    ):
        yield f"{function} {found}: {exception_code(function, bytes.fromhex(found))}"
    yield f"{exception_extents(3)} {exception_extents(43)} {STANDARD_EXCEPTIONS}"


def refusals() -> Iterator[str]:
    more = (
        Read(1, 100, 10), Read(1, 101, 10), Read(1, 99, 3), Read(1, 100, 11), Read(1, 104, 2),
        Read(1, 300, 8), Read(1, 300, 2), Read(1, 301, 3), Read(1, 300, 9), Read(1, 7, 1),
        Read(1, 5, 63), Read(1, 5, 64), Read(1, 65530, 7), Read(1, -1, 1), Read(1, 5, 0),
        Read(1, 5, 126), ReadInput(1, 5, 12), ReadInput(1, 5, 13), ReadInput(1, 100, 2),
        ReadCoils(1, 5, 16), ReadCoils(1, 5, 17), ReadDiscrete(1, 5, 24), ReadDiscrete(1, 5, 25),
        WriteMany(1, 500, (1, 2, 3, 4)), WriteMany(1, 500, (1, 2)), WriteMany(1, 5, (65536,)),
        WriteMany(1, 5, (1,) * 27), WriteMany(1, 5, (1,) * 28), WriteOne(1, 5, -1),
        WriteCoil(1, 5, 2), WriteCoils(1, 5, (1, 2)), WriteCoils(1, 5, (1,) * 9),
        WriteCoils(1, 5, (1,) * 10), WriteOne(256, 5, 1), WriteOne(-1, 5, 1), WriteOne(255, 5, 1),
        ReadWrite(1, 5, 20, 9, (1,) * 10), ReadWrite(1, 5, 21, 9, (1,)),
        ReadWrite(1, 5, 1, 9, (1,) * 11), ReadWrite(1, 5, 1, 65536, (1,)), Diagnose(1, 4, 0),
        Diagnose(1, 1, 0), Diagnose(1, 70000, 0), WriteMany(0, 5, (1,)), WriteOne(0, 5, 1),
    )  # fmt: skip
    for request in (*REQUESTS, *more):
        first, *others = [send_refusal(request, limits) for limits in (WIDE, SINGLE, CAUTIOUS)]
        others += [
            send_refusal(request, WIDE, read_only=True, held="A stop."),
            send_refusal(request, WIDE, held="A stop."),
        ]
        yield f"{request}: {first!r} {['same' if text == first else text for text in others]}"


TYPED = (
    "serial:/dev/ttyUSB0", "serial:/dev/ttyUSB0,9600", "serial: /dev/ttyUSB0 , 9600 , 8n1 ",
    "/dev/ttyUSB0,9600,8O1", "COM3,19200", "com12", "SERIAL:x,50,8E1", "serial:x,4000000",
    "serial:x,49", "serial:x,4000001", "serial:x,1234567890", "serial:x,9600,7E1",
    "serial:x,9600,8E1,9", "serial:", "serial:,9600", "tcp:plc", "tcp:10.0.0.5:5020",
    "tcp:[::1]:502", "tcp:[fe80::1]", "tcp:::1", "tcp:plc:0", "tcp:plc:65535", "tcp:plc:65536",
    "tcp:", "tcp:a b", "TCP:plc:1", "rtu-tcp:plc:4001", "rtu-tcp:plc", "rtu-tcp:[::1]:7",
    "tcp:plc,unit=255", "tcp:plc,unit=0,timeout=2", "tcp:plc, timeout = 0.02, unit=0",
    "tcp:plc,unit=1", "tcp:plc,unit=255,unit=255", "serial:x,unit=0", "rtu-tcp:a:1,unit=255",
    "serial:x,timeout=30", "serial:x,9600,8N2,timeout=0.019", "serial:x,timeout=30.1",
    "serial:x,timeout=nan", "serial:x,timeout=two", "serial:x,TIMEOUT=1,timeout=1", "nothing", "",
    "/no/such/port", "udp:plc", "plc:502",
)  # fmt: skip


def links() -> Iterator[str]:
    yield FORMS
    for typed in TYPED:
        for usual in (None, UsualSettings(9600, "8N1")):
            yield f"{typed!r}: {outcome(parse_link, typed, usual).replace(FORMS, 'FORMS')}"
        try:
            link = parse_link(typed)
        except LineError:
            continue
        yield f"  {label(link)} {parse_link(label(link)) == link}"
        yield f"  {character_time(link):.7f} {silence(link):.7f}"
    for unit in (None, 0, 255):
        yield f"{unit}: {[TcpLink('a', unit=unit).unit_of(device) for device in (0, 1, 2, 255)]}"
    yield f"{SerialLink('x')} {TcpLink('x')} {RtuTcpLink('x', 1)}"


ERRORS: tuple[LineError, ...] = (
    LineError("text"), PortBusy("/dev/a"), PortBusy("/dev/a", "minicom (pid 7)"),
    NotShared("no"), PortMissing("/dev/a"), PortMissing("/dev/a", ["/dev/b", "/dev/c"]),
    PortRefused("/dev/a", "why."), LineClosed(), LineClosed("own"), LineLost("lost"),
    LineBehind("behind"), LineFailed("failed"), LineBusy("busy"), Superseded(3, 8501),
    RequestRefused("refused"), NoAnswer(1, 3, 3201), NoAnswer(1, 3, 3201, "Own text."),
    NoAnswer(1, 17, 0, retry_in=2.345), NoAnswer(1, 6, 7, "Own.", retry_in=10.0),
    ChecksumFault(1, 16, 9001), ChecksumFault(1, 16, 9001, "Own.", b"\1\2"),
    WrongReply(1, 5, 3), WrongReply(1, 2, 3, "detail", b"\3"), BytesSwapped(4, "ABCDE"),
    BytesSwapped(4, ["A"]), DeviceException(1, 23, 5, 2), DeviceException(1, 43, 0, 3, "Why not."),
    DeviceException(1, 15, 9, 1, "why"), NotRecorded(1, 3, 7),
)  # fmt: skip


def errors() -> Iterator[str]:
    for error in ERRORS:
        yield f"{type(error).__name__}: {error} {vars(error)}"
        form = error_form(error)
        back = error_from(form)
        yield f"  {msgspec.to_builtins(form)}"
        yield f"  {type(back).__name__} {str(back) == str(error)} {vars(back) == vars(error)}"
        yield f"  {contact_of(error)} {isinstance(error, HOPELESS)}"
    for function, address in itertools.product((1, 2, 3, 4, 5, 6, 8, 15, 16, 17, 23), (None, 7)):
        yield f"{function} {address}: {request_text(function, address)}"
    noted = LineError(
        "Lost. The write may or may not have taken effect. Read the register before retrying."
    )
    yield f"{strip_outcome_note(noted)!r} {strip_outcome_note(LineError('Lost.'))!r}"
    yield f"{strip_retry_note('Lost. Retrying in 2.0 s.')!r} {strip_retry_note('Lost.')!r}"
    yield f"{stopped_first_text('space')!r} {stopped_first_text('')!r}"
    long = error_form(PortMissing("x" * 5000, ["y"] * 70))
    yield f"{len(long.text)} {len(long.path)} {len(long.ports)} {error_form(KeyError('x')).text}"


RECEIVED = (
    "03 00 01 00 02", "01 00 01 00 7d", "02 00 01 00 7e", "04 ff ff 00 01", "04 ff ff 00 02",
    "03 00 01 00 00", "03 00 01", "05 00 07 ff 00", "05 00 07 00 00", "05 00 07 00 01",
    "06 21 35 00 0f", "06 21 35", "0f 00 07 00 03 01 05", "0f 00 07 00 09 02 ff 01",
    "0f 00 07 00 03 02 05 00", "0f 00 07 00 03 01 05 00", "0f 00 07 00 00 00",
    "10 23 29 00 02 04 00 14 00 1e", "10 23 29 00 02 03 00 14 00", "10 23 29 00 02 04 00 14 00",
    "10 ff ff 00 02 04 00 14 00 1e", "17 0c 1e 00 04 23 29 00 01 02 00 14",
    "17 0c 1e 00 7e 23 29 00 01 02 00 14", "17 0c 1e 00 04 23 29 00 01 03 00 14 00",
    "17 0c 1e 00 04", "08 00 00 31 32", "08 00", "2b 0e 01 00", "2b 0e 04 03", "2b 0e 05 00",
    "2b 0e 00 00", "2b 0d 01 00", "2b 0e 01", "16 00 04 00 f2 00 25", "07", "18 00 01",
)  # fmt: skip


def gateways() -> Iterator[str]:
    for text in RECEIVED:
        yield f"{text}: {outcome(gateway.parse_request, bytes.fromhex(text))}"
        try:
            found = gateway.parse_request(bytes.fromhex(text))
        except gateway.Unanswerable:
            continue
        if isinstance(found, gateway.WriteRequested):
            yield f"  {found.words} {outcome(gateway.written_pdu, found)}"
    yield outcome(gateway.exception_pdu, 3, 2) + outcome(gateway.exception_pdu, 0xAB, 11)
    for function in (1, 2, 3, 4):
        yield outcome(gateway.words_pdu, function, (1, 0, 1, 1, 0, 0, 0, 0, 1))
    yield outcome(gateway.diagnosed_pdu, 11, 0x1234)
    objects = {2: b"C", 0: b"AB", 3: b"third", 0x7F: b"r" * 200, 0x80: b"e" * 40, 0x90: b"f" * 244}
    for read_code, first in itertools.product((1, 2, 3, 4), (0, 2, 1, 0x7F, 0x80, 0x90)):
        requested = gateway.IdentifyRequested(read_code, first)
        yield f"{requested}: {outcome(gateway.identified_pdu, requested, 0x83, objects)}"
    yield f"{gateway.Unanswerable(4)} {gateway.Unanswerable(4, 'why')}"


PROGRAMS = (
    Program("a", "panel", 812, "anna", "pts/3", "ns"), Program("b", "run", 12),
    Program("k", "keeper", 5), Program("c", "n" * 41, 12, "", "w\x1b" + "w" * 60),
)  # fmt: skip


def programs() -> Iterator[str]:
    for program in PROGRAMS:
        yield f"{program.text!r} {program.process[1]}"
    yield f"{PROGRAMS[0].process}"
    for length in (39, 40, 41):
        yield f"{readable('x' * length, 40)!r}"
    hostile = "a\tb\u202e\u00e9"
    yield f"{readable(hostile)!r} {len(readable('x' * 501))}"
    yield outcome(look_answer, PROGRAMS, {"a": 0.12345, "k": 0.5}, LastMinute(5, 1))
    known = (3, 0, 247, 248, 9)
    for line in (b" 2 3\n", b" 3 2 3\n", b" all\n", b" 1 all\n", b" 0\n", b" 247", b" 248\n",
                 b"\n", b"2\n", b" \n", b" 1" * 548 + b" 10\n", b" 1" * 550 + b"\n",
                 b" 02\n", b" 2  3\n"):  # fmt: skip
        yield f"{line[:20]!r} {len(line)}: {outcome(stop_devices, line, known)}"
    for key in ("serial:/dev/serial/by-id/usb-FTDI_FT232R-if00", "tcp:10.0.0.5:502", "", "--x--"):
        place = SharePlace(key, Path("/run/locks"), (Path("/run/lines"),))
        yield f"{key}: {file_name_of(key)} {place.name} {place.lock_path}"


def polls() -> Iterator[str]:
    first, other = PlannedRead(3201, 2), PlannedRead(40, 1, 4)
    for turns, period in ((((first,),), 0.1), (((first, other), (first,)), 0.5)):
        rates = PollPlan(1, turns, period, 7.0).rates
        yield f"{[(read, round(rate, 6)) for read, rate in rates.items()]}"
    yield f"{(LastMinute().share, LastMinute().whole_share)}"
    minute = LastMinute(6, 1, 3, 1, 9, 9)
    yield f"{minute.replies} {minute.share} {minute.whole_share}"
    for answers, refused in ((None, False), (False, True), (True, False), (True, True)):
        state = DeviceState(answers, 0, None, None, None, None, None, refused=refused)
        yield f"{answers} {refused}: {state.contact}"
    yield f"{PolledTurn(1, 5.0, {}).ended} {PolledTurn(1, 5.0, {}).differs}"
    third = PlannedRead(3, 1)
    turn = PolledTurn(2, 5.0, {first: Reply((1,), 6.0), other: NoAnswer(1, 3, 2)})
    yield f"{turn.turn} {turn.begun} {turn.ended} {turn.differs} {turn.block}"
    yield f"{turn.take(first, 5.9)} {turn.differs} {turn.take_more(first)}"
    try:
        turn.take(other, 0.0)
    except NoAnswer as error:
        yield f"{error} {turn.differs}"
    yield f"{turn.take(third, 0.0)} {turn.differs}"
    old = PolledTurn(0, 5.0, {first: Reply((1,), 6.0)})
    yield f"{old.take(first, 6.0)} {old.differs}"
    notice, written = (
        NoticeReceived(1, "a\x1b[31m"),
        DeviceWritten(1, 8501, (7, 8), PROGRAMS[0], 1.0),
    )
    yield f"{notice} {DevicesStopped((1,), 'b' * 600, PROGRAMS[0]).by[-2:]!r} {written.words}"


SECTIONS = (
    requests, choices, identities, refusals, links, errors, gateways, programs, polls,
)  # fmt: skip


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_functions_of_a_line_return_what_is_recorded(section: Callable[[], Iterator[str]]) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
