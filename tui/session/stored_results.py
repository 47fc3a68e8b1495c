"""Results of `drivepanel accept` in a folder and its subfolders, for a report."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Literal

import msgspec

from tui.drive.profile.profile import Profile
from tui.drive.settings.parameter_set import ParameterSet
from tui.drive.small_file import read_small_text

from .acceptance.result import settings_hash
from .connect.line_key import line_key
from .read.upload import setting_codes

FILES_READ = 500
"""Most JSON files that are read, the newest first: a large folder must not delay a report."""


class StoredStep(msgspec.Struct):
    """A step of a result; further fields are ignored."""

    outcome: str


class StoredResult(msgspec.Struct):
    """The fields of a result that a report shows; further ones are ignored."""

    command: Literal["accept"]
    line: str
    device: int
    profile: str
    name: str
    passed: bool
    begun: datetime
    by: str
    steps: list[StoredStep]
    identity: dict[str, str] = {}
    why_not: str | None = None
    settings_hash_after: str | None = None

    @property
    def steps_text(self) -> str:
        """Count of passed steps."""
        return f"{sum(s.outcome == 'passed' for s in self.steps)} of {len(self.steps)}"


def results_in(folder: Path) -> list[StoredResult]:
    """Return the results in a folder and its subfolders, newest first; skip all other files."""
    found: list[StoredResult] = []
    paths = sorted((*folder.glob("*.json"), *folder.glob("*/*.json")), key=_age)
    for path in paths[:FILES_READ]:
        # a missing field, or a half of a character, is not a result either
        with suppress(OSError, ValueError, RecursionError, msgspec.ValidationError):
            found.append(msgspec.convert(json.loads(read_small_text(path)), StoredResult))
    return sorted(found, key=lambda result: result.begun.timestamp(), reverse=True)


def _age(path: Path) -> float:
    """Return a number that is smaller for a newer file."""
    try:
        return -path.stat().st_mtime
    except OSError:
        return 0.0


def results_of(results: Iterable[StoredResult], values: ParameterSet) -> list[StoredResult]:
    """Return the newest result of each test of the drive that was read, newest first.

    Results of another drive at the same address are omitted, if both drives identify themselves.
    """
    head = values.head
    key = line_key(head.line)
    newest: dict[str, StoredResult] = {}
    for result in results:
        if (result.profile, result.device) != (head.profile, head.device):
            continue
        if line_key(result.line) == key and _may_be_same(result.identity, head.identity):
            newest.setdefault(result.name, result)
    return [*newest.values()]


def _may_be_same(first: Mapping[str, str], other: Mapping[str, str]) -> bool:
    return all(first[key] == other[key] for key in first.keys() & other.keys())


def unchanged_since(result: StoredResult, profile: Profile, values: ParameterSet) -> bool | None:
    """Return True if the drive has the settings that it had after the test; None if unknown."""
    if result.settings_hash_after is None:
        return None
    codes = setting_codes(profile)
    raws = {code: values.raws[code] for code in codes if code in values.raws}
    now = settings_hash(ParameterSet(values.head, raws))
    return result.settings_hash_after == now
