"""What the tests of the screens start from."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest
from textual._compositor import Compositor
from textual.css.stylesheet import Stylesheet
from textual.pilot import Pilot
from textual.widgets import Input

from tui.screens.dialogs.question import Question

from .quick import drawn_for_somebody, parse_once, wait_for_the_busy


@pytest.fixture(autouse=True)
def quick_hands(monkeypatch: pytest.MonkeyPatch) -> None:
    """Questions and the run line take Enter as soon as they stand.

    `test_questions` and `test_run_line` look at the waiting.
    """
    monkeypatch.setattr(Question, "_is_early", lambda _: False)
    monkeypatch.setattr("tui.screens.monitor.run_line.ENTER_COUNTS_AFTER", 0.0)


@pytest.fixture(autouse=True)
def patience(patient_lines: None) -> None:
    """How long a line waits is looked at in tests/bus; here a busy machine must not matter."""


@pytest.fixture(autouse=True)
def nobody_else(monkeypatch: pytest.MonkeyPatch) -> None:
    """No search listens for another master first; `test_other_settings` looks at that."""
    monkeypatch.setattr("tui.session.connect.other_masters.LISTEN", 0.0)


@pytest.fixture(autouse=True)
def styles_parsed_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A fifth of the time of a test of the panel would go into the same style sheets."""
    monkeypatch.setattr(Stylesheet, "_parse_rules", parse_once)


@pytest.fixture(autouse=True)
def only_the_busy_waited_for(
    request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A tenth of the time went into waking widgets that wait. Pictures take the pilot's own way."""
    if "snap_compare" not in request.fixturenames:
        monkeypatch.setattr(Pilot, "_wait_for_screen", wait_for_the_busy)


@pytest.fixture(autouse=True)
def drawn_when_looked_at(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter of the time went into drawing what nobody looks at.

    Pictures are drawn as a person comes to them, and so is all that is marked `drawn`.
    """
    looked_at = "snap_compare" in request.fixturenames or request.node.get_closest_marker("drawn")
    if not looked_at:
        monkeypatch.setattr(Compositor, "render_update", drawn_for_somebody)


@pytest.fixture(autouse=True)
def still_cursor(monkeypatch: pytest.MonkeyPatch) -> None:
    """The cursor of a field does not blink: on a busy machine a picture is taken after it went."""
    monkeypatch.setattr(Input, "_toggle_cursor", lambda _: None)


@pytest.fixture(autouse=True)
def utc(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Times of day are those of one place, wherever the tests are run."""
    monkeypatch.setenv("TZ", "UTC")
    time.tzset()
    yield
    monkeypatch.undo()
    time.tzset()
