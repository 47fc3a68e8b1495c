"""Typing errors, and the places where `-v` and `--json` are accepted."""

from __future__ import annotations

import json

import pytest

from tui.cli.command_index import COMMANDS
from tui.cli.shared.registration import GROUPS

from .commands import ended, invoked, refused, run

SIM = ("sim:atv71@2", "-d", "2")


@pytest.mark.parametrize(
    ("typed", "intended"), [("sttaus", "status"), ("Reed", "read"), ("wirte", "write")]
)
def test_misspelled_command_is_reported_and_opens_no_panel(typed: str, intended: str) -> None:
    for words in ((typed, *SIM), ("--read-only", typed), (typed,)):
        output = refused(2, *words)
        assert f"{typed}: no such command, did you mean {intended}?" in output


def test_unknown_word_is_reported() -> None:
    assert "xyzzy: no such command, and no LINE." in refused(2, "xyzzy")


def test_command_in_place_of_a_line_is_named() -> None:
    assert "scan is a command, not a LINE: type drivepanel scan." in refused(2, "panel", "scan")


@pytest.mark.parametrize("line", ["tcp:10.0.0.5", "COM3", "com3,9600", "/dev/ttyX", "sim:atv71"])
def test_line_argument_opens_the_panel(line: str) -> None:
    assert "The panel needs a terminal" in refused(2, line)


@pytest.mark.parametrize("place", range(4))
def test_verbose_option_is_accepted_anywhere(place: int) -> None:
    words = ["read", *SIM, "ACC"]
    words.insert(place, "-v")
    assert "3.0" in run(0, *words)


def test_verbose_option_after_two_dashes_is_an_argument() -> None:
    assert "'-v'" in refused(2, "read", *SIM, "--", "-v")


ERRORS = {
    "a word that is no command": ((), "sttaus", 2),
    "an option that is none": (("--nosuch",), "read", 2),
    "nothing at all": ((), "read", 2),
    "a code that is none": ((*SIM, "NOSUCH"), "read", 2),
    "nobody there": (("sim:atv71@2", "-d", "9", "ACC"), "read", 3),
    "not armed": ((*SIM, "ACC=5"), "write", 5),
    "a motor not armed": (SIM, "run", 5),
}


@pytest.mark.parametrize(("words", "command", "status"), ERRORS.values(), ids=ERRORS.keys())
def test_json_error_is_one_object_on_standard_output(
    words: tuple[str, ...], command: str, status: int
) -> None:
    done = ended(status, command, *words, "--json")
    reported = json.loads(done.stdout)
    known = command if command in COMMANDS else None
    assert reported == {"schema": 1, "command": known, "error": reported["error"], "status": status}
    assert done.stderr == f"drivepanel: {reported['error']}\n"


def test_error_without_json_prints_nothing_on_standard_output() -> None:
    assert ended(2, "read", *SIM, "NOSUCH").stdout == ""


def test_help_lists_each_command_under_its_heading() -> None:
    printed = invoked("--help").stdout
    headings = [f"\n{group}:\n" for group in GROUPS[:-1]]
    at = [printed.index(heading) for heading in headings]
    assert at == sorted(at)
    assert f"{GROUPS[-1]}:" not in printed, "each command has a group"
    for name, (_, group, summary) in COMMANDS.items():
        row = printed.index(f"  {name:<{max(map(len, COMMANDS))}}  {summary}")
        assert max(start for start in at if start < row) == printed.index(f"\n{group}:\n")


def test_help_lists_the_exit_statuses() -> None:
    reported = invoked("--help").stdout
    for status in ("0  done", "1  a difference", "70  internal error", "130  ended by Ctrl-C"):
        assert status in reported


def test_ctrl_c_is_not_reported_as_a_difference(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("tui.bus.transport.ports.list_ports", interrupted)
    done = ended(130, "ports", "--json")
    assert json.loads(done.stdout)["status"] == 130
    assert "Ended by Ctrl-C" in done.stderr


@pytest.mark.parametrize(
    "words",
    [
        ("write", "sim:v20", "P1120=fast", "--arm"),
        ("write", "sim:v20", "XYZQ=1", "--arm"),
        pytest.param(("reference", "sim:atv71", "fast", "--arm"), marks=pytest.mark.sweep),
        pytest.param(("block", "sim:atv71", "set", "1=LCR", "--arm"), marks=pytest.mark.sweep),
    ],
    ids=lambda words: f"{words[0]} {words[2]}",
)
def test_bad_value_and_bad_code_have_the_same_status(words: tuple[str, ...]) -> None:
    ended(2, *words)


@pytest.mark.sweep
def test_why_uses_the_profile_of_a_simulated_line() -> None:
    assert "Name the drive's profile" not in ended(0, "why", "sim:v20").stdout
