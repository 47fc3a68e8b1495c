"""Meeting place of programs that share a line: the lock that decides ownership, and the socket.

The lock is in a folder that persists (the state folder), and contains the socket's place.
"""

from __future__ import annotations

import hashlib
import logging
import os
import re
import socket
import stat
import struct
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from time import monotonic
from typing import IO, Annotated, NamedTuple

import msgspec
from msgspec import Meta

from ..bounds import MonotonicTime, Number, StopTimes, Text
from ..program import KEEPER, Program, pid_namespace

log = logging.getLogger(__name__)

PRIVATE_FOLDER, PRIVATE_FILE, SHARED_FILE = 0o700, 0o600, 0o660
LONGEST_SOCKET_PATH = 100
OPEN_FOLDERS = Path("/proc/self/fd")
STARTING = "starting"
"""The id of a keeper that does not listen yet, as the program writes it that starts it."""
MOST_DEATHS, DEATHS_WITHIN = 3, 60.0
"""Keepers that may die in so many seconds before a program holds the line itself."""
LONGEST_LOCK = 1 << 14
"""Bytes of a lock file that are read; ours hold some hundred, and some ten for each stop."""


class Owner(msgspec.Struct, frozen=True):
    """Entry of the owner in its lock file."""

    version: Number
    program: Program
    socket: Text
    """Address of its socket; empty before it listens and after it ended."""
    quiet_until: MonotonicTime = 0.0
    """Monotonic time until which a reply to the previous owner may come."""
    stopped: StopTimes = {}
    """When each device was stopped recently (monotonic)."""
    line: Text = ""
    """The line with its actual settings, while its owner listens."""
    deaths: Annotated[tuple[MonotonicTime, ...], Meta(max_length=MOST_DEATHS)] = ()
    """Recent deaths of keepers of the line (monotonic)."""

    @property
    def is_dead(self) -> bool:
        """True for a keeper whose lock is free, though it has not given it back."""
        return self.program.name == KEEPER and bool(self.socket or self.program.id == STARTING)

    @property
    def starts(self) -> bool:
        """True for a keeper that does not listen yet."""
        return self.program.name == KEEPER and not self.socket and not has_ended(self.program)


def file_name_of(key: str) -> str:
    """Return a file name for the key of a line: a readable part, and a unique digest."""
    readable = re.sub(r"[^A-Za-z0-9]+", "-", key).strip("-")[-24:]
    return f"{readable}-{hashlib.sha256(key.encode()).hexdigest()[:12]}"


@dataclass(frozen=True, slots=True)
class SharePlace:
    """The meeting place of one line."""

    key: str
    """The line without its spelling."""
    lock_folder: Path
    socket_folders: tuple[Path, ...]
    """Folders for the socket, the best first."""
    group: int | None = None
    """The group of users that may attach; None for this user alone."""

    @property
    def name(self) -> str:
        """The name of the line's files."""
        return file_name_of(self.key)

    @property
    def lock_path(self) -> Path:
        """The file whose lock decides about the owner."""
        return self.lock_folder / f"{self.name}.lock"


def make_private(folder: Path, *, shared: bool = False) -> None:
    """Make a folder for this user alone. Raises OSError, PermissionError where it is another's."""
    folder.mkdir(mode=PRIVATE_FOLDER, parents=True, exist_ok=True)
    found = folder.stat()
    if shared:
        return
    if found.st_uid != os.getuid():
        raise PermissionError(f"{folder} belongs to another user")
    if stat.S_IMODE(found.st_mode) & 0o077:
        folder.chmod(PRIVATE_FOLDER)


class OwnerLock:
    """The lock of one line; its holder owns the line. Given back by the system at exit."""

    def __init__(self, place: SharePlace) -> None:
        self._place = place
        self._file: IO[bytes] | None = None
        self.deaths: tuple[float, ...] = ()
        """Recent deaths of keepers of the line, by the lock file."""

    @property
    def held(self) -> bool:
        """True if this program owns the line."""
        return self._file is not None

    def take(self) -> bool:
        """Try to own the line; True on success. Raises OSError."""
        import fcntl

        if self._file is not None:
            return True
        path = self._place.lock_path
        shared = self._place.group is not None
        make_private(path.parent, shared=shared)
        descriptor = os.open(
            path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, SHARED_FILE if shared else PRIVATE_FILE
        )
        file = os.fdopen(descriptor, "r+b", buffering=0)
        try:
            if shared:
                with suppress(PermissionError):
                    os.fchown(descriptor, -1, self._place.group or -1)
                    os.fchmod(descriptor, SHARED_FILE)
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # a file that was removed in the meantime excludes no program
            if os.fstat(descriptor).st_ino != path.stat().st_ino:
                raise BlockingIOError
        except (BlockingIOError, FileNotFoundError):
            file.close()
            return False
        except BaseException:
            file.close()
            raise
        self._file = file
        self._learn_deaths()
        return True

    def _learn_deaths(self) -> None:
        before = owner_of(self._place)
        if before is not None:
            now, died = monotonic(), before.is_dead
            recent = [death for death in before.deaths if now - death < DEATHS_WITHIN]
            self.deaths = (*recent, *([now] if died else ()))[-MOST_DEATHS:]

    @property
    def descriptor(self) -> int:
        """The open lock file; the process that inherits it holds the lock, too."""
        assert self._file is not None
        return self._file.fileno()

    def adopt(self, descriptor: int) -> None:
        """Hold the lock by a file that was inherited."""
        self._file = os.fdopen(descriptor, "r+b", buffering=0)
        before = owner_of(self._place)
        self.deaths = before.deaths if before is not None else ()

    def hand_over(self) -> None:
        """Leave the lock to the process that has inherited it."""
        if self._file is not None:
            self._file.close()
            self._file = None

    def tell(self, owner: Owner) -> None:
        """Record the owner of the line and its socket."""
        if self._file is not None:
            data = msgspec.json.encode(msgspec.structs.replace(owner, deaths=self.deaths))
            os.pwrite(self._file.fileno(), data, 0)
            os.ftruncate(self._file.fileno(), len(data))

    @property
    def stands(self) -> bool:
        """True if the lock file is still the one that other programs would lock."""
        if self._file is None:
            return False
        try:
            return os.fstat(self._file.fileno()).st_ino == self._place.lock_path.stat().st_ino
        except OSError:
            return False

    def renew(self) -> bool:
        """Lock the present file, if the previous one was removed.

        Returns False if another program was first. Raises OSError.
        """
        before, self._file = self._file, None
        try:
            taken = self.take()
        finally:
            if self._file is None:
                self._file = before
            elif before is not None:
                before.close()
        return taken

    def give_back(self, last: Owner | None = None) -> None:
        """Release the line; `last` is the information for the next owner."""
        if self._file is not None:
            with suppress(OSError):
                os.ftruncate(self._file.fileno(), 0)
                if last is not None:
                    self.tell(last)
            self._file.close()
            self._file = None


def owner_of(place: SharePlace) -> Owner | None:
    """Return the owner of a line from its lock file; None if that is empty or not understood."""
    return owner_of_lock(place.lock_path)


def owner_of_lock(path: Path) -> Owner | None:
    """The same, by the path of the lock file."""
    try:
        with path.open("rb") as file:
            return msgspec.json.decode(file.read(LONGEST_LOCK), type=Owner)
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError):
        return None


def is_locked(path: Path) -> bool:
    """True while a process holds the lock in a file."""
    import fcntl

    try:
        with path.open("rb") as file:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    return False


@contextmanager
def short_path(path: Path) -> Iterator[str]:
    """A path to a socket that the system takes: it keeps little more than a hundred bytes for one.

    A longer one leads through the open folder, where the system shows those. Raises OSError.
    """
    if len(os.fsencode(path)) <= LONGEST_SOCKET_PATH or not OPEN_FOLDERS.is_dir():
        yield str(path)
        return
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        yield str(OPEN_FOLDERS / str(folder) / path.name)
    finally:
        os.close(folder)


def reached(path: Path, within: float) -> socket.socket:
    """A connection to a holder's socket; each step of its use takes `within` seconds at most.

    Raises OSError, ValueError.
    """
    connection = socket.socket(socket.AF_UNIX)
    try:
        connection.settimeout(within)
        with short_path(path) as address:
            connection.connect(address)
    except BaseException:
        connection.close()
        raise
    return connection


def has_ended(program: Program) -> bool:
    """Return True if a program of this computer has surely ended; in doubt it lives."""
    if program.process[0] != pid_namespace():
        return False
    try:
        os.kill(program.pid, 0)
    except ProcessLookupError:
        return True
    except (OSError, OverflowError):
        return False
    return False


class Peer(NamedTuple):
    """The process at the other end of a local socket."""

    pid: int
    """0 for one in another PID namespace."""
    user: int


def peer_of(connection: socket.socket) -> Peer | None:
    """The process at the other end of a local socket; None if the system does not report it."""
    try:
        found = connection.getsockopt(socket.SOL_SOCKET, socket.SO_PEERCRED, struct.calcsize("3i"))
    except (AttributeError, OSError):
        return None
    pid, user, _ = struct.unpack("3i", found)
    return Peer(max(0, pid), user)
