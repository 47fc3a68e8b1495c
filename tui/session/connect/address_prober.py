"""Requests to addresses that may be empty, derived from the profiles."""

from __future__ import annotations

from dataclasses import dataclass

from tui.bus.link import Link, SerialLink
from tui.drive.errors import DriveError
from tui.drive.finding import (
    LineSetting,
    PresenceProbe,
    likely_settings,
    longest_turnaround,
    presence_probes,
    silent_cost,
    wait_for_reply,
)
from tui.drive.profile import library
from tui.drive.profile.profile import Profile

PATIENCE = 2.0
"""Factor of the wait for a device that is present, compared with an empty address."""
JITTER = 0.002
"""Seconds by which this computer, or an adapter on USB, reports received bytes late."""


@dataclass(frozen=True, slots=True)
class AddressProber:
    """First requests to the addresses of one line."""

    probes: tuple[PresenceProbe, ...]
    within: float | None
    """Seconds within which a reply begins; None if the transport takes longer than a drive."""
    patience: float
    """The same for an identity request, which a device that is present may not answer."""
    cost: float
    """Seconds that an empty address costs."""


def known_profiles() -> list[Profile]:
    """Every valid profile; an invalid one is reported when it is chosen."""
    found = []
    for listing in library.listings():
        try:
            found.append(library.load(listing.id))
        except DriveError:
            continue
    return found


def probers_of(link: Link, network_wait: float, *, patient: bool = False) -> AddressProber:
    """Return the first requests for the addresses of a line; reads files.

    The wait is `network_wait` seconds on a network, on a line whose timeout a person has set, and
    on every line if `patient`.
    """
    profiles = known_profiles()
    probes = presence_probes(profiles)
    if patient or not isinstance(link, SerialLink) or link.timeout is not None:
        return AddressProber(probes, None, network_wait, network_wait * len(probes))
    setting = LineSetting(link.baud, link.format)
    within = wait_for_reply(setting, longest_turnaround(profiles)) + JITTER
    return AddressProber(
        probes, within, PATIENCE * within, silent_cost(setting, within, len(probes))
    )


def settings_worth_a_try(first: LineSetting, *, parity: bool = True) -> list[LineSetting]:
    """The open setting of a line, then all settings that families can have, likely ones first.

    Without `parity`, as on a pseudo-terminal, settings that differ only in parity are one.
    """
    profiles = known_profiles()
    links = [profile.data.link for profile in profiles]
    found = [first, *likely_settings(links, longest_turnaround(profiles))]
    if parity:
        return list(dict.fromkeys(found))
    alike: dict[tuple[int, int], LineSetting] = {}
    for setting in found:
        alike.setdefault((setting.baud, setting.stop_bits), setting)
    return list(alike.values())
