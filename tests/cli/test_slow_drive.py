"""A drive whose replies arrive after the timeout: commands report it as `why` does."""

from __future__ import annotations

import pytest

from tests.bus.peer import (
    PtyPeer,
    TcpPeer,
    honest_pdu,
    reply,
    silent,
    tcp_reply,
    tcp_request_length,
)

from .commands import ended


@pytest.mark.parametrize("tcp", [False, True], ids=["serial", "tcp"])
def test_drive_slower_than_the_timeout_is_named(tcp: bool) -> None:
    def serial(request: bytes, _count: int) -> list[bytes | float]:
        return [0.7, reply(request)]

    def server(request: bytes, _count: int) -> list[bytes | float]:
        return [0.7, tcp_reply(request, honest_pdu(request[7:]))]

    made = TcpPeer(server, length=tcp_request_length) if tcp else PtyPeer(serial)
    with made as peer:
        where = f"tcp:127.0.0.1:{peer.port}" if isinstance(peer, TcpPeer) else peer.path
        text = ended(3, "read", f"{where},timeout=0.1", "-p", "atv71", "ACC").stderr
    # a late reply over TCP is one of any drive of the line
    assert ("A late reply came on this line" if tcp else "after its timeout") in text
    assert "timeout=2" in text


def test_silent_drive_is_not_called_slow() -> None:
    with PtyPeer(silent) as peer:
        text = ended(3, "read", f"{peer.path},timeout=0.1", "-p", "atv71", "ACC").stderr
    assert "after its timeout" not in text
    assert "Are address, wiring" in text
