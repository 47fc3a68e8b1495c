"""`drivepanel export`: values as CSV and frames as pcapng, as other programs read them."""

from __future__ import annotations

import csv
import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable
from datetime import datetime
from pathlib import Path

import pytest

from tests.conftest import need_peer
from tests.programs import PATIENCE
from tests.session import test_changes as records
from tests.session.test_changes import DAY, LINE
from tests.sources import ROOT
from tui.bus.share.place import file_name_of
from tui.session.connect.line_key import line_key
from tui.wire.capture.forms import READ_RAW

from .commands import refused, run
from .printed import forms_of

CURRENT, SPEED = 3204, 3202
LCR, RFR = "LCR [A, scale 0.1]", "RFR [Hz, scale 0.1]"
TABLES_SETTING = "DRIVEPANEL_TABLES"
"""Environment variable: a Python with pandas and DuckDB."""


@pytest.fixture
def line() -> str:
    """The record of a line: 5 s of two values, 20 s without a reading, 5 s more; and a write."""
    folder = Path(os.environ["DRIVEPANEL_STATE"]) / "record"
    seconds = [*range(5), *range(25, 30)]
    rows = [records.row(second + 0.01, CURRENT, 30 + second) for second in seconds]
    rows += [records.row(second, SPEED, 10 * second) for second in seconds]
    rows += [records.row(second, CURRENT, 99, device=2) for second in seconds]
    rows += [records.row(30, CURRENT, None)]
    rows += [records.row(2.5, records.COMMAND, 0xF, function=6, who=records.PROGRAM)]
    records.write(folder, rows, name=file_name_of(line_key(LINE)))
    return LINE


def table_of(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text("utf-8").splitlines()))


def test_csv_has_a_row_for_each_cycle_with_unit_and_scale_in_its_heading(
    line: str, tmp_path: Path
) -> None:
    path = tmp_path / "values.csv"
    printed = run(0, "export", line, "rfr", "LCR", "-d", "1", "--out", path)
    table = table_of(path)
    assert printed == f"Wrote {len(table)} rows to {path}.\n"
    assert list(table[0]) == ["time UTC", "time local", "device", RFR, LCR, "quality"]
    assert [(row[RFR], row[LCR]) for row in table[:2]] == [("0.0", "3.0"), ("1.0", "3.1")]
    assert table[0]["time UTC"] == "2024-10-04T22:00:00.000Z"
    for row in table:
        utc, local = (datetime.fromisoformat(row[f"time {zone}"]) for zone in ("UTC", "local"))
        assert utc == local
    assert table[-1]["quality"] == "LCR: no reply"
    assert (table[-1][RFR], table[-1][LCR]) == ("", "")


def test_standard_output_has_the_same_rows_and_nothing_else(line: str, tmp_path: Path) -> None:
    path = tmp_path / "values.csv"
    run(0, "export", line, "rfr", "-d", "1", "--out", path)
    printed = run(0, "export", line, "rfr", "-d", "1", "--out", "-")
    assert printed.splitlines() == path.read_text("utf-8").splitlines()


def test_time_without_readings_is_an_empty_row(line: str, tmp_path: Path) -> None:
    path = tmp_path / "values.csv"
    run(0, "export", line, "RFR", "LCR", "-d", "1", "--out", path)
    table = table_of(path)
    (gap,) = [row for row in table if row["quality"].startswith("no reading")]
    assert table.index(gap) == 5
    assert gap["quality"] == "no reading for 21.0 s"
    assert (gap[RFR], gap[LCR]) == ("", "")


def test_rows_of_several_drives_are_in_order_of_time(line: str, tmp_path: Path) -> None:
    path = tmp_path / "values.csv"
    run(0, "export", line, "LCR", "--out", path)
    table = table_of(path)
    assert {row["device"] for row in table} == {"1", "2"}
    times = [row["time UTC"] for row in table]
    assert times == sorted(times)


def test_range_of_time_is_from_the_first_to_before_the_second(line: str, tmp_path: Path) -> None:
    path = tmp_path / "values.csv"
    begin, end = "2024-10-04T22:00:01+00:00", "2024-10-04T22:00:03+00:00"
    run(0, "export", line, "RFR", "-d", "1", "--from", begin, "--to", end, "--out", path)
    assert [row[RFR] for row in table_of(path)] == ["1.0", "2.0"]
    assert "--from must be before --to" in refused(
        2, "export", line, "RFR", "--from", end, "--to", begin, "--out", tmp_path / "no.csv"
    )


def test_values_that_are_reduced_have_minimum_and_maximum(tmp_path: Path) -> None:
    folder = Path(os.environ["DRIVEPANEL_STATE"]) / "record"
    rows = [records.row(second, CURRENT, 30 + second) for second in range(20)]
    records.write(folder, rows, name=file_name_of(line_key(LINE)), reduced=True)
    path = tmp_path / "values.csv"
    run(0, "export", LINE, "LCR", "--out", path)
    first, second = table_of(path)
    assert [first[name] for name in (LCR, f"{LCR} min", f"{LCR} max")] == ["3.45", "3.0", "3.9"]
    assert second[f"{LCR} min"] == "4.0"


@pytest.mark.parametrize(
    ("split", "names"),
    [
        ("hour", {"v-2024-10-04T22.csv", "v-2024-10-04T23.csv", "v-2024-10-05T00.csv"}),
        ("day", {"v-2024-10-04.csv", "v-2024-10-05.csv"}),
    ],
)
def test_split_writes_a_file_for_each_part_of_the_time(
    split: str, names: set[str], tmp_path: Path
) -> None:
    folder = Path(os.environ["DRIVEPANEL_STATE"]) / "record"
    rows = [records.row(second, CURRENT, 30) for second in (0, 10, 3600, 3610)]
    name = file_name_of(line_key(LINE))
    records.write(folder, rows, name=name)
    records.write(folder, [records.row(7300, CURRENT, 30)], name=name, day=DAY + 1)
    printed = run(0, "export", LINE, "LCR", "--split", split, "--out", tmp_path / "v.csv", "--json")
    assert forms_of(printed) == {"ExportDocument"}
    files = json.loads(printed)["files"]
    assert {Path(item["file"]).name for item in files} == names
    for item in files:
        table = table_of(Path(item["file"]))
        assert len(table) == item["count"]
        assert list(table[0])[3] == LCR


def test_parts_of_the_time_are_those_of_the_local_day(
    line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    try:
        with monkeypatch.context() as patch:
            patch.setenv("TZ", "Asia/Tokyo")
            time.tzset()
            run(0, "export", line, "LCR", "--split", "day", "--out", tmp_path / "v.csv")
    finally:
        time.tzset()
    (path,) = tmp_path.glob("v-*.csv")
    assert path.name == "v-2024-10-05.csv"  # 22:00 of the day before in UTC
    assert table_of(path)[0]["time local"] == "2024-10-05T07:00:00.000+09:00"


def test_times_before_a_trigger_are_negative(tmp_path: Path) -> None:
    rows = [records.row(second, CURRENT, 30 + second) for second in range(10)]
    form = json.dumps({"code": "LCR"})
    events = [
        records.event(0, "parameter", form, 1),
        records.event(4.5, "trigger", "LCR above 3.4", 1),
    ]
    records.write(tmp_path, rows, events)
    (source,) = tmp_path.glob("*.sqlite")
    path = tmp_path / "values.csv"
    run(0, "export", source, "--out", path)
    assert [float(row["from trigger [s]"]) for row in table_of(path)] == [
        number - 4.5 for number in range(10)
    ]
    assert "has no frames" in refused(2, "export", source, "--out", tmp_path / "x.pcapng")


def test_recording_of_two_drives_has_each_value_as_it_was(tmp_path: Path) -> None:
    # the cycle of one drive is written after that of the other, although it was read before
    rows = [
        records.row(second + late, CURRENT, 30 + second, device=device)
        for second in range(10)
        for device, late in ((2, 0.03), (1, 0.0))
    ]
    form = json.dumps({"code": "LCR"})
    records.write(tmp_path, rows, [records.event(0, "parameter", form, each) for each in (1, 2)])
    (source,) = tmp_path.glob("*.sqlite")
    run(0, "export", source, "--out", tmp_path / "values.csv")
    table = table_of(tmp_path / "values.csv")
    assert (len(table), f"{LCR} min" in table[0]) == (20, False)


REFUSED = {
    "no codes": (("LINE", "--out", "x.csv"), "Name the codes to export"),
    "unknown code": (("LINE", "NOPE", "--out", "x.csv"), "has no parameter 'NOPE'"),
    "unknown drive": (("LINE", "LCR", "-d", "9", "--out", "x.csv"), "Nothing of device 9"),
    "no value": (("LINE", "ACC", "--out", "x.csv"), "has no values of these codes"),
    "no record": (("tcp:192.0.2.7", "LCR", "--out", "x.csv"), "nothing is recorded of such a line"),
    "no record file": (("text", "LCR", "--out", "x.csv"), "cannot be exported: text: "),
    "codes of frames": (("LINE", "LCR", "--out", "x.pcapng"), "are for CSV files"),
    "raw values": (("LINE", "LCR", "--raw", "--out", "x.csv"), "--raw requires --out FILE.pcapng"),
    "existing file": (("LINE", "LCR", "--out", "text"), "already exists"),
    "existing frames": (("LINE", "--out", "old.pcapng"), "already exists"),
    "split output": (("LINE", "LCR", "--split", "day", "--out", "-"), "require --out FILE"),
    "JSON output": (("LINE", "LCR", "--json", "--out", "-"), "require --out FILE"),
    "no folder": (("LINE", "LCR", "--out", "none/x.csv"), "cannot be written"),
    "no folder for frames": (("LINE", "--out", "none/x.pcapng"), "cannot be written"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_wrong_use_is_refused_with_a_reason(
    name: str, line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    for existing in ("text", "old.pcapng"):
        Path(existing).write_text("kept")
    words, why = REFUSED[name]
    assert why in refused(2, "export", *(line if word == "LINE" else word for word in words))
    assert Path("text").read_text() == Path("old.pcapng").read_text() == "kept"
    assert not Path("x.csv").exists()


# Programs that the project did not write


def tshark(program: str, path: Path, *options: str) -> list[list[str]]:
    """Protocol, device, function and checksum status of each packet."""
    names = ("_ws.col.Protocol", "mbtcp.unit_id", "mbrtu.unit_id", "modbus.func_code")
    wanted = [part for name in (*names, "mbrtu.crc16.status") for part in ("-e", name)]
    done = subprocess.run(
        [program, *options, "-r", str(path), "-T", "fields", "-E", "separator=;", *wanted],
        capture_output=True, text=True, timeout=PATIENCE, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return [line.split(";") for line in done.stdout.splitlines()]


@pytest.mark.parametrize("raw", [False, True])
def test_tshark_reads_every_frame_of_the_record(
    raw: bool, line: str, peer: Callable[[str, str], str], tmp_path: Path
) -> None:
    path = tmp_path / "frames.pcapng"
    run(0, "export", line, "--out", path, *(["--raw"] if raw else []))
    options = re.findall(r"-o '?((?:uat|mbrtu)[^']*?)'? (?=-)", READ_RAW) if raw else []
    chosen = [part for option in options for part in ("-o", option)]
    packets = tshark(peer("tshark", "tshark"), path, *chosen)
    # 30 reads and their replies, one without a reply, a write and its reply
    assert len(packets) == 2 * 30 + 1 + 2
    assert {packet[0] for packet in packets} == {"Modbus RTU" if raw else "Modbus/TCP"}
    assert [packet[3] for packet in packets].count("6") == 2
    assert {packet[2 if raw else 1] for packet in packets} == {"1", "2"}
    assert {packet[4] for packet in packets} == ({"1"} if raw else {""})


PAGE = (ROOT / "docs" / "recording.md").read_text("utf-8")
EXAMPLES = re.findall(
    r"^```(python|sh)\n(.*?)^```$", PAGE.partition("\n## Export\n")[2], re.M | re.S
)
RESULTS = ["1    5.9\n2    9.9\n", "), 9.9)]\n", "9.9\n", "31|2024-10-04 22:00:00\n"]
"""Output of the examples, in their order."""


def test_frames_of_one_drive_are_exported_alone(line: str, tmp_path: Path) -> None:
    path = tmp_path / "frames.pcapng"
    assert run(0, "export", line, "-d", "2", "--out", path) == f"Wrote 20 frames to {path}.\n"


def test_page_has_an_example_for_each_program() -> None:
    programs = [re.search(r"pandas|duckdb|sqlite3", text) for _, text in EXAMPLES]
    assert [found[0] for found in programs if found] == ["pandas", "duckdb", "sqlite3", "sqlite3"]


@pytest.mark.parametrize(
    "number",
    [
        pytest.param(number, marks=pytest.mark.sweep if kind == "python" else ())
        for number, (kind, _) in enumerate(EXAMPLES)
    ],
)
def test_example_of_the_page_runs_as_printed(
    number: int,
    line: str,
    peer: Callable[[str, str], str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    run(0, "export", line, "LCR", "--out", "values.csv")
    (record,) = (Path(os.environ["DRIVEPANEL_STATE"]) / "record").glob("*.sqlite")
    Path("values.sqlite").write_bytes(record.read_bytes())
    kind, text = EXAMPLES[number]
    if kind == "sh":
        peer("sqlite3", "sqlite3")
        command = ["sh", "-ec", text]
    else:
        python = os.environ.get(TABLES_SETTING, sys.executable)
        library = re.findall(r"import (\w+)", text)[0]
        found = subprocess.run(
            [python, "-c", f"import {library}"], check=False, capture_output=True
        )
        if found.returncode:
            need_peer(
                f"{library} is not installed; pip install {library}, or set {TABLES_SETTING}."
            )
        command = [python, "-c", text]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    assert RESULTS[number] in done.stdout
