"""Conversion of tables to structs, in one thread at a time."""

from __future__ import annotations

import threading
from typing import Any

import msgspec

_ONE_AT_A_TIME = threading.RLock()
"""msgspec prepares a type on its first use. Two threads that do so at once crash the program
(version 0.22: a segmentation fault while two profiles were loaded)."""


def converted(tables: object, form: Any) -> Any:
    """Convert tables to a form; raises msgspec.ValidationError. Thread-safe."""
    with _ONE_AT_A_TIME:
        return msgspec.convert(tables, form)
