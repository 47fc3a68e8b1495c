"""Curves of a report: the last trip and the last run, as SVG and as text."""

from __future__ import annotations

from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from xml.etree import ElementTree

import pytest

from tui.cli.commands.report import CURVE_ROWS, curve_text
from tui.drive.profile import library
from tui.session.acceptance.curve import RunCurve, RunPoint, curve_svg
from tui.session.record.ring import files_of_line
from tui.session.report_trends import (
    ReportTrend,
    linked,
    report_trend_lines,
    report_trends,
    trend_files,
)

from . import test_changes as records
from .test_changes import FORWARD, READY, START
from .test_journal import entry

ATV71 = library.load("atv71")
SPEED, CURRENT = 3202, 3204
NOW = START + 3600.0
TRIP = replace(
    entry(1), kind="fault", code="ObF", new="Overbraking", answer="tripped",
    why="the trip was seen",
    time=datetime.fromtimestamp(START + 300, UTC).isoformat(),
)  # fmt: skip


def written_run(
    folder: Path,
    *,
    reduced: bool = False,
    speed: bool = True,
    profile: str = "atv71",
    name: str = "line-1",
) -> list[Path]:
    """A record of a run from 100 to 120 s, with frequency and current each second up to 330 s."""
    rows = [records.status(second, READY) for second in (99, 120, 121)]
    rows += [records.status(second, FORWARD) for second in range(100, 120)]
    if speed:
        rows += [records.row(second, SPEED, second) for second in range(90, 330)]
    rows += [records.row(second + 0.1, CURRENT, 30) for second in range(90, 330)]
    records.write(folder, rows, reduced=reduced, profile=profile, name=name)
    return files_of_line(folder, name)


def trends(files: list[Path], *trips: object) -> list[ReportTrend]:
    return report_trends(files, 1, ATV71, trips, NOW)  # type: ignore[arg-type]


def test_last_trip_and_last_run_have_their_seconds(tmp_path: Path) -> None:
    older = replace(TRIP, time=datetime.fromtimestamp(START + 150, UTC).isoformat())
    trip, run = trends(written_run(tmp_path), older, replace(older, answer="reset"), TRIP)
    assert (trip.kind, run.kind) == ("trip", "run")
    assert trip.title == "Trip ObF Overbraking, 2024-10-04 22:05:00"
    assert run.title.startswith("2024-10-04 22:01:40: RUN forward until 22:02:00")
    ends = [round(trip.curve.points[at].time - START) for at in (0, -1)]
    assert ends == [240, 309]
    assert trip.curve.marks == [(START + 300, "ObF")]
    assert [round(run.curve.points[at].time - START) for at in (0, -1)] == [95, 124]
    assert run.curve.points[0] == RunPoint(START + 95, 9.5, 3.0)
    assert run.remark == ""


def test_last_of_two_runs_is_the_one_of_the_report(tmp_path: Path) -> None:
    words = [READY, FORWARD, READY, FORWARD, READY]
    rows = [records.status(10 * at, word) for at, word in enumerate(words)]
    records.write(tmp_path, rows + [records.row(second, SPEED, 9) for second in range(50)])
    (run,) = trends(files_of_line(tmp_path, "line-1"))
    assert run.title.startswith("2024-10-04 22:00:30: RUN")


def test_current_is_only_beside_a_frequency_of_the_same_cycle(tmp_path: Path) -> None:
    rows = [records.status(0, READY), records.status(1, FORWARD), records.status(9, READY)]
    rows += [records.row(second, SPEED, 100) for second in range(10)]
    rows += [records.row(5.1, CURRENT, 30)]
    records.write(tmp_path, rows)
    (run,) = trends(files_of_line(tmp_path, "line-1"))
    amperes = {round(point.time - START): point.amperes for point in run.curve.points}
    assert [at for at, value in amperes.items() if value is not None] == [5, 6]


def test_reverse_run_is_negative_and_percent_are_no_amperes(tmp_path: Path) -> None:
    """The Altivar 21 reports the frequency without a sign, and the current in %."""
    status, speed, current, ready, reverse = 64769, 64768, 65027, 0x4000, 0x4600
    rows = [records.row(at, status, reverse if 2 <= at < 8 else ready) for at in range(10)]
    rows += [records.row(at, speed, 3000) for at in range(10)]
    rows += [records.row(at, current, 5000) for at in range(10)]
    records.write(tmp_path, rows, profile="atv21")
    files = files_of_line(tmp_path, "line-1")
    (run,) = report_trends(files, 1, library.load("atv21"), [], NOW)
    assert {(point.hertz, point.amperes) for point in run.curve.points} == {(-30.0, None)}


def test_reduced_values_have_a_remark(tmp_path: Path) -> None:
    (run,) = trends(written_run(tmp_path, reduced=True))
    assert run.remark.startswith("Values older than an hour")
    assert len(run.curve.points) < 6


def test_report_without_a_record_or_without_a_frequency_has_no_trend(tmp_path: Path) -> None:
    assert trends([], TRIP) == []
    assert trends(written_run(tmp_path, speed=False), TRIP) == []


def test_trip_whose_time_is_not_known_has_no_trend(tmp_path: Path) -> None:
    files = written_run(tmp_path)
    seen = replace(TRIP, answer="seen", why="in fault when first seen")
    assert [trend.kind for trend in trends(files, seen)] == ["run"]
    assert [trend.kind for trend in trends(files, replace(TRIP, time="cut off"))] == ["run"]
    later = replace(seen, time=datetime.fromtimestamp(START + 900, UTC).isoformat())
    assert [trend.kind for trend in trends(files, TRIP, replace(TRIP, answer="reset"), later)] == [
        "run"
    ]


def test_files_and_links_have_the_name_of_the_report(tmp_path: Path) -> None:
    found = trends(written_run(tmp_path), TRIP)
    files = trend_files(found, "drive 4")
    assert {name for name, _ in files.values()} == {"drive 4-trip.svg", "drive 4-run.svg"}
    for _, svg in files.values():
        assert ElementTree.fromstring(svg).tag.endswith("svg")
    lines = report_trend_lines(found, linked(files))
    assert [line for line in lines if line.startswith("#")] == ["## Last trip", "## Last run"]
    assert "![Curve of the trip](<drive 4-trip.svg>)" in lines


def test_curve_is_not_drawn_across_a_gap() -> None:
    points = [RunPoint(float(at), 10.0) for at in (0, 1, 2, 50, 51)]
    svg = curve_svg(RunCurve(ATV71, points), "gap", 5.0)
    assert svg.count("<polyline") == 2
    assert curve_svg(RunCurve(ATV71, points), "gap").count("<polyline") == 1


@pytest.mark.parametrize(("encoding", "ascii"), [("utf-8", False), ("ascii", True)])
def test_text_has_both_curves_with_their_ends(
    encoding: str, ascii: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (run,) = trends(written_run(tmp_path))
    monkeypatch.setattr("tui.cli.commands.report.output_encoding", lambda: encoding)
    lines = curve_text(run)
    text = "\n".join(lines)
    assert text.isascii() is ascii
    assert len(lines) == 2 + 2 * CURVE_ROWS + 1
    assert ["15 Hz" in text, "0 Hz" in text, "3 A" in text] == [True] * 3
    assert lines[-2].split() == ["22:01:35", "22:02:04"]


def test_later_trip_of_the_record_is_the_last_one(tmp_path: Path) -> None:
    rows = [records.row(second, SPEED, 100) for second in range(290, 420)]
    rows += [records.status(second, READY) for second in range(290, 400)]
    rows += [records.status(second, records.FAULT) for second in range(400, 420)]
    rows.append(records.row(405, records.LAST_FAULT, records.TRIPPED_ON))
    records.write(tmp_path, rows)
    (trip,) = trends(files_of_line(tmp_path, "line-1"), TRIP)
    assert trip.title.startswith("Trip OCF ")
    assert trip.curve.marks == [(START + 400, "OCF")]
