"""The profile of a drive: its choice, its contradiction, and the question about an unproved one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from .asking import may_ask, says_yes
from .say import say

if TYPE_CHECKING:
    from tui.session.connect.identify import DriveIdentity
    from tui.session.drive import DriveSession

FORCE_PROFILE = "--force-profile"


async def confirm_unproved(session: DriveSession) -> None:
    """Ask a person at the terminal before a command with --arm uses an unproved profile.

    Without one, arming is refused with the way out.
    """
    from tui.drive.profile.profile import proof_text

    context = click.get_current_context(silent=True)
    if not session.is_unconfirmed or context is None or not context.params.get("arm"):
        return
    if may_ask() and await says_yes(f"{session.arming.barred} Write to device {session.device}?"):
        session.confirm_profile()
        return
    session.arming.barred = (
        f"Not armed: the profile {session.profile.id} is unproved ({proof_text(session.profile)}),"
        " and no person at a terminal. For a script, make a profile of your own and prove it:"
        f" drivepanel profiles new NAME --from {session.profile.id}"
    )


def _way_to_profile(reported: str | None, *, by_recipe: bool) -> str:
    """Return how to correct a profile that the drive contradicts, where it was named."""
    if by_recipe:
        return "Check the address, or correct the profile in the recipe of this drive."
    if not reported:
        return "Name the profile of that drive."
    context = click.get_current_context(silent=True)
    source = None if context is None else context.get_parameter_source("profile_id")
    if source is click.core.ParameterSource.DEFAULT_MAP:  # the name of the line has it
        return f"Name -p {reported}, or correct the settings file."
    return f"Name -p {reported}, or leave -p away."


def believe_the_person(session: DriveSession, *, forced: bool, by_recipe: bool) -> None:
    """Use a profile that the drive contradicts if it is forced; else raise.

    With `by_recipe` a recipe has named it.
    """
    from tui.session.connect.contradiction import Contradiction

    if not forced:
        way = _way_to_profile(session.known_identity.profile, by_recipe=by_recipe)
        raise Contradiction(f"{session.contradiction}\n{way} Nothing was written.")
    session.bar_unconfirmed()
    context = click.get_current_context(silent=True)
    is_given = context is not None and context.params.get("force_profile")
    how = _FORCED if is_given else "The drive is compared with this profile anyway."
    say(f"drivepanel: {session.contradiction} {how}", err=True)


_FORCED = f"{FORCE_PROFILE} uses this profile anyway: values, units and names may be wrong."


_FITS_NONE = "Device {device} answers as {reference!r}; name its profile with -p: {profiles}."
_FITS_SEVERAL = (
    "Device {device} answers as {reference!r}, which fits the profiles {profiles} equally. Choose"
    " one with -p, or give one of them a longer prefix in reference_prefixes."
)
_NOT_IDENTIFIED = (
    "Device {device} answers but does not identify itself; name its profile with -p: {profiles}."
)


def unidentified(identity: DriveIdentity) -> click.UsageError:
    """The error for a drive that no profile was named for and none fits."""
    from tui.drive.profile import library

    text = _FITS_NONE if identity.reference else _NOT_IDENTIFIED
    fits = identity.candidates or tuple(listing.id for listing in library.listings())
    if len(equal := library.best_profiles(identity.reference)) > 1:
        text, fits = _FITS_SEVERAL, tuple(equal)
    return click.UsageError(
        text.format(device=identity.device, reference=identity.reference, profiles=", ".join(fits))
    )
