"""Results of plans of a line and of acceptance tests, right and damaged, as recorded text.

`recorded_files.txt` has a section for each subject; each entry has the change and its results.
"""

from __future__ import annotations

import json
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.recorded import sections, short
from tests.sources import ROOT
from tui.drive.errors import DriveError
from tui.session.acceptance import plan as motions
from tui.session.acceptance.step_file import read_test
from tui.session.line_plan.checks import best_master_ohm, line_length, plan_findings, total_ohm
from tui.session.line_plan.drawing import diagram_svg, diagram_text
from tui.session.line_plan.from_scan import NotAScan, plant_of_scan
from tui.session.line_plan.parts import parts_list
from tui.session.line_plan.plan_file import read_plant
from tui.session.line_plan.timing import line_times

TEXTS = Path(__file__).parent / "recorded_files.txt"
PLAN = ROOT / "docs" / "plan" / "hall-2.toml"
TEST = ROOT / "docs" / "acceptance" / "atv312.toml"
END = 'terminator = "RC"\nvalues'
PLAN_CHANGES = (
    ("", ""), ("cable = 12\n", "cable = 1250\n"), ("stub = 3\nterminator", "stub = 25\nterminator"),
    ("polarization = 820", "polarization = 300"), ("polarization = 820", "polarization = 5000"),
    ("polarization = 820\n", ""), ("polarization = 4700\nw", "polarization = 0\nw"),
    (END, "values"), (END, 'terminator = "R"\nvalues'), ('terminator = "RC"\n', ""),
    ('stub = 1\nbox = "A"', 'stub = 1\nbox = "A"\nterminator = "RC"'),
    ("period = 0.5", "period = 0.05"), ("period = 0.5\n", ""), ("baud = 19200", "baud = 4800"),
    ("baud = 19200", "baud = 38400"), ('"8E1"', '"8N1"'), ('"8E1"', '"8O2"'),
    ('way = "rj45"', 'way = "boxes"'), ('way = "rj45"', 'way = "sub_d"'),
    ("format = 1\n", 'format = 1\nschematic = "uni-telway"\n'),
    ("format = 1\n", 'format = 1\nschematic = "jbus"\n'), ("timeout = 3", "timeout = 0.2"),
    ("timeout = 3", "timeout = 500"), ("[master]\n", "[master]\ntimeout = 0.02\n"),
    ("[master]\n", "[master]\ntimeout = 9\n"),
    ("[master]\n", "[master]\nposition = 3\ncable = 9\n"),
    ("[master]\n", "[master]\nposition = 1\n"), ("[master]\n", "[master]\nposition = 6\n"),
    ("[master]\n", "[master]\ncable = 6\n"), ('kind = "Twido, screws"\n', ""),
    ('kind = "Twido, screws"', 'kind = "PC"'), ("address = 2", "address = 1"),
    ("address = 3", "address = 0"), ("address = 5", "address = 240"), ("words = 4", "words = 0"),
    ("words = 4", "words = 60\nturnaround = 0.3"), ("words = 4", 'values = ["ETA"]'),
    ("words = 4", "writes = 1"), ('["ETA", "RFR", "LCR"]', '["ETA", "GONE", "CMD"]'),
    ('profile = "atv71"', 'profile = "atv99"'), ('profile = "atv71"', 'profile = "varmeca"'),
    ("cable = 45\n", ""), ("cable = 20\n", ""), ("stub = 1\npol", "pol"),
    ("cable = 30", "cable = 0"),
    ('cable = 20\n', 'cable = 20\nbox = "A"\n'), ('cable = 30\n', 'cable = 30\nbox = "A"\n'),
    ("baud = 19200", "baud = 1"), ("stub = 3\nbox", "stub = -1\nbox"), ("[master]", "[mastr]"),
    ('name = "Hall 2, pumps"', 'name = "<Hall> & \\u001b[2J"'), ("writes = 2", "writes = 1"),
)  # fmt: skip
HIT = {"command": "scan", "event": "hit"}
SCANS: tuple[list[Any], ...] = (
    [
        {**HIT, "device": 3, "baud": 9600, "format": "8N1", "profile": "atv31", "line": "rtu:x"},
        {**HIT, "device": 1, "name": "Fan"}, {"command": "scan", "event": "ended", "line": "rtu:y"},
        {"command": "status"}, 5,
    ],
    [{**HIT, "device": 248}], [{**HIT, "device": "1"}], [],
    [{**HIT, "device": 2, "profile": None, "reference": 'AT"V'}],
)  # fmt: skip
TEST_CHANGES = (
    ("", ""), ('"3.0 s"', '"3 A"'), ("ACC =", "GONE ="), ('kind = "refused"', 'kind = "refuse"'),
    ('references = ["50.5Hz", "60Hz"]', "references = []"), ("hz = 10\n", ""),
    ("hz = 10", "hz = 0"),
    ("seconds = 2\n", 'seconds = 9.5\nturns = "left"\n'), ("seconds = 2\n", 'turns = "up"\n'),
    ("seconds = 2\n", 'direction = "reverse"\n'), ("seconds = 2\n", 'direction = "back"\n'),
    ("up = 3.0\ndown = 3.0\n", ""), ("down = 3.0\n", "base = 25\n"), ("up = 3.0\n", ""),
    ("tolerance = 0.1", "tolerance = -1"), ("[25, 50, 75, 100]", "[10, 100]"),
    ("[25, 50", "[0, 50"),
    ("motor_current", "current"), ('unit = "A"', 'units = "A"'),
    ("max = 2.5", "max = 2.5\nmin = 3"),
    ("max = 2.5", "settle = 7"), ('"quick-stop"', '"freewheel"'), ('"quick-stop"', '"reset"'),
    ('"quick-stop"', '"emergency-stop"'), ("over = 1.0", "over = 1.0\nhz = 30"),
    ("over = 1.0", "over = 9"),
    ("timeout = 2.0", "timeout = 2.0\nturning = true\nhz = 20"),
    ("timeout = 2.0", "turning = true"),
    ("timeout = 2.0", 'timeout = 2.0\nreaction = "Fault"'),
    ("timeout = 2.0", "timeout = 2.0\nhz = 9"),
    ('"atv312"', '"atv21"'), ('"atv312"', '"varmeca"'), ('"atv312"', '"gone"'),
    ("format = 1", "format = 2"),
    ('kind = "reset"', 'kind = "reset"\ncontinue = true'),
    ('kind = "reset"', 'kind = "reset"\nhz = 1'),
    ('values = { ACC = "3.0 s", dEC = "3.0 s", HSP = "50.0 Hz" }', 'file = "none.toml"'),
    ('values = { ACC = "3.0 s", dEC = "3.0 s", HSP = "50.0 Hz" }', 'ignore = ["GONE"]'),
)  # fmt: skip


def damaged(path: Path, changes: tuple[tuple[str, str], ...]) -> Iterator[tuple[str, Path]]:
    """Each change of a file with a file of its own, in a folder for the time of its use."""
    text = path.read_text("utf-8")
    with tempfile.TemporaryDirectory() as folder:
        own = Path(folder, path.name)
        for old, new in changes:
            assert old in text, old
            own.write_text(text.replace(old, new, 1), "utf-8")
            yield f"{old!r} -> {new!r}", own


def line_plans() -> Iterator[str]:
    for change, path in damaged(PLAN, PLAN_CHANGES):
        yield change
        try:
            plan = read_plant(path)
        except DriveError as error:
            yield str(error).replace(str(path), path.name)
            continue
        times = line_times(plan)
        found = plan_findings(plan, times)
        yield from (f"  {each}" for each in found)
        yield f"  {plan.schematic.id} {line_length(plan)} {total_ohm(plan)} {best_master_ohm(plan)}"
        yield f"  {times.cycle:.6f} {times.singly:.6f} {times.reply} {times.longest:.6f}"
        yield f"  { {baud: round(each, 6) for baud, each in times.by_baud.items()} }"
        for own in times.stations:
            seconds = [f"{each:.6f}" for each in (own.seconds, own.singly, own.slowest)]
            yield f"  {own.station.address}: {own.requests} {own.words} {seconds}"
        for limit in times.timeouts:
            span = f"{limit.low} to {limit.high}, {limit.suitable}"
            yield f"  {limit.station.address}: {limit.parameter} {limit.shortest} {span}"
        parts = parts_list(plan)
        yield from (f"  {row.count} x {row.number}: {row.text}" for row in parts.rows)
        yield f"  {parts.remarks}"
        yield from diagram_text(plan, found)
        if change == "'' -> ''" or "<" in change or "position = 3" in change:
            yield diagram_svg(plan, found)


def scans() -> Iterator[str]:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "scan.jsonl")
        for rows in SCANS:
            path.write_text("\n".join(map(json.dumps, rows)) + "\n", "utf-8")
            try:
                yield plant_of_scan(path)
            except NotAScan as error:
                yield str(error).replace(str(path), path.name)


def acceptance_tests() -> Iterator[str]:
    for change, path in damaged(TEST, TEST_CHANGES):
        yield change
        try:
            file = read_test(path)
        except DriveError as error:
            yield str(error).replace(str(path.parent), "")
            continue
        yield from motions.planned_motions(file)
        yield f"{motions.longest_motion(file):.3f} {file.moves} {file.test.name}"
        yield f"{[round(motions.longest_of(step), 3) for step in file.steps]}"
        yield from motions.planned_motions(file, motions.HighSpeed(50.0, "HSP"))[-2:]
        yield short(list(file.sets))


SECTIONS = (line_plans, scans, acceptance_tests)


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
def test_files_of_plans_and_tests_give_what_is_recorded(
    section: Callable[[], Iterator[str]],
) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
