"""The first message of a program on a line's socket, and the answer: it is taken in, or not.

A stop in its plain form takes the place of that message.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Collection, Mapping
from typing import Protocol

from ..bounds import MOST_PROGRAMS
from ..link import label
from ..schedule.inside import LineInside
from .attached import Client
from .beside import (
    GIVEN,
    LOOK_HEAD,
    PAST_HEAD,
    STOP_HEAD,
    look_answer,
    plain_stop,
    send_past,
)
from .messages import (
    LENGTH,
    VERSION,
    Alive,
    AnyMessage,
    Goodbye,
    Hello,
    NoMessage,
    Pulse,
    StopGiven,
    TurnedAway,
    next_message,
    packed,
)
from .place import peer_of

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

    def __init__(
        self,
        inside: LineInside,
        group: int | None,
        holder: LineHolder,
        stopped: Callable[[StopGiven], None],
    ) -> None:
        """`stopped` hears a stop that takes the place of a greeting."""
        self._stopped = stopped
        self._inside = inside
        self._group = group
        self._holder = holder

    async def heard(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        present: Mapping[str, Client],
    ) -> Hello | None:
        """The greeting of a program that is taken in; None for one that is not, and knows why.

        `present` are the programs that are attached, by id. Raises NoMessage, EOFError,
        OSError, TimeoutError.
        """
        async with asyncio.timeout(HELLO_WITHIN):
            head = await reader.readexactly(LENGTH)
            if head in (STOP_HEAD, LOOK_HEAD, PAST_HEAD):
                await self._answer_beside(head, reader, writer)
                return None
            message = await next_message(reader, head)
        if isinstance(message, Pulse):
            await self._hear_pulse(reader, writer, present, message.program)
            return None
        leaves = isinstance(message, Goodbye)
        needs_way = leaves or (isinstance(message, Hello) and not self._suits(message))
        if needs_way and (await self._holder.makes_way() or leaves):
            return None
        if not isinstance(message, Hello) or message.program.id == self._inside.facts.me.id:
            raise NoMessage("no greeting, or one in the name of the owner")
        if why := self._refusal(message, writer, present):
            writer.write(packed(TurnedAway(why)))
            return None
        return message

    async def _hear_pulse(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        present: Mapping[str, Client],
        program: str,
    ) -> None:
        """Hear the heartbeat of a program while it is attached; of the process itself alone."""
        peer = peer_of(writer.get_extra_info("socket"))
        message: AnyMessage = Alive()
        while isinstance(message, Alive) and (client := present.get(program)) is not None:
            if peer_of(client.writer.get_extra_info("socket")) != peer:
                return
            client.hears(message, self._inside.clock())
            message = await next_message(reader)

    async def _answer_beside(
        self, head: bytes, reader: asyncio.StreamReader, writer: asyncio.StreamWriter
    ) -> None:
        facts, around = self._inside.facts, self._inside.around
        if self._is_stranger(writer):
            raise NoMessage(f"{head.decode()} of another user")
        if head == LOOK_HEAD:
            tally = around.tally
            minute = tally.minute.total(tally.clock())
            writer.write(look_answer(facts.programs, tally.use.shares, minute))
            return
        if head == PAST_HEAD:
            await send_past(writer, around.trace.frames(), facts.notes.all)
            return
        peer = peer_of(writer.get_extra_info("socket"))
        stop = await plain_stop(reader, self._inside.devices.known, peer)
        self._stopped(stop)
        facts.holder.hear_stop_due(stop.devices, stop.program.text)
        self._holder.moved(arrived=False)  # its port may be closed
        # nobody of this name comes back: its stops count on without it
        facts.stops.fold({stop.program.id})
        writer.write(GIVEN)

    def _is_stranger(self, writer: asyncio.StreamWriter) -> bool:
        """True for a program of another user on a line that no group shares."""
        peer = peer_of(writer.get_extra_info("socket"))
        return self._group is None and peer is not None and peer.user not in (os.getuid(), 0)

    def _suits(self, hello: Hello) -> bool:
        """True if program and owner have the same version and settings of the line."""
        return hello.version == VERSION and hello.label == label(self._inside.link)

    def _refusal(self, hello: Hello, writer: asyncio.StreamWriter, present: Collection[str]) -> str:
        """Why a program may not share the line, or empty; its user as by the socket's mode."""
        if self._is_stranger(writer):
            return "This line is shared with other users only."
        if hello.version != VERSION:
            who = f"{self._inside.facts.me.text} owns the line, in another version of Drive Panel."
            return f"{who} Close it, or use the same version."
        if len({*present, hello.program.id}) >= MOST_PROGRAMS:
            return "Too many programs share this line. Close some."
        return ""
