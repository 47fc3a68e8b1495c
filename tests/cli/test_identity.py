"""A profile named by -p, against the identification of the drive."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

import pytest

from .commands import ended, held, motor, put, refused, run, tcp_line

pytestmark = pytest.mark.long

CMD, ACC = 8501, 9001


@pytest.fixture(scope="module")
def atv71() -> Iterator[str]:
    with tcp_line("atv71@1") as line:
        yield line


COMMANDS: dict[str, tuple[str, ...]] = {
    "read": ("read", "{line}", "ETA"),
    "watch": ("watch", "{line}", "ETA", "--count", "1"),
    "status": ("status", "{line}"),
    "write": ("write", "{line}", "ACC=7s", "--arm"),
    "a trial of write": ("write", "{line}", "ACC=7s", "--dry-run"),
    "backup": ("backup", "{line}", "{folder}/b.toml"),
    "report": ("report", "{line}", "{folder}/r.md"),
    "compare": ("compare", "{line}", "factory"),
    "reference": ("reference", "{line}", "20Hz", "--arm"),
    "reset": ("reset", "{line}", "--arm"),
    "block": ("block", "{line}"),
    "teach": ("teach", "{line}"),
}


@pytest.mark.parametrize("command", COMMANDS)
def test_write_to_a_drive_of_another_family_exits_with_5(
    atv71: str, command: str, tmp_path: object
) -> None:
    words = [text.format(line=atv71, folder=tmp_path) for text in COMMANDS[command]]
    before = [held(atv71, address) for address in (CMD, ACC)]
    output = refused(5, *words, "-p", "atv312")
    assert (
        "Device 1 says it is ATV71HU15M3, Altivar 71: the profile Altivar 312 does not fit it."
        in output
    )
    assert "-p atv71" in output
    assert [held(atv71, address) for address in (CMD, ACC)] == before


def test_restore_to_a_drive_of_another_family_is_refused(atv71: str, tmp_path: object) -> None:
    backup = f"{tmp_path}/b.toml"
    run(0, "backup", atv71, backup)
    output = refused(5, "restore", atv71, backup, "--arm", "-p", "atv312")
    assert "says it is ATV71HU15M3" in output


def test_run_of_a_drive_of_another_family_is_refused(atv71: str) -> None:
    output = motor(5, atv71, "--arm", "--for", "1", "-p", "atv312")
    assert "says it is ATV71HU15M3" in output
    assert held(atv71, CMD) == 0


@pytest.mark.parametrize("profile", ["atv71", "ATV71"])
def test_own_profile_of_the_drive_is_accepted(atv71: str, profile: str) -> None:
    assert "ETA" in run(0, "read", atv71, "ETA", "-p", profile)


def test_force_profile_reads_watches_and_writes_with_a_warning(atv71: str) -> None:
    put(atv71, ACC, 30)
    for words in (("read", atv71, "ETA"), ("watch", atv71, "ETA", "--count", "1")):
        done = ended(0, *words, "-p", "atv312", "--force-profile")
        assert "--force-profile uses this profile anyway" in done.stderr
        assert "ETA" in done.stdout
    done = ended(0, "write", atv71, "ACC=4s", "-p", "atv312", "--force-profile", "--arm")
    assert "says it is ATV71HU15M3" in done.stderr
    assert held(atv71, ACC) == 40


NEVER = ("run", "reference", "reset", "restore", "block", "teach", "backup", "report", "compare")


@pytest.mark.parametrize("command", NEVER)
def test_force_profile_with_a_moving_or_storing_command_exits_with_2(
    atv71: str, command: str
) -> None:
    more = {"reference": ["20Hz"], "restore": ["x"], "backup": ["x"], "report": ["x"]}
    words = [command, atv71, *more.get(command, ["factory"] if command == "compare" else [])]
    output = refused(2, *words, "-p", "atv312", "--force-profile")
    assert f"--force-profile does not apply to {command}" in output


@pytest.mark.parametrize("family", ["powerdrive", "varmeca"])
def test_family_without_identification_contradicts_no_profile(family: str) -> None:
    with tcp_line("powerdrive@1") as line:
        assert "10.40" in run(0, "read", line, "10.40", "-p", family)


def test_absent_drive_exits_with_3() -> None:
    with tcp_line("powerdrive@1") as line:
        refused(3, "read", line, "10.40", "-p", "powerdrive", "-d", "9")


@pytest.mark.parametrize("family", ["powerdrive", "ms300"])
def test_simulated_drive_that_does_not_identify_itself_has_the_profile_of_its_line(
    family: str,
) -> None:
    assert json.loads(run(0, "status", f"sim:{family}", "--json"))["profile"] == family
    stopped = json.loads(run(0, "stop", f"sim:{family}", "--json"))
    assert (stopped["profile"], stopped["stopped"]) == (family, True)


@pytest.mark.sweep
def test_confirm_names_no_option_that_was_not_given(atv71: str, tmp_path: Path) -> None:
    file = tmp_path / "evidence.json"
    done = ended(1, "profiles", "confirm", "atv312", atv71, "--to", file)
    assert "says it is ATV71HU15M3" in done.stderr
    assert "is compared with this profile anyway" in done.stderr
    assert "--force-profile" not in done.stderr
