"""Bytes per second that the Monitor screen sends to its terminal, compared with a plain panel.

    python -m tests.ui.bytes_per_second [SECONDS]

Both watch the same simulated, running Altivar 71 in a pseudo-terminal of 80 x 24, at their default
rates. The bytes after their first full picture count.
"""

from __future__ import annotations

import fcntl
import os
import pty
import select
import signal
import struct
import sys
import termios
import time
from dataclasses import dataclass
from pathlib import Path

from tests.answering import read_answering

ROOT = Path(__file__).resolve().parents[2]
SETTLED = 1.5
"""Seconds for the first full picture after the drive's values are on it."""
PATIENCE = 40.0
PANEL = ("-c", "from tests.ui.bytes_per_second import panel; panel()")
PLAIN = ("-m", "tests.ui.plain_panel")


@dataclass(frozen=True, slots=True)
class Measured:
    """Bytes that a program wrote to its terminal, with the seconds."""

    size: int
    seconds: float

    @property
    def rate(self) -> float:
        """Bytes a second."""
        return self.size / self.seconds


def panel() -> None:
    """The panel on one simulated, running drive; it opens Monitor automatically."""
    from tui.app import DrivePanelApp
    from tui.session.connect.open_line import demo_line

    DrivePanelApp(open_line=lambda *_, **__: demo_line({"atv71": 50.0}), start="", device=1).run()


def measure(arguments: tuple[str, ...], ready: bytes, seconds: float) -> Measured:
    """Bytes that a program writes, counted once `ready` was seen and the picture settled."""
    process, terminal = pty.fork()
    if process == 0:
        environment = os.environ | {
            "TERM": "xterm-256color",
            "COLORTERM": "truecolor",
            "PYTHONPATH": str(ROOT),
            "TEXTUAL_ANIMATIONS": "none",
        }
        os.chdir(ROOT)
        os.execve(sys.executable, [sys.executable, *arguments], environment)
    try:
        fcntl.ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", 24, 80, 0, 0))
        os.kill(process, signal.SIGWINCH)
        _read_until(terminal, ready)
        _count(terminal, SETTLED)
        return _count(terminal, seconds)
    finally:
        os.kill(process, signal.SIGTERM)
        os.close(terminal)
        os.waitpid(process, 0)


def _read_until(terminal: int, wanted: bytes) -> None:
    seen = b""
    end = time.monotonic() + PATIENCE
    while wanted not in seen:
        if time.monotonic() > end:
            raise TimeoutError(f"{wanted!r} did not come: {seen[-300:]!r}")
        if select.select([terminal], [], [], 0.2)[0]:
            seen += _read(terminal)


def _read(terminal: int) -> bytes:
    try:
        return read_answering(terminal)
    except OSError as error:
        raise RuntimeError("the program on the terminal ended before its time") from error


def _count(terminal: int, seconds: float) -> Measured:
    start = time.monotonic()
    size = 0
    while (left := start + seconds - time.monotonic()) > 0:
        if select.select([terminal], [], [], left)[0]:
            size += len(_read(terminal))
    return Measured(size, time.monotonic() - start)


def compare(seconds: float) -> tuple[Measured, Measured]:
    """The panel and the plain panel, one after the other."""
    return measure(PANEL, b"FORWARD", seconds), measure(PLAIN, b"Frequency", seconds)


def main() -> None:
    """Print both rates and their ratio."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 20.0
    ours, plain = compare(seconds)
    print(f"Monitor, 80 x 24:  {ours.rate:8.0f} B/s over {ours.seconds:.1f} s")
    print(f"plain panel:       {plain.rate:8.0f} B/s over {plain.seconds:.1f} s")
    print(f"ratio:             {ours.rate / plain.rate:8.3f}")


if __name__ == "__main__":
    main()
