"""The form of a help file: what the faults and alarms of a family point at."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta

from .base import BitNumber, RawWord, Table

HelpConfidence = Literal["manual", "public", "practice"]
"""How surely the first cause is known; `practice` is general practice, from no document."""

ResetWay = Literal["by-reset", "automatic", "by-itself", "power-cycle"]
"""How a fault ends once its cause is gone: by a reset, by the drive's automatic restart too where
that is switched on, by itself, or only by switching the drive off and on."""


class LookAt(Table, frozen=True, kw_only=True):
    """A parameter to look at after a fault, and why."""

    code: str
    why: str


class Hint(Table, frozen=True, kw_only=True):
    """What something points at: causes, checks, parameters."""

    probable: Annotated[list[str], Meta(min_length=1)]
    """Probable causes, the likeliest first."""
    check: list[str] = []
    look_at: list[LookAt] = []
    source: str = ""
    confidence: HelpConfidence = "practice"


class FaultHelp(Hint, frozen=True, kw_only=True):
    """What a fault points at."""

    raw: RawWord | None = None
    """The fault, as among the profile's codes; absent: any trip of a family without numbers."""
    code: str = ""
    """Its code, for who reads the file; it must be that of the profile."""
    name: str = ""
    """What it is called, where `raw` is absent."""
    reset: ResetWay | None = None
    """How it ends; absent where nobody says. Recalled, never sure: the drive knows better."""
    wait_s: Annotated[int, Meta(ge=1)] | None = None
    """Seconds to wait before a reset can work, about."""


class AlarmHelp(Hint, frozen=True, kw_only=True):
    """What an alarm bit points at."""

    word: str
    """The parameter that carries the bit."""
    bit: BitNumber
    name: str = ""


class HelpData(Table, frozen=True, kw_only=True):
    """A whole help file."""

    faults: list[FaultHelp] = []
    """What each fault points at."""
    alarms: list[AlarmHelp] = []
    """What each alarm bit points at."""
