"""Causes of a silent drive: each check of the sequence provoked, with its sentence."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.adapters import Adapters
from tests.adapters import adapters as adapters  # the fixture is for these tests too
from tests.bus.peer import (
    PtyPeer,
    Script,
    TcpPeer,
    honest,
    honest_pdu,
    reply,
    silent,
    tcp_reply,
    tcp_request_length,
)
from tests.misheard import misheard
from tui.bus.api import ModbusLine, Priority, Reply
from tui.bus.errors import (
    OWNER_SILENT,
    ChecksumFault,
    DeviceException,
    ExchangeError,
    LineError,
    LineLost,
    NoAnswer,
    NotShared,
    PortBusy,
    PortMissing,
    PortRefused,
    WrongReply,
)
from tui.bus.fake import FakeLine
from tui.bus.fake_device import FakeDevice
from tui.bus.line import Line, Timing
from tui.bus.link import Link, SerialLink, TcpLink
from tui.bus.transport.port_errors import PortErrors
from tui.bus.transport.ports import PortSeen
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.session.connect.known_line import KnownLine
from tui.session.diagnosis.asking import evidence_of_port, sight_of_drive
from tui.session.diagnosis.diagnosis import LADDER, Diagnosis, diagnosed
from tui.session.diagnosis.evidence import AdapterSeen, DiagnosticEvidence
from tui.session.diagnosis.gateway_probe import Works
from tui.session.diagnosis.measure import Measure
from tui.session.diagnosis.reply_evidence import ReplyEvidence, evidence_of_errors
from tui.wire.frames import frame

pytestmark = pytest.mark.skipif(os.name != "posix", reason="no pseudo-terminals here")
PROFILE = library.load("atv71")
SHORT = Timing(first_timeout=0.3, min_timeout=0.3, late_reply=0.4, retries=0)
PORT = "/dev/ttyUSB0"
LINK = SerialLink(PORT)

OpenedLine = Callable[[Link | str], Line]


@pytest.fixture
def line() -> Iterator[OpenedLine]:
    """Open lines that wait shortly; they are closed after the test."""
    lines: list[Line] = []

    def opened(link: Link | str) -> Line:
        link = SerialLink(link) if isinstance(link, str) else link
        lines.append(Line(link, timing=SHORT))
        lines[-1].open(wait=5.0)
        return lines[-1]

    yield opened
    for item in lines:
        item.close()


async def why(line: ModbusLine, device: int = 2, family: str | None = "atv71") -> Diagnosis:
    """The diagnosis of a drive on an open line."""
    profile = library.load(family) if family else None
    return reported(diagnosed(await sight_of_drive(line, device, profile)))


def reported(found: Diagnosis) -> Diagnosis:
    """The same, with a check of its form: one sentence, and steps that are sentences."""
    assert found.text.endswith(".")
    assert ". " not in found.text
    assert found.well is (not found.steps)
    return found


def of(sight: DiagnosticEvidence) -> Diagnosis:
    return reported(diagnosed(sight))


def heard(**seen: Any) -> DiagnosticEvidence:
    """Replies of a drive on a good port."""
    return DiagnosticEvidence(LINK, 2, PROFILE, heard=ReplyEvidence(requested=3, **seen))


def test_garbage_at_the_same_baud_suggests_another_format() -> None:
    same = of(heard(garbage=12, compared=(12, 14)))
    assert "the speed is right" in same.text
    assert "another format: 8O1, 8N1 or 8N2." in same.steps[0]
    assert not any("open serial:" in step for step in same.steps)
    faster = of(heard(garbage=2, compared=(2, 7)))
    assert any("open serial:/dev/ttyUSB0,38400,8E1" in step for step in faster.steps)


def test_answering_drive_has_correct_wires() -> None:
    damaged = of(heard(answered=2, damaged=1))
    assert damaged.rung == "checksum"
    output = " ".join(damaged.steps)
    assert "Termination" in output
    assert "Polarity" not in output
    assert "Pins" not in output


def test_first_suspects_are_settings_that_differ_from_factory() -> None:
    other = replace(heard(), link=SerialLink(PORT, 9600, "8E1"))
    assert "This line has 9600 8E1" in of(other).steps[0]
    assert of(heard()).steps[0].startswith("Address")
    assert any("--all-settings" in step for step in of(other).steps)


@pytest.mark.parametrize(
    ("code", "step"), [(2, "what was asked is not known"), (6, "Ask again"), (4, "has a trouble")]
)
def test_refusal_is_reported_with_its_code(code: int, step: str) -> None:
    found = of(heard(exceptions=(code,)))
    assert found.rung == "exception"
    assert step in found.steps[0]


# The port


def test_missing_port_is_the_cause(tmp_path: Path) -> None:
    path = str(tmp_path / "ttyUSB7")
    with pytest.raises(PortMissing) as caught:
        Line(SerialLink(path)).open(wait=5.0)
    found = of(evidence_of_port(SerialLink(path), 2, caught.value))
    assert (found.rung, found.text) == ("no-port", f"There is no port {path}.")
    assert "dmesg" in found.steps[-1]


def remembered(adapters: Adapters, name: str, serial: str) -> str:
    """A port that was used once; its path."""
    port = adapters.plug(name, "1.1", serial=serial)
    KnownLine(FakeLine({2: {}}, link=SerialLink(port)))
    return port


def test_renumbered_adapter_is_the_cause(adapters: Adapters) -> None:
    port = remembered(adapters, "ttyUSB0", "A5")
    adapters.unplug("ttyUSB0")
    moved = adapters.plug("ttyUSB3", "1.2", serial="A5")
    found = of(evidence_of_port(SerialLink(port), 2, PortMissing(port)))
    assert found.rung == "renumbered"
    assert found.text == f"{port} is not there: the adapter that it was is {moved} now."
    assert moved in found.steps[0]
    assert "by-id" in found.steps[0]


def test_replaced_adapter_is_the_cause(adapters: Adapters) -> None:
    port = remembered(adapters, "ttyUSB0", "A5")
    adapters.unplug("ttyUSB0")
    adapters.plug("ttyUSB0", "1.2", serial="B7")
    found = of(evidence_of_port(SerialLink(port), 2))
    assert found.rung == "renumbered"
    assert found.text.endswith("the one that it was is not plugged in.")
    moved = adapters.plug("ttyUSB1", "1.1", serial="A5")
    assert f"is {moved} now." in of(evidence_of_port(SerialLink(port), 2)).text


def test_unchanged_adapter_is_not_a_cause(adapters: Adapters) -> None:
    port = remembered(adapters, "ttyUSB0", "A5")
    assert evidence_of_port(SerialLink(port), 2).adapter.was == ""


def test_port_in_use_is_the_cause() -> None:
    with PtyPeer(honest) as peer:
        first = Line(SerialLink(peer.path))
        first.open(wait=5.0)
        try:
            with pytest.raises(PortBusy) as caught:
                Line(SerialLink(peer.path)).open(wait=5.0)
        finally:
            first.close()
    busy = replace(evidence_of_port(LINK, 2), port=PortSeen(PORT))
    found = of(replace(busy, trouble=caught.value))
    assert found.rung == "busy"
    assert "(pid " in found.text
    other = of(replace(busy, trouble=PortBusy(PORT, "minicom (pid 12)")))
    assert other.text == f"{PORT} is in use by minicom (pid 12)."
    assert of(replace(busy, trouble=NotShared("It is another user's. So be it."))).rung == "busy"
    frozen = of(replace(busy, trouble=LineLost(f"run (pid 7) {OWNER_SILENT}. Stops go out.")))
    assert frozen.rung == "busy"
    assert frozen.text.startswith(f"run (pid 7) {OWNER_SILENT}.")
    assert "kill -9" in frozen.steps[0]


def test_program_listening_on_the_port_is_named() -> None:
    seen = DiagnosticEvidence(
        LINK,
        2,
        PROFILE,
        port=PortSeen(PORT, others="cat (pid 3)"),
        heard=ReplyEvidence(requested=2),
    )
    assert of(seen).text == f"cat (pid 3) has {PORT} open too, and takes what the drive answers."
    assert of(replace(seen, heard=ReplyEvidence(requested=5, answered=5))).well


@pytest.mark.parametrize(
    ("seen", "text", "step"),
    [
        (
            PortSeen(PORT, permitted=False, group="dialout", user="ann"),
            "may be used by the group dialout alone, and ann is not in it.",
            "sudo usermod -a -G dialout ann",
        ),
        (
            PortSeen(PORT, permitted=False, group="dialout", user="ann", in_group=True),
            "and ann is in it since the next log-in only.",
            "Log out and in again",
        ),
        (
            PortSeen(PORT, permitted=False, user="ann"),
            "ann may not use /dev/ttyUSB0, and no group of users may.",
            "sudo chmod g+rw /dev/ttyUSB0 lets its group use it",
        ),
    ],
)
def test_missing_permission_is_the_cause(seen: PortSeen, text: str, step: str) -> None:
    found = of(DiagnosticEvidence(LINK, 2, trouble=PortRefused(PORT, "no."), port=seen))
    assert found.rung == "no-permission"
    assert text in found.text
    assert step in found.steps[0]


def test_unsupported_format_of_the_port_is_the_cause() -> None:
    trouble = PortRefused(PORT, "it does not take parity E.")
    found = of(DiagnosticEvidence(LINK, 2, trouble=trouble, port=PortSeen(PORT)))
    assert (found.rung, "parity E" in found.text) == ("port-refused", True)


def test_unreachable_host_is_the_cause() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
    link = TcpLink("127.0.0.1", port)
    with pytest.raises(LineError) as caught:
        Line(link).open(wait=0.5)
    found = of(evidence_of_port(link, 2, caught.value))
    assert found.rung == "line-lost"
    assert "gateway" in found.steps[0]


# The adapter


@pytest.mark.parametrize(
    ("latency", "turnaround", "rung"),
    [(16, 0.017, "slow-adapter"), (1, 0.017, "answers"), (16, 0.005, "answers"),
     (None, 0.017, "answers")],
)  # fmt: skip
def test_latency_is_reported_if_set_and_measured(
    latency: int | None, turnaround: float, rung: str
) -> None:
    heard = ReplyEvidence(requested=5, answered=5)
    port = PortSeen(PORT, latency=latency)
    found = of(DiagnosticEvidence(LINK, 2, PROFILE, port=port, heard=heard, turnaround=turnaround))
    assert found.rung == rung
    if rung == "slow-adapter":
        assert "17 ms after a request" in found.text
        assert "up to 16 ms" in found.text
        assert "ttyUSB0/latency_timer" in found.steps[0]


async def test_latency_is_measured_on_the_line(line: OpenedLine) -> None:
    with PtyPeer(lambda request, _: [0.03, reply(request)]) as peer:
        found = diagnosed(await sight_of_drive(line(peer.path), 2, PROFILE))
    assert found.sight.turnaround is not None
    assert found.sight.turnaround >= 0.02


async def test_echo_without_a_reply_is_the_cause(line: OpenedLine) -> None:
    with PtyPeer(silent, echo=True) as peer:
        found = await why(line(peer.path))
    assert found.rung == "echo"
    assert "no device answers at address 2" in found.text
    with PtyPeer(honest, echo=True) as peer:
        assert (await why(line(peer.path))).well


# Baud and format


def at(baud: int, format_: str) -> Script:
    """A drive whose every reply is received at 19200 8E1, and is sent otherwise."""

    def script(request: bytes, _count: int) -> list[bytes | float]:
        return [misheard(reply(request), (baud, format_), (19200, "8E1")).data]

    return script


@pytest.mark.parametrize("baud", [4800, 9600, 38400])
async def test_bytes_at_another_baud_show_which(baud: int, line: OpenedLine) -> None:
    with PtyPeer(at(baud, "8E1")) as peer:
        found = await why(line(peer.path))
    assert found.rung == "wrong-settings"
    assert f"probably at {baud} bit/s" in found.text
    assert ("more slowly" in found.text) is (baud < 19200)
    assert any(f",{baud},8E1." in step for step in found.steps)


def test_error_counts_of_a_port_show_wrong_settings() -> None:
    errors = PortErrors(framing=3, parity=1, breaks=2, overruns=0)
    found = of(
        DiagnosticEvidence(LINK, 2, PROFILE, heard=ReplyEvidence(requested=2), errors=errors)
    )
    assert found.rung == "wrong-settings"
    assert "3 without a stop bit, 1 with a wrong parity and 2 breaks" in found.text


async def test_error_counts_are_read_from_the_line() -> None:
    made = FakeLine(link=TcpLink("gateway"))
    made.counters = replace(made.counters, framing=40)

    class Noisy(FakeDevice):
        def noted(self, error: ExchangeError | None, now: float) -> None:
            made.counters = replace(made.counters, framing=made.counters.framing + 2)

    made.devices[2] = Noisy(2)
    made.silence(2)
    found = diagnosed(await sight_of_drive(made, 2, PROFILE))
    assert found.rung == "wrong-settings"
    assert 0 < found.sight.errors.framing < 40


@pytest.mark.parametrize("family", ["proxidrive", "varmeca"])
def test_unsupported_baud_of_the_family_is_the_cause(family: str) -> None:
    profile = library.load(family)
    found = of(
        DiagnosticEvidence(
            SerialLink(PORT, 38400, "8N2"), 2, profile, heard=ReplyEvidence(requested=2)
        )
    )
    assert found.rung == "silence"
    assert found.steps[0].startswith("38400 bit/s does not work on ")
    assert "300 to 19200" in found.steps[0]


# The drive


async def test_silence_lists_the_checks_of_the_family(line: OpenedLine) -> None:
    with PtyPeer(silent) as peer:
        opened = line(peer.path)
        found = await why(opened)
        assert found.rung == "silence"
        assert found.text == "No device answers at address 2: not one byte came back."
        functions = {request[1] for request in peer.requests}
    assert functions <= {3, 43}
    neighbor = replace(found.sight, neighbors=(3, 4))
    assert "while addresses 3 and 4 on this line do." in of(neighbor).text


async def test_some_damaged_replies_indicate_a_poor_line(line: OpenedLine) -> None:
    def script(request: bytes, count: int) -> list[bytes | float]:
        good = reply(request)
        return [good[:-3] + bytes([good[-3] ^ 0x40]) + good[-2:]] if count in (1, 3) else [good]

    with PtyPeer(script) as peer:
        found = await why(line(peer.path))
    assert found.rung == "checksum"
    assert "2 of 4 answers came damaged" in found.text
    assert any("termination" in step for step in found.steps)


async def test_reply_from_another_address_is_the_cause(line: OpenedLine) -> None:
    with PtyPeer(lambda request, _: [frame(7, honest_pdu(request[1:-2]))]) as peer:
        found = await why(line(peer.path))
    assert (found.rung, found.text) == (
        "other-address", "Address 7 answers what address 2 was asked.",
    )  # fmt: skip


async def test_reply_to_another_function_is_reported(line: OpenedLine) -> None:
    with PtyPeer(lambda request, _: [frame(request[0], bytes([4, 2, 0, 0]))]) as peer:
        found = await why(line(peer.path))
    assert (found.rung, "function 4." in found.text) == ("wrong-function", True)

    def longer(request: bytes, _count: int) -> list[bytes | float]:
        return [frame(request[0], bytes([3, 4, 0, 0, 0, 0]))] if request[1] == 3 else []

    with PtyPeer(longer) as peer:
        found = await why(line(peer.path))
    assert (found.rung, "not the requested number" in found.text) == ("wrong-function", True)


async def test_refusing_drive_is_reported(line: OpenedLine) -> None:
    with PtyPeer(lambda request, _: [frame(request[0], bytes([request[1] | 0x80, 2]))]) as peer:
        found = await why(line(peer.path))
    assert found.rung == "exception"
    assert "exception 2" in found.text
    assert any("Controller Inside" in step for step in found.steps)


@pytest.mark.parametrize(("code", "says"), [(10, "0A, it has no way"), (11, "0B, the drive did")])
async def test_gateway_exception_is_the_cause(code: int, says: str, line: OpenedLine) -> None:
    def script(request: bytes, _count: int) -> list[bytes | float]:
        return [tcp_reply(request, bytes([request[7] | 0x80, code]))]

    with TcpPeer(script, length=tcp_request_length) as peer:
        found = await why(line(TcpLink("127.0.0.1", peer.port)))
    assert found.rung == "gateway"
    assert says in found.text
    assert "gateway" in found.steps[0]


async def test_wrong_unit_over_tcp_is_the_cause(line: OpenedLine) -> None:
    def script(request: bytes, _count: int) -> list[bytes | float]:
        answer = tcp_reply(request)
        return [answer[:6] + b"\x09" + answer[7:]]

    with TcpPeer(script, length=tcp_request_length) as peer:
        found = await why(line(TcpLink("127.0.0.1", peer.port)))
    assert (found.rung, found.sight.heard.others) == ("other-address", (9,))


async def test_late_reply_is_the_cause(line: OpenedLine) -> None:
    with PtyPeer(lambda request, _: [0.36, reply(request)]) as peer:
        found = await why(line(peer.path), family="powerdrive")
    assert found.rung == "late"
    assert "timeout=2" in found.steps[0]


async def test_paused_polling_is_the_cause(line: OpenedLine) -> None:
    with PtyPeer(honest) as peer:
        opened = line(peer.path)
        opened.facts.pause_polling(2, "A proof is going on.")
        found = await why(opened)
        assert (found.rung, found.text) == ("withheld", "A proof is going on.")
        assert peer.requests == []


async def test_changed_line_is_the_cause(line: OpenedLine) -> None:
    with PtyPeer(honest) as peer:
        seen = await sight_of_drive(line(peer.path), 2, PROFILE, changed="Device 2 was a pump.")
    found = of(seen)
    assert (found.rung, found.text) == ("changed", "Device 2 was a pump.")


async def test_healthy_drive_is_reported(line: OpenedLine) -> None:
    with PtyPeer(honest) as peer:
        found = await why(line(peer.path))
        assert found.well
        assert found.text.startswith("Address 2 answers: 4 of 4 requests")
        assert {request[1] for request in peer.requests} == {3}
    with PtyPeer(honest) as peer:
        found = await why(line(peer.path), family=None)
        assert found.well
        assert {request[1] for request in peer.requests} == {43}


async def test_diagnosis_writes_nothing(line: OpenedLine) -> None:
    for script in (silent, honest, at(9600, "8E1")):
        for family in ("atv71", "powerdrive", None):
            with PtyPeer(script) as peer:
                await why(line(peer.path), family=family)
                assert {request[1] for request in peer.requests} <= {3, 4, 43}, family


async def test_diagnosis_uses_operator_priority() -> None:
    seen: list[Priority] = []

    class Listening(FakeLine):
        async def read(
            self, device: int, address: int, count: int = 1, *,
            priority: Priority = Priority.POLL, function: int = 3, max_age: float = 0.0,
            within: float | None = None,
        ) -> Reply:  # fmt: skip
            seen.append(priority)
            return await super().read(device, address, count, priority=priority)

    made = Listening({2: {PROFILE["ETA"].address: 0x0237}}, link=TcpLink("gateway"))
    assert (await why(made)).well
    assert seen == [Priority.OPERATOR_READ] * 3


# Without frames: a line that another program owns reports errors only


@pytest.mark.parametrize(
    ("error", "rung"),
    [
        (NoAnswer(2, 3, 1), "silence"),
        (NoAnswer(2, 3, 1, "only the adapter's echo of it came back"), "echo"),
        (ChecksumFault(2, 3, 1, received=b"\x02\x03\x02\0"), "checksum"),
        (ChecksumFault(2, 3, 1, received=b"\x80\0\0\xf8\0"), "wrong-settings"),
        (WrongReply(2, 3, 1, received=frame(7, b"\x03\x02\0\0")), "other-address"),
        (WrongReply(2, 3, 1, received=frame(2, b"\x06\0\0\0\0")), "wrong-function"),
        (DeviceException(2, 3, 1, 2), "exception"),
        (DeviceException(2, 3, 1, 11), "gateway"),
        (None, "answers"),
    ],
)
def test_results_of_requests_lead_to_their_check(error: LineError | None, rung: str) -> None:
    heard = evidence_of_errors([error, error], 2)
    assert of(DiagnosticEvidence(LINK, 2, PROFILE, heard=heard)).rung == rung


# What the manual of a family says to look at next


def steps_in_silence(family: str, device: int = 2) -> str:
    link = SerialLink(PORT, 19200, "8E1")
    found = of(
        DiagnosticEvidence(link, device, library.load(family), heard=ReplyEvidence(requested=2))
    )
    assert found.rung == "silence"
    return "\n".join(found.steps)


@pytest.mark.parametrize(
    ("family", "says"),
    [
        ("atv71", "Address: ADD. At OFF (0) it does not answer, and so it leaves the factory."),
        ("atv71", "Keypad port: 8E1 only, whatever the other port has."),
        ("atv71", "Polarity: D0 is A or A', D(A), RD+/TD+, L+. D1 is B"),
        ("atv71", "Pins, RJ45, Modbus keypad port (front): 4 D1, 5 D0, 8 Common."),
        ("atv71", "Polarization: 450 to 650 ohm"),
        ("atv71", "Termination: 120 ohm 0.25 W"),
        ("atv312", "Polarity: D0 is A or A', D(A), RD+/TD+ or L+. D1 is B"),
        ("atv312", "Changed settings take effect after a power cycle."),
        ("atv31", "Pins, RJ45, seen from the socket: 4 D1, 5 D0, 8 Common."),
        ("atv21", "Address: F802. At OFF (0) it does not answer."),
        ("proxidrive", "leaves the factory with 19200 8N2"),
        ("proxidrive", "This line has 19200 8E1"),
        ("varmeca", "RX\\ and TX\\ are the inverted wires"),
        ("powerdrive", "screw terminals: 1 0 V common, 2 RX\\, 3 RX, 4 TX\\, 5 TX."),
        ("powerdrive", "not isolated, and shared with the keypad"),
    ],
)
def test_manual_advice_on_communication_loss(family: str, says: str) -> None:
    assert says in steps_in_silence(family)


def test_invalid_address_of_the_family_is_the_cause() -> None:
    assert "Address 10 calls a group of drives" in steps_in_silence("powerdrive", 10)
    assert "calls a group" not in steps_in_silence("powerdrive", 11)
    assert "calls a group" not in steps_in_silence("atv71", 10)


def test_unsupported_format_of_the_family_is_the_cause() -> None:
    link = SerialLink(PORT, 19200, "8O2")
    found = of(DiagnosticEvidence(link, 2, PROFILE, heard=ReplyEvidence(requested=2)))
    assert found.steps[0] == "Altivar 71 has no 8O2: it has 8O1, 8E1, 8N1, 8N2."


def test_few_bytes_before_the_first_request_are_a_possible_cause() -> None:
    heard = ReplyEvidence(requested=5, answered=5)
    found = of(DiagnosticEvidence(LINK, 2, PROFILE, heard=heard, loose=4))
    assert (found.rung, found.certainty) == ("other-master", "possible")
    assert any("polarization" in other for other in found.others)


# The ladder as a whole

EVIDENCE = DiagnosticEvidence(LINK, 2, PROFILE, port=PortSeen(PORT))
EXAMPLES = {
    "other-master": replace(
        EVIDENCE, overheard="Another master polls drives on this line. Address 2."
    ),
    "wrong-protocol": replace(EVIDENCE, works=Works("rtu-tcp:gateway:4001")),
    "other-unit": replace(EVIDENCE, works=Works("tcp:gateway:502,unit=255", 255)),
    "behind": replace(EVIDENCE, measure=Measure(requested=9, behind=3)),
    "two-drives": replace(EVIDENCE, measure=Measure(requested=9, answered=9, second=3)),
    "stray-bytes": replace(EVIDENCE, measure=Measure(requested=9, answered=9, stray=1)),
    "swapped": replace(EVIDENCE, measure=Measure(requested=9, answered=9, swapped=3)),
    "lost": replace(EVIDENCE, measure=Measure(requested=9, answered=8, lost=1)),
    "duplicated": replace(EVIDENCE, measure=Measure(requested=9, answered=9, duplicated=1)),
    "idle-close": replace(EVIDENCE, measure=Measure(requested=9, answered=9), idle_closed=True),
    "renumbered": replace(EVIDENCE, adapter=AdapterSeen("/dev/serial/by-id/a", "/dev/ttyUSB1")),
    "changed": replace(
        EVIDENCE, changed="It was a pump.", heard=ReplyEvidence(requested=5, answered=5)
    ),
    "no-port": replace(EVIDENCE, trouble=PortMissing(PORT)),
    "no-permission": replace(EVIDENCE, port=PortSeen(PORT, permitted=False)),
    "busy": replace(EVIDENCE, trouble=PortBusy(PORT)),
    "port-refused": replace(EVIDENCE, trouble=PortRefused(PORT, "it does not take 8E1.")),
    "line-lost": replace(EVIDENCE, trouble=LineLost("The port went away.")),
    "withheld": replace(EVIDENCE, withheld="A proof is going on."),
    "slow-adapter": replace(
        EVIDENCE,
        port=PortSeen(PORT, latency=16),
        heard=ReplyEvidence(requested=5, answered=5),
        turnaround=0.02,
    ),
    "wrong-settings": replace(EVIDENCE, heard=ReplyEvidence(requested=2, garbage=9)),
    "silence": replace(EVIDENCE, heard=ReplyEvidence(requested=2)),
    "late": replace(EVIDENCE, heard=ReplyEvidence(requested=2, late=1)),
    "echo": replace(EVIDENCE, heard=ReplyEvidence(requested=2, echoed=2)),
    "checksum": replace(EVIDENCE, heard=ReplyEvidence(requested=5, answered=3, damaged=2)),
    "other-address": replace(EVIDENCE, heard=ReplyEvidence(requested=2, others=(7,))),
    "wrong-function": replace(EVIDENCE, heard=ReplyEvidence(requested=2, functions=(4,))),
    "gateway": replace(EVIDENCE, heard=ReplyEvidence(requested=2, exceptions=(11, 11))),
    "exception": replace(EVIDENCE, heard=ReplyEvidence(requested=2, exceptions=(2, 2))),
    "answers": replace(EVIDENCE, heard=ReplyEvidence(requested=5, answered=5)),
    "not-open": EVIDENCE,
}


@pytest.mark.parametrize("rung", EXAMPLES)
def test_evidence_leads_to_its_check(rung: str) -> None:
    assert of(EXAMPLES[rung]).rung == rung


def test_every_check_has_an_example() -> None:
    assert {rung.id for rung in LADDER} | {"answers", "not-open"} == set(EXAMPLES)


@pytest.mark.parametrize(("lost", "certainty"), [(1, "possible"), (2, "likely"), (5, "certain")])
def test_certainty_increases_with_the_evidence(lost: int, certainty: str) -> None:
    found = of(replace(EVIDENCE, measure=Measure(requested=200, answered=200 - lost, lost=lost)))
    assert found.certainty == certainty
    assert bool(found.others) is (certainty != "certain")


FEW = st.integers(0, 3)
CODES = st.lists(st.sampled_from([1, 2, 10, 11]), max_size=2).map(tuple)


@given(
    st.builds(
        ReplyEvidence, requested=st.integers(1, 5), late=FEW, echoed=FEW, exceptions=CODES,
        functions=CODES, misshapen=FEW, others=CODES, damaged=FEW, garbage=FEW,
    ),
    st.sampled_from([*map(library.load, ("atv71", "powerdrive")), None]),
)  # fmt: skip
def test_silent_drive_is_never_reported_as_healthy(
    heard: ReplyEvidence, profile: Profile | None
) -> None:
    found = of(DiagnosticEvidence(LINK, 2, profile, heard=heard))
    assert found.rung not in ("answers", "not-open")
    assert found.steps
