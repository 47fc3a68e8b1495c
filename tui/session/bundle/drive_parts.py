"""Bundle parts about drives and the last minutes; read at the lowest priority, never written."""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from datetime import datetime
from functools import partial
from pathlib import Path

import msgspec

from tui.bus.api import Frame
from tui.bus.errors import LineError
from tui.bus.link import TcpLink
from tui.bus.notes import LineNote
from tui.bus.share.beside import line_past
from tui.bus.share.place import is_locked, owner_of
from tui.drive.settings.parameter_set import ParameterSet, dump_set
from tui.drive.small_file import read_small
from tui.wire.capture.forms import READ_RAW

from ..capture_file import CaptureFile
from ..clock import REAL_CLOCK
from ..connect.share_place import share_place
from ..counters.watch import CounterWatch
from ..diagnosis.asking import evidence_of_port
from ..diagnosis.diagnosis import Diagnosis, diagnosed
from ..diagnosis.examining import examine_line
from ..drive import DriveSession
from ..event_notes import EVENTS_OF_LINE, LeftEvent
from ..events import Event
from ..journal import Journal
from ..journal_reading import entries_of
from ..read.upload import Upload
from ..report import report_text
from .parts import Missing, Part, PartFile, in_own_thread
from .subject import NOT_OPEN, BundleSubject

ECHOES = 20
"""Number of frames sent to compare counts, as by `counters`."""
WHY_WITHIN, COUNTERS_WITHIN, READ_WITHIN = 60.0, 30.0, 120.0
"""Limits in seconds for the diagnosis, the counters and the reading of one drive."""
BESIDE_READING = 30.0
"""Additional seconds for the identification of a drive, and for writing the files."""


def drive_parts(subject: BundleSubject, device: int) -> Iterator[Part]:
    """Diagnosis, counters, settings and report of one drive."""
    drive = _Drive(subject, device)
    folder = f"drive-{device}"
    yield Part(
        f"{folder}/why.json",
        f"Drive {device}: does it answer, and if not, why? As `drivepanel why --json`.",
        drive.why,
        limit=WHY_WITHIN,
    )
    yield Part(
        f"{folder}/counters.json",
        f"Drive {device}: frame counts, those of the drive too. As `drivepanel counters --json`.",
        drive.counters,
        limit=COUNTERS_WITHIN,
    )
    yield Part(
        f"{folder}/settings.toml",
        f"Drive {device}: its identity and all parameters. `drivepanel compare` reads it.",
        drive.settings,
        limit=READ_WITHIN + BESIDE_READING,
    )
    yield Part(
        f"{folder}/report.md",
        f"Drive {device}: a report on identity, changed settings, control, faults and trips.",
        drive.report,
    )


class _Drive:
    """Drive of the bundle; its parameters are read once."""

    def __init__(self, subject: BundleSubject, device: int) -> None:
        self._subject = subject
        self._device = device
        self._read: ParameterSet | None = None
        self._withheld = ""
        """Why nothing is sent to the drive: set by the diagnosis before its first request."""

    async def why(self) -> PartFile:
        """Return the diagnosis as a file."""
        subject = self._subject
        found = await self._diagnosis()
        if subject.opened is not None and not found.sight.heard.requested:
            self._withheld = f"Nothing was sent to the drive. {found.text}"
        session = None
        if found.well:
            try:
                session = await subject.session(self._device)
            except Missing:
                session = None
        return PartFile(subject.documents.why(subject.text, self._device, session, found))

    async def _diagnosis(self) -> Diagnosis:
        subject, device = self._subject, self._device
        if subject.link is None:
            raise Missing(f"{NOT_OPEN} {subject.trouble or ''}".strip())
        profile = await in_own_thread(lambda: subject.expected_profile(device))
        if subject.opened is None:
            link, trouble = subject.link, subject.trouble
            seen = await in_own_thread(lambda: evidence_of_port(link, device, trouble))
            return diagnosed(replace(seen, profile=profile))
        known = subject.opened.known
        changed = known.text if known is not None else ""
        return diagnosed(await examine_line(subject.opened.line, device, profile, changed=changed))

    async def _session(self) -> DriveSession:
        if self._withheld:
            raise Missing(self._withheld)
        return await self._subject.session(self._device)

    async def counters(self) -> PartFile:
        """Return the frame counts of the line and of the drive."""
        session = await self._session()
        watch = CounterWatch(session)
        await watch.look()
        answered = await watch.echo(ECHOES)
        await watch.look()
        sent = {"frames": ECHOES, "answered": answered}
        document = self._subject.documents.counters
        return PartFile(document(self._subject.text, session, watch.now(), sent))

    async def settings(self) -> PartFile:
        """Return all parameters; those not read in time are named."""
        session = await self._session()
        upload = Upload(session)
        why = ""
        try:
            async with asyncio.timeout(READ_WITHIN):
                await upload.run()
        except TimeoutError:
            why = f"not read within {READ_WITHIN:g} s"
        except LineError as error:
            why = str(error)
        if not upload.raws:
            raise Missing(why or "The drive has no parameter that can be read.")
        left = upload.left
        values = upload.parameter_set()
        self._read = replace(values, absent={**values.absent, **dict.fromkeys(left, why)})
        note = f"{len(left)} of {len(upload.codes)} parameters are missing: {why}" if left else ""
        text = await in_own_thread(lambda: dump_set(session.profile, self._values))
        return PartFile(text, note)

    @property
    def _values(self) -> ParameterSet:
        if self._read is None:
            raise Missing("The parameters of the drive were not read.")
        return self._read

    async def report(self) -> PartFile:
        """Return the report on the values read."""
        session = await self._session()
        values = self._values

        def text() -> str:
            entries = entries_of(Journal(), session.line_text, self._device)
            return report_text(session.profile, values, entries)

        return PartFile(await in_own_thread(text))


NO_PROCESS = "No process holds the line, so nothing is kept of its past."
NO_PANEL = "Screens are in a bundle only if the panel makes it: Ctrl+P, bundle."
LONGEST_CAPTURE = 64_000_000
CAPTURE_NAME = "line"
"""The name of the interface in a capture: the LINE may contain the name of a host."""

LinePastSeen = tuple[tuple[Frame, ...], tuple[LineNote, ...]]


def past_parts(subject: BundleSubject) -> Iterator[Part]:
    """Yield frames, messages and screens."""
    past = _Past(subject)
    yield Part(
        "frames.pcapng",
        "The last frames of the line, as Modbus/TCP: tshark and Wireshark decode it at once. Each"
        " drive is a server of its own, 192.0.2.N for address N.",
        partial(past.frames_file, raw=False),
        limit=30.0,
    )
    if not isinstance(subject.link, TcpLink):
        yield Part(
            "frames.raw.pcapng",
            "The same frames as RTU, with their checksums and with bytes that form no frame. To"
            f" read it:\n{READ_RAW.replace('FILE', 'frames.raw.pcapng')}",
            partial(past.frames_file, raw=True),
            limit=30.0,
        )
    yield Part(
        "messages.txt", "The messages about the line and its drives, oldest first.", past.messages
    )
    for number, (name, text) in enumerate((subject.screens or {}).items(), start=1):
        yield Part(
            f"screens/{number}-{name}.txt",
            "A screen of the panel, as it was when the bundle was requested.",
            partial(_screen_file, text),
        )
    if not subject.screens:
        yield Part("screens", "The screens of the panel.", partial(_screen_file, ""))


async def _screen_file(text: str) -> PartFile:
    if not text:
        raise Missing(NO_PANEL)
    return PartFile(text)


class _Past:
    """Recent frames and notes of one line, requested once."""

    def __init__(self, subject: BundleSubject) -> None:
        self._subject = subject
        self._seen: LinePastSeen | None = None
        self._before: tuple[Frame, ...] = ()
        """Frames of this program before the bundle: its own requests may displace them."""
        if subject.opened is not None:
            self._before = tuple(subject.opened.line.trace)
        self._note = ""

    async def _past(self) -> LinePastSeen:
        if self._seen is None:
            self._seen = await in_own_thread(self._look)
        return self._seen

    def _look(self) -> LinePastSeen:
        """Return the recent frames and notes from the process that holds the line, else from this
        program."""
        subject = self._subject
        opened = subject.opened
        place = share_place(subject.text) if opened is None or not opened.simulation else None
        owner = owner_of(place) if place is not None else None
        if place is not None and owner is not None and owner.socket and is_locked(place.lock_path):
            try:
                return line_past(owner)
            except OSError as error:
                self._note = f"The process that holds the line was not asked: {error}."
        if opened is None:
            raise Missing(self._note or NO_PROCESS)
        frames = tuple(opened.line.trace)
        older = (frame for frame in self._before if not frames or frame.time < frames[0].time)
        return (*older, *frames), opened.line.facts.notes.all

    async def frames_file(self, *, raw: bool) -> PartFile:
        """Return a capture of the frames."""
        frames, _ = await self._past()
        if not frames:
            raise Missing("No frame was seen on the line.")
        tcp = isinstance(self._subject.link, TcpLink)
        content = await in_own_thread(partial(_captured, frames, raw=raw, tcp=tcp))
        wall = REAL_CLOCK.wall_of(0.0)
        times = [f"{datetime.fromtimestamp(wall + frames[at].time):%H:%M:%S}" for at in (0, -1)]
        note = f"{len(frames)} frames, from {times[0]} to {times[1]}. {self._note}".strip()
        return PartFile(content, note)

    async def messages(self) -> PartFile:
        """Return the messages of the panel, else those that programs have left on the line."""
        events, note = self._subject.events, ""
        if events is None:
            _, notes = await self._past()
            events = sorted(_left_events(notes), key=lambda item: item.wall)
            note = "Those of the last ten minutes: older ones are kept by the panel only."
        first = self._subject.since.timestamp()
        lines = [_event_line(event) for event in events if event.wall >= first]
        return PartFile("\n".join([*(lines or ["No message."]), ""]), note)


def _captured(frames: Sequence[Frame], *, raw: bool, tcp: bool) -> bytes:
    wall = REAL_CLOCK.wall_of(0.0)
    with tempfile.TemporaryDirectory(prefix="drivepanel-") as folder:
        path = Path(folder) / CAPTURE_NAME
        file = CaptureFile(path, CAPTURE_NAME, raw=raw)
        try:
            for frame in frames:
                file.add_seen(frame, wall + frame.time, tcp=tcp)
        finally:
            file.close()
        return read_small(path, LONGEST_CAPTURE)


def _left_events(notes: Sequence[LineNote]) -> Iterator[Event]:
    for note in notes:
        if note.kind == EVENTS_OF_LINE and note.data:
            yield msgspec.msgpack.decode(note.data, type=LeftEvent).event


def _event_line(event: Event) -> str:
    when = datetime.fromtimestamp(event.wall).astimezone()
    drive = "" if event.device is None else f"drive {event.device}: "
    return f"{when:%Y-%m-%d %H:%M:%S %z}  {event.kind:<8} {drive}{event.text}"
