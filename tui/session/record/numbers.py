"""Values of a history as numbers in a text."""

from __future__ import annotations

from decimal import Decimal

from .history import History


def number_text(history: History, value: float) -> str:
    """Return a value with the decimals of the parameter's scale; with 6 digits if unknown."""
    entry = history.entry
    if entry is None or entry.scale_source or history.unit == "raw":
        return f"{value:.6g}"
    decimals = -int(Decimal(entry.scale).normalize().as_tuple().exponent)
    return f"{value:.{max(0, decimals)}f}"
