"""Arguments and options that several commands share, and the session behind them."""

from __future__ import annotations

import asyncio
import functools
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeVar

import click

from .looking_after import look_after
from .say import say
from .signals import cleaned_up

if TYPE_CHECKING:
    from tui.bus.link import UsualSettings
    from tui.session.connect.identify import DriveIdentity
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

T = TypeVar("T")
CommandFunction = Callable[..., Any]
Option = Callable[[CommandFunction], CommandFunction]

CONNECT_WITHIN = 5.0
"""Seconds in which a headless command wants its line connected."""

line_argument = click.argument("line_text", metavar="LINE")
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON and nothing else.")

read_only_option = click.option("--read-only", is_flag=True, help="Refuse every write on the line.")

SLAVE_ADDRESS = click.IntRange(1, 247)
device_option = click.option(
    "-d",
    "--device",
    type=SLAVE_ADDRESS,
    default=1,
    show_default=True,
    metavar="ADDRESS",
    help="Slave address of the drive.",
)
profile_option = click.option(
    "-p", "--profile", "profile_id", metavar="ID", help="Profile of the drive."
)
rated_current_option = click.option(
    "--rated-current",
    "rated_current",
    type=float,
    metavar="A",
    help="Rated current of the drive in A, for families that give currents in %.",
)


def devices_option(help_text: str, **more: Any) -> Option:
    """The option -d of a command that takes several drives; `more` goes to click."""
    return click.option(
        "-d",
        "--device",
        "devices",
        type=SLAVE_ADDRESS,
        multiple=True,
        metavar="ADDRESS",
        help=help_text,
        **more,
    )


@dataclass(frozen=True, slots=True)
class Target:
    """What the shared options name."""

    line_text: str
    device: int
    profile_id: str | None
    rated_current: float | None = None


def _target_of(*options: Option) -> Option:
    """Options that, with the LINE of `line_argument`, reach the command as one `target`."""

    def decorate(command: CommandFunction) -> CommandFunction:
        @functools.wraps(command)
        def handed_over(
            line_text: str,
            device: int,
            profile_id: str | None,
            rated_current: float | None = None,
            **others: Any,
        ) -> Any:
            return command(target=Target(line_text, device, profile_id, rated_current), **others)

        decorated: CommandFunction = handed_over
        for option in reversed(options):
            decorated = option(decorated)
        return decorated

    return decorate


drive_options = _target_of(device_option, profile_option, rated_current_option)
"""Which drive on the line, and by which profile, for commands that show values."""
settings_options = _target_of(profile_option, device_option)
"""The same for commands about settings, where a current is a word like any other."""


def on_line(
    where: str | Target,
    work: Callable[[OpenLine], Coroutine[Any, Any, T]],
    *,
    read_only: bool = False,
) -> T:
    """Open a line, do the work, close the line whatever happens.

    A Target whose text names no baud or format is opened with those of its profile.
    """
    from tui.bus.errors import NoAnswer
    from tui.session.connect.open_line import open_line

    text = where if isinstance(where, str) else where.line_text
    usual = None if isinstance(where, str) else _usual_settings(where.profile_id)
    program = click.get_current_context().info_name or "drivepanel"
    opened = open_line(text, read_only=read_only, wait=CONNECT_WITHIN, usual=usual, program=program)
    if opened.line.facts.voice is not None and opened.line.facts.others:
        say(f"drivepanel: {opened.line.state.reason}", err=True)
    look_after(opened.line)
    with cleaned_up(opened.close):
        try:
            return asyncio.run(work(opened))
        except NoAnswer as error:
            if not (hint := _about_silence(opened, text, usual is not None)):
                raise
            told = f"{error} {hint}"
            raise NoAnswer(error.device, error.function, error.address, told) from error


def _usual_settings(profile_id: str | None) -> UsualSettings | None:
    """The settings that drives of a profile leave the factory with; None where it is not known."""
    from tui.bus.link import UsualSettings
    from tui.drive.errors import DriveError
    from tui.drive.profile import library

    if profile_id is None:
        return None
    try:
        link = library.load(profile_id).data.link
    except DriveError:
        return None  # told by whoever needs the profile; a stop does without
    return UsualSettings(link.baud, link.format)


def _about_silence(opened: OpenLine, text: str, by_profile: bool) -> str:
    """What to look at where nothing answers; empty for a line without settings of its own."""
    from tui.bus.link import SerialLink, UsualSettings, parse_link

    link = opened.line.link
    if not isinstance(link, SerialLink) or opened.simulation is not None:
        return ""
    other = UsualSettings(link.baud + 1, "8N1" if link.format != "8N1" else "8E1")
    plain = parse_link(text, other)
    named = isinstance(plain, SerialLink) and (plain.baud, plain.format) == (link.baud, link.format)
    whose = "as typed" if named else "the profile's own" if by_profile else "as no others are named"
    return (
        f"Are address, wiring, {link.baud} baud and {link.format} ({whose}) those of the drive?"
        f" Others: serial:{link.path},BAUD,FORMAT."
    )


async def connect_drive(opened: OpenLine, target: Target) -> DriveSession:
    """The wanted drive with its profile, identified where none was named.

    Raises UnidentifiedDrive with what to type where the drive does not say who it is.
    """
    from tui.drive.profile import library
    from tui.session.connect.identify import identify_drive
    from tui.session.drive import DriveSession

    identity: DriveIdentity | None = None
    profile_id = target.profile_id
    if profile_id is None:
        identity = await identify_drive(opened.line, target.device)
        profile_id = identity.profile
        if profile_id is None:
            raise unidentified(identity)
    session = DriveSession(opened.line, target.device, library.load(profile_id), identity)
    await asyncio.to_thread(_recall, session)
    _rate(session, target.rated_current)
    return session


def _recall(session: DriveSession) -> None:
    """Go by what was taught of the drive; that it cannot be read is said and hinders nothing."""
    from tui.session.teaching.teacher import Teacher

    from .say import say

    teacher = Teacher(session)
    teacher.recall()
    if teacher.trouble:
        say(f"drivepanel: {teacher.trouble}", err=True)


def _rate(session: DriveSession, rated_current: float | None) -> None:
    current = session.profile.quantity("motor_current")
    if rated_current is None or current is None:
        return
    from decimal import Decimal

    from tui.session.reading import Rating

    session.ratings[current.code] = Rating(Decimal(str(rated_current)), "A")


def unidentified(identity: DriveIdentity) -> click.UsageError:
    """The error for a drive that no profile was named for and none fits."""
    from tui.drive.profile import library

    who = f"as {identity.reference!r}" if identity.reference else "but does not say who it is"
    fits = identity.candidates or tuple(listing.id for listing in library.listings())
    return click.UsageError(
        f"Device {identity.device} answers {who}; name its profile with -p: {', '.join(fits)}."
    )
