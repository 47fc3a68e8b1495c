"""`drivepanel serve`: its refusals before it serves anything."""

from __future__ import annotations

import socket
from contextlib import ExitStack
from pathlib import Path

import click
import pytest

from tui.bus.fake import FakeLine
from tui.cli.commands import serve
from tui.cli.commands.serve import with_named
from tui.cli.plant.publish_options import read_drives
from tui.cli.running.serving import GatewayWish
from tui.cli.shared.options import host_port, written_host_port
from tui.cli.shared.served_lines import ServedLine, served_lines
from tui.session.connect.open_line import OpenLine
from tui.session.gateway.rules import GatewayRules

from .commands import refused


@pytest.mark.parametrize(
    ("typed", "reported"),
    [
        ([], "Missing argument 'LINE...'"),
        (["sim:atv71", "--fresh", "1"], "require --tcp"),
        (["sim:atv71", "--allow-commands"], "require --tcp"),
        (["sim:atv71", "--tcp", "localhost"], "write HOST:PORT"),
        (["sim:atv71", "--tcp", ":1", "-d", "1"], "both, or none"),
        (["sim:atv71", "--tcp", ":1", "-d", "1", "-p", "atv99"], "atv99"),
        (["sim:atv71", "--tcp", ":1", "--allow-writes", " "], "Use codes"),
        (["sim:atv71", "sim:atv31", "--tcp", ":1"], "Several lines have the same ids"),
        (["sim:atv71", "--tcp", ":1", "--map", "1=2"], "there is no line 2"),
        (["sim:atv71", "sim:atv71"], "named twice"),
        (["sim:atv71", "-d", "1", "-p", "atv71"], "require --tcp, --metrics or --mqtt"),
        (["sim:atv71", "--every", "2"], "requires --metrics or --mqtt"),
        (["sim:atv71", "--mqtt-password-file", __file__], "requires --mqtt."),
        (["sim:atv71", "--metrics", ":1", "--mqtt-password-file", __file__], "requires --mqtt."),
        (["sim:atv71", "--metrics", "here"], "write HOST:PORT"),
        (["tcp:10.0.0.1", "sim:atv71", "--metrics", ":1", "-d", "1", "-p", "atv71"], "which line"),
    ],
)
def test_conflicting_options_exit_with_2(typed: list[str], reported: str) -> None:
    assert reported in refused(2, "serve", *typed)


def test_port_in_use_is_reported() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port: int = taken.getsockname()[1]
        place = f"127.0.0.1:{port}"
        reported = refused(3, "serve", "sim:atv71", "--tcp", place)
        assert f"Nothing can be served at {place}: Address already in use." in reported
        reported = refused(3, "serve", "sim:atv71", "--metrics", place)
        assert f"Metrics cannot be served at {place}: Address already in use." in reported


def test_line_without_a_keeper_is_reported(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    line = FakeLine()
    line.facts.unkept = "This program holds the line itself."
    opened = OpenLine("pump", line)
    monkeypatch.setattr("tui.session.connect.open_line.open_line", lambda *_, **__: opened)
    with ExitStack() as stack:
        serve._opened(stack, ServedLine("pump", "pump"), None)
    assert "drivepanel: This program holds the line itself." in capsys.readouterr().err


def test_address_without_a_host_is_loopback() -> None:
    assert host_port("502") == ("127.0.0.1", 502)
    assert host_port(":502") == ("127.0.0.1", 502)
    assert host_port("[::1]:502") == ("::1", 502)
    assert host_port("0.0.0.0:502") == ("0.0.0.0", 502)
    assert written_host_port("::1", 502) == "[::1]:502"


# Which drives are meant


SETTINGS = """
[lines]
bare = "tcp:10.0.0.3"
[lines.pump]
line = "tcp:10.0.0.1"
device = 2
profile = "powerdrive"
[lines.fan]
line = "tcp:10.0.0.1:502"
device = 5
profile = "varmeca"
[lines.belt]
line = "tcp:10.0.0.2"
profile = "proxidrive"
"""


@pytest.fixture
def settings(tmp_path: Path) -> None:
    file = tmp_path / "config" / "settings.toml"
    file.parent.mkdir()
    file.write_text(SETTINGS, "utf-8")


@pytest.mark.usefixtures("settings")
def test_name_includes_its_drive_and_the_profiles_of_its_line() -> None:
    both = {2: "powerdrive", 5: "varmeca"}
    (pump,) = served_lines(["pump"])
    assert (pump.name, pump.devices, pump.profiles) == ("pump", (2,), both)
    (pump,) = served_lines(["pump@1,2"])
    assert (pump.devices, pump.profiles) == ((1, 2), both)
    (pump,) = served_lines(["pump", "fan"])
    assert (pump.devices, pump.profiles) == ((2, 5), both)
    # the line, written out, is the same line
    (line,) = served_lines(["tcp:10.0.0.1@7"])
    assert (line.devices, line.profiles) == ((7,), both)
    (belt,) = served_lines(["belt@3"])
    assert (belt.devices, belt.profiles) == ((3,), {3: "proxidrive"})
    assert belt.usual_profile == "proxidrive"


@pytest.mark.usefixtures("settings")
def test_drives_are_read_with_their_profiles() -> None:
    (pump,) = served_lines(["pump@1,2"])
    assert [(drive.device, drive.profile_id) for drive in read_drives(pump, ())] == [
        (1, None),
        (2, "powerdrive"),
    ]
    assert "Use bare@1,2" in refused(2, "serve", "pump", "bare", "--metrics", ":1")
    (simulated,) = served_lines(["sim:atv71@1,atv31@4"])
    assert [drive.device for drive in read_drives(simulated, (1, 4))] == [1, 4]


@pytest.mark.usefixtures("settings")
def test_device_options_are_ids_of_the_gateway() -> None:
    lines = served_lines(["bare", "belt"])
    wish = GatewayWish("", 0, {101: (1, 3)}, GatewayRules())
    found = with_named(lines, wish, (101,), "varmeca")
    assert (found[0].devices, found[1].devices) == ((), (3,))
    assert found[1].profiles == {3: "varmeca"}
    with pytest.raises(click.UsageError, match="on which line"):
        with_named(lines, None, (1,), "varmeca")
