"""RunCurve, ramp times and reports of an acceptance test; pure functions."""

from __future__ import annotations

import math
from dataclasses import replace
from xml.etree import ElementTree

import pytest

from tui.drive.profile import library
from tui.drive.settings.parameter_set import ParameterSet, SetHead
from tui.session.acceptance.curve import RunCurve, RunPoint, curve_svg, ramp_seconds
from tui.session.acceptance.report_files import curve_files, result_junit, result_markdown
from tui.session.acceptance.result import AcceptanceResult, StepResult, settings_hash
from tui.session.acceptance.steps import DirectionStep, ResetStep


def ramp(up: float, period: float = 0.13, hz: float = 50.0, sign: int = 1) -> list[RunPoint]:
    """Cycles of a straight ramp that begins between two of them."""
    begun = 100.07
    times = [100 + period * n for n in range(int((up + 1) / period))]
    return [RunPoint(t, sign * min(hz, max(0.0, (t - begun) / up * hz))) for t in times]


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("up", "period"), [(3.0, 0.13), (30.0, 0.3), (1.0, 0.1)])
def test_ramp_is_timed_between_cycles(up: float, period: float, sign: int) -> None:
    points = ramp(up, period, sign=sign)
    assert ramp_seconds(points, 0.0, 50.0, 50.0) == pytest.approx(up, abs=0.001)
    assert ramp_seconds(points, 0.0, 50.0, 60.0) == pytest.approx(up * 1.2, abs=0.001)
    fall = [replace_time(p, -p.time) for p in reversed(points)]
    assert ramp_seconds(fall, 50.0, 0.0, 50.0) == pytest.approx(up, abs=0.001)


def replace_time(point: RunPoint, time: float) -> RunPoint:
    return point._replace(time=time)


def test_ramp_with_too_few_values_is_not_timed() -> None:
    assert ramp_seconds(ramp(0.2, 0.2), 0.0, 50.0, 50.0) is None
    assert ramp_seconds([], 0.0, 50.0, 50.0) is None
    half = [p for p in ramp(3.0) if p.hertz < 30]
    assert ramp_seconds(half, 0.0, 50.0, 50.0) is None


def curve(points: list[RunPoint]) -> RunCurve:
    return RunCurve(library.load("atv312"), points, [(101.0, "51Hz <&>")])


@pytest.mark.parametrize(
    "points",
    [
        [],
        [RunPoint(1.0, 0.0)],
        [RunPoint(1.0, -12.0, 2.0), RunPoint(2.0, 30.0, -0.5)],
        ramp(3.0),
    ],
)
def test_curve_is_drawn_with_numbers_in_its_frame(points: list[RunPoint]) -> None:
    tree = ElementTree.fromstring(curve_svg(curve(points), 'Ramp <1> \x1b & "2"'))
    assert tree.tag.endswith("svg")
    for line in tree.iter("{http://www.w3.org/2000/svg}polyline"):
        for place in line.attrib["points"].split():
            x, y = map(float, place.split(","))
            assert 50 <= x <= 750
            assert 30 <= y <= 290
            assert math.isfinite(x + y)
    texts = [t.text for t in tree.iter("{http://www.w3.org/2000/svg}text")]
    assert "-0" not in texts
    assert "Hz" in texts


def result(*outcomes: str) -> AcceptanceResult:
    steps = [
        StepResult(1, DirectionStep(kind="direction", hz=5, name="A | B"), seconds=2.0),
        StepResult(2, ResetStep(kind="reset"), text="x < y"),
    ]
    for step, outcome in zip(steps, outcomes, strict=True):
        step.outcome = outcome  # type: ignore[assignment]
    steps[0].check("Status word", "forward", "forward", passed=outcomes[0] == "passed")
    steps[0].curve = curve(ramp(3.0))
    return AcceptanceResult(
        "Pump \x1b 4", "sim:x", 4, "atv312", "Altivar 312", "1.0", "0.2", "A. <Person>", "t.toml",
        "abc", 1000.0, steps, {"version": "2.1"}, 1010.0, "", "aa", "aa", 100, 2,
    )  # fmt: skip


def test_result_passes_only_whole() -> None:
    whole = result("passed", "passed")
    assert whole.passed
    assert whole.why_not == ""
    for wrong, why in (
        (result("passed", "failed"), "Failed: step 2."),
        (result("passed", "not run"), "Steps were not run."),
        (replace(whole, ended_by="ended by SIGINT"), "The test ended early: ended by SIGINT."),
        (replace(whole, settings_after="bb"), "Settings of the drive changed during the test."),
        (replace(whole, settings_after=""), "The settings were not read after the test."),
        (replace(whole, settings_hash="", settings_after=""), "The settings were not"),
    ):
        assert not wrong.passed
        assert wrong.why_not.startswith(why)


def test_markdown_names_the_facts_and_shows_the_curve() -> None:
    found = result("passed", "failed")
    text = result_markdown(found, curve_files(found, "t"))
    for part in (
        "NOT PASSED. Failed: step 2.", "A. <Person>", "SHA-256 abc", "settings: aa",
        "2 not readable",
        "Version: 2.1", "Drive Panel 0.2", "A \\| B", "![Curve of step 1](t-step1.svg)", "x < y",
    ):  # fmt: skip
        assert part in text
    assert "\x1b" not in text
    assert "**PASSED**" in result_markdown(result("passed", "passed"), {})


def test_junit_counts_failures_and_skipped_steps() -> None:
    suite = ElementTree.fromstring(result_junit(result("failed", "not run")))
    counts = {name: suite.attrib[name] for name in ("tests", "failures", "skipped", "errors")}
    assert counts == {"tests": "3", "failures": "1", "skipped": "1", "errors": "0"}
    first, second, third = suite.iter("testcase")
    assert first.find("failure") is not None
    assert (skipped := second.find("skipped")) is not None
    assert skipped.attrib["message"] == "x < y"
    assert list(third) == []
    changed = replace(result("passed", "passed"), settings_after="bb")
    suite = ElementTree.fromstring(result_junit(changed))
    assert suite.attrib["failures"] == "1"
    names = {p.attrib["name"]: p.attrib["value"] for p in suite.iter("property")}
    assert (names["by"], names["settings"], names["version"]) == ("A. <Person>", "aa", "2.1")


def test_hash_follows_every_setting_and_no_order() -> None:
    head = SetHead("atv312", "1.0", "Altivar 312", "", "", 1)
    first = settings_hash(ParameterSet(head, {"ACC": 30, "dEC": 40}))
    assert first == settings_hash(ParameterSet(head, {"dEC": 40, "ACC": 30}))
    assert first != settings_hash(ParameterSet(head, {"ACC": 30, "dEC": 41}))
    assert len(first) == 64
