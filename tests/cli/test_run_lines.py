"""Lines that `drivepanel run` prints about its motor; without a drive."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any, cast

import pytest

from tui.bus.fake import FakeLine
from tui.cli.commands.prove import _milliseconds
from tui.cli.commands.run import RunTelling
from tui.drive.profile import library
from tui.session.drive import DriveSession


class Printed:
    """Output of a run, in lines or JSON."""

    def __init__(self, *, as_json: bool = False) -> None:
        self.lines: list[str] = []
        session = DriveSession(FakeLine(), 7, library.load("atv312"))
        self.telling = RunTelling(session, self.lines.append, as_json=as_json)

    def show(self, time: float, error: str = "", **state: Any) -> None:
        known = {"headline": "Running", "kind": "running", "direction": "forward", "fault": None}
        latest = SimpleNamespace(
            time=time, error=error, state=SimpleNamespace(**{**known, **state}), readings={}
        )
        self.telling.show(cast(Any, latest), lambda: "It goes on.")


def test_motor_that_is_not_stopped_yet_is_reported_on_standard_error(
    capsys: pytest.CaptureFixture[str],
) -> None:
    printed = Printed()
    printed.telling.warn("NOT STOPPED yet: no answer")
    assert "NOT STOPPED yet: no answer" in capsys.readouterr().err
    assert printed.lines == []


def test_run_prints_its_motor_once_a_second() -> None:
    printed = Printed()
    for time in (100.0, 100.5, 100.89, 100.91, 101.5, 101.9):
        printed.show(time)
    assert len(printed.lines) == 3
    assert all(line[8:].startswith("  Running") for line in printed.lines)


def test_trouble_of_the_line_is_reported_when_it_begins_and_ends(
    capsys: pytest.CaptureFixture[str],
) -> None:
    printed = Printed()
    printed.show(100.0)
    assert capsys.readouterr().err == ""
    for time in (101.0, 102.0):
        printed.show(time, "no reply")
    assert printed.lines[-1].endswith("  no answer: no reply")
    err = capsys.readouterr().err
    assert err.count("no reply") == 1
    assert "It goes on. Retrying." in err
    for time in (103.0, 104.0):
        printed.show(time)
    assert capsys.readouterr().err.count("The drive answers again.") == 1


@pytest.mark.parametrize("error", ["", "no reply"])
def test_document_of_a_cycle_has_no_state_without_an_answer(error: str) -> None:
    printed = Printed(as_json=True)
    fault = SimpleNamespace(code="OCF")
    printed.show(100.0, error, kind="fault", fault=fault)
    printed.telling.report("stopped", "Device 7: stopped.")
    cycle, end = map(json.loads, printed.lines)
    assert (cycle["device"], cycle["event"]) == (7, "state")
    assert cycle["state"] == (None if error else "fault")
    assert cycle["direction"] == (None if error else "forward")
    assert cycle["fault"] == (None if error else "OCF")
    assert cycle["error"] == (error or None)
    assert (end["event"], end["text"]) == ("stopped", "Device 7: stopped.")


@pytest.mark.parametrize(
    ("seconds", "shown"), [(None, None), (0.0, 0), (1.2345, 1234), (10.0, 10000)]
)
def test_times_of_a_test_are_printed_in_milliseconds(
    seconds: float | None, shown: int | None
) -> None:
    assert _milliseconds(seconds) == shown
