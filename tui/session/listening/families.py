"""Family of a drive polled by another master: named, self-reported, remembered, or likely.

The likely family follows from the drive's answers: addresses that a family has, functions, the
longest read.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from tui.bus.link import Link
from tui.drive.profile import library
from tui.drive.profile.profile import Profile
from tui.drive.words import word_count
from tui.wire.observed.pairing import ObservedExchange

from ..connect.identify import DriveIdentity, identity_from
from ..connect.known_lines import line_name, load_memory
from .words import identity_objects, spans_of

How = Literal["named", "identified", "remembered", "likely"]
NO_SUCH_FUNCTION, NO_SUCH_ADDRESS = 1, 2
"""Exception codes."""


@dataclass(frozen=True, slots=True)
class AssumedProfile:
    """Assumed profile of a drive, and its source."""

    profile: Profile
    how: How
    others: tuple[str, ...] = ()
    """Ids of other profiles that fit equally."""


@dataclass(slots=True)
class _Evidence:
    """Answers of a drive so far."""

    answered: set[tuple[int, int]] = field(default_factory=set)
    """Function and address of each answered word."""
    lacking: set[tuple[int, int]] = field(default_factory=set)
    functions: set[int] = field(default_factory=set)
    unknown_functions: set[int] = field(default_factory=set)
    longest: int = 0
    """Words of the longest read."""

    @property
    def size(self) -> int:
        """Number of facts; grows with each new one."""
        words, functions = len(self.answered) + len(self.lacking), len(self.functions)
        return words + functions + len(self.unknown_functions) + self.longest


def remembered_families(link: Link) -> dict[int, str]:
    """Return, by device, profile ids of drives that answered on a line at its last use."""
    key = line_name(link).key
    mark = load_memory().lines.get(key) if key else None
    found = {}
    for device, drive in (mark.drives if mark is not None else {}).items():
        fits = library.matching_profiles(drive.reference) if drive.reference else []
        if profile := drive.profile or next(iter(fits), ""):
            found[device] = profile
    return found


class Families:
    """Families of the drives on one line, learned from observed exchanges."""

    def __init__(
        self,
        known: Sequence[Profile],
        named: Mapping[int | None, Profile] | None = None,
        remembered: Mapping[int, str] | None = None,
    ) -> None:
        self._known = {profile.id: profile for profile in known}
        self._named = named or {}
        self._remembered = remembered or {}
        self._evidence: dict[int, _Evidence] = {}
        self._likely: dict[int, tuple[int, AssumedProfile | None]] = {}
        """By device, the number of facts used, and the result."""
        self.identities: dict[int, DriveIdentity] = {}
        """Identities that drives have reported to any program."""

    def family(self, device: int) -> AssumedProfile | None:
        """Return the likely family of a drive; None if nothing indicates one."""
        named = self._named.get(device) or self._named.get(None)
        if named is not None:
            return AssumedProfile(named, "named")
        identity = self.identities.get(device)
        if identity is not None and identity.profile in self._known:
            return AssumedProfile(self._known[identity.profile], "identified")
        remembered = self._remembered.get(device)
        if remembered in self._known:
            return AssumedProfile(self._known[remembered], "remembered")
        return self._inferred(device)

    def note(self, exchange: ObservedExchange) -> None:
        """Add the facts of an exchange."""
        if (objects := identity_objects(exchange)) is not None:
            reported = identity_from(exchange.device, objects)
            if reported.reference or exchange.device not in self.identities:
                self.identities[exchange.device] = reported
        if exchange.answer not in ("ok", "exception"):
            return
        evidence = self._evidence.setdefault(exchange.device, _Evidence())
        spans = spans_of(exchange.request)
        words = {(s.function, s.address + n) for s in spans for n in range(s.count)}
        if exchange.answer == "ok":
            evidence.functions.add(exchange.function)
            evidence.answered |= words
            reads = [span.count for span in spans if not span.written]
            evidence.longest = max([evidence.longest, *reads])
        elif exchange.exception == NO_SUCH_FUNCTION:
            evidence.unknown_functions.add(exchange.function)
        elif exchange.exception == NO_SUCH_ADDRESS and len(words) == 1:
            evidence.lacking |= words

    def _inferred(self, device: int) -> AssumedProfile | None:
        evidence = self._evidence.get(device)
        if evidence is None or not evidence.answered:
            return None
        size, found = self._likely.get(device, (-1, None))
        if size != evidence.size:
            found = _likeliest(evidence, tuple(self._known.values()))
            self._likely[device] = evidence.size, found
        return found


def _likeliest(evidence: _Evidence, known: Sequence[Profile]) -> AssumedProfile | None:
    scores = {profile.id: _score(evidence, profile) for profile in known}
    best = max(scores.values(), default=0.0)
    if best <= 0:
        return None
    first, *others = [profile for profile in known if scores[profile.id] == best]
    return AssumedProfile(first, "likely", tuple(profile.id for profile in others))


def _score(evidence: _Evidence, profile: Profile) -> float:
    """Return how well a family fits the answers of a drive; 0 and less if it does not."""
    functions = {function.code for function in profile.data.functions}
    if evidence.functions - functions:
        return 0.0
    longest = max((function.max_read or 1 for function in profile.data.functions), default=1)
    if evidence.longest > longest:
        return 0.0
    reported = _words(profile)
    hits = len(evidence.answered & reported)
    misses = len(evidence.answered) - hits
    # a refused address may be one that this model lacks, or that is unavailable at the moment
    doubts = len(evidence.lacking & reported) + len(evidence.unknown_functions & functions)
    weight = 0.5 if profile.data.reading.gaps_readable else 1.0
    return hits - weight * misses - 0.5 * doubts


def _words(profile: Profile) -> set[tuple[int, int]]:
    """Function and address of every word that a family knows, blocks included."""
    found: set[tuple[int, int]] = {
        (parameter.function, parameter.address) for parameter in profile.parameters
    }
    found |= {(p.function, p.address + n) for p in profile.parameters for n in range(word_count(p))}
    for block in profile.data.blocks:
        found |= {(3, block.address + n) for n in range(block.max_words)}
    return found
