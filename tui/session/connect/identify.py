"""Identification of the drive at an address, and the profiles that fit it."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
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
from .register_reads import RegisterReads, families_by_registers

VENDOR, REFERENCE, VERSION, NAME = 0, 1, 2, 6
HEXADECIMAL = "16#"
"""Begins the bytes of a reply to function 17 that has no text."""


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
    denied: str = ""
    """Identifying register of the named profile that has another value; empty if none has."""

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
    """Source of the identity: `function 43`, `function 17`, a read, registers; empty if none."""


async def identify_drive(
    line: Askable,
    device: int,
    *,
    priority: Priority = Priority.OPERATOR_READ,
    brief: bool = False,
) -> DriveIdentity:
    """Request a drive's identity by function 43; unless `brief`, also by 17 and by registers.

    A drive that refuses the function is present, but nameless. A drive that does not answer, or
    whose limits exclude function 43, gets a read of the status word of each family without that
    function. Functions and registers that no profile names are not requested. Raises NoAnswer if
    nothing answers, ChecksumFault or WrongReply if lost or damaged frames leave it open, and the
    line's other errors.
    """
    identity = await _by_function_43(line, device, priority)
    if brief or identity.profile is not None:
        return identity
    if not identity.reference and await asyncio.to_thread(_any_reports_its_id):
        with suppress(DeviceException, RequestRefused, NoAnswer):
            answer = await line.identify(device, priority=priority, function=REPORT_ID)
            if _identifies(reported := await confirmed_identity(device, answer)):
                identity = reported
    return await _by_registers(line, identity, priority, None)


def _any_reports_its_id() -> bool:
    """Return True if a profile describes drives that support function 17."""
    listed = (*library.listings(), *library.public_listings())
    return any(library.mentions_function(listing, REPORT_ID) for listing in listed)


async def _by_registers(
    line: Askable, identity: DriveIdentity, priority: Priority, within: float | None
) -> DriveIdentity:
    """Return an identity with the profile whose identifying registers fit, unless it has one."""
    if identity.profile is not None or (identity.reference and identity.candidates):
        return identity
    reads = RegisterReads(line, identity.device, priority, within)
    found = await families_by_registers(reads, identity.reference)
    if not found:
        return identity
    return replace(identity, profile=found[0] if len(found) == 1 else None, candidates=found)


async def _by_function_43(line: Askable, device: int, priority: Priority) -> DriveIdentity:
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


def _identifies(reported: DriveIdentity) -> bool:
    """Return True if function 17 gave a text, or bytes that a profile names."""
    text = reported.reference
    return bool(text) and (bool(reported.candidates) or not text.startswith(HEXADECIMAL))


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
        if answer is None:
            continue
        identity, by = await confirmed_identity(device, answer), how
        if function == IDENTIFY or _identifies(identity):
            break
    else:
        # a drive without these functions is not absent: its last answer counts
        if there.families and not await control():
            raise NotIdentified(device)
        identity = _nameless(device, there.families)
        by = f"read of register {there.register}" if there.families else ""
    known = await _by_registers(line, identity, priority, patience)
    return ScanResult(device, known, by=by if known == identity else "registers")


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
        profile=library.identified_profile(reference) if reference else None,
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
