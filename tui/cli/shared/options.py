"""Arguments and options that several commands share, and the session behind them."""

from __future__ import annotations

import asyncio
import functools
import os
from collections.abc import Callable, Coroutine
from contextlib import ExitStack, suppress
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import click

from .completion import complete_profile
from .line_argument import LineArgument, mind_the_drive, mind_the_line, takes_line_as
from .looking_after import guard_motors, say_shared, to_its_end
from .numbers import SHORTEST_CYCLE, FiniteRange, seconds
from .profile_choice import (
    FORCE_PROFILE,
    believe_the_person,
    confirm_unproved,
    unidentified,
)
from .say import say
from .signals import never_suspended
from .silence import about_silence, wait_for_state

if TYPE_CHECKING:
    from tui.bus.link import UsualSettings
    from tui.session.connect.open_line import OpenLine
    from tui.session.drive import DriveSession

T = TypeVar("T")

CommandFunction = Callable[..., Any]
Option = Callable[[CommandFunction], CommandFunction]

SLAVE_ADDRESS = click.IntRange(1, 247)


def one_device(_: click.Context, option: click.Parameter, given: tuple[int, ...]) -> int | None:
    """The one address of an option -d that may be given once; the last would win otherwise."""
    if len(given) > 1:
        raise click.BadParameter("once only: this command is for one drive.", param=option)
    return given[0] if given else None


device_option = click.option(
    "-d",
    "--device",
    type=SLAVE_ADDRESS,
    multiple=True,
    callback=one_device,
    default=(1,),
    show_default=True,
    metavar="ADDRESS",
    help="Use the drive at this slave address.",
)
several_devices_option = click.option(
    "-d",
    "--device",
    type=SLAVE_ADDRESS,
    multiple=True,
    default=(1,),
    show_default=True,
    metavar="ADDRESS",
    help="Use the drive at this slave address; repeatable.",
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


CONNECT_WITHIN = 5.0
"""Seconds in which a headless command wants its line connected."""

line_argument = takes_line_as(LineArgument, "LINE")
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON and nothing else.")

read_only_option = click.option("--read-only", is_flag=True, help="Write nothing on this line.")

every_option = click.option(
    "--every",
    type=seconds(SHORTEST_CYCLE),
    default=1.0,
    show_default=True,
    metavar="S",
    help="Set the target cycle time in seconds.",
)


def profile_of(what: str) -> Option:
    """The option that names a profile, with its help."""
    return click.option(
        "-p",
        "--profile",
        "profile_id",
        metavar="ID",
        shell_complete=complete_profile,
        help=what,
    )


profile_option = profile_of("Profile of the drive; it must match the drive's identification.")
rated_current_option = click.option(
    "--rated-current",
    "rated_current",
    type=FiniteRange(0, 10000, min_open=True),
    metavar="A",
    help="Set the rated current in A, if currents are in %.",
)


class Target(NamedTuple):
    """Line, drive and profile that the shared options name."""

    line_text: str
    device: int
    profile_id: str | None
    rated_current: float | None = None
    force_profile: bool = False
    """True if a profile counts that the drive contradicts; never for what moves a motor."""
    others: tuple[int, ...] = ()
    """Further addresses on the same line, where a command takes several."""
    by_recipe: bool = False
    """True if a recipe names the profile."""

    def each(self) -> list[Target]:
        """A target for each drive, in the order in which they were named."""
        devices = dict.fromkeys((self.device, *self.others))
        return [self._replace(device=device, others=()) for device in devices]


force_profile_option = click.option(
    FORCE_PROFILE,
    "force_profile",
    is_flag=True,
    help="Use the profile of -p even if the drive contradicts it.",
)
"""For commands that read, watch or write; it reaches them in their Target."""

hold_option = click.option(
    "--hold",
    type=seconds(above=True),
    metavar="S",
    help="Keep polling S seconds more; its timeout does not act.",
)


def never_forced(command: CommandFunction) -> CommandFunction:
    """The same option, refused: for commands after which a wrong profile moves a motor."""

    def refuse(context: click.Context, _option: click.Parameter, given: bool) -> None:
        if given:
            raise click.UsageError(
                f"{FORCE_PROFILE} does not apply to {context.info_name}, which uses the drive's own"
                " profile only. Use it with read, watch and write."
            )

    return click.option(
        FORCE_PROFILE, is_flag=True, hidden=True, expose_value=False, callback=refuse
    )(command)


def _target_of(*options: Option) -> Option:
    """Options that, with the LINE of `line_argument`, reach the command as one `target`."""

    def decorate(command: CommandFunction) -> CommandFunction:
        @functools.wraps(command)
        def handed_over(
            line_text: str,
            device: int | tuple[int, ...],
            profile_id: str | None,
            rated_current: float | None = None,
            force_profile: bool = False,
            **others: Any,
        ) -> Any:
            first, *more = device if isinstance(device, tuple) else (device,)
            target = Target(line_text, first, profile_id, rated_current, force_profile)
            return command(target=target._replace(others=tuple(more)), **others)

        decorated: CommandFunction = handed_over
        for option in reversed(options):
            decorated = option(decorated)
        return decorated

    return decorate


drive_options = _target_of(device_option, profile_option, rated_current_option)
"""Which drive on the line, and by which profile, for commands that show values."""
drives_options = _target_of(several_devices_option, profile_option, rated_current_option)
"""The same for commands that take several drives."""
settings_options = _target_of(profile_option, device_option)
"""The same for commands about settings, where a current is a word like any other."""
several_settings = _target_of(profile_option, several_devices_option)
"""The same for commands about the settings of several drives."""


def on_line(
    where: str | Target,
    work: Callable[[OpenLine], Coroutine[Any, Any, T]],
    *,
    read_only: bool = False,
    keeper: bool = True,
) -> T:
    """Open a line, do the work, close the line whatever happens.

    A Target whose text names no baud or format is opened with those of its profile. Without
    `keeper` no process is started for a line that none holds.
    """
    from tui.bus.errors import NoAnswer
    from tui.session.connect.open_line import open_line

    text = where if isinstance(where, str) else where.line_text
    usual = None if isinstance(where, str) else usual_settings(where.profile_id)
    program = click.get_current_context().info_name or "drivepanel"
    with ExitStack() as stack:
        stack.enter_context(never_suspended())
        opened = open_line(
            text,
            read_only=read_only,
            wait=CONNECT_WITHIN,
            usual=usual,
            program=program,
            keeper=keeper,
        )
        stack.callback(opened.close)
        say_shared(opened)
        stack.callback(guard_motors(opened))
        try:
            mind_the_line(opened)
            return asyncio.run(to_its_end([opened], lambda: work(opened)))
        except NoAnswer as error:
            wait_for_state(opened.line)
            hint = about_silence(opened, text, error.device, by_profile=usual is not None)
            if not hint:
                raise
            text = f"{error} {hint}"
            raise NoAnswer(error.device, error.function, error.address, text) from error


def usual_settings(profile_id: str | None) -> UsualSettings | None:
    """The settings that drives of a profile leave the factory with; None where it is not known."""
    from tui.bus.link import UsualSettings
    from tui.drive.errors import DriveError
    from tui.drive.profile import library

    if profile_id is None:
        return None
    try:
        link = library.load(profile_id).data.link
    except DriveError:
        return None  # reported by code that needs the profile; a stop needs none
    return UsualSettings(link.baud, link.format)


async def connect_drive(opened: OpenLine, target: Target) -> DriveSession:
    """A session with the drive, by the profile of -p, else by that of its identity or line.

    Raises UsageError with advice if the drive does not identify itself, Contradiction if its
    identity contradicts the profile.
    """
    from tui.drive.profile import library
    from tui.session.connect.contradiction import own_words
    from tui.session.connect.identify import identify_drive
    from tui.session.drive import DriveSession

    from .pending_timeouts import look_after

    if target.profile_id is not None:
        profile = library.load(target.profile_id)
        reported = await own_words(opened.line, target.device, profile)
    else:
        reported = await identify_drive(opened.line, target.device)
        # a simulated line names its profiles; some families cannot be identified
        known = reported.profile or opened.profiles.get(target.device)
        if known is None:
            raise unidentified(reported)
        profile = library.load(known)
    session = DriveSession(opened.line, target.device, profile, reported)
    if session.contradiction:
        believe_the_person(session, forced=target.force_profile, by_recipe=target.by_recipe)
    if opened.simulation is not None and session.is_unconfirmed and not session.contradiction:
        session.confirm_profile()
    await confirm_unproved(session)
    mind_the_drive(opened, target.device, reported, "" if session.contradiction else profile.id)
    await _check_byte_order(session)
    await look_after(opened, session, target.line_text).learn()
    await asyncio.to_thread(_recall, session)
    _rate(session, target.rated_current)
    return session


async def _check_byte_order(session: DriveSession) -> None:
    """Check the byte order of a drive that answers; a swapped order fails its first read."""
    from tui.bus.api import Priority
    from tui.bus.errors import LineError
    from tui.session.read.order_check import check_byte_order
    from tui.session.read.reader import Reader

    if session.line.device_state(session.device).heard is not None:
        with suppress(LineError):
            await check_byte_order(Reader(session), Priority.OPERATOR_READ)


def _recall(session: DriveSession) -> None:
    """Use the learned scales of the drive; if they cannot be read, report it and continue."""
    from tui.session.teaching.teacher import Teacher

    teacher = Teacher(session)
    teacher.recall()
    if teacher.trouble:
        say(f"drivepanel: {teacher.trouble}", err=True)


def _rate(session: DriveSession, rated_current: float | None) -> None:
    current = session.profile.quantity("motor_current")
    if rated_current is None or current is None:
        return
    from decimal import Decimal

    from tui.session.shown import Rating

    session.ratings[current.code] = Rating(Decimal(str(rated_current)), "A")


def host_port(text: str) -> tuple[str, int]:
    """Host and port; loopback where only a port is given, any free port for 0."""
    host, _, port = text.rpartition(":")
    if not port.isdecimal() or int(port) > 65535:
        raise click.UsageError(f"{text!r}: write HOST:PORT, for example 127.0.0.1:5020.")
    return host.strip("[]") or "127.0.0.1", int(port)


def written_host_port(host: str, port: int) -> str:
    """The same as it is written, an IPv6 address in brackets."""
    return f"[{host}]:{port}" if ":" in host else f"{host}:{port}"


def why_not_served(error: OSError) -> str:
    """Why a place cannot be listened at, in the system's own words; asyncio wraps some of them."""
    if error.errno is not None and error.errno > 0:
        return os.strerror(error.errno)
    return error.strerror or str(error)
