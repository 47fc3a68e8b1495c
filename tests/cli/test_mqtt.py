"""Output to a broker: topics, messages, passwords, and the cost of a lost connection."""

from __future__ import annotations

import asyncio
import json
import logging
import socket
import sys
from collections.abc import AsyncIterator
from pathlib import Path
from types import SimpleNamespace, TracebackType
from typing import Any

import aiomqtt
import click
import pytest

from tests.session.test_stop import wait_for
from tui.cli.plant import mqtt
from tui.cli.plant.broker import PASSWORD_SETTING, Broker, broker_of, level, need_mqtt
from tui.cli.plant.mqtt import MqttPublisher, client_id
from tui.cli.plant.status import DriveStatus, LineReport
from tui.cli.plant.topics import drive_messages, line_messages, line_topics
from tui.cli.shared.errors import Failure

from .commands import refused
from .plant_sights import cycle, drive_of, failed, line_of, small_drive

BROKER = Broker("broker", 1883, False, None, None, "plant")


# Topics and messages


def test_each_cycle_of_a_drive_is_one_message() -> None:
    seen = drive_of(cycle(small_drive(), ETA=0x88, RFR=499, LFT=18))
    ((topic, text),) = drive_messages("plant/hall", [line_of(seen)]).items()
    reported = json.loads(text)
    assert topic == "plant/hall/pump/2"
    assert (reported["device"], reported["state"]) == (2, "fault")
    assert reported["fault"] == {"code": "ObF", "name": 'Over"braking\\'}
    assert reported["values"]["RFR"]["value"] == 49.9
    assert reported["values"]["RFR"]["unit"] == "Hz"
    assert reported["values"]["RFR"]["quality"] == "good"
    assert reported["values"]["RFR"]["time"].startswith("2023-11-14T22:13:20")


def test_bad_reading_is_marked() -> None:
    seen = drive_of(failed(cycle(small_drive(), ETA=0x27, RFR=499), "No answer."))
    (text,) = drive_messages("plant", [line_of(seen)]).values()
    reported = json.loads(text)
    assert (reported["state"], reported["error"]) == (None, "No answer.")
    assert {item["quality"] for item in reported["values"].values()} == {"stale"}
    (text,) = drive_messages("plant", [line_of(DriveStatus(2, error="Nobody."))]).values()
    assert json.loads(text) | {"error": "Nobody.", "values": {}, "profile": None} == json.loads(
        text
    )


def test_line_message_has_its_counts() -> None:
    ((topic, text),) = line_messages("plant", [line_of()]).items()
    assert topic == "plant/pump/line"
    reported = json.loads(text)
    assert (reported["state"], reported["reason"], reported["counters"]["requests"]) == (
        "connected",
        None,
        0,
    )
    assert reported["last_minute"]["share"] is None


def test_line_is_one_level_of_a_topic() -> None:
    assert level("serial:/dev/ttyUSB0,19200,8E1") == "serial:_dev_ttyUSB0,19200,8E1"
    assert level("a+b#c d\x00") == "a_b_c_d"
    assert level("/") == "_"
    with pytest.raises(ValueError, match="give them different names"):
        line_topics("plant", ["/dev/a", "dev/a"])


# Broker and password


def test_url_selects_the_broker() -> None:
    assert broker_of("mqtt://h/plant/hall2/", None) == Broker(
        "h", 1883, False, None, None, "plant/hall2"
    )
    own = broker_of("mqtt://[::1]:99", None)
    assert (own.host, own.port, own.place) == ("::1", 99, "mqtt://[::1]:99")
    assert own.root == f"drivepanel/{socket.gethostname()}"


@pytest.mark.parametrize(
    ("url", "reported"),
    [
        ("broker", "use mqtt://"),
        ("http://broker", "use mqtt://"),
        ("mqtt://", "use mqtt://"),
        ("mqtt://h:99999", "use mqtt://"),
        ("mqtt://h/?retain=0", "use mqtt://"),
        ("mqtt://h/a/+/b", "is not a topic"),
        ("mqtt://h/a//b", "is not a topic"),
        ("mqtt://h/$SYS", "is not a topic"),
        ("mqtt://me:secret@h", "Every user of this computer"),
    ],
)
def test_invalid_broker_is_refused(url: str, reported: str) -> None:
    assert reported in refused(2, "serve", "sim:atv71", "--mqtt", url)
    assert reported in refused(2, "publish", "sim:atv71", "--mqtt", url)


def test_password_is_read_from_a_file_or_the_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "password"
    file.write_text("from a file\nand no more\n")
    assert broker_of("mqtts://me@h", file) == Broker(
        "h", 8883, True, "me", "from a file", broker_of("mqtt://h", None).root
    )
    with pytest.raises(click.UsageError, match="requires a user"):
        broker_of("mqtt://h", file)
    monkeypatch.setenv(PASSWORD_SETTING, "from outside")
    assert broker_of("mqtt://me@h:1/x", None).password == "from outside"
    assert broker_of("mqtt://h", None).password is None
    file.write_bytes(b"\xff")
    with pytest.raises(click.UsageError, match="cannot be read"):
        broker_of("mqtt://me@h", file)


def test_missing_package_is_reported_with_what_to_install(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "aiomqtt", None)
    assert "pip install 'drivepanel[mqtt]'" in refused(
        2, "publish", "sim:atv71", "--mqtt", "mqtt://h"
    )
    with pytest.raises(Failure):
        need_mqtt()


def test_client_id_depends_on_the_topic_root() -> None:
    assert client_id("plant") == client_id("plant") != client_id("plant/hall")


# Connections


class FakeClient:
    """A broker that keeps what is retained; `lose` ends its connection."""

    made: list[FakeClient] = []
    refuses = 0

    def __init__(self, host: str, port: int, **how: Any) -> None:
        self.how = how
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
