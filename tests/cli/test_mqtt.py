"""Output to a broker: topics, messages, the broker and its password."""

from __future__ import annotations

import json
import socket
import sys
from pathlib import Path

import click
import pytest

from tui.cli.plant.broker import PASSWORD_SETTING, Broker, broker_of, level, need_mqtt
from tui.cli.plant.mqtt import client_id
from tui.cli.plant.status import DriveStatus
from tui.cli.plant.topics import drive_messages, line_messages, line_topics
from tui.cli.shared.errors import Failure

from .commands import refused
from .plant_sights import cycle, drive_of, failed, line_of, small_drive

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
