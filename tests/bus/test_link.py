"""Links as typed, and the times that follow from them."""

from __future__ import annotations

from pathlib import Path

import pytest

from tui.bus.errors import LinkSyntaxError
from tui.bus.line import Line
from tui.bus.link import (
    Link,
    RtuTcpLink,
    SerialLink,
    TcpLink,
    character_time,
    label,
    parse_link,
    silence,
)


@pytest.mark.parametrize(
    ("text", "link"),
    [
        ("serial:/dev/ttyUSB0", SerialLink("/dev/ttyUSB0", 19200, "8E1")),
        ("serial:/dev/ttyUSB0,9600", SerialLink("/dev/ttyUSB0", 9600, "8E1")),
        ("serial:/dev/ttyUSB0,9600,8n2", SerialLink("/dev/ttyUSB0", 9600, "8N2")),
        ("SERIAL:COM3, 38400, 8O1", SerialLink("COM3", 38400, "8O1")),
        ("/dev/ttyUSB0", SerialLink("/dev/ttyUSB0")),
        ("/dev/ttyUSB0,9600,8N1", SerialLink("/dev/ttyUSB0", 9600, "8N1")),
        (
            "/dev/serial/by-path/pci-0000:00:14.0",
            SerialLink("/dev/serial/by-path/pci-0000:00:14.0"),
        ),
        ("COM12", SerialLink("COM12")),
        ("tcp:10.0.0.5", TcpLink("10.0.0.5", 502)),
        ("tcp:drive-1.example:1502", TcpLink("drive-1.example", 1502)),
        ("tcp:[::1]", TcpLink("::1", 502)),
        ("tcp:[fe80::1%eth0]:503", TcpLink("fe80::1%eth0", 503)),
        ("rtu-tcp:10.0.0.5:4001", RtuTcpLink("10.0.0.5", 4001)),
        (" tcp:10.0.0.5 ", TcpLink("10.0.0.5", 502)),
        ("tcp:10.0.0.5,timeout=2.5", TcpLink("10.0.0.5", 502, 2.5)),
        ("tcp:10.0.0.5, UNIT = 255", TcpLink("10.0.0.5", 502, unit=255)),
        ("tcp:10.0.0.5:1502,timeout=2,unit=0", TcpLink("10.0.0.5", 1502, 2.0, 0)),
        ("rtu-tcp:10.0.0.5:4001, Timeout=0.3", RtuTcpLink("10.0.0.5", 4001, 0.3)),
        ("/dev/ttyUSB0,timeout=2", SerialLink("/dev/ttyUSB0", timeout=2.0)),
        ("serial:/dev/ttyUSB0,9600,8N1,timeout=2", SerialLink("/dev/ttyUSB0", 9600, "8N1", 2.0)),
    ],
)
def test_valid_link_text_is_parsed(text: str, link: Link) -> None:
    assert parse_link(text) == link
    assert parse_link(label(link)) == link


def test_existing_path_is_a_port(tmp_path: Path) -> None:
    port = tmp_path / "port"
    with pytest.raises(LinkSyntaxError):
        parse_link(str(port))
    port.touch()
    assert parse_link(f"{port},9600") == SerialLink(str(port), 9600)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "drive",
        "udp:10.0.0.5",
        "serial:",
        "serial:/dev/ttyUSB0,fast",
        "serial:/dev/ttyUSB0,0",
        "serial:/dev/ttyUSB0,19200,7E1",
        "serial:/dev/ttyUSB0,19200,8E1,x",
        "serial:/dev/ttyUSB0,timeout=",
        "tcp:10.0.0.5,timeout=0",
        "tcp:10.0.0.5,timeout=nan",
        "tcp:10.0.0.5,timeout=60",
        "tcp:10.0.0.5,timeout=2,timeout=3",
        "tcp:10.0.0.5,unit=254",
        "tcp:10.0.0.5,unit=0255",
        "tcp:10.0.0.5,unit=",
        "rtu-tcp:10.0.0.5:4001,unit=255",
        "/dev/ttyUSB0,unit=255",
        "timeout=2",
        "tcp:",
        "tcp::502",
        "tcp:10.0.0.5:0",
        "tcp:10.0.0.5:65536",
        "tcp:::1",
        "rtu-tcp:10.0.0.5",
        "rtu-tcp:[::1]",
    ],
)
def test_invalid_link_text_is_refused(text: str) -> None:
    with pytest.raises(LinkSyntaxError) as caught:
        parse_link(text)
    assert str(caught.value).endswith((".", "bits."))


def test_configured_timeout_is_kept() -> None:
    usual, patient = Line(TcpLink("::1")).timing, Line(TcpLink("::1", timeout=5.0)).timing
    assert (patient.first_timeout, patient.late_reply) == (5.0, 10.0)
    assert patient.min_timeout == usual.min_timeout
    assert (usual.patient_timeout, patient.patient_timeout) == (0.8, 5.0)
    hurried = Line(TcpLink("::1", timeout=0.05)).timing
    assert (hurried.first_timeout, hurried.min_timeout, hurried.scan_timeout) == (0.05,) * 3


def test_label_includes_the_link_type_and_settings() -> None:
    assert label(SerialLink("/dev/ttyUSB0")) == "serial:/dev/ttyUSB0,19200,8E1"
    assert label(TcpLink("10.0.0.5")) == "tcp:10.0.0.5:502"
    assert label(RtuTcpLink("::1", 4001)) == "rtu-tcp:[::1]:4001"


@pytest.mark.parametrize(
    ("link", "character", "pause"),
    [
        (SerialLink("x", 9600), 11 / 9600, 38.5 / 9600),
        (SerialLink("x", 19200), 11 / 19200, 38.5 / 19200),
        (SerialLink("x", 38400), 11 / 38400, 0.00175),
        (SerialLink("x", 115200, "8N1"), 10 / 115200, 0.00175),
        (RtuTcpLink("x", 1), 11 / 19200, 38.5 / 19200),
        (TcpLink("x"), 0.0, 0.0),
    ],
)
def test_character_time_and_gap_follow_baud_and_format(
    link: Link, character: float, pause: float
) -> None:
    assert character_time(link) == pytest.approx(character)
    assert silence(link) == pytest.approx(pause)
