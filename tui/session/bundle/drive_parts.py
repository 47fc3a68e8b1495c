"""Bundle parts about one drive: it is read at the lowest priority, never written."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from dataclasses import replace

from tui.bus.errors import LineError
from tui.drive.settings.parameter_set import ParameterSet, dump_set

from ..counters.watch import CounterWatch
from ..diagnosis.asking import evidence_of_port
from ..diagnosis.diagnosis import Diagnosis, diagnosed
from ..diagnosis.examining import examine_line
from ..drive import DriveSession
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
