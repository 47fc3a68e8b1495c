"""Connections to a broker: what is sent on them, and the cost of a lost one."""

from __future__ import annotations

import asyncio
import logging
import ssl
from collections.abc import AsyncIterator
from dataclasses import replace
from types import SimpleNamespace, TracebackType
from typing import Any

import aiomqtt
import pytest

from tests.session.test_stop import wait_for
from tui.bus.api import LineCounters
from tui.cli.plant import mqtt
from tui.cli.plant.broker import Broker
from tui.cli.plant.mqtt import MqttPublisher, client_id, why_lost
from tui.cli.plant.publish_options import warn_of_plain_password
from tui.cli.plant.publishing import Changes, published_to
from tui.cli.plant.status import LineReport

from .plant_sights import cycle, drive_of, line_of, small_drive

BROKER = Broker("broker", 1883, False, None, None, "plant")


class FakeClient:
    """A broker that keeps what is retained; `lose` ends its connection."""

    made: list[FakeClient] = []
    refuses = 0

    def __init__(self, host: str, port: int, **how: Any) -> None:
        self.place = host, port
        self.how = how
        self.sent: list[tuple[str, str, dict[str, Any]]] = []
        """Every message, in order."""
        self.retained: dict[str, str] = {}
        self.lost = asyncio.Event()
        self.made.append(self)

    async def __aenter__(self) -> FakeClient:
        if len(self.made) <= self.refuses:
            raise aiomqtt.MqttError("[Errno 111] Connection refused")
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: object, tb: TracebackType | None
    ) -> None:
        return

    async def publish(self, topic: str, text: str, **how: Any) -> None:
        if self.lost.is_set():
            raise aiomqtt.MqttError("not connected")
        assert how["retain"] is True
        self.sent.append((topic, text, how))
        self.retained[topic] = text

    @property
    async def messages(self) -> AsyncIterator[object]:
        yield SimpleNamespace(topic="plant/pump/2/set", payload=b"1")
        await self.lost.wait()
        raise aiomqtt.MqttError("lost")


@pytest.fixture
def clients(monkeypatch: pytest.MonkeyPatch) -> type[FakeClient]:
    class Own(FakeClient):
        made = []

    monkeypatch.setattr(aiomqtt, "Client", Own)
    monkeypatch.setattr(mqtt, "TRY_AGAIN_FIRST", 0.01)
    return Own


async def test_everything_is_retained_again_after_a_lost_connection(
    clients: type[FakeClient], capsys: pytest.CaptureFixture[str]
) -> None:
    clients.refuses = 2
    sights: list[LineReport] = [line_of(drive_of(cycle(small_drive(), ETA=0x27, RFR=1)))]
    publisher = MqttPublisher(BROKER, lambda: sights)
    task = asyncio.create_task(publisher.run())
    topics = {"plant/status", "plant/pump/line", "plant/pump/2"}
    await wait_for(lambda: len(clients.made) == 3 and set(clients.made[2].retained) == topics)
    first = clients.made[2]
    assert first.how["will"] == aiomqtt.Will("plant/status", "offline", qos=1, retain=True)
    assert first.retained["plant/status"] == "online"
    # unsolicited messages of a broker fill no terminal and no log
    assert not first.how["logger"].isEnabledFor(logging.ERROR)
    assert first.how["max_queued_incoming_messages"] == 1

    sights[:] = [line_of(drive_of(cycle(small_drive(), ETA=0x27, RFR=2)))]
    publisher.news()
    await wait_for(lambda: '"value": 0.2' in first.retained["plant/pump/2"])

    first.lost.set()
    await wait_for(lambda: len(clients.made) == 4 and set(clients.made[3].retained) == topics)
    publisher.end()
    await task
    assert clients.made[3].retained["plant/status"] == "offline"
    output = capsys.readouterr().err
    assert output.count("Retrying.") == 2
    assert output.count("is connected again.") == 2
    assert ": Connection refused. Retrying." in output
    assert "Errno" not in output


@pytest.mark.internal_errors
async def test_unforeseen_error_does_not_end_publishing(
    clients: type[FakeClient],
) -> None:
    wrong = [True]

    def sights() -> list[LineReport]:
        if wrong:
            raise RuntimeError(wrong.pop())
        return [line_of()]

    publisher = MqttPublisher(BROKER, sights)
    task = asyncio.create_task(publisher.run())
    await wait_for(lambda: bool(clients.made) and "plant/pump/line" in clients.made[-1].retained)
    assert clients.made[0].retained == {"plant/status": "offline"}
    publisher.end()
    await task


async def test_connection_has_the_options_of_the_broker(
    clients: type[FakeClient], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ssl, "create_default_context", lambda: "checked")
    for tls, user in ((False, None), (True, "me")):
        broker = Broker("h", 99, tls, user, user and "secret", "plant/hall")
        publisher = MqttPublisher(broker, list)
        assert not publisher.connected
        task = asyncio.create_task(publisher.run())
        await wait_for(lambda made=publisher: made.connected)  # type: ignore[misc]
        publisher.end()
        await task
        assert not publisher.connected
        made = clients.made[-1]
        assert made.place == ("h", 99)
        assert made.how == {
            "username": user, "password": user and "secret",
            "identifier": client_id("plant/hall"), "logger": made.how["logger"],
            "will": aiomqtt.Will("plant/hall/status", "offline", qos=1, retain=True),
            "keepalive": 10, "tls_context": "checked" if tls else None,
            "max_queued_incoming_messages": 1,
        }  # fmt: skip


async def test_only_changes_are_sent_again_and_the_status_with_the_lines(
    clients: type[FakeClient], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mqtt, "LOOKED_EVERY", 1000.0)
    later, loop = [0.0], asyncio.get_running_loop()
    clock = loop.time
    monkeypatch.setattr(loop, "time", lambda: clock() + later[0])
    first, second = (line_of(drive_of(cycle(small_drive(), ETA=0x27, RFR=n))) for n in (1, 2))
    sights = [first]
    publisher = MqttPublisher(BROKER, lambda: sights)
    task = asyncio.create_task(publisher.run())
    status, line, drive = "plant/status", "plant/pump/line", "plant/pump/2"
    again = {"qos": 1, "retain": True, "timeout": None}
    await wait_for(lambda: bool(clients.made) and len(clients.made[0].sent) == 3)
    made = clients.made[0]

    async def published(seen: LineReport, seconds: float, count: int) -> list[str]:
        """Topics that are sent for these values so much later."""
        sights[:], before = [seen], len(made.sent)
        later[0] += seconds
        publisher.news()
        await wait_for(lambda: len(made.sent) >= before + count)
        for _ in range(5):  # nothing more is sent
            await asyncio.sleep(0)
        return [topic for topic, _, _ in made.sent[before:]]

    assert await published(first, 9.0, 0) == []
    assert await published(second, 0.0, 1) == [drive]
    assert await published(second, 2.0, 1) == [status]
    counted = replace(second, counters=LineCounters(requests=5))
    assert await published(counted, 1.0, 0) == []
    assert await published(counted, 10.0, 2) == [status, line]
    lost = replace(counted, state=replace(counted.state, reason="Gone."))
    assert await published(lost, 0.0, 2) == [status, line]
    publisher.end()
    await task
    assert [(topic, text) for topic, text, how in made.sent if how == again] == (
        [(status, "online")] * 4
    )
    assert [how for topic, _, how in made.sent if topic in (line, drive)] == [{"retain": True}] * 5
    assert made.sent[-1] == (status, "offline", {**again, "timeout": 3.0})


async def test_waiting_time_doubles_until_a_connection_has_lasted(
    clients: type[FakeClient], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mqtt, "TRY_AGAIN_FIRST", 1.0)
    monkeypatch.setattr(mqtt, "LOOKED_EVERY", 1000.0)
    clients.refuses = 7
    later, loop = [0.0], asyncio.get_running_loop()
    clock = loop.time
    monkeypatch.setattr(loop, "time", lambda: clock() + later[0])
    waited: list[float] = []

    class Impatient(MqttPublisher):
        async def _wait_to_try(self, seconds: float) -> None:
            waited.append(seconds)

    publisher = Impatient(BROKER, list)
    task = asyncio.create_task(publisher.run())
    for lasts in (29.0, 31.0, 0.0):
        await wait_for(lambda: publisher.connected)
        later[0] += lasts
        made = clients.made[-1]
        made.lost.set()
        await wait_for(lambda old=made: clients.made[-1] is not old)  # type: ignore[misc]
    publisher.end()
    await task
    assert waited[:10] == [2.0, 4.0, 8.0, 16.0, 30.0, 30.0, 30.0, 30.0, 1.0, 2.0]


async def test_end_does_not_wait_for_the_next_attempt(
    clients: type[FakeClient], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(mqtt, "TRY_AGAIN_FIRST", 1000.0)
    monkeypatch.setattr(mqtt, "TRY_AGAIN_LONGEST", 1000.0)
    clients.refuses = 9
    broker, changes = replace_host(BROKER, "10.0.0.9"), Changes()
    async with asyncio.timeout(60):
        async with published_to([], broker, changes) as place:
            assert place == "mqtt://10.0.0.9:1883/plant"
            await wait_for(lambda: bool(clients.made))
            changes()
        publisher = MqttPublisher(BROKER, list)
        task = asyncio.create_task(publisher.run())
        await wait_for(lambda: len(clients.made) == 2)
        publisher.end()
        await task
    output = capsys.readouterr().err.splitlines()
    assert output == [
        "drivepanel: the password for mqtt://10.0.0.9:1883 is sent unencrypted. Use mqtts://.",
        "drivepanel: mqtt://10.0.0.9:1883: Connection refused. Retrying.",
        "drivepanel: mqtt://broker:1883: Connection refused. Retrying.",
    ]


def replace_host(broker: Broker, host: str) -> Broker:
    """The same broker elsewhere, with a user."""
    return broker._replace(host=host, user="me", password="secret")


async def test_last_message_is_sent_before_the_end_of_publishing(
    clients: type[FakeClient], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mqtt, "LOOKED_EVERY", 1000.0)
    async with asyncio.timeout(60), published_to([], BROKER, Changes()):
        await wait_for(lambda: bool(clients.made) and bool(clients.made[0].retained))
    assert clients.made[0].retained == {"plant/status": "offline"}
    assert len(clients.made) == 1


@pytest.mark.parametrize(
    ("error", "why"),
    [
        (OSError(111, "Connection refused"), "Connection refused"),
        (aiomqtt.MqttError("[SSL: X] bad [Errno 1] x"), "bad [Errno 1] x"),
        (aiomqtt.MqttError(""), ""),
    ],
)
def test_cause_of_a_lost_connection_has_no_number(error: Exception, why: str) -> None:
    assert why_lost(error) == why


@pytest.mark.parametrize(
    ("host", "tls", "password", "warns"),
    [
        ("10.0.0.9", False, "secret", True),
        ("10.0.0.9", True, "secret", False),
        ("10.0.0.9", False, None, False),
        ("127.0.0.1", False, "secret", False),
        ("localhost", False, "secret", False),
    ],
)
def test_plain_password_is_warned_about(
    host: str, tls: bool, password: str | None, warns: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    warn_of_plain_password(Broker(host, 1883, tls, "me", password, "plant"))
    assert ("is sent unencrypted" in capsys.readouterr().err) is warns
