"""A serial port that is only listened to: opened for reading, so that the system lets nobody write.

It sends no break, and waits for no output; POSIX only. Modem lines are left as opening the port
leaves them: on some adapters they decide who may speak.
"""

from __future__ import annotations

import os
import select
import struct
import sys
from contextlib import suppress

from ..errors import LineLost, PortRefused
from .ports import is_pseudo_terminal, other_openers, port_error

READ_AT_ONCE = 4096
"""Bytes of one reading at most."""
_TIOCGSERIAL, _TIOCSSERIAL, _LOW_LATENCY, _SERIAL_FIELDS = 0x541E, 0x541F, 0x2000, 32
_FLAGS = 4


class ListeningPort:
    """A port that is open for reading, for this program alone."""

    def __init__(self, path: str, descriptor: int) -> None:
        self.path = path
        self._descriptor = descriptor

    def read(self, wait: float) -> bytes:
        """Bytes that have come; empty where none do within `wait` seconds. Raises LineLost."""
        if not select.select([self._descriptor], [], [], max(0.0, wait))[0]:
            return b""
        try:
            data = os.read(self._descriptor, READ_AT_ONCE)
        except (BlockingIOError, InterruptedError):
            return b""
        except OSError as error:
            reason = error.strerror or str(error)
            raise LineLost(f"{self.path} disappeared ({reason}).") from error
        if not data:
            raise LineLost(f"{self.path} disappeared.")
        return data

    def close(self) -> None:
        """Give the port back; may be called twice."""
        if self._descriptor >= 0:
            os.close(self._descriptor)
            self._descriptor = -1


def open_listening(path: str, baud: int, format_: str) -> ListeningPort:
    """Open a port to listen, raw, with the settings of the line.

    A pseudo-terminal has no parity and is opened without. Raises PortBusy, PortMissing,
    PortRefused.
    """
    if os.name != "posix":
        raise PortRefused(path, "listening needs a port of a POSIX system.")
    import fcntl

    descriptor = -1
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC)
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        _set_up(descriptor, path, baud, format_)
    except Exception as error:
        if descriptor >= 0:
            os.close(descriptor)
        # termios.error is no OSError
        if isinstance(error, OSError) or type(error).__name__ == "error":
            raise port_error(path, baud, format_, error) from error
        raise
    return ListeningPort(path, descriptor)


def others_at(path: str) -> str:
    """Programs that have the same port open, and take each other's bytes; empty for none.

    Both ends of a pseudo-terminal are programs: there it is not asked.
    """
    return "" if is_pseudo_terminal(path) else other_openers(path)


def _set_up(descriptor: int, path: str, baud: int, format_: str) -> None:
    """Raw, at this rate and format, at once. Raises PortRefused, OSError, termios.error."""
    import termios

    speed = getattr(termios, f"B{baud}", None)
    if speed is None:
        raise PortRefused(path, f"it does not support {baud} baud.")
    parity = "N" if is_pseudo_terminal(path) else format_[1]
    control = termios.CREAD | termios.CLOCAL | termios.CS8
    if parity != "N":
        control |= termios.PARENB | (termios.PARODD if parity == "O" else 0)
    if format_[2] == "2":
        control |= termios.CSTOPB
    characters = termios.tcgetattr(descriptor)[6]
    characters[termios.VMIN], characters[termios.VTIME] = 1, 0
    settings = [termios.IGNBRK, 0, control, 0, speed, speed, characters]
    termios.tcsetattr(descriptor, termios.TCSANOW, settings)
    if parity != "N" and not termios.tcgetattr(descriptor)[2] & termios.PARENB:
        raise PortRefused(path, f"it does not support parity {parity}.")
    if sys.platform.startswith("linux"):
        _hand_over_at_once(descriptor)


def _hand_over_at_once(descriptor: int) -> None:
    """Ask the adapter not to collect bytes for 16 ms; not every driver knows that."""
    import fcntl

    fields = struct.Struct(f"{_SERIAL_FIELDS}i")
    with suppress(OSError):
        reported = list(fields.unpack(fcntl.ioctl(descriptor, _TIOCGSERIAL, bytes(fields.size))))
        reported[_FLAGS] |= _LOW_LATENCY
        fcntl.ioctl(descriptor, _TIOCSSERIAL, fields.pack(*reported))
