"""A program on a pseudo-terminal: what it writes, when, what its picture says, what it uses."""

from __future__ import annotations

import codecs
import fcntl
import os
import pty
import random
import re
import signal
import struct
import sys
import termios
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from itertools import zip_longest
from pathlib import Path
from queue import Empty, Queue
from statistics import median
from typing import Any

from benchmarks.wire import share
from tests.limits import BURST_GAP

CHUNK = 65536
SLOW_CHUNK = 100
"""Bytes taken at once where the terminal is slow; small against a picture."""
SWITCH = 0.0005
"""Seconds after which a thread of the benchmark gives way to another one."""
LONGEST = 8.0
"""Seconds after which a key counts as lost."""
MOST_LOST = 10
"""Lost keys after which no more are pressed."""
GAPS = (BURST_GAP + 0.01, BURST_GAP + 0.06)
"""Shortest and longest time in s from a picture to the next key: a sooner one is part of a burst,
in which the panel ignores keys, and no person presses it."""
TOKEN = re.compile(
    r"\x1b\[(?P<arguments>[0-9;:<=>?]*)[ -/]*(?P<final>[@-~])"
    r"|\x1b[\]P_^][^\x07\x1b]*(?:\x07|\x1b\\)"
    r"|\x1b[()][0-9A-Z]"
    r"|\x1b[^\[\]P_^()]"
    r"|(?P<control>[\x00-\x1a\x1c-\x1f])"
    r"|(?P<text>[^\x00-\x1f]+)"
)


Figures = dict[str, Any]


class NotShown(Exception):
    """The expected output did not reach the terminal."""


class Picture:
    """Picture of a terminal: the part of its language that these programs use, no colors."""

    def __init__(self, columns: int, rows: int) -> None:
        self._columns, self._rows = columns, rows
        self._cells = [[" "] * columns for _ in range(rows)]
        self._x = self._y = 0
        self._decode = codecs.getincrementaldecoder("utf-8")("replace").decode
        self._rest = ""
        self.answers: list[str] = []
        """Reply that a terminal owes the program: the cursor position, for each request."""

    def feed(self, data: bytes) -> None:
        """Take what the program wrote; a sequence may come in pieces."""
        text = self._rest + self._decode(data)
        at = 0
        while found := TOKEN.match(text, at):
            at = found.end()
            if found["text"]:
                self._write(found["text"])
            elif found["final"]:
                self._control(found["final"], found["arguments"])
            elif found["control"]:
                self._move_by_control(found["control"])
        self._rest = text[at:]

    def row(self, y: int) -> str:
        """The text of a row."""
        return "".join(self._cells[y])

    def text(self) -> str:
        """All rows, one below the other."""
        return "\n".join("".join(cells) for cells in self._cells)

    def _write(self, text: str) -> None:
        for character in text:
            if self._x >= self._columns:
                self._x, self._y = 0, min(self._y + 1, self._rows - 1)
            self._cells[self._y][self._x] = character
            self._x += 1

    def _move_by_control(self, control: str) -> None:
        if control == "\r":
            self._x = 0
        elif control == "\n":
            self._y = min(self._y + 1, self._rows - 1)
        elif control == "\b":
            self._x = max(0, self._x - 1)

    def _control(self, final: str, arguments: str) -> None:
        """Moves and erasures; everything else changes no text."""
        if arguments[:1] in ("?", "<", "=", ">"):
            return
        numbers = [int(part or 0) for part in re.split("[;:]", arguments)]
        count = max(1, numbers[0])
        if final in "Hf":
            column = numbers[1] if len(numbers) > 1 else 1
            self._go(column - 1, count - 1)
        elif final == "G":
            self._go(count - 1, self._y)
        elif final == "d":
            self._go(self._x, count - 1)
        elif final in "ABCD":
            step = {"A": (0, -1), "B": (0, 1), "C": (1, 0), "D": (-1, 0)}[final]
            self._go(self._x + step[0] * count, self._y + step[1] * count)
        elif final == "b":
            self._write(self._cells[self._y][max(0, self._x - 1)] * count)
        elif final in "JKX":
            self._erase(final, numbers[0])
        elif final == "n" and numbers[0] == 6:
            x = min(self._x, self._columns - 1)
            self.answers.append(f"\x1b[{self._y + 1};{x + 1}R")

    def _go(self, x: int, y: int) -> None:
        self._x = max(0, min(x, self._columns - 1))
        self._y = max(0, min(y, self._rows - 1))

    def _erase(self, final: str, number: int) -> None:
        """Erase the screen or a line, before the cursor, behind it or wholly."""
        here = self._y * self._columns + min(self._x, self._columns - 1)
        first, last = {
            "J": (0, self._rows * self._columns),
            "K": (self._y * self._columns, (self._y + 1) * self._columns),
            "X": (here, here + max(1, number)),
        }[final]
        if final != "X" and number == 0:
            first = here
        elif final != "X" and number == 1:
            last = here + 1
        for cell in range(first, min(last, self._rows * self._columns)):
            self._cells[cell // self._columns][cell % self._columns] = " "


@dataclass(frozen=True, slots=True)
class Usage:
    """Resources used by a process: CPU time in s, memory in bytes."""

    cpu: float
    memory: int


class Terminal:
    """A program on a pseudo-terminal of its own, read as fast as it writes or at a set rate.

    `rate` is in bytes a second. Bytes count as come once a line of that rate has carried them.
    """

    def __init__(
        self,
        command: Sequence[str],
        size: tuple[int, int],
        folder: Path,
        environment: Mapping[str, str],
        rate: float | None = None,
    ) -> None:
        self.picture = Picture(*size)
        self.written = 0
        self._come: Queue[tuple[float, bytes]] = Queue()
        # the reader must not wait for the picture to be brought up to date
        sys.setswitchinterval(SWITCH)
        self.started = time.monotonic()
        self.process, self._terminal = pty.fork()
        if self.process == 0:
            self._become(command, size, folder, environment)
        self._reader = threading.Thread(target=self._read, args=(rate,), daemon=True)
        self._reader.start()

    def _read(self, rate: float | None) -> None:
        """Take what the program writes, and note when it had come; ends with the program."""
        free = 0.0
        while True:
            try:
                data = os.read(self._terminal, CHUNK if rate is None else SLOW_CHUNK)
            except OSError:
                data = b""
            if rate is not None:
                free = max(free, time.monotonic()) + len(data) / rate
                time.sleep(max(0.0, free - time.monotonic()))
            self._come.put((time.monotonic(), data))
            if not data:
                return

    @staticmethod
    def _become(
        command: Sequence[str], size: tuple[int, int], folder: Path, environment: Mapping[str, str]
    ) -> None:
        try:
            columns, rows = size
            fcntl.ioctl(0, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
            os.chdir(folder)
            kept = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "LINES")}
            os.execvpe(command[0], list(command), kept | dict(environment))
        finally:
            os._exit(127)  # never back into the benchmark

    def press(self, keys: str) -> float:
        """Type keys; the time just before, of the monotonic clock."""
        pressed = time.monotonic()
        os.write(self._terminal, keys.encode())
        return pressed

    def look(self, within: float) -> float | None:
        """Take what comes next; when it had come, or None if nothing came within so many s."""
        try:
            come, data = self._come.get(timeout=max(within, 0.0))
        except Empty:
            return None
        if not data:
            raise NotShown(f"the program ended: {self.picture.text()}")
        self.written += len(data)
        self.picture.feed(data)
        while self.picture.answers:
            with suppress(OSError):  # the program may have ended since
                os.write(self._terminal, self.picture.answers.pop(0).encode())
        return come

    def wait(self, shown: Callable[[str], bool], within: float = 20.0) -> float:
        """Read until the picture's text is as wanted; when the last byte for that had come."""
        end = time.monotonic() + within
        while (left := end - time.monotonic()) > 0:
            come = self.look(left)
            if come is not None and shown(self.picture.text()):
                return come
        raise NotShown(f"did not come within {within} s:\n{self.picture.text()}")

    def see(self, *words: str) -> float:
        """Read until all these words are on the picture; when the last of them had come."""
        return self.wait(lambda text: all(word in text for word in words))

    def run(self, seconds: float, seen: Callable[[str], None] | None = None) -> None:
        """Read for so long; whatever comes is shown to `seen`."""
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0:
            if self.look(left) is not None and seen is not None:
                seen(self.picture.text())

    def usage(self) -> Usage | None:
        """Resources used by the program so far; None if the system does not report them."""
        place = Path(f"/proc/{self.process}")
        if not place.exists():
            return None
        fields = (place / "stat").read_text().rpartition(")")[2].split()
        cpu = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        pages = int((place / "statm").read_text().split()[1])
        return Usage(cpu, pages * os.sysconf("SC_PAGE_SIZE"))

    def close(self) -> None:
        """End the program, and take the terminal away from it."""
        os.kill(self.process, signal.SIGTERM)
        os.waitpid(self.process, 0)
        self._reader.join()
        os.close(self._terminal)


@dataclass(frozen=True, slots=True)
class Key:
    """A key that changes the picture immediately, and the characters of its text that change."""

    key: str
    signs: Callable[[str], tuple[object, ...]]

    def changed(self, before: tuple[object, ...], text: str) -> bool:
        """Return True if every character has changed or disappeared; blanks do not count."""
        now = self.signs(text)
        if not before or not now:
            return False
        return all(b != a for a, b in zip_longest(before, now[: len(before)]) if a != "")


def steady(
    terminal: Terminal, seconds: float, seen: Callable[[str], None] | None = None
) -> Figures:
    """Bytes, CPU and memory of a program without input."""
    before, written, start = terminal.usage(), terminal.written, time.monotonic()
    terminal.run(seconds, seen)
    after, took = terminal.usage(), time.monotonic() - start
    return {
        "seconds": took,
        "bytes_a_second": (terminal.written - written) / took,
        "cpu_share": (after.cpu - before.cpu) / took if before and after else None,
        "memory_bytes": after.memory if after else None,
    }


def press_often(terminal: Terminal, key: Key, presses: int) -> Figures:
    """Times from a key to the whole picture that it brings, at irregular moments."""
    times: list[float] = []
    count, written = 0, terminal.written
    chance = random.Random(0)
    while count < presses and count - len(times) < MOST_LOST:
        count += 1
        terminal.run(chance.uniform(*GAPS))
        before = key.signs(terminal.picture.text())
        pressed = terminal.press(key.key)
        with suppress(NotShown):
            times.append(terminal.wait(partial(key.changed, before), LONGEST) - pressed)
    size = (terminal.written - written) / max(count, 1)
    return spread(times) | {"presses": count, "lost": count - len(times), "bytes_a_press": size}


def spread(times: Sequence[float]) -> Figures:
    """Median, 95th and 99th percentile and worst of times in s, formatted in ms."""
    found = {"median": median(times) if times else None, "worst": max(times, default=None)}
    found |= {"95": share(times, 0.95), "99": share(times, 0.99)}
    return {f"{name}_ms": None if value is None else value * 1e3 for name, value in found.items()}
