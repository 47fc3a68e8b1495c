"""The first commissioning of a drive, step by step."""

from __future__ import annotations

from typing import Literal

from .base import Confidence, Table


class StartUpStep(Table, frozen=True, kw_only=True):
    """One step of a first commissioning; the steps stand in their order.

    Their parameters, in this order, are the group Simply start of the editor.
    """

    step: str
    """What it is called, in a word or two."""
    text: str
    """What is to be decided or done, for the person at the machine."""
    parameters: list[str] = []
    """Codes in the order in which they are set or looked at."""
    action: Literal["", "auto-tune", "save", "first-run", "take-control"] = ""
    """What the step does beyond setting values."""
    stopped_only: bool = False
    note: str = ""
    source: str
    confidence: Confidence | Literal["practice"]
    """How surely the step belongs here; `practice` is general practice, from no document."""
