"""Output of monitored traffic: lines of text, or one JSON object a line."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol, TypedDict, overload

from .output import iso_time, plain_number, print_json
from .rows import Column, row_text
from .say import say

if TYPE_CHECKING:
    from tui.drive.read_plan import ReadRequest
    from tui.session.listening.families import AssumedProfile, Families
    from tui.session.listening.listener import DecodedExchange, ReadTally, WriteTally
    from tui.session.listening.summary import DriveSummary, ListeningSummary
    from tui.session.listening.words import ObservedValue, WordSpan

    from ..documents.listening_documents import (
        FeedingField,
        HeardDriveField,
        HeardExchangeDocument,
        HeardReadField,
        HeardSummaryDocument,
        HeardValueField,
        HeardWriteField,
        HowIdentified,
        ShorterField,
    )

FURTHER = 25
"""Indent of continuation lines."""


class ListenOutput(Protocol):
    """Takes exchanges and summaries; `wall` is a time in seconds since 1970."""

    def exchange(self, reported: DecodedExchange, wall: float) -> None:
        """Put one exchange out, at once."""

    def summary(self, summary: ListeningSummary, wall: float) -> None:
        """Put a summary out."""


class ListenNoOutput:
    """Prints nothing: standard output takes the frames."""

    def exchange(self, reported: DecodedExchange, wall: float) -> None:
        """Print nothing."""

    def summary(self, summary: ListeningSummary, wall: float) -> None:
        """Print nothing."""


class ListenTextOutput:
    """Readable text: a line an exchange."""

    def __init__(self, families: Families) -> None:
        self._families = families
        self._taken: dict[int, str] = {}

    def exchange(self, reported: DecodedExchange, wall: float) -> None:
        """Print one exchange, preceded by the assumed profile of its drive if it is new."""
        from tui.session.listening.summary import family_text
        from tui.session.listening.telling import exchange_text

        device = reported.exchange.device
        if reported.family is not None and self._taken.get(device) != reported.family.profile.id:
            self._taken[device] = reported.family.profile.id
            say(f"Device {device}: {family_text(reported.family)}")
        cells = (iso_time(wall)[11:23], exchange_text(reported, self._families))
        say(row_text((Column(), Column()), cells), indent=FURTHER)

    def summary(self, summary: ListeningSummary, wall: float) -> None:
        """Print a summary, apart from the lines around it."""
        from tui.session.listening.summary import summary_lines

        say()
        for line in summary_lines(summary):
            say(line, indent=4 if line.startswith(" ") else 2)
        say()


class ListenJsonOutput:
    """One object a line on standard output."""

    def __init__(self, line_text: str, families: Families) -> None:
        self._line_text = line_text
        self._families = families

    def exchange(self, reported: DecodedExchange, wall: float) -> None:
        """Print one exchange as an object."""
        print_json(exchange_document(self._line_text, reported, self._families, wall), compact=True)

    def summary(self, summary: ListeningSummary, wall: float) -> None:
        """Print a summary as an object."""
        print_json(summary_document(self._line_text, summary, wall), compact=True)


class _FamilyFields(TypedDict):
    """The family of a drive that was heard."""

    profile: str | None
    how: HowIdentified | None
    others: list[str]


class _SpanFields(TypedDict):
    """Words that are read together."""

    function: int
    address: int
    words: int


def exchange_document(
    line_text: str, reported: DecodedExchange, families: Families, wall: float
) -> HeardExchangeDocument:
    """The document of one exchange."""
    from tui.session.listening.summary import exception_meaning
    from tui.session.listening.telling import exchange_text, function_name, requested_names

    from ..documents.listening_documents import HeardExchangeDocument

    exchange, code = reported.exchange, reported.exchange.exception
    return HeardExchangeDocument(
        time=iso_time(wall),
        line=line_text,
        device=exchange.device,
        **_family_fields(reported.family),
        function=exchange.function,
        name=function_name(exchange.function),
        answer=exchange.answer,
        exception=code,
        meaning=None if code is None else exception_meaning(code, reported.profile),
        turnaround_ms=_milliseconds(exchange.turnaround),
        asked=requested_names(reported),
        values={value.code: heard_value_field(value) for value in reported.values},
        request=exchange.request.hex(),
        reply=exchange.reply.hex(),
        text=exchange_text(reported, families).strip(),
    )


def heard_value_field(value: ObservedValue) -> HeardValueField:
    """One value; that of a name or a bit word is its raw number."""
    from ..documents.listening_documents import HeardValueField

    number = value.value.number
    return HeardValueField(
        address=value.address,
        raw=value.raw,
        value=value.raw if number is None else plain_number(number),
        unit=value.value.unit,
        text=value.value.text,
        written=value.written,
    )


def summary_document(
    line_text: str, summary: ListeningSummary, wall: float
) -> HeardSummaryDocument:
    """The document of a summary."""
    from tui.session.listening.summary import summary_lines

    from ..documents.listening_documents import HeardSummaryDocument, NoiseField, SilencesField

    tally = summary.tally
    return HeardSummaryDocument(
        time=iso_time(wall),
        line=line_text,
        seconds=round(summary.seconds, 3),
        exchanges=tally.exchanges,
        frames=tally.frames,
        bytes=tally.bytes,
        load=None if summary.load is None else round(summary.load, 3),
        crossed=tally.crossed,
        noise=NoiseField(places=tally.noises, bytes=tally.noise_bytes),
        silences=SilencesField(
            judged=summary.reports_silences,
            broken_frames=tally.cut,
            longest_ms=_milliseconds(tally.longest_cut) or 0.0,
            too_soon=tally.hasty,
            together=tally.together,
        ),
        drives=[_drive_field(drive) for drive in summary.drives],
        text=summary_lines(summary),
    )


def _drive_field(drive: DriveSummary) -> HeardDriveField:
    from ..documents.listening_documents import HeardDriveField

    tally = drive.tally
    return HeardDriveField(
        device=tally.device,
        **_family_fields(drive.family),
        requests=tally.requests,
        per_second=None if drive.pace is None else round(drive.pace, 3),
        longest_pause=round(tally.longest_gap, 3),
        answered=tally.answered,
        unanswered=tally.answers["none"],
        damaged=tally.answers["damaged"],
        answered_twice=tally.answers["again"],
        exceptions={str(code): times for code, times in sorted(tally.exceptions.items())},
        turnaround_ms=_milliseconds(tally.turnaround),
        commanded=tally.commanded,
        writes={code: _write_field(written) for code, written in tally.writes.items()},
        reads=[_read_field(read) for read in tally.reads.values()],
        timeout=_feeding_field(drive),
        shorter=_shorter_field(drive),
    )


def _family_fields(family: AssumedProfile | None) -> _FamilyFields:
    return {
        "profile": family.profile.id if family is not None else None,
        "how": family.how if family is not None else None,
        "others": list(family.others) if family is not None else [],
    }


def _write_field(tally: WriteTally) -> HeardWriteField:
    from ..documents.listening_documents import HeardWriteField

    return HeardWriteField(
        commands=tally.commands,
        times=tally.times,
        every=None if tally.every is None else round(tally.every, 3),
        raw=tally.raw,
        text=tally.text,
    )


def _read_field(tally: ReadTally) -> HeardReadField:
    from ..documents.listening_documents import HeardReadField

    every = None if tally.every is None else round(tally.every, 3)
    return HeardReadField(**_span_fields(tally.span), times=tally.times, every=every)


def _span_fields(span: WordSpan | ReadRequest) -> _SpanFields:
    return {"function": span.function, "address": span.address, "words": span.count}


def _feeding_field(drive: DriveSummary) -> FeedingField | None:
    from ..documents.listening_documents import FeedingField

    feeding = drive.feeding
    if feeding is None:
        return None
    return FeedingField(
        code=feeding.code,
        seconds=feeding.seconds,
        known=feeding.known,
        begun=feeding.begun,
        longest_pause=round(feeding.longest_pause, 3),
        fed=feeding.fed,
        margin=None if feeding.margin is None else round(feeding.margin, 3),
    )


def _shorter_field(drive: DriveSummary) -> ShorterField | None:
    from ..documents.listening_documents import PlannedReadField, ShorterField

    plan = drive.shorter
    if plan is None:
        return None
    return ShorterField(
        codes=list(plan.codes),
        requests_now=len(plan.now),
        ms_now=_milliseconds(plan.now_seconds),
        requests=[PlannedReadField(**_span_fields(request)) for request in plan.plan.requests],
        ms=_milliseconds(plan.plan.seconds),
    )


@overload
def _milliseconds(seconds: float) -> float: ...
@overload
def _milliseconds(seconds: None) -> None: ...
def _milliseconds(seconds: float | None) -> float | None:
    return None if seconds is None else round(seconds * 1000, 3)
