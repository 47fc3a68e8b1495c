"""Endpoints of a simulated line: pseudo-terminal, TCP; and their common part.

Each endpoint has a thread that waits for bytes and for the next action of its conversation, with
the resolution of `select`, not of an event loop's timers.
"""

from __future__ import annotations

import contextlib
import math
import os
import select
import socket
import tempfile
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from ..errors import SimulatorError
from ..spec import LineTiming
from .client_settings import ClientSettings, set_up_terminal, settings_of_terminal
from .conversation import Conversation

STREAM_PAUSE = 0.005
"""Longest pause in s between two reads of an opened port without data."""


class ByteStream(Protocol):
    """Open port of the caller: reads with a short timeout, writes, closes."""

    def read(self, size: int, /) -> bytes:
        """Return up to `size` bytes; b"" after the timeout."""

    def write(self, data: bytes, /) -> int | None:
        """Write all bytes."""

    def close(self) -> None:
        """Close the port."""


CHUNK = 4096


class Endpoint(ABC):
    """Endpoint of the line, with a thread of its own while it is plugged in."""

    def __init__(self, name: str, converse: Callable[[], Conversation]) -> None:
        self._name = name
        self._converse = converse
        self._thread: threading.Thread | None = None
        self._stopping = threading.Event()

    def plug(self) -> None:
        """Open it and start its thread; does nothing if it is plugged in already."""
        if self._thread is not None:
            return
        self._stopping.clear()
        self._open()
        self._thread = threading.Thread(target=self._work, name=self._name, daemon=True)
        self._thread.start()

    def unplug(self) -> None:
        """Stop its thread and close it, so that the other side notices."""
        if self._thread is None:
            return
        self._stopping.set()
        self._wake()
        self._thread.join()
        self._thread = None
        self._shut()

    @abstractmethod
    def _open(self) -> None: ...

    @abstractmethod
    def _work(self) -> None: ...

    @abstractmethod
    def _wake(self) -> None: ...

    @abstractmethod
    def _shut(self) -> None: ...


class StreamEndpoint(Endpoint):
    """Port that the caller opened; it is closed at the end, and cannot be plugged in again."""

    def __init__(self, converse: Callable[[], Conversation], stream: ByteStream) -> None:
        super().__init__("simulated line, port", converse)
        self._stream = stream
        self.error: OSError | None = None
        """Error that ended the port, if any."""

    def _open(self) -> None:
        return

    def _work(self) -> None:
        conversation = self._converse()
        try:
            while not self._stopping.is_set():
                if data := self._stream.read(CHUNK):
                    conversation.feed(data, time.monotonic())
                else:
                    time.sleep(wait_time(conversation, STREAM_PAUSE) or 0.0)
                if out := conversation.poll(time.monotonic()):
                    self._stream.write(out)
        except OSError as error:
            self.error = error

    def _wake(self) -> None:
        return

    def _shut(self) -> None:
        self._stream.close()


def wait_time(conversation: Conversation, longest: float | None) -> float | None:
    """Return how long an endpoint may wait for bytes, in s."""
    due = conversation.due
    if due is None:
        return longest
    wait = max(0.0, due - time.monotonic())
    return wait if longest is None else min(wait, longest)


class PtyEndpoint(Endpoint):
    """Pseudo-terminal; a client opens the line at `path`.

    `converse` receives a function that reads the client's settings, or None if the settings do not
    matter. The terminal begins with the settings of `timing`, for clients that set nothing.
    """

    def __init__(
        self,
        converse: Callable[[Callable[[], ClientSettings] | None], Conversation],
        link: str | None,
        timing: LineTiming,
        *,
        any_settings: bool = False,
    ) -> None:
        super().__init__("simulated line, pseudo-terminal", lambda: converse(self._look()))
        self._timing = timing
        self._any_settings = any_settings
        # the system reuses the number of a pseudo-terminal as soon as it is unplugged
        self._folder = None if link else Path(tempfile.mkdtemp(prefix="drivepanel-"))
        self._link = Path(link) if link else Path(f"{self._folder}/line")
        self._master = self._slave = -1
        self._pipe = (-1, -1)
        self._seen = False
        """True if the terminal's settings are known."""
        self.path = ""
        """Path of the link to the slave side; constant over all plugs and unplugs."""

    def _open(self) -> None:
        try:
            import termios  # noqa: F401  (absent on Windows)
            import tty
        except ImportError:
            raise SimulatorError(
                "This system has no pseudo-terminals; serve the line over TCP instead."
            ) from None
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self._seen = set_up_terminal(self._slave, self._timing)
        os.set_blocking(self._master, False)
        self._pipe = os.pipe()
        self._make_link(self._link, os.ttyname(self._slave))
        self.path = str(self._link)

    def _look(self) -> Callable[[], ClientSettings] | None:
        if self._any_settings or not self._seen:
            return None
        slave = self._slave
        return lambda: settings_of_terminal(slave)

    def _make_link(self, link: Path, device: str) -> None:
        if self._folder is not None:
            self._folder.mkdir(mode=0o700, exist_ok=True)
        if link.exists() and not link.is_symlink():
            self._shut()
            raise SimulatorError(f"{link} exists and is not a link; choose another path.")
        link.unlink(missing_ok=True)
        link.symlink_to(device)

    def _work(self) -> None:
        conversation = self._converse()
        while not self._stopping.is_set():
            ready = select.select(
                [self._master, self._pipe[0]], [], [], wait_time(conversation, None)
            )[0]
            if self._master in ready:
                with contextlib.suppress(BlockingIOError):
                    conversation.feed(os.read(self._master, CHUNK), time.monotonic())
            if out := conversation.poll(time.monotonic()):
                # A full terminal loses bytes, as a line does whose master does not read.
                with contextlib.suppress(BlockingIOError):
                    os.write(self._master, out)

    def _wake(self) -> None:
        os.write(self._pipe[1], b"x")

    def _shut(self) -> None:
        if self._link.is_symlink():
            self._link.unlink()
        if self._folder is not None:
            with contextlib.suppress(OSError):
                self._folder.rmdir()
        for handle in (self._master, self._slave, *self._pipe):
            if handle >= 0:
                os.close(handle)
        self._master = self._slave = -1
        self._pipe = (-1, -1)


class TcpEndpoint(Endpoint):
    """TCP port; each connection has a conversation of its own.

    A connection without bytes from its client for `idle_close` seconds is closed.
    """

    def __init__(
        self,
        converse: Callable[[], Conversation],
        host: str,
        port: int,
        idle_close: float = math.inf,
    ) -> None:
        super().__init__("simulated line, TCP", converse)
        self._idle_close = idle_close
        self._host = host
        self._port = port
        self._listener: socket.socket | None = None
        self._bell: tuple[socket.socket, socket.socket] | None = None
        self._talks: dict[socket.socket, Conversation] = {}
        self._heard: dict[socket.socket, float] = {}

    @property
    def address(self) -> tuple[str, int]:
        """Host and port of the listening socket."""
        return self._host, self._port

    def _open(self) -> None:
        family = socket.AF_INET6 if ":" in self._host else socket.AF_INET
        try:
            self._listener = socket.create_server((self._host, self._port), family=family)
        except OSError as error:
            raise SimulatorError(
                f"Nothing can be served at {self._host}:{self._port}: {error.strerror}."
            ) from error
        self._port = self._listener.getsockname()[1]
        self._bell = socket.socketpair()

    def _work(self) -> None:
        assert self._listener is not None
        assert self._bell is not None
        while not self._stopping.is_set():
            waits = [w for t in self._talks.values() if (w := wait_time(t, None)) is not None]
            closes = min(self._heard.values(), default=math.inf) + self._idle_close
            if closes < math.inf:
                waits.append(max(0.0, closes - time.monotonic()))
            watched = [self._listener, self._bell[0], *self._talks]
            ready = select.select(watched, [], [], min(waits, default=None))[0]
            if self._listener in ready:
                self._accept(self._listener)
            for connection in [c for c in self._talks if c in ready]:
                self._read(connection)
            for connection in list(self._talks):
                self._write(connection)
            limit = time.monotonic() - self._idle_close
            for connection in [c for c, heard in self._heard.items() if heard <= limit]:
                self._drop(connection)

    def _accept(self, listener: socket.socket) -> None:
        try:
            connection, _ = listener.accept()
        except OSError:
            return  # The client disconnected before it was served.
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection.settimeout(1.0)
        self._talks[connection] = self._converse()
        self._heard[connection] = time.monotonic()

    def _read(self, connection: socket.socket) -> None:
        conversation = self._talks[connection]
        try:
            data = connection.recv(CHUNK)
        except OSError:
            data = b""
        if data:
            self._heard[connection] = time.monotonic()
            conversation.feed(data, self._heard[connection])
        if not data or getattr(conversation, "broken", False):
            self._drop(connection)

    def _write(self, connection: socket.socket) -> None:
        if out := self._talks[connection].poll(time.monotonic()):
            try:
                connection.sendall(out)
            except OSError:
                self._drop(connection)

    def _drop(self, connection: socket.socket) -> None:
        del self._talks[connection], self._heard[connection]
        connection.close()

    def _wake(self) -> None:
        if self._bell is not None:
            self._bell[1].send(b"x")

    def _shut(self) -> None:
        for connection in list(self._talks):
            self._drop(connection)
        for item in (self._listener, *(self._bell or ())):
            if item is not None:
                item.close()
        self._listener = self._bell = None
