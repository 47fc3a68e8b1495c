"""Taking a drive's control from its terminals, and giving it back, on the command line."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest

from tui.drive.control_source import control_taking
from tui.drive.profile import library

from .commands import held, invoked, motor, put, refused, run, tcp_line

pytestmark = pytest.mark.long

DRIVE = ("-p", "powerdrive")
COMMAND_WORD, IN_FORCE = 641, 642


@pytest.fixture
def line() -> Iterator[str]:
    """A simulated Powerdrive at rest, commanded at its terminals, that several commands reach."""
    with tcp_line("powerdrive@1") as served:
        yield served


@pytest.mark.sweep
def test_control_is_taken_and_given_back(line: str) -> None:
    output = motor(5, line, *DRIVE, "--arm", "--for", "1")
    assert "run --take-control takes the control first." in output
    assert held(line, COMMAND_WORD) == 0
    status = run(0, "status", line, *DRIVE)
    assert "drivepanel run --take-control takes it, in the panel t on Monitor." in status
    reported = motor(0, line, *DRIVE, "--arm", "--take-control", "--for", "1")
    assert reported.index("Control by Modbus") < reported.index("Unlock and run forward:")
    assert "stop --give-back --arm gives it back" in reported
    assert reported.rstrip().endswith("stopped.")
    assert held(line, IN_FORCE) == 1
    control = json.loads(run(0, "status", line, *DRIVE, "--json"))["control"]
    assert control == {
        "taken": True, "take": "run --take-control", "give_back": "stop --give-back --arm",
    }  # fmt: skip
    back = run(0, "stop", line, *DRIVE, "--give-back", "--arm")
    assert "stopped." in back
    assert "Control by the terminals" in back
    assert held(line, IN_FORCE) == 0


def test_stop_without_arming_gives_nothing_back_exits_with_6(line: str) -> None:
    put(line, IN_FORCE, 1)
    put(line, COMMAND_WORD, 0x0003)
    done = invoked("stop", line, *DRIVE, "--give-back")
    assert done.exit_code == 6
    assert "stopped." in done.stdout
    assert "Not given back" in done.stderr
    assert "Sent by this command: " in done.stderr
    assert "waits at the terminals" in done.stderr
    assert held(line, COMMAND_WORD) & 0x002E == 0
    assert held(line, IN_FORCE) == 1


def test_taking_control_that_would_start_the_motor_exits_with_5(line: str) -> None:
    put(line, COMMAND_WORD, 0x0003)
    output = motor(5, line, *DRIVE, "--arm", "--take-control")
    assert "the motor would start as soon as that word takes effect" in output
    assert held(line, IN_FORCE) == 0


def test_giving_back_several_drives_exits_with_2() -> None:
    refused(2, "stop", "sim:powerdrive", "--all", "--give-back")


def test_taking_control_of_a_family_without_it_exits_with_5() -> None:
    output = motor(5, "sim:atv71@1", "--arm", "--take-control")
    assert "has no control to take" in output


def test_giving_back_control_of_a_family_without_it_stops_and_exits_with_6() -> None:
    output = refused(6, "stop", "sim:atv71@1", "--give-back", "--arm")
    assert "has no control to give back" in output


def test_advice_to_arm_is_only_for_a_family_that_can_give_back() -> None:
    output = refused(6, "stop", "sim:atv71@1", "--give-back")
    assert "has no control to give back" in output
    assert "--arm" not in output.replace("reset --arm", "")


def test_control_that_is_given_back_is_not_offered_again() -> None:
    profile = library.load("atv21")
    held = control_taking(profile, {"FA00": 0x0000})
    commanded = control_taking(profile, {"FA00": 0xC000})
    assert held is not None
    assert (held.taken, held.is_given_back) == (False, True)
    assert commanded is not None
    assert (commanded.taken, commanded.is_given_back) == (None, False)


def test_status_omits_control_for_a_family_without_it() -> None:
    assert "Control  " not in run(0, "status", "sim:atv71@1")
    assert json.loads(run(0, "status", "sim:atv71@1", "--json"))["control"] is None


@pytest.mark.parametrize(("answer", "status"), [(True, 0), (False, 5)])
def test_unproved_profile_writes_only_if_a_person_confirms_it(
    monkeypatch: pytest.MonkeyPatch, answer: bool, status: int
) -> None:
    questions: list[str] = []

    async def answered(question: str) -> bool:
        questions.append(question)
        return answer

    monkeypatch.setattr("tui.cli.shared.profile_choice.may_ask", lambda: True)
    monkeypatch.setattr("tui.cli.shared.profile_choice.says_yes", answered)
    with tcp_line("ms300@1") as line:
        result = invoked("write", line, "-p", "ms300", "01-00=50", "--arm")
    assert result.exit_code == status, result.stderr
    (question,) = questions
    assert question.endswith("Write to device 1?")


def test_simulated_drive_of_an_unproved_profile_is_armed_without_a_question() -> None:
    run(0, "write", "sim:ms300", "01-00=50", "--arm")
