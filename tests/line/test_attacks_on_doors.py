"""Hosts that send anything to Modbus TCP and metrics while a motor runs: a stop passes them."""

from __future__ import annotations

import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from random import Random
from urllib.parse import urlparse

import pytest

from tests.programs import PATIENCE, is_running, keepers, served, wait_until
from tui.simulator import DriveSpec

from .test_commands import bench, stands, turns
from .test_serve import COMMAND, ENABLED, STATUS, Gateway, serving, started_by_a_client

STOP = struct.pack(">HHHBBHH", 7, 0, 6, 1, 6, COMMAND, 0x0007)
READ = struct.pack(">HHHBBHH", 1, 0, 6, 1, 3, STATUS, 2)
Place = tuple[str, int]


def connected(place: Place, host: str) -> socket.socket:
    return socket.create_connection(place, timeout=PATIENCE, source_address=(host, 0))


def noise(place: Place, chance: Random) -> None:
    """Random bytes, and frames with a wrong header or length; never a write by chance."""
    with connected(place, "127.0.0.2") as client:
        for _ in range(20):
            pdu = bytes([chance.choice((0, 3, 4, 8, 43, 99))]) + chance.randbytes(
                chance.randrange(1, 260)
            )
            length = chance.choice((len(pdu) + 1, 0, 1, 300, 65535))
            client.sendall(struct.pack(">HHHB", 1, chance.choice((0, 0, 0, 7)), length, 1) + pdu)


def halves(place: Place, chance: Random) -> None:
    """Frames that never end."""
    with connected(place, "127.0.0.2") as client:
        client.sendall(STOP[: chance.randrange(1, len(STOP) - 1)])
        time.sleep(0.05)


def reads(place: Place, chance: Random) -> None:
    """Requests without a pause, whose replies are not read."""
    with connected(place, "127.0.0.2") as client:
        client.settimeout(0.2)
        for _ in range(chance.randrange(1, 400)):
            client.sendall(READ * 20)


def stops(place: Place, chance: Random) -> None:
    """Stops of another drive, in any form, without a pause."""
    with connected(place, "127.0.0.2") as client:
        client.settimeout(0.2)
        for _ in range(50):
            word = chance.choice((0x0000, 0x0002, 0x0007))
            client.sendall(struct.pack(">HHHBBHH", 1, 0, 6, 2, 6, COMMAND, word) * 10)


def scrapes(place: Place, chance: Random) -> None:
    """Requests to the metrics that are none, or never end."""
    long = b"GET /metrics HTTP/1.1\r\nHost: " + b"x" * 5000 + b"\r\n\r\n"
    with connected(place, "127.0.0.2") as client:
        client.sendall(chance.choice((b"GET ", b"\0" * 9000, long, b"POST / HTTP/1.1\r\n\r\n")))


@contextmanager
def attacked(attack: Callable[[Place, Random], None], place: Place, count: int) -> Iterator[None]:
    """Threads that do it again and again."""
    over = threading.Event()

    def work(seed: int) -> None:
        chance = Random(seed)
        while not over.is_set():
            with suppress(OSError):
                attack(place, chance)

    threads = [threading.Thread(target=work, args=(seed,), daemon=True) for seed in range(count)]
    for thread in threads:
        thread.start()
    try:
        yield
    finally:
        over.set()
        for thread in threads:
            thread.join(PATIENCE)


@pytest.mark.parametrize("attack", [noise, halves, reads, stops])
def test_stop_works_during_an_attack_on_modbus_tcp(attack: Callable[[Place, Random], None]) -> None:
    with bench(ENABLED, DriveSpec("atv71", 2, sets={"CHCF": 1})) as (simulation, line):
        command = serving(line, "--tcp", "127.0.0.1:0", "--allow-commands")
        with served(command, ready="Ready:") as program, ExitStack() as stack:
            made = Gateway(simulation, line, program)
            started_by_a_client(made)
            place = "127.0.0.1", made.port
            idle = [stack.enter_context(connected(place, "127.0.0.4")) for _ in range(300)]
            processes = [program.process.pid, *keepers()]
            with attacked(attack, place, 4):
                time.sleep(2.0)
                assert turns(simulation)
                with connected(place, "127.0.0.3") as client:
                    client.sendall(STOP)
                    assert client.recv(100) == STOP
                wait_until(lambda: stands(simulation), "the motor stops")
            assert len(idle) == 300
            assert all(map(is_running, processes))
            assert simulation.drive(1).fault is None


def test_scrape_works_during_an_attack_on_metrics() -> None:
    with bench(ENABLED) as (_, line):
        command = serving(f"{line}@1", "--metrics", "127.0.0.1:0")
        with served(command, ready="Ready:") as program, ExitStack() as stack:
            url = urlparse(program.ready.split("metrics at ")[1].rstrip("."))
            assert url.port is not None
            place = "127.0.0.1", url.port
            for _ in range(300):
                stack.enter_context(connected(place, "127.0.0.4"))
            with attacked(scrapes, place, 4):
                time.sleep(1.0)
                for _ in range(5):
                    with connected(place, "127.0.0.3") as client:
                        client.sendall(b"GET /metrics HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
                        assert client.recv(15) == b"HTTP/1.1 200 OK"
            assert program.process.poll() is None
