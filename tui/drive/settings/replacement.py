"""A drive that may replace another one: signs of factory settings, and its predecessor's identity.

Pure functions. A set of a predecessor is of the same family, or of one that the profile replaces.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from typing import NamedTuple

from ..profile.profile import Profile
from ..profile.schema import Predecessor
from .factory import factory_raw, not_factory
from .parameter_set import ParameterSet, SetHead, lacking
from .rating import rated, rating_codes
from .writable import CUTTING, is_setting

_FAMILY = re.compile(r"[A-Za-z]+\d+(.+)")
LEAST_AT_FACTORY = 3
NEW_DRIVE_SHARE = 0.5
"""Least share of settings with the factory value; some are set on a new drive to reach it."""


class FactoryCount(NamedTuple):
    """Count of settings that the predecessor had changed, and of those at the factory setting."""

    at_factory: int
    known: int

    @property
    def looks_new(self) -> bool:
        """True if the drive may be new; it is only a reason for an offer."""
        return self.at_factory >= max(LEAST_AT_FACTORY, NEW_DRIVE_SHARE * self.known)

    @property
    def text(self) -> str:
        """The counts as a sentence."""
        count = f"{self.at_factory} of {self.known}"
        return f"{count} settings that the predecessor had changed have their factory setting."


def predecessor_families(profile: Profile) -> list[str]:
    """Return the ids of profiles whose sets may be those of a predecessor."""
    return [profile.id, *(table.profile for table in profile.data.predecessors)]


def changed_settings(profile: Profile, old: Profile, source: ParameterSet) -> list[str]:
    """Return this profile's codes of settings that the predecessor had changed from the factory.

    Line settings and motor data are omitted: every drive has its own.
    """
    same = Predecessor(profile=old.id, same_codes=True, source="", confidence="manual")
    tables = profile.data.predecessors
    table = next((t for t in tables if t.profile == old.id), same)
    links = {s.parameter for s in profile.data.link.settings if s.role in CUTTING}
    absent = lacking(old, source.raws)
    found: list[str] = []
    for theirs in old.parameters:
        ours = profile.get(table.counterpart(theirs.code))
        if ours is None or ours.code in links or rated(ours) or not is_setting(profile, ours):
            continue
        if not_factory(old, theirs, source.raws, absent):
            found.append(ours.code)
    return found


def factory_count(
    profile: Profile, codes: Iterable[str], raws: Mapping[str, int], absent: Collection[str] = ()
) -> FactoryCount:
    """Count the settings of `changed_settings` that this drive has as the factory set them.

    Settings that were not read, and those without a known factory setting, do not count.
    """
    known = [
        profile[code]
        for code in codes
        if code in raws and factory_raw(profile, profile[code], raws, absent) is not None
    ]
    at_factory = sum(not not_factory(profile, p, raws, absent) for p in known)
    return FactoryCount(at_factory, len(known))


def is_of_another_drive(now: SetHead, before: SetHead) -> bool:
    """Return True if a set of this address is of a drive with another family or identity."""
    both = now.identity.keys() & before.identity.keys()
    other = any(now.identity[key] != before.identity[key] for key in both)
    return before.device == now.device and (before.profile != now.profile or other)


def identity_lines(
    profile: Profile, now: SetHead, held: Mapping[str, int], old: Profile, source: ParameterSet
) -> list[str]:
    """Return sentences that compare rating and firmware of a drive with those of its predecessor.

    `now` has the identity of the drive, `held` its raw values.
    """
    before = source.head
    return [
        f"Predecessor: {_identity_text(old, before)}; set of {before.time or 'unknown time'}.",
        f"This drive: {_identity_text(profile, now)}.",
        _rating_text(_model(now), _model(before), _same_words(profile, held, source)),
        _firmware_text(now.identity.get("version", ""), before.identity.get("version", "")),
    ]


def _identity_text(profile: Profile, head: SetHead) -> str:
    version = head.identity.get("version", "")
    parts = (profile.name, head.identity.get("reference", ""), version and f"version {version}")
    return ", ".join(part for part in parts if part)


def _model(head: SetHead) -> str:
    """Return the reference behind the letters and digits of its family; empty if not known."""
    found = _FAMILY.match(head.identity.get("reference", ""))
    return found[1] if found else ""


def _same_words(profile: Profile, held: Mapping[str, int], source: ParameterSet) -> bool | None:
    """Compare the words that show the model; None if a word is missing, or of another family."""
    codes = rating_codes(profile) if source.head.profile == profile.id else []
    known = [code for code in codes if code in held and code in source.raws]
    return all(held[code] == source.raws[code] for code in known) if known else None


def _rating_text(now: str, before: str, same: bool | None) -> str:
    if now and before and now != before and (now.startswith(before) or before.startswith(now)):
        return f"Rating: the same model, another variant ({before}, now {now})."
    if now and before:
        same = now == before
    if same is None:
        return "Rating: not known. Compare the nameplates."
    if same:
        return "Rating: the same model."
    return f"Rating: another model ({before or '-'}, now {now or '-'}). Compare the nameplates."


def _firmware_text(now: str, before: str) -> str:
    if not now or not before:
        return "Firmware: not known."
    if now == before:
        return "Firmware: the same version."
    return "Firmware: another version. A setting may have another meaning or limit: test the drive."
