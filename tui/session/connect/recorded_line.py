"""Recording of an open line: its exchanges, its events, and the notes of the programs on it."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from tui.bus.line_events import (
    DevicesStopped,
    LineEvent,
    NoticeReceived,
    ProgramsChanged,
    StateChanged,
    StopDue,
    WriteAbandoned,
)
from tui.bus.link import label
from tui.bus.program import Program
from tui.bus.share.place import file_name_of

from ..event_notes import BLOCK_OF_DRIVE, EVENTS_OF_LINE, PROFILE_OF_DRIVE, LeftEvent
from ..record.recorder import LineRecorder
from ..record.ring import files_of_line, record_folder
from ..record.schema import EventRow, to_microseconds
from .line_key import REPLAY_PREFIX, line_key
from .named_lines import line_settings

if TYPE_CHECKING:
    from tui.bus.api import ModbusLine
    from tui.bus.notes import LineNote

    from ..record.replay_line import ReplayLine

RECORD_SETTING = "DRIVEPANEL_RECORD"
"""Environment variable: `off` or `on`, instead of the settings file."""
_OFF = ("off", "no", "0", "false")
PRIVATE_NAME = "line"
"""Name of the files of a line that is recorded in a folder of its own."""
MOST_NAMES = 1000
"""Programs whose names are kept."""


def recording_is_on() -> bool:
    """True unless the environment or the settings file turns the record off."""
    found = _by_environment()
    return line_settings().record if found is None else found


def _by_environment() -> bool | None:
    setting = os.environ.get(RECORD_SETTING, "").strip().casefold()
    return setting not in _OFF if setting else None


def record_line(line: ModbusLine, name: str) -> LineRecorder | None:
    """Record what this process sends and receives on a line; None if the environment says no.

    `name` is that of the line's files. Nothing is read or written before the first exchange, so a
    client of a keeper records nothing.
    """
    return RecordedEvents(line, name).recorder if may_record() else None


def record_privately(line: ModbusLine, folder: Path) -> LineRecorder:
    """Record a line in a folder of its own, which the caller removes."""
    return RecordedEvents(line, PRIVATE_NAME, folder).recorder


def record_files(source: str) -> list[Path]:
    """Return the files of a record: the one at this path, or those of a line, the oldest first."""
    if (path := Path(source)).is_file():
        return [path]
    return files_of_line(record_folder(), file_name_of(line_key(source)))


def replayed(text: str, *, lead: float = 0.0) -> ReplayLine:
    """Open `replay:FILE,at=TIME`, with a folder of files or a recorded line instead of a file.

    Raises LinkSyntaxError.
    """
    from ..record.replay_text import open_replay, parse_replay

    wanted = parse_replay(text[len(REPLAY_PREFIX) :])
    return open_replay(wanted, record_files(str(wanted.path)), lead=lead)


def may_record() -> bool:
    """True unless the environment turns the record off."""
    return _by_environment() is not False


class RecordedEvents:
    """Passes the events and notes of one line to its recorder, in any thread."""

    def __init__(self, line: ModbusLine, name: str, folder: Path | None = None) -> None:
        self._facts = line.facts
        self._programs: dict[str, Program] = {}
        self._commanders: dict[int, str] = {}
        self._names = {self._facts.me.id: self._facts.me.text}
        """Texts of all programs so far: rows of one that has left may still wait."""
        self.recorder = LineRecorder(
            folder or record_folder(),
            label(line.link),
            name,
            program=self._facts.me.text,
            name_of=self._name_of,
            report=lambda text: self._facts.tell_all(0, text),
            is_on=recording_is_on,
        )
        self._event("line settings", label(line.link))
        self._facts.events.subscribe(self._hear)
        self._facts.notes.heard = self._hear_note
        self._facts.record = self.recorder.note

    def _event(self, kind: str, text: str, device: int | None = None, who: str = "") -> None:
        now = to_microseconds(time.time()), to_microseconds(time.monotonic())
        self.recorder.note(EventRow(*now, device, kind, text, who))

    def _name_of(self, id: str) -> str:
        return self._names.get(id, id)

    def _hear(self, event: LineEvent) -> None:
        match event:
            case StateChanged(state):
                self._event("line", f"{state.status.value} {state.reason}".strip())
            case ProgramsChanged():
                self._compare_programs()
            case DevicesStopped(devices, by, program):
                self._stopped(devices, by, program.text)
            case StopDue(devices, by):
                self._stopped(devices, "a stop whose program has left", by)
            case NoticeReceived(device, text):
                self._event("notice", text, device or None)
            case WriteAbandoned(program, request, _):
                text = f"The program left during a write ({request.pdu().hex(' ')})."
                self._event("abandoned", text, request.device, program.text)

    def _stopped(self, devices: Iterable[int], by: str, who: str) -> None:
        for device in devices:
            self._event("stop", by, device, who)

    def _compare_programs(self) -> None:
        """Record which programs have come and left, and which drives they command."""
        here = {program.id: program for program in self._facts.programs}
        commanders = dict(self._facts.commanders)
        known, held = self._programs, self._commanders
        self._programs, self._commanders = here, commanders
        names = {**self._names, **{id: program.text for id, program in here.items()}}
        self._names = dict(list(names.items())[-MOST_NAMES:])
        for id in here.keys() - known.keys():
            self._event("program", "It has come.", who=here[id].text)
        for id in known.keys() - here.keys():
            self._event("program", "It has left.", who=known[id].text)
        for device in held.keys() | commanders.keys():
            if held.get(device) != commanders.get(device):
                new, old = commanders.get(device), held.get(device)
                text = "It commands the drive." if new else "It no longer commands the drive."
                self._event("commander", text, device, self._name_of(new or old or ""))

    def _hear_note(self, note: LineNote) -> None:
        if note.kind in (PROFILE_OF_DRIVE, BLOCK_OF_DRIVE):
            self._event(note.kind, note.data.decode("utf-8", "replace"), note.device)
        elif note.kind == EVENTS_OF_LINE:
            left = msgspec.msgpack.decode(note.data, type=LeftEvent)
            wall, device, kind, text = left.event
            mono = time.monotonic() - (time.time() - wall)
            at = to_microseconds(wall), to_microseconds(mono)
            self.recorder.note(EventRow(*at, device, kind, text, left.program))
