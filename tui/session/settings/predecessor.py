"""Backups of a drive or of its predecessor, and the notice about a drive that replaces another."""

from __future__ import annotations

import asyncio
from pathlib import Path

from tui.bus.api import Priority
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.settings.factory import factory_sources
from tui.drive.settings.parameter_set import ParameterSet
from tui.drive.settings.replacement import (
    changed_settings,
    factory_count,
    predecessor_families,
)
from tui.drive.shown import depends_on

from ..drive import DriveSession
from ..read.retrying_reader import RetryingReader
from .backups import newest_set

SETTINGS_SAMPLED = 24
"""Settings that are read to recognize factory settings."""


def predecessor_set(profile: Profile, line: str, device: int) -> tuple[Path, ParameterSet] | None:
    """Return the newest set of this address, of the drive's family or of one that it replaces."""
    return newest_set(predecessor_families(profile), line, device)


async def predecessor_notice(session: DriveSession) -> str:
    """Return a sentence if a drive has factory settings and its newest backup has others.

    It reads files, and then a few settings if there is such a backup. Writes nothing. Raises the
    line's errors.
    """
    profile = session.profile
    found = await asyncio.to_thread(predecessor_set, profile, session.line_text, session.device)
    if found is None:
        return ""
    _, values = found
    codes = changed_settings(profile, library.load(values.head.profile), values)
    sampled = codes[:SETTINGS_SAMPLED]
    sources = {s for c in sampled for s in (*depends_on(profile[c]), *factory_sources(profile[c]))}
    reader = RetryingReader(session, Priority.BACKGROUND)
    raws = await reader.ask_raws([*dict.fromkeys((*sampled, *sources))])
    count = factory_count(profile, sampled, raws, reader.lacking)
    if not count.looks_new:
        return ""
    made = values.head.time[:16].replace("T", " ") or "unknown time"
    return f"Drive {session.device} may be new: {count.text} Its backup is of {made}."
