"""Parameters of a test that only the sweeps run, because the main layer has similar ones."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def kept(values: Iterable[Any], *main: Any) -> list[Any]:
    """Mark all values except those of the main layer as a sweep."""
    return [
        pytest.param(value, marks=() if value in main else pytest.mark.sweep) for value in values
    ]
