"""Fixtures of the tests of screens."""

from __future__ import annotations

import pytest
from textual._compositor import Compositor
from textual.css.stylesheet import Stylesheet
from textual.pilot import Pilot
from textual.widgets import Input

from tests.internal_errors import no_internal_errors
from tui.screens.dialogs.question import Question

from .quick import drawn_for_a_person, parse_once, wait_for_the_busy

__all__ = ["no_internal_errors"]


@pytest.fixture(autouse=True)
def quick_hands(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let questions and the run line accept Enter immediately.

    `test_questions` and `test_run_line` test the delay.
    """
    monkeypatch.setattr(Question, "_is_early", lambda _: False)
    monkeypatch.setattr("tui.screens.monitor.run_line.ENTER_COUNTS_AFTER", 0.0)


@pytest.fixture(autouse=True)
def no_ports(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let Line list no serial ports of this machine."""
    monkeypatch.setattr("tui.session.connect.open_line.serial_ports", list)


@pytest.fixture(autouse=True)
def patience(patient_lines: None) -> None:
    """Make lines wait long, so that a busy machine does not matter; tests/bus tests the timing."""


@pytest.fixture(autouse=True)
def nobody_else(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no scan monitor for another master first; `test_other_settings` tests that."""
    monkeypatch.setattr("tui.session.connect.other_masters.LISTEN", 0.0)


@pytest.fixture(autouse=True)
def styles_parsed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reuse parsed style sheets: they would take a fifth of the time of a test of the panel."""
    monkeypatch.setattr(Stylesheet, "_parse_rules", parse_once)


@pytest.fixture(autouse=True)
def only_the_busy_waited_for(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Leave waiting widgets asleep, to save a tenth of time. Pictures use the pilot's method."""
    if "snap_compare" not in request.fixturenames:
        monkeypatch.setattr(Pilot, "_wait_for_screen", wait_for_the_busy)


@pytest.fixture(autouse=True)
def drawn_when_looked_at(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Do not draw screens that no test checks: that took a quarter of the time.

    Pictures are drawn as for a person, and so are tests marked `drawn`.
    """
    looked_at = "snap_compare" in request.fixturenames or request.node.get_closest_marker("drawn")
    if not looked_at:
        monkeypatch.setattr(Compositor, "render_update", drawn_for_a_person)


@pytest.fixture(autouse=True)
def still_cursor(monkeypatch: pytest.MonkeyPatch) -> None:
    """Stop the cursor of a field from blinking: on a busy machine a picture may miss it."""
    monkeypatch.setattr(Input, "_toggle_cursor", lambda _: None)


@pytest.fixture(autouse=True)
def utc(in_utc: None) -> None:
    """Use one time zone on every machine."""
