"""Raw values by their names; names of older versions, kept in backups and scripts, work too."""

from __future__ import annotations

from collections.abc import Mapping

FORMER_WORDS = {
    "analogue": "analog",
    "customised": "customized",
    "optimised": "optimized",
    "synchronisation": "synchronization",
    "travelling": "traveling",
    "stand-by": "standby",
    "lock-out": "lockout",
    "in force": "active",
    "run order": "run command",
    "dc bus kept up": "dc bus maintained",
    "speed kept": "speed maintained",
    "watch over the speed": "speed monitoring",
    "cut on the output side detected": "disconnection on the output side",
}
"""Words of value names in versions up to 0.2.1, and the words that replaced them, case-folded."""


def raw_of_name(typed: str, names: Mapping[int, str]) -> int | None:
    """Return the raw value with that name in any case; None if there is none."""
    folded = typed.casefold()
    found = next((raw for raw, name in names.items() if name.casefold() == folded), None)
    if found is not None:
        return found
    for former, present in FORMER_WORDS.items():
        folded = folded.replace(former, present)
    return next((raw for raw, name in names.items() if name.casefold() == folded), None)
