"""Permissions of a gateway's clients, and the drive behind each unit id."""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass

from tui.drive.errors import DriveError
from tui.drive.foreign_write import ALL
from tui.drive.profile import library

HIGHEST_DEVICE = 247
_MAPPED = re.compile(r"(\d+)(?:-(\d+))?=(\d+)(?:@(\d+))?")


class RulesError(DriveError):
    """Typed unit ids or codes are not valid."""


@dataclass(frozen=True, slots=True)
class GatewayRules:
    """Permissions of clients; reading is always allowed, and so are words that only stop."""

    fresh: float = 0.0
    """Seconds for which a value that was read before is sent as a reply; 0 reads each time."""
    writes: frozenset[str] = frozenset()
    """Codes of settings that may be written, or `ALL`."""
    commands: bool = False
    """True if command words and references may be written."""


def allowed_codes(text: str) -> frozenset[str]:
    """Parse typed codes, separated by commas, or `all` in any case. Raises RulesError."""
    codes = frozenset(part.strip() for part in text.split(",") if part.strip())
    if not codes:
        raise RulesError(f"{text!r} has no code. Use codes such as ACC,DEC, or all.")
    return frozenset(ALL if code.casefold() == ALL else code for code in codes)


def as_written(codes: frozenset[str]) -> frozenset[str]:
    """Return codes in the case that the families use.

    Raises RulesError for a code that no family has; it would allow nothing, and silently.
    """
    if codes <= {ALL}:
        return codes
    known = defaultdict[str, set[str]](set)
    for listing in library.listings():
        with suppress(DriveError):  # no drive uses a profile that cannot be read
            for parameter in library.load(listing.id).parameters:
                known[parameter.code.casefold()].add(parameter.code)
    if strange := sorted(code for code in codes - {ALL} if code.casefold() not in known):
        raise RulesError(
            f"No family has a parameter {', '.join(strange)}. Use codes such as ACC,DEC, or all."
        )
    return frozenset(own for code in codes for own in known.get(code.casefold(), {code}))


def unit_map(lines: int, texts: Sequence[str]) -> Mapping[int, tuple[int, int]]:
    """Return the line (from 0) and the device of each unit id.

    `texts` are `FIRST-LAST=LINE[@DEVICE]`: these ids are the devices from DEVICE on (default: the
    same numbers) of line LINE, from 1. Without texts, ids are the devices of the only line.
    Raises RulesError.
    """
    if not texts:
        if lines > 1:
            raise RulesError(
                "Several lines have the same ids. Map them, for example"
                " --map 1-31=1 --map 101-131=2@1."
            )
        return {device: (0, device) for device in range(1, HIGHEST_DEVICE + 1)}
    found: dict[int, tuple[int, int]] = {}
    for text in texts:
        match = _MAPPED.fullmatch(text.strip())
        if match is None:
            raise RulesError(
                f"{text!r} is not a mapping. Use IDS=LINE[@DEVICE], for example 101-131=2@1."
            )
        first, last = int(match[1]), int(match[2] or match[1])
        line, device = int(match[3]), int(match[4] or match[1])
        if not 1 <= line <= lines:
            raise RulesError(f"{text!r}: there is no line {line}. Lines given: {lines}.")
        if last < first:
            right = f"{last}-{first}={text.strip().partition('=')[2]}"
            raise RulesError(f"{first}-{last} ends before it begins. Use {right}.")
        if not 1 <= first <= last <= 255 or not 1 <= device <= HIGHEST_DEVICE - (last - first):
            raise RulesError(f"{text!r}: use ids 1 to 255, and devices 1 to {HIGHEST_DEVICE}.")
        for offset in range(last - first + 1):
            if first + offset in found:
                raise RulesError(f"{text!r}: id {first + offset} is given twice.")
            found[first + offset] = line - 1, device + offset
    return found
