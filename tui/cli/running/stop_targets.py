"""Which drive a stop is for: what it may be, what it says it is, and what it is stopped as."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..commands.orders import complain
from ..shared.errors import DRIVE_REFUSED, LINE_TROUBLE, Failure
from ..shared.options import Target, unidentified

if TYPE_CHECKING:
    from tui.bus.api import Priority
    from tui.drive.profile.profile import Profile
    from tui.drive.profile.schema import OrderId
    from tui.session.command.first_stop import FirstStop
    from tui.session.connect.identify import DriveIdentity
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession
    from tui.session.journal import Journal

    from .stop_telling import StopTelling

BLIND_TRIES = 3
"""How often the first word goes to a drive that answers nothing."""
REMEMBERED_WITHIN = 0.5
"""Seconds in which the starts on record are read."""


@dataclass(frozen=True, slots=True)
class StoppableDrive:
    """A drive that can be stopped, and what it is called."""

    session: DriveSession
    name: str
    proved: bool = True
    """True if the user, a recorded start or the drive itself named its family."""


async def first_stopped(
    opened: OpenLine, target: Target, order: OrderId, journal: Journal, telling: StopTelling
) -> StoppableDrive:
    """Send the first word, then find out what the drive is; both are told."""
    from tui.bus.api import LineStatus, Priority
    from tui.bus.errors import ExchangeError, NoAnswer
    from tui.drive.first_stop import families_beside
    from tui.drive.profile import library
    from tui.drive.profile.stop_facts import stop_facts
    from tui.session.command.first_stop import stop_first
    from tui.session.connect.identify import DriveIdentity, identify_drive

    device = target.device
    typed = library.load(target.profile_id).id if target.profile_id is not None else None
    families = await asyncio.to_thread(stop_facts)
    if typed is not None:
        families = families_beside(families, typed)
    before = (await remembered(opened)).get(device)
    known = {typed, *(one.id for one in families)}
    named = [one for one in (typed, before) if one is not None and one in known]
    # what other programs meant for it is void before the first word, not once it is known
    opened.line.facts.give_stop([device], "drivepanel stop")
    for _ in range(BLIND_TRIES if typed else 1):
        first = await stop_first(opened.line, device, journal, families, named, order)
        if first.answered:
            break
    identity = DriveIdentity(device, "", "", "", "", None, ())
    silent: ExchangeError | None = None
    try:
        # before all polls, and past an owner of the line that is frozen
        identity = await identify_drive(opened.line, device, priority=Priority.STOP)
        says = f"it says it is {identity.reference}" if identity.reference else "it names nothing"
    except ExchangeError as error:
        silent, says = error, "it does not say what it is"
    telling.sent_first(device, first.sent, says)
    if silent is not None and not first.answered:
        hint = "" if typed else " -p sends a stop word blind."
        # past a frozen owner of the line: what keeps the stop from the drive
        away = opened.line.state.status is LineStatus.LOST
        why = f" {opened.line.state.reason}" if away else ""
        text = f"NOT STOPPED: Device {device} did not answer. Stop it at the machine.{hint}{why}"
        raise NoAnswer(device, silent.function, silent.address, text)
    found = await asyncio.to_thread(_by_what_is_known, opened, identity, typed, named, first)
    if found is None and first.sent:
        text = f"Device {device}: NOT STOPPED: it took no stop word. Stop it at the machine."
        raise Failure(text, DRIVE_REFUSED)
    if found is None:
        raise unidentified(identity)
    # what was sent first was a command, too
    found.session.told_by_line = bool(first.sent)
    return found


def _by_what_is_known(
    opened: OpenLine,
    identity: DriveIdentity,
    typed: str | None,
    named: Sequence[str],
    first: FirstStop,
) -> StoppableDrive | None:
    """The drive by the user's profile, else by its own words, else by the word that it took.

    The user's profile is final unless the drive identifies itself as one of another family.
    """
    from tui.drive.profile import library
    from tui.session.connect.contradiction import contradiction

    if typed is not None:
        own = identity.profile or typed
        if wrong := contradiction(identity, library.load(typed)):
            complain(f"{wrong} It is stopped as {library.load(own).name}.")
            return _stoppable(opened, identity, [library.load(own)])
        return _stoppable(opened, identity, [library.load(typed)])
    for one in named:
        profile = library.load(one)
        unsaid = identity.profile is None and first.may_be(one)
        if not contradiction(identity, profile) and (one in identity.candidates or unsaid):
            return _stoppable(opened, identity, [profile])
    if identity.profile or identity.candidates:
        return _session(opened, identity, None)
    if first.taken is None or not first.followers:
        return None
    found = _stoppable(opened, identity, [library.load(first.followers[0])])
    name = " or ".join(one.name for one in first.taken.families)
    return StoppableDrive(found.session, name, proved=False)


async def remembered(opened: OpenLine) -> dict[int, str]:
    """By device, the profile by which a motor of this line was last started from here.

    A disk that hangs holds up no stop: then it is not known.
    """
    from tui.bus.link import label
    from tui.session.starts.starts import Starts

    found: list[dict[int, str]] = []
    loop, done = asyncio.get_running_loop(), asyncio.Event()

    def look() -> None:
        try:
            with suppress(OSError):
                found.append(Starts().profiles(label(opened.line.link)))
        finally:
            with suppress(RuntimeError):  # the loop has ended: nobody waits for it
                loop.call_soon_threadsafe(done.set)

    if opened.simulation is not None:
        return {}
    threading.Thread(target=look, name="starts on record", daemon=True).start()
    with suppress(TimeoutError):
        await asyncio.wait_for(done.wait(), REMEMBERED_WITHIN)
    return found[0] if found else {}


async def found_at(
    opened: OpenLine, device: int, profile_id: str | None, patience: Priority
) -> StoppableDrive | None:
    """The drive at an address; None where nobody answers.

    What comes but is no answer is asked for anew with an operator's patience. Raises Failure where
    the drive cannot be stopped, and why; where it is asked shortly, LineError for no answer.
    """
    from tui.bus.api import LineStatus, Priority
    from tui.bus.errors import LineError, NoAnswer
    from tui.session.connect.identify import identify_drive

    # nothing else goes past an owner that is frozen, or to a drive that is left alone
    past = opened.line.state.status is LineStatus.LOST or device in opened.line.facts.hushed
    try:
        priority = Priority.STOP if past else patience
        identity = await identify_drive(opened.line, device, priority=priority)
    except NoAnswer:
        return None
    except LineError as error:
        if patience is Priority.BACKGROUND:
            raise
        if patience is Priority.PATIENT:
            return await found_at(opened, device, profile_id, Priority.OPERATOR_READ)
        raise Failure(f"Device {device}: NOT STOPPED: {error}", LINE_TROUBLE) from error
    if (found := await asyncio.to_thread(_session, opened, identity, profile_id)) is not None:
        if profile_id is not None and (wrong := _wrongly_named(identity, profile_id)):
            complain(f"{wrong} It is stopped as {found.name}.")
        return found
    fits = ", ".join(identity.candidates) or "drivepanel profiles"
    raise Failure(
        f"Device {device}: NOT STOPPED: it does not say who it is. Name its profile"
        f" with -p ({fits}), or stop it at the machine.",
        DRIVE_REFUSED,
    )


def _session(
    opened: OpenLine, identity: DriveIdentity, profile_id: str | None
) -> StoppableDrive | None:
    """A session with the drive; None where it is not known what stops it.

    A drive that does not say who it is may belong to several families: where the same words stop
    them all, which one it is does not matter.
    """
    from tui.drive.orders import stop_alike
    from tui.drive.profile import library

    named = identity.profile or profile_id
    profiles = [library.load(one) for one in ([named] if named else identity.candidates)]
    return _stoppable(opened, identity, profiles) if stop_alike(profiles) else None


def _stoppable(
    opened: OpenLine, identity: DriveIdentity, profiles: Sequence[Profile]
) -> StoppableDrive:
    from tui.session.drive import DriveSession

    session = DriveSession(opened.line, identity.device, profiles[0], identity)
    return StoppableDrive(session, " or ".join(profile.name for profile in profiles))


def _wrongly_named(identity: DriveIdentity, profile_id: str) -> str:
    """How a drive contradicts the profile of -p; empty if it does not."""
    from tui.drive.profile import library
    from tui.session.connect.contradiction import contradiction

    return contradiction(identity, library.load(profile_id))
