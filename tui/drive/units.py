"""Units that a person may type instead of a parameter's own, with their factors."""

from __future__ import annotations

from decimal import Decimal

KINDS: tuple[dict[str, str], ...] = (
    {"µs": "1e-6", "us": "1e-6", "ms": "1e-3", "s": "1", "sec": "1", "min": "60", "h": "3600"},
    {"Hz": "1", "kHz": "1e3"},
    {"µA": "1e-6", "uA": "1e-6", "mA": "1e-3", "A": "1", "kA": "1e3"},
    {"µV": "1e-6", "uV": "1e-6", "mV": "1e-3", "V": "1", "kV": "1e3"},
    {"mW": "1e-3", "W": "1", "kW": "1e3"},
    {"µH": "1e-6", "uH": "1e-6", "mH": "1e-3", "H": "1"},
    {"mohm": "1e-3", "ohm": "1", "kohm": "1e3", "mΩ": "1e-3", "Ω": "1", "kΩ": "1e3"},
    {"rpm": "1", "1/min": "1", "min-1": "1", "r/min": "1"},
    {"Nm": "1", "N·m": "1", "kNm": "1e3"},
    {"%": "1", "percent": "1", "pct": "1"},
    {"mm": "1e-3", "cm": "1e-2", "m": "1", "km": "1e3"},
    {"mm/s": "1e-3", "m/s": "1"},
)
"""Units of one kind each, as multiples of one another."""


def factor_between(typed: str, own: str) -> Decimal | None:
    """Return the factor from the typed unit to the parameter's own; None if their kinds differ.

    Case is ignored: no two units of one kind differ by it.
    """
    if typed.casefold() == own.casefold():
        return Decimal(1)
    for kind in KINDS:
        sizes = {unit.casefold(): Decimal(size) for unit, size in kind.items()}
        if typed.casefold() in sizes and own.casefold() in sizes:
            return sizes[typed.casefold()] / sizes[own.casefold()]
    return None


def spelled(typed: str) -> str:
    """Return a unit in its usual capitals: `hz` is Hz; an unknown unit unchanged."""
    known = (unit for kind in KINDS for unit in kind if unit.casefold() == typed.casefold())
    return next(known, typed)
