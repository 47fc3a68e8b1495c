"""Finding out which drive answers at an address, and which profile fits it."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass
from typing import Protocol

from tui.bus.api import IdentificationObjects, Priority, Reply
from tui.bus.errors import DeviceException, NoAnswer, RequestRefused
from tui.bus.expectation import IDENTIFY
from tui.drive.errors import DriveError
from tui.drive.plain import plain
from tui.drive.profile import library

VENDOR, REFERENCE, VERSION, NAME = 0, 1, 2, 6


class Askable(Protocol):
    """As much of a line as it takes to ask who is there."""

    async def identify(self, device: int, *, priority: Priority) -> IdentificationObjects:
        """Function 43."""
        ...

    async def read(self, device: int, address: int, count: int = 1, *, priority: Priority) -> Reply:
        """Function 3."""
        ...


@dataclass(frozen=True, slots=True)
class DriveIdentity:
    """What a drive says of itself, and the profiles that fit."""

    device: int
    vendor: str
    reference: str
    version: str
    name: str
    profile: str | None
    """The one profile that fits best, or None."""
    candidates: tuple[str, ...]
    """Every profile that may fit, best first."""

    @property
    def version_text(self) -> str:
        """The version as a person reads it."""
        return library.version_shown(self.profile, self.version)


@dataclass(frozen=True, slots=True)
class ScanResult:
    """What one address answered: a drive, or a fault that is not silence."""

    device: int
    identity: DriveIdentity | None
    error: str = ""


async def identify_drive(
    line: Askable, device: int, *, priority: Priority = Priority.OPERATOR_READ
) -> DriveIdentity:
    """Ask a drive who it is by function 43.

    A drive that refuses the function is there, but nameless. One that stays silent, or of which
    it is known that it has no function 43 (its limits came from a profile before), is asked for
    the status word of each family without that function. Raises NoAnswer where nothing answers
    at all, and the line's other errors.
    """
    try:
        answer = await _ask(line, device, priority)
    except DeviceException:
        return _nameless(device)
    except (NoAnswer, RequestRefused):
        return _nameless(device, await _nameless_families(line, device, priority))
    return await asyncio.to_thread(identity_from, device, answer)


async def _ask(line: Askable, device: int, priority: Priority) -> IdentificationObjects:
    """Function 43; a person's question is asked again once, a lost reply is no absent drive."""
    try:
        return await line.identify(device, priority=priority)
    except NoAnswer:
        if priority >= Priority.BACKGROUND:
            raise
        return await line.identify(device, priority=priority)


def _nameless(device: int, candidates: tuple[str, ...] = ()) -> DriveIdentity:
    return DriveIdentity(device, "", "", "", "", None, candidates)


def identity_from(device: int, answer: IdentificationObjects) -> DriveIdentity:
    """What a drive says of itself, as text that commands no terminal wherever it is shown."""
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


async def _nameless_families(line: Askable, device: int, priority: Priority) -> tuple[str, ...]:
    """Profiles without function 43 whose status word the device lets be read.

    None of them where it only refuses: it is there. Raises NoAnswer where nothing answers.
    """
    probes = await asyncio.to_thread(_status_words_without_identification)
    refused = False
    for address, profiles in probes.items():
        try:
            await line.read(device, address, 1, priority=priority)
        except DeviceException:
            refused = True
        except NoAnswer:
            continue
        else:
            return profiles
    if refused:
        return ()
    raise NoAnswer(device, IDENTIFY, 0)


def _status_words_without_identification() -> dict[int, tuple[str, ...]]:
    found: dict[int, tuple[str, ...]] = {}
    for listing in library.listings():
        if library.mentions_function(listing, IDENTIFY):
            continue
        try:
            profile = library.load(listing.id)
        except DriveError:
            # a profile that cannot be used is told where it is chosen; it ends no search
            continue
        status = profile.quantity("status_word")
        if status is not None and status.function == 3:
            found[status.address] = (*found.get(status.address, ()), profile.id)
    return found
