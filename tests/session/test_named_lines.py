"""Lines that the settings file names: read, checked, and never in the way of a stop."""

from __future__ import annotations

import os
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given
from hypothesis import settings as how
from hypothesis import strategies as st

from tui.session.connect.named_lines import (
    LONGEST_SETTINGS,
    NamedLine,
    SettingsError,
    is_name,
    line_named,
    line_settings,
    line_to_stop,
    named_lines,
    profile_named,
    settings_file,
)

BY_ID = "serial:/dev/serial/by-id/usb-FTDI_FT232R_USB_UART_A50285BI-if00-port0,19200,8E1"
GOOD = f"""
[lines]
pump = "{BY_ID}"

[lines.Fan]
line = "tcp:192.168.0.10"
device = 5
profile = "Powerdrive"

[lines.mixer]
line = "tcp:192.168.0.10"
"""


def settings(text: str) -> Path:
    """The settings file with this text; its path."""
    path = settings_file()
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, "utf-8")
    return path


def test_name_refers_to_a_line_and_its_drive() -> None:
    path = settings(GOOD)
    assert line_named("pump") == NamedLine("pump", BY_ID)
    assert line_named("fan") == NamedLine("Fan", "tcp:192.168.0.10", 5, "powerdrive")
    assert line_named("FAN") == line_named("fan")
    assert [*named_lines()] == ["pump", "fan", "mixer"]
    assert line_settings().faults == ()
    assert line_settings().places["fan"] == f"{path}:5: lines.Fan"


@pytest.mark.parametrize("text", ["other", "tcp:192.168.0.10", "/dev/ttyUSB0", "COM3", "factory"])
def test_invalid_name_is_ignored(text: str) -> None:
    settings(GOOD)
    assert line_named(text) is None


def test_without_a_file_there_are_no_names() -> None:
    assert named_lines() == {}
    assert line_named("pump") is None


def test_changed_file_is_read_again() -> None:
    settings('lines.pump = "tcp:one"')
    assert named_lines()["pump"].line == "tcp:one"
    settings('lines.pump = "tcp:three"')
    assert named_lines()["pump"].line == "tcp:three"


def test_file_is_beside_the_profiles(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.delenv("DRIVEPANEL_CONFIG")
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert settings_file() == tmp_path / "drivepanel" / "settings.toml"


@pytest.mark.parametrize(
    ("row", "fault"),
    [
        ("bad = 5", "3: lines.bad: expected a LINE in quotes"),
        ('COM3 = "tcp:x"', "3: lines.COM3: a name is"),
        ('factory = "tcp:x"', "3: lines.factory: a name is"),
        ('"with space" = "tcp:x"', "3: lines.with space: a name is"),
        ('PUMP = "tcp:x"', "3: lines.PUMP: pump has this name already"),
        ('bad = "pump"', "3: lines.bad: 'pump' is not a LINE."),
        ('bad = { line = "tcp:x", adress = 3 }', "3: lines.bad.adress: only line, device, profile"),
        ('bad = { line = "tcp:x", device = "5" }', "3: lines.bad.device: expected"),
        ('bad = { line = "tcp:x", device = 248 }', "3: lines.bad.device: expected"),
        (
            'bad = { line = "tcp:x", device = true }',
            "3: lines.bad.device: expected",
        ),
        (
            'bad = { line = "tcp:x", profile = 3 }',
            "3: lines.bad.profile: expected the id",
        ),
        ("bad = { device = 3 }", "3: lines.bad: expected a LINE in quotes"),
        ("[line]", "3: line: only a table [lines]"),
    ],
)
def test_error_has_file_line_and_key_and_affects_no_other_name(row: str, fault: str) -> None:
    path = settings(f'[lines]\npump = "tcp:gateway"\n{row}\n')
    (reported,) = line_settings().faults
    assert reported.startswith(f"{path}:{fault}")
    assert named_lines() == {"pump": NamedLine("pump", "tcp:gateway")}
    with pytest.raises(SettingsError, match=r"settings\.toml:3"):
        line_named("bad")


@pytest.mark.parametrize(
    "text",
    [
        "[lines\n",
        'lines.pump = "tcp:x"\nx = ',
        "x = " + "[" * 90_000,
        "\0",
        "#" * (LONGEST_SETTINGS + 1),
    ],
    ids=["table", "cut short", "deep", "zero", "long"],
)
def test_invalid_settings_file_is_reported_and_ends_nothing(text: str) -> None:
    path = settings(text)
    (reported,) = line_settings().faults
    assert reported.startswith(str(path))
    assert named_lines() == {}
    assert line_named("/dev/ttyUSB0") is None


@pytest.mark.parametrize("what", ["pipe", "zero", "folder", "bytes", "gone"])
def test_path_that_is_not_a_file_is_reported_without_blocking(what: str) -> None:
    path = settings_file()
    path.parent.mkdir(parents=True)
    match what:
        case "pipe":
            os.mkfifo(path)
        case "zero":
            path.symlink_to("/dev/zero")
        case "folder":
            path.mkdir()
        case "bytes":
            path.write_bytes(b"[lines]\npump = '\xff'\n")
        case "gone":
            path.symlink_to("gone.toml")
    assert named_lines() == {}
    assert bool(line_settings().faults) is (what != "gone")


BROKEN = {
    "string": 'lines.pump = "tcp:x"\nbroken',
    "pair": '[lines]\npump = "tcp:x"\n[',
    "table": "[lines.pump]\nline = 'tcp:x'\nbroken\n",
    "inline": '[lines]\npump = { line = "tcp:x" }\nbroken',
    "quoted": '["lines"]\n"pump" = "tcp:x"\nbroken',
}


@pytest.mark.parametrize("text", BROKEN.values(), ids=BROKEN)
def test_stop_finds_its_line_in_a_broken_file(text: str) -> None:
    text = text.replace('["lines"]', "[lines]")
    settings(text)
    with pytest.raises(SettingsError):
        line_named("pump")
    assert line_to_stop("pump") == NamedLine("pump", "tcp:x")


@pytest.mark.parametrize(
    "text",
    [
        '[lines.pump]\nline = "tcp:x"\ndevice = 7\nprofile = "powerdrive"\nbroken',
        '[lines]\npump = { line = "tcp:x", device = 7, profile = "powerdrive" }\n[',
        '[lines.pump]\nline = "tcp:x"\ndevice = 7\nprofile = "powerdrive"\ntypo = 1',
        '[lines.fan]\nline = "tcp:y"\ndevice = 9\n'
        '[lines.pump]\nline = "tcp:x"\ndevice = 7\nprofile = "powerdrive"\n'
        "[lines.x]\ndevice = 3\n[",
    ],
)
def test_stop_finds_its_drive_in_a_broken_file(text: str) -> None:
    settings(text)
    assert line_to_stop("pump") == NamedLine("pump", "tcp:x", 7, "powerdrive")


@pytest.mark.parametrize("device", ['"x"', "five", "300", "", "-2"])
def test_stop_of_an_unreadable_drive_says_what_to_type(device: str) -> None:
    settings(f'[lines.pump]\nline = "tcp:x"\ndevice = {device}\n')
    with pytest.raises(SettingsError, match="stop tcp:x -d ADDRESS"):
        line_to_stop("pump")


def test_stop_of_an_unknown_name_is_refused() -> None:
    settings("[lines")
    with pytest.raises(SettingsError):
        line_to_stop("pump")
    settings(GOOD)
    assert line_to_stop("other") is None


def test_profile_of_a_drive_follows_line_and_address() -> None:
    settings(GOOD)
    assert profile_named("tcp:192.168.0.10:502", 5) == "powerdrive"
    assert profile_named("tcp:192.168.0.10:502", 6) is None
    assert profile_named("tcp:192.168.0.11:502", 5) is None


@pytest.mark.parametrize("text", ["a", "pump-2", "Pump_2", "COM", "COM3x"])
def test_valid_names_are_accepted(text: str) -> None:
    assert is_name(text)


@pytest.mark.parametrize("text", ["", "2pump", "pump.toml", "a b", "com12", "x" * 33, "tcp:x", "é"])
def test_invalid_names_are_refused(text: str) -> None:
    assert not is_name(text)


SIGNS = [*"[]{}=\".'\n,\\#5x\0é", "", "lines"]


@how(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=300)
@given(st.lists(st.tuples(st.integers(0, len(GOOD)), st.sampled_from(SIGNS)), max_size=12))
def test_random_content_is_reported_in_a_sentence(changes: list[tuple[int, str]]) -> None:
    text = GOOD
    for at, sign in changes:
        text = text[:at] + sign + text[at + 1 :]
    settings(text)
    found = line_settings()
    assert all("\n" not in fault for fault in found.faults)
    for name in ("pump", "fan", "mixer"):
        with suppress(SettingsError):
            reported = line_to_stop(name)
            assert reported is None or (reported.line and reported.device in (None, *range(1, 248)))
