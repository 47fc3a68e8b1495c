"""Terminals of a simulated drive: logic inputs that keep their state, analog inputs.

A closed contact stays closed, through a trip, a reset and a loss of the supply. An analog input is
stored as a share of its full scale, 0..1, for any wiring.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from ..errors import SimulatorError
from ..rules import ChartKind

FULL_VOLTS, FULL_MILLIAMPERES = 10.0, 20.0
SHORT_LIST = 3
"""Greatest number of input names that are listed one by one."""
_LEVEL = re.compile(r"(\d+(?:\.\d+)?)\s*(v|ma|%)?", re.IGNORECASE)
_OPEN, _CLOSED = frozenset({"0", "off", "open"}), frozenset({"1", "on", "closed"})


@dataclass(frozen=True, slots=True)
class TerminalNames:
    """Names of a family's terminals; the first analog input gives the reference."""

    logic: tuple[str, ...]
    analog: tuple[str, ...]
    forward: str
    reverse: str
    reset: str = ""


def _altivar(logic: int, analog: int) -> TerminalNames:
    return TerminalNames(
        tuple(f"LI{n}" for n in range(1, logic + 1)),
        tuple(f"AI{n}" for n in range(1, analog + 1)),
        "LI1",
        "LI2",
    )


PLAIN_TERMINALS = TerminalNames(("RUN", "REV", "RESET"), ("AI1",), "RUN", "REV", "RESET")
"""Terminals of a drive whose own names are unknown."""
BY_KIND: Mapping[ChartKind, TerminalNames] = {
    "drivecom": _altivar(14, 4),
    "altivar21": TerminalNames(("F", "R", "RES"), ("VIA", "VIB"), "F", "R", "RES"),
    "leroy-somer": PLAIN_TERMINALS,
    "own": PLAIN_TERMINALS,
}
COMPACT = _altivar(6, 3)
"""Terminals of the Altivar 31 and 312."""


@dataclass
class Terminals:
    """Present inputs of one drive."""

    names: TerminalNames
    _closed: set[str] = field(default_factory=set)
    _levels: dict[str, float] = field(default_factory=dict)

    def closed(self, name: str) -> bool:
        """Return True if a logic input is on."""
        return name in self._closed

    def level(self, name: str) -> float:
        """Return an analog input as a share of its full scale, 0..1."""
        return self._levels.get(name, 0.0)

    def close(self, name: str, closed: bool = True) -> None:
        """Switch a logic input on or off."""
        (self._closed.add if closed else self._closed.discard)(name)

    def apply(self, name: str, level: float) -> None:
        """Set an analog input to a share of its full scale; values outside 0..1 are limited."""
        self._levels[name] = min(max(level, 0.0), 1.0)

    def set(self, name: str, text: str) -> str:
        """Set an input by name (`LI1`, `ai1`) to `1`, `0`, `5`, `5V`, `12mA` or `50%`.

        Returns the resulting text for a person. Raises SimulatorError.
        """
        wanted, value = self.check(name, text)
        if isinstance(value, bool):
            self.close(wanted, value)
            return f"{wanted} = {int(value)}"
        self.apply(wanted, value)
        return f"{wanted} = {100 * value:g} %"

    def check(self, name: str, text: str) -> tuple[str, bool | float]:
        """Return the input of a name and its new value; raises SimulatorError."""
        wanted = name.strip().upper()
        if wanted in self.names.logic:
            return wanted, _switch(wanted, text)
        if wanted in self.names.analog:
            return wanted, _part(wanted, text)
        known = ", ".join((*self.names.logic, *self.names.analog))
        raise SimulatorError(f"No input is called {name.strip()!r} here. Inputs: {known}.")

    def bits(self) -> int:
        """Return the logic inputs as bits, the first in bit 0."""
        return sum(1 << bit for bit, name in enumerate(self.names.logic) if self.closed(name))

    def reported(self) -> str:
        """Return all inputs as one line, for a person."""
        logic = self.names.logic
        group = f"{logic[0]} to {logic[-1]}" if len(logic) > SHORT_LIST else ", ".join(logic)
        closed = ", ".join(name for name in logic if self.closed(name)) or "none"
        levels = ", ".join(f"{name} {100 * self.level(name):g} %" for name in self.names.analog)
        return f"closed of {group}: {closed}; {levels}"


def _switch(name: str, text: str) -> bool:
    word = text.strip().casefold()
    if word not in _OPEN | _CLOSED:
        raise SimulatorError(f"{name} is a logic input: 1 or 0, not {text.strip()!r}.")
    return word in _CLOSED


def _part(name: str, text: str) -> float:
    match = _LEVEL.fullmatch(text.strip())
    if match is None:
        raise SimulatorError(
            f"{name} is an analog input: 5 or 5V of 10 V, 12mA of 20 mA, or 50%,"
            f" not {text.strip()!r}."
        )
    unit = (match[2] or "v").casefold()
    full = {"v": FULL_VOLTS, "ma": FULL_MILLIAMPERES, "%": 100.0}[unit]
    part = float(match[1]) / full
    if part > 1:
        raise SimulatorError(f"{name}: {text.strip()} is more than its full scale.")
    return part
