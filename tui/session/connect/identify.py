"""Identification of the drive at an address, and the profiles that fit it."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

from tui.bus.api import IdentificationObjects, Priority
from tui.bus.errors import (
    ChecksumFault,
    DeviceException,
    NoAnswer,
    RequestRefused,
    WrongReply,
)
from tui.bus.expectation import IDENTIFY, REPORT_ID
from tui.drive.errors import DriveError
from tui.drive.finding import PresenceProbe
from tui.drive.plain import plain
from tui.drive.profile import library

from .identifying import TRIES, Askable, NotIdentified, ask_identification, intact

VENDOR, REFERENCE, VERSION, NAME = 0, 1, 2, 6


@dataclass(frozen=True, slots=True)
class DriveIdentity:
    """Identity reported by a drive, and the profiles that fit."""

    device: int
    vendor: str
    reference: str
    version: str
    name: str
    profile: str | None
    """Id of the profile that fits best, or None."""
    candidates: tuple[str, ...]
    """Ids of all profiles that may fit, best first."""

    @property
    def text(self) -> str:
        """Vendor, reference and name as one text; empty if it reports none of them."""
        return " ".join(filter(None, (self.vendor, self.reference, self.name)))

    @property
    def version_text(self) -> str:
        """The version as shown to a person."""
        return library.version_shown(self.profile, self.version)


@dataclass(frozen=True, slots=True)
class ScanResult:
    """Result for one address: a drive, or a fault other than a missing reply."""

    device: int
    identity: DriveIdentity | None
    error: str = ""
    by: str = ""
    """Source of the identity: `function 43`, `function 17`, a read; empty if none."""


async def identify_drive(
    line: Askable, device: int, *, priority: Priority = Priority.OPERATOR_READ
) -> DriveIdentity:
    """Request a drive's identity by function 43.

    A drive that refuses the function is present, but nameless. A drive that does not answer, or
    whose limits exclude function 43, gets a read of the status word of each family without that
    function. Raises NoAnswer if nothing answers, ChecksumFault or WrongReply if lost or damaged
    frames leave it open, and the line's other errors.
    """
    # a person's request is repeated once: a lost reply does not mean an absent drive
    there = _Presence(damaged=True)
    left = TRIES
    for _ in range(1 if priority >= Priority.BACKGROUND else 2):
        left -= 1
        try:
            return await confirmed_identity(device, await line.identify(device, priority=priority))
        except DeviceException:
            return _nameless(device)
        except (ChecksumFault, WrongReply):
            break
        except RequestRefused:
            return _nameless(device, (await _nameless_families(line, device, priority)).families)
        except NoAnswer:
            continue
    else:
        there = await _nameless_families(line, device, priority)
    answer = await ask_identification(
        line, device, partial(_is_intact, line, device, there, priority), priority=priority,
        tries=left, healthy=bool(there.families),
    )  # fmt: skip
    if answer is not None:
        return await confirmed_identity(device, answer)
    return _nameless(device, there.families)


async def confirmed_identity(device: int, answer: IdentificationObjects) -> DriveIdentity:
    """Return a drive's identity from its answer to function 43; matches profiles in a thread."""
    return await asyncio.to_thread(identity_from, device, answer)


BY_IDENTIFICATION = {IDENTIFY: "function 43", REPORT_ID: "function 17"}


async def find_drive(
    line: Askable,
    device: int,
    probes: Sequence[PresenceProbe],
    *,
    priority: Priority,
    within: float | None,
    patience: float | None = None,
) -> ScanResult:
    """Probe an address with minimal requests, then identify the drive.

    An empty address costs one request for each probe, and `within` seconds each; None applies the
    line's own wait. A drive that answers the status word of a family without identification gets an
    identity request with a wait of `patience` seconds. Raises NoAnswer if nothing answers, and the
    line's other errors.
    """
    there = await _present(line, device, probes, priority, within)
    try:
        return await _identified(line, device, there, priority, patience)
    except (ChecksumFault, WrongReply) as fault:
        return ScanResult(device, _nameless(device), str(fault))


async def _identified(
    line: Askable, device: int, there: _Presence, priority: Priority, patience: float | None
) -> ScanResult:
    """Identify the drive that answered at an address. Raises ChecksumFault, WrongReply."""
    likely = patience if there.families else None
    control = partial(_is_intact, line, device, there, priority, likely)
    for function, how in BY_IDENTIFICATION.items():
        answer = there.objects if function == IDENTIFY else None
        if answer is None:
            answer = await ask_identification(
                line, device, control, priority=priority, within=likely, function=function,
                tries=TRIES if function == IDENTIFY else 1, healthy=bool(there.families),
            )  # fmt: skip
        if answer is not None and (answer.objects.get(REFERENCE) or function == IDENTIFY):
            return ScanResult(device, await confirmed_identity(device, answer), by=how)
    # a drive without these functions is not absent: its last answer counts
    if there.families and not await control():
        raise NotIdentified(device)
    by = f"read of register {there.register}" if there.families else ""
    return ScanResult(device, _nameless(device, there.families), by=by)


@dataclass(frozen=True, slots=True)
class _Presence:
    """Evidence that a device is at an address."""

    register: int = 0
    families: tuple[str, ...] = ()
    """Ids of the families whose status read was answered."""
    objects: IdentificationObjects | None = None
    damaged: bool = False
    """True if no reply was intact."""


async def _is_intact(
    line: Askable,
    device: int,
    there: _Presence,
    priority: Priority,
    within: float | None = None,
) -> bool:
    """True if a device answers the request that showed its presence again."""
    if there.damaged:
        return False
    return await intact(line.read(device, there.register, 1, priority=priority, within=within))


async def _present(
    line: Askable,
    device: int,
    probes: Sequence[PresenceProbe],
    priority: Priority,
    within: float | None,
) -> _Presence:
    """Return how a device answers at an address, including by refusal. Raises NoAnswer."""
    refused = damaged = False
    register = 0
    for probe in probes:
        try:
            if probe.register is None:
                found = await line.identify(device, priority=priority, within=within)
                return _Presence(objects=found)
            await line.read(device, probe.register, 1, priority=priority, within=within)
        except DeviceException:
            refused, register = True, probe.register or register
        except (ChecksumFault, WrongReply):
            damaged = True
        except (NoAnswer, RequestRefused):
            continue
        else:
            return _Presence(probe.register or 0, probe.families)
    if refused or damaged:
        return _Presence(register, damaged=not refused)
    raise NoAnswer(device, IDENTIFY, 0)


def _nameless(device: int, candidates: tuple[str, ...] = ()) -> DriveIdentity:
    return DriveIdentity(device, "", "", "", "", None, candidates)


def identity_from(device: int, answer: IdentificationObjects) -> DriveIdentity:
    """Return the identity as text without terminal control characters."""
    texts = {
        number: plain(value.decode("ascii", errors="replace").strip("\0 "))
        for number, value in answer.objects.items()
    }
    reference = texts.get(REFERENCE, "")
    candidates = tuple(library.matching_profiles(reference)) if reference else ()
    return DriveIdentity(
        device=device,
        vendor=texts.get(VENDOR, ""),
        reference=reference,
        version=texts.get(VERSION, ""),
        name=texts.get(NAME, ""),
        profile=candidates[0] if candidates else None,
        candidates=candidates,
    )


async def _nameless_families(line: Askable, device: int, priority: Priority) -> _Presence:
    """Profiles without function 43 whose status word the device returns.

    Empty if it only refuses, since it is present. Raises NoAnswer if nothing answers.
    """
    found = await asyncio.to_thread(status_words_without_identification)
    probes = tuple(PresenceProbe(address, profiles) for address, profiles in found.items())
    return await _present(line, device, probes, priority, None)


def status_words_without_identification() -> dict[int, tuple[str, ...]]:
    found: dict[int, tuple[str, ...]] = {}
    for listing in library.listings():
        if library.mentions_function(listing, IDENTIFY):
            continue
        try:
            profile = library.load(listing.id)
        except DriveError:
            # an invalid profile is reported when it is chosen; it does not end the search
            continue
        status = profile.quantity("status_word")
        if status is not None and status.function == 3:
            found[status.address] = (*found.get(status.address, ()), profile.id)
    return found
