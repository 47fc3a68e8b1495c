"""Exit statuses, and errors in one or two lines on standard error."""

from __future__ import annotations

from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from tests.programs import drivepanel, free_port
from tui.bus.errors import RequestRefused
from tui.cli.shared.errors import reported
from tui.drive.errors import ValueRefused
from tui.session.logs import log_file, start_logging, stop_logging

from .commands import ended, tcp_line

SIM = "sim:atv71@2"

USAGE = {
    "no such LINE": ("read", "foo:", "ETA"),
    "no such device path": ("read", "./nosuch", "ETA"),
    "a baud rate that is none": ("read", "serial:/dev/ttyS0,fast", "ETA"),
    "no such simulated profile": ("read", "sim:nosuch", "ETA"),
    "an address past the last": ("read", "sim:atv71@300", "ETA"),
    "no such parameter": ("read", SIM, "-d", "2", "NOSUCH"),
    "no such profile": ("read", SIM, "-d", "2", "-p", "nosuch", "ETA"),
    "no LINE": ("read",),
    "no CODE": ("read", SIM),
    "device 0": ("read", SIM, "-d", "0", "ETA"),
    "no such option": ("read", SIM, "--nosuch"),
    "no such option of the panel": ("--nosuch",),
    "the panel without a terminal": (SIM,),
    "the panel on a device of no line": ("-d", "2"),
    "the demo without a terminal": ("demo",),
    "no such profile to show": ("profiles", "nosuch"),
    "a profile file that is none": ("profiles", "--check", __file__),
    "a profile file that is not there": ("profiles", "--check", "nosuch.toml"),
    "watching into a folder that is not there": (
        "watch", SIM, "-d", "2", "ETA", "--count", "1", "--csv", "nosuch/watch.csv",
    ),
    "a simulation nowhere": ("simulate", "atv71"),
    "a simulation in two places": ("simulate", "atv71", "--pty", "p", "--tcp", "127.0.0.1:0"),
    "a simulation of nothing": ("simulate", "--tcp", "127.0.0.1:0"),
    "a ghost of no file": ("simulate", "--from", "no.sqlite@2", "--tcp", "127.0.0.1:0"),
    "a script that is no file": (
        "simulate", "atv71", "--tcp", "127.0.0.1:0", "--script", "no-such-script",
    ),
    "a TCP place that is none": ("simulate", "atv71", "--tcp", "x"),
    "two simulated drives with one address": (
        "simulate", "atv71@2", "atv71@2", "--tcp", "127.0.0.1:0",
    ),
    "a set word without a value": ("simulate", "atv71", "--tcp", "127.0.0.1:0", "--set", "ACC"),
    "a set word too large": ("simulate", "atv71", "--tcp", "127.0.0.1:0", "--set", "ACC=70000"),
    "a set word that is none": ("simulate", "atv71", "--tcp", "127.0.0.1:0", "--set", "NOSUCH=1"),
    "a set word of a drive that is not there": (
        "simulate", "atv71@2", "--tcp", "127.0.0.1:0", "--set", "9:ACC=1",
    ),
    "a line fault that is none": (
        "simulate", "atv71", "--tcp", "127.0.0.1:0", "--line-fault", "fire=1",
    ),
    "a rate past 1": ("simulate", "atv71", "--tcp", "127.0.0.1:0", "--line-fault", "late=2"),
    "a format that is none": ("simulate", "atv71", "--tcp", "127.0.0.1:0", "--format", "9Z9"),
}  # fmt: skip


@pytest.mark.parametrize("arguments", USAGE.values(), ids=USAGE.keys())
def test_scan_usage_exits_with_2(arguments: tuple[str, ...]) -> None:
    expect(2, *arguments)


@pytest.mark.parametrize("command", [("read", "ETA"), ("watch", "ETA"), ("identify",)])
def test_unused_address_exits_with_3(command: tuple[str, ...]) -> None:
    expect(3, command[0], SIM, *command[1:], "-d", "9")


def test_unanswered_read_with_profile_exits_with_3() -> None:
    expect(3, "read", SIM, "ETA", "-d", "9", "-p", "atv71")


@pytest.mark.parametrize("extra", [(), ("--json",)])
def test_watch_without_any_value_exits_with_3(extra: tuple[str, ...]) -> None:
    watch = ("watch", SIM, "ETA", "-d", "9", "-p", "atv71", "--count", "2", "--every", "0.1")
    done = ended(3, *watch, *extra)
    assert done.stderr.startswith("drivepanel: Device 9 does not answer")


def test_closed_tcp_port_exits_with_3() -> None:
    expect(3, "identify", f"tcp:127.0.0.1:{free_port()}")


def test_missing_port_exits_with_3() -> None:
    expect(3, "identify", "/dev/ttyNOSUCH9")


def test_refusal_by_the_drive_exits_with_4() -> None:
    with tcp_line("atv71@2", "--protect", "ACC") as line:
        done = ended(4, "read", line, "ACC", "-d", "2")
        assert "ACC" in done.stderr
        assert "exception 2" in done.stderr
        # the drive answers, so watching it is not a line failure
        watch = ("watch", line, "ETA", "ACC", "-d", "2", "--count", "1", "--json")
        ended(0, *watch)


@pytest.mark.parametrize(("refusal", "status"), [(RequestRefused, 5), (ValueRefused, 2)])
def test_refusal_exits_with_its_status(refusal: type[Exception], status: int) -> None:
    @click.command()
    @reported
    def command() -> None:
        raise refusal("ACC: 9999 is above 999.9 s.")

    result = CliRunner().invoke(command)
    assert (result.exit_code, result.stdout) == (status, "")
    assert result.stderr == "drivepanel: ACC: 9999 is above 999.9 s.\n"


@pytest.mark.internal_errors
def test_unforeseen_error_is_logged() -> None:
    @click.command()
    @reported
    def command() -> None:
        raise KeyError("nobody thought of this")

    start_logging(0)
    result = CliRunner().invoke(command)
    assert result.exit_code == 70
    assert "Traceback" not in result.output
    assert str(log_file()) in result.stderr
    stop_logging()
    assert "nobody thought of this" in log_file().read_text()
    assert "Traceback" in log_file().read_text()


def test_unwritable_log_does_not_stop_commands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("DRIVEPANEL_STATE", str(tmp_path / "file"))
    assert drivepanel("profiles").returncode == 0
    assert drivepanel("profiles", "nosuch").returncode == 2


def test_read_only_lines_can_be_read() -> None:
    for command in (("read", SIM, "ETA"), ("identify", SIM), ("watch", SIM, "ETA", "--count", "1")):
        ended(0, *command, "-d", "2", "--read-only", "--json")


def expect(status: int, *arguments: str) -> None:
    """The command ends so, says why in one or two lines, and prints nothing else."""
    done = ended(status, *arguments)
    assert done.stdout == ""
    lines = done.stderr.splitlines()
    assert 1 <= len(lines) <= 2, done.stderr
    assert lines[0].startswith("drivepanel: ")


def test_unreadable_timeout_is_not_reported_as_off() -> None:
    """A Powerdrive is silent at the words of a port that it does not have."""
    both = ("powerdrive@1", "--protect", "15.07,11.63", "--any-settings")
    with tcp_line(*both) as line:
        output = ended(0, "status", line, "-p", "powerdrive").stdout
    assert "cannot be read: the drive may react when polling stops" in output
    with tcp_line("powerdrive@1", "--protect", "15.07", "--any-settings") as line:
        output = ended(0, "status", line, "-p", "powerdrive").stdout
    assert "none: it goes on without communication" in output
