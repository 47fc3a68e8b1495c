"""Facts of profiles for scanning: settings, turnaround, reads, timeouts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from decimal import Decimal
from typing import TypeVar

from tui.wire.frames import character_seconds, silent_seconds

from .profile.profile import Profile
from .profile.schema import LinkSettings

T = TypeVar("T")

FACTORY_SHARE = Decimal("0.5")
"""Share of a family's drives assumed to have factory settings, for each setting."""
SLOW_BELOW = 1200
"""Baud rates below it are tried last, unless they are the factory setting of a family. An address
takes 0.2 s or more there."""
IDENTIFY = 43
PROBE_CHARACTERS = 8
"""Characters of the request that probes an address."""


@dataclass(frozen=True, slots=True)
class LineSetting:
    """Baud and format of a line."""

    baud: int
    format: str

    def __str__(self) -> str:
        return f"{self.baud} {self.format}"

    @property
    def stop_bits(self) -> int:
        """1 or 2."""
        return int(self.format[2])

    @property
    def slow(self) -> bool:
        """True if scans try it last, and only after a warning."""
        return self.baud < SLOW_BELOW

    def hears(self, other: LineSetting) -> bool:
        """Return True if both settings are equal but for stop bits: drives may understand both."""
        return (self.baud, self.format[:2]) == (other.baud, other.format[:2])


@dataclass(frozen=True, slots=True)
class WatchingFamily:
    """A family whose communication timeout begins with the first request."""

    id: str
    name: str
    code: str
    """The parameter that sets its timeout."""
    sure: bool
    """True if a document states this; False if it is only assumed."""


@dataclass(frozen=True, slots=True)
class PresenceProbe:
    """A request that present drives answer: a read, or an identification."""

    register: int | None
    """Register to read with function 3; None for function 43."""
    families: tuple[str, ...] = ()
    """Ids of the families without function 43 whose status word is this register."""


def wait_for_reply(setting: LineSetting, turnaround: float) -> float:
    """Return the seconds from the end of a request in which a reply must begin.

    A drive answers after its `turnaround`, but not before the inter-frame gap.
    """
    character = character_seconds(setting.baud, setting.format)
    return max(turnaround, silent_seconds(setting.baud, setting.format)) + character


def silent_cost(setting: LineSetting, wait: float, probes: int = 1) -> float:
    """Return the seconds that an unused address takes: the requests, and the timeout of each."""
    request = PROBE_CHARACTERS * character_seconds(setting.baud, setting.format)
    return probes * (request + wait)


def longest_turnaround(profiles: Iterable[Profile]) -> float:
    """Return the longest turnaround of all families with factory settings, in seconds."""
    return max((float(profile.data.link.turnaround_ms) / 1000 for profile in profiles), default=0.0)


def likely_settings(links: Sequence[LinkSettings], turnaround: float) -> list[LineSetting]:
    """Return every baud rate and format that a family can have, most promising first.

    Factory settings come first, then the others by the share of drives that have them, per second
    that an address takes. At 300 baud an address takes as long as thirty at 19 200. Slow ones come
    last.
    """
    shares: dict[LineSetting, Decimal] = {}
    for link in links:
        for baud, baud_share in _shares(link.baud, link.bauds).items():
            for form, form_share in _shares(link.format, link.formats).items():
                setting = LineSetting(baud, form)
                shares[setting] = shares.get(setting, Decimal(0)) + baud_share * form_share
    factory = {LineSetting(link.baud, link.format) for link in links}

    def worth(setting: LineSetting) -> tuple[bool, bool, float, int, str]:
        cost = silent_cost(setting, wait_for_reply(setting, turnaround))
        return (
            setting not in factory,
            setting.slow,
            -float(shares[setting]) / cost,
            -setting.baud,
            setting.format,
        )

    return sorted(shares, key=worth)


def families_at(profiles: Iterable[Profile], settings: Iterable[LineSetting]) -> list[str]:
    """Return the names of the families that support one of these."""
    wanted = {(setting.baud, setting.format) for setting in settings}
    found = []
    for profile in profiles:
        link = profile.data.link
        bauds, formats = {link.baud, *link.bauds}, {link.format, *link.formats}
        if any(baud in bauds and form in formats for baud, form in wanted):
            found.append(profile.data.profile.name)
    return found


def _shares(factory: T, all_of_them: Sequence[T]) -> dict[T, Decimal]:
    """Return the share of each value: FACTORY_SHARE for the factory setting, the rest evenly."""
    others = [
        type_var_type for type_var_type in dict.fromkeys(all_of_them) if type_var_type != factory
    ]
    if not others:
        return {factory: Decimal(1)}
    rest = (1 - FACTORY_SHARE) / len(others)
    return {factory: FACTORY_SHARE, **dict.fromkeys(others, rest)}


def presence_probes(profiles: Iterable[Profile]) -> tuple[PresenceProbe, ...]:
    """Return the fewest requests of which every family answers one, at least with an exception.

    A family without function 43 answers a read of its status word. A family that refuses a read of
    a missing word is also found by such a read.
    """
    registers: dict[int, tuple[str, ...]] = {}
    needs_identification = False
    for profile in profiles:
        status = profile.quantity("status_word")
        if any(function.code == IDENTIFY for function in profile.data.functions):
            needs_identification |= profile.data.reading.unknown_exception is None
        elif status is not None and status.function == 3:
            registers[status.address] = (*registers.get(status.address, ()), profile.id)
    found = [PresenceProbe(register, families) for register, families in registers.items()]
    if needs_identification or not found:
        found.append(PresenceProbe(None))
    return tuple(found)


def watching_families(profiles: Iterable[Profile]) -> list[WatchingFamily]:
    """Return the families whose timeout begins with any request; documented ones first."""
    found = []
    for profile in profiles:
        rules = profile.data.communication_fault
        if rules is None or not rules.timeout or rules.needs_write:
            continue
        sure = rules.starts_confidence != "unverified"
        found.append(WatchingFamily(profile.id, profile.data.profile.name, rules.timeout, sure))
    return sorted(found, key=lambda family: not family.sure)


_WATCHING = {
    (True, False): "Drives of these families start their communication timeout with the first"
    " request, and react when polling stops: {sure}.",
    (True, True): "Drives of these families start their communication timeout with the first"
    " request, and react when polling stops: {sure}, and perhaps {likely}.",
    (False, True): "Drives of these families may start their communication timeout with the first"
    " request, and react when polling stops: {likely}.",
}
"""By whether there are documented and likely families."""


def watching_text(families: Sequence[WatchingFamily]) -> str:
    """Return a sentence that names the families that react when polling stops; empty for none."""
    sure = ", ".join(f"{family.name} ({family.code})" for family in families if family.sure)
    likely = ", ".join(f"{family.name} ({family.code})" for family in families if not family.sure)
    if not families:
        return ""
    return _WATCHING[bool(sure), bool(likely)].format(sure=sure, likely=likely)
