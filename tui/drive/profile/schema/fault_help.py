"""The form of a help file: help on the faults and alarms of a family."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Literal

from msgspec import Meta

from .base import BitNumber, RawWord, Table, When

HelpConfidence = Literal["manual", "public", "practice"]
"""Certainty of the first cause; `practice` is general practice, from no document."""

ResetWay = Literal["by-reset", "automatic", "by-itself", "power-cycle"]
"""End of a fault once its cause is gone: by a reset, by the drive's automatic restart too if
that is on, without action, or only by switching the drive off and on."""


class LookAt(Table, frozen=True, kw_only=True):
    """A parameter to check after a fault, and why."""

    code: str
    why: str


class RuledOut(Table, frozen=True, kw_only=True):
    """A cause or a check that the value of a parameter rules out."""

    text: str
    """The cause or check, word for word as in `probable` or `check`."""
    parameter: str
    values: list[int] = []
    """Raw values that rule it out."""
    min: int | None = None
    """With `max`: the lowest raw value that rules it out."""
    max: int | None = None
    """With `min`: the highest raw value that rules it out."""
    when: list[When] = []
    """Conditions; their words must be known."""

    def holds(self, raws: Mapping[str, int]) -> bool:
        """True if it is ruled out; an unknown value rules out nothing."""
        raw = raws.get(self.parameter)
        if raw is None or not all(when.holds(raws) for when in self.when):
            return False
        within = self.min is not None and self.max is not None and self.min <= raw <= self.max
        return raw in self.values or within


class Hint(Table, frozen=True, kw_only=True):
    """Help on a fault or alarm: causes, checks, parameters."""

    probable: Annotated[list[str], Meta(min_length=1)]
    """Probable causes, the likeliest first."""
    check: list[str] = []
    look_at: list[LookAt] = []
    ruled_out: list[RuledOut] = []
    """Causes and checks that a value can rule out."""
    source: str = ""
    confidence: HelpConfidence = "practice"


class FaultHelp(Hint, frozen=True, kw_only=True):
    """Help on a fault."""

    raw: RawWord | None = None
    """The fault, as among the profile's codes; absent: any trip of a family without numbers."""
    code: str = ""
    """Code of the fault, for readers of the file; must match the profile."""
    name: str = ""
    """Name of the fault if `raw` is absent."""
    reset: ResetWay | None = None
    """End of the fault; absent if no document states it. Recalled from memory, so the drive's own
    sign takes precedence."""
    wait_s: Annotated[int, Meta(ge=1)] | None = None
    """Approximate seconds to wait before a reset can work."""


class AlarmHelp(Hint, frozen=True, kw_only=True):
    """Help on an alarm bit."""

    word: str
    """The parameter that carries the bit."""
    bit: BitNumber
    name: str = ""


class HelpData(Table, frozen=True, kw_only=True):
    """A whole help file."""

    faults: list[FaultHelp] = []
    """Help on each fault."""
    alarms: list[AlarmHelp] = []
    """Help on each alarm bit."""
