"""The first commissioning of a drive, step by step."""

from __future__ import annotations

from typing import Literal

from .base import Confidence, Table


class StartUpStep(Table, frozen=True, kw_only=True):
    """One step of a first commissioning; the steps are in their order.

    Their parameters, in this order, are the group Simply start of the editor.
    """

    step: str
    """Short name of the step."""
    text: str
    """Decision or task for the technician at the machine."""
    parameters: list[str] = []
    """Codes in the order in which they are set or checked."""
    action: Literal["", "auto-tune", "save", "first-run", "take-control"] = ""
    """Action of the step besides setting values."""
    stopped_only: bool = False
    note: str = ""
    source: str
    confidence: Confidence | Literal["practice"]
    """Certainty that the step belongs here; `practice` is general practice, from no document."""
