"""The line served in reality: pseudo-terminal, TCP, an open port; unplugged; in real time."""

from __future__ import annotations

import os
import queue
import socket
import statistics
import threading
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tui.simulator import DriveSpec, LineTiming, Simulation, SimulatorError
from tui.simulator.server.frames import seal

from .small import PROFILES
from .test_manual_frames import read

REQUEST = seal(bytes.fromhex("020323290001"))
REPLY = seal(bytes.fromhex("020302001E"))
MBAP_REQUEST = bytes.fromhex("000100000006020323290001")
MBAP_REPLY = bytes.fromhex("000100000005020302001e")


def simulation(timing: LineTiming | None = None) -> Simulation:
    specs = [DriveSpec("atv71", 2), DriveSpec("atv21", 3, run_hz=20.0)]
    return Simulation(specs, timing=timing, profiles=PROFILES)


@contextmanager
def terminal(path: str) -> Iterator[int]:
    port = os.open(path, os.O_RDWR | os.O_NOCTTY)
    try:
        tty.setraw(port)
        yield port
    finally:
        os.close(port)


def exchange(port: int) -> bytes:
    os.write(port, REQUEST)
    return read(port, len(REPLY))


def test_pseudo_terminal_serves_the_line() -> None:
    with simulation() as running, terminal(running.serve_pty()) as port:
        assert exchange(port) == REPLY
        assert exchange(port) == REPLY


def test_pseudo_terminal_has_a_link(tmp_path: Path) -> None:
    link = tmp_path / "line"
    with simulation() as running:
        assert running.serve_pty(str(link)) == str(link)
        with terminal(str(link)) as port:
            assert exchange(port) == REPLY
    assert not link.is_symlink()


def test_existing_file_is_not_replaced_by_a_link(tmp_path: Path) -> None:
    taken = tmp_path / "file"
    taken.write_text("mine")
    with simulation() as running, pytest.raises(SimulatorError, match="is not a link"):
        running.serve_pty(str(taken))
    assert taken.read_text() == "mine"


def test_unplugged_pseudo_terminal_disappears_until_plugged(tmp_path: Path) -> None:
    link = str(tmp_path / "line")
    with simulation() as running:
        running.serve_pty(link)
        with terminal(link) as port:
            assert exchange(port) == REPLY
            running.unplug()
            assert not os.path.lexists(link)
            with pytest.raises(OSError, match="Input/output error"):
                os.write(port, REQUEST)
        running.replug()
        with terminal(link) as port:
            assert exchange(port) == REPLY


def receive(connection: socket.socket, size: int) -> bytes:
    data = b""
    while len(data) < size and (part := connection.recv(size - len(data))):
        data += part
    return data


def test_modbus_tcp_serves_several_clients() -> None:
    with simulation() as running:
        place = running.serve_tcp()
        with (
            socket.create_connection(place, timeout=5) as item,
            socket.create_connection(place, timeout=5) as other,
        ):
            for client in (item, other, item):
                client.sendall(MBAP_REQUEST)
                assert receive(client, len(MBAP_REPLY)) == MBAP_REPLY


def test_rtu_frames_are_served_over_tcp() -> None:
    with (
        simulation() as running,
        socket.create_connection(running.serve_rtu_tcp(), timeout=5) as client,
    ):
        client.sendall(REQUEST)
        assert receive(client, len(REPLY)) == REPLY


def test_unplugging_breaks_tcp_connections_until_plugged() -> None:
    with simulation() as running:
        place = running.serve_tcp()
        with socket.create_connection(place, timeout=5) as client:
            client.sendall(MBAP_REQUEST)
            assert receive(client, len(MBAP_REPLY)) == MBAP_REPLY
            running.unplug()
            assert client.recv(1) == b""
        with pytest.raises(ConnectionRefusedError):
            socket.create_connection(place, timeout=1).close()
        running.replug()
        with socket.create_connection(place, timeout=5) as client:
            client.sendall(MBAP_REQUEST)
            assert receive(client, len(MBAP_REPLY)) == MBAP_REPLY


def test_port_in_use_is_reported() -> None:
    with simulation() as running:
        place = running.serve_tcp()
        with pytest.raises(SimulatorError, match="Nothing can be served"):
            running.serve_tcp(*place)


def test_client_that_sends_garbage_is_dropped_and_others_are_served() -> None:
    with simulation() as running:
        place = running.serve_tcp()
        with socket.create_connection(place, timeout=5) as client:
            client.sendall(b"GET / HTTP/1.1\r\n\r\n")
            assert client.recv(100) == b""
        with socket.create_connection(place, timeout=5) as client:
            client.sendall(MBAP_REQUEST)
            assert receive(client, len(MBAP_REPLY)) == MBAP_REPLY


class Port:
    """An open port: put bytes are read, written bytes are returned."""

    def __init__(self) -> None:
        self.inward: queue.Queue[bytes] = queue.Queue()
        self.outward: queue.Queue[bytes] = queue.Queue()
        self.closed = threading.Event()

    def read(self, size: int, /) -> bytes:
        try:
            return self.inward.get(timeout=0.01)[:size]
        except queue.Empty:
            return b""

    def write(self, data: bytes, /) -> int:
        self.outward.put(data)
        return len(data)

    def close(self) -> None:
        self.closed.set()


def test_open_port_is_served_and_closed_at_the_end() -> None:
    port = Port()
    with simulation() as running:
        running.serve_stream(port)
        port.inward.put(REQUEST[:4])
        port.inward.put(REQUEST[4:])
        assert port.outward.get(timeout=5) == REPLY
    assert port.closed.is_set()


def test_several_connections_reach_the_same_drives() -> None:
    with simulation() as running:
        place = running.serve_tcp()
        with (
            terminal(running.serve_pty()) as port,
            socket.create_connection(place, timeout=5) as client,
        ):
            client.sendall(bytes.fromhex("00010000000602062329001F"))
            receive(client, 12)
            os.write(port, REQUEST)
            assert read(port, len(REPLY)) == seal(bytes.fromhex("020302001F"))


def test_drive_time_passes_without_requests() -> None:
    with simulation() as running:
        end = time.monotonic() + 10
        while running.drive(3).motor.frequency < 2 and time.monotonic() < end:
            time.sleep(0.02)
        assert running.drive(3).motor.frequency >= 2


def test_start_and_stop_can_be_repeated() -> None:
    running = simulation()
    for _ in range(2):
        running.start()
        running.start()
        with terminal(running.serve_pty()) as port:
            assert exchange(port) == REPLY
        running.stop()
        running.stop()


def test_real_time_takes_about_the_time_of_the_line() -> None:
    """The middle of several exchanges, in bounds that a busy machine keeps too."""
    timing = LineTiming(9600, "8E1", real_time=True)
    characters = len(REQUEST) + len(REPLY)
    theory = characters * timing.character + max(0.005, timing.silence)
    with simulation(timing) as running, terminal(running.serve_pty()) as port:
        taken = []
        for _ in range(9):
            start = time.monotonic()
            assert exchange(port) == REPLY
            taken.append(time.monotonic() - start)
            time.sleep(2 * timing.silence)
    assert min(taken) >= 0.99 * theory
    assert statistics.median(taken) < 3 * theory


def test_without_real_time_an_exchange_is_quicker_than_the_line() -> None:
    timing = LineTiming(300, "8E1")
    with simulation(timing) as running, terminal(running.serve_pty()) as port:
        start = time.monotonic()
        assert exchange(port) == REPLY
        assert time.monotonic() - start < (len(REQUEST) + len(REPLY)) * timing.character
