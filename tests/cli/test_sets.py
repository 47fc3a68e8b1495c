"""Settings and parameter sets on the command line: back up, compare, restore, write."""

from __future__ import annotations

import csv
import io
import json
import os
import re
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.programs import DRIVEPANEL, PATIENCE
from tests.sources import ROOT
from tests.sweeps import kept
from tui.bus.errors import LineLost
from tui.bus.fake import FakeLine
from tui.cli.shared.say import Messages
from tui.cli.shared.sets import say_afterwards, take_set
from tui.drive.profile import library
from tui.drive.settings.restore_plan import RestorePlan
from tui.drive.small_file import supplied
from tui.session.drive import DriveSession
from tui.session.settings.restore import plan_for

from .commands import ended, held, invoked, motor, refused, run, tcp_line

pytestmark = pytest.mark.long

SP2 = 11410
FAMILIES = ["atv21", "atv31", "atv312", "atv71", "powerdrive", "proxidrive", "varmeca"]


@pytest.fixture
def line() -> Iterator[str]:
    """A simulated Altivar 312 that several commands in turn can reach, at address 2."""
    with tcp_line("atv312@2") as line:
        yield line


@pytest.mark.parametrize("family", kept(FAMILIES, "atv71", "varmeca"))
def test_drive_equals_its_own_backup(family: str, tmp_path: Path) -> None:
    file = tmp_path / "set.toml"
    drive = (f"sim:{family}@3", "-d", "3", "-p", family)
    assert "settings of" in run(0, "backup", drive[0], file, *drive[1:])
    run(0, "compare", file, *drive)
    assert "0 to write" in run(0, "restore", drive[0], file, "--dry-run", *drive[1:])


def test_changed_setting_is_restored_from_a_backup(line: str, tmp_path: Path) -> None:
    file = tmp_path / "set.toml"
    run(0, "backup", line, file, "-d", "2")
    written = run(0, "write", line, "ACC=5,5 s", "hsp=40", "-d", "2", "--arm", "--save")
    assert "ACC: 3.0 s -> 5.5 s" in written
    assert "saved to EEPROM" in written
    different = run(1, "compare", file, line, "-d", "2")
    assert [row.split()[1] for row in different.splitlines()[1:]] == ["HSP", "ACC"]
    rows = list(
        csv.DictReader(io.StringIO(run(1, "compare", file, line, "-d", "2", "--format", "csv")))
    )
    assert {(row["code"], row["raw a"], row["raw b"]) for row in rows} == {
        ("ACC", "30", "55"), ("HSP", "500", "400"),
    }  # fmt: skip
    assert "| yes | ACC |" in run(1, "compare", file, line, "-d", "2", "--format", "markdown")
    assert "2 to write" in run(0, "restore", line, file, "-d", "2", "--dry-run")
    run(1, "compare", file, line, "-d", "2")
    assert "Wrote 2, all verified. 0 not written." in run(
        0, "restore", line, file, "-d", "2", "--arm"
    )
    run(0, "compare", file, line, "-d", "2")


def test_two_drives_of_a_line_are_compared(tmp_path: Path) -> None:
    with tcp_line("atv31@1", "atv31@2", "--set", "2:ACC=99") as line:
        reported = run(1, "compare", line, line, "-d", "1", "-d", "2")
        assert {row.split()[1] for row in reported.splitlines()[1:]} == {"ACC", "Add"}


def test_drive_is_compared_with_factory_settings(line: str) -> None:
    reported = run(1, "compare", "factory", line, "-d", "2")
    assert "LAC" in reported
    assert "ACC" in run(1, "compare", "factory", line, "-d", "2", "--all")


@pytest.mark.sweep
def test_restore_killed_half_way_is_resumed(tmp_path: Path) -> None:
    file = tmp_path / "set.toml"
    sets = {f"SP{n}": 100 + n for n in range(2, 9)} | {"ACC": 77, "dEC": 66, "AC2": 55}
    settings = [part for code, raw in sets.items() for part in ("--set", f"{code}={raw}")]
    with tcp_line("atv312", *settings) as line:
        run(0, "backup", line, file)
    with tcp_line("atv312") as line:
        process = subprocess.Popen(
            [*DRIVEPANEL, "restore", line, str(file), "--arm"],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
            env=_unbuffered(),
        )  # fmt: skip
        try:
            assert process.stdout is not None
            first = process.stdout.readline()
            assert first.startswith("1/"), first
        finally:
            process.send_signal(signal.SIGKILL)
            process.communicate(timeout=PATIENCE)
        reported = run(0, "restore", line, file, "--arm")
        assert "did not finish" in reported
        run(0, "compare", file, line)
        assert "did not come" not in run(0, "restore", line, file, "--arm")


def test_restore_without_a_final_comparison_exits_with_3(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It reported "1 written, 0 not" and status 4, as if the drive had refused something."""
    file, looks = tmp_path / "set.toml", [plan_for]
    run(0, "backup", line, file, "-d", "2")
    run(0, "write", line, "ACC=9", "--arm", "-d", "2")

    async def once(*what: Any, **how: Any) -> RestorePlan:
        if not looks:
            raise LineLost("The gateway is gone.")
        return await looks.pop()(*what, **how)

    monkeypatch.setattr("tui.session.settings.restore.plan_for", once)
    output = refused(3, "restore", line, file, "--arm", "-d", "2")
    assert "Not all of it was seen again: The gateway is gone." in output


@pytest.mark.sweep
def test_restore_ended_by_ctrl_c_reports_its_writes_and_exits_with_130(tmp_path: Path) -> None:
    file = tmp_path / "set.toml"
    settings = [part for n in range(2, 9) for part in ("--set", f"SP{n}={100 + n}")]
    with tcp_line("atv312", *settings) as line:
        run(0, "backup", line, file)
    with tcp_line("atv312") as line:
        restore = [*DRIVEPANEL, "restore", line, str(file), "--arm", "--json"]
        process = subprocess.Popen(
            restore, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True, preexec_fn=lambda: signal.signal(signal.SIGINT, signal.default_int_handler),
        )  # fmt: skip
        end = time.monotonic() + PATIENCE
        while held(line, SP2) == 100:
            assert time.monotonic() < end
        process.send_signal(signal.SIGINT)
        out, output = process.communicate(timeout=PATIENCE)
        if process.returncode == 0:
            pytest.skip("the restore was done before the signal came")
        assert process.returncode == 130
        reported = json.loads(out)
        assert reported["status"] == 130
        assert re.search(r"Ended by Ctrl-C: \d of 7 written: SP2|may have been written", output)
        assert output.endswith(f"{reported['error']}\n")


def _unbuffered() -> dict[str, str]:
    return {**os.environ, "PYTHONUNBUFFERED": "1"}


@pytest.mark.sweep
def test_backups_before_and_after_a_run_differ_in_time_only(tmp_path: Path) -> None:
    with tcp_line("atv71@2", "--set", "DEC=1") as line:
        run(0, "backup", line, tmp_path / "a", "-d", "2")
        run(0, "backup", line, tmp_path / "all-a", "-d", "2", "--all")
        motor(0, line, "-d", "2", "--reference", "20Hz", "--arm", "--for", "1")
        run(0, "backup", line, tmp_path / "b", "-d", "2")
        run(0, "backup", line, tmp_path / "all-b", "-d", "2", "--all")
    a, b = ((tmp_path / name).read_text("utf-8").splitlines() for name in "ab")
    assert [
        text for text, two in zip(a, b, strict=True) if text != two and "time" not in text
    ] == []
    a, b = ((tmp_path / f"all-{name}").read_text("utf-8").splitlines() for name in "ab")
    assert [text for text, two in zip(a, b, strict=True) if text != two and "time" not in text]


def test_backup_is_written_to_standard_output(line: str, tmp_path: Path) -> None:
    file = tmp_path / "set.toml"
    file.write_text(run(0, "backup", line, "-", "-d", "2"), encoding="utf-8")
    assert not Path("-").exists()
    run(0, "compare", file, line, "-d", "2")
    assert "standard output" in refused(2, "backup", line, "-", "-d", "2", "--json")


def test_incomplete_backup_exits_with_4(tmp_path: Path) -> None:
    with tcp_line("atv71@2", "--protect", "ACC") as line:
        output = refused(4, "backup", line, tmp_path / "set.toml", "-d", "2")
    assert "ACC could not be read" in output
    assert "[absent]" in (tmp_path / "set.toml").read_text("utf-8")


def test_drives_of_one_line_are_distinguished_by_their_address(tmp_path: Path) -> None:
    run(0, "backup", "sim:atv71", tmp_path / "set.toml")
    assert "-d" not in run(0, "compare", tmp_path / "set.toml", tmp_path / "set.toml")
    with tcp_line("atv31@1", "atv31@2") as line:
        head, *rows = run(1, "compare", line, line, "-d", "1", "-d", "2").splitlines()
    assert head.split()[-6:] == [line, "-d", "1", line, "-d", "2"]
    assert [row.split()[1] for row in rows] == ["Add"]


def test_line_settings_are_not_compared_with_the_factory() -> None:
    with tcp_line("atv31@5", "--set", "ACC=99") as line:
        reported = run(1, "compare", line, "factory", "-d", "5")
        codes = {row.split()[1] for row in reported.splitlines()[1:]}
        assert "ACC" in codes
        assert "Add" not in codes
        every = run(1, "compare", line, "factory", "-d", "5", "--all")
        assert re.search(r"Add .* 5 .*line setting", every)


ROUNDED = [
    ("LSP=0.04", "LSP: 0.04 would be rounded to 0.0 Hz"),
    ("ACC=3.55s", "3.55s would be rounded"),
]


@pytest.mark.parametrize(("wanted", "text"), ROUNDED)
def test_value_changed_much_by_rounding_exits_with_2(line: str, wanted: str, text: str) -> None:
    drive = (line, "-d", "2")
    for how in ("--arm", "--dry-run"):
        output = refused(2, "write", *drive, wanted, how)
        assert text in output
        assert "--round" in output
    code = wanted.partition("=")[0]
    assert code in run(0, "write", *drive, wanted, "--arm", "--round")


def test_slightly_rounded_value_is_written_and_reported(line: str) -> None:
    reported = run(0, "write", line, "-d", "2", "ACC=3.56", "--arm")
    assert "3.56 is rounded to 3.6 s" in reported


def test_repeated_code_exits_with_2(line: str) -> None:
    assert "ACC: given more than once" in refused(
        2, "write", line, "-d", "2", "ACC=3", "W9001=4", "--arm"
    )
    assert re.search(r"ACC .* 3\.0 +s ", run(0, "read", line, "ACC", "-d", "2"))


def test_dry_run_holds_back_what_the_real_run_would(line: str) -> None:
    words = ("write", line, "HSP=70", "LSP=55", "-d", "2")
    done = ended(2, *words, "--dry-run", "--json")
    results = json.loads(done.stdout)["results"]
    assert {each["code"]: each["outcome"] for each in results} == {
        "HSP": "refused", "LSP": "held-back",
    }  # fmt: skip
    assert "LSP depends on HSP, which would not be written." in done.stdout
    assert "LSP was not written: it depends on HSP" in ended(2, *words, "--arm").stderr


def test_rounding_of_a_set_is_reported(line: str, tmp_path: Path) -> None:
    file = tmp_path / "set.toml"
    run(0, "backup", line, file, "-d", "2")
    text = file.read_text("utf-8")
    text = text.replace('LSP = { raw = 0, value = "0.0 Hz"', 'LSP = { value = "0.04 Hz"')
    text = text.replace('ACC = { raw = 30, value = "3.0 s"', 'ACC = { value = "3.55 s"')
    text = text.replace('dEC = { raw = 30, value = "3.0 s"', 'dEC = { value = "3.56 s"')
    file.write_text(text, encoding="utf-8")
    planned = run(0, "restore", line, file, "-d", "2", "--dry-run")
    assert "leave  ACC" in planned
    reported = run(0, "restore", line, file, "-d", "2", "--arm")
    assert "3.55 s is rounded to 3.6 s. Use --round to write it anyway" in reported
    assert "3.56 s is rounded to 3.6 s" in reported
    assert "Wrote 1, all verified" in reported
    assert "write  ACC" in run(0, "restore", line, file, "-d", "2", "--dry-run", "--round")


USAGE: dict[str, tuple[str, ...]] = {
    "backup without a file": ("backup", "sim:atv71"),
    "compare the factory with itself": ("compare", "factory", "factory"),
    "compare a file that is not there": ("compare", "nosuch.toml", "factory"),
    "compare what is nothing": ("compare", "no such line", "factory"),
    "compare three drives": ("compare", "sim:atv71", "factory", "-d", "1", "-d", "2", "-d", "3"),
    "restore a file that is not there": ("restore", "sim:atv71", "nosuch.toml", "--dry-run"),
    "restore both ways": ("restore", "sim:atv71", "x.toml", "--dry-run", "--arm"),
    "write nothing": ("write", "sim:atv71", "--arm"),
    "write no value": ("write", "sim:atv71", "ACC", "--arm"),
    "write an empty value": ("write", "sim:atv71", "ACC=", "--arm"),
    "write an unknown code": ("write", "sim:atv71", "NOSUCH=1", "--arm"),
    "confirm an unknown code": ("write", "sim:atv71", "ACC=5", "--confirm", "NOSUCH", "--arm"),
}


@pytest.mark.parametrize("arguments", USAGE.values(), ids=USAGE.keys())
def test_compare_usage_exits_with_2(arguments: tuple[str, ...]) -> None:
    refused(2, *arguments)


def test_bad_file_is_reported_with_its_line_exits_with_2(tmp_path: Path) -> None:
    file = tmp_path / "set.toml"
    run(0, "backup", "sim:powerdrive", file, "-p", "powerdrive")
    text = file.read_text(encoding="utf-8")
    assert "already exists" in refused(2, "backup", "sim:powerdrive", file, "-p", "powerdrive")
    assert file.read_text(encoding="utf-8") == text
    run(0, "backup", "sim:powerdrive", file, "-p", "powerdrive", "--force")
    file.write_text(text[: len(text) // 2], encoding="utf-8")
    for command in (("compare", file, "factory"), ("restore", "sim:powerdrive", file, "--dry-run")):
        output = refused(2, *command)
        assert (
            f"{file}:{len((text[: len(text) // 2]).splitlines())}: " in output
            or "cut short" in output
        )


def test_two_families_are_not_compared_exits_with_2(tmp_path: Path) -> None:
    for family in ("atv31", "atv312"):
        run(0, "backup", f"sim:{family}", tmp_path / f"{family}.toml")
    assert "different families" in refused(
        2, "compare", tmp_path / "atv31.toml", tmp_path / "atv312.toml"
    )


def test_no_answer_exits_with_3(tmp_path: Path) -> None:
    refused(3, "backup", "sim:atv71@2", tmp_path / "x.toml", "-d", "9")
    assert not (tmp_path / "x.toml").exists()


WRITES_REFUSED_HERE = [
    (5, ("ACC=5",), "Not armed"),
    (2, ("ACC=100000", "--arm"), "out of range"),
    (2, ("ACC=fast", "--arm"), "is not a number"),
    (2, ("NOSUCH=5", "--arm"), "has no parameter"),
    (2, ("RFR=5", "--arm"), "only be read"),
    (2, ("CMD=6", "--arm"), "is a command"),
    (2, ("FRY=1", "--arm"), "never written by Drive Panel"),
    (5, ("BIR=1", "--arm"), "unverified"),
    (5, ("ACC=5", "--arm", "--read-only"), "read-only"),
]


@pytest.mark.parametrize(("status", "arguments", "text"), WRITES_REFUSED_HERE)
def test_bad_code_or_value_exits_with_2_and_a_state_that_forbids_it_with_5(
    status: int, arguments: tuple[str, ...], text: str
) -> None:
    assert text in refused(status, "write", "sim:atv71", *arguments)


def test_setting_written_before_a_refused_one_exits_with_6() -> None:
    error = ended(6, "write", "sim:atv71", "LSP=60", "HSP=40", "--arm").stderr
    assert "would be above HSP" in error
    assert error.endswith("drivepanel: Sent by this command: HSP = 40.0 Hz.\n")


def test_unarmed_restore_writes_nothing_exits_with_5(tmp_path: Path) -> None:
    run(0, "backup", "sim:atv21", tmp_path / "x.toml")
    assert "Not armed" in refused(5, "restore", "sim:atv21", tmp_path / "x.toml")


def test_restore_to_a_running_motor_exits_with_6() -> None:
    with tcp_line("atv312", "--run", "30") as line:
        output = refused(6, "write", line, "ACC=4", "FrS=60", "--arm")
        assert "with the motor stopped" in output
        assert "1 to write" not in output
        assert re.search(r"ACC .* 4\.0 +s ", run(0, "read", line, "ACC"))


def test_unverified_parameter_is_written_if_confirmed() -> None:
    assert "F111" in run(0, "write", "sim:atv21", "F111=Forced local", "--arm", "--confirm", "f111")


def test_dry_run_of_write_sends_nothing(line: str) -> None:
    assert "write  ACC: 3.0 s -> 9.0 s" in run(0, "write", line, "ACC=9", "-d", "2", "--dry-run")
    assert "3.0" in run(0, "read", line, "ACC", "-d", "2")


PAST_LIMITS = [
    # the drive of the line has HSP 50.0 Hz and TFR 60.0 Hz
    (("HSP=70",), "above TFR = 60.0 Hz"),
    (("TFR=45",), "below HSP = 50.0 Hz"),
    (("ITH=900",), "1.5 x INV"),
]


@pytest.mark.parametrize(("wanted", "text"), PAST_LIMITS)
def test_value_beyond_the_limit_of_another_parameter_exits_with_2(
    wanted: tuple[str, ...], text: str
) -> None:
    assert text in run(2, "write", "sim:atv71", *wanted, "--dry-run")
    assert text in refused(2, "write", "sim:atv71", *wanted, "--arm")


def test_limit_is_raised_before_the_value_it_limits() -> None:
    assert "HSP: 50.0 Hz -> 70.0 Hz" in run(0, "write", "sim:atv71", "HSP=70", "TFR=80", "--arm")


def test_drive_is_found_at_its_new_address() -> None:
    with tcp_line("atv21") as line:
        reported = run(0, "write", line, "F802=7", "--arm")
        assert "-d 7" in reported
        end = time.monotonic() + PATIENCE
        while invoked("read", line, "F802", "-d", "7").exit_code != 0:
            assert time.monotonic() < end


def test_set_of_another_family_is_converted_by_quantity(line: str, tmp_path: Path) -> None:
    with tcp_line("atv71", "--set", "ACC=88") as other:
        run(0, "backup", other, tmp_path / "71.toml")
    reported = run(0, "restore", line, tmp_path / "71.toml", "-d", "2", "--dry-run")
    assert "write  ACC: 3.0 s -> 8.8 s" in reported
    assert "of another family" in reported
    run(0, "restore", line, tmp_path / "71.toml", "-d", "2", "--arm")
    assert re.search(r"ACC .* 8\.8 +s ", run(0, "read", line, "ACC", "-d", "2"))


def test_report_has_identity_and_changed_settings(line: str, tmp_path: Path) -> None:
    file = tmp_path / "pump.md"
    run(0, "write", line, "ACC=9", "-d", "2", "--arm")
    run(0, "report", line, file, "-d", "2")
    text = file.read_text(encoding="utf-8")
    assert text.startswith("# Altivar 312 at tcp:")
    assert "| ACC | 3.0 s | 9.0 s | ok | setting |" in text
    assert "already exists" in refused(2, "report", line, file, "-d", "2")
    assert file.read_text(encoding="utf-8") == text
    run(0, "report", line, file, "-d", "2", "--force")


def test_one_set_is_restored_to_several_drives(tmp_path: Path) -> None:
    file = tmp_path / "model.toml"
    with tcp_line("atv312@1,atv312@2,atv21@3") as line:
        run(0, "write", line, "ACC=7", "HSP=40", "-d", "1", "--arm")
        run(0, "backup", line, file)
        reported = run(0, "restore", line, file, "-d", "1", "-d", "2", "--arm")
        assert "Device 1:" in reported
        assert (
            reported.index("The drive holds these values already.")
            < reported.index("Device 2:")
            < reported.index("Wrote 2")
        )
        assert "equal" in run(0, "restore", line, file, "-d", "2", "--dry-run")
        # a drive that is not there keeps the set from no other
        run(0, "write", line, "ACC=3", "-d", "2", "--arm")
        result = invoked("restore", line, file, "-d", "9", "-d", "2", "--arm")
        assert result.exit_code == 3
        assert "Wrote 1" in result.output


@pytest.mark.parametrize(
    ("after_reset", "unsaved", "saved", "parts"),
    [
        ([], [], False, []),
        (["TTO", "ADD"], [], False, ["next reset of the drive: TTO, ADD."]),
        ([], ["ACC"], False, ["--save"]),
        ([], ["ACC"], True, []),
        (["TTO"], ["ACC"], False, ["TTO", "--save"]),
    ],
)
def test_steps_left_after_a_write_are_reported(
    after_reset: list[str], unsaved: list[str], saved: bool, parts: list[str]
) -> None:
    messages = Messages(as_json=True)
    say_afterwards(messages, library.load("atv312"), after_reset, unsaved, saved=saved)
    assert len(messages.texts) == len(parts)
    assert all(part in text for part, text in zip(parts, messages.texts, strict=True))


def test_save_is_not_promised_if_the_family_has_none() -> None:
    messages = Messages(as_json=True)
    say_afterwards(messages, library.load("v20"), [], ["P1120"], saved=False)
    [text] = messages.texts
    assert text.startswith("Lost at power-off: P1120. No available document says how")
    assert "--save" not in text


@pytest.mark.parametrize("how", ["--arm", "--dry-run"])
@pytest.mark.parametrize(
    ("family", "setting", "why"),
    [("atv21", "ACC=7.5", "You do not have to save."), ("v20", "P1120=7.5", "No available doc")],
)
def test_save_that_the_family_lacks_is_refused_before_anything_is_written(
    tmp_path: Path, family: str, setting: str, why: str, how: str
) -> None:
    line = f"sim:{family}"
    assert why in refused(2, "write", line, setting, "--save", how)
    file = tmp_path / "set.toml"
    run(0, "backup", line, file)
    assert why in refused(2, "restore", line, file, "--save", how)
    assert setting.partition("=")[0] not in run(0, "journal")


@pytest.mark.sweep
def test_dash_is_standard_output_and_standard_input() -> None:
    line = "sim:atv71@2"
    text = run(0, "backup", line, "-", "-d", "2")
    assert f'line = "{line}"' in text
    assert "settings of" not in text

    def given(status: int, data: str, *words: str) -> str:
        supplied.clear()
        done = invoked(*words, typed=data)
        assert done.exit_code == status, done.output
        return done.output

    restore = "restore", line, "-", "--dry-run", "-d", "2"
    assert "529 equal already" in given(0, text, *restore)
    assert "No setting differs" in given(0, text, "compare", line, "-", "-d", "2")
    assert "drivepanel: -:2: " in given(2, "[set]\nformat", *restore)
    profile = (ROOT / "profiles/atv21.toml").read_text("utf-8")
    checked = given(0, profile, "profiles", "--check", "-")
    assert "-: Altivar 21, 207 parameters, no fault found." in checked
    blocks = run(0, "block", line, "save", "-", "-d", "2")
    given(0, blocks, "block", line, "load", "-", "--dry-run", "-d", "2")
    assert run(0, "report", line, "-", "-d", "2").startswith(f"# Altivar 71 at {line}, address 2\n")
    for command in ("backup", "report"):
        assert "both write to standard output" in refused(2, command, line, "-", "--json")
    assert not Path("-").exists()
    supplied.clear()


def test_nothing_to_write_is_no_refusal_on_a_read_only_line(tmp_path: Path) -> None:
    file, line = tmp_path / "set.toml", "sim:atv71"
    run(0, "backup", line, file)
    acceleration = re.search(r'^ACC += \{.*value = "([^"]+)"', file.read_text(), re.M)
    assert acceleration is not None
    same = f"ACC={acceleration[1]}"
    assert "holds these values already" in run(0, "write", line, same, "--arm", "--read-only")
    assert "holds these values already" in run(0, "restore", line, file, "--arm", "--read-only")
    for command in (("write", line, "ACC=7.7"), ("write", line, same, "--save"),
                    ("restore", line, file, "--save")):  # fmt: skip
        assert "is read-only" in refused(5, *command, "--arm", "--read-only")


@pytest.mark.parametrize("typed", ["ACC=abc", "ACC=16#zz", "CHCF=Nowhere", "NOSUCH=3"])
def test_bad_value_and_bad_code_have_one_status(typed: str) -> None:
    refused(2, "write", "sim:atv71", typed, "--arm")


async def test_set_of_a_drive_that_was_not_identified_has_its_identity() -> None:
    line = FakeLine({4: dict.fromkeys(range(65536), 0)})
    line.devices[4].identity = {0: b"Schneider", 1: b"ATV71HU22N4"}
    session = DriveSession(line, 4, library.load("atv71"))
    values = await take_set(session, settings_only=True)
    assert values.head.identity["reference"] == "ATV71HU22N4"
    assert "ACC" in values.raws
    assert "RFR" not in values.raws
