"""The profile of a drive: its choice, its contradiction, and the question about an unproved one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from .asking import may_ask, says_yes
from .say import say

if TYPE_CHECKING:
    from tui.drive.profile.profile import Profile
    from tui.session.connect.identify import DriveIdentity
    from tui.session.drive import DriveSession

FORCE_PROFILE = "--force-profile"


async def confirm_unproved(session: DriveSession) -> None:
    """Ask a person at the terminal before a command with --arm uses an unproved profile.

    Without one, arming is refused with the way out. A command that this site has proved is not
    asked about.
    """
    from tui.drive.profile.profile import proof_text
    from tui.session.drive import unproved_text

    context = click.get_current_context(silent=True)
    if not session.is_unconfirmed or context is None or not context.params.get("arm"):
        return
    if session.contradiction:
        return
    if _is_proved(session.profile, context):
        session.arming.barred = ""  # each word is still compared with what was proved
        return
    if may_ask() and await says_yes(f"{unproved_text(session)} Write to device {session.device}?"):
        session.confirm_profile()
        return
    session.arming.barred = (
        f"Not armed: the profile {session.profile.id} is unproved ({proof_text(session.profile)}),"
        " and no person at a terminal. For a script, make a profile of your own and prove it:"
        f" drivepanel profiles new NAME --from {session.profile.id}"
    )


def _is_proved(profile: Profile, context: click.Context) -> bool:
    """Return True if all that a command may send was proved on this site."""
    from tui.drive.site_proof import unproved_commands
    from tui.session.command.reference import reference_parameters

    given = context.params
    needed: dict[str, set[str]] = {
        "run": {"reverse" if given.get("reverse") else "forward"},
        "reference": set(),
        "reset": {"reset"},
    }
    if (ids := needed.get(context.info_name or "")) is None:
        return False
    if context.info_name == "reference" or given.get("reference"):
        ids |= {parameter.code for parameter in reference_parameters(profile)}
    if given.get("take_control"):
        ids.add("take-control")
    return not unproved_commands(profile) & {*ids, "stop"}


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
    return f"Name -p {reported}, or omit -p."


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
