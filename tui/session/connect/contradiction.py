"""Whether a drive says of itself that it is another than the profile it is taken by."""

from __future__ import annotations

from contextlib import suppress

from tui.bus.api import Priority
from tui.bus.errors import ExchangeError, NoAnswer, RequestRefused
from tui.bus.expectation import IDENTIFY
from tui.drive.errors import DriveError
from tui.drive.profile import library
from tui.drive.profile.profile import Profile

from .identify import Askable, DriveIdentity, identity_told


class Contradiction(DriveError):
    """A drive that says it is another than the profile named for it."""


async def own_words(line: Askable, device: int, profile: Profile) -> DriveIdentity | None:
    """What a drive says of itself, asked once; None where it says nothing.

    Silence and refusals are no contradiction: families without function 43 do either. One that was
    silent is asked for its status word, so that it does not count as absent. Raises the errors of
    a line that is lost.
    """
    # a family that has the function is waited for as always; the others are silent
    has_it = profile.function(IDENTIFY) is not None
    priority = Priority.OPERATOR_READ if has_it else Priority.BACKGROUND
    try:
        answer = await line.identify(device, priority=priority)
    except NoAnswer:
        with suppress(ExchangeError):
            await _show_itself(line, device, profile)
        return None
    except (ExchangeError, RequestRefused):
        return None
    return await identity_told(device, answer)


async def _show_itself(line: Askable, device: int, profile: Profile) -> None:
    status = profile.quantity("status_word")
    if status is not None and status.function == 3:
        await line.read(device, status.address, 1, priority=Priority.OPERATOR_READ)


def contradiction(identity: DriveIdentity | None, profile: Profile) -> str:
    """How a drive contradicts the profile that it is taken by, for a person; empty if it does not.

    A drive that names nothing contradicts nothing, nor does one of a kind that no profile knows,
    where the profile names no kinds itself or its own begin alike.
    """
    if identity is None or not identity.reference or profile.id in identity.candidates:
        return ""
    if not identity.candidates and _may_be(identity.reference, profile):
        return ""
    names = {one.id: one.name for one in library.listings()}
    family = names.get(identity.candidates[0], "") if identity.candidates else ""
    says = f"{identity.reference}, {family}" if family else identity.reference
    return f"Device {identity.device} says it is {says}: it is not {_with_article(profile.name)}."


def _may_be(reference: str, profile: Profile) -> bool:
    """Whether a reference that no profile claims may be of a family all the same."""
    prefixes = [one.upper() for one in profile.data.identification.reference_prefixes]
    if not prefixes:
        return True
    # what all kinds of a family begin with; a reference may be cut short
    stem, told = min(prefixes), reference.upper()
    while not all(one.startswith(stem) for one in prefixes):
        stem = stem[:-1]
    return told.startswith(stem) or stem.startswith(told)


def _with_article(name: str) -> str:
    return f"{'an' if name[:1].upper() in tuple('AEIOU') else 'a'} {name}"
