"""The first message of a program on a line's socket, and the answer: it is taken in, or not."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Collection
from typing import Protocol

from ..bounds import MOST_PROGRAMS
from ..link import label
from ..schedule.inside import LineInside
from .messages import VERSION, Goodbye, Hello, NoMessage, TurnedAway, next_message, packed
from .place import user_of

HELLO_WITHIN = 2.0
"""Seconds that a program has for its greeting."""


class LineHolder(Protocol):
    """The program that holds the line that is served."""

    def moved(self, *, arrived: bool) -> None:
        """A program came, or one has gone."""

    async def port_left(self) -> None:
        """Return once a program that leaves may count on it that the port is closed, or in use."""

    async def makes_way(self) -> bool:
        """End if nobody is served; True then."""


class Greeting:
    """Takes the greetings of programs for the holder of a line."""

    def __init__(self, inside: LineInside, group: int | None, holder: LineHolder) -> None:
        self._inside = inside
        self._group = group
        self._holder = holder

    async def heard(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, present: Collection[str]
    ) -> Hello | None:
        """The greeting of a program that is taken in; None for one that is not, and knows why.

        `present` are the ids of the programs that are attached. Raises NoMessage, EOFError,
        OSError, TimeoutError.
        """
        async with asyncio.timeout(HELLO_WITHIN):
            message = await next_message(reader)
        leaves = isinstance(message, Goodbye)
        if leaves or (isinstance(message, Hello) and not self._suits(message)):
            if await self._holder.makes_way():
                writer.write(packed(Goodbye()))
                return None
            if leaves:
                return None
        if not isinstance(message, Hello) or message.program.id == self._inside.facts.me.id:
            raise NoMessage("no greeting, or one in the name of the owner")
        if why := self._refusal(message, writer, present):
            writer.write(packed(TurnedAway(why)))
            return None
        return message

    def _suits(self, hello: Hello) -> bool:
        """True if program and owner have the same version and settings of the line."""
        return hello.version == VERSION and hello.label == label(self._inside.link)

    def _refusal(self, hello: Hello, writer: asyncio.StreamWriter, present: Collection[str]) -> str:
        """Why a program may not share the line, or empty; its user as by the socket's mode."""
        mine = (os.getuid(), 0, None)
        if self._group is None and user_of(writer.get_extra_info("socket")) not in mine:
            return "This line is shared with other users only."
        if hello.version != VERSION:
            who = f"{self._inside.facts.me.text} owns the line, in another version of Drive Panel."
            return f"{who} Close it, or use the same version."
        if len({*present, hello.program.id}) >= MOST_PROGRAMS:
            return "Too many programs share this line. Close some."
        return ""
