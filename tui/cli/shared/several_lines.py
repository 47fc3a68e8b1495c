"""Several LINEs for one command: which drives of each are meant, and their opening side by side.

The LINEs come first; each may have its drives behind an `@`, as in `pump@1,2` or `tcp:HOST@5`.
"""

from __future__ import annotations

import asyncio
import os
import re
from collections.abc import Callable, Coroutine, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from itertools import takewhile
from typing import TYPE_CHECKING, Any, TypeVar

import click
from click.core import ParameterSource

from .line_argument import (
    LineArgument,
    is_known_name,
    is_written_out,
    mind_the_line,
    named_line_of,
    takes_line_as,
)
from .looking_after import guard_motors, say_shared, to_its_end
from .options import CONNECT_WITHIN, Target, usual_settings
from .signals import never_suspended

if TYPE_CHECKING:
    from tui.session.connect.open_line import OpenLine

T = TypeVar("T")

CONNECTION_LOOK = 0.02
_FIRST_WORD = "drivepanel.first-line"
_ADDRESSES = re.compile(r"\d[\d,-]*")
_SIMULATED = "sim:"


class FirstOfLines(LineArgument):
    """The first LINE of a command that takes several; its word is kept as it was typed."""

    def is_line(self, text: str) -> bool:
        """Return True if a word is surely meant for this argument."""
        return super().is_line(split_addresses(text)[0])

    def process_value(self, ctx: click.Context, value: Any) -> Any:
        """The LINE that is meant, written out, without the addresses behind it."""
        ctx.meta[_FIRST_WORD] = value
        return super().process_value(
            ctx, split_addresses(value)[0] if isinstance(value, str) else value
        )


lines_argument = takes_line_as(FirstOfLines, "LINE...")


@dataclass(frozen=True, slots=True)
class LineWish:
    """A LINE with the drives on it that are meant."""

    name: str
    """As it was typed first, without addresses."""
    drives: tuple[Target, ...]
    all_drives: bool = False
    """True if a simulated line is meant with all its drives."""
    addresses: str = ""
    """Text after its `@`; empty if none."""

    @property
    def text(self) -> str:
        """The line, written out."""
        return self.drives[0].line_text

    def on(self, opened: OpenLine) -> tuple[Target, ...]:
        """Each drive that is meant, once the line is open."""
        if not self.all_drives:
            return self.drives
        return tuple(self.drives[0]._replace(device=device) for device in opened.devices)

    def with_profile(self, profile_id: str | None) -> LineWish:
        """The same line, with this profile for each of its drives."""
        drives = tuple(drive._replace(profile_id=profile_id) for drive in self.drives)
        return replace(self, drives=drives)


def split_addresses(word: str) -> tuple[str, str]:
    """A LINE and the addresses behind its `@`; those of a simulated line are its own."""
    line, sign, addresses = word.rpartition("@")
    if not sign or not _ADDRESSES.fullmatch(addresses) or word.casefold().startswith(_SIMULATED):
        return word, ""
    return (word, "") if os.path.exists(word.partition(",")[0]) else (line, addresses)


def further_lines(words: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The LINEs among the words behind the first LINE, and the rest: LINEs come first.

    Raises UsageError for a LINE behind a word that is none.
    """
    lines = tuple(takewhile(_is_line, words))
    rest = tuple(words[len(lines) :])
    if late := [text for text in rest if is_written_out(text)]:
        raise click.UsageError(f"{late[0]}: put every LINE before the first CODE.")
    return lines, rest


def _is_line(word: str) -> bool:
    return is_written_out(word) or is_known_name(split_addresses(word)[0])


def lines_wished(target: Target, more: Sequence[str]) -> list[LineWish]:
    """Return the lines of the first LINE, which made the target, and of those after it; each once.

    -d and -p count for every LINE; the addresses behind a LINE go before -d. Raises UsageError, and
    LinkSyntaxError for an invalid LINE or address.
    """
    from tui.session.connect.line_key import line_key
    from tui.session.connect.open_line import check_line

    ctx = click.get_current_context()
    first = str(ctx.meta[_FIRST_WORD])
    wishes: dict[str, LineWish] = {}
    for word in (first, *more):
        wish = _wish_of(ctx, word, target, several=bool(more))
        if more:
            check_line(wish.text)
        key = line_key(wish.text)
        wishes[key] = _joined(wishes[key], wish) if key in wishes else wish
    return list(wishes.values())


def _wish_of(ctx: click.Context, word: str, target: Target, *, several: bool) -> LineWish:
    from tui.session.connect.addresses import parse_addresses

    name, addresses = split_addresses(word)
    named = named_line_of(name)
    text = named.line if named is not None else name
    typed = _was_typed(ctx, "device")
    given = tuple(item.device for item in target.each()) if typed else ()
    own = (named.device,) if named is not None and named.device is not None else ()
    devices = tuple(parse_addresses(addresses)) if addresses else given or own
    profile = target.profile_id if _was_typed(ctx, "profile_id") else None
    if profile is None and named is not None and (not own or set(devices) == set(own)):
        profile = named.profile  # it is that of the drive which the name means
    simulated = text.casefold().startswith(_SIMULATED)
    wanted = target._replace(line_text=text, profile_id=profile, others=())
    drives = tuple(wanted._replace(device=number) for number in dict.fromkeys(devices or (1,)))
    every = several and simulated and not devices
    return LineWish(name, drives, all_drives=every, addresses=addresses)


def _was_typed(ctx: click.Context, option: str) -> bool:
    return ctx.get_parameter_source(option) is ParameterSource.COMMANDLINE


def _joined(wish: LineWish, more: LineWish) -> LineWish:
    """A line that was named twice, with the drives of both."""
    drives = {drive.device: drive for drive in (*more.drives, *wish.drives)}
    in_order = dict.fromkeys(drive.device for drive in (*wish.drives, *more.drives))
    all_drives = wish.all_drives or more.all_drives
    where = ",".join(each.addresses for each in (wish, more) if each.addresses)
    return LineWish(wish.name, tuple(drives[device] for device in in_order), all_drives, where)


def on_lines(
    wishes: Sequence[LineWish],
    work: Callable[[Sequence[OpenLine]], Coroutine[Any, Any, T]],
    *,
    read_only: bool,
) -> T:
    """Open lines, do the work, close them whatever happens.

    None of them is waited for here: see connected().
    """
    with ExitStack() as stack:
        stack.enter_context(never_suspended())
        opened = [stack.enter_context(_line_of(wish, read_only=read_only)) for wish in wishes]
        return asyncio.run(to_its_end(opened, lambda: work(opened)))


@contextmanager
def _line_of(wish: LineWish, *, read_only: bool) -> Iterator[OpenLine]:
    """A line that connects automatically, closed at the end."""
    from tui.session.connect.open_line import open_line

    opened = open_line(
        wish.text,
        read_only=read_only,
        usual=usual_settings(wish.drives[0].profile_id),
        program=click.get_current_context().info_name or "drivepanel",
    )
    guard_motors(opened, wish.name)
    try:
        yield opened
    finally:
        opened.close()


async def connected(opened: OpenLine, name: str) -> None:
    """Wait until a line is connected. Raises LineLost with the reason after CONNECT_WITHIN."""
    from tui.bus.api import LineStatus
    from tui.bus.errors import LineLost

    line = opened.line
    end = asyncio.get_running_loop().time() + CONNECT_WITHIN
    while line.state.status is not LineStatus.CONNECTED:
        if asyncio.get_running_loop().time() > end:
            raise LineLost(line.state.reason or f"not connected within {CONNECT_WITHIN:g} s.")
        await asyncio.sleep(CONNECTION_LOOK)
    say_shared(opened, name)
    mind_the_line(opened)
