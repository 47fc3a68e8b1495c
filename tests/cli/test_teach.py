"""`drivepanel teach`, and running a drive with its learned scales."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from .commands import ended, held, motor, put, refused, run, tcp_line

pytestmark = pytest.mark.long

DRIVE = ("-p", "powerdrive")
PRESET, COMMAND_WORD, IN_FORCE = 120, 641, 642


@pytest.fixture
def line() -> Iterator[str]:
    """A simulated Powerdrive at rest, commanded at its terminals, that several commands reach."""
    with tcp_line("powerdrive@1") as served:
        yield served


def teach(line: str, *arguments: str, status: int = 0) -> str:
    """Run the command; return its standard output."""
    return run(status, "teach", line, *DRIVE, *arguments)


def preset_taught(line: str) -> None:
    """1.21 in rpm, from two looks."""
    teach(line, "1.21", "900", "rpm")
    put(line, PRESET, 600)
    assert "1 count is 1 rpm" in teach(line, "1.21", "600")


def test_two_readings_teach_the_scale_and_mark_values(line: str) -> None:
    assert teach(line) == "Nothing is taught.\n"
    assert "Enter another value of the display" in teach(line, "1.21", "900 rpm")
    assert "taught" not in run(0, "read", line, *DRIVE, "1.21")
    put(line, PRESET, 600)
    reported = teach(line, "1.21", "600")
    assert "1.21: 1 count is 1 rpm (raw 900 at 900 rpm, raw 600 at 600)." in reported
    row = run(0, "read", line, *DRIVE, "1.21").splitlines()[1]
    assert "600  rpm" in row
    assert row.rstrip().endswith("taught")
    value = json.loads(run(0, "read", line, *DRIVE, "1.21", "1.06", "--json"))["values"]
    assert (value["1.21"]["value"], value["1.21"]["unit"], value["1.21"]["taught"]) == (
        600, "rpm", True,
    )  # fmt: skip
    assert (value["1.06"]["unit"], value["1.06"]["taught"]) == ("", False)
    watched = run(0, "watch", line, *DRIVE, "1.21", "--count", "1", "--every", "0.1")
    assert "1.21 600 rpm taught" in watched
    status = run(0, "status", line, *DRIVE)
    assert "1.21              Preset reference 1 600 rpm taught" in status
    values = json.loads(run(0, "status", line, *DRIVE, "--json"))["values"]
    assert values["1.21"]["taught"] is True


def test_csv_column_with_a_learned_scale_is_marked(line: str, tmp_path: Path) -> None:
    preset_taught(line)
    file = tmp_path / "watch.csv"
    run(0, "watch", line, *DRIVE, "1.21", "--count", "1", "--every", "0.1", "--csv", file)
    head, row = file.read_text("utf-8").splitlines()
    assert "1.21 [rpm, taught]" in head
    assert "600" in row


def test_teach_result_is_printed_as_json(line: str) -> None:
    first = json.loads(teach(line, "1.21", "90.0", "Hz", "--json"))
    assert (first["lesson"], first["taught"]) == ("first", None)
    put(line, PRESET, 600)
    second = json.loads(teach(line, "1.21", "60.0", "--json"))
    assert second["lesson"] == "taught"
    assert second["taught"] == {"scale": 0.1, "unit": "Hz", "signed": None}
    known = json.loads(teach(line, "--json"))
    assert known["taught"]["1.21"]["looks"][1] == {"raw": 600, "shown": 60.0, "unit": None}
    assert known["reference"] is None


def test_negative_number_is_a_value_not_an_option(line: str) -> None:
    put(line, PRESET, 0x10000 - 900)
    assert "raw 64636 at -90.0 Hz" in teach(line, "1.21", "-90.0", "Hz")
    put(line, PRESET, 300)
    assert "It has a sign." in teach(line, "1.21", "30.0")


def test_disagreeing_reading_exits_with_1(line: str) -> None:
    preset_taught(line)
    teach(line, "1.21", "--reference")
    output = teach(line, "1.21", "61.5", status=1)
    assert "Before: 1 count is 1 rpm" in output
    assert teach(line) == "Nothing is taught.\n"
    assert "No available manual" in refused(5, "reference", line, *DRIVE, "600rpm", "--arm")


def test_forget_removes_the_learned_scale(line: str) -> None:
    preset_taught(line)
    assert "shown raw again" in teach(line, "1.21", "--forget")
    assert "was not taught" in teach(line, "1.21", "--forget")


@pytest.mark.parametrize(
    ("status", "arguments", "why"),
    [
        (2, ("NOSUCH", "1"), "no parameter"),
        (2, ("--forget",), "Which CODE?"),
        (2, ("1.21", "5", "--forget"), "Either"),
        (2, ("10.40", "3"), "no scale that can be learned"),
        (2, ("15.07", "3"), "is already known"),
        (2, ("1.21", "fast"), "not a displayed value"),
        (2, ("5.01", "--reference"), "Use 1.21"),
        (5, ("1.21", "--reference"), "not learned yet"),
    ],
)
def test_invalid_teach_arguments_are_refused(
    line: str, status: int, arguments: tuple[str, ...], why: str
) -> None:
    assert why in refused(status, "teach", line, *DRIVE, *arguments)


def test_damaged_scale_file_is_reported_and_blocks_no_command(line: str, own_folders: Path) -> None:
    preset_taught(line)
    (kept,) = (own_folders / "state" / "taught").glob("*.json")
    kept.write_text("{", "utf-8")
    done = ended(0, "read", line, *DRIVE, "1.21")
    assert "cannot be read" in done.stderr
    assert "taught" not in done.stdout.splitlines()[1]
    assert kept.read_text("utf-8") == "{"
    assert "not been" not in teach(line, "1.21", "600 rpm")
    assert kept.with_suffix(".damaged1").read_text("utf-8") == "{"


# Running by it


def test_reference_is_written_to_the_confirmed_preset(line: str) -> None:
    assert "teach 1.21" in refused(5, "reference", line, *DRIVE, "20", "--arm")
    preset_taught(line)
    output = refused(5, "reference", line, *DRIVE, "700rpm", "--arm")
    assert "1.21 --reference" in output
    assert held(line, PRESET) == 600
    confirmed = teach(line, "1.21", "--reference")
    assert "1.21 now takes the reference, in rpm." in confirmed
    assert "bit 8 of 6.42" in confirmed
    error = refused(2, "reference", line, *DRIVE, "20Hz", "--arm")
    assert "1.21 takes its reference in rpm. Type it like 900rpm." in error
    assert "Reference 20 rpm (1.21)" in run(0, "reference", line, *DRIVE, "20", "--arm")
    assert "Reference 700 rpm (1.21)" in run(0, "reference", line, *DRIVE, "700rpm", "--arm")
    assert held(line, PRESET) == 700
    teach(line, "--no-reference")
    refused(5, "reference", line, *DRIVE, "800rpm", "--arm")
    assert held(line, PRESET) == 700


@pytest.mark.sweep
def test_run_takes_control_uses_the_learned_reference_and_gives_it_back(line: str) -> None:
    output = motor(5, line, *DRIVE, "--arm", "--for", "1")
    assert "run --take-control takes the control first." in output
    assert held(line, COMMAND_WORD) == 0
    status = run(0, "status", line, *DRIVE)
    assert "drivepanel run --take-control takes it, in the panel t on Monitor." in status
    preset_taught(line)
    teach(line, "1.21", "--reference")
    reported = motor(
        0, line, *DRIVE, "--arm", "--take-control", "--reference", "750rpm", "--for", "1"
    )
    order = ("Control by Modbus", "Reference 750 rpm (1.21)", "Unlock and run forward:")
    places = [reported.index(text) for text in order]
    assert places == sorted(places)
    assert "stop --give-back --arm gives it back" in reported
    assert "1.21 Preset reference 1 750 rpm taught" in reported
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


def test_each_run_command_selects_the_confirmed_preset(line: str, own_folders: Path) -> None:
    preset_taught(line)
    teach(line, "1.21", "--reference")
    motor(0, line, *DRIVE, "--arm", "--take-control", "--for", "0.5")
    words = [row["new_raw"] for row in journal(own_folders) if row["code"] == "6.42"]
    assert words[0] == 0x0103
    assert words[-1] & 0x002F in (0, 1), "the stop that followed"


def journal(folders: Path) -> list[dict[str, Any]]:
    """Registers written so far."""
    text = (folders / "state" / "journal.jsonl").read_text("utf-8")
    return [json.loads(entry) for entry in text.splitlines()]
