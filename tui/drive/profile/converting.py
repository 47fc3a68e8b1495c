"""Tables into forms, one thread at a time."""

from __future__ import annotations

import threading
from typing import Any

import msgspec

_ONE_AT_A_TIME = threading.RLock()
"""msgspec works a form out when it meets it first; two threads that meet it at once crash the
whole program (seen with 0.22: a segmentation fault while two profiles were loaded)."""


def converted(tables: object, form: Any) -> Any:
    """The tables in a form; raises msgspec.ValidationError. For any thread."""
    with _ONE_AT_A_TIME:
        return msgspec.convert(tables, form)
