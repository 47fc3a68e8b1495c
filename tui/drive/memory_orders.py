"""How each family saves its settings and goes back to its factory settings, as data.

Only what a document of the family says is here; a family without an entry is refused with what
is known. Sources: ATV312 communication variables, CMI and SCS (the ATV31 by analogy for CMI);
ATV71 communication parameters guide, configuration management; ATV21 Modbus manual 8.2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from .errors import DriveError
from .profile import Profile


class MemoryRefused(DriveError):
    """The settings cannot be saved or recalled from here, and why."""


@dataclass(frozen=True, slots=True)
class MemoryOrder:
    """A word that saves or recalls settings."""

    parameter: str
    raw: int
    """The value, or the bit that is set while the other bits stay."""
    bit: bool
    does: str
    """What exactly happens, for the person who is asked."""
    at_rest_mask: int = 0
    """Bits of the extended status word that must be 0 before."""
    groups: str = ""
    """A word that chooses the groups of settings; nothing happens while it is 0."""


_SAVE = (
    "All present settings are copied from working memory (RAM) to EEPROM and so outlast a"
    " power-off. The motor must be stopped; nothing can be written meanwhile."
)
_LIFE = " The EEPROM lasts for 100,000 writes."
_COMPACT_FACTORY = (
    "Every setting goes back to its factory value in working memory; standard motor frequency,"
    " keypad settings and the line's own settings stay. The access level goes back to L1 and"
    " commands to the terminals: the line commands the drive no more, and a run order that waits"
    " at the terminals can start the motor. EEPROM keeps the old settings until they are saved"
    " over."
)
_ATV71_FACTORY = (
    "The groups of settings that FRY selects go back to their factory values in working memory;"
    " where these hold the command channels, commands go back to the terminals: a run order that"
    " waits there can start the motor. EEPROM keeps the old settings until they are saved over."
)
_BIT_0, _BIT_1 = 1 << 0, 1 << 1
_RUNNING_OR_INJECTING = 1 << 4 | 1 << 5

SAVE: Mapping[str, MemoryOrder] = {
    "atv31": MemoryOrder("SCS", 2, False, _SAVE),
    "atv312": MemoryOrder("SCS", 2, False, _SAVE),
    "atv71": MemoryOrder("CMI", _BIT_1, True, _SAVE + _LIFE),
}
FACTORY: Mapping[str, MemoryOrder] = {
    "atv31": MemoryOrder("CMI", _BIT_0, True, _COMPACT_FACTORY, _RUNNING_OR_INJECTING),
    "atv312": MemoryOrder("CMI", _BIT_0, True, _COMPACT_FACTORY, _RUNNING_OR_INJECTING),
    "atv71": MemoryOrder("CMI", _BIT_0, True, _ATV71_FACTORY, groups="FRY"),
}


def save_order(profile: Profile) -> MemoryOrder:
    """How a family saves its settings; raises MemoryRefused where there is nothing to order."""
    if (order := SAVE.get(profile.id)) is not None:
        return order
    storages = {p.storage for p in profile.parameters if p.access in ("rw", "rw-stopped")}
    if "eeprom" in storages and "ram-until-saved" not in storages:
        raise MemoryRefused(
            f"{profile.name} keeps each setting in EEPROM as soon as it is written: nothing is"
            " to be saved."
        )
    raise MemoryRefused(
        f"How {profile.name} saves settings over the line is in no document at hand: save them"
        " at its keypad."
    )


def factory_order(profile: Profile) -> MemoryOrder:
    """How a family goes back to factory settings; raises MemoryRefused where that is not known."""
    if (order := FACTORY.get(profile.id)) is not None:
        return order
    raise MemoryRefused(
        f"Which word of {profile.name} recalls the factory settings is in no document at hand:"
        " do it at its keypad, or restore a parameter set."
    )
