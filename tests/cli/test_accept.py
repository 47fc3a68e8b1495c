"""`drivepanel accept`: refusals before anything is sent, and its document."""

from __future__ import annotations

import asyncio
import json
from contextlib import nullcontext
from pathlib import Path
from types import SimpleNamespace

import pytest

from tui.cli.running import keyboard
from tui.cli.shared import asking
from tui.simulator import DriveSpec, Simulation

from .commands import ended, refused, run, tcp_line
from .printed import forms_of

HEAD = 'format = 1\nname = "T"\nprofile = "atv312"\n'
STILL = '\n[[steps]]\nkind = "refused"\nreferences = ["60Hz"]\n'
OCF = 9
"""Number of a fault of the Altivar 312."""
MOVING = '\n[[steps]]\nkind = "direction"\nhz = 10\nseconds = 2\n'


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "t.toml"
    path.write_text(HEAD + STILL + MOVING, "utf-8")
    return path


def person(monkeypatch: pytest.MonkeyPatch, answer: str) -> list[str]:
    """A person who answers each question the same; returns the questions."""
    questions: list[str] = []

    async def answered(question: str) -> str:
        questions.append(question)
        return answer

    monkeypatch.setattr(keyboard, "person_is_here", lambda: True)
    monkeypatch.setattr(keyboard, "ended_by_typing", lambda _: nullcontext())
    monkeypatch.setattr(asking, "typed_answer", answered)
    return questions


def test_check_shows_what_moves_and_opens_no_line(file: Path) -> None:
    output = run(0, "accept", file, "serial:/dev/none", "--check")
    assert "T: 2 steps. The motor runs for 4 s at most, without its stops." in output
    assert "Step 2: forward at 10 Hz, for 2 s." in output
    file.write_text(HEAD + STILL, "utf-8")
    assert run(0, "accept", file, "sim:atv312", "--check") == "T: 1 steps. None moves the motor.\n"


def test_test_without_arming_is_refused(file: Path) -> None:
    assert "--arm lets this one command write" in refused(5, "accept", file, "sim:atv312")


def test_test_without_a_person_is_refused(file: Path) -> None:
    output = refused(5, "accept", file, "sim:atv312", "--arm")
    assert "needs a person at the keyboard of a terminal" in output


@pytest.mark.parametrize(
    ("terminal", "group", "here"), [(True, 7, True), (True, 8, False), (False, 7, False)]
)
def test_person_is_here_at_a_terminal_in_the_foreground(
    terminal: bool, group: int, here: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(keyboard, "may_ask", lambda: terminal)
    monkeypatch.setattr(keyboard, "sys", SimpleNamespace(stdin=SimpleNamespace(fileno=lambda: 0)))
    system = SimpleNamespace(name="posix", tcgetpgrp=lambda _: group, getpgrp=lambda: 7)
    monkeypatch.setattr(keyboard, "os", system)
    assert keyboard.person_is_here() == here


def test_bad_file_is_refused_before_the_line_is_opened(file: Path) -> None:
    file.write_text(HEAD + MOVING.replace("10", "0"), "utf-8")
    output = refused(2, "accept", file, "serial:/dev/none", "--arm")
    assert "t.toml:7: step 1, hz: must be >= 0.1, not 0" in output


def test_existing_folder_is_refused(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    questions = person(monkeypatch, "y")
    output = refused(2, "accept", file, "sim:atv312", "--arm", "--out", tmp_path)
    assert "already exists. Name a new folder" in output
    assert questions == []


@pytest.mark.parametrize("option", ["--read-only", "-p"])
def test_drive_that_may_not_be_armed_or_is_another_is_refused_without_a_question(
    option: str, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    questions = person(monkeypatch, "y")
    words = {"--read-only": ("--read-only",), "-p": ("-p", "atv71")}[option]
    status = 2 if option == "-p" else 5
    refused(status, "accept", file, "sim:atv312", "--arm", "--json", *words)
    refused(5, "accept", file, "sim:atv71", "--arm", "--json")
    assert questions == []


def test_running_motor_is_refused(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    questions = person(monkeypatch, "y")
    with tcp_line("atv312@1", "--run", "20", "--any-settings") as line:
        output = ended(5, "accept", file, line, "--arm", "--json").stderr
    assert questions == []
    assert "Not tested: device 1 is running forward. Stop it first." in output


@pytest.mark.parametrize("late", [False, True])
def test_drive_in_fault_is_not_tested(
    late: bool, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Simulation([DriveSpec("atv312", 1)]) as simulation:
        host, port = simulation.serve_tcp()
        questions = person(monkeypatch, "y")

        async def trips(question: str) -> str:
            questions.append(question)
            simulation.drive(1).provoke(OCF)
            await asyncio.sleep(1.0)
            return "y"

        if late:
            monkeypatch.setattr(asking, "typed_answer", trips)
        else:
            simulation.drive(1).provoke(OCF)
        line = f"tcp:{host}:{port}"
        output = ended(5, "accept", file, line, "--arm", "--json").stderr
    assert len(questions) == late, "a fault is not asked about"
    assert f"is in fault. Clear its cause, then: drivepanel reset {line} -d 1 --arm" in output


def test_refusal_writes_no_folder(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    questions = person(monkeypatch, "n")
    folder = tmp_path / "out"
    output = ended(5, "accept", file, "sim:atv312", "--arm", "--json", "--out", folder).stderr
    assert "Step 2: forward at 10 Hz, for 2 s." in output
    assert "Not confirmed. Nothing was tested." in output
    assert questions == ["Carry out this test on device 1? [y/N]"]
    assert not folder.exists()


def test_result_at_standstill_is_printed_and_written(
    file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    person(monkeypatch, "y")
    file.write_text(HEAD + STILL, "utf-8")
    folder = tmp_path / "out"
    words = ("accept", file, "sim:atv312", "--arm", "--out", folder, "--by", "A. Person", "--json")
    done = ended(0, *words)
    assert forms_of(done.stdout) == {"AcceptDocument"}
    assert json.loads((folder / "t.json").read_text("utf-8")) == json.loads(done.stdout)
    assert {path.name for path in folder.iterdir()} == {"t.json", "t.md", "t.xml"}
    assert "- Tested by: A. Person" in (folder / "t.md").read_text("utf-8")
