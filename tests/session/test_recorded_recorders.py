"""Turns of a recorder as text: the calls of its files, its reports, and the rows that are left.

The time is the test's, and the recorder's thread waits for it. `recorded_recorders.txt` has a
section for each subject.
"""

from __future__ import annotations

import errno
import os
import re
import sqlite3
import tempfile
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, closing, contextmanager
from functools import partial
from itertools import product
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest.mock import patch

import pytest

import tui
from tests.recorded import sections
from tui.bus.model import EndedExchange
from tui.session.record import record_file, recorder, ring
from tui.session.record.record_file import RecordFile
from tui.session.record.recorder import LineRecorder
from tui.session.record.ring import make_room, record_path
from tui.session.record.schema import EventRow, RecordDamaged, RecordHeld, ReplyRow

TEXTS = Path(__file__).parent / "recorded_recorders.txt"
DAY = 20_000
MIDNIGHT = (DAY + 1) * 86_400.0
LOGGED = ("write", "flush", "expire", "end_window", "give_back", "close", "shed", "trim", "abandon")
"""Methods of a file whose calls are logged."""


class Steps:
    """The time of a recorder, whose thread makes a turn when the test lets it."""

    def __init__(self, folder: Path, wall: float) -> None:
        self.folder = folder
        self.now = 5000.0
        self.offset = wall - self.now
        self.log: list[str] = []
        self.fails: Callable[[RecordFile], Exception | None] = lambda file: None
        """Returns why a write to a file fails."""
        self.expiring_takes = 0.0
        self._goes, self._waits = threading.Semaphore(0), threading.Semaphore(0)

    def wait(self, timeout: float) -> None:
        """In the recorder's thread: wait for its next turn."""
        self.now += timeout
        self._waits.release()
        self._goes.acquire()

    def set(self) -> None:
        """Let the thread make its last turn."""
        self._goes.release()

    def begun(self) -> None:
        """Wait until the thread waits for its first turn."""
        assert self._waits.acquire(timeout=20)

    def turn(self, count: int = 1) -> None:
        for _ in range(count):
            self._goes.release()
            self.begun()

    def say(self, text: str) -> None:
        self.log.append(f"{self.now - 5000:.1f} {text.replace(str(self.folder), '')}")

    def exchange(self, word: int, **more: Any) -> EndedExchange:
        """A read that ends now."""
        reply = b"\3\2" + word.to_bytes(2, "big")
        wall = self.now + self.offset
        ended = EndedExchange(4, b"\3\0\x64\0\1", "reply", reply, self.now - 0.02, self.now, wall)
        return ended._replace(**more)

    def event(self, kind: str, text: str, device: int | None = 4) -> EventRow:
        return EventRow(round((self.now + self.offset) * 1e6), round(self.now * 1e6), device, kind,
                        text, "panel")  # fmt: skip


def short(argument: object) -> str:
    """An argument of a call; of rows only their number."""
    return str(len(argument)) if isinstance(argument, list | tuple) else f"{argument}"


def logged(steps: Steps) -> type[RecordFile]:
    """The class of files, which logs the calls of its methods."""

    def method(name: str) -> Callable[..., Any]:
        plain = getattr(RecordFile, name)

        def call(self: RecordFile, *args: Any, **named: Any) -> Any:
            error = steps.fails(self) if name == "write" else None
            found = None if error else plain(self, *args, **named)
            shown = [*map(short, args), *(f"{key}={value}" for key, value in named.items())]
            steps.say(f"{self.path.name} {name}({', '.join(shown)}): {error or found}")
            if name == "expire":
                steps.now += steps.expiring_takes
            if error is not None:
                raise error
            return found

        return call

    return type("LoggedFile", (RecordFile,), {name: method(name) for name in LOGGED})


@contextmanager
def stepped(wall: float = MIDNIGHT - 30, **changes: Any) -> Iterator[Steps]:
    """The time of recorders; `changes` are constants of the module."""
    with tempfile.TemporaryDirectory() as name, ExitStack() as stack:
        steps = Steps(Path(name), wall)
        now = SimpleNamespace(time=lambda: steps.now + steps.offset, monotonic=lambda: steps.now)
        for module in (recorder, record_file, ring):
            stack.enter_context(patch.object(module, "time", now))
        threads = SimpleNamespace(Event=lambda: steps, Thread=threading.Thread, Lock=threading.Lock)
        stack.enter_context(patch.object(recorder, "threading", threads))
        stack.enter_context(patch.object(record_file, "boot_id", lambda: "boot"))
        stack.enter_context(patch.object(record_file, "RecordFile", logged(steps)))
        for constant, value in changes.items():
            stack.enter_context(patch.object(recorder, constant, value))
        yield steps


def begin(steps: Steps, **options: Any) -> LineRecorder:
    names = {"id": "panel (12)"}
    return LineRecorder(
        steps.folder, "serial:x", "line-1", program="keeper", name_of=lambda id: names.get(id, "?"),
        report=lambda text: steps.say(f"REPORT {text}"), **options,
    )  # fmt: skip


def state(record: LineRecorder) -> str:
    return f"waiting {record.waiting}, lost {record.lost}, trouble {record.trouble!r}"


def rows_of(path: Path) -> Iterator[str]:
    """All rows of a file; of many alike the first and the last ones."""
    with closing(sqlite3.connect(path)) as base:
        for table in ("about", "session", "who", "event", "reply", "reduced"):
            rows = base.execute(f"SELECT * FROM {table}").fetchall()
            shown = rows if len(rows) < 9 else rows[:4] + rows[-4:]
            yield f"{path.name} {table}: {len(rows)}"
            for row in shown:
                texts = (part.hex() if isinstance(part, bytes) else str(part) for part in row)
                yield f"  {' '.join(texts)}".replace(tui.__version__, "VERSION")
        names = ("auto_vacuum", "journal_mode", "application_id", "user_version", "freelist_count")
        yield f"  {[base.execute(f'PRAGMA {name}').fetchone()[0] for name in names]}"


def days() -> Iterator[str]:
    """A line from the evening to the next one: events, exchanges, an hour without any."""
    with stepped() as steps:
        record = begin(steps)
        for number in range(104):
            record.note(steps.event("notice", f"before {number}"))
        record.note(steps.event("profile", "atv71"))
        record.note(steps.event("block", "places", 5))
        yield state(record)
        record.note(steps.exchange(0, program="id", strays=(b"\5\3\2\0\1\0\0",)))
        record.note(steps.exchange(0, request=b"", strays=(b"\6\3\2\0\1\0\0", b"\7\1\1")))
        record.note(steps.exchange(1, result="nothing", reply=b"", repeat=2, program="other"))
        steps.begun()
        yield state(record)
        for number in range(140):
            if number % 2:
                record.note(steps.exchange(number // 20))
            if number == 100:
                record.note(steps.event("profile", "atv312"))
            steps.turn()
        record.note(steps.event("line settings", "x", None))
        steps.offset += 1.5
        record.note(steps.exchange(9))
        record.note(steps.exchange(10))
        steps.turn(2)
        steps.now += 3590
        steps.turn(8)
        steps.expiring_takes = 0.3
        steps.now += 20
        steps.turn(45)
        steps.now += 86400
        record.note(steps.exchange(11))
        steps.turn(3)
        yield state(record)
        yield f"{record.close(20)} {record.close(20)} {state(record)}"
        yield from (text for text in steps.log if "write(1, 0): None" not in text)
        yield f"{[path.name for path in record.files()]}"
        for path in record.files():
            yield from rows_of(path)


def troubles() -> Iterator[str]:
    """A disk that fails for some time, in each way; the rows that are lost meanwhile."""
    errors: Sequence[tuple[str, Callable[[Path], Exception]]] = (
        ("full", lambda path: OSError(errno.ENOSPC, "x")),
        ("other", lambda path: OSError("something")),
        ("held", lambda path: RecordHeld("in use")),
        ("damaged", lambda path: RecordDamaged("a page", path)),
        ("internal", lambda path: ValueError("a defect")),
    )
    for (name, error), seconds in product(errors, (1.0, 14.0)):
        with stepped(RECORD_BACKLOG=12) as steps:
            yield f"{name} for {seconds} s"
            record = begin(steps)
            record.note(steps.event("profile", "atv71"))
            record.note(steps.exchange(1))
            steps.begun()
            steps.turn()
            steps.fails = partial(failure, steps, error, steps.now + seconds)
            before = ""
            for number in range(60):
                record.note(steps.exchange(number))
                steps.turn()
                if (text := state(record)) != before:
                    steps.say(text)
                before = text
            yield f"{record.close(20)}"
            yield from (text for text in steps.log if "write(1, 0): None" not in text)
            for path in record.files():
                yield from (row for row in rows_of(path) if "lost" in row or "reply" in row)
            yield f"{sorted(path.name for path in steps.folder.iterdir())}"


def failure(
    steps: Steps, error: Callable[[Path], Exception], until: float, file: RecordFile
) -> Exception | None:
    return error(file.path) if steps.now < until else None


def closings() -> Iterator[str]:
    """A recorder that ends while the disk fails, that is off, or that has written nothing."""
    with stepped() as steps:
        record = begin(steps)
        record.note(steps.event("notice", "x"))
        yield f"{record.close()} {state(record)}"
        record.note(steps.exchange(1))
        yield f"{state(record)} {steps.log}"
    with stepped() as steps:
        record = begin(steps)
        record.note(steps.exchange(1))
        steps.begun()
        steps.fails = lambda file: OSError(errno.EROFS, "x")
        steps.turn(2)
        record.note(steps.exchange(2))
        yield f"{record.close(20)} {state(record)} {steps.log}"


def rooms() -> Iterator[str]:
    """Files of several days and lines, of which the oldest rows and files go."""
    for most, opened in ((1_000_000, 0), (700_000, 1)):
        with stepped() as steps, patch.object(record_file, "SHED_AT_A_TIME", 100):
            names = ("line-1", "line-2", "line-1", "line-1", "line-1.damaged-7")
            for day, name in enumerate(names):
                file = RecordFile(record_path(steps.folder, name, DAY - 9 + day), "x", "p")
                for number in range(20):
                    steps.now += 10
                    file.write([record_row(steps, number, at) for at in range(30)], ())
                (file.abandon if opened and day == 1 else file.close)()
            record = begin(steps, most=most)
            record.note(steps.exchange(1))
            steps.begun()
            steps.turn(50)
            yield f"most {most}, open {opened}: {record.close(20)}"
            texts = (re.sub(r"trim\(.*\)", "trim", text) for text in steps.log)
            yield from (f"  {text}" for text in texts if "write" not in text)
            for path in sorted(steps.folder.glob("*.sqlite")):
                with closing(sqlite3.connect(path)) as base:
                    rows = [base.execute(f"SELECT count(*), min(id) FROM {table}").fetchone()
                            for table in ("reply", "reduced")]  # fmt: skip
                yield f"  {path.name} {path.stat().st_size // 50_000 * 50} kB {rows}"


def oldest_first() -> Iterator[str]:
    """Which files go, by their days, sizes, uses and ages."""
    now = MIDNIGHT - 30
    for most in (*range(1800, 200, -200), 100 << 20):
        for own, age, wal in product((0, 1), (10_700.0, 10_900.0), (0, 150)):
            with stepped() as steps:
                paths = [record_path(steps.folder, name, day) for day, name in
                         enumerate(("a", "b", "a", "a.damaged-5", "b"))]  # fmt: skip
                for number, path in enumerate(paths):
                    path.write_bytes(bytes(300 + number))
                    os.utime(path, (now - age, now - age))
                paths[1].with_name(paths[1].name + "-wal").write_bytes(bytes(wal))
                paths[2].with_name(paths[2].name + "-journal").write_bytes(bytes(20))
                Path(steps.folder, "other.txt").write_bytes(bytes(5000))
                excess, closed = make_room(steps.folder, paths[:own], most)
                left = sorted(each.name[8:] for each in steps.folder.iterdir())
                yield f"{most} {own} {age} {wal}: {excess} {closed and closed.name} {left}"


def record_row(steps: Steps, number: int, at: int) -> ReplyRow:
    words = bytes([number, at] * 100)
    return ReplyRow(
        round((steps.now + steps.offset) * 1e6) + at, round(steps.now * 1e6) + at, 9, 4, 3, 100,
        100, 0, words, None, None, 0, "",
    )  # fmt: skip


SECTIONS = (days, troubles, closings, rooms, oldest_first)


@pytest.mark.parametrize("section", SECTIONS, ids=lambda section: section.__name__)
@pytest.mark.internal_errors
def test_recorder_does_what_is_recorded(section: Callable[[], Iterator[str]]) -> None:
    assert "\n".join(section()) == sections(TEXTS)[section.__name__]
