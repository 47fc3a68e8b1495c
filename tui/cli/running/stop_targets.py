"""The drive of a stop: its possible families, its identity, and the profile that stops it."""

from __future__ import annotations

import asyncio
import threading
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING

from tui.bus.api import LineStatus, Priority
from tui.bus.errors import ExchangeError, LineError, NoAnswer
from tui.drive.errors import DriveError

from ..shared.drive_commands import complain
from ..shared.errors import DRIVE_REFUSED, LINE_TROUBLE, Failure
from ..shared.profile_choice import unidentified

if TYPE_CHECKING:
    from tui.drive.profile.schema import OrderId
    from tui.session.command.first_stop import FirstStop
    from tui.session.connect.identify import DriveIdentity
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession
    from tui.session.journal import Journal
    from tui.session.starts.record import StartRecord

    from .stop_telling import StopTelling

BLIND_TRIES = 3
"""Number of first stop words to a drive that does not answer."""
REMEMBERED_WITHIN = 0.5
"""Seconds in which the starts on record are read."""


@dataclass(frozen=True, slots=True)
class StoppableDrive:
    """A drive that can be stopped, with its name."""

    session: DriveSession
    name: str


@dataclass(frozen=True, slots=True)
class StopWish:
    """Options for stopping the drives of a line."""

    opened: OpenLine
    profile_id: str | None
    """The profile that the user named; final, unless a drive identifies itself as another."""
    order: OrderId
    journal: Journal
    telling: StopTelling

    def typed(self, device: int) -> str | None:
        """Return the profile that the user named, by -p or as a simulated drive.

        Raises DriveError if there is none such.
        """
        from tui.drive.profile import library

        named = self.profile_id or self.opened.profiles.get(device)
        return library.load(named).id if named is not None else None


async def first_stopped(wish: StopWish, device: int, before: StartRecord | None) -> StoppableDrive:
    """Send the first word, then find out what the drive is; both are reported.

    `before` is the last start of its motor from here. Raises UsageError where it is not known what
    stops it, NoAnswer where it is not there, Failure where it took no stop word.
    """
    from tui.drive.first_stop import families_beside
    from tui.drive.profile.stop_profile import stop_profile
    from tui.session.command.first_stop import stop_first
    from tui.session.connect.identify import DriveIdentity, identify_drive

    opened, typed = wish.opened, wish.typed(device)
    families = await asyncio.to_thread(stop_profile)
    if typed is not None:
        families = families_beside(families, typed)
    known = {typed, *(family.id for family in families)}
    recorded = before.profile if before is not None else None
    named = [item for item in (typed, recorded) if item is not None and item in known]
    # what other programs meant for it is void before the first word, not once it is known
    opened.line.facts.give_stop([device], "drivepanel stop")
    for _ in range(BLIND_TRIES if typed else 1):
        first = await stop_first(opened.line, device, wish.journal, families, named, wish.order)
        if first.answered:
            break
    identity = DriveIdentity(device, "", "", "", "", None, ())
    silent: ExchangeError | None = None
    try:
        # before all polls, and past an owner of the line that is frozen
        identity = await identify_drive(opened.line, device, priority=Priority.STOP)
        says = f"it says it is {identity.reference}" if identity.reference else "it names nothing"
    except ExchangeError as error:
        silent, says = error, "it does not identify itself"
    wish.telling.sent_first(device, first.sent, says)
    if silent is not None and not first.answered:
        hint = [] if typed else ["-p sends a stop word blind."]
        # past a frozen owner of the line: what keeps the stop from the drive
        away = opened.line.state.status is LineStatus.LOST
        why = [opened.line.state.reason] if away else []
        text = f"NOT STOPPED: Device {device} did not answer. Stop it at the machine."
        text = " ".join([text, *hint, *why])
        raise NoAnswer(device, silent.function, silent.address, text)
    found = await asyncio.to_thread(_by_what_is_known, wish, identity, before, first)
    if found is None and first.sent:
        text = f"Device {device}: NOT STOPPED: it took no stop word. Stop it at the machine."
        raise Failure(text, DRIVE_REFUSED)
    if found is None:
        raise unidentified(identity)
    # what was sent first was a command, too
    found.session.reported_by_line = bool(first.sent)
    return found


def _by_what_is_known(
    wish: StopWish,
    identity: DriveIdentity,
    before: StartRecord | None,
    first: FirstStop | None = None,
) -> StoppableDrive | None:
    """The drive by the user's profile, else by its own words, else by the word that it took.

    The user's profile is final unless the drive identifies itself as one of another family.
    """
    from tui.drive.profile import library
    from tui.session.connect.contradiction import contradiction

    if (typed := wish.typed(identity.device)) is not None:
        own = identity.profile or typed
        if wrong := contradiction(identity, library.load(typed)):
            complain(f"{wrong} It is stopped as {library.load(own).name}.")
            return _stoppable(wish, identity, own)
        return _stoppable(wish, identity, typed)
    if before is not None:
        unsaid = identity.profile is None and first is not None and first.may_be(before.profile)
        with suppress(DriveError):
            wrong = contradiction(identity, library.load(before.profile))
            if not wrong and (before.profile in identity.candidates or unsaid):
                guessed = before.guessed and identity.profile is None
                return _stoppable(wish, identity, before.profile, guessed=guessed)
    if identity.profile is not None:
        return _stoppable(wish, identity, identity.profile)
    followers = first.followers if first is not None and first.taken is not None else ()
    guess = next(iter((*identity.candidates, *followers)), None)
    return _stoppable(wish, identity, guess, guessed=True) if guess is not None else None


async def remembered(opened: OpenLine) -> dict[int, StartRecord]:
    """By device, the last start of a motor of this line from here.

    A disk that hangs holds up no stop: then it is not known.
    """
    from tui.bus.link import label
    from tui.session.starts.starts import Starts

    from ..short_stop import STARTS

    found: list[dict[int, StartRecord]] = []
    loop, done = asyncio.get_running_loop(), asyncio.Event()

    def look() -> None:
        try:
            with suppress(OSError):
                found.append(Starts().newest(label(opened.line.link), STARTS))
        finally:
            with suppress(RuntimeError):  # the loop has ended: no task waits for it
                loop.call_soon_threadsafe(done.set)

    if opened.simulation is not None:
        return {}
    threading.Thread(target=look, name="starts on record", daemon=True).start()
    with suppress(TimeoutError):
        await asyncio.wait_for(done.wait(), REMEMBERED_WITHIN)
    return found[0] if found else {}


async def found_at(
    wish: StopWish, device: int, before: StartRecord | None, patience: Priority
) -> StoppableDrive | None:
    """The drive at an address; None without an answer.

    Damaged answers are requested again with an operator's patience. A drive that shows no family is
    sent the word that stops them all first. Raises what `first_stopped` raises, Failure for answers
    that are none; where it is asked shortly, LineError.
    """
    from tui.session.connect.identify import identify_drive

    line = wish.opened.line
    # only a stop reaches a frozen owner, or a drive whose polling is paused
    past = line.state.status is LineStatus.LOST or device in line.facts.paused
    try:
        priority = Priority.STOP if past else patience
        identity = await identify_drive(line, device, priority=priority, brief=True)
    except NoAnswer:
        return None
    except LineError as error:
        if patience is Priority.BACKGROUND:
            raise
        if patience is Priority.PATIENT:
            return await found_at(wish, device, before, Priority.OPERATOR_READ)
        raise Failure(f"Device {device}: NOT STOPPED: {error}", LINE_TROUBLE) from error
    found = await asyncio.to_thread(_by_what_is_known, wish, identity, before)
    return found if found is not None else await first_stopped(wish, device, before)


def _stoppable(
    wish: StopWish, identity: DriveIdentity, profile: str, *, guessed: bool = False
) -> StoppableDrive:
    from tui.drive.profile import library
    from tui.session.drive import DriveSession

    session = DriveSession(wish.opened.line, identity.device, library.load(profile), identity)
    session.guessed = guessed
    return StoppableDrive(session, session.profile.name)
