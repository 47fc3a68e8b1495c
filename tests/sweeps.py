"""Which values of a parametrised test are left to the sweeps: those alike to one that is kept."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import pytest


def kept(values: Iterable[Any], *main: Any) -> list[Any]:
    """The values, all but those of the main layer marked as a sweep."""
    return [
        pytest.param(value, marks=() if value in main else pytest.mark.sweep) for value in values
    ]
