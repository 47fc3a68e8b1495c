"""`drivepanel why`: its status, its sentence, its JSON; and that it leaves the drive unchanged."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from pathlib import Path

import pytest

from tests.adapters import Adapters
from tests.adapters import adapters as adapters  # the fixture is for these tests too
from tests.bus.peer import PtyPeer, TcpPeer, honest, silent, tcp_reply, tcp_request_length
from tests.programs import DRIVEPANEL, served
from tui.bus.fake import FakeLine
from tui.bus.link import SerialLink, TcpLink
from tui.session.connect.known_line import KnownLine

from .commands import ended, run, tcp_line

pytestmark = pytest.mark.long

posix = pytest.mark.skipif(os.name != "posix", reason="no pseudo-terminals here")


def test_drive_that_answers_is_reported_as_healthy() -> None:
    with tcp_line("atv71@2") as line:
        text = run(0, "why", line, "-d", "2")
        assert re.match(r"Address 2 answers: (1[45]\d) of \1 requests", text)
        assert "kept the connection for 3 s without a request" in text
        reported = json.loads(run(0, "why", line, "-d", "2", "--json"))
    assert (reported["rung"], reported["answers"], reported["next"]) == ("answers", True, [])
    assert (reported["profile"], reported["seen"]["answered"]) == ("atv71", 4)
    assert reported["timeout"]["seconds"] == 10.0


@pytest.mark.sweep
def test_family_without_identification_is_diagnosed_by_its_profile() -> None:
    with tcp_line("powerdrive@2") as line:
        assert "Address 2 answers" in run(0, "why", line, "-d", "2")
        reported = json.loads(run(0, "why", line, "-d", "2", "-p", "powerdrive", "--json"))
    assert (reported["rung"], reported["profile"]) == ("answers", "powerdrive")


@posix
def test_silent_drive_gets_the_checks_of_its_family() -> None:
    with PtyPeer(silent) as peer:
        text = run(3, "why", peer.path, "-d", "2", "-p", "atv71")
        assert {request[1] for request in peer.requests} <= {3, 43}
    first, head, *steps = text.splitlines()
    assert first == "No device answers at address 2: not one byte came back."
    assert head == "Next steps:"
    assert steps[0] == (
        "  - Address: ADD. At OFF (0) it does not answer, and so it leaves the factory."
    )


@posix
def test_remembered_drive_needs_no_profile() -> None:
    with PtyPeer(silent) as peer:
        KnownLine(FakeLine({2: {}}, link=SerialLink(peer.path))).note(None, 2, "atv71")
        reported = json.loads(run(3, "why", peer.path, "-d", "2", "--json"))
        assert (reported["rung"], reported["profile"]) == ("silence", "atv71")
        reported = json.loads(run(3, "why", peer.path, "-d", "3", "--json"))
        assert reported["profile"] is None


def test_missing_port_is_the_cause(tmp_path: Path) -> None:
    path = tmp_path / "ttyUSB7"
    reported = json.loads(run(3, "why", f"serial:{path}", "--json"))
    assert (reported["rung"], reported["text"]) == ("no-port", f"There is no port {path}.")
    assert reported["seen"]["asked"] == 0


@posix
def test_renumbered_adapter_is_the_cause(adapters: Adapters) -> None:
    with PtyPeer(honest) as peer:
        pty = Path(peer.path).resolve()
        port = adapters.plug("ttyUSB0", "1.1", serial="A5", leads_to=pty)
        ended(0, "why", f"serial:{port}")
        adapters.unplug("ttyUSB0")
        adapters.plug("ttyUSB1", "1.1", serial="A5", leads_to=pty)
        reported = json.loads(run(3, "why", f"serial:{port}", "--json"))
    assert reported["rung"] == "renumbered"
    assert "by-id" in reported["next"][0]


@posix
def test_gateway_exception_is_reported() -> None:
    def script(request: bytes, _count: int) -> list[bytes | float]:
        return [tcp_reply(request, bytes([request[7] | 0x80, 11]))]

    with TcpPeer(script, length=tcp_request_length) as peer:
        link = TcpLink("127.0.0.1", peer.port)
        reported = json.loads(run(3, "why", f"tcp:{link.host}:{link.port}", "--json"))
    assert (reported["rung"], reported["seen"]["exceptions"][0]) == ("gateway", 11)


def test_invalid_line_is_a_usage_error() -> None:
    assert "is not a line" in ended(2, "why", "nosuch").stderr
    assert "no profile" in ended(2, "why", "sim:atv71", "-p", "nosuch").stderr


def test_pending_timeout_is_reported() -> None:
    with tcp_line("atv21@1", "--set", "F803=30") as line:
        assert "F803" in ended(0, "why", line).stderr


@posix
def test_why_works_beside_a_program_that_owns_the_line(tmp_path: Path) -> None:
    """Its frames arrive with a delay; it has the port, which is not a trouble."""

    def script(request: bytes, count: int) -> Sequence[bytes | float]:
        return honest(request, count) if request[0] == 1 else []

    with PtyPeer(script) as peer:
        owner = [*DRIVEPANEL, "watch", peer.path, "-p", "atv71", "--every", "0.2", "ETA"]
        with served(owner, ready="ETA"):
            reported = json.loads(run(0, "why", peer.path, "-p", "atv71", "--json"))
            assert (reported["rung"], reported["seen"]["answered"] >= 3) == ("answers", True), (
                reported
            )
            reported = json.loads(run(3, "why", peer.path, "-p", "atv71", "-d", "3", "--json"))
            assert reported["rung"] == "silence"
