"""`drivepanel export`: recorded values as CSV, recorded frames as pcapng."""

from __future__ import annotations

import heapq
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from tui.drive.sentences import counted

from ..documents.document import Document, DocumentPart
from ..shared.completion import complete_line_or_code
from ..shared.csv_files import CsvFile
from ..shared.errors import USAGE, Failure, file_failures
from ..shared.line_argument import LineArgument
from ..shared.options import devices_option, json_option
from ..shared.output import both_times, print_json, time_typed
from ..shared.registration import command
from ..shared.rows import Column
from ..shared.say import say
from ..shared.standard_streams import NO_RECORD_FROM_INPUT, STANDARD

if TYPE_CHECKING:
    from tui.session.capture_file import CaptureFile
    from tui.session.record.export_rows import ExportRow
    from tui.session.record.history import History
    from tui.session.record.runs import RecordEvents

FRAMES_SUFFIX = ".pcapng"
_LAST = 4e9
"""A time after all records, in seconds since 1970."""
_SPLITS = {"hour": "%Y-%m-%dT%H", "day": "%Y-%m-%d"}
"""Forms of the local time that names each of several files."""
_WROTE_ROWS = "Wrote 1 row to {file}.", "Wrote {count} rows to {file}."
_WROTE_FRAMES = "Wrote 1 frame to {file}.", "Wrote {count} frames to {file}."


class ExportFileField(DocumentPart):
    """A file that was written; `count` is the number of its rows or frames."""

    file: str
    count: int


class ExportDocument(Document, kw_only=True):
    """`export`: the files, and why values or files of the record are missing."""

    command: Literal["export"] = "export"
    source: str
    files: list[ExportFileField]
    messages: list[str]


@dataclass(slots=True)
class ExportOptions:
    """The export as typed; times in seconds since 1970."""

    source: str
    codes: Sequence[str]
    devices: Sequence[int]
    path: Path
    begin: float
    end: float
    split: str | None
    raw: bool
    force: bool
    files: list[ExportFileField] = field(default_factory=list)
    messages: dict[str, None] = field(default_factory=dict)


@command("Export recorded values as CSV, or frames as pcapng.", group="Watch")
@click.argument("source", metavar="LINE|FILE", cls=LineArgument)
@click.argument("codes", nargs=-1, metavar="[CODE...]", shell_complete=complete_line_or_code)
@devices_option("Export this drive only; repeatable.")
@click.option(
    "--out",
    "path",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Write FILE.csv (- for output) or FILE.pcapng with frames.",
)
@click.option(
    "--from", "begin", callback=time_typed, metavar="TIME", help="Export from this time on."
)
@click.option("--to", "end", callback=time_typed, metavar="TIME", help="Export up to this time.")
@click.option(
    "--split",
    type=click.Choice(list(_SPLITS)),
    help="Write one CSV file for each hour or day.",
)
@click.option("--raw", is_flag=True, help="Write RTU frames with checksum to the pcapng file.")
@click.option("--force", is_flag=True, help="Replace files that exist.")
@json_option
def export(
    source: str,
    codes: tuple[str, ...],
    devices: tuple[int, ...],
    path: Path,
    begin: datetime | None,
    end: datetime | None,
    split: str | None,
    raw: bool,
    force: bool,
    as_json: bool,
) -> None:
    """Export the record of a LINE, or a FILE of `record`, for other programs.

    A CSV file has one row for each cycle of each drive: time in UTC and local time, and the values
    of CODEs in engineering units. An interruption is an empty row. Around a trigger, a column has
    the seconds from it, negative before. Values that are older than an hour are means over up to
    10 s, with minimum and maximum. A pcapng file has the frames of the last hour, and older writes.
    """
    wish = ExportOptions(
        source, codes, devices, path,
        0.0 if begin is None else begin.timestamp(), _LAST if end is None else end.timestamp(),
        split, raw, force,
    )  # fmt: skip
    as_frames = path.suffix.casefold() == FRAMES_SUFFIX
    if wish.begin >= wish.end:
        raise click.UsageError("--from must be before --to.")
    if as_frames and (codes or split):
        raise click.UsageError("CODEs and --split are for CSV files.")
    if path == STANDARD and (split or as_json):
        raise click.UsageError("--split and --json require --out FILE.")
    if raw and not as_frames:
        raise click.UsageError("--raw requires --out FILE.pcapng.")
    record = _recorded(source)
    wish.messages |= dict.fromkeys(record.unread)
    (_export_frames if as_frames else _export_values)(wish, record)
    if as_json:
        files, messages = wish.files, list(wish.messages)
        print_json(ExportDocument(source=source, files=files, messages=messages))
        return
    for text in wish.messages:
        say(f"drivepanel: {text}", err=True)
    for item in wish.files if path != STANDARD else ():
        say(counted(item.count, *(_WROTE_FRAMES if as_frames else _WROTE_ROWS), file=item.file))


def _recorded(source: str) -> RecordEvents:
    """The files of a record, with their events. Raises Failure if there are none."""
    if source == str(STANDARD):
        raise click.UsageError(NO_RECORD_FROM_INPUT)
    from tui.session.connect.recorded_line import record_files
    from tui.session.record.runs import read_events

    found = read_events(record_files(source))
    if not found.files:
        if found.unread:
            raise Failure(f"{source} cannot be exported: {'; '.join(found.unread)}.", USAGE)
        text = f"{source} is not a file, and nothing is recorded of such a line."
        raise Failure(f"{text} Lines with a record are open, or were: drivepanel lines.", USAGE)
    return found


# Frames


def _export_frames(wish: ExportOptions, record: RecordEvents) -> None:
    """Write the frames of all files to one file. Raises Failure."""
    from tui.session.capture_file import CaptureFile

    if next(record.of("parameter"), None) is not None:
        text = "It has values only. Frames are in the record of a line."
        raise Failure(f"{wish.source} has no frames. {text}", USAGE)
    with file_failures(wish.path):
        file = CaptureFile(wish.path, record.line, raw=wish.raw, force=wish.force)
        with closing(file):
            _write_frames(file, wish, record)
    wish.files.append(ExportFileField(file=str(wish.path), count=file.packets))


def _write_frames(file: CaptureFile, wish: ExportOptions, record: RecordEvents) -> None:
    from tui.bus.api import Frame
    from tui.session.record.reader import RecordReader
    from tui.session.record.rebuilt_frames import frames_of
    from tui.session.record.schema import to_microseconds

    times = to_microseconds(wish.begin), to_microseconds(wish.end)
    is_tcp = record.line.startswith("tcp:")
    for path in record.files:
        with closing(RecordReader(path)) as reader:
            for row in reader.all_exchanges(*times):
                if wish.devices and row.device not in wish.devices:
                    continue
                for frame in frames_of(row):
                    if frame.checked:
                        file.add_frame(frame.device, frame.data, frame.wall, request=frame.request)
                    else:
                        file.add_seen(Frame(0.0, "in", frame.data), frame.wall, tcp=is_tcp)


# Values


def _export_values(wish: ExportOptions, record: RecordEvents) -> None:
    """Write the values of all drives to one file, or one for each part of the time."""
    from tui.session.record.export_rows import export_rows

    histories = dict(_histories(wish, record))
    for found in (item for each in histories.values() for item in each.values()):
        wish.messages |= dict.fromkeys(found.troubles)
    if not any(found.points for each in histories.values() for found in each.values()):
        text = f"{wish.source} has no values of these codes in that time."
        raise Failure(" ".join([text, *wish.messages]), USAGE)
    triggers = [event.utc / 1e6 for event in record.of("trigger")]
    table = ValueTable(histories, triggers)
    rows = heapq.merge(
        *(export_rows(device, each) for device, each in histories.items()), key=lambda row: row.time
    )
    table.write(rows, wish)


def _histories(
    wish: ExportOptions, record: RecordEvents
) -> Iterator[tuple[int, dict[str, History]]]:
    """Yield the values of each drive, by code. Raises Failure for a code that no drive has."""
    from tui.drive.errors import DriveError
    from tui.drive.profile import library
    from tui.session.record.history import read_history

    recorded = _recorded_codes(record)
    unknown: dict[str, str] = {}
    known: set[str] = set()
    devices = record.profiles
    for device in wish.devices or sorted(devices):
        if device not in devices:
            raise Failure(f"Nothing of device {device} is in {wish.source}.", USAGE)
        codes = wish.codes or recorded.get(device, ())
        found: dict[str, History] = {}
        for text in codes:
            try:
                code = library.load(devices[device]).find(text).code
            except DriveError as error:
                unknown[text] = str(error)
                continue
            known.add(text)
            found[code] = read_history(record.files, device, code, wish.begin, wish.end)
        yield device, found
    for text in unknown.keys() - known:
        raise Failure(unknown[text], USAGE)
    if not known:
        example = f"drivepanel export {wish.source} CODE CODE --out {wish.path}"
        raise Failure(f"Name the codes to export, for example: {example}", USAGE)


def _recorded_codes(record: RecordEvents) -> Mapping[int, Sequence[str]]:
    """The codes of a file of `record`, by device."""
    found: dict[int, dict[str, None]] = {}
    for event in record.of("parameter"):
        with suppress(ValueError, TypeError, KeyError):
            if event.device is not None:
                found.setdefault(event.device, {})[str(json.loads(event.text)["code"])] = None
    return {device: list(codes) for device, codes in found.items()}


class ValueTable:
    """Columns and cells of the values of all drives."""

    def __init__(
        self, histories: Mapping[int, Mapping[str, History]], triggers: Sequence[float]
    ) -> None:
        self._histories = histories
        self._triggers = triggers
        self._titles: dict[str, bool] = {}
        """Titles of the values, with True if they have columns for minimum and maximum."""
        for each in histories.values():
            for code, found in each.items():
                title = value_title(code, found)
                reduced = any(point.reduced for point in found.points)
                self._titles[title] = self._titles.get(title, False) or reduced

    @property
    def titles(self) -> list[str]:
        """Titles of all columns."""
        head = [
            "time UTC",
            "time local",
            *(["from trigger [s]"] if self._triggers else []),
            "device",
        ]
        values = [
            name
            for title, reduced in self._titles.items()
            for name in (title, *((f"{title} min", f"{title} max") if reduced else ()))
        ]
        return [*head, *values, "quality"]

    def cells(self, row: ExportRow) -> list[str]:
        """The cells of a row, in the order of `titles`."""
        from tui.session.record.export_rows import from_trigger
        from tui.session.record.history import number_text

        texts: dict[str, tuple[str, ...]] = {}
        reasons = (
            [] if row.gap_until is None else [f"no reading for {row.gap_until - row.time:.1f} s"]
        )
        for code, point in row.points.items():
            found = self._histories[row.device][code]
            if point.mean is None:
                reasons.append(f"{code}: {point.quality}")
            if point.least is None or point.most is None:
                continue
            if not point.exact:
                reasons.append(f"{code}: minimum and maximum are limits")
            ends = number_text(found, point.least), number_text(found, point.most)
            mean = "" if point.mean is None else ends[0]
            if point.mean is not None and point.reduced and ends[0] != ends[1]:
                mean = f"{point.mean:.6g}"
            texts[value_title(code, found)] = (mean, *ends)
        after = from_trigger(row.time, self._triggers)
        cells = [*both_times(row.time), *([f"{after:.3f}"] if after is not None else [])]
        cells.append(str(row.device))
        for title, reduced in self._titles.items():
            cells += texts.get(title, ("", "", ""))[: 3 if reduced else 1]
        return [*cells, "; ".join(reasons)]

    def write(self, rows: Iterator[ExportRow], wish: ExportOptions) -> None:
        """Write the rows to the file, or to one for each part of the time. Raises Failure."""
        file: CsvFile | None = None
        try:
            for row in rows:
                path = _path_of(wish, row.time)
                if file is None or file.path != path:
                    if file is not None:
                        self._end(file, wish)
                    file = CsvFile(path, self.titles, force=wish.force)
                file.write(self.cells(row))
        finally:
            if file is not None:
                self._end(file, wish)

    def _end(self, file: CsvFile, wish: ExportOptions) -> None:
        file.close()
        wish.files.append(ExportFileField(file=str(file.path), count=file.rows))


def _path_of(wish: ExportOptions, wall: float) -> Path:
    """The file of a time: one for each part of the local time, if that was typed."""
    if wish.split is None:
        return wish.path
    part = datetime.fromtimestamp(wall).strftime(_SPLITS[wish.split])
    return wish.path.with_stem(f"{wish.path.stem}-{part}")


def value_title(code: str, found: History) -> str:
    """The heading of the values of a code, with unit and scale: `LCR [A, scale 0.1]`."""
    entry = found.entry
    scale = "" if entry is None or entry.scale_source else f"scale {entry.scale}"
    return Column(code, ", ".join(part for part in (found.unit, scale) if part)).title
