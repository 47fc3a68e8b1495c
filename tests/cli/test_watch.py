"""`drivepanel watch`: good values, CSV files that are not lost, several drives."""

from __future__ import annotations

import csv
import itertools
import json
import time
from datetime import date, datetime
from pathlib import Path
from typing import Any

import pytest

from tests.programs import DRIVEPANEL, PATIENCE, port_of, served, simulated
from tests.sweeps import kept
from tui.cli.shared.csv_files import CsvFile
from tui.cli.shared.errors import Failure

from .commands import ended, refused, run

LINE = ("sim:atv71@2", "-d", "2")
SHORT = ("--every", "0.1", "--count")


def cycles(*arguments: str) -> list[dict[str, Any]]:
    """The objects that `watch --json` prints."""
    reported = run(0, "watch", *arguments, "--json")
    return [json.loads(line) for line in reported.splitlines()]


@pytest.mark.sweep
def test_no_value_is_good_after_the_server_exits() -> None:
    with simulated("atv71@2", "--tcp", "127.0.0.1:0") as simulation:
        line = f"tcp:127.0.0.1:{port_of(simulation.ready)},timeout=0.2"
        watch = ("watch", line, "-d", "2", "ETA", "RFR", "--every", "0.1", "--json")
        with served([*DRIVEPANEL, *watch], ready="{") as watching:
            first = last = json.loads(watching.ready)
            assert first["error"] is None
            assert {value["quality"] for value in first["values"].values()} == {"good"}
            assert first["state"] == "blocked"
            assert watching.process.stdout is not None
            simulation.end()
            end = time.monotonic() + PATIENCE
            while (reported := json.loads(watching.process.stdout.readline()))["error"] is None:
                assert time.monotonic() < end
                last = reported
            for _ in range(3):
                assert {value["quality"] for value in reported["values"].values()} == {"stale"}
                assert (reported["state"], reported["direction"]) == (None, None)
                before = last["values"]["ETA"]["time"]
                assert reported["values"]["ETA"]["time"] == before
                assert reported["time"] > before
                reported = json.loads(watching.process.stdout.readline())
            watching.process.kill()


@pytest.mark.sweep
def test_drive_lost_at_the_end_exits_with_3() -> None:
    with simulated("atv71@2", "--tcp", "127.0.0.1:0") as simulation:
        line = f"tcp:127.0.0.1:{port_of(simulation.ready)},timeout=0.2"
        watch = ("watch", line, "-d", "2", "RFR", "--every", "0.1", "--count", "20", "--json")
        with served([*DRIVEPANEL, *watch], ready="{") as watching:
            simulation.end()
            _, output = watching.process.communicate(timeout=PATIENCE)
            assert watching.process.returncode == 3
            ways = ("the other end closed", "cannot be reached", "reset by peer")
            assert any(way in output for way in ways), output


def test_every_value_has_its_time_within_its_cycle() -> None:
    # not SHORT: on a busy machine a value is truly old by the end of so short a cycle
    reported = cycles(*LINE, "--every", "0.5", "--count", "3")
    assert len(reported) == 3
    for before, now in itertools.pairwise(reported):
        for value in now["values"].values():
            assert value["quality"] == "good"
            read = datetime.fromisoformat(value["time"])
            assert datetime.fromisoformat(before["time"]) <= read
            assert read <= datetime.fromisoformat(now["time"])


def test_state_is_null_if_its_words_are_not_watched() -> None:
    (reported,) = cycles(*LINE, "RFR", *SHORT, "1")
    assert (reported["state"], reported["direction"], reported["error"]) == (None, None, None)


def test_several_drives_are_watched() -> None:
    line = ("sim:atv71@1,atv312@2", "-d", "1", "-d", "2", "-d", "1")
    reported = cycles(*line, "ETA", *SHORT, "2")
    assert sorted((row["device"], row["profile"]) for row in reported) == [
        (1, "atv71"), (1, "atv71"), (2, "atv312"), (2, "atv312"),
    ]  # fmt: skip
    text = run(0, "watch", *line, "ETA", *SHORT, "1")
    assert "device 1" in text
    assert "device 2" in text


def test_several_drives_are_written_to_one_file(tmp_path: Path) -> None:
    file = tmp_path / "run.csv"
    line = ("sim:atv71@1,atv312@2", "-d", "1", "-d", "2")
    run(0, "watch", *line, "RFR", "ETA", *SHORT, "1", "--csv", file)
    with file.open(newline="", encoding="utf-8") as opened:
        rows = list(csv.DictReader(opened))
    assert {row["device"]: row["ETA"] for row in rows} == {"1": "16#0250", "2": "16#0240"}
    assert {row["state"] for row in rows} == {"blocked"}


# Files


def test_existing_file_is_replaced_or_appended_only_on_request(tmp_path: Path) -> None:
    file = tmp_path / "run.csv"
    watch = ("watch", *LINE, "ETA", *SHORT, "1", "--csv", file)
    run(0, *watch)
    text = file.read_text("utf-8")
    assert "already exists" in refused(2, *watch)
    assert file.read_text("utf-8") == text
    run(0, *watch, "--append")
    assert file.read_text("utf-8").startswith(text)
    assert len(file.read_text("utf-8").splitlines()) == 3
    run(0, *watch, "--force")
    assert len(file.read_text("utf-8").splitlines()) == 2


@pytest.mark.parametrize(
    "options",
    [("--append",), ("--rotate", "day"), ("--csv", "x.csv", "--append", "--force"),
     ("--csv", "x.csv", "--rotate", "soon"), ("--csv", "x.csv", "--rotate", "0MB")],
)  # fmt: skip
def test_conflicting_options_exit_with_2(options: tuple[str, ...]) -> None:
    refused(2, "watch", *LINE, "ETA", *SHORT, "1", *options)
    assert not Path("x.csv").exists()


def test_file_with_other_columns_is_not_appended(tmp_path: Path) -> None:
    file = tmp_path / "run.csv"
    file.write_text("time,other\n", encoding="utf-8")
    watch = ("watch", *LINE, "ETA", *SHORT, "1", "--csv", file)
    assert "other columns" in refused(2, *watch, "--append")
    assert file.read_text("utf-8") == "time,other\n"


def test_row_cut_by_a_crash_does_not_damage_the_next(tmp_path: Path) -> None:
    file = tmp_path / "run.csv"
    file.write_text("time,a\r\n1,2\r\n3", encoding="utf-8", newline="")
    more = CsvFile(file, ["time", "a"], append=True)
    more.write(["5", "6"])
    more.close()
    assert file.read_text("utf-8").splitlines() == ["time,a", "1,2", "3", "5,6"]


def test_rotation_by_size_loses_no_row(tmp_path: Path) -> None:
    file = CsvFile(tmp_path / "run.csv", ["time", "a"], rotate=100)
    for number in range(40):
        file.write([f"{number:06d}", "x" * 10])
    file.close()
    found = sorted(tmp_path.glob("run*.csv"))
    assert len(found) > 5
    rows = []
    for path in found:
        head, *more = path.read_text("utf-8").splitlines()
        assert head == "time,a"
        assert path.stat().st_size <= 100
        rows += more
    assert sorted(rows) == [f"{number:06d},{'x' * 10}" for number in range(40)]


def test_file_is_rotated_daily(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Today(date):
        now = date(2026, 11, 22)

        @classmethod
        def today(cls) -> date:  # type: ignore[override]
            return cls.now

    monkeypatch.setattr("tui.cli.shared.csv_files.date", Today)
    file = CsvFile(tmp_path / "run.csv", ["time"], rotate="day")
    file.write(["one"])
    file.write(["two"])
    Today.now = date(2026, 11, 23)
    file.write(["three"])
    file.close()
    assert (tmp_path / "run-2026-11-22.csv").read_text("utf-8").split() == ["time", "one", "two"]
    assert (tmp_path / "run.csv").read_text("utf-8").split() == ["time", "three"]


def test_full_disk_is_reported() -> None:
    with pytest.raises(Failure, match="cannot be written: No space left"):
        CsvFile(Path("/dev/full"), ["time"], force=True)


# Repeated -d


@pytest.mark.parametrize(
    "command",
    [("write", "ACC=5", "--arm"), ("run", "--arm"), ("reference", "5", "--arm"),
     ("reset", "--arm"), ("teach",), ("block",)],
)  # fmt: skip
def test_several_drives_for_a_one_drive_command_exit_with_2(command: tuple[str, ...]) -> None:
    name, *more = command
    output = refused(2, name, "sim:atv71@1,atv71@2", *more, "-d", "1", "-d", "2")
    assert "this command is for one drive" in output


@pytest.mark.parametrize(
    ("command", "option"), [(("backup", "x.toml"), "--recipe"), (("report", "x.md"), "--page")]
)
def test_several_drives_need_the_option_for_them(command: tuple[str, ...], option: str) -> None:
    output = refused(2, command[0], "sim:atv71@1,atv71@2", command[1], "-d", "1", "-d", "2")
    assert f"several -d require {option}." in output.casefold()


def test_panel_with_several_drives_exits_with_2() -> None:
    assert "for one drive" in refused(2, "sim:atv71@1,atv71@2", "-d", "1", "-d", "2")


@pytest.mark.parametrize(
    "command", kept([("read", "ETA"), ("status",), ("identify",)], ("status",))
)
def test_absent_drive_of_several_is_reported(command: tuple[str, ...]) -> None:
    name, *more = command
    line = ("sim:atv71@1,atv312@2", "-d", "2", "-d", "9", "-d", "1")
    done = ended(3, name, line[0], *more, *line[1:], "--json")
    two, nine, item = json.loads(done.stdout)
    assert (two["profile"], item["profile"]) == ("atv312", "atv71")
    assert (nine["device"], nine["status"]) == (9, 3)
    assert "did not answer" in nine["error"]
    assert "Device 1:" in ended(3, name, line[0], *more, *line[1:]).stdout


def test_several_drives_are_stopped() -> None:
    line = ("sim:atv71@1,atv312@2", "-d", "2", "-d", "1")
    reported = run(0, "stop", *line)
    assert "Device 1, Altivar 71: stopped" in reported
    assert "Device 2, Altivar 312: stopped" in reported
    done = ended(3, "stop", *line, "-d", "9")
    assert "no answer at 9" in done.stderr
    refused(2, "stop", *line, "--give-back", "--arm")
