"""Commands that save a drive's settings and restore its factory settings."""

from __future__ import annotations

from collections.abc import Collection
from typing import Literal

import msgspec

from ..errors import DriveError
from ..profile.profile import Profile
from ..profile.schema import MemoryOrder, Parameter
from .writable import is_setting


class MemoryRefused(DriveError):
    """The settings cannot be saved or restored over Modbus; the text gives the reason."""


NOTHING_UNSAVED = "Nothing to save: this program has written no setting that is not in EEPROM."


def eeprom_copy(parameter: Parameter) -> Parameter | None:
    """Return a parameter at its EEPROM address; None if it has none."""
    if parameter.eeprom_address is None:
        return None
    return msgspec.structs.replace(
        parameter, address=parameter.eeprom_address, eeprom_address=None, storage="eeprom"
    )


def saved_by_address(profile: Profile, codes: Collection[str]) -> list[Parameter] | None:
    """Return the EEPROM copies of these settings; None if the family saves by a command.

    Raises MemoryRefused if none of them has one.
    """
    if all(parameter.eeprom_address is None for parameter in profile.parameters):
        return None
    found = [copy for code in sorted(codes) if (copy := eeprom_copy(profile[code])) is not None]
    if not found:
        raise MemoryRefused(NOTHING_UNSAVED)
    return found


def save_effect(profile: Profile, unsaved: Collection[str]) -> str:
    """Return what a save does, for its question. Raises MemoryRefused if there is none."""
    if (copies := saved_by_address(profile, unsaved)) is None:
        return save_order(profile).does
    names = ", ".join(copy.code for copy in copies)
    return f"Writes the present value of {names} to the EEPROM. The motor must be stopped."


def save_order(profile: Profile) -> MemoryOrder:
    """Return the command that saves settings; raises MemoryRefused if the family has none."""
    if (order := profile.data.memory.save) is not None:
        return order
    storages = {p.storage for p in profile.parameters if p.access in ("rw", "rw-stopped")}
    if "eeprom" in storages and "ram-until-saved" not in storages:
        raise MemoryRefused(
            f"{profile.name} stores each setting in EEPROM when it is written. You do not have to"
            " save."
        )
    raise MemoryRefused(
        f"No available document says how {profile.name} saves settings over Modbus. Save them on"
        " its keypad."
    )


def factory_order(profile: Profile) -> MemoryOrder:
    """Return the command for factory settings; raises MemoryRefused if it is not known."""
    if (order := profile.data.memory.factory) is not None:
        return order
    raise MemoryRefused(
        f"No available document says which word of {profile.name} restores the factory settings."
        " Use its keypad, or restore a parameter set."
    )


def eeprom_use(profile: Profile, parameter: Parameter, raw: int) -> Literal["", "write", "save"]:
    """Return what a write of a raw value stores in the EEPROM: nothing, the parameter, or all.

    A setting that is stored in an unknown way counts as one that goes to EEPROM.
    """
    memory, raws = profile.data.memory, {parameter.code: raw & 0xFFFF}
    saved_by = memory.save
    if saved_by is not None and saved_by.parameter == parameter.code:
        wanted = saved_by.raw & 0xFFFF
        if (raw & wanted == wanted) if saved_by.bit else (raw & 0xFFFF == wanted):
            return "save"
    if any(when.holds(raws) for when in memory.eeprom.also_saved_by):
        return "save"
    stored = parameter.storage in ("eeprom", "unknown") and is_setting(profile, parameter)
    return "write" if stored else ""
