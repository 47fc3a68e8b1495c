"""Output about a running motor, as lines or JSON, for a reader that may be slow or have exited."""

from __future__ import annotations

import os
import queue
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING

from tui.session.reading import with_text

from ..shared.drive_commands import complain
from ..shared.drive_status import shown_fields, shown_values
from ..shared.pending_timeouts import timeout_field
from ..shared.say import printable

if TYPE_CHECKING:
    from tui.session.drive import DriveSession
    from tui.session.monitor.snapshot import Snapshot

    from ..documents.drive_documents import PrintedRunEvent

REPORT_INTERVAL = 1.0
"""Seconds between two lines about the motor."""


class RunTelling:
    """Reports on one motor; `say` puts a line out."""

    def __init__(self, session: DriveSession, say: Callable[[str], None], *, as_json: bool) -> None:
        self._session = session
        self._say = say
        self._as_json = as_json
        self._trouble = 0.0
        """When the last cycle failed, time.monotonic()."""
        self._reported = 0.0

    def show(self, latest: Snapshot, left_alone: Callable[[], str]) -> None:
        """A line about the motor once a second; trouble on the line when it begins and ends.

        `left_alone` gives what happens to the motor when polling stops.
        """
        if latest.error:
            if not self._trouble:
                complain(f"{latest.error}\n{left_alone()} It is tried on.")
            self._trouble = latest.time
        elif self._trouble:
            complain("The drive answers again.")
            self._trouble = 0.0
        if latest.time - self._reported < REPORT_INTERVAL * 0.9:
            return
        self._reported = latest.time
        self._print("state", self._state_line(latest), latest)

    def _state_line(self, latest: Snapshot) -> str:
        if latest.error:
            return f"no answer: {latest.error}"
        values = shown_values(self._session.profile, with_text(latest.readings))
        return "  ".join([latest.state.headline, *(f"{k} {v}" for k, v in values.items())])

    def report(self, event: PrintedRunEvent, text: str) -> None:
        """Print one line, or one JSON object a line, about an event."""
        self._print(event, text)

    def warn(self, text: str) -> None:
        """Print it on standard error."""
        complain(text)

    def _print(self, event: PrintedRunEvent, text: str, latest: Snapshot | None = None) -> None:
        from msgspec.structs import replace

        from tui.session.monitor.timeout import timeout_now

        from ..documents.drive_documents import RunDocument
        from ..shared.output import iso_time, json_text

        now = time.time()
        if not self._as_json:
            self._say(f"{time.strftime('%H:%M:%S', time.localtime(now))}  {text}")
            return
        document = RunDocument(
            time=iso_time(now),
            device=self._session.device,
            event=event,
            text=text,
            timeout=timeout_field(timeout_now(self._session)),
        )
        if latest is not None:
            state = latest.state
            document = replace(
                document,
                state=None if latest.error else state.kind,
                direction=None if latest.error else state.direction,
                fault=state.fault.code if state.fault and not latest.error else None,
                values=shown_fields(self._session.profile, with_text(latest.readings)),
                error=latest.error or None,
            )
        self._say(json_text(document))


HEARD_POLL_INTERVAL = 0.05
LINES_WAITING = 64
"""Lines kept for a reader that is slower than they come; older ones are dropped."""
HEARD_OUT = 2.0
"""Seconds that the reader has for the last lines."""


class BufferedOutput:
    """Lines for standard output, in a thread: a reader that takes none must not hold up a stop."""

    def __init__(self, gone: Callable[[], None]) -> None:
        self._gone = gone
        self._lines: queue.Queue[bytes] = queue.Queue(LINES_WAITING)
        self._out = sys.stdout.fileno()
        self._encoding = sys.stdout.encoding or "utf-8"
        threading.Thread(target=self._work, name="output", daemon=True).start()

    def say(self, text: str) -> None:
        """Put a line out as soon as the reader takes it."""
        line = f"{printable(text, self._encoding)}{os.linesep}".encode(self._encoding)
        while True:
            try:
                return self._lines.put_nowait(line)
            except queue.Full:
                with suppress(queue.Empty):
                    self._lines.get_nowait()
                    self._lines.task_done()

    def finish(self) -> None:
        """Give the reader time for the last lines."""
        end = time.monotonic() + HEARD_OUT
        while self._lines.unfinished_tasks and time.monotonic() < end:
            time.sleep(HEARD_POLL_INTERVAL)

    def _work(self) -> None:
        broken = False
        while True:
            line = self._lines.get()
            try:
                # past Python's own buffer: its lock would hold up the end of the process
                while line and not broken:
                    line = line[os.write(self._out, line) :]
            except OSError:
                broken = True
                self._gone()
            finally:
                self._lines.task_done()
