"""The slow link of the benchmarks: delay and completeness of bytes."""

from __future__ import annotations

import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import pytest

from benchmarks.link_proxy import PIECE, Link, Pace, Proxy
from benchmarks.terminal import Picture
from tests.programs import PATIENCE

SLOW = Link(2_000, 0.3)


def test_bytes_are_carried_at_the_rate_of_the_link() -> None:
    pace = Pace(SLOW)
    assert pace.carried(10.0, 200) == pytest.approx(10.1)
    assert pace.carried(10.0, 100) == pytest.approx(10.15)


def test_idle_link_accumulates_no_capacity() -> None:
    pace = Pace(SLOW)
    pace.carried(10.0, 200)
    assert pace.carried(60.0, 2_000) == pytest.approx(61.0)


def test_bytes_take_half_a_round_trip() -> None:
    pace = Pace(SLOW)
    assert pace.arrival(pace.carried(10.0, 200)) == pytest.approx(10.25)


def test_link_without_a_limit_is_free_immediately() -> None:
    pace = Pace(Link())
    assert pace.arrival(pace.carried(10.0, 1_000_000)) == 10.0


def test_limited_link_sends_small_pieces() -> None:
    assert SLOW.piece == PIECE < Link().piece


@pytest.mark.parametrize("link", [Link(), Link(1_000_000, 0.02)], ids=["no limit", "shaped"])
def test_output_is_complete_and_in_order(link: Link) -> None:
    sent = bytes(range(256)) * 200
    with echo() as port, Proxy(port, link).at_work() as proxy, connected(proxy) as end:
        threading.Thread(target=end.sendall, args=(sent,), daemon=True).start()
        assert received(end, len(sent)) == sent
        assert (proxy.up, proxy.down) == (len(sent), len(sent))


def test_nothing_is_echoed_before_the_round_trip() -> None:
    link = Link(10_000, 0.1)
    with echo() as port, Proxy(port, link).at_work() as proxy, connected(proxy) as end:
        began = time.monotonic()
        end.sendall(bytes(100))
        received(end, 100)
        # 100 bytes each way take 10 ms each; later is the machine's load and no fault
        assert time.monotonic() - began >= 0.1 + 2 * 0.01


def test_cut_link_ends_on_both_sides() -> None:
    with echo() as port, Proxy(port, SLOW).at_work() as proxy, connected(proxy) as end:
        end.sendall(b"one")
        received(end, 3)
        proxy.cut()
        assert end.recv(1) == b""


def test_picture_answers_cursor_position_requests() -> None:
    picture = Picture(80, 24)
    picture.feed(b"\x1b[5;7Hab\x1b[6n\x1b[?6n\x1b[5n")
    assert picture.answers == ["\x1b[5;9R"]
    picture.feed(b"\x1b[24;80Hx\x1b[6n")
    assert picture.answers[1:] == ["\x1b[24;80R"]


@contextmanager
def echo() -> Iterator[int]:
    """Run an echo server for one connection; return its port."""
    with socket.create_server(("127.0.0.1", 0)) as listener:
        thread = threading.Thread(target=_send_back, args=(listener,), daemon=True)
        thread.start()
        yield listener.getsockname()[1]
        thread.join(PATIENCE)


def _send_back(listener: socket.socket) -> None:
    connection, _ = listener.accept()
    with connection, suppress(OSError):
        while data := connection.recv(4096):
            connection.sendall(data)


def connected(proxy: Proxy) -> socket.socket:
    return socket.create_connection(("127.0.0.1", proxy.port), timeout=PATIENCE)


def received(end: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size:
        more = end.recv(size - len(data))
        assert more, "the link ended too early"
        data += more
    return data
