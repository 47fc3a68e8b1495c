"""What the tests of a session start from."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def patience(patient_lines: None) -> None:
    """How long a line waits is looked at in tests/bus; here a busy machine must not matter."""
