"""A service from its first message to its last, in this process: gateway, metrics, its line."""

from __future__ import annotations

import asyncio
import os
import signal
import socket
import struct
from collections.abc import AsyncIterator, Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest
import pytest_asyncio

from tests.session.test_stop import wait_for
from tui.bus.fake import FakeLine
from tui.cli.plant.publish_options import PublishOptions
from tui.cli.running import serving
from tui.cli.running.serving import (
    GatewayWish,
    LinePulse,
    OpenedLine,
    ServedAt,
    Service,
    served_until_signal,
)
from tui.cli.shared.options import Target
from tui.session.connect.open_line import OpenLine, demo_line
from tui.session.gateway.rules import GatewayRules

ETA, UNIT = 3201, 9
OPEN_TO_ALL = "can read these drives and stop their motors"


@pytest_asyncio.fixture
async def opened() -> AsyncIterator[OpenLine]:
    """A simulated line with an Altivar 71 at address 1."""
    made = demo_line({"atv71": 0.0})
    yield made
    await asyncio.to_thread(made.close)


@pytest.fixture
def systemd(tmp_path: Path) -> Iterator[socket.socket]:
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as end:
        end.bind(str(tmp_path / "notify"))
        end.setblocking(False)
        yield end


async def read_word(place: str) -> bytes:
    """One read of the status word as a client of the gateway."""
    host, port = place.removeprefix("tcp:").rsplit(":", 1)
    reader, writer = await asyncio.open_connection(host, int(port))
    writer.write(struct.pack(">HHHBBHH", 7, 0, 6, UNIT, 3, ETA, 1))
    try:
        return await asyncio.wait_for(reader.readexactly(11), 30)
    finally:
        writer.close()


async def metrics_of(url: str) -> str:
    host, port = url.removeprefix("http://").partition("/")[0].rsplit(":", 1)
    reader, writer = await asyncio.open_connection(host, int(port))
    writer.write(b"GET /metrics HTTP/1.1\r\n\r\n")
    try:
        return (await asyncio.wait_for(reader.read(), 30)).decode()
    finally:
        writer.close()


@pytest.mark.parametrize(
    ("host", "rules"),
    [
        ("127.0.0.1", GatewayRules()),
        ("0.0.0.0", GatewayRules()),
        ("0.0.0.0", GatewayRules(commands=True)),
        ("0.0.0.0", GatewayRules(writes=frozenset({"ACC"}))),
    ],
    ids=["this computer only", "others read", "others command", "others write"],
)
async def test_service_serves_until_a_signal(
    opened: OpenLine, systemd: socket.socket, host: str, rules: GatewayRules,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    places: asyncio.Queue[ServedAt] = asyncio.Queue()

    def ready(served: ServedAt) -> str:
        places.put_nowait(served)
        return f"{served.tcp}\nand {served.metrics}"

    line = OpenedLine("pump", opened, {1: "atv71"}, (Target("pump", 1, "atv71"),))
    service = Service({"NOTIFY_SOCKET": systemd.getsockname()})
    gateway = GatewayWish(host, 0, {UNIT: (0, 1)}, rules)
    plant = PublishOptions(("127.0.0.1", 0), None, 0.1)
    task = asyncio.create_task(served_until_signal([line], gateway, plant, service, ready))
    served = await asyncio.wait_for(places.get(), 30)
    assert (served.tcp or "").startswith(f"tcp:{host}:")
    assert served.mqtt is None
    assert systemd.recv(500).decode() == f"READY=1\nSTATUS={served.tcp} and {served.metrics}"
    answer = await read_word((served.tcp or "").replace("0.0.0.0", "127.0.0.1"))
    assert answer[:9] == struct.pack(">HHHBBB", 7, 0, 5, UNIT, 3, 2)
    text = await metrics_of(served.metrics or "")
    while 'drivepanel_value_good{line="pump",device="1",code="ETA"' not in text:
        text = await metrics_of(served.metrics or "")
    assert 'drivepanel_line_connected{line="pump"} 1' in text
    assert not task.done()
    os.kill(os.getpid(), signal.SIGTERM)
    assert await asyncio.wait_for(task, 30) == signal.SIGTERM
    assert systemd.recv(500) == b"STOPPING=1\nSTATUS=Ending"
    with pytest.raises(OSError, match=r"refused|Connect call failed"):
        await metrics_of(served.metrics or "")
    output = capsys.readouterr().err
    is_open, allows = host != "127.0.0.1", bool(rules.writes or rules.commands)
    assert (OPEN_TO_ALL in output) is is_open
    assert ("and do what the options allow. Restrict access by a firewall." in output) is allows
    assert (f"anyone who can reach {(served.tcp or '').removeprefix('tcp:')} " in output) is is_open


async def test_service_without_options_serves_nothing_and_ends(opened: OpenLine) -> None:
    found: list[ServedAt] = []

    def ready(served: ServedAt) -> str:
        found.append(served)
        os.kill(os.getpid(), signal.SIGINT)
        return ""

    line = OpenedLine("pump", opened, {})
    ended = served_until_signal([line], None, None, Service({}), ready)
    assert await asyncio.wait_for(ended, 30) == signal.SIGINT
    assert found == [ServedAt(None, None, None)]


async def test_line_is_alive_while_its_loop_goes_on(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [100.0]
    monkeypatch.setattr(serving, "time", SimpleNamespace(monotonic=lambda: now[0]))
    monkeypatch.setattr(serving, "PULSE_INTERVAL", 0.001)
    line = FakeLine()
    pulse = LinePulse(line)
    assert pulse.alive
    for later, alive in ((4.9, True), (5.0, False), (60.0, False)):
        now[0] = 100.0 + later
        assert pulse.alive is alive
    await wait_for(lambda: pulse.alive)
    now[0] += 4.9
    assert pulse.alive
    line.close()
    await asyncio.sleep(0)
    assert not pulse.alive, "its loop has ended"
