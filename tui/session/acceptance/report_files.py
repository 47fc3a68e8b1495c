"""Files of an acceptance test: Markdown for a person, JUnit XML for programs, curves as SVG."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from xml.sax.saxutils import escape, quoteattr

from tui.drive.plain import markdown_table, plain

from .curve import curve_svg
from .result import AcceptanceResult, StepResult

_PASSED = {True: "passed", False: "FAILED"}


def report_time(wall: float) -> str:
    """Return a time in seconds since 1970 as local time with its zone; empty for 0."""
    return datetime.fromtimestamp(wall).astimezone().isoformat(" ", "seconds") if wall else ""


def curve_files(result: AcceptanceResult, stem: str) -> dict[int, tuple[str, str]]:
    """Return the name and the SVG of each curve, by the number of its step."""
    return {
        step.number: (
            f"{stem}-step{step.number}.svg",
            curve_svg(step.curve, f"{step.number}. {step.title}"),
        )
        for step in result.steps
        if step.curve is not None and step.curve.points
    }


def result_markdown(result: AcceptanceResult, curves: Mapping[int, tuple[str, str]]) -> str:
    """Return the report as Markdown; it shows the curves by the names of their files."""
    verdict = "PASSED" if result.passed else f"NOT PASSED. {result.why_not}"
    after = "changed during the test" if result.settings_trouble else "unchanged after the test"
    if not result.settings_after:
        after = "not read after the test"
    lines = [
        f"# {result.name}",
        "",
        f"**{verdict}**",
        "",
        f"- Drive: {result.family} at {result.line}, address {result.device}",
        *(f"- {key.capitalize()}: {text}" for key, text in result.identity.items()),
        f"- Tested by: {result.by}",
        f"- Begun: {report_time(result.begun)}; ended: {report_time(result.ended)}",
        f"- Test file: {result.file}, SHA-256 {result.file_hash}",
        f"- Settings: {result.settings_read} read, {result.unreadable} not readable; {after}",
        f"- SHA-256 of the settings: {result.settings_hash or 'none'}",
        f"- Drive Panel {result.panel}; profile {result.profile}, version {result.profile_version}",
        "",
        *markdown_table(
            ("step", "name", "result", "s"),
            ((str(s.number), s.title, s.outcome, f"{s.seconds:.1f}") for s in result.steps),
        ),
    ]
    for step in result.steps:
        lines += ["", *_step_lines(step, curves)]
    lines += ["", "Signature: ________________________    Date: ____________", ""]
    return plain("\n".join(lines), lines=True)


def _step_lines(step: StepResult, curves: Mapping[int, tuple[str, str]]) -> list[str]:
    lines = [f"## {step.number}. {step.title}: {step.outcome}", ""]
    if step.text:
        lines += [step.text, ""]
    if step.checks:
        rows = ((c.name, c.value, c.limit, _PASSED[c.passed]) for c in step.checks)
        lines += [*markdown_table(("check", "value", "allowed", "result"), rows), ""]
    if step.number in curves:
        lines += [f"![Curve of step {step.number}]({curves[step.number][0]})", ""]
    return lines[:-1]


def result_junit(result: AcceptanceResult) -> str:
    """Return the result as JUnit XML: a test case for each step, and one for the settings."""
    rows = [_case(result, s.title, s.seconds, _trouble(s), _output(s)) for s in result.steps]
    trouble = result.settings_trouble
    settings = _element("failure", trouble) if trouble else ""
    rows.append(_case(result, "settings unchanged after the test", 0.0, settings, ""))
    failed = sum("<failure" in row for row in rows)
    skipped = sum("<skipped" in row for row in rows)
    length = max(result.ended - result.begun, 0.0)
    begun = datetime.fromtimestamp(result.begun).isoformat(timespec="seconds")
    properties = {
        "device": str(result.device),
        "line": result.line,
        "profile": f"{result.profile} {result.profile_version}",
        "panel": result.panel,
        "by": result.by,
        "settings": result.settings_hash,
        "ended_by": result.ended_by,
        **result.identity,
    }
    return "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            f'<testsuite name={_quoted(result.name)} tests="{len(rows)}" failures="{failed}"'
            f' skipped="{skipped}" errors="0" time="{length:.1f}"'
            f" timestamp={_quoted(begun)}>",
            "<properties>",
            *(
                f"<property name={_quoted(key)} value={_quoted(text)}/>"
                for key, text in properties.items()
                if text
            ),
            "</properties>",
            *rows,
            "</testsuite>",
            "",
        ]
    )


def _case(result: AcceptanceResult, title: str, seconds: float, trouble: str, output: str) -> str:
    return (
        f"<testcase classname={_quoted(result.name)} name={_quoted(title)}"
        f' time="{seconds:.1f}">{trouble}{output}</testcase>'
    )


def _trouble(step: StepResult) -> str:
    names = {"failed": "failure", "not run": "skipped"}
    return _element(names[step.outcome], step.text) if step.outcome in names else ""


def _element(name: str, text: str) -> str:
    return f"<{name} message={_quoted(text)}/>"


def _output(step: StepResult) -> str:
    lines = (f"{c.name}: {c.value} [{c.limit}] {_PASSED[c.passed]}" for c in step.checks)
    text = escape(plain("\n".join(lines), lines=True))
    return f"<system-out>{text}</system-out>" if text else ""


def _quoted(text: str) -> str:
    return quoteattr(plain(text))
