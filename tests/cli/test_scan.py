"""`drivepanel scan`: it listens, probes each address once, shows the drives, and writes nothing."""

from __future__ import annotations

import json
import os
import pty
import select
import signal
import subprocess
import threading
import time
import tty
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import pytest

from tests.bus.peer import PtyPeer, Step, TcpPeer, silent, tcp_reply, tcp_request_length
from tests.programs import DRIVEPANEL, PATIENCE, served
from tui.drive.finding import LineSetting, likely_settings
from tui.session.connect import address_prober
from tui.simulator import DriveSpec, LineTiming, Simulation
from tui.wire.frames import frame, read_frame

from .commands import ended, invoked, tcp_line
from .printed import documents

pytestmark = pytest.mark.long

READS = {3, 4, 17, 43}
"""Functions that change nothing."""
MOTORS = (DriveSpec("atv71", 2), DriveSpec("atv312", 4), DriveSpec("powerdrive", 7))


@pytest.fixture(autouse=True)
def busy_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    """Listens for less long, tries fewer settings, and waits for drives of this very process."""
    monkeypatch.setattr("tui.session.connect.other_masters.LISTEN", 0.5)
    monkeypatch.setattr(address_prober, "JITTER", 0.25)
    monkeypatch.setattr(address_prober, "likely_settings", lambda *a: likely_settings(*a)[:6])


@contextmanager
def drives(*specs: DriveSpec) -> Iterator[PtyPeer]:
    """Simulated drives behind a peer that records every request."""
    simulation = Simulation(list(specs), any_settings=True)

    def script(request: bytes, _count: int) -> Sequence[Step]:
        reply = simulation.line.receive(request)
        return [reply.data] if reply is not None else []

    with simulation, PtyPeer(script) as peer:
        yield peer


@contextmanager
def line_of(*specs: DriveSpec) -> Iterator[str]:
    """Simulated drives on a pseudo-terminal that heed its baud and stop bits."""
    simulation = Simulation(list(specs), timing=LineTiming(19200, "8E1"))
    with simulation:
        yield simulation.serve_pty()


def events(text: str, kind: str) -> list[dict[str, Any]]:
    """The documents of one kind of event, each of which fits the schema."""
    return [document for document in documents(text) if document.get("event") == kind]


def test_answering_drive_is_reported_as_certain() -> None:
    with drives(*MOTORS) as peer:
        text = ended(0, "scan", peer.path, "--addresses", "1-9", "--json").stdout
    first, second, third = events(text, "hit")
    assert {key: first[key] for key in ("device", "baud", "format", "vendor", "reference")} == {
        "device": 2, "baud": 19200, "format": "8E1", "vendor": "Telemecanique",
        "reference": "ATV71HU15M3",
    }  # fmt: skip
    assert [first[key] for key in ("version", "name", "profile", "sure", "by")] == [
        "0201", "MACHINE 4", "atv71", "identified", "function 43",
    ]  # fmt: skip
    assert (second["device"], second["profile"], second["sure"]) == (4, "atv312", "identified")
    assert (third["device"], third["profile"], third["sure"]) == (7, None, "likely")
    assert third["candidates"] == ["powerdrive", "proxidrive", "varmeca"]
    (end,) = events(text, "ended")
    assert (end["done"], end["found"], end["held_back"]) == (True, 3, None)
    assert end["settings"] == [{"baud": 19200, "format": "8E1"}]


def test_scan_writes_nothing_and_polls_empty_addresses_once() -> None:
    with drives(*MOTORS) as peer:
        ended(0, "scan", peer.path, "--addresses", "1-12")
    assert {request[1] for request in peer.requests} <= READS
    empty = set(range(1, 13)) - {2, 4, 7}
    assert [request[0] for request in peer.requests if request[0] in empty] == sorted(empty)


def test_text_output_lists_drives_by_address() -> None:
    with drives(*MOTORS) as peer:
        text = ended(0, "scan", peer.path, "--addresses", "1-9").stdout
    assert text.splitlines() == [
        "  2  19200 8E1   Altivar 71  ATV71HU15M3  2.1  MACHINE 4",
        "  4  19200 8E1   Altivar 312  ATV312HU09M3  2.1",
        "  7  19200 8E1   likely Leroy-Somer: Powerdrive, Proxidrive or Varmeca 33/34",
    ]


def test_silent_addresses_are_not_hits() -> None:
    with PtyPeer(silent) as peer:
        done = invoked("scan", peer.path, "--addresses", "1-5", "--json")
    assert done.exit_code == 3
    assert not events(done.stdout, "hit")
    assert "No drives found at addresses 1-5. Tried 19200 8E1." in done.stderr


def test_drive_with_line_timeout_is_named_before_first_request() -> None:
    with drives() as peer:
        done = invoked("scan", peer.path, "--addresses", "1-2", "--json")
    assert documents(done.stdout)[0]["event"] == "families"
    assert "start their communication timeout" in done.stderr.splitlines()[0]
    (reported,) = events(done.stdout, "families")
    assert {"profile": "atv21", "name": "Altivar 21", "timeout": "F803", "sure": True} in reported[
        "families"
    ]
    assert "atv71" not in {item["profile"] for item in reported["families"]}


@pytest.mark.parametrize("options", [(), ("--all-settings", "--yes")], ids=["one", "all"])
def test_another_master_ends_the_scan_before_anything_is_sent(options: tuple[str, ...]) -> None:
    over = threading.Event()
    with PtyPeer(silent) as peer:

        def talk() -> None:
            while not over.wait(0.01):
                peer.send(read_frame(6, 3201, 4))
                peer.send(frame(6, bytes.fromhex("06 2135 0006")))

        master = threading.Thread(target=talk)
        master.start()
        try:
            done = invoked("scan", peer.path, *options)
        finally:
            over.set()
            master.join()
        assert peer.requests == []
    assert done.exit_code == 5
    # the one received first
    assert "Address 6: " in done.stderr
    assert "read of registers 3201 to 3204" in done.stderr
    assert "write of register 8501" in done.stderr
    assert "Nothing was sent." in done.stderr


def test_later_master_ends_the_scan_and_keeps_the_hits() -> None:
    simulation = Simulation([DriveSpec("atv71", 2)], any_settings=True)

    def script(request: bytes, _count: int) -> Sequence[Step]:
        reply = simulation.line.receive(request)
        if request[0] == 5:
            return [read_frame(40, 3201, 4)]
        return [reply.data] if reply is not None else []

    with simulation, PtyPeer(script) as peer:
        done = invoked("scan", peer.path, "--addresses", "1-20", "--json")
    assert done.exit_code == 3
    assert "Address 40: read of registers 3201 to 3204" in done.stderr
    (end,) = events(done.stdout, "ended")
    assert (end["done"], end["found"]) == (False, 1)
    assert "1 drive found at addresses 1-20, not all of which were asked" in end["text"]
    assert max(request[0] for request in peer.requests) < 20


def test_two_drives_at_one_address_are_reported_as_unclear() -> None:
    def script(request: bytes, _count: int) -> Sequence[Step]:
        return [frame(3, bytes.fromhex("03 02 0001"))[:-1] + b"\0"] if request[0] == 3 else []

    with PtyPeer(script) as peer:
        done = invoked("scan", peer.path, "--addresses", "2-4", "--json")
    assert done.exit_code == 3
    (reported,) = events(done.stdout, "unclear")
    assert reported["device"] == 3


def test_damaged_identification_is_unclear_without_a_family() -> None:
    """An Altivar that answers the probe for other families; its identification is damaged."""

    def script(request: bytes, _count: int) -> Sequence[Step]:
        if request[0] != 3:
            return []
        if request[1] == 43:
            return [frame(3, bytes.fromhex("2B 0E 01 01 00 00 01 00 01 41"))[:-1] + b"\0"]
        return [frame(3, bytes.fromhex("03 02 0001"))]

    with PtyPeer(script) as peer:
        done = invoked("scan", peer.path, "--addresses", "2-4", "--json")
    assert done.exit_code == 3
    assert not events(done.stdout, "hit")
    (unclear,) = events(done.stdout, "unclear")
    assert unclear["device"] == 3
    assert "damaged" in unclear["text"]
    assert [request[1] for request in peer.requests if request[0] == 3][:4] == [3, 43, 43, 43]


@pytest.mark.parametrize(("code", "text"), [(10, "0A, it has no way"), (11, "0B, the drive did")])
def test_gateway_exceptions_are_reported(code: int, text: str) -> None:
    def script(request: bytes, _count: int) -> Sequence[Step]:
        return [tcp_reply(request, bytes([request[7] | 0x80, code]))]

    with TcpPeer(script, length=tcp_request_length) as peer:
        line = f"tcp:127.0.0.1:{peer.port}"
        done = invoked("scan", line, "--addresses", "3-5", "--json")
    assert done.exit_code == 3
    (end,) = events(done.stdout, "ended")
    (remark,) = end["remarks"]
    assert remark.startswith(f"The gateway answers {text}")
    assert "3-5" in remark
    assert remark in done.stderr
    assert "drivepanel why" in done.stderr


def test_echo_of_the_adapter_is_reported() -> None:
    simulation = Simulation([DriveSpec("atv71", 2)], any_settings=True)

    def script(request: bytes, _count: int) -> Sequence[Step]:
        reply = simulation.line.receive(request)
        return [request, reply.data] if reply is not None else [request]

    with simulation, PtyPeer(script) as peer:
        done = ended(0, "scan", peer.path, "--addresses", "1-3", "--json")
    (hit,) = events(done.stdout, "hit")
    assert hit["device"] == 2
    (end,) = events(done.stdout, "ended")
    assert "as an echo" in end["remarks"][0]
    assert "The adapter repeats what it sends" in done.stderr


def test_healthy_line_has_no_remarks() -> None:
    with tcp_line("atv71@2") as line:
        (end,) = events(ended(0, "scan", line, "--addresses", "1-2", "--json").stdout, "ended")
    assert end["remarks"] == []


def test_network_line_has_no_setting() -> None:
    with tcp_line("atv71@2") as line:
        (hit,) = events(ended(0, "scan", line, "--addresses", "1-2", "--json").stdout, "hit")
        assert (hit["baud"], hit["format"]) == (None, None)
        assert "no baud" in ended(2, "scan", line, "--all-settings").stderr


SLOW = DriveSpec("atv71", 4, sets={"TBR": 28})
"""At 9600 baud."""


def test_other_settings_find_drives_and_report_each_once() -> None:
    with line_of(DriveSpec("atv71", 1), SLOW) as line:
        text = ended(0, "scan", line, "--addresses", "1,4", "--all-settings", "--json").stdout
    hits = events(text, "hit")
    assert [(hit["device"], hit["baud"], hit["format"]) for hit in hits] == [
        (1, 19200, "8E1"),
        (4, 9600, "8E1"),
    ]
    (end,) = events(text, "ended")
    # a pseudo-terminal has no parity: what differs in nothing else is tried once
    assert [(item["baud"], item["format"]) for item in end["settings"]] == [
        (19200, "8E1"),
        (19200, "8N2"),
        (9600, "8E1"),
    ]
    assert end["not_tried"] == 0


def test_slow_setting_is_reported_before_it_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    slow = [LineSetting(9600, "8E1"), LineSetting(600, "8E1"), LineSetting(300, "8E1")]
    monkeypatch.setattr(address_prober, "likely_settings", lambda *_: slow)
    with PtyPeer(silent) as peer:
        done = invoked("scan", peer.path, "--addresses", "1", "--all-settings", "--json")
    (reported,) = events(done.stdout, "slow")
    assert [item["baud"] for item in reported["settings"]] == [600, 300]
    text = "Not searched yet: 300 and 600 baud, 1 s more, for Powerdrive, Proxidrive and Varm"
    assert text in done.stderr
    (end,) = events(done.stdout, "ended")
    assert [item["baud"] for item in end["settings"]] == [19200, 9600, 600, 300]


def test_without_a_terminal_a_drive_with_a_timeout_blocks_other_settings() -> None:
    with line_of(DriveSpec("atv21", 1), SLOW) as line:
        requested = "scan", line, "--addresses", "1,4", "--all-settings", "--json"
        held = ended(0, *requested)
        (end,) = events(held.stdout, "ended")
        assert len(end["settings"]) == 1
        assert "Device 1, Altivar 21" in end["held_back"]
        assert "--yes" in held.stderr
        text = ended(0, *requested, "--yes").stdout
        assert [event["device"] for event in events(text, "hit")] == [1, 4]


def test_shared_line_is_not_scanned_at_other_settings() -> None:
    with line_of(DriveSpec("atv71", 1)) as line:
        watch = [*DRIVEPANEL, "watch", line, "RFR", "--json"]
        with served(watch, ready="RFR"):
            output = ended(5, "scan", line, "--addresses", "1-2", "--all-settings").stderr
            assert "needs the line for itself" in output
            assert "watch" in output
            # beside it at the line's own setting
            assert "Altivar 71" in ended(0, "scan", line, "--addresses", "1-2").stdout


@pytest.mark.sweep
def test_ctrl_c_keeps_the_hits() -> None:
    with line_of(DriveSpec("atv71", 1)) as line:
        scan = [*DRIVEPANEL, "scan", line, "--all-settings", "--json"]
        with served(scan, ready='"hit"') as program:
            program.process.send_signal(signal.SIGINT)
            rest, output = program.process.communicate(timeout=PATIENCE)
    assert program.process.returncode == 130
    (end,) = events(rest, "ended")
    assert (end["done"], end["found"]) == (False, 1)
    assert "Ended by Ctrl-C. 1 drive found" in output


@contextmanager
def at_a_terminal(*arguments: str) -> Iterator[tuple[subprocess.Popen[bytes], int]]:
    """A command with a person at a terminal, and the handle of that; JSON goes to a pipe."""
    near, far = pty.openpty()
    tty.setraw(near)
    process = subprocess.Popen(
        [*DRIVEPANEL, *arguments], stdin=far, stdout=subprocess.PIPE, stderr=far
    )
    os.close(far)
    try:
        yield process, near
    finally:
        if process.poll() is None:
            process.kill()
        process.communicate(timeout=PATIENCE)
        os.close(near)


def seen(near: int, wanted: str) -> None:
    """Wait until the terminal shows a text."""
    text, end = "", time.monotonic() + PATIENCE
    while wanted not in text:
        assert time.monotonic() < end, text
        if select.select([near], [], [], 0.1)[0]:
            text += os.read(near, 4096).decode()


@pytest.mark.sweep
def test_drives_are_kept_alive_during_the_question() -> None:
    simulation = Simulation([DriveSpec("atv21", 1, sets={"F803": 2})], timing=LineTiming())
    with simulation:
        line, drive = simulation.serve_pty(), simulation.drive(1)
        scan = "scan", line, "--addresses", "1-2", "--all-settings", "--json"
        with at_a_terminal(*scan) as (process, near):
            seen(near, "Try the other settings?")
            time.sleep(5.0)  # more than two of its timeouts
            assert drive.fault is None
            os.write(near, b"n\n")
            out, _ = process.communicate(timeout=PATIENCE)
    assert process.returncode == 0
    (end,) = (load for load in map(json.loads, out.splitlines()) if load.get("event") == "ended")
    assert end["held_back"] == "No other setting is tried."
    assert len(end["settings"]) == 1
