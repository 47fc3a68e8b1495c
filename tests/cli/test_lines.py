"""Lines by their names and out of the environment; lines that are not as they were."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest
from click.shell_completion import ShellComplete

from tests.adapters import Adapters, adapters
from tests.programs import drivepanel
from tests.sweeps import kept
from tui.bus.model import LastMinute
from tui.bus.program import Program
from tui.bus.share import beside
from tui.bus.share.beside import LineLook
from tui.bus.share.place import Owner
from tui.cli.main import main
from tui.cli.shared.line_argument import is_line
from tui.session.connect import share_place
from tui.session.connect.known_lines import load_memory
from tui.session.connect.named_lines import settings_file

from .commands import held, invoked, refused, run, tcp_line

pytestmark = pytest.mark.long

__all__ = ["adapters"]

ACC = 9001


@pytest.fixture
def line() -> Iterator[str]:
    """A line with two drives, one of which does not identify itself."""
    with tcp_line("atv71@1", "powerdrive@5") as found:
        yield found


def settings(text: str) -> None:
    path = settings_file()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, "utf-8")


def named(line: str) -> None:
    """`pump` is the first drive of a line, `fan` the other."""
    settings(
        f'[lines]\npump = "{line}"\n'
        f'[lines.fan]\nline = "{line}"\ndevice = 5\nprofile = "powerdrive"\n'
    )


def test_name_replaces_a_line(line: str) -> None:
    named(line)
    assert json.loads(run(0, "read", "pump", "ACC", "--json"))["line"] == line
    assert json.loads(run(0, "identify", "PUMP", "--json"))["profile"] == "atv71"
    reported = json.loads(run(0, "read", "fan", "5.01", "--json"))
    assert (reported["device"], reported["profile"]) == (5, "powerdrive")


def test_typed_option_overrides_the_named_line(line: str) -> None:
    named(line)
    assert json.loads(run(0, "read", "fan", "ACC", "-d", "1", "--json"))["profile"] == "atv71"
    assert "-p" in refused(2, "read", "pump", "5.01", "-d", "5")
    assert "no parameter '1.99'" in refused(2, "read", "fan", "1.99", "-p", "varmeca")


def test_named_drive_can_be_compared_and_restored_to(line: str, tmp_path: Path) -> None:
    named(line)
    file = tmp_path / "fan.toml"
    run(0, "backup", "fan", file)
    assert 'profile = "powerdrive"' in file.read_text("utf-8")
    assert invoked("compare", file, "fan").exit_code == 0
    assert "0 to write" in run(0, "restore", "fan", file, "--dry-run")


@pytest.mark.sweep
def test_environment_selects_the_line(
    line: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    assert "Missing argument 'LINE'" in refused(2, "identify")
    monkeypatch.setenv("DRIVEPANEL_LINE", line)
    assert "atv71" in run(0, "identify")
    assert {*json.loads(run(0, "read", "ACC", "DEC", "--json"))["values"]} == {"ACC", "DEC"}
    assert "ACC" in run(0, "read", "ACC")
    assert "ACC" in run(0, "read", line, "ACC")
    file = tmp_path / "pump.toml"
    run(0, "backup", file)
    run(0, "backup", file, "--force")  # that it exists makes no line of it
    assert invoked("compare", file).exit_code == 0
    assert "to write" in run(0, "restore", file, "--dry-run")
    assert "ACC" in run(0, "write", "ACC=4", "DEC=4", "--dry-run")
    assert "stopped" in run(0, "stop")
    assert "NMA1" in run(0, "block")


def test_typed_line_overrides_the_environment(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DRIVEPANEL_LINE", "tcp:127.0.0.1:1")
    assert "atv71" in run(0, "identify", line)
    assert "Missing argument 'CODE...'" in refused(2, "read", line)
    named(line)
    assert "ACC" in run(0, "read", "pump", "ACC")
    assert "Missing argument 'CODE...'" in refused(2, "read", "pump")


def test_environment_may_have_a_name(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    named(line)
    monkeypatch.setenv("DRIVEPANEL_LINE", "fan")
    assert json.loads(run(0, "read", "5.01", "--json"))["device"] == 5


def test_unknown_name_is_reported_with_the_known_names(line: str) -> None:
    named(line)
    reported = refused(2, "read", "pumb", "ACC")
    assert "'pumb' is not a LINE or a name from" in reported
    assert "pump, fan" in reported


def test_settings_error_is_reported_only_if_a_name_is_used(
    line: str,
) -> None:
    settings(f'[lines]\npump = "{line}"\nfan = 5\n')
    reported = refused(2, "read", "fan", "ACC")
    assert "settings.toml:3: lines.fan: expected a LINE in quotes" in reported
    for where in ("pump", line):
        done = invoked("read", where, "ACC")
        assert done.exit_code == 0
    assert "only stops are written" not in done.stderr


@pytest.mark.parametrize("profile", ["", 'profile = "gone"'])
def test_broken_settings_do_not_block_a_stop(line: str, profile: str) -> None:
    settings(f'[lines.fan]\nline = "{line}"\ndevice = 5\n{profile}\n[broken')
    refused(2, "read", "fan", "5.01")
    done = invoked("stop", "fan")
    # the profile that the file names is not known: the family is a guess
    assert done.exit_code == 4, done.output
    assert "Device 5: sent first" in done.stdout
    assert "settings.toml" in done.stderr
    assert "stopped" in run(0, "stop", line)


def test_profile_of_a_name_applies_to_its_drive_only_in_stop_all(line: str) -> None:
    settings(f'[lines.fan]\nline = "{line}"\ndevice = 1\nprofile = "atv71"\n')
    reported = refused(4, "stop", "fan", "--all", "--addresses", "5")
    assert "Read as Powerdrive, it is at standstill" in reported


def test_lines_lists_named_and_remembered_lines(line: str) -> None:
    assert "No line has a name" in run(0, "lines")
    named(line)
    run(0, "identify", "pump")
    reported = json.loads(run(0, "lines", "--json"))
    assert reported["settings"] == str(settings_file())
    assert reported["faults"] == []
    assert reported["lines"] == [
        {"name": "pump", "line": line, "device": None, "profile": None},
        {"name": "fan", "line": line, "device": 5, "profile": "powerdrive"},
    ]
    (known,) = reported["known"]
    assert (known["line"], known["drives"][0]["profile"]) == (line, "atv71")
    text = run(0, "lines")
    assert "fan" in text
    assert "device 5  powerdrive" in text
    assert "ATV71" in text


def test_lines_reports_settings_errors() -> None:
    settings(
        '[lines]\nstop = "tcp:x"\nbad = "tcp:x:y"\nfan = { line = "tcp:x", profile = "gone" }\n'
        "old = 5\n"
    )
    done = invoked("lines")
    assert done.exit_code == 2
    for row, key in ((2, "stop"), (3, "bad"), (4, "fan"), (5, "old")):
        assert f"settings.toml:{row}: lines.{key}: " in done.stderr
    done = invoked("lines", "--json")
    assert done.exit_code == 2
    assert len(json.loads(done.stdout)["faults"]) == 4


def test_ports_lists_the_lasting_names_of_adapters(
    adapters: Adapters, monkeypatch: pytest.MonkeyPatch
) -> None:
    from tui.bus.transport.ports import PortInfo

    ports = [
        adapters.plug("ttyUSB0", "1.1", serial="A5"),
        adapters.plug("ttyUSB1", "1.2", product="7523"),
    ]
    monkeypatch.setattr(
        "tui.bus.transport.ports.list_ports", lambda: [PortInfo(p, "adapter") for p in ports]
    )
    item, two = json.loads(run(0, "ports", "--json"))
    assert item["lasting"].endswith("by-id/usb-FTDI_6001_A5-if00-port0")
    assert item["adapter"] == "0403:6001 A5"
    assert two["lasting"].endswith("by-path/pci-usb-1.2-port0")
    text = run(0, "ports")
    assert f"always {item['lasting']}" in text
    assert text.count("without a serial number of its own") == 1


# Lines that are not as they were


def swapped(before: str) -> None:
    """The line was used with another drive before."""
    run(0, "identify", before)
    memory = load_memory()
    text = (memory_file := _memory_file()).read_text("utf-8")
    assert memory.lines
    memory_file.write_text(text.replace("ATV71HU15M3", "ATV71HD22N4"), "utf-8")


def _memory_file() -> Path:
    from tui.session.connect.known_lines import memory_file

    return memory_file()


def test_read_of_a_changed_drive_warns_and_continues(line: str) -> None:
    swapped(line)
    for command in (["read", line, "ACC"], ["identify", line], ["status", line]):
        done = invoked(*command)
        assert done.exit_code == 0
        assert "Device 1 was ATV71HD22N4" in done.stderr
        assert "--accept-line" in done.stderr
    assert "ACC" in run(0, "write", line, "ACC=7", "--dry-run")


@pytest.mark.parametrize(
    "command",
    kept(
        [
            ["write", "ACC=7"],
            ["run", "--for", "1"],
            ["reference", "20Hz"],
            ["reset"],
            ["block", "set", "NMA3=LCR"],
        ],
        ["write", "ACC=7"],
        ["run", "--for", "1"],
    ),
    ids=lambda command: command[0],
)
def test_write_to_a_changed_drive_is_refused(line: str, command: list[str]) -> None:
    before = held(line, ACC)
    swapped(line)
    done = drivepanel(command[0], line, *command[1:], "--arm")
    assert done.returncode == 5, done.stderr
    assert "Until you confirm, only stops are written. Device 1 was ATV71HD22N4" in done.stderr
    assert "--accept-line takes the line as it is now" in done.stderr
    assert done.stderr.count("Device 1 was") == 1
    assert held(line, ACC) == before


def test_stop_is_sent_to_a_changed_drive(line: str) -> None:
    swapped(line)
    assert "stopped" in run(0, "stop", line)
    assert "stopped" in run(0, "stop", line, "--all", "--addresses", "1")


def test_accepted_line_stays_accepted(line: str) -> None:
    swapped(line)
    refused(5, "write", line, "ACC=7", "--arm")
    run(0, "write", line, "ACC=7", "--arm", "--accept-line")
    assert held(line, ACC) == 70
    done = invoked("write", line, "ACC=8", "--arm")
    assert done.exit_code == 0
    assert "only stops are written" not in done.stderr


def test_stop_reads_no_file(line: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def hangs(*_: object) -> None:
        raise AssertionError("a disk that hangs")

    monkeypatch.setattr("tui.session.connect.known_lines.read_small_text", hangs)
    monkeypatch.setattr("tui.session.connect.named_lines.read_small_text", hangs)
    assert "stopped" in run(0, "stop", line)


def completed(typed: str) -> list[str]:
    """Completions for a line whose last word has begun."""
    *words, incomplete = typed.split(" ")
    found = ShellComplete(main, {}, "drivepanel", "_X").get_completions(words, incomplete)
    return [item.value for item in found]


def test_names_and_codes_of_their_drives_are_completed() -> None:
    assert "pump" not in completed("read p")
    named("tcp:gateway")
    assert completed("read pu") == ["pump"]
    assert "pump" in completed("pu")
    assert "5.01" in completed("read fan 5.0")
    settings("[broken")
    assert completed("read pu") == []


def test_name_opens_the_panel_but_an_unknown_word_does_not() -> None:
    assert not is_line("pump")
    named("tcp:gateway")
    assert is_line("pump")
    assert not is_line("pumb")
    assert "no such command" in refused(2, "pumb")
    settings("[broken")
    assert is_line("pump")
    assert "settings.toml:1" in refused(2, "pump")


def test_open_line_shows_the_replies_of_its_last_minute(monkeypatch: pytest.MonkeyPatch) -> None:
    owners = {
        "tcp:a:502": LineLook([], LastMinute(good=19, lost=1)),
        "tcp:b:502": LineLook([]),
        "tcp:c:502": None,
    }
    held = [Owner(1, Program("k", "keeper", 7), "", line=line) for line in owners]
    monkeypatch.setattr(share_place, "owners", lambda: held)
    monkeypatch.setattr(beside, "line_look", lambda owner: owners[owner.line])
    minutes = [load["last_minute"] for load in json.loads(run(0, "lines", "--json"))["open"]]
    assert minutes[1:] == [None, None]
    assert (minutes[0]["share"], minutes[0]["good"], minutes[0]["lost"]) == (0.95, 19, 1)
    text = run(0, "lines")
    assert text.count("replies good") == 1
    assert "19 of 20 replies good in the last minute" in text
