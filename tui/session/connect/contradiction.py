"""Comparison of the identity that a drive reports with its assumed profile."""

from __future__ import annotations

from tui.bus.api import Priority
from tui.bus.errors import NoAnswer
from tui.bus.expectation import IDENTIFY
from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.profile.profile import Profile

from .identify import DriveIdentity, confirmed_identity
from .identifying import Askable, ask_identification, intact
from .register_reads import RegisterReads, families_by_registers, unexpected_register

BRIEFLY = 0.4
"""Seconds within which a drive that has the function answers, although its family lacks it."""
SILENCES = 2
"""Requests without a reply after which a drive whose family has the function counts as nameless or
absent."""


class Contradiction(DriveError):
    """The drive's reported identity contradicts the profile named for it."""


async def own_words(line: Askable, device: int, profile: Profile) -> DriveIdentity | None:
    """Return the identity that a drive reports; None if it reports none.

    A missing reply and a refusal are not contradictions: drives of families without function 43
    give them too. After a missing reply, the status word is read so that the drive does not count
    as absent. Raises ChecksumFault or WrongReply if the reply arrives only damaged, or is lost on a
    line that loses frames, and the errors of a lost line.
    """
    # only a family that has the function gets the full wait; the others do not answer
    has_it = profile.function(IDENTIFY) is not None
    priority, within = (Priority.OPERATOR_READ, None) if has_it else (Priority.BACKGROUND, BRIEFLY)
    silences = SILENCES if has_it else 1
    misses = 0

    async def control() -> bool:
        nonlocal misses
        if await intact(read_status(line, device, profile, Priority.OPERATOR_READ)):
            return True
        misses += 1
        if misses == silences:
            raise NoAnswer(device, IDENTIFY, 0)
        return False

    try:
        answer = await ask_identification(
            line, device, control, priority=priority, within=within, silences=silences
        )
    except NoAnswer:
        return None
    if answer is not None:
        return await confirmed_identity(device, answer)
    reads = RegisterReads(line, device, Priority.OPERATOR_READ, None)
    if denied := await unexpected_register(reads, profile):
        return DriveIdentity(device, "", "", "", "", None, (), denied)
    found = await families_by_registers(reads, "")
    if not found or profile.id in found:
        return None
    return DriveIdentity(device, "", "", "", "", found[0] if len(found) == 1 else None, found)


async def read_status(line: Askable, device: int, profile: Profile, priority: Priority) -> bool:
    """Read a drive's status word; False if it cannot be asked for before the drive is known."""
    status = profile.quantity("status_word")
    if status is None or status.function != 3:
        return False
    await line.read(device, status.address, 1, priority=priority)
    return True


_OTHER_FAMILY = (
    "Device {device} says it is {reference}, {family}: the profile {profile} does not fit it."
)
_UNKNOWN_KIND = "Device {device} says it is {reference}: the profile {profile} does not fit it."
_OTHER_REGISTERS = (
    "Device {device} has the registers of {family}: the profile {profile} does not fit it."
)
_DENIED = "Device {device} has {denied}: the profile {profile} does not fit it."


def contradiction(identity: DriveIdentity | None, profile: Profile) -> str:
    """Return how a drive contradicts its profile, for a person; empty if it does not.

    No contradiction: a drive without names, and one of a kind that no profile knows if the profile
    names no kinds or its kinds begin alike.
    """
    if identity is None or profile.id in identity.candidates:
        return ""
    if identity.reference:
        differs = bool(identity.candidates) or not _may_be(identity.reference, profile)
    else:
        differs = bool(identity.denied) or identity.profile not in (None, profile.id)
    if not differs:
        return ""
    names = {listing.id: listing.name for listing in library.listings()}
    family = names.get(identity.candidates[0], "") if identity.candidates else ""
    text = _OTHER_FAMILY if family else _UNKNOWN_KIND
    if not identity.reference:
        text = _DENIED if identity.denied else _OTHER_REGISTERS
    return text.format(
        device=identity.device,
        reference=identity.reference,
        family=family,
        profile=profile.name,
        denied=identity.denied,
    )


def _may_be(reference: str, profile: Profile) -> bool:
    """Return True if a reference that no profile claims may still be of a family."""
    prefixes = [prefix.upper() for prefix in profile.data.identification.reference_prefixes]
    if not prefixes:
        return True
    # what all kinds of a family begin with; a reference may be cut short
    stem, reported = min(prefixes), reference.upper()
    while not all(prefix.startswith(stem) for prefix in prefixes):
        stem = stem[:-1]
    return reported.startswith(stem) or stem.startswith(reported)
