"""A person's consent to frequent writes to a drive's EEPROM."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING

from ..shared.say import Messages
from .asking import may_ask, says_yes

if TYPE_CHECKING:
    from tui.session.journal import Journal
    from tui.session.settings.wear import WearGate


def wear_gate(journal: Journal, confirmed: Collection[str], messages: Messages) -> WearGate:
    """Return the decision of a command: warn, ask at a terminal, else require --confirm CODE."""
    from tui.session.settings.wear import WearGate

    return WearGate(
        journal.eeprom,
        confirmed,
        says_yes if may_ask() else None,
        messages.complain,
        "Use --confirm {code} to write it anyway.",
    )
