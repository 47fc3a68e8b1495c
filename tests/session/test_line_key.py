"""The key of a line: the same however the line was typed, another for another line."""

from __future__ import annotations

from pathlib import Path

import pytest

from tui.session.connect.line_key import line_key


def test_port_links_are_resolved(tmp_path: Path) -> None:
    port, link = tmp_path / "ttyUSB0", tmp_path / "by-id-adapter"
    port.touch()
    link.symlink_to(port)
    assert line_key(f"serial:{link},9600,8N1") == line_key(str(port)) == f"serial:{port}"


def test_changed_link_is_another_line(tmp_path: Path) -> None:
    link = tmp_path / "by-id-adapter"
    link.symlink_to(tmp_path / "ttyUSB0")
    before = line_key(f"serial:{link}")
    link.unlink()
    link.symlink_to(tmp_path / "ttyUSB1")
    assert line_key(f"serial:{link}") != before


@pytest.mark.parametrize(
    ("text", "other"),
    [
        ("serial:/dev/ttyS77,19200,8E1", "/dev/ttyS77"),
        ("/dev/ttyS77 19200 8E1", "SERIAL: /dev/ttyS77 , 9600"),
        ("/dev/ttyS77 19200 8E1 timeout=2", "/dev/ttyS77,timeout=0.5"),
        ("COM3", r"serial:\\.\com3,9600"),
        ("tcp:Gateway.Plant", " TCP:gateway.plant.:502,timeout=2"),
        ("tcp:[::1]", "tcp:[0:0:0:0:0:0:0:1]:502"),
        ("rtu-tcp:MOXA:4001", "rtu-tcp:moxa:4001"),
        ("tcp:gateway,unit=0", "tcp:gateway:502,timeout=2,unit=0"),
        ("tcp:127.0.0.1", "tcp:127.1"),
        ("tcp:127.0.0.1", "tcp:[::ffff:127.0.0.1]:502"),
        ("sim:atv71@2,atv21", "SIM: atv21@1, ATV71@2"),
    ],
)
def test_spellings_of_one_line_have_one_key(text: str, other: str) -> None:
    assert line_key(text) == line_key(other)


@pytest.mark.parametrize(
    ("text", "other"),
    [
        ("/dev/ttyS77", "/dev/ttyS7"),
        ("/dev/TTYS77", "/dev/ttyS77"),
        ("tcp:gateway", "tcp:gateway:503"),
        ("tcp:gateway:4001", "rtu-tcp:gateway:4001"),
        ("tcp:gateway,unit=255", "tcp:gateway"),
        ("tcp:gateway,unit=255", "tcp:gateway,unit=0"),
        ("sim:atv71", "sim:atv71@2"),
        ("sim:atv71", "sim:atv21"),
    ],
)
def test_different_lines_have_different_keys(text: str, other: str) -> None:
    assert line_key(text) != line_key(other)


def test_hosts_file_name_equals_its_address(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    hosts = tmp_path / "hosts"
    monkeypatch.setattr("tui.session.connect.line_key.HOSTS", hosts)
    assert line_key("tcp:pump:502") == "tcp:pump:502"
    hosts.write_text("# tcp\n::1 pump\n10.0.0.7\tPump.plant  pump # 10.0.0.9 fan\n\n", "utf-8")
    assert line_key("tcp:PUMP.") == line_key("tcp:pump.plant") == line_key("tcp:10.0.0.7")
    assert line_key("rtu-tcp:pump:4001") == "rtu-tcp:10.0.0.7:4001"
    assert line_key("tcp:fan") == "tcp:fan:502"
    hosts.write_text("10.0.0.71 pump\n", "utf-8")
    assert line_key("tcp:pump") == "tcp:10.0.0.71:502"
    hosts.write_bytes(b"\xff\xfe10.0.0.7 pump")
    assert line_key("tcp:pump") == "tcp:pump:502"


@pytest.mark.parametrize("text", ["", "  ", "sim:", "sim:atv71@2,atv21@2", "tcp:", "nonsense:1"])
def test_invalid_line_is_its_own_key(text: str) -> None:
    assert line_key(text) == text.strip()
