"""JSON documents of `why`, `counters` and `journal`, for these commands and for a bundle."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Literal, cast

from .output import drive_fields, last_minute_field

if TYPE_CHECKING:
    from tui.bus.api import DeviceCounters
    from tui.session.bundle.subject import DriveDocuments
    from tui.session.changes import ChangeList
    from tui.session.counters.watch import CountersNow
    from tui.session.diagnosis.diagnosis import Diagnosis
    from tui.session.drive import DriveSession

    from ..documents.document import Document, DriveFields
    from ..documents.drive_documents import (
        CertaintyText,
        CountersDocument,
        MeasuredReads,
        WhyDocument,
    )
    from ..documents.journal_documents import JournalDocument
    from ..documents.parts import OurCountersField


def drive_documents() -> DriveDocuments:
    """Return the JSON documents of the commands."""
    from tui.session.bundle.subject import DriveDocuments

    return DriveDocuments(_why, _counters, _journal)


def _why(line: str, device: int, session: DriveSession | None, found: Diagnosis) -> dict[str, Any]:
    fields = drive_fields(line, session) if session is not None else None
    return _as_object(why_document(line, device, fields, found))


def _counters(
    line: str, session: DriveSession, found: CountersNow, sent: Mapping[str, int]
) -> dict[str, Any]:
    fields = drive_fields(line, session)
    return _as_object(
        counters_document(fields, found, sent["frames"], sent["answered"], reset=False)
    )


def _journal(journal: str, found: ChangeList) -> dict[str, Any]:
    return _as_object(changes_document(journal, found))


def _as_object(document: Document) -> dict[str, Any]:
    """A document as a plain object."""
    import msgspec

    found: dict[str, Any] = msgspec.to_builtins(document)
    return found


def why_document(
    line_text: str, device: int, fields: DriveFields | None, found: Diagnosis
) -> WhyDocument:
    """The diagnosis as a document; `fields` are those of a drive with a session."""
    from ..documents.drive_documents import WhyDocument
    from ..documents.parts import HeardField

    sight, heard = found.sight, found.sight.heard
    late, profile = sight.turnaround, sight.profile
    without_session: DriveFields = {
        "line": line_text,
        "device": device,
        "profile": profile.id if profile is not None else None,
        "timeout": None,
    }
    return WhyDocument(
        **(fields or without_session),
        rung=found.rung,
        answers=found.well,
        certainty=cast("CertaintyText", found.certainty),
        others=list(found.others),
        text=found.text,
        next=list(found.steps),
        measured=_measured_reads(found),
        seen=HeardField(
            asked=heard.requested,
            answered=heard.answered,
            late=heard.late,
            echoed=heard.echoed,
            damaged=heard.damaged,
            garbage_bytes=heard.garbage,
            exceptions=list(heard.exceptions),
            functions=list(heard.functions),
            others=list(heard.others),
            framing_errors=sight.errors.framing,
            parity_errors=sight.errors.parity,
            breaks=sight.errors.breaks,
            turnaround_ms=round(late * 1000, 1) if late is not None else None,
            latency_timer_ms=sight.port.latency if sight.port is not None else None,
        ),
    )


def _measured_reads(found: Diagnosis) -> MeasuredReads | None:
    """The counts of the short reads; None where there were none."""
    from ..documents.drive_documents import MeasuredReads

    measure = found.sight.measure
    if measure is None:
        return None
    return MeasuredReads(
        asked=measure.requested,
        answered=measure.answered,
        lost=measure.lost,
        damaged=measure.damaged,
        late=measure.late,
        duplicated=measure.duplicated,
        foreign=measure.foreign,
        unreached=measure.unreached,
        behind=measure.behind,
        second=measure.second + measure.surplus,
        seconds=round(measure.seconds, 2),
        stray=measure.stray,
    )


def counters_document(
    fields: DriveFields, found: CountersNow, frames: int, answered: int, *, reset: bool
) -> CountersDocument:
    """The counts as a document; so many of the sent `frames` were answered."""
    from ..documents.drive_documents import CountersDocument
    from ..documents.parts import (
        CountingTestField,
        DifferenceField,
        DriveCountersField,
        LastMinutesField,
        LoadField,
    )

    return CountersDocument(
        **fields,
        counted_by=found.counted_by or None,
        seconds=round(found.seconds, 3),
        ours=_ours_field(found.since),
        since_opened=_ours_field(found.total),
        last_minute=LastMinutesField(
            line=last_minute_field(found.line_minute, found.line_minute.share),
            device=last_minute_field(found.total.minute, found.total.minute.whole_share),
        ),
        load=LoadField(line=found.line_load, device=found.device_load),
        drive=[
            DriveCountersField(
                name=name,
                frames=comparison.last.frames,
                checksum_errors=comparison.last.damaged,
                saturated=comparison.last.saturated,
                frames_since=comparison.frames,
                checksum_errors_since=comparison.damaged,
                counts_this_line=comparison.counts_this_line,
            )
            for name, comparison in found.drive
        ],
        differences=[
            DifferenceField(kind=item.kind, count=item.count, text=item.text)
            for item in found.differences
        ],
        agree=False if found.differences else True if found.compared else None,
        trouble=found.trouble or None,
        test=CountingTestField(frames=frames, answered=answered),
        reset=reset,
    )


def _ours_field(ours: DeviceCounters) -> OurCountersField:
    from tui.session.counters.compare import bars

    from ..documents.parts import OurCountersField, TurnaroundField

    return OurCountersField(
        frames=ours.requests,
        replies=ours.replies,
        timeouts=ours.timeouts,
        checksum=ours.checksum,
        wrong=ours.wrong,
        repeats=ours.repeats,
        exceptions={str(code): count for code, count in sorted(ours.exceptions.items())},
        bytes_out=ours.bytes_out,
        bytes_in=ours.bytes_in,
        busy_seconds=round(ours.busy_seconds, 4),
        turnarounds=[
            TurnaroundField(up_to_ms=bar.up_to_ms, count=bar.count)
            for bar in bars(ours.turnarounds)
        ],
    )


def changes_document(journal: str, found: ChangeList) -> JournalDocument:
    """Changes as a document; times are local, to the millisecond. `journal` is its file."""
    from dataclasses import asdict

    from tui.session.journal import entry_time

    from ..documents.journal_documents import (
        DamagedLineField,
        JournalDocument,
        JournalEntryField,
        LostLinkField,
        RunField,
        TripField,
    )

    return JournalDocument(
        journal=journal,
        entries=[JournalEntryField(**asdict(entry)) for entry in found.entries],
        damaged=[
            DamagedLineField(file=str(line.file), line=line.number, text=line.text)
            for line in found.damaged
        ],
        trips=[
            TripField(
                line=item.line,
                device=item.device,
                code=item.trip.code,
                name=item.trip.name,
                seen=item.trip.seen,
                tripped=item.trip.tripped or None,
                reset=item.trip.reset or None,
            )
            for item in found.trips
        ],
        runs=[
            RunField(
                line=item.line,
                device=run.device,
                profile=run.profile,
                begun=entry_time(run.begun),
                ended=entry_time(run.ended),
                begin_seen=run.begin_within is not None,
                end_seen=run.end_within is not None,
                within=round(max(run.begin_within or 0.0, run.end_within or 0.0), 3),
                direction=cast(Literal["forward", "reverse"] | None, run.direction or None),
                reference=run.reference or None,
                least=run.least or None,
                most=run.most or None,
                who=run.who or None,
            )
            for item in found.runs
            for run in (item.run,)
        ],
        lost=[
            LostLinkField(
                line=item.line,
                device=loss.device,
                begun=entry_time(loss.begun),
                ended=None if loss.ended is None else entry_time(loss.ended),
                reason=loss.reason,
            )
            for item in found.losses
            for loss in (item.loss,)
        ],
        unread=found.unread,
    )
