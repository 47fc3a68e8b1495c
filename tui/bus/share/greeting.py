"""The socket on which the owner of a line listens: private, newly made, never left after its end.

Also the first message of a program there, which is admitted or not. A request without attaching
replaces that message.
"""

from __future__ import annotations

import asyncio
import logging
import os
import socket
from collections.abc import Awaitable, Callable, Collection, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Protocol

from ..bounds import MOST_PROGRAMS
from ..line_events import StopDue
from ..link import label
from ..schedule.inside import LineInside
from ..shared_state import SharedState
from .attached import Client
from .beside import (
    GIVEN,
    LOOK_HEAD,
    PAST_HEAD,
    STOP_HEAD,
    look_answer,
    plain_stop,
    send_directly,
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
from .place import (
    PRIVATE_FILE,
    SHARED_FILE,
    Owner,
    OwnerLock,
    SharePlace,
    make_private,
    peer_of,
    short_path,
)

log = logging.getLogger(__name__)

HELLO_WITHIN = 2.0
"""Seconds that a program has for its greeting."""
KEEPING_ENDS = 0.5
"""Seconds to wait for a write to the disk before the next owner writes its own."""


class PortHolder(Protocol):
    """The part of a line's owner that opens and closes the port as programs come and leave."""

    def moved(self, *, arrived: bool) -> None:
        """Note that a program has attached or left."""

    async def port_left(self) -> None:
        """Return once the port is closed, or in use by others."""

    async def makes_way(self) -> bool:
        """End if no program is served, and return True."""


TakeIn = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


class Greeting:
    """Takes the greetings of programs for the holder of a line."""

    def __init__(
        self,
        inside: LineInside,
        group: int | None,
        holder: PortHolder,
        stopped: Callable[[StopGiven], None],
    ) -> None:
        """`stopped` is called with a stop that replaces a greeting."""
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
        """The greeting of an admitted program; None for a rejected one, which has its reason.

        `present` are the attached programs, by id. Raises NoMessage, EOFError, OSError,
        TimeoutError.
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
        """Receive the heartbeat of an attached program; only from its own process."""
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
            await send_directly(writer, around.trace.frames(), facts.notes.all)
            return
        peer = peer_of(writer.get_extra_info("socket"))
        stop = await plain_stop(reader, self._inside.devices.known, peer, facts.programs)
        self._stopped(stop)
        facts.events.emit(StopDue(stop.devices, stop.program.text))
        self._holder.moved(arrived=False)  # its port may be closed
        # no program of this name returns: its stops still count, without its name
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
        """Reason if a program may not share the line, else empty; the socket's mode checks its
        user."""
        if self._is_stranger(writer):
            return "This line is shared with other users only."
        if hello.version != VERSION:
            who = f"{self._inside.facts.me.text} owns the line, in another version of Drive Panel."
            return f"{who} Close it, or use the same version."
        if len({*present, hello.program.id}) >= MOST_PROGRAMS:
            return "Too many programs share this line. Close some."
        return ""


class Listening:
    """Listens for programs of one line; lives in the line's loop."""

    def __init__(
        self, place: SharePlace, lock: OwnerLock, facts: SharedState, line: str, welcome: TakeIn
    ) -> None:
        self._place = place
        self._line = line
        self._lock = lock
        self._facts = facts
        self._stopped: dict[int, float] = {}
        self._welcome = welcome
        self._server: asyncio.Server | None = None
        self._path: Path | None = None
        self._keeping: asyncio.Task[None] | None = None

    async def start(self) -> None:
        """Listen in the first folder that accepts a socket. Raises OSError if none does."""
        trouble: OSError = FileNotFoundError("no folder for the socket of the line")
        for folder in self._place.socket_folders:
            try:
                await self._listen(folder)
            except OSError as error:
                trouble = error
            else:
                return
        raise trouble

    async def _listen(self, folder: Path) -> None:
        shared = self._place.group is not None
        # only its owner may enter it, so that no program connects before the socket has its mode
        make_private(folder, shared=shared)
        path = folder / f"{self._place.name}.sock"
        with suppress(FileNotFoundError):
            path.unlink()
        listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            with short_path(path) as address:
                listening.bind(address)
            path.chmod(SHARED_FILE if shared else PRIVATE_FILE)
            if self._place.group is not None:
                os.chown(path, -1, self._place.group)
            self._server = await asyncio.start_unix_server(self._welcome, sock=listening)
        except BaseException:
            # this program may end in the midst of it
            listening.close()
            with suppress(OSError):
                path.unlink()
            raise
        self._path = path
        self._tell()

    def keep(self) -> None:
        """Begin to look after the socket and the lock; a disk that hangs is not waited for."""
        if self._keeping is None or self._keeping.done():
            self._keeping = asyncio.create_task(self._keep(), name="socket of the line")

    async def _keep(self) -> None:
        """Make the socket again if its folder was removed, for example at the end of a login.

        The lock is taken again if its file was removed.
        """
        if not await asyncio.to_thread(lambda: self._lock.stands):
            self._renew_lock()
        if self._path is not None and await asyncio.to_thread(self._note, self._path):
            return
        if self._server is not None:
            self._server.close()
        with suppress(OSError):
            await self.start()

    def _note(self, path: Path) -> bool:
        """Record recent stops; False if the socket was removed."""
        if self._facts.stops.late_times != self._stopped:
            with suppress(OSError):
                self._tell()
        return os.access(path, os.F_OK)

    def _renew_lock(self) -> None:
        with suppress(OSError):
            if self._lock.renew() and self._path is not None:
                log.error("the lock of the line was removed, and is made again")
                self._tell()

    def _tell(self) -> None:
        """Write down this program's address and the stops, for the next owner."""
        self._stopped = self._facts.stops.late_times
        self._lock.tell(
            Owner(VERSION, self._facts.me, str(self._path), 0.0, self._stopped, self._line)
        )

    async def close(self) -> None:
        """Stop listening, and remove the socket."""
        if self._keeping is not None:
            await asyncio.wait((self._keeping,), timeout=KEEPING_ENDS)
            self._keeping.cancel()
        if self._server is not None:
            self._server.close()
        if self._path is not None:
            with suppress(OSError):
                self._path.unlink()
            self._path = None
