"""Finding out which drive answers at an address, and which profile fits it."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

from tui.bus.api import IdentificationObjects, Priority, Reply
from tui.bus.errors import DeviceException, ExchangeError, NoAnswer, RequestRefused
from tui.bus.expectation import IDENTIFY, REPORT_ID
from tui.drive.errors import DriveError
from tui.drive.finding import PresenceProbe
from tui.drive.plain import plain
from tui.drive.profile import library

VENDOR, REFERENCE, VERSION, NAME = 0, 1, 2, 6


class Askable(Protocol):
    """As much of a line as it takes to ask who is there."""

    async def identify(
        self,
        device: int,
        *,
        priority: Priority,
        within: float | None = None,
        function: int = IDENTIFY,
    ) -> IdentificationObjects:
        """Function 43, or 17."""
        ...

    async def read(
        self,
        device: int,
        address: int,
        count: int = 1,
        *,
        priority: Priority,
        within: float | None = None,
    ) -> Reply:
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
    by: str = ""
    """What told who it is: `function 43`, `function 17`, a read; empty where nothing did."""


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
    return await identity_told(device, answer)


async def identity_told(device: int, answer: IdentificationObjects) -> DriveIdentity:
    """Who a drive is by its answer to function 43; looks for fitting profiles in a thread."""
    return await asyncio.to_thread(identity_from, device, answer)


async def _ask(line: Askable, device: int, priority: Priority) -> IdentificationObjects:
    """Function 43; a person's question is asked again once, a lost reply is no absent drive."""
    try:
        return await line.identify(device, priority=priority)
    except NoAnswer:
        if priority >= Priority.BACKGROUND:
            raise
        return await line.identify(device, priority=priority)


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
    """Find out whether anybody is at an address, by the fewest requests, and then who.

    An empty address costs one request a probe, and `within` seconds for each; None leaves that to
    the line. Who tells its state, as a family does that cannot say who it is, is asked who it is
    with so much `patience`, in seconds. Raises NoAnswer where nothing answers, and the line's
    other errors.
    """
    there = await _present(line, device, probes, priority, within)
    likely = patience if there.families else None
    for function, how in BY_IDENTIFICATION.items():
        try:
            answer = there.objects if function == IDENTIFY else None
            if answer is None:
                answer = await line.identify(
                    device, priority=priority, within=likely, function=function
                )
        except (DeviceException, NoAnswer, RequestRefused):
            continue
        if answer.objects.get(REFERENCE) or function == IDENTIFY:
            return ScanResult(device, await identity_told(device, answer), by=how)
    if there.families:
        # that it has no such functions makes it no silent one: its last answer is what counts
        with suppress(ExchangeError):
            await line.read(device, there.register, 1, priority=priority, within=likely)
    by = f"read of register {there.register}" if there.families else ""
    return ScanResult(device, _nameless(device, there.families), by=by)


@dataclass(frozen=True, slots=True)
class _Presence:
    """What has shown that somebody is at an address."""

    register: int = 0
    families: tuple[str, ...] = ()
    """Ids of those that tell their state by the read that was answered."""
    objects: IdentificationObjects | None = None


async def _present(
    line: Askable,
    device: int,
    probes: Sequence[PresenceProbe],
    priority: Priority,
    within: float | None,
) -> _Presence:
    """How somebody answers at an address, were it with a refusal. Raises NoAnswer."""
    refused = False
    for probe in probes:
        try:
            if probe.register is None:
                found = await line.identify(device, priority=priority, within=within)
                return _Presence(objects=found)
            await line.read(device, probe.register, 1, priority=priority, within=within)
        except (DeviceException, RequestRefused) as error:
            refused |= isinstance(error, DeviceException)
        except NoAnswer:
            continue
        else:
            return _Presence(probe.register or 0, probe.families)
    if refused:
        return _Presence()
    raise NoAnswer(device, IDENTIFY, 0)


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
    probes = await asyncio.to_thread(status_words_without_identification)
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


def status_words_without_identification() -> dict[int, tuple[str, ...]]:
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
