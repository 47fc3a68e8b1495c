"""Scripted peers of a line: they answer late, twice, damaged or not at all, or disconnect."""

from __future__ import annotations

import os
import pty
import select
import socket
import tempfile
import threading
import time
import tty
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Self

from tui.wire.frames import frame

Step = bytes | float
"""Bytes to send, or seconds to wait before the next step."""
Script = Callable[[bytes, int], Sequence[Step]]
"""Reaction to a request, given its bytes and the number of earlier requests."""


def honest_pdu(pdu: bytes) -> bytes:
    """Correct reply of a drive whose every register contains its own address.

    Of its coils and inputs, every second eight are set.
    """
    address, count = int.from_bytes(pdu[1:3], "big"), int.from_bytes(pdu[3:5], "big")
    match pdu[0]:
        case 1 | 2:
            bits = (n // 8 & 1 for n in range(address, address + count))
            number = sum(bit << place for place, bit in enumerate(bits))
            data = number.to_bytes((count + 7) // 8, "little")
            return bytes([pdu[0], len(data)]) + data
        case 3 | 23:
            words = (n.to_bytes(2, "big") for n in range(address, address + count))
            return bytes([pdu[0], 2 * count]) + b"".join(words)
        case 43:
            return bytes([43, 14, pdu[2], 1, 0, 0, 1, 0, 4]) + b"none"
        case 17:
            return bytes([17, 6, 9]) + b"none" + b"\xff"
        case _:
            return pdu[:5]


def reply(request: bytes) -> bytes:
    """The right answer to an RTU request."""
    return frame(request[0], honest_pdu(request[1:-2]))


def honest(request: bytes, _count: int) -> Sequence[Step]:
    """Answer every request immediately and correctly, except broadcasts."""
    return [reply(request)] if request[0] else []


def silent(_request: bytes, _count: int) -> Sequence[Step]:
    """Answer nothing."""
    return []


def request_length(data: bytes) -> int:
    """Length of the RTU request that begins with these bytes, 0 if there are too few."""
    fixed = {1: 8, 2: 8, 3: 8, 4: 8, 5: 8, 6: 8, 8: 8, 17: 4, 43: 7}
    counted = {15: 6, 16: 6, 23: 10}
    if len(data) < 2:
        return 0
    if data[1] in fixed:
        return fixed[data[1]]
    at = counted[data[1]]
    return at + 3 + data[at] if len(data) > at else 0


def tcp_request_length(data: bytes) -> int:
    """Length of the Modbus TCP request that begins with these bytes."""
    return 6 + int.from_bytes(data[4:6], "big") if len(data) >= 6 else 0


def tcp_reply(request: bytes, pdu: bytes | None = None, *, transaction: int | None = None) -> bytes:
    """An answer to a Modbus TCP request (default: the correct one)."""
    pdu = honest_pdu(request[7:]) if pdu is None else pdu
    head = request[:2] if transaction is None else transaction.to_bytes(2, "big")
    return head + b"\0\0" + (len(pdu) + 1).to_bytes(2, "big") + request[6:7] + pdu


def eventually(condition: Callable[[], bool], seconds: float = 10.0) -> None:
    """Wait until a condition is true; fail if it stays false."""
    limit = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < limit, "what was waited for did not happen"
        time.sleep(0.002)


class Peer:
    """The other end: a thread that follows a script request by request."""

    def __init__(
        self, script: Script, *, echo: bool = False, length: Callable[[bytes], int] = request_length
    ) -> None:
        self.script = script
        self.echo = echo
        self.requests: list[bytes] = []
        self.arrivals: list[float] = []
        """Time at which each request was complete."""
        self.departures: list[float] = []
        """Just before each sending."""
        self.bursts: list[bytes] = []
        """Bytes of each read, to detect requests that collide."""
        self._length = length
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None

    def __enter__(self) -> Self:
        self._thread = threading.Thread(target=self._work, name="peer", daemon=True)
        self._thread.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stop.set()
        self._close()
        if self._thread is not None:
            self._thread.join()

    def requested(self, device: int) -> list[bytes]:
        """The requests to one device so far."""
        return [request for request in self.requests if request[0] == device]

    @property
    def words_written(self) -> list[tuple[int, int]]:
        """Device and word of each write of one word that arrived."""
        return [(r[0], int.from_bytes(r[4:6], "big")) for r in self.requests if r[1] == 6]

    def await_requests(self, count: int, seconds: float = 5.0) -> None:
        """Wait until this many requests have arrived."""
        eventually(lambda: len(self.requests) >= count, seconds)

    def _read(self) -> bytes | None:
        """Bytes, b'' for none yet, None at the end."""
        raise NotImplementedError

    def _write(self, data: bytes) -> None:
        raise NotImplementedError

    def _close(self) -> None:
        raise NotImplementedError

    def _work(self) -> None:
        pending = b""
        while not self._stop.is_set():
            data = self._read()
            if data is None:
                return
            if not data:
                continue
            self.bursts.append(data)
            if self.echo:
                self._write(data)
            pending += data
            while (length := self._length(pending)) and len(pending) >= length:
                request, pending = pending[:length], pending[length:]
                self.arrivals.append(time.monotonic())
                self.requests.append(request)
                self._act(self.script(request, len(self.requests) - 1))

    def _act(self, steps: Sequence[Step]) -> None:
        for step in steps:
            if isinstance(step, bytes):
                self.departures.append(time.monotonic())
                self._write(step)
            elif self._stop.wait(step):
                return


class PtyPeer(Peer):
    """A peer on a pseudo-terminal, with a symbolic link that is removed with it.

    The number of a pseudo-terminal is reused as soon as it is closed. A line that searches for its
    lost port by number would open that of another test. `link` can be moved to a next peer.
    """

    def __init__(self, script: Script, *, echo: bool = False, link: Path | None = None) -> None:
        super().__init__(script, echo=echo)
        self._master, self._slave = pty.openpty()
        tty.setraw(self._slave)
        self._lock = threading.Lock()
        self._folder = None if link else tempfile.mkdtemp(prefix="peer-")
        self._link = link or Path(f"{self._folder}/line")
        self._link.unlink(missing_ok=True)
        self._device = Path(os.ttyname(self._slave))
        self._link.symlink_to(self._device)
        self.path = str(self._link)

    def send(self, data: bytes) -> None:
        """Send bytes without a request."""
        self._write(data)

    def unplug(self) -> None:
        """Remove the port, like an unplugged adapter."""
        self._stop.set()
        self._close()

    def _read(self) -> bytes | None:
        try:
            if not select.select([self._master], [], [], 0.05)[0]:
                return b""
            return os.read(self._master, 1024)
        except (OSError, ValueError):
            return None

    def _write(self, data: bytes) -> None:
        with suppress(OSError):
            os.write(self._master, data)

    def _close(self) -> None:
        with self._lock:
            if self._master >= 0:
                if self._thread is not None and self._thread is not threading.current_thread():
                    # the thread leaves the descriptor first, so that its number is not reused
                    self._stop.set()
                    self._thread.join()
                if self._link.is_symlink() and self._link.readlink() == self._device:
                    self._link.unlink()
                if self._folder is not None:
                    os.rmdir(self._folder)
                os.close(self._slave)
                os.close(self._master)
                self._master = self._slave = -1


class TcpPeer(Peer):
    """A peer behind a loopback port; RTU bytes, or Modbus TCP with `length` given."""

    def __init__(
        self, script: Script, *, length: Callable[[bytes], int] = request_length, port: int = 0
    ) -> None:
        super().__init__(script, length=length)
        self._listener = socket.create_server(("127.0.0.1", port))
        self._listener.settimeout(0.05)
        self.port: int = self._listener.getsockname()[1]
        self._client: socket.socket | None = None

    def _read(self) -> bytes | None:
        try:
            if self._client is None:
                self._client, _ = self._listener.accept()
                self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                self._client.settimeout(0.05)
            data = self._client.recv(4096)
        except TimeoutError:
            return b""
        except OSError:
            data = b""
        if not data:
            self.hang_up()
        return data

    def _write(self, data: bytes) -> None:
        if self._client is not None:
            with suppress(OSError):
                self._client.sendall(data)

    def hang_up(self) -> None:
        """Close the connection; the next one is accepted."""
        client, self._client = self._client, None
        if client is not None:
            client.close()

    def _close(self) -> None:
        if self._thread is not None:
            self._thread.join()
        self.hang_up()
        self._listener.close()
