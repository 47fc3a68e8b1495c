"""Fixtures of the tests of sessions."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.internal_errors import no_internal_errors
from tui.session.journal import Journal

__all__ = ["no_internal_errors"]


@pytest.fixture(autouse=True)
def patience(patient_lines: None) -> None:
    """Make lines wait long, so that a busy machine does not matter; tests/bus tests the timing."""


@pytest.fixture
def journal() -> Iterator[Journal]:
    """A journal in the test's own folder."""
    made = Journal()
    yield made
    made.close()
