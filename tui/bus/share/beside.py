"""Requests of a program to the holder of a line without being attached.

In place of a Hello it sends four bytes, which read as the length of a message are longer than any.
The answer follows, then the connection closes.

- STOP: a stop, in a form that never changes: any version of any program may send it. The rest of
  the line is ASCII text, ` 2 3` for the devices at these addresses, ` all` for every device that
  the holder knows. The answer is GIVEN. The shell's short way sends it before anything slow is
  imported: tui.cli.short_stop.
- LOOK: the programs on the line and its last minute, as JSON.
- PAST: the frames and notes that the holder has kept, in pieces, each after its length. It works
  on a lost line too.
"""

from __future__ import annotations

import asyncio
import uuid
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from time import monotonic
from typing import Annotated

import msgspec
from msgspec import Meta

from ..bounds import MOST_FRAMES, Number, Share, Word
from ..model import LastMinute
from ..notes import NOTES_A_LOOK, LineNote
from ..program import LONGEST_NAME, Program, pid_namespace, readable
from ..program_use import use_by_program
from ..trace import Frame
from .messages import LENGTH, LONGEST_MESSAGE, NoMessage, StopGiven
from .place import Owner, Peer, reached

STOP_HEAD, LOOK_HEAD, PAST_HEAD = b"STOP", b"LOOK", b"PAST"
GIVEN = b"GIVEN\n"
LONGEST_PLAIN_STOP = 1100
"""Most bytes of a stop after its head; all addresses take fewer."""
GIVEN_WITHIN, LOOK_WITHIN, PAST_WITHIN = 0.5, 0.5, 5.0
"""Timeout in seconds of each step of a stop, and of the other two as a whole."""
LONGEST_LOOK_ANSWER = 1 << 16
FRAMES_KEPT = 20_000
"""Frames that a keeper keeps: minutes of a serial line, some megabytes."""
_DEVICES = range(1, 248)
_ADDRESSES = {str(device).encode(): device for device in _DEVICES}
_ALL = [b"all"]
_BY, _BY_PROGRAM = "drivepanel stop", "a direct stop"


async def plain_stop(
    reader: asyncio.StreamReader,
    known: Collection[int],
    peer: Peer | None,
    programs: Iterable[Program] = (),
) -> StopGiven:
    """The stop of a program that has sent its head, in the name of a program of its own.

    `known` are the devices that `all` stands for. If the sender is one of the `programs` on the
    line, the stop is shown with its name. Raises NoMessage, EOFError, OSError.
    """
    try:
        line = await reader.readuntil(b"\n")
    except asyncio.LimitOverrunError as error:
        raise NoMessage("a stop without an end") from error
    devices = stop_devices(line, known)
    pid, id = peer.pid if peer is not None else 0, uuid.uuid4().hex
    here = pid_namespace(), pid
    for program in programs:
        if pid and program.process == here:
            named = msgspec.structs.replace(program, id=id)
            return StopGiven(devices, (1,) * len(devices), _BY_PROGRAM, named)
    return StopGiven(devices, (1,) * len(devices), _BY, Program(id, "stop", pid))


def send_plain_stop(address: Path, devices: Iterable[int]) -> None:
    """Send such a line to the socket of a holder, and await its answer. Raises OSError."""
    with reached(address, GIVEN_WITHIN) as connection:
        connection.sendall(b"%s %s\n" % (STOP_HEAD, " ".join(map(str, devices)).encode()))
        if connection.recv(len(GIVEN)) != GIVEN:
            raise OSError(f"{address} did not accept the stop")


def stop_devices(line: bytes, known: Collection[int]) -> tuple[int, ...]:
    """The devices that the rest of such a line names, each once. Raises NoMessage."""
    if len(line) > LONGEST_PLAIN_STOP:
        raise NoMessage("a stop that is too long")
    blank, *words = line.removesuffix(b"\n").split(b" ")
    if blank or not words:
        raise NoMessage("a stop without a device")
    if words == _ALL:
        return tuple(device for device in known if device in _DEVICES)
    try:
        return tuple(dict.fromkeys(_ADDRESSES[word] for word in words))
    except KeyError:
        raise NoMessage("a stop of a wrong address") from None


class LineClient(msgspec.Struct, frozen=True):
    """A program on a line, and its recent share of the line's time."""

    program: Word
    pid: Number
    share: Share


class LineLook(msgspec.Struct, frozen=True):
    """The answer to a program that looks."""

    clients: list[LineClient]
    minute: LastMinute | None = None
    """None from a holder of an older version."""


def look_answer(
    programs: Iterable[Program], shares: Mapping[str, float], minute: LastMinute
) -> bytes:
    """The answer to a program that looks."""
    clients = [
        LineClient(readable(program.name, LONGEST_NAME), program.pid, round(share, 3))
        for program, share in use_by_program(programs, shares)
    ]
    return msgspec.json.encode(LineLook(clients, minute))


def line_look(owner: Owner) -> LineLook | None:
    """Ask the holder of a line; None without an answer."""
    data, end = b"", monotonic() + LOOK_WITHIN
    try:
        with reached(Path(owner.socket), LOOK_WITHIN) as connection:
            connection.sendall(LOOK_HEAD)
            while (part := connection.recv(4096)) and len(data) < LONGEST_LOOK_ANSWER:
                data += part
                connection.settimeout(max(0.01, end - monotonic()))
        # a holder of an older version answers its clients alone
        found = msgspec.json.decode(data, type=LineLook | list[LineClient])
        return found if isinstance(found, LineLook) else LineLook(found)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError):
        return None


class LinePast(msgspec.Struct, frozen=True):
    """Frames with their times on the monotonic clock, and notes; the oldest first."""

    frames: Annotated[tuple[Frame, ...], Meta(max_length=FRAMES_KEPT)] = ()
    notes: tuple[LineNote, ...] = ()


async def send_directly(
    writer: asyncio.StreamWriter, frames: Sequence[Frame], notes: Sequence[LineNote]
) -> None:
    """Send the past in pieces, so that the line can be served in between; the first is empty."""
    await _send(writer, LinePast())
    for at in range(0, len(frames), MOST_FRAMES):
        await _send(writer, LinePast(frames=tuple(frames[at : at + MOST_FRAMES])))
    for at in range(0, len(notes), NOTES_A_LOOK):
        await _send(writer, LinePast(notes=tuple(notes[at : at + NOTES_A_LOOK])))


async def _send(writer: asyncio.StreamWriter, piece: LinePast) -> None:
    data = msgspec.msgpack.encode(piece)
    writer.write(len(data).to_bytes(LENGTH, "big") + data)
    await writer.drain()
    await asyncio.sleep(0)


def line_past(owner: Owner) -> tuple[tuple[Frame, ...], tuple[LineNote, ...]]:
    """Request the past from the holder of a line; waits for it.

    Raises OSError if it does not answer, for example because it has an older version.
    """
    frames: list[Frame] = []
    notes: list[LineNote] = []
    end, received = monotonic() + PAST_WITHIN, False
    with reached(Path(owner.socket), PAST_WITHIN) as connection:
        connection.sendall(PAST_HEAD)
        with connection.makefile("rb") as pieces:
            while len(frames) < FRAMES_KEPT and (head := pieces.read(LENGTH)):
                data = pieces.read(min(int.from_bytes(head, "big"), LONGEST_MESSAGE))
                try:
                    piece = msgspec.msgpack.decode(data, type=LinePast)
                except (msgspec.MsgspecError, UnicodeDecodeError) as error:
                    raise OSError(f"its answer is damaged: {error}") from error
                frames += piece.frames
                notes += piece.notes
                received = True
                connection.settimeout(max(0.01, end - monotonic()))
    if not received:
        raise OSError("it has an older version, which keeps no frames")
    return tuple(frames), tuple(notes)
